"""Allocation: grades against enumeration, mixed problems against brute force, and how it says no."""

import itertools
import json

import numpy as np
import pytest

from hdopt.allocation.convex import Infeasible, Item, Requirement, cost_curve, rss_rule, solve, worst_case_rule
from hdopt.allocation.cost import Exponential, Grade, GradeTable, Piecewise, Power, Reciprocal
from hdopt.errors import HdoptError
from hdopt.workflow.allocate import allocate

TABLES = [
    GradeTable(tuple(Grade(f"IT{i}", base * 1.6**i, scale / 1.5**i) for i in range(6)))
    for base, scale in ((0.001, 10.0), (0.0015, 7.0), (0.0008, 12.0))
]
SENSITIVITIES = (1.0, -0.5, 2.0)


@pytest.mark.parametrize("rule", [worst_case_rule, rss_rule])
def test_grades_are_the_cheapest_of_all_choices(rule):
    requirement = rule(SENSITIVITIES, 0.008)
    items = [Item(f"t{i}", table, 0.002) for i, table in enumerate(TABLES)]
    found = solve(items, requirement)
    cheapest = min(
        sum(grade.cost for grade in choice)
        for choice in itertools.product(*(table.grades for table in TABLES))
        if requirement.value(np.array([grade.tolerance for grade in choice])) <= 0.008
    )
    assert found.total_cost == pytest.approx(cheapest, rel=1e-9)
    assert found.optimality_gap < 1e-6
    assert set(found.grades) == {"t0", "t1", "t2"}
    assert found.marginal_cost is None


@pytest.mark.parametrize("rule", [worst_case_rule, rss_rule])
def test_mixed_costs_against_brute_force(rule):
    """Grades, a smooth cost and a cost whose lines turn down, together."""
    falling = Piecewise(((0.001, 5.0), (0.004, 4.5), (0.006, 1.0), (0.01, 0.9)))
    assert falling.discrete
    items = [Item("a", TABLES[0], 0.004), Item("b", Power(1, 0.1, 0.45), 0.005), Item("c", falling, 0.005)]
    found = solve(items, rule([1.0] * 3, 0.015))
    best = np.inf
    for grade in TABLES[0].grades:
        for c in np.linspace(0.001, 0.01, 901):
            rest = 0.015 - grade.tolerance - c if rule is worst_case_rule else 0.015**2 - grade.tolerance**2 - c**2
            if rest > 0:
                b = rest if rule is worst_case_rule else np.sqrt(rest)
                best = min(best, grade.cost + float(items[1].cost.cost(b)) + float(falling.cost(c)))
    assert found.total_cost <= best * (1 + 1e-6)
    assert found.total_cost == pytest.approx(best, rel=1e-3)  # the grid's step


@pytest.mark.parametrize("model", [Reciprocal(1.0, 0.02), Power(0.0, 1.0, 0.3), Exponential(3.0, 0.01)])
def test_slopes_of_cost_models(model):
    t, h = 0.01, 1e-7
    assert model.slope(t) == pytest.approx((model.cost(t + h) - model.cost(t - h)) / (2 * h), rel=1e-5)


def test_convex_lines_need_no_choice():
    convex = Piecewise(((0.001, 5.0), (0.004, 2.0), (0.01, 1.0)))
    assert not convex.discrete
    found = solve([Item("a", convex, 0.004), Item("b", Power(0.0, 0.01, 1.0), 0.004)], worst_case_rule([1, 1], 0.01))
    grid = np.linspace(0.001, 0.0099, 8901)
    best = np.min(convex.cost(grid) + 0.01 / (0.01 - grid))
    assert found.total_cost == pytest.approx(best, rel=1e-5)


