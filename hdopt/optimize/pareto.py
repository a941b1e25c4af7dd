"""Fronts between two quantities: one is minimised while the other is held to a falling limit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from hdopt.arrays import Mask
from hdopt.optimize.objectives import find_quantity
from hdopt.optimize.problem import DesignProblem, Limit
from hdopt.optimize.solve import Method, Solution, solve

T = TypeVar("T")

KEPT_EQUAL = 1e-9
"""Relative difference below which two values count as equal."""


def front_ends(
    problem: DesignProblem, second: str, method: Method, start: dict[str, float]
) -> tuple[tuple[Solution, Solution] | None, int]:
    """The ends of a front of `problem`, the best of its objective and the best of `second`, searched by `method` from
    the values `start`; None where either cannot be had. And the evaluations spent. Raises an interrupt as `front` does.
    """
    best = solve(problem, method, [start])
    extreme = solve(_with_objective(problem, second), method, [start])
    if best.outcome.interrupted or extreme.outcome.interrupted:
        raise KeyboardInterrupt
    spent = best.evaluations + extreme.evaluations
    return ((best, extreme) if best.feasible and extreme.feasible else None), spent


def front(
    problem: DesignProblem, second: str, points: int, method: Method, best: Solution, extreme: Solution
) -> list[Solution]:
    """Feasible designs of `problem` between the least objective (`best`) and the best of the quantity `second`
    (`extreme`), at most `points`, searched by `method`.

    Epsilon-constraint: the second quantity's limit is moved in even steps from what the best design has to the best it
    can be, and each search starts from its neighbour's design. Not yet freed of dominated points. An interrupt that a
    search answered with its best so far is raised here: a front that was cut off is none.
    """
    quantity = find_quantity(second)
    ends = [
        quantity.value(problem.trade, problem.space.design(problem.combination, solution.values))
        for solution in (best, extreme)
    ]
    slack = abs(ends[1]) * KEPT_EQUAL * (1 if quantity.small_is_good else -1)
    found = [best]
    for bound in np.linspace(ends[0], ends[1], points)[1:]:
        limit = Limit(second, float(bound) + slack, at_least=not quantity.small_is_good)
        limited = problem.with_limits(limit)
        solution = solve(limited, method, [found[-1].values])
        if not solution.feasible:
            solution = solve(limited, method, [extreme.values])
        if solution.feasible:
            found.append(solution)
        if solution.outcome.interrupted:
            raise KeyboardInterrupt
    return found


def _with_objective(problem: DesignProblem, objective: str) -> DesignProblem:
    limits = tuple(limit for limit in problem.limits if limit.quantity != objective)
    return replace(problem, objective=objective, limits=limits)


def non_dominated(points: ArrayLike, slack: float = 0.0) -> Mask:
    """Which rows of `points` (n, d), small is good, no other row beats in everything: boolean (n,).

    Of rows that are equal the first stays. With `slack`, a share of each value, a row is beaten by one that is better
    by more than it in one coordinate and worse by no more than it in the others: what only rounding tells apart.
    """
    rows = np.asarray(points, float)
    kept = np.ones(len(rows), bool)
    for i, row in enumerate(rows):
        margin = slack * np.abs(row)
        no_worse = (rows <= row + margin).all(axis=1)
        better = no_worse & (rows < row - margin).any(axis=1)
        equal_before = no_worse & (rows == row).all(axis=1) & (np.arange(len(rows)) < i)
        kept[i] = not (better.any() or equal_before.any())
    return kept


def pareto(items: Iterable[T], points: Sequence[Sequence[float]], slack: float = 0.0) -> list[T]:
    """The non-dominated of `items`, sorted by the first coordinate of their `points`; one must be better by more than
    the share `slack` to dominate."""
    given, places = list(items), np.asarray(points, float).reshape(-1, 2)
    chosen = np.flatnonzero(non_dominated(places, slack))
    return [given[i] for i in chosen[np.argsort(places[chosen, 0])]]


def hypervolume(points: ArrayLike, reference: Sequence[float]) -> float:
    """Area between the `points` (n, 2), small is good, and a `reference` point that is worse in both."""
    rows = np.asarray(points, float).reshape(-1, 2)
    rows = rows[(rows < np.asarray(reference)).all(axis=1)]
    if len(rows) == 0:
        return 0.0
    rows = rows[non_dominated(rows)]
    rows = rows[np.argsort(rows[:, 0])]
    right = np.append(rows[1:, 0], reference[0])
    return float(np.sum((right - rows[:, 0]) * (reference[1] - rows[:, 1])))
