"""Least-cost tolerances of a nonlinear response: by the real yield, and by the rules it is compared with.

No rule's convex model is believed: each is renewed at the tolerances it led to until both agree, and what comes out is
judged by the real response. The yield rule keeps a margin, fixed beforehand, that covers the sampling of design and
verification, so that one verification on a fresh seed passes; it is not repeated until it does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import special

from hdopt.allocation.convex import Infeasible, Item, Requirement, Solution, solve, total_cost
from hdopt.allocation.cost import GradeTable
from hdopt.arrays import Array
from hdopt.errors import HdoptError
from hdopt.parallel.engine import Engine
from hdopt.tolerance.intervals import IntervalEstimate
from hdopt.tolerance.linearise import linearise
from hdopt.tolerance.response import Response, evaluate
from hdopt.tolerance.sampling import ScrambledSobol
from hdopt.tolerance.space import InputSpace
from hdopt.tolerance.stack import Stack, StackRequest, run_stack
from hdopt.tolerance.worst_case import find_worst_case

MODEL_POINTS = 2**17
"""Points of the sample, the same at every step, whose quantile the convex models follow."""
NEIGHBOURS = 200
"""Drives on either side of the quantile whose mean slope is the quantile's slope."""
CURVE_POINTS = 2**15
DESIGN_POINTS = 2**20
COMPARE_POINTS = 2**17
STEP = 0.01
"""Relative step of slopes: small against the curvature, large against rounding."""
REACH = 1.6
"""Factor by which one convex model may move a tolerance."""
SHRINK = 0.6
"""What is left of a tolerance's reach after a step in which it did not use it up, or turned back."""
LEAST_REACH = 1.005
"""No reach is shorter: a solver needs room between the ends."""
AT_THE_END = 0.99
"""Share of a reach from which it counts as used up."""
SETTLED = 5e-5
"""Relative change of cost below which successive models agree."""
ARRIVED = 0.005
"""Largest change of a tolerance, by its logarithm, below which they do."""
MAX_STEPS = 60
CORRECTIONS = 8
CLOSE = 1e-4
"""How near below the limit, relative to it, the measured response of a continuous design is brought."""


@dataclass(frozen=True)
class AllocationProblem:
    """A response with its inputs, the tolerances that may change, and what is required of it."""

    response: Response
    space: InputSpace
    items: tuple[Item, ...]
    limit: float
    required_yield: float
    unit: str = "arcmin"
    engine: Engine | str | None = None

    @property
    def current(self) -> Array:
        """Tolerances as they are."""
        return np.array([self.space.values[item.name] for item in self.items])

    def space_at(self, tolerances: Array) -> InputSpace:
        return self.space.with_tolerances(self.by_name(tolerances))

    def by_name(self, tolerances: Array) -> dict[str, float]:
        return {item.name: float(t) for item, t in zip(self.items, tolerances, strict=True)}


@dataclass(frozen=True)
class Allocation:
    """Tolerances one rule allocates, what they cost, and what the real response makes of them.

    `conforming` and `required_quantile` are of a stack of `judged_n` points; `modelled` is what the rule itself says
    the response is, to hold against the limit.
    """

    rule: str
    tolerances: dict[str, float]
    costs: dict[str, float]
    grades: dict[str, str]
    total_cost: float
    modelled: float
    conforming: IntervalEstimate
    required_quantile: IntervalEstimate
    judged_n: int
    marginal_cost: float | None = None
    steps: int = 0
    solution: Solution | None = field(default=None, repr=False)


@dataclass(frozen=True)
class _Constraint:
    """A rule: its requirement around given tolerances, and its value there."""

    name: str
    model: Callable[[Array], Requirement]
    value: Callable[[Array], float]


def yield_margin(required_yield: float, design_n: int, verify_n: int, scramblings: int = 16) -> float:
    """By how much the design's yield must exceed the required one for a verification to pass with its lower bound.

    The design is found on `design_n` points, verified on `verify_n` in so many `scramblings`; `required_yield` lies in
    0 to 1. Three standard deviations of the difference of both estimates, and the verification's own half width; both
    taken as of independent points, which scrambled ones do not exceed. Raises `HdoptError` where the margin leaves no
    yield below 1 to aim at.
    """
    variance = required_yield * (1 - required_yield)
    half_width = float(special.stdtrit(scramblings - 1, 0.975)) * math.sqrt(variance / verify_n)
    margin = half_width + 3 * math.sqrt(variance / verify_n + variance / design_n)
    if required_yield + margin >= 1:
        raise HdoptError(
            f"a yield of {required_yield:g} cannot be verified with {verify_n} samples; "
            f"take at least {math.ceil(100 / (1 - required_yield))}"
        )
    return margin


