"""Fits of which nothing but the base bends: the same numbers as any fit has."""

from dataclasses import replace

import numpy as np
import pytest
from test_cross_validation import noisy

from hdopt.diagnosis.inference import descent
from hdopt.diagnosis.inference.catalogue import properties_of
from hdopt.diagnosis.inference.compiled_descent import _moving_columns, _reading_columns, _solve, descended
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.linear_terms import LinearTermsFit
from hdopt.diagnosis.inference.noise import Noise, weights_with_a_past
from hdopt.effects.declared import Shaft
from hdopt.effects.met import Pulse, Spline, Waves
from hdopt.effects.term import Term
from hdopt.kinematics.cartesian import MOST_WAVES, PARAMETERS, CartesianModel
from hdopt.study import load_study

SIGMA = 0.02
# Sums in another order: 1e-11 of a parameter after one step, 4e-13 of an objective after twelve.
ROUNDING = 1e-10
LINEAR = {
    "none": (),
    "columns": ("columns",),
    "waves of both splines": ("fs", "cs"),
    "waves of one spline twice": ("cs", "columns", "other cs"),
    "zones": ("zones",),
    "all": ("zones", "cs", "columns", "fs", "other zones"),
}


@pytest.fixture(scope="module", params=["no teeth measured", "measured teeth"])
def base(request):
    base = CartesianModel.of(load_study(drive="csf-25-80").drive)
    if request.param == "no teeth measured":
        return base
    rng = np.random.default_rng(2)
    return replace(base, cs_table=1e-3 * rng.normal(size=162), fs_table=1e-3 * rng.normal(size=160))


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


def with_a_reading(problem, kinds):
    """A fit of terms of these `kinds` beside an eccentric input encoder and the lines of another that reads it."""
    eccentric = properties_of("encoder_input_eccentricity").term(problem.rows, {"shaft": Shaft.INPUT, "orders": (1,)})
    lines = {"shaft": Shaft.INPUT, "lines": 9, "cycles": (1,)}
    uneven = properties_of("encoder_interpolation").term(problem.rows, lines)
    others = terms_of(problem.rows, kinds)
    return fit_of(problem, (eccentric, *others, uneven))


@pytest.mark.parametrize("ar", [(), (0.5, 0.2)])
@pytest.mark.parametrize("kinds", LINEAR.values(), ids=LINEAR)
def test_where_the_input_is_read_wrong_it_has_the_numbers_too(kinds, ar):
    """The objective, and the end of a way down. Any fit takes its slope over the angle from differences over 2e-3 rad,
    which are off where the zone changes: of these 288 rows the ways end within 5 % of each other. Faults caught: a
    drive at the angle that was read, or ahead of it twice; the flexspline's teeth turned as far as the input; a reading
    that is no part of the record."""
    problem = problem_of(CartesianModel.of(load_study(drive="csf-25-80").drive), ar)
    fit = with_a_reading(problem, kinds)
    quick = LinearTermsFit.of(fit, True)
    _, objective = descended(quick.base, quick.problem, quick.start, quick.effort(0, 0.0))
    assert objective == pytest.approx(fit.objective, rel=1e-11)
    end, slow = refine(fit, 30, 1e-9), slowly(fit, 30, 1e-9)
    assert end.objective < 0.9 * fit.objective
    assert end.objective == pytest.approx(slow.objective, rel=0.05)


@pytest.mark.parametrize("kinds", LINEAR.values(), ids=LINEAR)
def test_columns_of_a_reading_are_those_of_any_fit(kinds):
    """On all rows but those where the zone or the rim changes. Faults caught: a column without the drive's slope; a
    slope without the waves, with those of the other spline's speed, or of a wave's own order left out."""
    problem = problem_of(CartesianModel.of(load_study(drive="csf-25-80").drive))
    fit = with_a_reading(problem, kinds)
    quick = LinearTermsFit.of(fit, True)
    n, waves = len(problem.rows), quick.problem.waves
    columns = np.zeros((quick.offsets.start, n))
    columns[:PARAMETERS] = fit.base_jacobian.T
    _moving_columns.py_func(quick.problem, problem.base.arcmin_per_mm, fit.zone, columns)
    _reading_columns.py_func(quick.problem, quick.start, columns)
    for i in (0, len(fit.terms) - 1):
        off = np.abs(columns[quick.places[i]].T - fit.columns_of(fit.terms[i])).max(axis=1)
        assert np.mean(off < 1e-6) > 0.98
    assert len(waves) == 0 or np.std(columns[PARAMETERS : PARAMETERS + 2 * len(waves)]) > 0


def slowly(fit, iterations, tolerance):
    """`refine` as any other fit goes."""
    return descent._descended(fit, iterations, tolerance, True)


