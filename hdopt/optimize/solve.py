"""Solving one combination: a global start, a local search, then standard values for the variables that have steps."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import reduce

import numpy as np

from hdopt.optimize.design_space import Combination, Variable
from hdopt.optimize.minimax import GLOBAL, LOCAL, explore, minimise
from hdopt.optimize.nlopt_adapter import Effort, Outcome
from hdopt.optimize.objectives import NOMINAL, ROBUST
from hdopt.optimize.problem import DesignProblem

DECIMALS = 5
"""Of shares of a bound by which limits are broken: as finely as a record says whether one is."""


@dataclass(frozen=True)
class Solution:
    """A solved combination: its values of the variables, and how NLopt came to them."""

    problem: DesignProblem
    values: dict[str, float]
    outcome: Outcome
    evaluations: int

    @property
    def combination(self) -> Combination:
        return self.problem.combination

    @property
    def feasible(self) -> bool:
        return self.outcome.feasible

    @property
    def objective(self) -> float:
        return self.outcome.evaluation.objective if self.outcome.evaluation else np.inf

    @property
    def weighed(self) -> float:
        """The objective with what the structure costs: what designs of different structures are compared by."""
        return self.objective * self.problem.trade.structure_factor(self.combination.structure)

    @property
    def violation(self) -> float:
        return self.outcome.evaluation.violation if self.outcome.evaluation else np.inf

    @property
    def broken(self) -> tuple[float, float]:
        """By how much the limit is broken that is broken most, and all of them together, in shares of their bounds;
        without what rounding adds, by which designs that break the same one alike would differ."""
        if self.outcome.evaluation is None:
            return np.inf, np.inf
        excess = np.maximum(self.outcome.evaluation.constraints, 0.0)
        return round(float(excess.max(initial=0.0)), DECIMALS), round(float(excess.sum()), DECIMALS)


@dataclass(frozen=True)
class Method:
    """Which algorithms, and how much each may do."""

    global_algorithm: str = GLOBAL
    local_algorithm: str = LOCAL
    global_evaluations: int = 150
    warm_evaluations: int = 40
    """Of a local search that starts from a neighbour's optimum, which takes about 7."""
    local: Effort = field(default_factory=Effort)


def solve(problem: DesignProblem, method: Method, starts: Sequence[dict[str, float]] = ()) -> Solution:
    """Best design of the combination of `problem` by `method`. Without `starts` (values by variable) a global search
    finds one; the baseline is tried as well.

    Variables with standard values are first free, then set to the values next to what they came to, every combination
    of neighbours, and the rest searched again. A heuristic: `tests/unit/test_optimize_search.py` compares it with
    trying all values.
    """
    spent, local = 0, method.local
    if starts:
        local = replace(local, evaluations=method.warm_evaluations)
        places = [problem.place(values) for values in starts]
    else:
        effort = replace(method.local, evaluations=method.global_evaluations)
        found = explore(_cheap(problem), method.global_algorithm, effort)
        spent += found.evaluations
        if found.interrupted:
            return Solution(problem, problem.values(found.u), found, spent)
        places = [found.u, problem.place(problem.space.baseline_values)]
    outcomes: list[Outcome] = []
    for place in places:
        outcomes.append(minimise(problem, place, method.local_algorithm, local))
        spent += outcomes[-1].evaluations
        if outcomes[-1].interrupted:
            break
    best = reduce(lambda one, other: other if other.better_than(one) else one, outcomes)
    stepped = [variable for variable in problem.variables if variable.values]
    if not stepped or best.interrupted:
        return Solution(problem, problem.values(best.u), best, spent)
    return _on_steps(problem, method, problem.values(best.u), stepped, spent)


def _cheap(problem: DesignProblem) -> DesignProblem:
    """For a global start only: the nominal error stands in for its quantile, which a thousand drives make."""
    return replace(problem, objective=NOMINAL) if problem.objective == ROBUST else problem


def _on_steps(
    problem: DesignProblem, method: Method, values: dict[str, float], stepped: list[Variable], spent: int
) -> Solution:
    for reach in (1, 2, 4):
        found: list[Solution] = []
        for chosen in itertools.product(*(_neighbours(v, values[v.name], reach) for v in stepped)):
            narrowed = problem.with_fixed(**{v.name: x for v, x in zip(stepped, chosen, strict=True)})
            outcome = minimise(narrowed, narrowed.place(values), method.local_algorithm, method.local)
            spent += outcome.evaluations
            found.append(Solution(narrowed, narrowed.values(outcome.u), outcome, spent))
            if outcome.interrupted:
                break
        best = reduce(lambda one, other: other if other.outcome.better_than(one.outcome) else one, found)
        if best.feasible or found[-1].outcome.interrupted:
            break
    return replace(best, evaluations=spent)


def _neighbours(variable: Variable, value: float, reach: int) -> tuple[float, ...]:
    """Up to `reach` standard values on either side; a value that is standard stands alone."""
    allowed = np.array(sorted(variable.values))
    near = np.flatnonzero(np.isclose(allowed, value, rtol=1e-9))
    if len(near) and reach == 1:
        return (float(allowed[near[0]]),)
    place = int(np.searchsorted(allowed, value))
    return tuple(float(x) for x in allowed[max(place - reach, 0) : place + reach])
