"""Stacks and sensitivities of a study: the results behind `hdopt stack` and `hdopt sobol`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hdopt.engine import Engine
from hdopt.errors import HdoptError, unknown_name
from hdopt.study import Study, load_study
from hdopt.tolerance.drive_inputs import DriveResponse, drive_problem
from hdopt.tolerance.response import Response
from hdopt.tolerance.sampling import SAMPLINGS
from hdopt.tolerance.space import InputSpace
from hdopt.tolerance.stack import Stack, run_stack

if TYPE_CHECKING:
    from hdopt.sensitivity import Shapley, Sobol
    from hdopt.tolerance.tail import Tail
    from hdopt.tolerance.worst_case import WorstCase

STACK_N = 2**18
SOBOL_N = 2**14
SHAPLEY_INPUTS = 8
"""Up to here every input is a Shapley player of its own; beyond, their groups are."""


@dataclass(frozen=True)
class StudyProblem:
    """What a study asks of its tolerances: response, inputs, limit and yield."""

    study: str
    response: Response
    space: InputSpace
    limit: float
    required_yield: float
    unit: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class StackResult:
    """A stack with what was asked for beside it."""

    study: str
    stack: Stack
    worst_case: WorstCase | None = None
    tail: Tail | None = None
    notes: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        result = {"study": self.study, **self.stack.to_dict()}
        result["notes"] = [*result["notes"], *self.notes]
        if self.worst_case is not None:
            result[f"worst_case_{self.stack.unit}"] = self.worst_case.to_dict()
        if self.tail is not None:
            result["tail"] = self.tail.to_dict()
        return result

    def to_frame(self):
        """One row a figure, with its interval."""
        return self.stack.to_frame()


@dataclass(frozen=True)
class SobolResult:
    """Sobol' indices of independent inputs, or Shapley effects; either may be absent."""

    study: str
    sobol: Sobol | None = None
    shapley: Shapley | None = None
    notes: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        result: dict[str, Any] = {"study": self.study}
        if self.shapley is not None:
            result |= self.shapley.to_dict()
        if self.sobol is not None:
            result |= self.sobol.to_dict()
        return {"groups": {}, **result, "notes": list(self.notes)}

    def to_frame(self):
        """One row an input or group; of the Shapley effects where there are no Sobol' indices."""
        return (self.sobol or self.shapley).to_frame()


def study_problem(study: Study | str | Path | None) -> StudyProblem:
    """Response, inputs and requirement of a study: its drive's, or those of its linear stack."""
    study = loaded_study(study)
    if "linear_stack" in study.sections:
        return _linear(study)
    tolerances, requirement = study.section("tolerances", "a stack"), study.section("requirement", "a stack")
    contributors = study.sections.get("contributors")
    problem = drive_problem(
        study.drive,
        tolerances.distributions(study.folder),
        held=study.errors if "errors" in study.sections else None,
        contributors=contributors.build() if contributors else None,
        correlations=[row.build() for row in tolerances.correlation],
        homogenization=_homogenization(study, requirement.homogenization),
    )
    notes = ()
    if problem.replaced:
        notes = (f"callouts take the place of the tolerances of {', '.join(problem.replaced)}",)
    limit, required = requirement.peak_to_peak_arcmin, getattr(requirement, "yield")
    response, said = with_effects(study, problem.response)
    return StudyProblem(study.name, response, problem.space, limit, required, "arcmin", (*notes, *said))


def with_effects(study: Study, response: DriveResponse) -> tuple[Response, tuple[str, ...]]:
    """`response` with the effects of the study that count, if any, and what is to be said of them.

    Where [operation] does not say which count, those of the drive do: a tolerance does not answer for the bench.
    """
    if not study.effects:
        return response, ()
    from hdopt.included import inclusion

    chosen = inclusion(study, "drive")
    if not chosen.counted:
        return response, chosen.says
    from hdopt.extended.many import tabulate
    from hdopt.extended.response import ExtendedResponse

    extended = ExtendedResponse(response, tabulate(study.drive, chosen.counted, study.operation))
    return extended, (*chosen.says, "the effects are the same in every drive: they have no tolerance")


