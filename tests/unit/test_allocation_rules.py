"""Requirements, prices and rules of an allocation, by hand and by differences."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hdopt.allocation import convex, rules
from hdopt.allocation.convex import Infeasible, Item, rss_rule, solve, worst_case_rule
from hdopt.allocation.cost import Exponential, Grade, GradeTable, Piecewise, Reciprocal
from hdopt.allocation.rules import (
    AllocationProblem,
    allocate_by_equal_scaling,
    allocate_by_rss,
    allocate_by_worst_case,
    allocate_by_yield,
)
from hdopt.errors import HdoptError
from hdopt.tolerance.distributions import Normal, Uniform
from hdopt.tolerance.space import InputSpace, Tolerance

SENSITIVITIES, FIXED = (2.0, -3.0), (0.1, -0.2)
AT = np.array([0.01, 0.02])
Z_90 = 1.2816
"""Standard deviations below which nine tenths of a normal distribution lie."""


@pytest.mark.parametrize(
    ("rule", "value"),
    [(worst_case_rule, 0.02 + 0.06 + 0.3), (rss_rule, math.sqrt(0.02**2 + 0.06**2 + 0.1**2 + 0.2**2))],
)
def test_a_requirement_is_its_sum_and_slopes_as_it_does(rule, value):
    """Would catch a sign that takes from the stack, and fixed parts that add otherwise or not at all."""
    found = rule(SENSITIVITIES, 1.0, FIXED)
    assert found.value(AT) == pytest.approx(value)
    step = 1e-7
    differences = [(found.value(AT + e) - found.value(AT - e)) / (2 * step) for e in np.diag([step, step])]
    assert found.slope(AT) == pytest.approx(differences, rel=1e-6)


@pytest.mark.parametrize("rule", [worst_case_rule, rss_rule])
def test_the_price_of_the_limit_is_what_a_wider_one_saves(rule):
    items = [Item("a", Reciprocal(1.0, 0.02), 0.1), Item("b", Exponential(3.0, 0.1), 0.1)]
    limit = 0.9
    found, wider, narrower = (solve(items, rule(SENSITIVITIES, x, FIXED)) for x in (limit, limit + 1e-3, limit - 1e-3))
    assert found.marginal_cost == pytest.approx((narrower.total_cost - wider.total_cost) / 2e-3, rel=1e-3)
    at = np.array(list(found.tolerances.values()))
    assert found.slack == pytest.approx(limit - rule(SENSITIVITIES, limit, FIXED).value(at), abs=1e-15)
    assert found.slack >= -1e-9 * limit
    assert found.total_cost * (1 - 1e-6) <= found.lower_bound <= found.total_cost * (1 + 1e-9)


def test_a_tolerance_keeps_its_own_bounds_and_those_of_its_cost():
    quoted = Piecewise(((0.1, 5.0), (0.4, 1.0)))
    assert Item("a", quoted, 0.2, lower=0.05, upper=0.3).bounds == (0.1, 0.3)
    assert Item("a", quoted, 0.2, lower=0.2, upper=0.9).bounds == (0.2, 0.4)


def test_a_kink_belongs_to_the_line_behind_it():
    lines = Piecewise(((1.0, 10.0), (2.0, 4.0), (4.0, 2.0)))
    assert lines.slope(np.array([1.999, 2.0, 2.001])) == pytest.approx([-6.0, -1.0, -1.0])


class Sum:
    """s . x: normal where the inputs are."""

    def __init__(self, *slopes):
        self.slopes = np.array(slopes)

    def __call__(self, inputs):
        return inputs @ self.slopes


def problem(*held, required=0.9, limit=0.4, costs=(Reciprocal(0.0, 0.1), Reciprocal(0.0, 0.2)), present=(0.4, 0.4)):
    """Two normal inputs to be chosen, 4 sigma within the `present` tolerances, and `held` ones of that standard
    deviation."""
    tolerances = {
        name: Tolerance.of_deviation(Normal(mean=0.0, std=t / 4, lower=-t, upper=t))
        for name, t in zip("ab", present, strict=True)
    }
    tolerances |= {
        f"held{i}": Tolerance.of_deviation(Normal(mean=0.0, std=s, lower=-8 * s, upper=8 * s))
        for i, s in enumerate(held)
    }
    chosen = zip("ab", costs, present, strict=True)
    items = tuple(Item(name, cost, t, lower=1e-3, upper=40.0) for name, cost, t in chosen)
    return AllocationProblem(Sum(1.0, 1.0, *[1.0] * len(held)), InputSpace(tolerances), items, limit, required, "mm")


@pytest.fixture
def quick(monkeypatch):
    """Stacks of a few points, and the seeds that they were drawn with."""
    seeds = []
    run = rules.run_stack

    def noted(response, space, request):
        seeds.append(request.seed)
        return run(response, space, request)

    monkeypatch.setattr(rules, "run_stack", noted)
    for name in ("COMPARE_POINTS", "DESIGN_POINTS", "MODEL_POINTS"):
        monkeypatch.setattr(rules, name, 2**14)
    return seeds


@pytest.mark.parametrize("required", [0.9, 0.99])
def test_root_sum_square_brings_the_share_asked_for_to_the_limit(quick, required):
    """A sum of normal numbers is normal: the rule is exact, but for the sample."""
    found = allocate_by_rss(problem(0.05, required=required), seed=3)
    assert found.modelled == pytest.approx(0.4, rel=2e-4)
    assert found.required_quantile.value == pytest.approx(0.4, rel=0.02)
    assert set(quick) == {4}


def test_the_price_of_a_root_sum_square_counts_what_stays_as_it_is(quick):
    """By hand: cost C = K/sqrt(L^2 - r^2), r the held spread's part, so dC/dL = C L/(L^2 - r^2)."""
    found = allocate_by_rss(problem(0.15), seed=3)
    assert found.marginal_cost == pytest.approx(found.total_cost * 0.4 / (0.4**2 - (Z_90 * 0.15) ** 2), rel=0.02)


