"""`hdopt.search`: from a study to the best design, the fronts, what limits cost, and how sure the choice is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from hdopt.errors import MissingValue
from hdopt.study import Study
from hdopt.trade.front import front, front_ends, hypervolume, pareto
from hdopt.trade.minimax import GLOBAL, LOCAL
from hdopt.trade.nlopt_guard import INTERRUPTED, Effort, find_algorithm
from hdopt.trade.prices import prices
from hdopt.trade.problem import DesignProblem
from hdopt.trade.quantities import NOMINAL, QUANTITIES, ROBUST, find_quantity
from hdopt.trade.setup import Setup, setup_of
from hdopt.trade.solve import Method, Solution, solve
from hdopt.trade.space import Combination, Design

EQUAL = 1e-3
"""Share by which two designs of different searches may differ and still count as equal."""
COARSE = 6
"""Points of the first, coarse front of every combination; those that win nowhere are not traced further."""
Progress = Callable[[str], None]


@dataclass(frozen=True)
class DesignRecord:
    """One design in plain numbers: its choices, the variables by their study key, and every quantity."""

    profile: str
    structure: str
    variables: dict[str, float]
    quantities: dict[str, float]
    feasible: bool = True
    broken_limits: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)

    @property
    def name(self) -> str:
        return f"{self.profile}, {self.structure}"


@dataclass(frozen=True)
class Front:
    """Non-dominated designs between two quantities, and each combination's own front."""

    objective: str
    second: str
    designs: tuple[DesignRecord, ...]
    by_combination: dict[str, tuple[DesignRecord, ...]]
    hypervolume: float
    reference: tuple[float, float]


@dataclass(frozen=True)
class SearchResult:
    """What a search found. `best` is feasible unless `feasible` says no; then it is the design nearest to the limits.

    `active` lists limits and bounds that hold the best design, with the price of each; `optimality_residual` is how far
    the first-order conditions are from holding there, as a share of the objective's slope.
    """

    study: str
    objective: str
    second: str | None
    feasible: bool
    best: DesignRecord
    baseline: DesignRecord
    combinations: tuple[DesignRecord, ...]
    fronts: tuple[Front, ...]
    limits: tuple[str, ...]
    active: tuple[dict[str, Any], ...]
    optimality_residual: float
    evaluations: int
    impossible: int
    algorithm: str
    stopped_because: str
    interrupted: bool
    setup: Setup
    solutions: tuple[Solution, ...]
    notes: tuple[str, ...] = ()

    @property
    def chosen(self) -> Solution:
        """The solution behind `best`."""
        return choose(self.solutions)

    @property
    def front(self) -> tuple[DesignRecord, ...]:
        """The front of the study's own objective, the nominal one where both were made."""
        return self.fronts[0].designs if self.fronts else ()

    def to_dict(self) -> dict[str, Any]:
        return {
            "study": self.study,
            "objective": self.objective,
            "second_objective": self.second,
            "feasible": self.feasible,
            "best": self.best.to_dict(),
            "baseline": self.baseline.to_dict(),
            "front": [design.to_dict() for design in self.front],
            "fronts": [
                {
                    "objective": found.objective,
                    "second_objective": found.second,
                    "hypervolume": found.hypervolume,
                    "reference": list(found.reference),
                    "designs": [design.to_dict() for design in found.designs],
                }
                for found in self.fronts
            ],
            "combinations": [design.to_dict() for design in self.combinations],
            "limits": list(self.limits),
            "active": list(self.active),
            "optimality_residual": self.optimality_residual,
            "evaluations": self.evaluations,
            "impossible_designs": self.impossible,
            "algorithm": self.algorithm,
            "stopped_because": self.stopped_because,
            "notes": list(self.notes),
        }

    def to_frame(self):
        """The front as a table."""
        import pandas as pd

        rows = [{"profile": d.profile, "structure": d.structure, **d.variables, **d.quantities} for d in self.front]
        return pd.DataFrame(rows)


