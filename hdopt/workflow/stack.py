"""Stacks and sensitivities of a study: the results behind `hdopt stack` and `hdopt sobol`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np

from hdopt.drive.errors import PHASE_OF, DriveErrors, study_key
from hdopt.drive.geometry import Drive
from hdopt.errors import HdoptError, unknown_name
from hdopt.kinematics.model_error import WORTH_A_WORD_ARCMIN, ModelError, model_error
from hdopt.kinematics.waveform import CLOSED_FORM, EXACT
from hdopt.parallel.engine import Engine
from hdopt.study import AnyStudy, Study, as_study
from hdopt.study.tolerances import (
    ContributorsSection,
    LinearStackSection,
    RequirementSection,
    TolerancesBase,
    TolerancesSection,
)
from hdopt.tolerance.copula import CorrelationGroup
from hdopt.tolerance.distributions import Distribution
from hdopt.tolerance.drive_inputs import DriveProblem, DriveResponse, drive_problem
from hdopt.tolerance.exact_response import MOST_DRIVES, ExactResponse
from hdopt.tolerance.linear_stack import LinearResponse
from hdopt.tolerance.linearise import DIRECTIONS
from hdopt.tolerance.response import Response
from hdopt.tolerance.results import SobolResult, StackResult
from hdopt.tolerance.sampling import SAMPLINGS
from hdopt.tolerance.screening import Screening, run_screening
from hdopt.tolerance.space import InputSpace
from hdopt.tolerance.stack import StackRequest, run_stack
from hdopt.tolerance.worst_case import WorstCase
from hdopt.workflow.measured_parts import words_on_measured_parts
from hdopt.workflow.placed import numbers_named

STACK_N = 2**18
USUAL_YIELD = 0.9973
"""Share of drives that must keep a limit where nobody says: as many as lie within 3 standard deviations of a normal."""
SOBOL_N = 2**14
FEWEST_DIRECTIONS = 128
PILOT_N, PILOT_MEASURED = 512, 32
"""Drives of which the pilot for the model error takes the largest and some others; with measured teeth, which take
long."""
STACK_GEOMETRIES = (CLOSED_FORM, EXACT, "auto")
SHAPLEY_INPUTS = 8
"""Up to here every input is a Shapley player of its own; beyond, their groups are."""


@dataclass(frozen=True)
class ToleranceProblem:
    """What is asked of tolerances: the `response` to the inputs of a `space`, its upper `limit` in `unit`, and the
    share of drives that must keep it. `study` is its name, `notes` what is to be said of it, `pitch` by spline the
    figures of teeth that are drawn from tolerances of pitch, `geometry` that of a stack's sampled drives (see `by`)."""

    study: str
    response: Response
    space: InputSpace
    limit: float
    required_yield: float
    unit: str
    notes: tuple[str, ...] = ()
    pitch: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    geometry: str = CLOSED_FORM

    def by(self, geometry: str) -> ToleranceProblem:
        """The problem with the drives that a stack samples by another `geometry`: 'closed form', 'exact' for up to
        `MOST_DRIVES`, or 'auto', exact where a pilot finds the closed form too far off and the drives are that few.
        Raises `HdoptError` for one that is none."""
        if geometry not in STACK_GEOMETRIES:
            raise HdoptError(unknown_name("geometry", geometry, STACK_GEOMETRIES))
        return replace(self, geometry=geometry)

    @classmethod
    def of_drive(
        cls,
        drive: Drive,
        tolerances: Mapping[str, Distribution],
        limit: float,
        required_yield: float = USUAL_YIELD,
        *,
        errors: DriveErrors | None = None,
        correlations: Sequence[CorrelationGroup] = (),
        homogenization: float = 1.0,
    ) -> ToleranceProblem:
        """The problem of records, for calls that need no study.

        `drive` and the distributions of its errors, `tolerances`, by study key (mm, deg); `limit` (arcmin) of the
        kinematic error's peak-to-peak, which the share `required_yield` of drives must keep. What is toleranced
        nowhere keeps its value in `errors`; `correlations` group inputs that vary together; `homogenization` is k_e.
        Raises `HdoptError` for a key that is not an error, and for a magnitude that could be negative.
        """
        problem = drive_problem(
            drive, tolerances, held=errors, correlations=correlations, homogenization=homogenization
        )
        notes = _freed(problem.freed)
        return cls("drive", problem.response, problem.space, limit, required_yield, "arcmin", notes)


AnyProblem: TypeAlias = ToleranceProblem | AnyStudy
"""What the calls about tolerances take: a problem made of records, or a study, its name or its path."""


