"""Repeated passes of the same angles: what comes again is no noise."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from test_cross_validation import without_base

from hdopt.diagnosis import diagnose
from hdopt.diagnosis.checks.repeated_passes import NOTHING_REPEATED, pairs_at_same_angle, repeated_passes
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather

TURN, RATE, TURNS, STROKES = 2 * np.pi, 60, 6, 6
THETA = np.concatenate([np.arange(TURNS * RATE)[:: 1 if one % 2 else -1] for one in range(STROKES)]) * TURN / RATE
LAWLESS = np.random.default_rng(0).normal(size=TURNS * RATE)
"""Something that no law of order, wave or defect holds, but that stays where it is."""


def table(error, theta=THETA, ratio=80.0):
    return pd.DataFrame(
        {
            "time_s": 0.01 * np.arange(len(theta)),
            "input_angle_deg": np.degrees(theta),
            "output_angle_deg": np.degrees(theta / ratio - error * np.pi / 10800),
        }
    )


def fit_of(error, theta=THETA, ratio=80.0):
    return without_base(gather([recording_from_table(table(error, theta, ratio), ratio, name="record")]))


def noise(sigma, seed=1, size=len(THETA)):
    return np.random.default_rng(seed).normal(0, sigma, size)


def stays(size):
    return size * LAWLESS[np.round(THETA * RATE / TURN).astype(int)]


def test_what_stays_where_it_is_and_what_does_not_are_told_apart():
    """0.05 arcmin come again, 0.03 do not; each turn's mean is lost of sixty rows. Fault caught: rows of one pass set
    against their own neighbours, of which nothing comes again.
    """
    found = repeated_passes(fit_of(stays(0.05) + noise(0.03)))
    assert found.repeated == pytest.approx(0.05, rel=0.1)
    assert found.scatter == pytest.approx(0.03, rel=0.1)
    assert found.left == pytest.approx(np.hypot(0.05, 0.03), rel=0.05)
    assert found.t > 6


@pytest.mark.parametrize("colour", [0.0, 0.8])
def test_noise_does_not_come_again(colour):
    """Whatever its colour: the passes are far apart in time."""
    t = []
    for seed in range(12):
        white = noise(0.03, seed)
        red = np.empty_like(white)
        last = 0.0
        for i, step in enumerate(white):
            last = red[i] = colour * last + step
        t.append(repeated_passes(fit_of(red)).t)
    assert np.max(t) < 4.0 and abs(np.mean(t)) < 1.0


def test_a_wander_over_many_turns_does_not_look_like_something_that_comes_again():
    wander = 0.2 + 0.05 * np.sin(TURN * np.arange(len(THETA)) / len(THETA) * 1.3 + 0.4)
    assert repeated_passes(fit_of(wander + noise(0.03))).t < 4.0


def test_directions_are_not_compared():
    """A loop that differs between the directions and nothing else: the same in every pass of one direction."""
    way = np.sign(np.gradient(THETA))
    found = repeated_passes(fit_of(0.05 * way * stays(1.0) + noise(0.02)))
    assert found.repeated == pytest.approx(0.05, rel=0.15)


@pytest.mark.parametrize(("ratio", "some"), [(5.0, True), (5.5, False)])
def test_a_whole_output_turn_brings_the_same_teeth_together(ratio, some):
    """One way over three output turns of a gear of 5; with 5.5 the same teeth meet at other input angles."""
    theta = np.arange(15 * RATE) * TURN / RATE
    one, other = pairs_at_same_angle(fit_of(noise(0.03, size=len(theta)), theta, ratio).problem.rows)
    assert bool(len(one)) == some
    apart = np.abs(theta[other] - theta[one]) / (ratio * TURN)
    assert np.abs(apart - np.round(apart)).max(initial=0.0) < 1e-6
    assert np.round(apart).min(initial=1.0) >= 1


def test_one_pass_shows_nothing():
    theta = np.arange(20 * RATE) * TURN / RATE
    assert repeated_passes(fit_of(noise(0.03, size=len(theta)), theta)) == NOTHING_REPEATED


def test_rows_that_lie_close_in_one_pass_are_not_repeated():
    """A slow start puts rows of one and the same pass nearer to each other than half the usual step."""
    steps = np.r_[np.full(5 * RATE, 0.1), np.full(15 * RATE, 1.0)] * TURN / RATE
    theta = np.cumsum(steps)
    one, _ = pairs_at_same_angle(fit_of(noise(0.03, size=len(theta)), theta).problem.rows)
    assert len(one) == 0


def test_few_repeated_turns_show_nothing():
    short = THETA[: int(1.5 * TURNS * RATE)]
    assert repeated_passes(fit_of(noise(0.03, size=len(short)), short)) == NOTHING_REPEATED


@pytest.mark.slow
def test_what_comes_again_and_nothing_explains_is_unknown_and_located():
    """A gear without a model whose every angle has an error of its own, five times the noise."""
    record = recording_from_table(table(stays(0.1) + noise(0.02)), 80.0, name="record")
    said = diagnose([record], ratio=80.0)
    assert (said.verdict, said.effects) == ("unknown", ())
    assert said.where["domain"] == "angle"
    assert said.where["rms_arcmin"] == pytest.approx(0.1, rel=0.15)
    quiet = diagnose([replace(record, error_arcmin=noise(0.02))], ratio=80.0)
    assert quiet.verdict == "adequate"
