"""Where a choice holds: each constant of the trade followed to either side until another choice is the better.

Every combination keeps its best design while a constant changes nothing that holds it, which costs one evaluation to
see; the others are searched anew from their last best. So a boundary is that of local searches, each from a neighbour.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from hdopt.errors import HdoptError
from hdopt.optimize.constants import Constant, constants_of
from hdopt.optimize.design_space import Combination
from hdopt.optimize.objectives import find_quantity
from hdopt.optimize.problem import DesignProblem
from hdopt.optimize.records import SearchResult
from hdopt.optimize.region_records import NONE_LEFT, Boundary, ConstantRange
from hdopt.optimize.search import method_of
from hdopt.optimize.setup import Setup
from hdopt.optimize.solve import Method, Solution, solve

STEPS = 4
"""Factors to either side of 1 at which all that may win is searched anew; in between, boundaries are bisected."""
FINE_STEPS = 12
"""The same for today's numbers, which need no search: only whether they keep the limits."""
CLOSE = 0.005
"""Share to which a boundary of structure or profile is found."""
CLOSE_DESIGN = 0.0005
"""Share to which a boundary of today's numbers is found."""
CONTENDERS = 0.05
"""Combinations within this share of the best, as it stands or at the end of the reach, are followed in between."""
RIVALS = 0.02
"""Those within this share of the best on either side of a boundary are searched anew to find it."""
EVALUATIONS = 25
"""Of a search from a neighbour's best design, which takes about 7; more change its value by less than `SAME`."""
DIGITS = 7
"""To which two problems are told apart: some constants do the same, a notch factor and a limit on the safety."""
SAME = 1e-4
"""By less than this share another combination is no better: two searches of one problem differ by as much."""
LOSS = 0.01
"""Today's numbers no longer hold where another design is better by this share."""
BROKEN = 1e-4
"""Excess over a limit, as a share of it, from which a design breaks it."""
DISTANT = 0.15
"""Combinations that are worse than today's by more than this share are not looked at, but for the best of each
structure and of each profile."""
HOPELESS = 0.25
"""A search that loses its limits, but by less than this share, is tried again, and longer."""
PATIENT = 40
"""Evaluations of such a second trial: a search that stalls outside its limits mostly finds back within these."""
HELD = 1e-5
"""A limit nearer to its bound than this share holds a design."""
UNCHANGED = 1e-8
"""Largest change of what is minimised, and of a limit that holds, that counts as none."""

Bests = Mapping[Combination, Solution]


@dataclass(frozen=True)
class Followed:
    """One constant followed, and the combinations that were the best somewhere or near it."""

    constant: Constant
    range: ConstantRange
    rivals: tuple[Combination, ...]


