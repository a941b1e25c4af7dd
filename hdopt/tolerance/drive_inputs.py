"""From rows of random inputs to drives: the one adapter that stacks, sensitivities, allocation and search use."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.errors import ERROR_GROUPS, ERROR_NAMES, PHASE_OF, STUDY_KEYS, DriveErrors, study_key
from hdopt.drive.geometry import Drive
from hdopt.errors import HdoptError, unknown_name
from hdopt.tolerance.contributors import TILT, VECTORS, Contributor
from hdopt.tolerance.copula import CorrelationGroup
from hdopt.tolerance.distributions import Distribution, Rayleigh, Uniform
from hdopt.tolerance.drawn_teeth import (
    SPLINES,
    WHICH_SPLINE,
    DrawnTeeth,
    GradedTeeth,
    check_graded,
    deviations_of,
    drawn_peak_to_peak_arcmin,
)
from hdopt.tolerance.space import InputSpace, Tolerance

FULL_TURN = Uniform(lower=0.0, upper=360.0)
"""A free direction, deg."""

TILTS = tuple(name for name in ERROR_NAMES if "tilt" in name)
SINE_OF = dict(zip(SPLINES, ("cs_tooth_amplitude", "fs_tooth_amplitude"), strict=True))
"""The sine that stands for all teeth of a spline where nothing better is known."""
TURNING = tuple(PHASE_OF.values())
"""Directions and phases: they have no tolerance that could be narrowed."""


class Feed(Protocol):
    """Fills some of a drive's errors from the columns of a sample."""

    def fill(self, inputs: Array, errors: dict[str, Array]) -> None: ...

    def widest(self, largest: Array, errors: dict[str, float]) -> None:
        """The same for the largest absolute value each error can have; `largest` of shape (d,)."""


@dataclass(frozen=True)
class Direct:
    """One column is one error, in the unit of the study file."""

    column: int
    error: str

    def fill(self, inputs: Array, errors: dict[str, Array]) -> None:
        values = inputs[:, self.column]
        errors[self.error] = values if self.per_unit == 1 else values * self.per_unit

    def widest(self, largest: Array, errors: dict[str, float]) -> None:
        errors[self.error] = float(largest[self.column]) * self.per_unit

    @property
    def per_unit(self) -> float:
        """The error, mm or rad, for one unit of the column, mm or deg."""
        return 1.0 if study_key(self.error).endswith("_mm") else math.pi / 180


@dataclass(frozen=True)
class VectorSum:
    """Columns of callouts (mm) and of their directions (deg) that add as vectors to one error.

    `terms` holds (column of the value, column of the direction, error per mm).
    """

    vector: str
    terms: tuple[tuple[int, int, float], ...]

    def fill(self, inputs: Array, errors: dict[str, Array]) -> None:
        along, across = np.zeros(len(inputs)), np.zeros(len(inputs))
        for value, direction, factor in self.terms:
            angle = inputs[:, direction] * (math.pi / 180)
            along = along + factor * inputs[:, value] * np.cos(angle)
            across = across + factor * inputs[:, value] * np.sin(angle)
        kind, first, second = VECTORS[self.vector]
        if kind == TILT:
            errors[first], errors[second] = along, across
        else:
            errors[first], errors[second] = np.hypot(along, across), np.arctan2(across, along)

    def widest(self, largest: Array, errors: dict[str, float]) -> None:
        length = float(sum(factor * largest[value] for value, _, factor in self.terms))
        kind, first, second = VECTORS[self.vector]
        # the wave generator turns under an axis tilt, so only that tilt's length counts; its own tilt turns with it
        errors[first], errors[second] = length, length if kind == TILT and self.vector == "wg_tilt" else 0.0


