"""What a compensation says of long recordings is of samples as recorded, however many of them make a row of the fit."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather, row_of_each_sample
from hdopt.workflow import compensate as module
from hdopt.workflow.compensate import compensation_of
from hdopt.workflow.compensation_samples import samples_of
from hdopt.workflow.compensation_speeds import own_of_each_speed
from hdopt.workflow.compensation_trials import neighbours_of

RATIO, TURN, NOISE = 80.0, 2 * np.pi, 0.01


def wave(theta):
    """0.3 arcmin twice an input turn, 0.1 once an output turn."""
    return 0.3 * np.sin(2 * theta) + 0.1 * np.cos(theta / RATIO)


def recorded(samples, seed, back=False, error=wave, speed=1.0, gap=None):
    """Two output turns (there and back one each) in so many samples, at a `speed` in units of 60 r/min, without the
    samples of `gap`."""
    one = np.linspace(0, TURN * (80 if back else 160), samples // (2 if back else 1), endpoint=False)
    theta = np.r_[one, one[::-1]] if back else one
    way = np.r_[np.ones(len(one)), -np.ones(len(theta) - len(one))]
    noisy = error(theta) + 0.05 * way + np.random.default_rng(seed).normal(0, NOISE, len(theta))
    table = pd.DataFrame(
        {
            "time_s": np.arange(len(theta)) * 160 / samples / speed,
            "input_angle_deg": np.degrees(theta),
            "output_angle_deg": np.degrees(theta) / RATIO - noisy / 60,
        }
    )
    return recording_from_table(table if gap is None else table.drop(index=list(gap)), RATIO, name=f"{seed}")


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize("samples", [8_000, 32_000, 64_000])
def test_what_is_expected_does_not_fall_with_the_rows(samples, back):
    """Of one recording and of two, on a fresh recording as a controller meets it, sample by sample. Would catch a
    prediction, or a held-out peak-to-peak, of means: of 64,000 samples they were 0.6 of what was found, of two such
    recordings a half."""
    runs = [recorded(samples, seed, back) for seed in range(5)]
    made = [compensation_of(some, None, 64, 1) for some in (runs[:1], runs[:2])]
    left = [np.ptp(_left(made[0].found, fresh)) for fresh in runs[2:]]
    assert (neighbours_of(runs[:2]) > 1) == (samples > 8_000)
    for one in made:
        assert one.worth
        assert one.low < np.mean(left) < one.high
        assert one.predicted == pytest.approx(np.mean(left), rel=0.08)
        assert one.after == pytest.approx(np.mean(left), rel=0.2)
        assert one.before == pytest.approx(np.ptp(runs[0].error_arcmin), rel=0.1)
        assert one.scores[one.method] == pytest.approx(NOISE, rel=0.1)
        for way in one.ways.values():
            assert way.expected == pytest.approx(np.mean(left), rel=0.1)


def _left(found, fresh):
    way = np.sign(np.gradient(fresh.input_angle))
    return fresh.error_arcmin - found.at(fresh.input_angle, fresh.input_angle / RATIO, way)


@pytest.mark.parametrize("neighbours", [1, 3, 4])
def test_every_sample_knows_its_row(neighbours):
    """Reversals and gaps cut rows short. Would catch samples that are counted into a neighbouring row, or numbered anew
    wrongly where some rows are left out."""
    runs = [recorded(997, 1, True), recorded(1003, 2, gap=range(101, 240))]
    rows = gather(runs, neighbours)
    samples = samples_of(runs, rows, neighbours)
    assert len(samples.each) == len(samples.row) == sum(map(len, runs))
    np.testing.assert_allclose(samples.means(samples.each.error), rows.error, atol=1e-12)
    np.testing.assert_allclose(samples.means(samples.each.theta), rows.theta, atol=1e-9)
    for name in ("record", "direction", "block", "piece", "speed"):
        np.testing.assert_array_equal(getattr(samples.each, name), getattr(rows, name)[samples.row])
    np.testing.assert_array_equal(samples.row, row_of_each_sample(runs, neighbours))
    some = (rows.record == 1) & (np.arange(len(rows)) % 3 > 0)
    part = samples.of_rows(some)
    np.testing.assert_allclose(part.means(part.each.error), rows.error[some], atol=1e-12)
    assert set(part.each.record) == {0}


@pytest.mark.parametrize(("peak", "worth"), [(1.1, True), (4.0, False)])
def test_the_chance_of_one_sample_does_not_refuse_a_file(monkeypatch, peak, worth):
    """Every sample at half its error, but one beyond the largest there was, and the mean of its row below or beyond.
    Would catch a decision by the extremes of samples, which of a noisy recording are chance."""
    run = recorded(64_000, 1)

    def one_peak(_split, _terms, _paths, _fit, samples):
        left = 0.5 * (samples.each.error - samples.each.error.mean())
        left[1001] = peak * float(np.ptp(samples.each.error)) + left.min()
        return {"harmonics": left}

    monkeypatch.setattr(module, "tried", one_peak)
    made = compensation_of([run], None, 64, 1)
    assert neighbours_of([run]) >= 3 and made.after > made.before
    assert made.worth is worth


def test_a_speeds_own_terms_leave_what_samples_scatter_by():
    """A wave of one of two speeds, in rows of four samples. Would catch an own term judged on the rows' means, or
    subtracted from the wrong samples."""
    slow = recorded(32_000, 1, error=lambda theta: 0 * theta)
    fast = recorded(32_000, 2, error=lambda theta: 0.2 * np.sin(3 * theta), speed=2.0)
    rows = gather([slow, fast], 4)
    samples = samples_of([slow, fast], rows, 4)
    left = samples.each.error - samples.each.error.mean()
    own, again = own_of_each_speed(rows, samples, left, 16)
    assert [len(own[speed]) > 0 for speed in sorted(own)] == [False, True]
    assert np.std(again[samples.each.record == 1]) == pytest.approx(NOISE, rel=0.03)
    np.testing.assert_array_equal(again[samples.each.record == 0], left[samples.each.record == 0])


def test_a_speed_is_that_of_the_rows():
    """Would catch a lag subtracted with each sample's own speed, which an encoder's steps and a clock's jitter make."""
    run = recorded(32_000, 1)
    assert run.time is not None
    jittered = replace(run, time=run.time + np.random.default_rng(2).normal(0, 2e-4, len(run)))
    rows = gather([jittered], 4)
    speed = samples_of([jittered], rows, 4).each.speed
    assert np.std(speed) < 0.5 * np.std(gather([jittered]).speed)
