"""Least-cost tolerances under one requirement that is convex in them: worst case, root sum square, or a local model.

Everything is solved in scaled numbers (tolerances near 1), because solvers accept violations near 1 % on badly scaled
problems, and what they return is checked afterwards against the requirement itself.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, TypeAlias  # Any: cvxpy's problem, which has no types

import numpy as np

from hdopt.allocation.cost import ConvexCost, CostModel, Expression, GradeTable, Piecewise
from hdopt.arrays import Array
from hdopt.errors import HdoptError, NoResult

FEASIBLE = 1e-9
"""Violation of the requirement, relative to its limit, that is left to rounding."""
GAP = 1e-7
"""Relative gap to the proven lower bound at which a choice among grades is called optimal."""
ROUNDS = 200


class Infeasible(HdoptError):
    """No tolerances allowed can meet the requirement; `best_reachable` is the least the stack can be."""

    def __init__(self, message: str, best_reachable: float) -> None:
        super().__init__(message)
        self.best_reachable = best_reachable


@dataclass(frozen=True)
class Item:
    """One tolerance to choose: what it costs, its bounds, and a typical value `scale`."""

    name: str
    cost: CostModel
    scale: float
    lower: float = 0.0
    upper: float = math.inf

    def __post_init__(self) -> None:
        if not 0 <= self.lower < self.upper:
            raise HdoptError(
                f"the tolerance {self.name} may run from {self.lower:g} to {self.upper:g}; "
                "the lower bound must be 0 or above and below the upper one"
            )

    @property
    def bounds(self) -> tuple[float, float]:
        """The item's own bounds met with those of its cost model."""
        low, high = self.cost.range
        return max(self.lower, low), min(self.upper, high)


@dataclass(frozen=True)
class Requirement:
    """offset + linear . t + norm of (quadratic * t, rest) <= limit, over the tolerances t of shape (k,).

    `linear` (k,) alone is the worst-case rule, `quadratic` (k,) with the rest of fixed parts the root-sum-square rule.
    Of several rows, `linear` (m, k) with `offset` (m,), the largest must keep the limit.
    """

    limit: float
    linear: Array
    quadratic: Array
    offset: Array | float = 0.0
    rest: float = 0.0
    rule: str = ""

    def rows(self, tolerances: Array) -> Array:
        """Left sides at the tolerances, (m,), or () where there is one row."""
        return np.asarray(self.offset + self.linear @ tolerances + self._norm(tolerances))

    def slopes(self, tolerances: Array) -> Array:
        """Gradients of the `rows`, (m, k) or (k,)."""
        norm = self._norm(tolerances)
        return self.linear + (self.quadratic**2 * tolerances / norm if norm > 0 else 0.0)

    def value(self, tolerances: Array) -> float:
        """The largest left side at the tolerances."""
        return float(np.max(self.rows(tolerances)))

    def slope(self, tolerances: Array) -> Array:
        """Its gradient, (k,)."""
        largest: Array = np.atleast_2d(self.slopes(tolerances))[int(np.argmax(self.rows(tolerances)))]
        return largest

    def mean_row(self, weights: Array) -> Requirement:
        """The one row that the rows make with `weights` (m,), or () for one, which add up to 1: what keeps all of them
        keeps it."""
        linear, offset = weights @ np.atleast_2d(self.linear), float(np.sum(weights * self.offset))
        return replace(self, linear=linear, offset=offset)

    def with_limit(self, limit: float) -> Requirement:
        return replace(self, limit=limit)

    def _norm(self, tolerances: Array) -> float:
        return math.sqrt(float(np.square(self.quadratic * tolerances).sum()) + self.rest**2)


def worst_case_rule(sensitivities: Sequence[float], limit: float, fixed: Sequence[float] = ()) -> Requirement:
    """Tolerances add in full: sum |s_i| t_i + sum |fixed| <= limit.

    `sensitivities` s (k,) are the response's slopes over the k tolerances that may change; `fixed` holds what each
    other tolerance adds to it, in the unit of `limit`.
    """
    magnitudes = np.abs(np.asarray(sensitivities, float))
    offset = float(np.abs(np.asarray(fixed, float)).sum())
    return Requirement(limit, magnitudes, np.zeros_like(magnitudes), offset, rule="worst case")


