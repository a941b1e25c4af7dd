"""Figures of an acceptance sheet on cells that are written down: each with the case that would bend it."""

from __future__ import annotations

from dataclasses import replace
from math import pi, radians, sqrt

import numpy as np
import pytest

from hdopt.recordings import figures
from hdopt.recordings.capability import gauge, outliers, performance
from hdopt.recordings.decision import decide, parse_limits
from hdopt.recordings.figures import Cells
from hdopt.recordings.recording import Recording

TURN, RATE = 2 * pi, 720
PER_TURN = figures.CELLS_PER_TURN
WIDTH = TURN / PER_TURN


def recorded(error, theta, **more):
    return Recording("record", 80.0, theta, np.broadcast_to(error, theta.shape).astype(float), **more)


def ramp(turns=3, rate=RATE):
    return (np.arange(turns * rate) + 0.5) * TURN / rate


def cells(error, place=None, direction=1.0, index=0, sigma=0.01):
    """Cells of one pass, `error` (n,) at these `place`s, each sampled in its middle."""
    error = np.asarray(error, float)
    place = np.arange(len(error)) if place is None else np.asarray(place)
    one = np.ones(len(error))
    return Cells((place + 0.5) * WIDTH, error, sigma * one, direction * one, index * one.astype(int), place, WIDTH, 0.0)