@dataclass(frozen=True)
class Ground:
    """What regions are found from: a search, its choice as it stands, and how combinations are searched anew."""

    setup: Setup
    method: Method
    today: Bests
    chosen: Solution
    _known: dict[tuple[object, ...], Solution] = field(default_factory=dict, repr=False, compare=False)
    """Problems solved already, by what tells them apart."""

    @staticmethod
    def of(result: SearchResult, seed: int) -> Ground:
        """From the `result` of a search; `seed` is that of the algorithms."""
        today = {solution.combination: solution for solution in result.solutions}
        method = replace(method_of(result.setup, seed), warm_evaluations=EVALUATIONS)
        return Ground(result.setup, method, today, result.chosen)

    def best(self, changed: Setup, starts: Bests) -> dict[Combination, Solution]:
        """The best design of each combination of `starts` under a `changed` setup, from where it stands there."""
        limits = tuple(limit for limit in changed.limits() if limit.quantity != changed.settings.objective)
        found = {}
        for combination, start in starts.items():
            problem = DesignProblem(changed.space, changed.trade, combination, changed.settings.objective, limits)
            found[combination] = self._moved(problem, start)
        return {combination: self._helped(solution, found) for combination, solution in found.items()}

    def _helped(self, solution: Solution, others: Bests) -> Solution:
        """`solution`, or the best from where another of the same profile stands, where that promises more: structures
        share their designs, and a local search may have stopped in a worse valley."""
        problem, best = solution.problem, solution
        for combination, other in others.items():
            if combination.profile != problem.combination.profile or other.values == solution.values:
                continue
            found = problem.evaluate(problem.place(other.values), slopes=False)
            promising = found.objective < (1 - SAME) * best.objective or not _keeps(best)
            if promising and found.violation < HOPELESS:
                tried = solve(problem, self.method, [other.values])
                best = min(best, tried, key=lambda s: _rank(s.violation, s.objective))
        return best

    def _moved(self, problem: DesignProblem, start: Solution) -> Solution:
        """The best design of `problem`, searched from `start`, or `start` itself where it still is the best."""
        if still_best(problem, start):
            return replace(start, problem=problem)
        asked = (problem.combination, *_signature(problem, self.today[problem.combination]))
        if asked not in self._known:
            found = solve(problem, self.method, [start.values])
            if _keeps(start) and BROKEN < found.violation < HOPELESS:
                patient = replace(self.method, warm_evaluations=PATIENT)
                again = solve(problem, patient, [start.values])
                found = min(found, again, key=lambda s: _rank(s.violation, s.objective))
            self._known[asked] = found
        return replace(self._known[asked], problem=problem)

    def choice(self, bests: Bests) -> Combination | None:
        """The combination to choose among `bests`: today's unless another is better by more than `SAME`; None where
        none keeps all limits."""
        found = _least(bests)
        if not _keeps(found):
            return None
        own = bests.get(self.chosen.combination)
        if own is not None and _keeps(own) and own.weighed <= (1 + SAME) * found.weighed:
            return self.chosen.combination
        return found.combination

    def excess(self, changed: Setup) -> tuple[float, str]:
        """By which share today's numbers exceed the limit that they break most under a `changed` setup (below 0: the
        room of the nearest), and that limit's title."""
        design = changed.space.design(self.chosen.combination, self.chosen.values)
        quantities = [(limit, find_quantity(limit.quantity)) for limit in changed.limits()]
        found = [(limit.excess(one.value(changed.trade, design)), one.title) for limit, one in quantities]
        return max(found, default=(-math.inf, ""))


def _rank(violation: float, objective: float) -> tuple[float, float]:
    return (0.0 if violation <= BROKEN else violation), objective


def _keeps(solution: Solution) -> bool:
    return solution.violation <= BROKEN


def _least(bests: Bests) -> Solution:
    """The best of `bests`; where none keeps all limits, the one nearest to them."""
    return min(bests.values(), key=lambda s: _rank(s.violation, s.weighed))


def _signature(problem: DesignProblem, today: Solution) -> Iterator[float]:
    """What `problem` minimises and its limits, rounded, at the design of `today` and in the middle of the cube."""
    for place in (problem.place(today.values), np.full(problem.n, 0.5)):
        try:
            found = problem.evaluate(place, slopes=False)
        except HdoptError:
            yield math.nan
        else:
            yield from (round(float(x), DIGITS) for x in (found.objective, *found.constraints))


def still_best(problem: DesignProblem, start: Solution) -> bool:
    """Whether the design of `start`, the best of its own problem, is that of `problem`: what is minimised and the
    limits that hold it are as they were, and the others are kept. (Slopes do not change alone: not looked at.)"""
    then = start.outcome.evaluation
    if then is None or not _keeps(start):
        return False
    try:
        now = problem.evaluate(problem.place(start.values), slopes=False)
    except HdoptError:
        return False
    if now.pieces.shape != then.pieces.shape or now.constraints.shape != then.constraints.shape:
        return False
    held = then.constraints > -HELD
    return bool(
        abs(now.objective - then.objective) <= UNCHANGED * abs(then.objective)
        and np.all(np.abs(now.constraints - then.constraints)[held] <= UNCHANGED)
        and np.all(now.constraints[~held] <= 0)
    )