def search(study: Study, seed: int = 1, progress: Progress = lambda stage: None, fronts: bool = True) -> SearchResult:
    """Search a study's designs for the best, and for fronts between its two objectives.

    Every combination of profile and structure gets a global start and a local search; the best of all is chosen. An
    interrupt (Ctrl-C) ends the search with the best so far. `progress` is told what comes next.
    """
    setup = setup_of(study, seed)
    method = method_of(setup, seed)
    solved: list[Solution] = []
    made: list[Front] = []
    interrupted = False
    evaluations = 0
    try:
        for combination in setup.space.combinations:
            progress(str(combination))
            solution = solve(setup.problem(combination), method)
            evaluations += solution.evaluations
            solved.append(solution)
            if solution.outcome.interrupted:
                raise KeyboardInterrupt
        if fronts and setup.section.second_objective:
            for objective in _front_objectives(setup):
                found, spent = _front(setup, method, objective, solved, progress)
                made.append(found)
                evaluations += spent
    except KeyboardInterrupt:
        interrupted = True
        if not solved:
            raise
    best = choose(solved)
    held, residual = prices(best.problem, best.values)
    return SearchResult(
        study=study.name,
        objective=setup.section.objective,
        second=setup.section.second_objective,
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
        notes=_notes(study),
    )


def _notes(study: Study) -> tuple[str, ...]:
    """What is to be said of the study's effects."""
    if not study.effects:
        return ()
    from hdopt.included import inclusion

    chosen = inclusion(study, "drive")
    carried = (
        "the effects found on the study's drive are carried over to every design: a radial one follows the pressure "
        "angle, the others stay; the lag is without them"
    )
    return (*chosen.says, carried) if chosen.counted else chosen.says


def method_of(setup: Setup, seed: int) -> Method:
    """The algorithms a study names, or those chosen by comparison."""
    section = setup.section
    names = section.global_algorithm or GLOBAL, section.local_algorithm or LOCAL
    for name in names:
        find_algorithm(name)
    return Method(*names, local=Effort(seed=seed))


def choose(solutions: Sequence[Solution]) -> Solution:
    """The least objective of the feasible ones; where none is, the one nearest to the limits."""
    return min(solutions, key=lambda s: (0.0 if s.feasible else s.violation, s.objective))


def _front_objectives(setup: Setup) -> list[str]:
    objectives = [setup.section.objective]
    if setup.section.robust:
        objectives = [NOMINAL, ROBUST]
    return [name for name in objectives if name != setup.section.second_objective]


def _front(
    setup: Setup, method: Method, objective: str, solved: list[Solution], progress: Progress
) -> tuple[Front, int]:
    second, points = setup.section.second_objective, setup.section.front_points
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


def _wins_somewhere(combination, coarse, objective: str, second: str) -> bool:
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


def _coordinates(records, objective: str, second: str) -> list[tuple[float, float]]:
    signs = [1.0 if find_quantity(key).small_is_good else -1.0 for key in (objective, second)]
    return [tuple(s * d.quantities[key] for s, key in zip(signs, (objective, second), strict=True)) for d in records]


def record_of(setup: Setup, solution: Solution) -> DesignRecord:
    """A solution in plain numbers."""
    design = setup.space.design(solution.combination, solution.values)
    return record(setup, design, solution)


def record(setup: Setup, design: Design, solution: Solution | None = None) -> DesignRecord:
    """A design in plain numbers; its peak-to-peak is the converged one, not the envelope that the search works on."""
    from hdopt.kinematics import peak_to_peak_arcmin

    found = {}
    for key, quantity in QUANTITIES.items():
        try:
            found[key] = quantity.value(setup.trade, design)
        except MissingValue:
            continue
    if setup.trade.added is None and isinstance(design.drive.geometry.flexspline_teeth, int):
        found[NOMINAL] = float(peak_to_peak_arcmin(design.drive, setup.trade.errors))
    limits = setup.limits() if solution is None else solution.problem.limits
    broken = tuple(str(x) for x in limits if x.quantity in found and x.excess(found[x.quantity]) > 1e-5)
    combination: Combination = design.combination
    return DesignRecord(
        combination.profile,
        combination.structure.value,
        dict(design.values),
        found,
        not broken if solution is None else solution.feasible,
        broken,
    )
