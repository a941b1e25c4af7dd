"""The joint fit and its covariance: prior, box, zones, degrees of freedom, wander."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_cross_validation import RATE, noisy, rows_of, without_base

from hdopt.diagnosis.inference.fit import FitProblem, evaluate, refine, term_columns
from hdopt.diagnosis.inference.noise import Noise
from hdopt.effects.term import Term
from hdopt.kinematics.cartesian import PARAMETERS, CartesianModel
from hdopt.study import load_study

SIGMA = 0.02


@pytest.fixture(scope="module")
def base():
    return CartesianModel.of(load_study(drive="csf-25-80").drive)


def problem_of(rows, base, noise=None):
    return FitProblem(rows, base, np.ones((len(rows), 1)), noise or Noise.white(rows, SIGMA))


def test_the_objective_holds_the_prior(base):
    """(e/s)^2 in the noise's variance beside the squares of the rows: a Gaussian prior of standard deviation s."""
    problem = problem_of(noisy(4), base)
    errors = np.linspace(0.2, 1.3, PARAMETERS) * problem.prior
    fit = evaluate(problem, errors, np.zeros(1), (), ())
    squares = fit.residual @ fit.residual
    assert fit.objective == pytest.approx(squares + SIGMA**2 * np.sum(np.linspace(0.2, 1.3, 12) ** 2), rel=1e-12)


def test_rows_without_weight_leave_the_prior_alone(base):
    """The base goes to no errors, and is known as well as the prior has it: nothing was measured."""
    rows = noisy(4)
    nothing = replace(Noise.white(rows, SIGMA), root_weight=np.zeros(len(rows)))
    problem = problem_of(rows, base, nothing)
    fit = refine(evaluate(problem, 0.8 * problem.prior, np.zeros(1), (), ()))
    assert np.abs(fit.errors / problem.prior).max() < 1e-3
    assert np.sqrt(np.diag(fit.covariance())[:PARAMETERS]) == pytest.approx(problem.prior, rel=1e-6)


def test_the_base_stays_in_its_box(base):
    """Data of a drive twice as bad as the box allows."""
    problem = problem_of(noisy(6), base)
    far = base.evaluate(problem.rows.theta, 2 * problem.box)[0]
    fit = refine(evaluate(problem_of(rows_of(far), base), 0.9 * problem.box, np.zeros(1), (), ()))
    assert np.all(np.abs(fit.errors) <= problem.box)
    assert np.any(np.abs(fit.errors) == problem.box)


def test_a_term_in_the_zones_shows_in_the_zone_that_drives(base):
    first, second = np.arange(6.0)[:, None], 10 + np.arange(6.0)[:, None]
    term = Term("cs_tooth_harmonics", {}, zones=np.stack([first, second]))
    fit = SimpleNamespace(problem=SimpleNamespace(base=base), zone=np.array([0, 1, 1, 0, 1, 0]))
    shown = term_columns(term, fit)[:, 0] / base.arcmin_per_mm
    assert shown == pytest.approx([0, 11, 12, 3, 14, 5])


def test_covariance_is_that_of_ordinary_least_squares():
    """s^2 (X'X)^-1, s^2 of n - q degrees of freedom (any text on regression), where all rows are one turn, so that the
    sandwich has nothing to add."""
    rows = noisy(2)
    rows = replace(rows, block=np.zeros_like(rows.block))
    columns = np.random.default_rng(2).normal(size=(len(rows), 12))
    problem = FitProblem(rows, None, columns, Noise.white(rows, 0.5))
    fit = refine(evaluate(problem, np.zeros(0), np.zeros(12), (), ()))
    variance = fit.residual @ fit.residual / (len(rows) - 12)
    assert fit.covariance() == pytest.approx(variance * np.linalg.inv(columns.T @ columns), rel=1e-6)


def spread_of_the_zero(turns_alike, seed):
    """The standard error of a zero under noise that stays for so many turns, with the turns' size that it has."""
    turns = 80
    noise = np.random.default_rng(seed).normal(size=turns // turns_alike).repeat(turns_alike * RATE)
    fit = without_base(rows_of(noise + 1e-3 * np.random.default_rng(seed).normal(size=len(noise))))
    fit = refine(fit)
    return np.sqrt(fit.covariance()[0, 0]) / np.std(noise)


def test_noise_that_outlasts_a_turn_widens_the_intervals():
    """The mean of 80 turns of which four at a time are alike is known half as well as of 80 that are not; Bartlett's
    weights over 10 lags see 1.85 of that 2 (sum of (1 - l/11) (1 - l/4))."""
    alike, alone = (np.mean([spread_of_the_zero(n, seed) for seed in range(12)]) for n in (4, 1))
    assert 1.5 < alike / alone < 2.2
    assert alone == pytest.approx(1 / np.sqrt(80), rel=0.15)