def rss_rule(sensitivities: Sequence[float], limit: float, fixed: Sequence[float] = ()) -> Requirement:
    """Tolerances add as independent spreads: sqrt(sum (s_i t_i)^2 + sum fixed^2) <= limit.

    `sensitivities` s (k,) are the response's slopes over the k tolerances that may change; `fixed` holds what each
    other tolerance adds to it, in the unit of `limit`.
    """
    magnitudes = np.abs(np.asarray(sensitivities, float))
    rest = float(np.linalg.norm(np.asarray(fixed, float))) if len(fixed) else 0.0
    return Requirement(limit, np.zeros_like(magnitudes), magnitudes, rest=rest, rule="root sum square")


@dataclass(frozen=True)
class Solution:
    """Least-cost tolerances with what was verified after solving.

    `marginal_cost` is the fall of cost per unit of the limit, grades held (None where there are only grades);
    `lower_bound` the proven least cost; `slack` the requirement's limit less its value, computed anew.
    """

    tolerances: dict[str, float]
    costs: dict[str, float]
    grades: dict[str, str]
    total_cost: float
    lower_bound: float
    marginal_cost: float | None
    slack: float
    solver: str
    binding: tuple[str, ...] = field(default=())

    @property
    def optimality_gap(self) -> float:
        """(cost - proven lower bound)/cost."""
        return max(self.total_cost - self.lower_bound, 0.0) / abs(self.total_cost) if self.total_cost else 0.0


def solve(items: Sequence[Item], requirement: Requirement) -> Solution:
    """Least total cost of the items' tolerances under the requirement.

    Convex costs: one conic problem (Clarabel). Grades or piecewise costs that are not convex: outer approximation
    (Duran and Grossmann 1986), a mixed-integer linear problem (HiGHS) whose tangents are drawn where the conic problem
    of each of its choices ends; its value is a proven lower bound. Raises `Infeasible` where no allowed tolerances meet
    the requirement.
    """
    check_feasible(items, requirement)
    if any(item.cost.discrete for item in items):
        return _solve_with_choices(items, requirement)
    return _solve_convex(items, requirement)


def check_feasible(items: Sequence[Item], requirement: Requirement) -> None:
    """Raise `Infeasible`, naming the bounds that make it so, unless the tightest tolerances of `items` meet the
    `requirement`; `HdoptError` where an item's own bounds miss its cost data."""
    tightest = np.array([item.bounds[0] for item in items])
    for item in items:
        low, high = item.bounds
        if low > high:
            raise HdoptError(
                f"{item.name}: its bounds [{item.lower:g}, {item.upper:g}] miss its cost data [{low:g}, {high:g}]"
            )
    best = requirement.value(tightest)
    if best <= requirement.limit * (1 + FEASIBLE) and (best < requirement.limit or tightest.min() > 0):
        return
    shares = sorted(zip(np.abs(requirement.slope(tightest)) * tightest, items, strict=True), key=lambda pair: -pair[0])
    at_bound = ", ".join(f"{item.name} >= {item.bounds[0]:g}" for share, item in shares[:3] if share > 0)
    fixed = requirement.value(np.zeros(len(items)))
    what = [f"its fixed part alone is {fixed:.6g}"] if fixed > 0 else []
    what += [f"the lower bounds hold it up: {at_bound}"] if at_bound else []
    raise Infeasible(
        f"the requirement {requirement.limit:g} cannot be met by the {requirement.rule or 'given'} rule: the best "
        f"reachable is {best:.6g} ({'; '.join(what)}); allow finer tolerances or relax the requirement",
        best,
    )


def _finish(
    items: Sequence[Item],
    requirement: Requirement,
    tolerances: Array,
    *,
    lower_bound: float,
    marginal_cost: float | None,
    solver: str,
) -> Solution:
    costs = [float(item.cost.cost(t)) for item, t in zip(items, tolerances, strict=True)]
    slack = requirement.limit - requirement.value(tolerances)
    if slack < -FEASIBLE * abs(requirement.limit):
        raise HdoptError(
            f"the solver's tolerances break the requirement by {-slack:.3g}, more than rounding; "
            "check that all numbers are in the same unit"
        )
    names = [item.name for item in items]
    binding = tuple(
        item.name
        for item, t in zip(items, tolerances, strict=True)
        if not item.cost.discrete and (t <= item.bounds[0] * (1 + 1e-6) or t >= item.bounds[1] * (1 - 1e-6))
    )
    return Solution(
        tolerances=dict(zip(names, map(float, tolerances), strict=True)),
        costs=dict(zip(names, costs, strict=True)),
        grades={
            item.name: item.cost.nearest(t).name
            for item, t in zip(items, tolerances, strict=True)
            if isinstance(item.cost, GradeTable)
        },
        total_cost=float(sum(costs)),
        lower_bound=lower_bound,
        marginal_cost=marginal_cost,
        slack=slack,
        solver=solver,
        binding=binding,
    )