def loaded_study(study: Study | str | Path | None) -> Study:
    """The study itself, or the one that a path or a shipped name means."""
    return study if isinstance(study, Study) else load_study(study)


def _linear(study: Study) -> StudyProblem:
    from hdopt.tolerance.linear_stack import Dimension, linear_problem

    section = study.section("linear_stack")
    response, space = linear_problem(
        {name: Dimension(d.sensitivity, d.tolerance, d.sigmas) for name, d in section.dimensions.items()}
    )
    return StudyProblem(study.name, response, space, section.gap_tolerance, section.required_yield, section.unit)


def _homogenization(study: Study, kind: str) -> float:
    if kind == "single_tooth":
        return 1.0
    from hdopt.contact import contact_angle, homogenization_coefficient, meshing_teeth

    geometry = study.drive.geometry
    angle = contact_angle(geometry, study.drive.wave_generator.profile)
    return homogenization_coefficient(meshing_teeth(geometry, angle))


def stack(
    study: Study | str | Path | None = None,
    n: int = STACK_N,
    *,
    tail: float | None = None,
    worst_case: bool = False,
    sampling: str = "sobol",
    quantiles: Sequence[float] = (),
    seed: int = 1,
    engine: Engine | str | None = None,
) -> StackResult:
    """Monte Carlo stack of a study's tolerances against its requirement, with `n` samples in all.

    `tail` adds the probability beyond that limit, `worst_case` the worst case. Raises `HdoptError` where the study has
    no tolerances, or `n` is too small.
    """
    problem = study_problem(study)
    if sampling not in SAMPLINGS:
        raise HdoptError(unknown_name("sampling", sampling, SAMPLINGS))
    result = run_stack(
        problem.response,
        problem.space,
        limit=problem.limit,
        required_yield=problem.required_yield,
        n=n,
        sampling=SAMPLINGS[sampling](),
        seed=seed,
        engine=engine,
        quantiles=quantiles,
        unit=problem.unit,
    )
    worst = rare = None
    if worst_case:
        from hdopt.tolerance.worst_case import find_worst_case

        worst = find_worst_case(problem.response, problem.space, seed)
    if tail is not None:
        from hdopt.tolerance.tail import tail_probability

        rare = tail_probability(problem.response, problem.space, tail, seed=seed)
    return StackResult(problem.study, result, worst, rare, problem.notes)


def sobol(
    study: Study | str | Path | None = None,
    n: int = SOBOL_N,
    *,
    second_order: bool = True,
    shapley: str | None = None,
    seed: int = 1,
    engine: Engine | str | None = None,
) -> SobolResult:
    """Sobol' indices of a study's inputs and groups with `n` base points in all; Shapley effects where inputs are
    correlated, or where `shapley` asks for them: 'inputs' or 'groups'."""
    from hdopt.sensitivity import run_shapley, run_sobol

    problem = study_problem(study)
    if shapley not in (None, "inputs", "groups"):
        raise HdoptError(unknown_name("set of Shapley players", shapley, ("inputs", "groups")))
    options = {"n": n, "seed": seed, "engine": engine, "unit": problem.unit}
    space, notes, indices = problem.space, list(problem.notes), None
    if space.copula.is_independent:
        indices = run_sobol(problem.response, space, second_order=second_order, **options)
    elif shapley is None:
        shapley = "inputs" if space.dimension <= SHAPLEY_INPUTS or not space.groups else "groups"
        notes.append("inputs are correlated: Shapley effects share the variance, Sobol' indices would not sum up")
    if shapley is None:
        return SobolResult(problem.study, indices, None, tuple(notes))
    players = None if shapley == "inputs" else space.groups
    effects = run_shapley(problem.response, space, players=players, **options)
    return SobolResult(problem.study, indices, effects, tuple(notes))
