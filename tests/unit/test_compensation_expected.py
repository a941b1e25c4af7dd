"""The peak-to-peak to expect: closer than one recording's own extremes, and never drawn where tails are heavy."""

import numpy as np
import pytest

from hdopt.compensation.expected import NORMAL, peak_to_peak_again

TURNS, ROWS = 60, 100
BLOCK = np.repeat(np.arange(TURNS), ROWS)
ANGLE = np.arange(TURNS * ROWS) * 2 * np.pi / ROWS


def wave(rng):
    """A beat 1.5 high that comes again, and normal noise of 1."""
    return 1.5 * np.sin(2 * ANGLE) * np.cos(ANGLE / TURNS) + rng.normal(size=len(ANGLE))


def coloured(rng):
    """Noise that hangs together over three rows or so."""
    return np.convolve(rng.normal(size=len(ANGLE) + 8), 0.7 ** np.arange(9), "valid")


def pulses(rng):
    """Narrow pulses that come again, six noises high: their height is known from what was seen, not from moments."""
    return rng.normal(size=len(ANGLE)) + 6 * np.exp(-0.5 * ((ANGLE % (2 * np.pi) - 2) / 0.1) ** 2)


@pytest.mark.parametrize("make", [wave, coloured])
def test_what_is_expected_is_closer_than_one_recordings_extremes(make):
    """Extremes of 6000 normal values vary by 5 to 6 % of their mean, twice that in square for two recordings; what is
    expected may be off by half as much as one recording's, and has no bias."""
    rng = np.random.default_rng(5)
    seen = [make(rng) for _ in range(40)]
    mean = np.mean([np.ptp(make(rng)) for _ in range(200)])
    told = np.array([peak_to_peak_again(one, BLOCK, rng)[0] for one in seen]) / mean - 1
    own = np.array([np.ptp(one) for one in seen]) / mean - 1
    assert np.std(told) < 0.7 * np.std(own)
    assert abs(np.mean(told)) < 0.03


def test_pulses_are_not_drawn_away():
    rng = np.random.default_rng(6)
    one = pulses(rng)
    assert peak_to_peak_again(one, BLOCK, rng)[0] == np.ptp(one)


@pytest.mark.parametrize("make", [wave, pulses])
def test_a_fresh_recording_lies_within_the_interval_as_often_as_it_should(make):
    """19 of 20; of 80 at least 68 (one in 2000 would have fewer)."""
    rng = np.random.default_rng(7)
    told = [peak_to_peak_again(make(rng), BLOCK, rng) for _ in range(80)]
    assert sum(abs(np.ptp(make(rng)) - value) < NORMAL * spread for value, spread in told) >= 68


def test_a_few_rows_are_enough():
    value, spread = peak_to_peak_again(np.array([0.0, 1.0, 0.5]), np.array([0, 0, 1]), np.random.default_rng(1))
    assert value == 1.0
    assert spread >= 0