def follow(ground: Ground, constant: Constant) -> Followed:
    """`constant` followed from `ground` to both ends of the reach: the boundaries of structure, profile and design."""
    reach = 1 + ground.setup.settings.perturbation
    boundaries: list[Boundary] = []
    rivals: dict[Combination, None] = {}
    for end in (1 / reach, reach):
        points = _walk(ground, constant, end)
        boundaries += _merged(list(_choice_boundaries(ground, constant, points)))
        boundaries += _design_boundary(ground, constant, end, points)
        for _, bests in points:
            rivals |= dict.fromkeys(contenders(bests, share=RIVALS))
    record = ConstantRange(
        constant.name, constant.value, constant.unit, constant.source, 1 / reach, reach, tuple(boundaries)
    )
    return Followed(constant, record, tuple(rivals))


def _walk(ground: Ground, constant: Constant, end: float) -> list[tuple[float, Bests]]:
    """Factors from 1 to `end` with the best designs there: of all but distant combinations at the end, of
    contenders between."""
    start = {c: ground.today[c] for c in (*contenders(ground.today, share=DISTANT), *_best_of_each(ground.today))}
    at_end = ground.best(constant.scaled(ground.setup, end), start)
    if all(solution.values == ground.today[combination].values for combination, solution in at_end.items()):
        return [(1.0, ground.today), (end, at_end)]
    watched = _watched(ground.today, at_end)
    near: Bests = {combination: ground.today[combination] for combination in watched}
    points = [(1.0, near)]
    for step in range(1, STEPS):
        factor = end ** (step / STEPS)
        near = ground.best(constant.scaled(ground.setup, factor), near)
        points.append((factor, near))
    last = {c: at_end[c] for c in watched}
    lost = {c: near[c] for c in watched if not _keeps(at_end[c]) and _keeps(near[c])}
    if lost:
        last |= ground.best(constant.scaled(ground.setup, end), lost)
    return [*points, (end, last)]


def contenders(*stages: Bests, share: float = CONTENDERS) -> list[Combination]:
    """The combinations that keep the limits within this `share` of the best at any of `stages`."""
    found: dict[Combination, None] = {}
    for bests in stages:
        feasible = {c: s for c, s in bests.items() if _keeps(s)}
        least = min((s.weighed for s in feasible.values()), default=math.inf)
        found |= dict.fromkeys(c for c, s in feasible.items() if s.weighed <= (1 + share) * least)
    return list(found)


def _watched(today: Bests, at_end: Bests) -> list[Combination]:
    """The contenders of both; and where nothing keeps the limits at the end, the best of each structure and of each
    profile today, of which any may be the last that does."""
    found = dict.fromkeys(contenders(today, at_end))
    if not any(map(_keeps, at_end.values())):
        found |= dict.fromkeys(c for c in _best_of_each(today) if c in at_end)
    return list(found)


def _best_of_each(today: Bests) -> list[Combination]:
    """The best combination of each structure and of each profile."""
    least: dict[str, Combination] = {}
    for solution in sorted(today.values(), key=lambda s: _rank(s.violation, s.weighed)):
        for level in ("structure", "profile"):
            least.setdefault(_level(level, solution.combination), solution.combination)
    return list(dict.fromkeys(least.values()))


def _level(level: str, combination: Combination | None) -> str:
    if combination is None:
        return NONE_LEFT
    return combination.structure.value if level == "structure" else combination.profile


def _choice_boundaries(ground: Ground, constant: Constant, points: list[tuple[float, Bests]]) -> Iterator[Boundary]:
    """The nearest boundaries of structure and profile on the side that `points` lie on."""
    for level in ("structure", "profile"):
        own = _level(level, ground.chosen.combination)
        for one, other in pairwise(points):
            if _level(level, ground.choice(other[1])) != own:
                yield _between(ground, constant, level, one, other)
                break