def _scaled_bounds(items: Sequence[Item], scale: Array) -> tuple[Array, Array]:
    low, high = np.array([item.bounds for item in items]).T
    return low / scale, np.minimum(high / scale, 1e6)


def _scales(items: Sequence[Item]) -> Array:
    return np.array([item.scale for item in items])


def _smooth_cost(item: Item) -> ConvexCost:
    """The item's cost where nothing is left to choose: one with a slope, and a form that the solver takes."""
    if not isinstance(item.cost, ConvexCost):
        raise HdoptError(
            f"the cost of {item.name} is one of separate choices, where a curve is needed; give it a slope and an "
            "expression, or call it discrete"
        )
    return item.cost


def _solve_convex(items: Sequence[Item], requirement: Requirement) -> Solution:
    import cvxpy as cp

    scale = _scales(items)
    low, high = _scaled_bounds(items, scale)
    t = cp.Variable(len(items), pos=True)
    unit = max(abs(requirement.limit), 1e-300)
    left = requirement.offset / unit + (requirement.linear * scale / unit) @ t
    parts = requirement.quadratic * scale / unit
    if np.any(parts):
        left = left + cp.norm(cp.hstack([cp.multiply(parts, t), requirement.rest / unit]))
    else:
        left = left + requirement.rest / unit
    meets = left <= requirement.limit / unit
    bounds = [t <= high]
    if np.any(low > 0):
        bounds.append(t >= low)
    costs = [_smooth_cost(item) for item in items]
    cost_unit = max(
        sum(abs(float(cost.slope(item.scale))) * item.scale for item, cost in zip(items, costs, strict=True)), 1e-300
    )
    cost = sum(costs[i].expression(t[i], item.scale) for i, item in enumerate(items)) / cost_unit
    problem = cp.Problem(cp.Minimize(cost), [meets, *bounds])
    with warnings.catch_warnings():
        # asked for more digits than it may reach, the solver says so; slack and gap are computed anew below
        warnings.filterwarnings("ignore", "Solution may be inaccurate")
        try:
            _solve(problem, cp.CLARABEL, tol_gap_abs=1e-12, tol_gap_rel=1e-12, tol_feas=1e-12, max_iter=500)
        except NoResult:
            # scaled once more, numbers that are near 1 already can make it give up
            _solve(problem, cp.CLARABEL, equilibrate_enable=False, warm_start=False, max_iter=500)
    if problem.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
        raise HdoptError(f"the solver ended with {problem.status!r}; check the cost data and the bounds")
    prices = np.atleast_1d(meets.dual_value)
    price = float(prices.sum())
    multiplier = price * cost_unit / unit
    tolerances = np.clip(t.value, low, high) * scale
    tolerances = _pull_inside(items, requirement, tolerances)
    weights = prices / price if price > 0 else np.full(len(prices), 1 / len(prices))
    bound = _lagrange_bound(items, requirement.mean_row(weights), multiplier, tolerances)
    return _finish(items, requirement, tolerances, lower_bound=bound, marginal_cost=multiplier, solver="Clarabel")


def _solve(problem: Any, solver: str, **options: Any) -> None:
    """Solve a CVXPY problem; a solver that gives up on its numbers is unusable input."""
    import cvxpy as cp

    try:
        problem.solve(solver=solver, **options)
    except cp.error.SolverError as error:
        raise NoResult(
            f"the solver {solver} gave up on these costs and tolerances; see whether each has the unit its name says "
            "and none is a million times another"
        ) from error


def _pull_inside(items: Sequence[Item], requirement: Requirement, tolerances: Array) -> Array:
    """Take off what rounding left too much, along the ray to the tightest tolerances."""
    excess = requirement.value(tolerances) - requirement.limit
    if excess <= 0:
        return tolerances
    tightest = np.array([item.bounds[0] for item in items])
    room = requirement.value(tolerances) - requirement.value(tightest)
    return tolerances - min(excess / room * (1 + 1e-9), 1.0) * (tolerances - tightest) if room > 0 else tolerances