def allocate_by_yield(problem: AllocationProblem, seed: int = 1, verify_n: int = DESIGN_POINTS) -> Allocation:
    """Least cost of the `problem`'s tolerances under P(response <= limit) >= yield, with the margin of `yield_margin`
    for a verification by `verify_n` points.

    `seed` draws the model's sample, `seed` + 1 the larger one. Successive linear models of the quantile on one fixed
    sample, whose slope is the mean slope of the drives next to the quantile; then the limit is corrected by what a
    larger sample says of the quantile. Raises `Infeasible` where even the tightest tolerances do not.
    """
    target = problem.required_yield + yield_margin(problem.required_yield, DESIGN_POINTS, verify_n)
    constraint = _quantile_constraint(problem, target, seed)
    tightest = np.array([item.bounds[0] for item in problem.items])
    if np.all(tightest > 0):
        _refuse_unreachable(problem, constraint.value(tightest))
    judged: dict[bytes, Stack] = {}

    def measured(tolerances: Array) -> float:
        key = tolerances.tobytes()
        judged[key] = judged.get(key) or _judge(problem, tolerances, DESIGN_POINTS, seed + 1, (target,))
        return judged[key].quantiles[target].value

    solution, steps = _successive(problem, constraint, measured)
    tolerances = np.array(list(solution.tolerances.values()))
    return _allocation("yield", problem, solution, measured(tolerances), judged[tolerances.tobytes()], steps)


def allocate_by_worst_case(problem: AllocationProblem, seed: int = 1) -> Allocation:
    """Least cost of the `problem`'s tolerances while the largest response over their box keeps the limit.

    It is the largest as far as the search of `find_worst_case` with `seed` finds it. At the least cost several corners
    are as bad, and a model that knew one would make the others worse: all that were found stay in the model, a tangent
    each (Kelley, J. SIAM 8, 1960). Raises `Infeasible` where even the tightest tolerances do not keep the limit,
    `Unbounded` where an input is.
    """
    space, items = problem.space, problem.items
    columns = [space.index(item.name) for item in items]
    centres = np.array([space.tolerances[item.name].centre for item in items])
    corners: list[Array] = []  # in their columns the items' shares of the tolerances that they were found at

    def at_corners(tolerances: Array) -> Array:
        places = np.array(corners)
        places[:, columns] = centres + places[:, columns] * tolerances
        return evaluate(problem.response, places, space.names, "the worst corners")

    def model(tolerances: Array) -> Requirement:
        worst = find_worst_case(problem.response, problem.space_at(tolerances), seed, corners=2**15, generations=100)
        corner = np.array([worst.at[name] for name in space.names])
        corner[columns] = (corner[columns] - centres) / tolerances
        corners.append(corner)
        slopes = np.column_stack(
            [
                (at_corners(tolerances + step) - at_corners(tolerances - step)) / (2 * step[i])
                for i, step in enumerate(np.diag(STEP * tolerances))
            ]
        )
        return _tangent(problem, "worst case", at_corners(tolerances), np.maximum(slopes, 0), tolerances)

    def value(tolerances: Array) -> float:
        return find_worst_case(problem.response, problem.space_at(tolerances), seed).value

    return _by_rule(problem, _Constraint("worst case", model, value), seed)