@pytest.mark.parametrize("dearer", [2.0, 2e4])
@pytest.mark.parametrize("rule", [allocate_by_rss, allocate_by_worst_case, allocate_by_yield])
def test_least_cost_does_not_hang_on_the_present_tolerances(quick, rule, dearer):
    """What a limit costs at least is a property of prices and limit, not of where a drawing stands today: from a tenth
    of the present tolerances, thirty times them, and one of them loose while the other is tight. Fault caught: a reach
    that shrinks at every step, so that nothing moves by more than 3.5 times; it cost five to seventy times as much.
    """
    costs = (Reciprocal(0.0, 0.1), Reciprocal(0.0, 0.1 * dearer))
    starts = [(0.4, 0.4), (0.04, 0.04), (12.0, 12.0), (12.0, 0.012), (0.02, 2.0)]
    found = [rule(problem(costs=costs, present=start), seed=3) for start in starts]
    # The yield's quantile is a sample's, and its cost at the optimum flat: 0.5 % are what its corrections leave.
    assert [one.total_cost for one in found] == pytest.approx([found[0].total_cost] * len(starts), rel=5e-3)
    assert [one.modelled for one in found] == pytest.approx([0.4] * len(starts), rel=1e-3)


@pytest.mark.parametrize("present", [(0.4, 0.4), (0.1, 1.0)])
def test_the_worst_case_weighs_all_corners_that_are_as_bad(quick, present):
    """By hand: of s a + b at one corner and a + s b at the opposite one, s = 0.2, the least cost of 0.1/a + 0.1/b under
    0.4 is where both are 0.4, at a = b = 0.4/1.2. Would catch a model that knows one corner a time, turns to and fro
    between them, and says in the end that nothing meets the limit.
    """

    class Opposite(Sum):
        def __call__(self, inputs):
            return np.maximum(inputs @ (0.2, 1.0), inputs @ (-1.0, -0.2))

    one = problem(costs=(Reciprocal(0.0, 0.1), Reciprocal(0.0, 0.1)), present=present)
    opposite = AllocationProblem(Opposite(), one.space, one.items, one.limit, one.required_yield, "mm")
    found = allocate_by_worst_case(opposite, seed=3)
    assert found.total_cost == pytest.approx(0.2 / (0.4 / 1.2), rel=1e-3)
    assert found.tolerances == pytest.approx({"a": 0.4 / 1.2, "b": 0.4 / 1.2}, rel=0.01)
    assert found.steps < rules.MAX_STEPS


def test_the_price_of_a_root_sum_square_counts_directions(quick):
    class Turned(Sum):
        def __call__(self, inputs):
            return super().__call__(inputs[:, :2]) + 0.15 * math.sqrt(2) * np.cos(inputs[:, 2])

    one = problem()
    turned = Tolerance(Uniform(lower=0.0, upper=2 * math.pi), None)
    space = InputSpace({**one.space.tolerances, "phase": turned}, turning=frozenset({"phase"}))
    found = allocate_by_rss(
        AllocationProblem(Turned(1.0, 1.0), space, one.items, one.limit, one.required_yield, "mm"), seed=3
    )
    assert found.marginal_cost == pytest.approx(found.total_cost * 0.4 / (0.4**2 - (Z_90 * 0.15) ** 2), rel=0.02)


def test_a_design_is_judged_on_a_sample_that_it_never_saw(quick):
    """The quantile's model is drawn with the seed, the judgement with the one after it."""
    allocate_by_yield(problem(), seed=3, verify_n=2**14)
    assert set(quick) == {4}