def _lagrange_bound(items: Sequence[Item], requirement: Requirement, multiplier: float, at: Array) -> float:
    """A proven lower bound: cost + multiplier * (tangent of the requirement - limit), least item by item.

    The tangent lies below the convex requirement, so every tolerance that meets the requirement costs at least this.
    """
    from scipy.optimize import minimize_scalar

    slope = requirement.slope(at)
    constant = requirement.value(at) - float(slope @ at) - requirement.limit
    total = multiplier * constant
    for item, s, t in zip(items, slope, at, strict=True):
        low, high = item.bounds
        low, high = max(low, 1e-9 * t), min(high, 1e3 * t)

        def lagrangian(log_t: float, item: Item = item, s: float = float(s)) -> float:
            return float(item.cost.cost(math.exp(log_t))) + multiplier * s * math.exp(log_t)

        found = minimize_scalar(
            lagrangian, bounds=(math.log(low), math.log(high)), method="bounded", options={"xatol": 1e-12}
        )
        total += min(float(found.fun), lagrangian(math.log(t)))
    return float(total)


def _solve_with_choices(items: Sequence[Item], requirement: Requirement) -> Solution:
    import cvxpy as cp

    scale, unit = _scales(items), max(abs(requirement.limit), 1e-300)
    low, high = _scaled_bounds(items, scale)
    t, cost = cp.Variable(len(items)), cp.Variable(len(items))
    constraints, curved = _choices(items, t, cost, low, high)
    constraints.append(_requirement_tangent(requirement, scale, unit, t, np.clip(np.ones(len(items)), low, high)))
    best: tuple[float, Array, float | None] | None = None
    bound, tried = -math.inf, set[tuple[Choice, ...]]()
    for _ in range(ROUNDS):
        problem = cp.Problem(cp.Minimize(cp.sum(cost)), constraints)
        _solve(problem, cp.HIGHS, mip_rel_gap=1e-9, mip_abs_gap=1e-12)
        if problem.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
            break  # no choice is left that the tangents allow
        bound = max(bound, float(problem.value))
        at = np.clip(t.value, low, high) * scale
        choice = tuple(_choice(item, x) for item, x in zip(items, at, strict=True))
        solved = _solve_choice(items, requirement, choice)
        if solved is None:
            # the choice itself breaks the requirement, or no room is left beside it: cut it off
            tightest = [c if isinstance(c, float) else x for c, x in zip(choice, low * scale, strict=True)]
            at = np.array(tightest)
        else:
            at, multiplier = solved
            total = sum(float(item.cost.cost(x)) for item, x in zip(items, at, strict=True))
            if best is None or total < best[0]:
                best = total, at, multiplier
        closed = best is not None and best[0] - bound <= GAP * abs(best[0])
        if closed or choice in tried:
            break
        tried.add(choice)
        constraints.append(_requirement_tangent(requirement, scale, unit, t, at / scale))
        constraints += [_cost_tangent(items[i], t[i], cost[i], at[i] / scale[i]) for i in curved]
    if best is None:
        reachable, rule = requirement.value(low * scale), requirement.rule or "given"
        raise Infeasible(
            f"no choice of grades meets the requirement {requirement.limit:g} by the {rule} rule "
            f"({problem.status}); the best reachable is {reachable:.6g}; allow finer grades or relax the requirement",
            reachable,
        )
    return _finish(
        items,
        requirement,
        best[1],
        lower_bound=min(bound, best[0]),
        marginal_cost=best[2],
        solver="HiGHS and Clarabel",
    )


Choice: TypeAlias = float | tuple[tuple[float, float], ...] | None
"""What a master problem's solution chose for an item: a grade's tolerance, the ends of a segment, or nothing."""


def _choices(
    items: Sequence[Item], t: Expression, cost: Expression, low: Array, high: Array
) -> tuple[list[Expression], list[int]]:
    """Constraints of the master problem: one grade or segment of each item that has some, first tangents below the
    cost of the others; and which those others are. `t` and `cost` are CVXPY's variables, one entry an item."""
    import cvxpy as cp

    constraints: list[Expression] = [t <= high, t >= low]
    curved: list[int] = []
    for i, item in enumerate(items):
        if isinstance(item.cost, GradeTable):
            allowed = [g for g in item.cost.grades if item.lower <= g.tolerance <= item.upper]
            pick = cp.Variable(len(allowed), boolean=True)
            tolerances = np.array([g.tolerance for g in allowed]) / item.scale
            costs = np.array([g.cost for g in allowed])
            constraints += [cp.sum(pick) == 1, t[i] == tolerances @ pick, cost[i] == costs @ pick]
        elif isinstance(item.cost, Piecewise) and not item.cost.convex:
            constraints += _piecewise_choice(item.cost, item.scale, t[i], cost[i])
        else:
            curved.append(i)
            constraints += [_cost_tangent(items[i], t[i], cost[i], x) for x in _first_tangents(low[i], high[i])]
    return constraints, curved