@dataclass(frozen=True)
class DriveResponse:
    """Converged peak-to-peak kinematic error (arcmin, times k_e) of the drive each row of inputs describes.

    With measured or drawn `teeth` k_e is for the sines beside them, and misalignment has its own mean. Errors that no
    column feeds keep the value they have in `held`.
    """

    drive: Drive
    held: DriveErrors
    feeds: tuple[Feed, ...]
    homogenization: float = 1.0
    teeth: tuple[DrawnTeeth, ...] = ()

    def errors(self, inputs: Array) -> DriveErrors:
        """The errors of all rows at once."""
        varying: dict[str, Array] = {}
        for feed in self.feeds:
            feed.fill(inputs, varying)
        return self.held.with_(**varying)

    def upper_bound(self, lower: Array, upper: Array) -> float | None:
        """A proven bound of the response over the box, None where there is no proof; see `drive_bound`."""
        from hdopt.tolerance.drive_bound import peak_to_peak_bound_arcmin

        if self.teeth or not self.drive.wave_generator.profile.tip_is_smooth:
            return None
        bound = peak_to_peak_bound_arcmin(self.drive, self.widest_errors(lower, upper))
        if bound is None:
            return None
        if self.drive.has_measured_teeth:
            from hdopt.kinematics.load_sharing import mesh_range

            # Shared terms are no larger than those of a single pair of teeth.
            return bound + mesh_range(self.drive) * self.drive.geometry.arcmin_per_mm
        return self.homogenization * bound

    def widest_errors(self, lower: Array, upper: Array) -> DriveErrors:
        """The largest absolute value of every error over the box of inputs between `lower` and `upper`, (d,) each.

        Directions mean nothing here.
        """
        errors = {name: abs(float(value)) for name, value in self.held.by_name().items()}
        largest = np.maximum(np.abs(lower), np.abs(upper))
        for feed in self.feeds:
            feed.widest(largest, errors)
        return DriveErrors(**errors)

    def matrix(self, inputs: Array) -> Array:
        """The same as rows of `DriveErrors.to_matrix`, without making twelve columns of what does not vary."""
        varying: dict[str, Array] = {}
        for feed in self.feeds:
            feed.fill(inputs, varying)
        matrix = np.empty((len(inputs), len(ERROR_NAMES)))
        for column, name in enumerate(ERROR_NAMES):
            matrix[:, column] = varying.get(name, getattr(self.held, name))
        return matrix

    def __call__(self, inputs: Array) -> Array:
        from hdopt.kinematics.peak_to_peak import matrix_peak_to_peak_arcmin

        if self.teeth:
            return drawn_peak_to_peak_arcmin(self.drive, self.matrix(inputs), inputs, self.teeth, *self.shares)
        if self.drive.has_measured_teeth and self.homogenization != 1:
            return self._shared(inputs)
        return self.homogenization * matrix_peak_to_peak_arcmin(self.drive, self.matrix(inputs))

    def _shared(self, inputs: Array) -> Array:
        """Each term of drives with `inputs` (n, d) as the teeth in contact share it: sines by k_e, misalignment by its
        mean, measured teeth by theirs; arcmin, (n,)."""
        from hdopt.kinematics.peak_to_peak import beat_extremes_arcmin

        low, high = beat_extremes_arcmin(self.drive, self.matrix(inputs), None, *self.shares).T
        return np.asarray(high - low)

    def deviations(self, inputs: Array) -> dict[str, Array]:
        """Cumulative pitch deviations (mm, (n, Z)) of the teeth that `inputs` (n, d) draw, by spline."""
        return deviations_of(self.teeth, inputs)

    @property
    def shares(self) -> tuple[float, float]:
        """What is left of misalignment and of sines where the teeth in contact share them; all for a single pair."""
        from hdopt.kinematics.load_sharing import misalignment_share

        return (1.0, 1.0) if self.homogenization == 1 else (misalignment_share(self.drive), self.homogenization)


