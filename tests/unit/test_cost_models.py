"""Costs of tolerances and the margin of a yield, by hand."""

import math

import numpy as np
import pytest
from scipy import stats

from hdopt.allocation.cost import Exponential, Grade, GradeTable, Piecewise, Power, Reciprocal
from hdopt.allocation.rules import yield_margin

CONVEX = [
    (Power(2.0, 3.0, 0.7), lambda t: 2 + 3 / t**0.7),
    (Reciprocal(1.0, 4.0), lambda t: 1 + 4 / t),
    (Exponential(5.0, 0.02, 1.0), lambda t: 1 + 5 * np.exp(-t / 0.02)),
]
PLACES = np.array([0.005, 0.01, 0.03])


@pytest.mark.parametrize(("model", "cost"), CONVEX, ids=lambda one: type(one).__name__)
def test_a_cost_is_its_formula_and_falls(model, cost):
    assert model.cost(PLACES) == pytest.approx(cost(PLACES))
    step = 1e-6
    assert model.slope(PLACES) == pytest.approx((cost(PLACES + step) - cost(PLACES - step)) / (2 * step), rel=1e-4)
    assert np.all(model.slope(PLACES) < 0)


@pytest.mark.parametrize(("model", "cost"), CONVEX, ids=lambda one: type(one).__name__)
def test_a_solver_sees_the_same_cost(model, cost):
    import cvxpy as cp

    variable = cp.Variable(nonneg=True)
    variable.value = 1.5
    assert float(model.expression(variable, 0.02).value) == pytest.approx(cost(0.03))


def test_lines_meet_at_their_points():
    model = Piecewise(((1.0, 10.0), (2.0, 4.0), (4.0, 2.0)))
    assert [slope * t + start for (slope, start), t in zip(model.segments, (1.5, 3.0), strict=True)] == [7.0, 3.0]
    assert model.cost([1.5, 3.0]) == pytest.approx([7.0, 3.0])
    assert model.slope(np.array([1.5, 3.0])) == pytest.approx([-6.0, -1.0])
    assert model.convex and not Piecewise(((1.0, 10.0), (2.0, 9.0), (4.0, 2.0))).convex


def test_lines_say_nothing_of_what_is_finer_than_their_points():
    """Fault caught: the end's cost for a tolerance that nobody quoted; and none for one at the end but for rounding, or
    for one wider than all, which costs no more than the widest."""
    model = Piecewise(((0.1, 10.0), (0.2, 4.0)))
    assert model.cost([0.02, 0.09]) == pytest.approx([math.nan, math.nan], nan_ok=True)
    assert model.cost([0.1, 0.1 * (1 - 1e-12), 0.2, 0.9]) == pytest.approx([10.0, 10.0, 4.0, 4.0])


def test_the_cheapest_grade_that_keeps_a_tolerance():
    """A finer grade may be cheaper; one that is wider does not keep it."""
    costs = {"fine": (0.01, 7.0), "odd": (0.015, 9.0), "usual": (0.02, 5.0), "wide": (0.05, 1.0)}
    table = GradeTable(tuple(Grade(name, *pair) for name, pair in costs.items()))
    chosen = {0.01: "fine", 0.015: "fine", 0.02: "usual", 0.049: "usual", 0.06: "wide"}
    assert {tolerance: table.at_most(tolerance).name for tolerance in chosen} == chosen
    assert float(table.cost(0.03)) == 5.0


def test_the_margin_covers_design_and_verification():
    """Student's half width of the verification, and three standard deviations of the difference of two shares."""
    variance = 0.99 * 0.01
    half = stats.t.ppf(0.975, 15) * np.sqrt(variance / 50_000)
    expected = half + 3 * np.sqrt(variance * (1 / 50_000 + 1 / 200_000))
    assert yield_margin(0.99, 200_000, 50_000) == pytest.approx(expected, rel=1e-9)