def _choice(item: Item, tolerance: float) -> Choice:
    """What the item's `tolerance` in a master problem's solution means."""
    if isinstance(item.cost, GradeTable):
        return float(item.cost.nearest(tolerance).tolerance)
    if isinstance(item.cost, Piecewise) and not item.cost.convex:
        ends = list(pairwise(item.cost.points))
        return min(ends, key=lambda pair: max(pair[0][0] - tolerance, tolerance - pair[1][0]))
    return None


def _solve_choice(
    items: Sequence[Item], requirement: Requirement, choice: tuple[Choice, ...]
) -> tuple[Array, float | None] | None:
    """Least-cost tolerances once all choices are made, with the marginal cost of what is left to choose; None where
    they leave no room."""
    chosen = np.array([c if isinstance(c, float) else 0.0 for c in choice])
    free = [i for i, c in enumerate(choice) if not isinstance(c, float)]
    if not free:
        return (chosen, None) if requirement.value(chosen) <= requirement.limit * (1 + FEASIBLE) else None
    remaining = Requirement(
        requirement.limit,
        requirement.linear[..., free],
        requirement.quadratic[free],
        requirement.offset + requirement.linear @ chosen,
        math.hypot(requirement.rest, float(np.linalg.norm(requirement.quadratic * chosen))),
        requirement.rule,
    )
    segments = [(items[i], choice[i]) for i in free]
    convex = [replace(item, cost=Piecewise(ends)) if isinstance(ends, tuple) else item for item, ends in segments]
    try:
        check_feasible(convex, remaining)
    except Infeasible:
        return None
    solution = _solve_convex(convex, remaining)
    chosen[free] = list(solution.tolerances.values())
    return chosen, solution.marginal_cost


def _first_tangents(low: float, high: float) -> Array:
    """Twelve tolerances, relative to the present one, from `low` to `high` or over four decades of them at most."""
    return np.geomspace(max(low, 1e-2), min(max(high, 2e-2), 1e2 * max(low, 1.0)), 12)


def _cost_tangent(item: Item, t: Expression, cost: Expression, at: float) -> Expression:
    smooth = _smooth_cost(item)
    value, slope = float(smooth.cost(at * item.scale)), float(smooth.slope(at * item.scale)) * item.scale
    return cost >= value + slope * (t - at)


def _requirement_tangent(requirement: Requirement, scale: Array, unit: float, t: Expression, at: Array) -> Expression:
    slopes = requirement.slopes(at * scale) * scale
    return (requirement.rows(at * scale) + slopes @ (t - at)) / unit <= requirement.limit / unit


def _piecewise_choice(lines: Piecewise, scale: float, t: Expression, cost: Expression) -> list[Expression]:
    """One segment of `lines` is chosen; the point lies on it."""
    import cvxpy as cp

    points = np.array(lines.points)
    segments = len(points) - 1
    pick, along = cp.Variable(segments, boolean=True), cp.Variable(segments, nonneg=True)
    steps = np.diff(points, axis=0)
    return [
        cp.sum(pick) == 1,
        along <= pick,
        t * scale == points[:-1, 0] @ pick + steps[:, 0] @ along,
        cost == points[:-1, 1] @ pick + steps[:, 1] @ along,
    ]


def cost_curve(items: Sequence[Item], requirement: Requirement, limits: Sequence[float]) -> list[tuple[float, float]]:
    """(limit, least cost) of the `items` under the `requirement` with each of `limits`; NaN where it cannot be met."""
    curve = []
    for limit in limits:
        try:
            curve.append((float(limit), solve(items, requirement.with_limit(float(limit))).total_cost))
        except Infeasible:
            curve.append((float(limit), math.nan))
    return curve


def total_cost(items: Sequence[Item], tolerances: Mapping[str, float]) -> float:
    """Sum of what the given `tolerances`, by name, cost by the cost models of `items`."""
    return float(sum(float(item.cost.cost(tolerances[item.name])) for item in items))
