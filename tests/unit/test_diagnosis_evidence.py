"""The numbers that carry a verdict do what their names say: held-out turns, family-wise chance, placebo, robust
covariance, seed, penalty."""

from dataclasses import replace
from math import log

import numpy as np
import pandas as pd
import pytest

from hdopt.diagnosis.checks.assessment import best_placebo, placebo_error
from hdopt.diagnosis.inference.cross_validation import held_out, turn_folds
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.search.penalty import Scale, penalty
from hdopt.diagnosis.settings import DEFAULT
from hdopt.diagnosis.stages import begin, fit_base_in_noise
from hdopt.effects.term import Term
from hdopt.recordings.read import recording_from_table

TURN = 2 * np.pi
RATIO, TURNS, RATE, NOISE = 50.0, 40, 48, 0.02
THETA = np.arange(TURNS * RATE) * TURN / RATE


def record(error, seed=0):
    """A recording without a drive model: `error` (arcmin) over 40 input turns."""
    error = error + np.random.default_rng(seed).normal(0, NOISE, len(THETA))
    table = {
        "time_s": 0.01 * np.arange(len(THETA)),
        "input_angle_deg": np.degrees(THETA),
        "output_angle_deg": np.degrees(THETA / RATIO - error * np.pi / 10800),
    }
    return recording_from_table(pd.DataFrame(table), RATIO, name="record")


def state(error, seed=1):
    return fit_base_in_noise(begin([record(error)], None, seed, DEFAULT))


@pytest.fixture(scope="module")
def clean():
    return state(np.zeros_like(THETA)).base


def wave(fit, order, effect="output_coupling"):
    theta = fit.problem.rows.theta
    return Term(effect, {}, columns=np.column_stack([np.sin(order * theta), np.cos(order * theta)]))


def leaving(fit, residual):
    """`fit` as it would stand had it left `residual` (arcmin)."""
    return replace(fit, prediction=fit.problem.rows.error - residual)


def test_rows_that_are_held_out_take_no_part_in_the_fit(clean):
    """Against the fit made by hand on the other rows; what happens only in the held-out turns is never learnt."""
    groups = clean.problem.rows.block % 5
    only_there = np.where(groups == 2, np.random.default_rng(4).normal(size=len(groups)), 0.0)[:, None]
    plain = held_out(clean, None, groups)
    beside = held_out(clean, only_there, groups)
    assert beside.plain.sum() == pytest.approx(plain.plain.sum(), rel=1e-3)

    spike = leaving(clean, clean.residual + 0.5 * only_there[:, 0])
    told = held_out(spike, only_there, groups)
    expected = spike.residual[groups == 2] @ spike.residual[groups == 2]
    turns = np.unique(clean.problem.rows.block[groups == 2])
    # The fitted zero and drift take up a few hundredths of a row's worth; the spike itself must stay.
    assert told.plain[turns].sum() == pytest.approx(expected, rel=0.05)


def test_a_fold_is_predicted_by_the_fit_to_the_other_turns(clean):
    """One column, by hand: its coefficient from the rows outside the fold, its square errors inside."""
    groups = clean.problem.rows.block % 2
    order = np.sin(2.2 * clean.problem.rows.theta)
    column = np.where(groups == 0, order, 3.0 * order)[:, None]
    fit = leaving(clean, 0.2 * order)
    told = held_out(fit, column, groups)
    # From fold 0 the column's coefficient is 0.2, so 0.6 is said of fold 1 where 0.2 stands; from fold 1 a third of it.
    turns = np.arange(int(clean.problem.rows.block[-1]) + 1) % 2
    for fold, left in ((0, 0.2 - 0.2 / 3), (1, 0.2 - 0.6)):
        rms = np.sqrt(told.plain[turns == fold].sum() / told.rows[turns == fold].sum())
        assert rms == pytest.approx(abs(left) / np.sqrt(2), rel=0.05)