@dataclass(frozen=True)
class DriveProblem:
    """A drive's response and its random inputs, ready for a stack."""

    response: DriveResponse
    space: InputSpace
    replaced: tuple[str, ...] = field(default=())
    """Tolerances that callouts took the place of."""
    freed: tuple[str, ...] = ()
    """Directions and phases that no tolerance says anything of: they are free over the full turn."""
    graded: Mapping[str, GradedTeeth] = field(default_factory=dict)
    """By spline ('cs_teeth', 'fs_teeth'), tolerances of pitch that teeth are drawn from."""


def tolerance_of(error: str, distribution: Distribution) -> Tolerance:
    """The tolerance of the drive error `error` (a name of `ERROR_NAMES`) that spreads as `distribution`.

    A magnitude's is its upper bound, a tilt's its half range; a direction has none.
    """
    if error in TURNING:
        return Tolerance(distribution, None)
    return Tolerance.of_deviation(distribution) if error in TILTS else Tolerance.of_magnitude(distribution)


def drive_problem(
    drive: Drive,
    tolerances: Mapping[str, Distribution],
    *,
    held: DriveErrors | None = None,
    contributors: Mapping[Contributor, Distribution] | None = None,
    correlations: Sequence[CorrelationGroup] = (),
    homogenization: float = 1.0,
    graded: Mapping[str, GradedTeeth] | None = None,
) -> DriveProblem:
    """The stack of a `drive` from the distributions of its errors and of its callouts.

    `tolerances` are by study key (mm, deg), those of `contributors` by callout (mm). An error that callouts feed is
    theirs alone. A direction or phase that is not given is free over the full turn where its magnitude varies; what is
    given nowhere keeps its value in `held`. `correlations` group inputs that vary together, `homogenization` is k_e.
    `graded` holds tolerances of pitch by spline; the spline's sine leaves where they stand instead of it. Raises
    `HdoptError` for a key that is not an error, and for a magnitude that could be negative.
    """
    contributors, graded = contributors or {}, graded or {}
    check_graded(drive, graded)
    held, tolerances = _without_sines(held or DriveErrors(), tolerances, graded)
    tolerances, freed = with_free_directions(tolerances)
    fed = {error for contributor in contributors for error in VECTORS[contributor.feeds][1:]}
    inputs: dict[str, Tolerance] = {}
    groups: dict[str, list[str]] = {name: [] for name in ERROR_GROUPS}
    own = {key: distribution for key, distribution in tolerances.items() if STUDY_KEYS.get(key) not in fed}
    feeds = _add_errors(own, inputs, groups)
    terms, free = _add_callouts(contributors, inputs, groups)
    feeds += [VectorSum(vector, tuple(parts)) for vector, parts in terms.items()]
    drawn = _add_teeth(drive, graded, inputs, groups)
    space = InputSpace(
        inputs,
        tuple(correlations),
        {group: tuple(names) for group, names in groups.items() if names},
        folded=frozenset(study_key(name) for name in TILTS) & set(inputs),
        turning=frozenset(name for name in inputs if STUDY_KEYS.get(name) in TURNING or name in free or name in graded),
        fields=frozenset(graded),
    )
    return DriveProblem(
        DriveResponse(drive, held, tuple(feeds), homogenization, drawn),
        space,
        tuple(key for key in tolerances if key not in own and key not in freed),
        tuple(key for key in freed if key in inputs),
        graded,
    )


def _add_errors(
    tolerances: Mapping[str, Distribution], inputs: dict[str, Tolerance], groups: dict[str, list[str]]
) -> list[Feed]:
    """Add the errors that `tolerances` are of, by study key, to `inputs` and `groups`: what they feed."""
    feeds: list[Feed] = []
    for key, distribution in tolerances.items():
        if key not in STUDY_KEYS:
            raise HdoptError(f"[tolerances]: {unknown_name('error', key, STUDY_KEYS)}")
        error = STUDY_KEYS[key]
        if error in PHASE_OF and distribution.support[0] < 0:
            raise HdoptError(
                f"[tolerances] {key} is a magnitude but may be as low as {distribution.support[0]:g}; give lower = 0, "
                "or a distribution of magnitudes such as rayleigh or half_normal"
            )
        feeds.append(Direct(len(inputs), error))
        inputs[key] = tolerance_of(error, distribution)
        groups[_group_of(error)].append(key)
    return feeds