def joined(*parts):
    """Passes of one recording, in this order."""
    names = ("angle", "error", "sigma", "direction", "pass_index", "place")
    return replace(parts[0], **{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


def test_cells_are_two_degrees_wide_and_as_certain_as_their_samples():
    """720 samples a turn are four a cell: the scatter of single samples and the encoder's step, q/sqrt 12, add as
    squares, and a mean of four has half of both together."""
    found = figures.cells_of(recorded(1.0, ramp(), quantum_arcmin=0.12))
    assert found.width == pytest.approx(radians(2))
    assert found.sigma == pytest.approx(0.12 / sqrt(12) / 2)
    noise = np.random.default_rng(0).normal(0, 0.02, 30 * RATE)
    both = figures.cells_of(recorded(noise, ramp(30), quantum_arcmin=0.12))
    assert np.median(both.sigma) == pytest.approx(sqrt(0.02**2 + 0.12**2 / 12) / 2, rel=0.02)


def test_no_cell_reaches_over_a_reversal():
    """Half an arcmin between the directions: where it turns, two cells stand at one place."""
    theta = np.r_[ramp(), ramp()[::-1]]
    way = np.repeat([0.25, -0.25], 3 * RATE)
    found = figures.cells_of(recorded(way, theta))
    np.testing.assert_allclose(np.abs(found.error), 0.25, atol=1e-12)


def test_the_larger_direction_counts():
    small, large = 0.3 * np.sin(np.arange(180)), 0.5 * np.sin(np.arange(180))
    for pair in ((small, large), (large, small)):
        found = joined(cells(pair[0]), cells(pair[1] + 3.0, direction=-1.0, index=1))
        assert figures.directional_peak_to_peak(found) == pytest.approx(np.ptp(large))


def test_return_error_is_usual_and_largest_at_the_middles_of_its_cells():
    """Half an arcmin of play, and two more over a tenth of the turn: they make no usual play."""
    more = np.where(np.arange(180) < 18, -2.5, 0.5)
    found = joined(cells(np.sin(np.arange(180)) + more), cells(np.sin(np.arange(180)), direction=-1.0, index=1))
    back = figures.return_error(found)
    assert (back.median, back.largest) == (pytest.approx(0.5), pytest.approx(-2.5))
    assert back.sigma == pytest.approx(0.01 * sqrt(2))
    assert back.angle[0] == pytest.approx(WIDTH / 2)
    np.testing.assert_allclose(back.curve, more)


def test_repeatability_is_of_one_direction_over_whole_turns_whatever_the_zero():
    """Two passes there that differ by a wave of 0.2: half the square of that. A zero set anew, another curve on the
    way back and a pass over part of a turn change nothing."""
    place = np.arange(180)
    wave, back = np.sin(place / 7), np.cos(place / 5)
    off = 0.2 * np.cos(2 * np.pi * place / 180)
    twice = joined(cells(wave), cells(wave + off + 5.0, index=2))
    expected = sqrt(np.mean(off**2) / 2)
    assert figures.repeatability([twice]) == pytest.approx(expected)
    both = joined(twice, cells(back, direction=-1.0, index=1), cells(back, direction=-1.0, index=3))
    assert figures.repeatability([both]) == pytest.approx(expected / sqrt(2))
    part = cells(wave[:90] + 9 * np.sin(place[:90]), place[:90], index=4)
    assert figures.repeatability([joined(twice, part)]) == pytest.approx(expected)
    assert figures.repeatability([joined(cells(wave), part)]) is None


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_slope_is_that_of_ten_degrees_rising_or_falling(way):
    """A line of 0.1 arcmin/deg over 12 deg between flat parts; its doubt is that of a line through cells 2 deg apart
    within the window: sigma over the root of their squares about the middle, 16 + 4 + 0 + 4 + 16."""
    error = way * 0.1 * np.clip(2.0 * (np.arange(180) - 60), 0, 12)
    slope, doubt = figures.steepest_slope(cells(error))
    assert slope == pytest.approx(0.1, rel=1e-6)
    assert doubt == pytest.approx(0.01 / sqrt(40), rel=1e-6)


def test_no_slope_is_taken_over_a_gap():
    place = np.r_[0:60, 90:180]
    assert figures.steepest_slope(cells(np.where(place < 60, 0.0, 1.0), place))[0] == pytest.approx(0.0, abs=1e-12)


def slipped(size=0.5, slope=0.02, at=80):
    return slope * np.arange(180) + size * (np.arange(180) > at)


def test_a_slip_is_as_high_as_the_lines_on_both_sides_are_apart():
    ((place, size),) = figures.slips(cells(slipped()), 0.0)
    assert place == pytest.approx(80.5 * WIDTH)
    assert size == pytest.approx(0.5)


def test_a_spike_or_a_step_of_the_encoder_is_no_slip():
    spike = 0.5 * (np.arange(180) == 80)
    assert figures.slips(cells(spike), 0.0) == []
    assert figures.slips(cells(slipped(0.2)), 0.15) == []
    assert len(figures.slips(cells(slipped(0.2)), 0.09)) == 1


def late(delay, speeds, turns, wave=0.0, noise=0.0):
    """A recording whose output is late by `delay` (s): passes at these speeds (rad/s), over so many `turns` each."""
    theta, time, error = [0.0], [0.0], [0.0]
    for speed, count in zip(speeds, turns, strict=True):
        n = round(count * TURN / abs(speed) / 0.002)
        step = np.arange(1, n + 1)
        theta = np.r_[theta, theta[-1] + speed * 0.002 * step]
        time = np.r_[time, time[-1] + 0.002 * step]
        error = np.r_[error, np.full(n, delay * speed / 80 * 10800 / pi + 0.3 * np.sign(speed))]
    scatter = np.random.default_rng(3).normal(0, max(noise, 1e-15), len(speeds))
    error = error + scatter[np.r_[0, np.repeat(np.arange(len(speeds)), np.diff(np.r_[1, _ends(speeds, turns)]))]]
    return recorded(error + wave * np.sin(theta + 0.3), np.asarray(theta), time=np.asarray(time))


def _ends(speeds, turns):
    counts = [round(count * TURN / abs(speed) / 0.002) for speed, count in zip(speeds, turns, strict=True)]
    return 1 + np.cumsum(counts)


SPEEDS = (5.0, -5.0, 2.0, -2.0, 8.0, -8.0)


def test_a_delay_is_told_by_whole_turns_of_several_speeds():
    """An eccentricity of 3 arcmin has no mean over whole turns; over 2.3 of them it has. At one speed a delay cannot
    be told from play."""
    found, _ = figures.skew_s(late(0.004, SPEEDS, (2.3, 2.6, 2.4, 2.7, 2.2, 2.45), wave=3.0))
    # The last whole turn ends within a sample, of which the wave has 3 arcmin over a thousandth of a turn.
    assert found == pytest.approx(0.004, abs=2e-4)
    assert figures.skew_s(late(0.004, (5.0, -5.0, 5.0, -5.0), (2,) * 4)) is None


def test_the_doubt_of_a_delay_is_as_large_as_its_scatter():
    """By the normal equations of delay, zero and play over the six passes, at hand."""
    made = late(0.004, SPEEDS, (2,) * 6, noise=0.05)
    _, doubt = figures.skew_s(made)
    scatter = np.random.default_rng(3).normal(0, 0.05, 6)
    design = np.column_stack([np.array(SPEEDS) * 10800 / pi / 80, np.ones(6), np.sign(SPEEDS)])
    left = scatter - design @ np.linalg.lstsq(design, scatter, rcond=None)[0]
    expected = sqrt(left @ left / 3 * np.linalg.inv(design.T @ design)[0, 0])
    assert doubt == pytest.approx(expected, rel=0.02)


def test_the_guard_band_is_that_of_ninety_five_per_cent():
    """1.645 standard uncertainties on one side; a value at its very edge keeps the limit."""
    assert decide("rms", 1.0 - 1.66 * 0.1, 0.1, 1.0).verdict == "met"
    assert decide("rms", 1.0 - 1.63 * 0.1, 0.1, 1.0).verdict == "not decidable"
    assert decide("rms", 1.0 + 1.66 * 0.1, 0.1, 1.0).verdict == "missed"
    assert decide("rms", 1.0, 0.0, 1.0).verdict == "met"


def test_limits_are_kept_in_arcmin_and_slopes_by_degree():
    found = parse_limits("peak_to_peak=0.02deg,rms=30arcsec,slope=3arcsec/deg")
    assert found == pytest.approx({"peak_to_peak": 1.2, "rms": 0.5, "slope": 0.05})


def test_an_interval_of_performance_is_the_bootstraps():
    """2000 log-normal samples of eight, of the same seed: their 2.5 and 97.5 per cent; seven drives say nothing."""
    values = np.exp(np.array([0.3, -0.2, 0.1, 0.0, 0.5, -0.4, 0.2, -0.1]) * 0.2)
    found = performance(values, 2.0)
    mean, spread = np.log(values).mean(), np.log(values).std(ddof=1)
    draws = np.random.default_rng(1).normal(mean, spread, (2000, 8))
    middle, out = draws.mean(1), draws.std(1, ddof=1)
    each = (2.0 - np.exp(middle)) / (np.exp(middle + 3 * out) - np.exp(middle))
    assert (found.low, found.high) == pytest.approx(tuple(np.quantile(each, [0.025, 0.975])))
    assert performance(values[:7], 2.0) is None


def test_outliers_are_told_by_the_logarithm_from_the_median():
    """Scores of 3.4 and 3.6 median deviations over 0.6745, on either side of a skewed lot."""
    unit = 0.1 / 0.6745
    usual = [-0.1, 0.0, 0.1] * 5
    for score, told in ((3.4, []), (3.6, [15])):
        for side in (1, -1):
            assert outliers(np.exp([*usual, side * score * unit])) == told
    assert outliers([1.0, 1.0, 1.0, 2.0]) == []


def test_mountings_of_unequal_size_weigh_by_theirs():
    """One-way analysis of variance by hand: within 2 degrees of freedom fewer than readings, n0 = (n - sum n_i^2/n)/(k
    - 1); both together as squares."""
    groups = [np.array([1.0, 1.2]), np.array([2.0, 2.1, 1.9, 2.2, 2.3, 1.8, 2.05]), np.array([1.5, 1.4])]
    n = sum(map(len, groups))
    within = sum(((g - g.mean()) ** 2).sum() for g in groups) / (n - 3)
    mean = np.concatenate(groups).mean()
    between = sum(len(g) * (g.mean() - mean) ** 2 for g in groups) / 2
    usual = (n - sum(len(g) ** 2 for g in groups) / n) / 2
    labels = [name for name, g in zip("abc", groups, strict=True) for _ in g]
    found = gauge(np.concatenate(groups), labels)
    assert found.repeatability == pytest.approx(sqrt(within))
    assert found.reproducibility == pytest.approx(sqrt((between - within) / usual))
    assert found.total == pytest.approx(sqrt(within + (between - within) / usual))