def test_folds_follow_the_seed_and_keep_turns_whole(clean):
    one, again, other = (turn_folds(clean, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert np.array_equal(one, again) and not np.array_equal(one, other)
    block = clean.problem.rows.block
    assert all(len(set(one[block == turn])) == 1 for turn in np.unique(block))


def test_the_seed_of_a_diagnosis_reaches_its_draws():
    first, second = (state(np.zeros_like(THETA), seed).draws().random(4) for seed in (1, 2))
    assert not np.array_equal(first, second)
    assert np.array_equal(first, state(np.zeros_like(THETA), 1).draws().random(4))


def test_significance_is_strict():
    """Above a hundredth, one recording in a hundred with nothing in it would be named, and it is not to be."""
    assert 0 < DEFAULT.verdict.significance <= 0.01


def test_every_freedom_and_every_effect_is_paid_for():
    """Schwarz 1978: half the logarithm of the rows a coefficient; what was searched, its logarithm."""
    columns = np.zeros((4, 2))
    term, wider = Term("hysteresis", {}, columns=columns), Term("hysteresis", {}, columns=np.zeros((4, 3)))
    scale, more_rows = Scale(1000.0), Scale(8000.0)
    one = penalty([term], 0.0, scale)
    assert one == pytest.approx(log(1000.0) + DEFAULT.penalty.effect_cost)
    assert penalty([wider], 0.0, scale) - one == pytest.approx(log(1000.0) / 2)
    assert penalty([term], 0.0, more_rows) - one == pytest.approx(log(8.0))
    assert penalty([replace(term, trials=50)], 0.0, scale) - one == pytest.approx(log(50.0))
    assert penalty([], 0.0, scale) == 0.0


def test_the_placebo_is_fitted():
    """The best term that was not named lowers the held-out error as far as it can: here all of a wave. What was named
    is no placebo."""
    hidden = state(0.3 * np.sin(7.3 * THETA + 0.5))
    base = hidden.base
    folds = turn_folds(base, np.random.default_rng(0))
    without = held_out(base, None, folds)
    pool = [wave(base, 7.3), wave(base, 4.1, "bearing_pass")]
    probe = FitProbe(base)
    placebo = best_placebo(probe, pool, base)
    assert placebo is pool[0]
    assert placebo_error(probe, placebo, folds).rms < 0.3 * without.rms
    assert best_placebo(probe, [], base) is None
    assert best_placebo(probe, pool, replace(base, terms=(pool[0],))) is pool[1]


def test_covariance_grows_with_noise_that_the_model_misses(clean):
    """White noise: the model-based errors hold. Noise that comes turn by turn: sqrt(rows a turn) times larger."""
    honest = np.sqrt(np.diag(clean.covariance()))
    block = clean.problem.rows.block
    steps = np.random.default_rng(8).normal(0, NOISE, block[-1] + 1)[block]
    rough = leaving(clean, steps)
    grown = np.sqrt(np.diag(rough.covariance()))
    assert grown[0] / honest[0] > 0.5 * np.sqrt(RATE)


def test_an_interval_holds_though_few_turns_are_independent(clean):
    """The mean of noise that comes turn by turn, over 40 turns of which 8 before and behind count with each: within
    1.96 standard deviations in 95 of 100 samples (0.95 of 400 is known to 0.011). Would catch standard deviations as if
    they were known exactly, which hold 0.87.
    """
    block, rng = clean.problem.rows.block, np.random.default_rng(9)
    assert clean.problem.nuisance.shape[1] == 1
    held = []
    for _ in range(400):
        steps = rng.normal(0, NOISE, block[-1] + 1)
        error = steps[block].mean()
        sigma = np.sqrt(leaving(clean, steps[block] - error).covariance()[0, 0])
        held.append(abs(error) < 1.96 * sigma)
    assert np.mean(held) > 0.95 - 3 * 0.011
