"""The joint fit and its covariance: prior, box, zones, degrees of freedom, wander."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_cross_validation import RATE, noisy, rows_of, without_base

from hdopt.diagnosis.inference import fit as fits
from hdopt.diagnosis.inference.catalogue import properties_of
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import FitProblem, evaluate, term_columns
from hdopt.diagnosis.inference.noise import Noise, weights_with_a_past
from hdopt.diagnosis.inference.normal_equations import bordered
from hdopt.effects.met import Spline, ToothForms
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


SWINGS = {"frequency_hz": 20.0, "damping_ratio": 0.05}


@pytest.mark.parametrize(
    ("beside", "shape", "ar", "by_groups"),
    [
        ("_varying_contact", {"waves": 2.0}, (), True),
        ("_varying_contact", {"waves": 2.0}, (0.5, 0.2), False),
        ("resonance", SWINGS, (), False),
    ],
)
def test_heights_of_teeth_have_the_products_of_their_columns(base, monkeypatch, beside, shape, ar, by_groups):
    """The design written out and multiplied, against sums over the rows of each tooth: where a contact varies, and not
    where noise or a swing reaches from row to row. Faults caught: heights as the drive has them and not as its output
    shows them, no weights, a tooth's rows known apart where the filter mixes them."""
    rng = np.random.default_rng(5)
    rows = noisy(6)
    rows = replace(rows, time=0.001 * np.arange(len(rows)), speed=np.full(len(rows), 10.0))
    rows = replace(rows, weight=rng.uniform(0.5, 2.0, len(rows)))
    problem = problem_of(rows, base, Noise(np.array(ar), SIGMA, weights_with_a_past(rows, len(ar))))
    errors = 0.3 * problem.prior * rng.normal(size=PARAMETERS)
    motion = base.evaluate_at(problem.rotation, errors)[0]
    driven = properties_of(beside).term(rows, shape, motion)
    teeth = Term("tooth_mesh", {}, met=ToothForms(Spline.CIRCULAR, rng.normal(size=(162, 7)), 0.2, 0.3))
    coefficients = [0.1 * rng.normal(size=driven.width), 1e-3 * rng.normal(size=teeth.width)]
    fit = evaluate(problem, errors, np.array([0.01]), [driven, teeth], coefficients)
    grouped = []
    monkeypatch.setattr(fits, "bordered", lambda *given: grouped.append(1) or bordered(*given))
    gram, moment = fit.normal_equations()
    white = problem.noise.whiten(fit.design())
    scale = np.sqrt(np.diag(white.T @ white))
    np.testing.assert_allclose(gram / np.outer(scale, scale), white.T @ white / np.outer(scale, scale), atol=1e-12)
    expected = white.T @ problem.noise.whiten(fit.residual)
    size = np.linalg.norm(problem.noise.whiten(fit.residual))
    np.testing.assert_allclose(moment / scale / size, expected / scale / size, atol=1e-12)
    assert bool(grouped) == by_groups


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