def allocate_by_rss(problem: AllocationProblem, seed: int = 1) -> Allocation:
    """Least cost of the `problem`'s tolerances under the root-sum-square stack, its line drawn at the tolerances it
    leads to; `seed` draws the directions that the line is averaged over. Raises `Infeasible` as `allocate_by_yield`."""
    z = float(special.ndtri(problem.required_yield))
    names = [item.name for item in problem.items]

    def model(tolerances: Array) -> Requirement:
        line = linearise(problem.response, problem.space_at(tolerances), seed)
        slope = np.array([line.slopes[name] for name in names])
        mean = np.array([line.point[name] for name in names])
        spread = np.array([line.spreads[name] for name in names])
        others = [line.slopes[n] * line.spreads[n] for n in line.slopes if n not in names]
        centre = np.array([problem.space.tolerances[name].centre for name in names])
        shift = np.where(centre == 0, slope * mean / tolerances, 0.0)
        return Requirement(
            problem.limit,
            linear=shift,
            quadratic=z * np.abs(slope) * spread / tolerances,
            offset=line.value - float(shift @ tolerances),
            rest=z * math.hypot(line.turning_std, float(np.linalg.norm(others))),
            rule="rss",
        )

    def value(tolerances: Array) -> float:
        return linearise(problem.response, problem.space_at(tolerances), seed).rss(z)

    return _by_rule(problem, _Constraint("rss", model, value), seed)


def allocate_by_equal_scaling(problem: AllocationProblem, seed: int = 1) -> Allocation:
    """All tolerances of the `problem` times one factor (0.01 to 4), the largest that meets the yield on the sample that
    `seed` draws: no cost is looked at.

    Grades take the cheapest that keeps the scaled tolerance. Raises `Infeasible` where a hundredth of every tolerance
    is still too much.
    """
    from scipy.optimize import brentq

    constraint = _quantile_constraint(problem, problem.required_yield, seed)
    low, high = 1e-2, 4.0
    if constraint.value(low * problem.current) > problem.limit:
        best = constraint.value(low * problem.current)
        raise Infeasible(
            f"{_cannot_be_met(problem, 'equal scaling')}: with a hundredth of every tolerance the response is still "
            f"{best:.6g} {problem.unit}; relax the requirement",
            best,
        )
    factor = high
    if constraint.value(high * problem.current) > problem.limit:
        factor = brentq(lambda f: constraint.value(f * problem.current) - problem.limit, low, high, xtol=1e-5)
    tolerances = factor * problem.current
    grades = {}
    for i, item in enumerate(problem.items):
        low, high = item.bounds
        if isinstance(item.cost, GradeTable):
            grade = item.cost.at_most(max(tolerances[i], low))
            tolerances[i], grades[item.name] = grade.tolerance, grade.name
        else:
            tolerances[i] = min(max(tolerances[i], low), high)
    judged = _judge(problem, tolerances, COMPARE_POINTS, seed + 1)
    by_name = problem.by_name(tolerances)
    return Allocation(
        rule="equal scaling",
        tolerances=by_name,
        costs={item.name: float(item.cost.cost(by_name[item.name])) for item in problem.items},
        grades=grades,
        total_cost=total_cost(problem.items, by_name),
        modelled=constraint.value(tolerances),
        conforming=judged.conforming,
        required_quantile=judged.required_quantile,
        judged_n=judged.n,
    )


def verify(problem: AllocationProblem, tolerances: Mapping[str, float], seed: int, n: int) -> Stack:
    """The one verification: a stack of the `problem` with the allocated `tolerances` (by name), with `n` points fixed
    beforehand and a `seed` of its own."""
    at = np.array([tolerances[item.name] for item in problem.items])
    return _judge(problem, at, n, seed)


def _judge(problem: AllocationProblem, tolerances: Array, n: int, seed: int, quantiles: Sequence[float] = ()) -> Stack:
    return run_stack(
        problem.response,
        problem.space_at(tolerances),
        StackRequest(
            limit=problem.limit,
            required_yield=problem.required_yield,
            n=n,
            seed=seed,
            engine=problem.engine,
            quantiles=quantiles,
            unit=problem.unit,
        ),
    )


def _refuse_unreachable(problem: AllocationProblem, best: float, rule: str = "yield") -> None:
    """Raise `Infeasible` where `best`, the response as `rule` sees it with every tolerance at its lower bound, is above
    the limit."""
    if best > problem.limit:
        bounds = ", ".join(f"{item.name} >= {item.bounds[0]:g}" for item in problem.items)
        held = [name for name in problem.space.names if name not in {item.name for item in problem.items}]
        raise Infeasible(
            f"{_cannot_be_met(problem, f'the {rule} rule')}: with "
            f"every tolerance at its lower bound ({bounds}) the best reachable is {best:.6g} {problem.unit}"
            + (f"; {', '.join(held)} stay as they are" if held else "")
            + "; allow finer tolerances or relax the requirement",
            best,
        )