@numbers_named
def study_problem(study: AnyProblem) -> ToleranceProblem:
    """Response, inputs and requirement of a `study`, or of its name or path: its drive's, or those of its linear stack;
    a problem as it is.

    Raises `HdoptError` where it has no [tolerances] or no [requirement], and no [linear_stack].
    """
    if isinstance(study, ToleranceProblem):
        return study
    study = as_study(study)
    if "linear_stack" in study.sections:
        return _linear(study)
    problem, requirement = drive_problem_of(study), study.section("requirement", RequirementSection, "a stack")
    notes = []
    if problem.replaced:
        notes.append(f"callouts take the place of the tolerances of {', '.join(problem.replaced)}")
    notes += _freed(problem.freed)
    notes += words_on_graded_teeth(problem)
    notes += words_on_measured_parts(study.drive)
    response, said = with_effects(study, problem.response)
    return ToleranceProblem(
        study.name,
        response,
        problem.space,
        requirement.peak_to_peak_arcmin,
        requirement.required_yield,
        "arcmin",
        (*notes, *said),
        {spline: given.to_dict(_teeth_of(study.drive, spline)) for spline, given in problem.graded.items()},
    )


def needed_beside_the_drive(study: Study) -> tuple[str, ...]:
    """The sections that a stack of drives of `study` needs beside those of the drive: callouts may stand in place of
    tolerances."""
    contributors = study.find("contributors", ContributorsSection)
    varies = () if contributors is not None and contributors.rows else ("tolerances",)
    return (*varies, "requirement")


@numbers_named
def drive_problem_of(study: Study) -> DriveProblem:
    """The drives of a `study` under its [tolerances] and [contributors], without effects: their response, arcmin, and
    their random inputs. Raises `HdoptError` where it has neither of both or no [requirement]."""
    contributors = study.find("contributors", ContributorsSection)
    study.require(("drive", "wave_generator", *needed_beside_the_drive(study)), "a stack")
    tolerances = study.find("tolerances", TolerancesBase) or TolerancesSection()
    requirement = study.section("requirement", RequirementSection, "a stack")
    return drive_problem(
        study.drive,
        _not_measured(study, tolerances.distributions(study.folder)),
        held=study.errors if "errors" in study.sections else None,
        contributors=contributors.build() if contributors else None,
        correlations=[row.build() for row in tolerances.correlation],
        homogenization=_homogenization(study, requirement.homogenization),
        graded=tolerances.graded(study.drive.geometry),
    )


def words_on_graded_teeth(problem: DriveProblem) -> list[str]:
    """What teeth that are drawn from tolerances of pitch in `problem` rest on, a sentence each."""
    drive = problem.response.drive
    return [words for spline, given in problem.graded.items() for words in given.says(spline, _teeth_of(drive, spline))]


def _teeth_of(drive: Drive, spline: str) -> int:
    gear = drive.geometry
    return {"cs_teeth": gear.circular_spline_teeth, "fs_teeth": gear.flexspline_teeth}[spline]


def _freed(names: Sequence[str]) -> tuple[str, ...]:
    return (f"[tolerances] does not give {', '.join(names)}: free over the full turn",) if names else ()


def _not_measured(study: Study, distributions: dict[str, Distribution]) -> dict[str, Distribution]:
    """Without those of tooth sines that measured teeth stand instead of."""
    left_out = {key for name in study.measured_instead for key in (study_key(name), study_key(PHASE_OF[name]))}
    return {key: distribution for key, distribution in distributions.items() if key not in left_out}


def with_effects(study: Study, response: DriveResponse) -> tuple[Response, tuple[str, ...]]:
    """`response` with the effects of the study that count, if any, and what is to be said of them.

    Where [operation] does not say which count, those of the drive do: a tolerance does not answer for the bench.
    """
    if not study.effects:
        return response, ()
    from hdopt.workflow.effect_selection import inclusion

    chosen = inclusion(study, "drive")
    if not chosen.counted:
        return response, chosen.says
    from hdopt.simulation.batch import tabulate
    from hdopt.tolerance.drive_effects import ExtendedResponse

    extended = ExtendedResponse(response, tabulate(study.drive, chosen.counted, study.operation))
    return extended, (*chosen.says, "the effects are the same in every drive: they have no tolerance")