@pytest.mark.parametrize("ar", [(), (0.5, 0.2)])
@pytest.mark.parametrize("kinds", LINEAR.values(), ids=LINEAR)
def test_it_has_the_numbers_of_any_fit(base, kinds, ar):
    """Objective, and a step from there. Faults caught: a wave in another's place, a spline's waves met where the
    other's are, a zone's columns where the other drives, no weights, a column whitened twice, a prior left out,
    coefficients handed back in the order of the parameters."""
    problem = problem_of(base, ar)
    fit = fit_of(problem, terms_of(problem.rows, kinds))
    quick = LinearTermsFit.of(fit, True)
    here, objective = descended(quick.base, quick.problem, quick.start, quick.effort(0, 0.0))
    assert objective == pytest.approx(fit.objective, rel=1e-11)
    np.testing.assert_array_equal(here, quick.start)
    step, expected = refine(fit, 1, 0.0), slowly(fit, 1, 0.0)
    assert expected.objective < 0.95 * fit.objective
    assert step.objective == pytest.approx(expected.objective, rel=ROUNDING)
    np.testing.assert_allclose(step.errors, expected.errors, atol=ROUNDING * problem.prior.max())
    np.testing.assert_allclose(step.offsets, expected.offsets, atol=ROUNDING)
    for one, other in zip(step.coefficients, expected.coefficients, strict=True):
        np.testing.assert_allclose(one, other, atol=ROUNDING * np.abs(other).max())


@pytest.mark.parametrize("tolerance", [0.0, 1e-2, 0.3])
def test_a_descent_comes_to_the_same_end(base, tolerance):
    """Step by step as any fit goes, and as far: faults caught are those of a damping that does not fall or grow, or of
    a descent that stops for a drop that is not small."""
    problem = problem_of(base)
    fit = fit_of(problem, terms_of(problem.rows, LINEAR["all"]))
    quick, slow = refine(fit, 6, tolerance), slowly(fit, 6, tolerance)
    assert quick.objective < 0.9 * fit.objective
    assert quick.objective == pytest.approx(slow.objective, rel=ROUNDING)


def test_a_step_that_does_not_help_is_damped(base):
    """From far away, where full steps overshoot. Faults caught: a worse point that is taken, a damping that does not
    grow, normal equations of the point that was left."""
    problem = problem_of(base)
    far = evaluate(problem, 2.5 * problem.prior * np.sign(np.arange(PARAMETERS) % 3 - 0.5), np.zeros(2), (), ())
    settings, at, grew = problem.settings.fit, far, False
    damping = settings.damping
    for _ in range(8):
        better, used = descent._improved(at, damping, True)
        grew = grew or used > damping
        if better is None:
            break
        at, damping = better, used / settings.damping_down
    assert grew
    quick, slow = refine(far, 8, 0.0), slowly(far, 8, 0.0)
    assert quick.objective == pytest.approx(slow.objective, rel=ROUNDING)


def test_it_stays_in_its_box(base):
    """A record of ten times the largest error that is allowed: faults caught are a box left, or kept to one side."""
    problem = problem_of(base)
    errors = np.zeros(PARAMETERS)
    errors[[4, 8]] = 10 * problem.box[4], -10 * problem.box[8]
    loud = base.evaluate_at(problem.rotation, errors)[0]
    problem = replace(problem, rows=replace(problem.rows, error=loud))
    fit = evaluate(problem, np.zeros(PARAMETERS), np.zeros(2), (), ())
    quick, slow = refine(fit, 12, 0.0), slowly(fit, 12, 0.0)
    assert np.all(np.abs(quick.errors) <= problem.box)
    assert {-1.0, 1.0} <= set(quick.errors / problem.box)
    assert quick.objective == pytest.approx(slow.objective, rel=ROUNDING)


def test_columns_alike_do_not_stop_it(base):
    """The same nuisance twice: the damping alone tells the two apart. Faults caught: a matrix that is not positive
    taken for solved, or the end of the way."""
    problem = problem_of(base)
    twice = replace(problem, nuisance=np.repeat(problem.nuisance, 2, axis=1))
    fit = evaluate(twice, 0.3 * problem.prior, np.zeros(4), (), ())
    assert refine(fit, 8, 0.0).objective == pytest.approx(slowly(fit, 8, 0.0).objective, rel=ROUNDING)


@pytest.mark.parametrize("size", [1, 2, 7, 40])
def test_small_systems_are_solved(size):
    """By their upper triangle alone, and told where they are not positive. Faults caught: a row left out of the sums, a
    square root of what is negative."""
    rng = np.random.default_rng(size)
    root = rng.normal(size=(size, size + 3))
    matrix, moment = root @ root.T, rng.normal(size=size)
    upper, solution = np.triu(matrix), moment.copy()
    assert _solve.py_func(upper, solution)
    np.testing.assert_allclose(solution, np.linalg.solve(matrix, moment), rtol=1e-9)
    matrix[-1, -1] = -1.0
    assert not _solve.py_func(matrix, moment)


def test_what_bends_besides_is_no_such_fit(base):
    """Shapes that move, columns that the drive's motion makes, a pulse met where the zone is, more waves than are worth
    going through, a gear without a base, and an input encoder that reads ahead where teeth are measured, whose slope is
    not known: faults caught are each of them left out.
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
    measured = len(base.cs_table) > 0
    assert [name for name, fit in taken.items() if fit is not None] == ([] if measured else ["reads the input"])
    held = fit_of(problem, (columns, bent["shape"]))
    assert LinearTermsFit.of(held, False) is not None
    without = replace(problem, base=None)
    assert LinearTermsFit.of(evaluate(without, np.zeros(0), np.zeros(2), (), ()), True) is None