def _without_sines(
    held: DriveErrors, tolerances: Mapping[str, Distribution], graded: Mapping[str, GradedTeeth]
) -> tuple[DriveErrors, Mapping[str, Distribution]]:
    """`held` and `tolerances` without the tooth sines that drawn teeth stand instead of."""
    amplitudes = [SINE_OF[spline] for spline, teeth in graded.items() if not teeth.sine]
    left_out = {study_key(name) for amplitude in amplitudes for name in (amplitude, PHASE_OF[amplitude])}
    kept = {key: distribution for key, distribution in tolerances.items() if key not in left_out}
    return held.with_(**dict.fromkeys(amplitudes, 0.0)), kept


def _add_teeth(
    drive: Drive, graded: Mapping[str, GradedTeeth], inputs: dict[str, Tolerance], groups: dict[str, list[str]]
) -> tuple[DrawnTeeth, ...]:
    """Add an input for each spline of `drive` whose teeth are drawn to `inputs` and `groups`."""
    numbers = (drive.geometry.circular_spline_teeth, drive.geometry.flexspline_teeth)
    drawn = []
    for spline, teeth in zip(SPLINES, numbers, strict=True):
        if spline in graded:
            try:
                random_field = graded[spline].field(teeth)
            except HdoptError as error:
                raise HdoptError(f"[tolerances] {spline}: {error}") from error
            drawn.append(DrawnTeeth(len(inputs), spline, random_field))
            inputs[spline] = WHICH_SPLINE
            groups[_group_of(SINE_OF[spline])].append(spline)
    return tuple(drawn)


def _add_callouts(
    contributors: Mapping[Contributor, Distribution], inputs: dict[str, Tolerance], groups: dict[str, list[str]]
) -> tuple[dict[str, list[tuple[int, int, float]]], set[str]]:
    """Add each callout and its free direction to `inputs` and `groups`: the terms of each vector sum, the
    directions."""
    terms: dict[str, list[tuple[int, int, float]]] = {}
    free: set[str] = set()
    for contributor, distribution in contributors.items():
        direction = f"{contributor.name}_direction_deg"
        for name in (contributor.name, direction):
            if name in inputs:
                raise HdoptError(f"two inputs are called {name!r}; rename the contributor")
        terms.setdefault(contributor.feeds, []).append((len(inputs), len(inputs) + 1, contributor.error_per_mm))
        inputs[contributor.name] = Tolerance(distribution, contributor.value)
        inputs[direction] = Tolerance(FULL_TURN, None)
        free.add(direction)
        groups[_group_of(VECTORS[contributor.feeds][1])] += [contributor.name, direction]
    return terms, free


def with_free_directions(tolerances: Mapping[str, Distribution]) -> tuple[dict[str, Distribution], tuple[str, ...]]:
    """`tolerances` by study key, with a direction free over the full turn after each magnitude that has none; and which
    were added."""
    made, freed = dict[str, Distribution](), []
    for key, distribution in tolerances.items():
        made[key] = distribution
        direction = PHASE_OF.get(STUDY_KEYS.get(key, ""))
        if direction is not None and study_key(direction) not in tolerances:
            made[study_key(direction)] = FULL_TURN
            freed.append(study_key(direction))
    return made, tuple(freed)


def _group_of(error: str) -> str:
    return next(group for group, names in ERROR_GROUPS.items() if error in names)


def contributor_distribution(value: float, shape: float | None = None) -> Distribution:
    """How a callout of `value` mm is used up unless the study says otherwise: a plane normal deviation whose standard
    deviation is `shape` of the value (a third by default, an assumption), truncated at the value."""
    return Rayleigh(scale=value * (1 / 3 if shape is None else shape), upper=value)