def _linear(study: Study) -> ToleranceProblem:
    from hdopt.tolerance.linear_stack import Dimension, linear_problem

    section = study.section("linear_stack", LinearStackSection)
    response, space = linear_problem(
        {name: Dimension(d.sensitivity, d.tolerance, d.sigmas) for name, d in section.dimensions.items()}
    )
    return ToleranceProblem(study.name, response, space, section.gap_tolerance, section.required_yield, section.unit)


def _homogenization(study: Study, kind: str) -> float:
    if kind == "single_tooth":
        return 1.0
    from hdopt.mechanics.contact_model import contact_of

    return contact_of(study.drive).homogenization()


@numbers_named
def stack(
    study: AnyProblem = None,
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

    `study` is a study, its name or its path, or a problem made of records (`ToleranceProblem.of_drive`). `tail` adds
    the probability beyond that limit, `worst_case` the worst case. `sampling` is 'sobol' or 'monte-carlo', `seed` its
    seed; `quantiles` are reported beside the usual ones; `engine` computes the sample (threads, processes or a
    cluster). Raises `HdoptError` where the study has no tolerances, or `n` is too small.
    """
    problem = study_problem(study)
    if sampling not in SAMPLINGS:
        raise HdoptError(unknown_name("sampling", sampling, SAMPLINGS))
    method, distance = _method(problem, seed)
    exact = _exact_response(problem, n, distance)
    result = run_stack(
        exact or problem.response,
        problem.space,
        StackRequest(
            limit=problem.limit,
            required_yield=problem.required_yield,
            n=n,
            sampling=SAMPLINGS[sampling](),
            seed=seed,
            engine=engine,
            quantiles=quantiles,
            unit=problem.unit,
            linearised=problem.response,
            directions=_directions(problem, n),
        ),
    )
    worst = rare = None
    notes = [*problem.notes]
    if worst_case:
        from hdopt.tolerance.worst_case import Unbounded, find_worst_case

        try:
            worst = find_worst_case(problem.response, problem.space, seed)
        except Unbounded as error:
            notes.append(f"the worst case is left out: {error}")
    if tail is not None:
        from hdopt.tolerance.tail import tail_probability

        rare = tail_probability(problem.response, problem.space, tail, seed=seed, engine=engine)
    if worst is not None:
        notes += _exact_at(problem, worst)
    if distance is not None and distance.says is not None:
        notes.append(distance.says)
    if exact is not None:
        method = EXACT
        notes.append("the sampled drives are computed by the exact geometry; worst case and tail by the closed form")
    return StackResult(problem.study, result, worst, rare, tuple(notes), method, distance, problem.pitch)


def _exact_response(problem: ToleranceProblem, n: int, distance: ModelError | None) -> ExactResponse | None:
    """The response of `problem` by the exact geometry where it asks for it, for `n` drives whose closed form is at a
    `distance` from it; None where the closed form is taken. Raises `HdoptError` where there is none, or `n` is too
    many."""
    response, asked = problem.response, problem.geometry
    too_far = distance is not None and distance.says is not None
    if asked == CLOSED_FORM or (asked != EXACT and (n > MOST_DRIVES or not too_far)):
        return None
    if isinstance(response, DriveResponse) and not response.drive.wave_generator.profile.tip_is_smooth:
        return None  # a measured cam has no other geometry than the exact one
    if not isinstance(response, DriveResponse) or response.teeth or response.drive.has_measured_teeth:
        if asked != EXACT:
            return None
        raise HdoptError("the exact geometry of a stack is for drives without effects whose teeth are sines")
    if n > MOST_DRIVES:
        raise HdoptError(f"{n} drives by the exact geometry take too long; ask for up to {MOST_DRIVES}, with -n")
    return ExactResponse(response)


def _directions(problem: ToleranceProblem, n: int) -> int:
    """Directions that the straight line of `problem` is averaged over, where its sample has `n` drives: where each
    drive is dear, the line takes no more drives than the sample, or 128 directions."""
    if not _is_dear(problem.response):
        return DIRECTIONS
    most = n // (2 * len(problem.space.names) + 1)
    return min(DIRECTIONS, max(FEWEST_DIRECTIONS, 1 << max(most, 1).bit_length() - 1))


def _is_dear(response: Response) -> bool:
    """Whether a drive takes some thousand times as long as the closed form: on a measured cam, or with effects where
    every drive has teeth of its own."""
    if isinstance(response, DriveResponse | LinearResponse):
        return isinstance(response, DriveResponse) and not response.drive.wave_generator.profile.tip_is_smooth
    from hdopt.tolerance.drive_effects import ExtendedResponse

    return isinstance(response, ExtendedResponse) and response.has_own_teeth


def _method(problem: ToleranceProblem, seed: int) -> tuple[str | None, ModelError | None]:
    """The method of the drives' kinematic error, and how far it is from the exact geometry, for a pilot of drives."""
    response = problem.response
    if not isinstance(response, DriveResponse):
        return (None if isinstance(response, LinearResponse) else CLOSED_FORM), None
    if not response.drive.wave_generator.profile.tip_is_smooth:
        return EXACT, None
    points = next(SAMPLINGS["sobol"]().blocks(seed, 0, PILOT_N, problem.space.dimension))
    if response.drive.has_measured_teeth or response.teeth:
        points = points[:PILOT_MEASURED]
    return CLOSED_FORM, model_error(response.drive, response.matrix(problem.space.sample(points)))


def words_on_model(problem: ToleranceProblem, seed: int) -> tuple[str, ...]:
    """A sentence where the closed form that the drives of `problem` are computed with is far from the exact geometry
    for a pilot of them, drawn with `seed`; () where it is not."""
    distance = _method(problem, seed)[1]
    return () if distance is None or distance.says is None else (distance.says,)


def _exact_at(problem: ToleranceProblem, worst: WorstCase) -> tuple[str, ...]:
    """A sentence where the exact geometry of the worst drive found differs from what was maximised."""
    response = problem.response
    if not isinstance(response, DriveResponse) or response.drive.has_measured_teeth:
        return ()
    from hdopt.kinematics.extremes import converged_peak_to_peak_arcmin

    row = response.matrix(np.array([[worst.at[name] for name in problem.space.names]]))
    exact = response.homogenization * converged_peak_to_peak_arcmin(response.drive, DriveErrors.from_matrix(row[0]))
    if abs(exact - worst.value) <= WORTH_A_WORD_ARCMIN:
        return ()
    return (
        f"the worst case found is {worst.value:.4g} arcmin by the closed form and {exact:.4g} by the exact geometry of "
        "that drive: such large errors leave the closed form's range",
    )


@numbers_named
def sobol(
    study: AnyProblem = None,
    n: int = SOBOL_N,
    *,
    second_order: bool = True,
    shapley: str | None = None,
    seed: int = 1,
    engine: Engine | str | None = None,
) -> SobolResult:
    """Sobol' indices of a study's inputs and groups with `n` base points in all; Shapley effects where inputs are
    correlated, or where `shapley` asks for them: 'inputs' or 'groups'.

    `study` is as for `stack`; `second_order` adds the indices of pairs; `seed` is that of the samples,
    `engine` computes them (threads, processes or a cluster).
    """
    from hdopt.tolerance.sensitivity import run_shapley, run_sobol

    problem = study_problem(study)
    if shapley not in (None, "inputs", "groups"):
        raise HdoptError(unknown_name("set of Shapley players", shapley, ("inputs", "groups")))
    response, unit = problem.response, problem.unit
    space, notes, indices = problem.space, list(problem.notes), None
    if space.copula.is_independent:
        indices = run_sobol(response, space, n=n, second_order=second_order, seed=seed, engine=engine, unit=unit)
    elif shapley is None:
        shapley = "inputs" if space.dimension <= SHAPLEY_INPUTS or not space.groups else "groups"
        notes.append("inputs are correlated: Shapley effects share the variance, Sobol' indices would not sum up")
    notes += words_on_model(problem, seed)
    if shapley is None:
        return SobolResult(problem.study, indices, None, tuple(notes))
    players = None if shapley == "inputs" else space.groups
    effects = run_shapley(response, space, n=n, players=players, seed=seed, engine=engine, unit=unit)
    return SobolResult(problem.study, indices, effects, tuple(notes))


@numbers_named
def screen(
    study: AnyProblem = None,
    method: str = "morris",
    n: int | None = None,
    *,
    seed: int = 1,
    engine: Engine | str | None = None,
) -> Screening:
    """Which inputs of a study matter, by SALib's `method`: 'morris', 'delta', 'pawn', 'rbd_fast' or 'dgsm'.

    `study` is as for `stack`; `n` the base points, the method's own number where None; `seed` that of
    the samples, `engine` computes them. `to_salib()` of the result is SALib's own.
    """
    problem = study_problem(study)
    found = run_screening(
        problem.response, problem.space, method.replace("-", "_"), n=n, seed=seed, engine=engine, unit=problem.unit
    )
    notes = (*problem.notes, *words_on_model(problem, seed), *found.notes)
    return replace(found, study=problem.study, notes=notes)