def test_equal_scaling_takes_the_finer_grade_and_keeps_the_bounds(quick):
    grades = GradeTable(tuple(Grade(name, t, 1 / t) for name, t in (("fine", 0.3), ("usual", 0.5), ("wide", 3.0))))
    given = problem(limit=1.0, costs=(grades, Reciprocal(0.0, 0.2)))
    found = allocate_by_equal_scaling(given, seed=3)
    factor = found.tolerances["b"] / 0.4
    assert 0.5 < factor * 0.4 < 3.0  # between two grades
    assert (found.grades, found.tolerances["a"]) == ({"a": "usual"}, 0.5)
    narrow = Item("b", Reciprocal(0.0, 0.2), 0.4, lower=0.01, upper=0.45)
    bounded = AllocationProblem(given.response, given.space, (given.items[0], narrow), 1.0, 0.9, "mm")
    assert allocate_by_equal_scaling(bounded, seed=3).tolerances["b"] == 0.45


def test_tolerances_that_break_the_requirement_are_no_answer():
    """A millionth too much is more than rounding; a billionth is not."""
    items = [Item("a", Reciprocal(0.0, 0.1), 0.1)]
    requirement = worst_case_rule([2.0], 1.0)
    end = {"lower_bound": 0.0, "marginal_cost": None, "solver": "none"}
    assert convex._finish(items, requirement, np.array([0.5 * (1 + 1e-10)]), **end).slack < 0
    with pytest.raises(HdoptError, match="break the requirement by 1e-06"):
        convex._finish(items, requirement, np.array([0.5 * (1 + 1e-6)]), **end)


@pytest.mark.parametrize(
    ("rule", "said"),
    [
        (allocate_by_worst_case, r"^the requirement 0\.4 mm cannot be met by the worst case rule: .*reachable is 0\.8"),
        (
            allocate_by_rss,
            r"^the requirement 0\.4 mm at yield 0\.9 cannot be met by the rss rule: .*reachable is 0\.51",
        ),
        (allocate_by_yield, r"^the requirement 0\.4 mm at yield 0\.9 cannot be met by the yield rule: .*is 0\.5"),
    ],
)
def test_what_cannot_be_met_is_so_by_a_rule(quick, rule, said):
    """The held input has a standard deviation of 0.1 to 0.4 within 8 of it: 0.8 or more in the worst case, 1.2816 x 0.4
    at the yield. Fault caught: the yield in the sentence of the worst case, whatever the rule, which is false where the
    requirement can be met by yield."""
    held = 0.1 if rule is allocate_by_worst_case else 0.4
    with pytest.raises(Infeasible, match=said):
        rule(problem(held), seed=3)


def test_what_equal_scaling_cannot_meet_has_no_lower_bounds(quick):
    """Fault caught: lower bounds of the tolerances in the sentence of a rule that knows none."""
    with pytest.raises(
        Infeasible, match=r"cannot be met by equal scaling: with a hundredth of every tolerance .* 0\.5"
    ):
        allocate_by_equal_scaling(problem(0.4), seed=3)


@pytest.mark.parametrize("lower", [0.9, 2.0])
@pytest.mark.parametrize("rule", [allocate_by_rss, allocate_by_worst_case, allocate_by_yield])
def test_bounds_may_begin_far_above_the_present_tolerance(quick, rule, lower):
    """From tolerances of 0.4 to at least 2.3 and 5 times as much, which a limit of 8 leaves room for. Fault caught: the
    reach of a step that ends below the bounds, refused as "may run from 0.9 to 0.64"."""
    one = problem(limit=8.0)
    items = (replace(one.items[0], lower=lower, upper=1.5 * lower), one.items[1])
    found = rule(replace(one, items=items), seed=3)
    # wider is cheaper and the limit leaves room, but for the worst case
    assert lower <= found.tolerances["a"] <= 1.5 * lower * (1 + 1e-9)
    assert found.modelled <= 8.0


@pytest.mark.parametrize(
    ("bounds", "tolerance", "kept"),
    [
        ((0.9, 2.0), 0.1, (0.9, 1.44)),
        ((0.9, 1.2), 0.1, (0.9, 1.2)),
        ((0.01, 0.05), 0.4, (0.03125, 0.05)),
        ((0.1, 2.0), 0.4, (0.25, 0.64)),
        ((0.3, 0.5), 0.4, (0.3, 0.5)),
    ],
)
def test_a_step_starts_at_the_end_of_the_bounds_next_to_it(bounds, tolerance, kept):
    """A factor of 1.6 to either side of where a tolerance stands, or of the end of its bounds next to that. Fault
    caught: an upper end of a step below the lower one of the bounds."""
    item = rules._within(Item("a", Reciprocal(0.0, 1.0), tolerance, *bounds), tolerance, 1.6)
    assert (item.lower, item.upper) == pytest.approx(kept)