def _cannot_be_met(problem: AllocationProblem, by: str) -> str:
    """'the requirement 0.6 arcmin cannot be met by the worst case rule'; the worst case knows no yield."""
    required = "" if "worst case" in by else f" at yield {problem.required_yield:g}"
    return f"the requirement {problem.limit:g} {problem.unit}{required} cannot be met by {by}"


def _tangent(problem: AllocationProblem, rule: str, value: Array | float, slopes: Array, at: Array) -> Requirement:
    return Requirement(problem.limit, slopes, np.zeros(slopes.shape[-1]), value - slopes @ at, rule=rule)


def _quantile_constraint(
    problem: AllocationProblem, target: float, seed: int, points: int = MODEL_POINTS
) -> _Constraint:
    """The target quantile of the response on one fixed sample, as a function of the tolerances, with its tangents."""
    names = problem.space.names
    replicates = 4
    sampling = ScrambledSobol(replicates)
    u = np.concatenate(
        [
            block
            for replicate in range(replicates)
            for block in sampling.blocks(seed, replicate, points // replicates, len(names))
        ]
    )
    rank = min(math.ceil(target * len(u)), len(u)) - 1
    columns = [problem.space.index(item.name) for item in problem.items]
    centres = np.array([problem.space.tolerances[item.name].centre for item in problem.items])

    def values(inputs: Array) -> Array:
        return evaluate(problem.response, inputs, names, "the yield model")

    def value(tolerances: Array) -> float:
        return float(np.partition(values(problem.space_at(tolerances).sample(u)), rank)[rank])

    def model(tolerances: Array) -> Requirement:
        inputs = problem.space_at(tolerances).sample(u)
        y = values(inputs)
        order = np.argsort(y)
        reach = min(NEIGHBOURS, len(y) - 1 - rank)
        near = inputs[order[rank - reach : rank + reach + 1]]
        slopes = []
        for column, centre, tolerance in zip(columns, centres, tolerances, strict=True):
            wider, narrower = near.copy(), near.copy()
            wider[:, column] += STEP * (near[:, column] - centre)
            narrower[:, column] -= STEP * (near[:, column] - centre)
            slopes.append(float(np.mean(values(wider) - values(narrower))) / (2 * STEP * tolerance))
        return _tangent(problem, "yield", float(y[order[rank]]), np.maximum(slopes, 0), tolerances)

    return _Constraint("yield", model, value)


def _successive(
    problem: AllocationProblem, constraint: _Constraint, measured: Callable[[Array], float]
) -> tuple[Solution, int]:
    """Renew the convex model at its own solution until it stays there, then correct the last model's limit until the
    response as `measured` keeps the limit. Each tolerance has a reach of its own, within what a model can know."""
    at, cost, step = problem.current, math.inf, 0
    reach, before = np.full(len(at), REACH), np.zeros(len(at))
    for step in range(1, MAX_STEPS + 1):
        requirement = constraint.model(at)
        near = [_within(item, t, r) for item, t, r in zip(problem.items, at, reach, strict=True)]
        try:
            solution = solve(near, requirement)
        except Infeasible:
            # out of reach in one step: go as far down as it allows, and look again from there
            tightest = np.array([item.bounds[0] for item in near])
            if np.allclose(tightest, at, rtol=1e-9) or step == MAX_STEPS:
                _refuse_unreachable(problem, requirement.value(tightest), constraint.name)
                raise
            at, reach = tightest, np.full(len(at), REACH)
            continue
        moved = np.array(list(solution.tolerances.values()))
        went = np.log(moved / at)
        change = float(np.max(np.abs(went)))
        settled = abs(solution.total_cost - cost) <= SETTLED * abs(solution.total_cost) and change < ARRIVED
        at, cost = moved, solution.total_cost
        if settled:
            break
        reach, before = _next_reach(reach, went, before), went
    near = [_chosen(_within(item, t, 1.2), t) for item, t in zip(problem.items, at, strict=True)]
    return _corrected(problem, near, constraint.model(at), measured, constraint.name), step


def _next_reach(reach: Array, went: Array, before: Array) -> Array:
    """Factors by which each tolerance may move next, where each moved by the logarithms `went` within `reach`, and by
    `before` in the step before: more for one that is still on its way at the end of its reach, less for the others,
    which have arrived or turn to and fro. All (k,).
    """
    on_its_way = (np.abs(went) > AT_THE_END * np.log(reach)) & (went * before >= 0)
    wider = np.minimum(1 + (reach - 1) / SHRINK, REACH)
    return np.where(on_its_way, wider, np.maximum(1 + (reach - 1) * SHRINK, LEAST_REACH))


def _chosen(item: Item, tolerance: float) -> Item:
    """The item with its grade settled, so that corrections move the others only."""
    if isinstance(item.cost, GradeTable):
        return replace(item, cost=GradeTable((item.cost.nearest(tolerance),)))
    return item


def _corrected(
    problem: AllocationProblem,
    items: Sequence[Item],
    requirement: Requirement,
    measured: Callable[[Array], float],
    rule: str,
) -> Solution:
    """Solutions of one convex model of `rule` under a limit moved by what the response is measured to exceed it."""
    limit, best, value = problem.limit, None, math.inf
    for _ in range(CORRECTIONS):
        solution = solve(items, requirement.with_limit(limit))
        value = measured(np.array(list(solution.tolerances.values())))
        excess = value - problem.limit
        if excess <= 0 and (best is None or solution.total_cost < best.total_cost):
            best = solution
        moving = [item for item in items if item.name not in (*solution.grades, *solution.binding)]
        if -CLOSE * problem.limit <= excess <= 0 or (excess <= 0 and not moving):
            break
        limit -= excess + CLOSE / 2 * problem.limit
    if best is None:
        raise Infeasible(
            f"{_cannot_be_met(problem, f'the {rule} rule')}: no tolerances were found that do; the last ones reached "
            f"{value:.6g} {problem.unit}; allow finer tolerances or relax the requirement",
            value,
        )
    return best


def _within(item: Item, tolerance: float, reach: float) -> Item:
    """The item kept near a tolerance, or near the end of its bounds next to that; grades are free, they come in
    steps."""
    if item.cost.discrete:
        return item
    low, high = item.bounds
    near = min(max(tolerance, low), high)
    return replace(item, lower=min(max(near / reach, low), high * 0.999), upper=min(near * reach, high))


def _by_rule(problem: AllocationProblem, constraint: _Constraint, seed: int) -> Allocation:
    solution, steps = _successive(problem, constraint, constraint.value)
    tolerances = np.array(list(solution.tolerances.values()))
    judged = _judge(problem, tolerances, COMPARE_POINTS, seed + 1)
    return _allocation(constraint.name, problem, solution, constraint.value(tolerances), judged, steps)


def _allocation(
    rule: str, problem: AllocationProblem, solution: Solution, modelled: float, judged: Stack, steps: int
) -> Allocation:
    return Allocation(
        rule=rule,
        tolerances=solution.tolerances,
        costs=solution.costs,
        grades=solution.grades,
        total_cost=solution.total_cost,
        modelled=modelled,
        conforming=judged.conforming,
        required_quantile=judged.required_quantile,
        judged_n=judged.n,
        marginal_cost=solution.marginal_cost,
        steps=steps,
        solution=solution,
    )


def yield_cost_curve(problem: AllocationProblem, limits: Sequence[float], seed: int = 1) -> list[tuple[float, float]]:
    """(limit, least cost) of the `problem` by the yield rule at each of `limits`, NaN where it cannot be met.

    As the rule's models see it on the sample that `seed` draws, with the rule's margin but without the correction by a
    larger sample (within about 1 % of the limit).
    """
    target = problem.required_yield + yield_margin(problem.required_yield, DESIGN_POINTS, DESIGN_POINTS)
    curve = []
    for limit in limits:
        other = replace(problem, limit=float(limit))
        constraint = _quantile_constraint(other, target, seed, CURVE_POINTS)
        try:
            cost = _successive(other, constraint, constraint.value)[0].total_cost
        except Infeasible:
            cost = math.nan
        curve.append((float(limit), cost))
    return curve
