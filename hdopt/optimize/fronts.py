"""Fronts over all combinations: coarse ones first, then fine ones of those that win somewhere."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

from hdopt.errors import HdoptError
from hdopt.optimize.design_space import Combination
from hdopt.optimize.evaluation import record_of
from hdopt.optimize.objectives import NOMINAL, ROBUST, find_quantity
from hdopt.optimize.pareto import front, front_ends, hypervolume, pareto
from hdopt.optimize.problem import DesignProblem
from hdopt.optimize.records import DesignRecord, Front
from hdopt.optimize.setup import Setup
from hdopt.optimize.solve import Method, Solution
from hdopt.parallel.engine import engine_from, for_large_items

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
    `progress` is told of each combination. Combinations are traced on the engine in force, with the same answer on
    each. An interrupt is raised: a front that was cut off is none.
    """
    second, points = setup.settings.second_objective, setup.settings.front_points
    if second is None:
        raise HdoptError("a front needs two objectives; set search.second_objective")
    engine = for_large_items(engine_from(None))
    coarse: dict[Combination, list[DesignRecord]] = {}
    ends: dict[Combination, Span] = {}
    spent = 0

    def starts() -> Iterator[tuple[DesignProblem, dict[str, float]]]:
        for solution in solved:
            progress(f"front of {solution.combination}, {objective}")
            problem = setup.problem(solution.combination, objective)
            limits = tuple(limit for limit in problem.limits if limit.quantity != second)
            yield replace(problem, limits=limits), solution.values

    for span, found, cost in engine.map(partial(_coarse, method, second, min(COARSE, points)), starts()):
        spent += cost
        if span is not None:
            combination = span[0].combination
            ends[combination] = span
            coarse[combination] = [record_of(setup, item) for item in found]
    winners = [c for c in coarse if points > COARSE and _wins_somewhere(c, coarse, objective, second)]

    def spans() -> Iterator[Span]:
        for combination in winners:
            progress(f"fine front of {combination}, {objective}")
            yield ends[combination]

    records = dict(coarse)
    for combination, found in zip(winners, engine.map(partial(_fine, method, second, points), spans()), strict=True):
        spent += sum(item.evaluations for item in found)
        records[combination] = [record_of(setup, item) for item in found]
    by_combination = {
        str(combination): tuple(pareto(made, _coordinates(made, objective, second)))
        for combination, made in records.items()
    }
    everything = [design for designs in by_combination.values() for design in designs]
    places = _coordinates(everything, objective, second)
    reference = tuple(1.01 * max(column) for column in zip(*places, strict=True)) if places else (0.0, 0.0)
    designs = tuple(pareto(everything, places, EQUAL)) if places else ()
    area = hypervolume(_coordinates(designs, objective, second), reference) if designs else 0.0
    return Front(objective, second, designs, by_combination, area, reference), spent


Span = tuple[DesignProblem, Solution, Solution]
"""A problem with the ends of its front."""


def _coarse(
    method: Method, second: str, points: int, piece: tuple[DesignProblem, dict[str, float]]
) -> tuple[Span | None, list[Solution], int]:
    """The coarse front of one combination from where it starts: its ends, the designs, the evaluations spent."""
    problem, start = piece
    ends, spent = front_ends(problem, second, method, start)
    if ends is None:
        return None, [], spent
    found = front(problem, second, points, method, *ends)
    return (problem, *ends), found, spent + sum(item.evaluations for item in found)


def _fine(method: Method, second: str, points: int, span: Span) -> list[Solution]:
    problem, best, extreme = span
    return front(problem, second, points, method, best, extreme)


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
