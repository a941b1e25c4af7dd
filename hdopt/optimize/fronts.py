"""Fronts over all combinations: coarse ones first, then fine ones of those that win somewhere."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

from hdopt.errors import HdoptError
from hdopt.optimize.design_space import Combination
from hdopt.optimize.evaluation import record_of
from hdopt.optimize.objectives import NOMINAL, ROBUST, find_quantity
from hdopt.optimize.pareto import front, front_ends, hypervolume, pareto
from hdopt.optimize.problem import DesignProblem
from hdopt.optimize.records import DesignRecord, Front
from hdopt.optimize.setup import Setup
from hdopt.optimize.solve import Method, Solution

EQUAL = 1e-3
"""Share by which two designs of different searches may differ and still count as equal."""
COARSE = 6
"""Points of the first, coarse front of every combination; those that win nowhere are not traced further."""
Progress = Callable[[str], None]


def front_objectives(setup: Setup) -> list[str]:
    """The objectives that get a front with the second one; `setup` says whether under the tolerances too."""
    objectives = [setup.settings.objective]
    if setup.settings.robust:
        objectives = [NOMINAL, ROBUST]
    return [name for name in objectives if name != setup.settings.second_objective]


def trace_front(
    setup: Setup, method: Method, objective: str, solved: Sequence[Solution], progress: Progress
) -> tuple[Front, int]:
    """The front of `objective` and the second one over all combinations of `setup`, and the evaluations spent.

    `method` says which algorithms, `solved` holds the best design of each combination, from which its front starts;
    `progress` is told of each combination.
    """
    second, points = setup.settings.second_objective, setup.settings.front_points
    if second is None:
        raise HdoptError("a front needs two objectives; set search.second_objective")
    spent = 0
    coarse: dict[Combination, list[DesignRecord]] = {}
    ends: dict[Combination, tuple[DesignProblem, Solution, Solution]] = {}
    for solution in solved:
        progress(f"front of {solution.combination}, {objective}")
        problem = setup.problem(solution.combination, objective)
        problem = replace(problem, limits=tuple(x for x in problem.limits if x.quantity != second))
        span, cost = front_ends(problem, second, method, solution.values)
        spent += cost
        if span is None:
            continue
        found = front(problem, second, min(COARSE, points), method, *span)
        spent += sum(item.evaluations for item in found)
        ends[solution.combination] = (problem, *span)
        coarse[solution.combination] = [record_of(setup, item) for item in found]
    by_combination: dict[str, tuple[DesignRecord, ...]] = {}
    for combination, records in coarse.items():
        if points > COARSE and _wins_somewhere(combination, coarse, objective, second):
            progress(f"fine front of {combination}, {objective}")
            problem, start, extreme = ends[combination]
            found = front(problem, second, points, method, start, extreme)
            spent += sum(item.evaluations for item in found)
            records = [record_of(setup, item) for item in found]
        by_combination[str(combination)] = tuple(pareto(records, _coordinates(records, objective, second)))
    everything = [design for designs in by_combination.values() for design in designs]
    places = _coordinates(everything, objective, second)
    reference = tuple(1.01 * max(column) for column in zip(*places, strict=True)) if places else (0.0, 0.0)
    designs = tuple(pareto(everything, places, EQUAL)) if places else ()
    area = hypervolume(_coordinates(designs, objective, second), reference) if designs else 0.0
    return Front(objective, second, designs, by_combination, area, reference), spent


def _wins_somewhere(
    combination: Combination, coarse: Mapping[Combination, list[DesignRecord]], objective: str, second: str
) -> bool:
    """Whether any point of a combination's coarse front lies below every other's, taken as steps (above their true
    fronts, so that no combination is dropped that a finer front would bring back). Ends that are equal but for the
    searches' own accuracy do not count as won."""
    others = [
        place
        for other, records in coarse.items()
        if other != combination
        for place in _coordinates(records, objective, second)
    ]
    return any(
        not any(y <= own_y + EQUAL * abs(own_y) and x < own_x - EQUAL * abs(own_x) for x, y in others)
        for own_x, own_y in _coordinates(coarse[combination], objective, second)
    )


def _coordinates(records: Iterable[DesignRecord], objective: str, second: str) -> list[tuple[float, float]]:
    x, y = (1.0 if find_quantity(key).small_is_good else -1.0 for key in (objective, second))
    return [(x * d.quantities[objective], y * d.quantities[second]) for d in records]
