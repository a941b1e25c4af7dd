"""The best design of a search, the fronts it was chosen from, and what its limits cost."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial

from hdopt.interruption import answering_interruptions
from hdopt.optimize.evaluation import record, record_of
from hdopt.optimize.fronts import Progress, front_objectives, trace_front
from hdopt.optimize.minimax import GLOBAL, LOCAL
from hdopt.optimize.multipliers import prices
from hdopt.optimize.nearest import nearest
from hdopt.optimize.nlopt_adapter import INTERRUPTED, Effort, find_algorithm
from hdopt.optimize.problem import DesignProblem
from hdopt.optimize.records import Front, SearchResult, choose
from hdopt.optimize.setup import Setup
from hdopt.optimize.solve import Method, Solution, solve
from hdopt.parallel.engine import engine_from, for_large_items


class Interrupted(Exception):
    """Ctrl-C came while a combination was being solved; `solution` is the best of it so far. It is raised, not
    returned, so that no engine keeps it for a finished part."""

    def __init__(self, solution: Solution) -> None:
        super().__init__(solution)
        self.solution = solution


@answering_interruptions()
def search_designs(
    setup: Setup,
    seed: int = 1,
    progress: Progress = lambda stage: None,
    *,
    fronts: bool = True,
    study: str = "",
    notes: tuple[str, ...] = (),
) -> SearchResult:
    """Search the designs of `setup` for the best, and for `fronts` between its two objectives.

    Every combination of profile and structure gets a global start and a local search, on the engine in force and with
    the same answer on each; the best of all is chosen. An interrupt (Ctrl-C) ends the search with the best so far.
    `seed` is that of the algorithms, `progress` is told what comes next, with `fronts` those between two objectives are
    traced as well, `study` and `notes` are passed on to the result.
    """
    method = method_of(setup, seed)
    solved: list[Solution] = []
    made: list[Front] = []
    interrupted = False
    evaluations = 0
    try:
        for solution in _each_solved(setup, method, progress):
            evaluations += solution.evaluations
            solved.append(solution)
        if fronts and setup.settings.second_objective:
            for objective in front_objectives(setup):
                found, spent = trace_front(setup, method, objective, solved, progress)
                made.append(found)
                evaluations += spent
        if not choose(solved).feasible:
            solved, spent = _nearest(setup, method, solved)
            evaluations += spent
    except KeyboardInterrupt:
        interrupted = True
        if not solved:
            raise
    best = choose(solved)
    held, residual = prices(best.problem, best.values) if best.feasible else ([], math.nan)
    return SearchResult(
        study=study,
        objective=setup.settings.objective,
        second=setup.settings.second_objective,
        feasible=best.feasible,
        best=record_of(setup, best),
        baseline=record(setup, setup.baseline),
        combinations=tuple(record_of(setup, solution) for solution in solved),
        fronts=tuple(made),
        limits=tuple(map(str, setup.limits())),
        active=tuple(price.to_dict() for price in held),
        optimality_residual=residual,
        evaluations=evaluations,
        impossible=sum(solution.outcome.impossible for solution in solved),
        algorithm=f"{method.global_algorithm}, then {method.local_algorithm}",
        stopped_because=INTERRUPTED if interrupted else best.outcome.stopped_because,
        interrupted=interrupted,
        setup=setup,
        solutions=tuple(solved),
        notes=notes,
    )


def _nearest(setup: Setup, method: Method, solved: Sequence[Solution]) -> tuple[list[Solution], int]:
    """Of each of the `solved` combinations, none of which keeps the limits of `setup`, the design nearest to them by
    `method`; and how many designs that took."""
    found = [nearest(setup.problem(solution.combination), solution, method) for solution in solved]
    return found, sum(new.evaluations - old.evaluations for new, old in zip(found, solved, strict=True))


def _each_solved(setup: Setup, method: Method, progress: Progress) -> Iterator[Solution]:
    """The solution of each combination, the interrupted one too before the interrupt goes on."""
    try:
        yield from for_large_items(engine_from(None)).map(partial(_solved, method), _problems(setup, progress))
    except Interrupted as cut:
        yield cut.solution
        raise KeyboardInterrupt from cut


def _problems(setup: Setup, progress: Progress) -> Iterator[DesignProblem]:
    for combination in setup.space.combinations:
        progress(str(combination))
        yield setup.problem(combination)


def _solved(method: Method, problem: DesignProblem) -> Solution:
    solution = solve(problem, method)
    if solution.outcome.interrupted:
        raise Interrupted(solution)
    return solution


def method_of(setup: Setup, seed: int) -> Method:
    """The algorithms that `setup` names, or those chosen by comparison, with `seed` for what they do at random."""
    settings = setup.settings
    names = settings.global_algorithm or GLOBAL, settings.local_algorithm or LOCAL
    for name in names:
        find_algorithm(name)
    return Method(*names, local=Effort(seed=seed))