def test_of_two_rows_each_has_its_own_price():
    """By hand: 1/a + 1/b under a + b/5 <= 1 and b + 1/2 <= 1 is least at a = 0.9, b = 0.5, where the rows' prices are
    1/a^2 and 1/b^2 - 1/(5 a^2), 1.23 and 3.75. Would catch a proven bound that weighs the rows alike.
    """
    rows = Requirement(1.0, np.array([[1.0, 0.2], [0.0, 1.0]]), np.zeros(2), np.array([0.0, 0.5]))
    found = solve([Item("a", Reciprocal(0.0, 1.0), 1.0), Item("b", Reciprocal(0.0, 1.0), 1.0)], rows)
    assert found.tolerances == pytest.approx({"a": 0.9, "b": 0.5}, rel=1e-6)
    assert found.marginal_cost == pytest.approx(0.8 / 0.9**2 + 1 / 0.5**2, rel=1e-4)
    assert found.lower_bound == pytest.approx(1 / 0.9 + 1 / 0.5, rel=1e-6)


def test_scaling_of_units_does_not_change_the_answer():
    """The same stack in inches, in nanometres and in kilometres."""
    costs = []
    for unit in (1.0, 1e9, 1e-6):
        items = [Item(f"t{i}", Power(1.0, 0.1 * unit**0.45, 0.45), 0.004 * unit) for i in range(3)]
        costs.append(solve(items, rss_rule(SENSITIVITIES, 0.01 * unit)).total_cost)
    assert costs == pytest.approx([costs[0]] * 3, rel=1e-9)


def test_cost_curve_falls_and_marks_what_cannot_be():
    items = [Item("a", Power(1.0, 0.1, 0.5), 0.004)]
    curve = cost_curve(items, worst_case_rule([1.0], 0.01, (0.005,)), [0.004, 0.006, 0.01])
    assert np.isnan(curve[0][1]) and curve[1][1] > curve[2][1]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Power(1.0, -1.0, 0.5), "b of the power cost is -1.0"),
        (lambda: Piecewise(((0.2, 1.0), (0.1, 2.0))), "tolerances rising"),
        (lambda: GradeTable(()), "the table of grades is empty"),
        (lambda: Item("a", Power(1, 1, 1), 1.0, lower=2.0, upper=1.0), "must be 0 or above and below the upper one"),
        (
            lambda: solve([Item("a", Power(1, 1, 1), 1.0, lower=0.5)], worst_case_rule([1.0], 0.1)),
            r"best reachable is 0\.5 \(the lower bounds hold it up: a >= 0\.5\)",
        ),
        (lambda: solve([Item("a", TABLES[0], 1.0)], worst_case_rule([1.0], 1e-4)), "best reachable is 0.001"),
        (lambda: allocate("csf-25-80"), "allocate needs costs"),
        (lambda: allocate("chase-shaft-housing", "yield"), "a linear stack takes the rule worst_case or rss"),
        (lambda: allocate("chase-shaft-housing", "worst"), "unknown allocation rule 'worst'; did you mean"),
    ],
)
def test_bad_problems(make, message):
    with pytest.raises(HdoptError, match=message):
        make()


def test_infeasible_is_an_answer():
    with pytest.raises(Infeasible) as caught:
        solve([Item("a", Power(1, 1, 1), 1.0)], worst_case_rule([1.0], 0.1, (0.2,)))
    assert caught.value.best_reachable == pytest.approx(0.2)


def test_chase_study():
    result = allocate("chase-shaft-housing", curve=(1.0, 2.0))
    assert result.total_cost == pytest.approx(11.07783, abs=5e-6)
    assert result.status == "optimal" and result.optimality_gap < 1e-9
    assert result.comparison[-1].total_cost == pytest.approx(8.053611, abs=5e-7)
    assert result.cost_curve[0][1] == pytest.approx(result.total_cost) and result.cost_curve[1][1] < result.total_cost
    assert json.dumps(result.to_dict())
    assert result.to_frame().loc["shaft", "tolerance"] == pytest.approx(0.00253711, abs=6e-9)