def _merged(found: list[Boundary]) -> list[Boundary]:
    """`found` with boundaries that cannot be told apart from one beyond which nothing keeps the limits turned into that
    one: the last combination to lose its limits is then a matter of rounding."""
    lost = [b for b in found if b.becomes == NONE_LEFT]
    return [
        replace(b, factor=lost[0].factor, becomes=NONE_LEFT)
        if lost and abs(math.log(b.factor / lost[0].factor)) <= 2 * CLOSE
        else b
        for b in found
    ]


def _between(
    ground: Ground, constant: Constant, level: str, one: tuple[float, Bests], other: tuple[float, Bests]
) -> Boundary:
    """The boundary of `level` between the factor of `one`, where today's choice holds, and that of the `other`."""
    own = _level(level, ground.chosen.combination)
    near = {ground.chosen.combination, *contenders(one[1], other[1], share=RIVALS)}
    if ground.choice(other[1]) is None:
        near |= set(one[1])
    starts = {c: s for c, s in one[1].items() if c in near}
    beyond = _level(level, ground.choice(other[1]))

    def holds(factor: float) -> bool:
        nonlocal beyond
        now = _level(level, ground.choice(ground.best(constant.scaled(ground.setup, factor), starts)))
        beyond = beyond if now == own else now
        return now == own

    factor = bisect(one[0], other[0], holds, CLOSE)
    return Boundary(level, factor, beyond)


def _design_boundary(
    ground: Ground, constant: Constant, end: float, points: list[tuple[float, Bests]]
) -> list[Boundary]:
    """Where, up to the factor `end`, today's numbers break a limit or fall behind the best by `LOSS`."""

    def broken(factor: float) -> str | None:
        excess, title = ground.excess(constant.scaled(ground.setup, factor))
        return title if excess > BROKEN else None

    found: list[Boundary] = []
    before = 1.0
    for step in range(1, FINE_STEPS + 1):
        after = end ** (step / FINE_STEPS)
        if title := broken(after):
            factor = bisect(before, after, lambda f: broken(f) is None, CLOSE_DESIGN)
            found.append(Boundary("design", factor, f"breaks the limit on {title[:1].lower()}{title[1:]}"))
            break
        before = after
    shares = [_behind(ground, constant, factor, bests) for factor, bests in points]
    for (low, high), (one, other) in zip(pairwise(shares), pairwise(points), strict=True):
        if high > LOSS:
            part = (LOSS - low) / (high - low)
            factor = one[0] * (other[0] / one[0]) ** part
            found.append(Boundary("design", factor, f"{100 * LOSS:g} % behind the best"))
            break
    return [min(found, key=lambda b: abs(math.log(b.factor)))] if found else []


def _behind(ground: Ground, constant: Constant, factor: float, bests: Bests) -> float:
    """By which share today's numbers miss the best of `bests`, found at `factor` times the `constant`."""
    changed = constant.scaled(ground.setup, factor)
    design = changed.space.design(ground.chosen.combination, ground.chosen.values)
    value = find_quantity(changed.settings.objective).value(changed.trade, design)
    best = _least(bests)
    own = value * changed.trade.structure_factor(ground.chosen.combination.structure)
    return own / best.weighed - 1 if _keeps(best) else 0.0


def bisect(inside: float, outside: float, holds: Callable[[float], bool], close: float) -> float:
    """The factor between `inside`, where the test `holds`, and `outside`, where it does not, to the share `close`."""
    while abs(math.log(outside / inside)) > close:
        middle = math.sqrt(inside * outside)
        if holds(middle):
            inside = middle
        else:
            outside = middle
    return math.sqrt(inside * outside)


def ranges(result: SearchResult, seed: int = 1) -> tuple[Ground, list[Followed]]:
    """Every constant of the trade of a search's `result` followed; `seed` is that of the algorithms."""
    ground = Ground.of(result, seed)
    return ground, [follow(ground, constant) for constant in constants_of(result.setup)]
