"""Held-out errors and paired t against what is computed by hand."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from hdopt.diagnosis.inference.cross_validation import held_out, paired_chance, paired_t
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.settings import DEFAULT
from hdopt.kinematics.cartesian import CartesianModel
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather
from hdopt.study import load_study

TURN, RATE = 2 * np.pi, 48


def rows_of(error, ratio=80.0):
    theta = np.arange(len(error)) * TURN / RATE
    table = {
        "time_s": 0.01 * np.arange(len(error)),
        "input_angle_deg": np.degrees(theta),
        "output_angle_deg": np.degrees(theta / ratio - error * np.pi / 10800),
    }
    return gather([recording_from_table(pd.DataFrame(table), ratio, name="record")])


def noisy(turns, sigma=0.02):
    return rows_of(np.random.default_rng(3).normal(0, sigma, turns * RATE))


def without_base(rows, sigma=0.02):
    return evaluate(FitProblem(rows, None, np.ones((len(rows), 1)), Noise.white(rows, sigma)), [], np.zeros(1), (), ())


def test_held_out_errors_are_those_of_the_penalised_fit_to_the_other_rows():
    """Least squares with the prior and the small ridge as rows of their own. Faults caught: the prior's pull or its
    scale lost, held-out rows left in, whitened errors that are not counted in the noise's standard deviation.
    """
    base = CartesianModel.of(load_study(drive="csf-25-80").drive)
    rows = noisy(12, sigma=0.2)
    sigma, prior_scale = 0.2, 0.02
    problem = FitProblem(rows, base, np.ones((len(rows), 1)), Noise.white(rows, sigma), prior_scale)
    fit = evaluate(problem, 1.5 * problem.prior, np.array([0.1]), (), ())
    extra = np.column_stack([np.sin(3.3 * rows.theta), np.cos(3.3 * rows.theta)])
    groups = rows.block % 3
    found = held_out(fit, extra, groups)

    design, target = np.column_stack([fit.design(), extra]), fit.residual
    ridge = np.diag(np.sqrt(DEFAULT.held_out.ridge * (design**2).sum(0)))
    pulled = np.column_stack([np.diag(sigma / problem.prior), np.zeros((12, design.shape[1] - 12))])
    expected = np.empty(len(rows))
    for group in range(3):
        inside = groups == group
        stacked = np.vstack([design[~inside], pulled, ridge])
        wanted = np.r_[target[~inside], -sigma / problem.prior * fit.errors, np.zeros(design.shape[1])]
        step = np.linalg.lstsq(stacked, wanted, rcond=None)[0]
        expected[inside] = target[inside] - design[inside] @ step
    assert found.plain == pytest.approx(np.bincount(rows.block, expected**2), rel=1e-9)
    assert found.white == pytest.approx(found.plain / sigma**2, rel=1e-9)


def test_paired_t_is_the_text_books():
    rng = np.random.default_rng(1)
    worse, better = rng.normal(1.0, 1.0, 25), rng.normal(0.6, 1.0, 25)
    assert paired_t(worse, better) == pytest.approx(stats.ttest_rel(worse, better).statistic, rel=1e-12)
    assert paired_t(worse[:2], better[:2]) == 0.0
    assert paired_t(worse, worse) == 0.0


def test_the_chance_is_students():
    rng = np.random.default_rng(8)
    worse, better = rng.normal(0.5, 1, 40), rng.normal(0, 1, 40)
    expected = stats.ttest_rel(worse, better, alternative="greater").pvalue
    assert paired_chance(worse, better) == pytest.approx(expected, rel=1e-12)
    assert paired_chance(better, worse) == 1.0
