"""Fits of which nothing but the base bends: the same numbers as any fit has."""

from dataclasses import replace

import numpy as np
import pytest
from test_cross_validation import noisy

from hdopt.diagnosis.inference.catalogue import properties_of
from hdopt.diagnosis.inference.descent import FitPoint, refine
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.linear_terms import LinearTermsFit
from hdopt.diagnosis.inference.noise import Noise, weights_with_a_past
from hdopt.effects.declared import Shaft
from hdopt.effects.met import Pulse, Spline, Waves
from hdopt.effects.term import Term
from hdopt.kinematics.cartesian import MOST_WAVES, PARAMETERS, CartesianModel
from hdopt.study import load_study

SIGMA = 0.02
LINEAR = {
    "none": (),
    "columns": ("columns",),
    "waves of both splines": ("fs", "cs"),
    "waves of one spline twice": ("cs", "columns", "other cs"),
    "zones": ("zones",),
    "all": ("zones", "cs", "columns", "fs", "other zones"),
}


@pytest.fixture(scope="module")
def base():
    return CartesianModel.of(load_study(drive="csf-25-80").drive)


def problem_of(base, ar=()):
    rng = np.random.default_rng(3)
    rows = noisy(6)
    rows = replace(rows, weight=rng.uniform(0.5, 2.0, len(rows)))
    nuisance = np.column_stack([np.ones(len(rows)), np.linspace(-1, 1, len(rows))])
    return FitProblem(rows, base, nuisance, Noise(np.array(ar), SIGMA, weights_with_a_past(rows, len(ar))))


def terms_of(rows, kinds):
    rng, n = np.random.default_rng(4), len(rows)
    there = {
        "columns": Term("output_coupling", {}, columns=rng.normal(size=(n, 2))),
        "cs": Term("cs_tooth_harmonics", {}, met=Waves(Spline.CIRCULAR, (2, 3, 7))),
        "other cs": Term("circular_spline_lobing", {}, met=Waves(Spline.CIRCULAR, (4, 8))),
        "fs": Term("fs_tooth_harmonics", {}, met=Waves(Spline.FLEX, (5, 2))),
        "zones": Term("bearing_pass", {}, zones=rng.normal(size=(2, n, 3))),
        "other zones": Term("bearing_pass", {}, zones=rng.normal(size=(2, n, 1))),
    }
    return tuple(there[kind] for kind in kinds)


def fit_of(problem, terms):
    rng = np.random.default_rng(5)
    per = [1e-3 if term.in_zones else 0.05 for term in terms]
    coefficients = [size * rng.normal(size=term.width) for size, term in zip(per, terms, strict=True)]
    errors = 0.3 * problem.prior * rng.normal(size=PARAMETERS)
    return evaluate(problem, errors, np.array([0.02, -0.01]), terms, coefficients)


def order_of(fit):
    """Where each parameter of `Fit.design` stands among those of `LinearTermsFit`."""
    first = PARAMETERS + fit.problem.nuisance.shape[1]
    places = LinearTermsFit.of(fit, True).prepared.places
    return np.r_[np.arange(first), *(np.arange(place.start, place.stop) for place in places)].astype(int)


@pytest.mark.parametrize("ar", [(), (0.5, 0.2)])
@pytest.mark.parametrize("kinds", LINEAR.values(), ids=LINEAR)
def test_it_has_the_numbers_of_any_fit(base, kinds, ar):
    """Objective, normal equations and a step from there. Faults caught: a wave in another's place, a spline's waves met
    where the other's are, a zone's columns where the other drives, no weights, a column whitened twice, a prior left
    out, coefficients handed back in the order of the parameters."""
    problem = problem_of(base, ar)
    fit = fit_of(problem, terms_of(problem.rows, kinds))
    quick, order = LinearTermsFit.of(fit, True), order_of(fit)
    assert quick.objective == pytest.approx(fit.objective, rel=1e-11)
    gram, moment = fit.normal_equations()
    gram_quick, moment_quick = quick.normal_equations()
    scale = np.sqrt(np.diag(gram))
    size = np.linalg.norm(problem.noise.whiten(fit.residual))
    np.testing.assert_allclose(
        gram_quick[np.ix_(order, order)] / np.outer(scale, scale), gram / np.outer(scale, scale), atol=1e-11
    )
    np.testing.assert_allclose(moment_quick[order] / scale / size, moment / scale / size, atol=1e-11)
    step = 0.1 * np.random.default_rng(6).normal(size=len(moment)) * np.r_[problem.prior, np.ones(len(moment) - 12)]
    step[0] = 10.0  # far out of its box
    quick_step = np.empty_like(step)
    quick_step[order] = step
    there, quick_there = FitPoint(fit, True).moved(step).fit, quick.moved(quick_step)
    assert quick_there.objective == pytest.approx(there.objective, rel=1e-11)
    back = quick_there.fit
    np.testing.assert_allclose(back.prediction, there.prediction, atol=1e-11)
    for one, other in zip(back.coefficients, there.coefficients, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12)


def test_a_descent_comes_to_the_same_end(base, monkeypatch):
    """Step by step as `Fit` goes: faults caught are those of a point that is moved or asked out of turn, such as a
    design that another point has written since."""
    problem = problem_of(base)
    fit = fit_of(problem, terms_of(problem.rows, LINEAR["all"]))
    quick = refine(fit, 6, 0.0)
    with monkeypatch.context() as patched:
        patched.setattr(LinearTermsFit, "of", lambda fit, move_shapes: None)
        slow = refine(fit, 6, 0.0)
    assert quick.objective < 0.9 * fit.objective
    assert quick.objective == pytest.approx(slow.objective, rel=1e-8)


def test_what_bends_besides_is_no_such_fit(base):
    """Shapes that move, columns that the drive's motion makes, an input encoder that reads ahead, a pulse met where the
    zone is, more waves than are worth going through, a gear without a base: faults caught are each of them left out.
    """
    problem = problem_of(base)
    rows = replace(problem.rows, time=0.001 * np.arange(len(problem.rows)), speed=np.full(len(problem.rows), 10.0))
    problem = replace(problem, rows=rows)
    (columns,) = terms_of(rows, ("columns",))
    motion = base.evaluate_at(problem.rotation, problem.prior)[0]
    swings = {"frequency_hz": 20.0, "damping_ratio": 0.05}
    eccentric = {"shaft": Shaft.INPUT, "orders": (1,)}
    bent = {
        "shape": replace(columns, shape={"phase": 1.0}, steps={"phase": 0.1}),
        "driven": replace(properties_of("resonance").term(rows, swings, motion), steps={}),
        "reads the input": properties_of("encoder_input_eccentricity").term(rows, eccentric),
        "pulse": Term("local_tooth_defect", {}, met=Pulse(Spline.CIRCULAR, 1.0, 0.05)),
        "many waves": Term("cs_tooth_harmonics", {}, met=Waves(Spline.CIRCULAR, (2, MOST_WAVES + 1))),
    }
    taken = {name: LinearTermsFit.of(fit_of(problem, (columns, term)), True) for name, term in bent.items()}
    assert [name for name, fit in taken.items() if fit is not None] == []
    held = fit_of(problem, (columns, bent["shape"]))
    assert LinearTermsFit.of(held, False) is not None
    without = replace(problem, base=None)
    assert LinearTermsFit.of(evaluate(without, np.zeros(0), np.zeros(2), (), ()), True) is None
