"""[tolerances], [requirement], [contributors] and [linear_stack] of a study file, and the records they become."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal  # Any: fields that pydantic takes

import numpy as np
from pydantic import ConfigDict, Field, create_model, model_validator

from hdopt.drive.errors import PHASE_OF, STUDY_KEYS, study_key
from hdopt.drive.geometry import DriveGeometry
from hdopt.drive.pitch_tolerances import CLASSES, PitchTolerances, iso_1328_tolerances
from hdopt.errors import HdoptError, unknown_name
from hdopt.study.base import Positive, Section
from hdopt.study.costs import Cost
from hdopt.study.drive import LARGEST_ERROR_MM, STEEPEST_DEG
from hdopt.tolerance.contributors import VECTORS, Contributor
from hdopt.tolerance.copula import CorrelationGroup
from hdopt.tolerance.distributions import (
    Beta,
    Distribution,
    Fixed,
    HalfNormal,
    LogNormal,
    MeasuredSample,
    Normal,
    Rayleigh,
    Triangular,
    Uniform,
)
from hdopt.tolerance.drawn_teeth import GradedTeeth
from hdopt.tolerance.drive_inputs import contributor_distribution

INFINITY = float("inf")


class Row(Section):
    """What every distribution may carry: its truncation, and the cost of its tolerance."""

    lower: float = Field(default=-INFINITY, allow_inf_nan=True)
    """Where the distribution is cut off below, in the error's unit."""
    upper: float = Field(default=INFINITY, allow_inf_nan=True)
    """Where it is cut off above; the tolerance."""
    cost: Cost | None = None
    """What tightening costs; for `hdopt allocate`."""

    @property
    def bounds(self) -> dict[str, float]:
        return {"lower": self.lower, "upper": self.upper}


class NormalRow(Row):
    distribution: Literal["normal"]
    """Normal."""
    mean: float = 0.0
    """Mean."""
    std: Positive
    """Standard deviation."""

    def build(self, folder: Path) -> Distribution:
        return Normal(mean=self.mean, std=self.std, **self.bounds)


class UniformRow(Row):
    distribution: Literal["uniform"]
    """Uniform."""
    lower: float
    """Smallest value."""
    upper: float
    """Largest value."""

    def build(self, folder: Path) -> Distribution:
        return Uniform(**self.bounds)


class TriangularRow(Row):
    distribution: Literal["triangular"]
    """Triangular."""
    minimum: float
    """Smallest value."""
    mode: float
    """Most frequent value."""
    maximum: float
    """Largest value."""

    def build(self, folder: Path) -> Distribution:
        return Triangular(minimum=self.minimum, mode=self.mode, maximum=self.maximum, **self.bounds)


class RayleighRow(Row):
    distribution: Literal["rayleigh"]
    """Rayleigh: the size of an offset whose two components are normal."""
    scale: Positive
    """Standard deviation of each component."""

    def build(self, folder: Path) -> Distribution:
        return Rayleigh(scale=self.scale, **self.bounds)


class HalfNormalRow(Row):
    distribution: Literal["half_normal"]
    """The size of a normal value."""
    scale: Positive
    """Standard deviation of that value."""

    def build(self, folder: Path) -> Distribution:
        return HalfNormal(scale=self.scale, **self.bounds)


class LogNormalRow(Row):
    distribution: Literal["lognormal"]
    """Log-normal."""
    median: Positive
    """Median."""
    log_std: Positive
    """Standard deviation of the logarithm."""

    def build(self, folder: Path) -> Distribution:
        return LogNormal(median=self.median, log_std=self.log_std, **self.bounds)


class BetaRow(Row):
    distribution: Literal["beta"]
    """Beta, between minimum and maximum."""
    a: Positive
    """First shape parameter."""
    b: Positive
    """Second shape parameter."""
    minimum: float = 0.0
    """Smallest value."""
    maximum: float
    """Largest value."""

    def build(self, folder: Path) -> Distribution:
        return Beta(a=self.a, b=self.b, minimum=self.minimum, maximum=self.maximum, **self.bounds)


class MeasuredRow(Row):
    distribution: Literal["measured"]
    """A measured sample."""
    file: str
    """CSV of one number a line, with a decimal point or comma, in the error's unit, relative to the study file."""

    def build(self, folder: Path) -> Distribution:
        return MeasuredSample.from_csv(folder / self.file, **self.bounds)


class FixedRow(Section):
    """An input that does not vary, such as a direction that is known."""

    distribution: Literal["fixed"]
    """No distribution."""
    value: float
    """The value, in the error's unit."""
    cost: None = None
    """None: what does not vary costs nothing."""

    def build(self, folder: Path) -> Distribution:
        return Fixed(value=self.value)


class PositionZoneRow(Section):
    """A position tolerance zone: a plane normal deviation truncated at its edge, or one uniform over the zone."""

    distribution: Literal["position_zone"]
    """A position tolerance zone."""
    diameter: Positive
    """Diameter of the zone, mm."""
    std: Positive | None = None
    """Standard deviation of each component; without it every place in the zone is alike."""
    cost: Cost | None = None
    """What tightening costs; for `hdopt allocate`."""

    def build(self, folder: Path) -> Distribution:
        radius = self.diameter / 2
        if self.std is None:
            return Triangular(minimum=0.0, mode=radius, maximum=radius)  # the distance of a point uniform on a disc
        return Rayleigh(scale=self.std, upper=radius)


SpreadRow = (
    NormalRow
    | UniformRow
    | TriangularRow
    | RayleighRow
    | HalfNormalRow
    | LogNormalRow
    | BetaRow
    | MeasuredRow
    | FixedRow
)
AnyRow = Annotated[SpreadRow | PositionZoneRow, Field(discriminator="distribution")]
RowWithoutZone = Annotated[SpreadRow, Field(discriminator="distribution")]
"""Of what has no place in a plane, as a tilt or the deviation of teeth."""


class CorrelationRow(Section):
    """Errors that vary together: the correlation matrix of their normal scores (Gaussian copula)."""

    errors: list[str] = Field(min_length=2)
    """Study keys of the errors, two at least."""
    matrix: list[list[float]]
    """Correlation matrix of their normal scores, row by row."""

    def build(self) -> CorrelationGroup:
        return CorrelationGroup(tuple(self.errors), self.matrix)


class GradedTeethRow(Section):
    """Tolerances of the pitch of a spline, from which its teeth are drawn: two lengths, or a class that gives both."""

    iso_1328_class: int | None = Field(default=None, ge=CLASSES[0], le=CLASSES[1])
    """ISO 1328-1:2013, which ANSI/AGMA ISO 1328-1-B14 adopts. Its scope begins at module 0.5 and at involutes."""
    single_pitch_um: Positive | None = None
    """Largest single pitch deviation by size, f_p."""
    cumulative_pitch_um: Positive | None = None
    """Range of the cumulative pitch deviations, F_p."""
    share: float = Field(default=0.9973, ge=0.5, le=0.9995)
    """Share of splines that keep each of both."""
    spectrum: Literal["power_law", "one_wave"] = "power_law"
    """How the deviations spread over waves a turn: as a power of the wave, or independent teeth and one wave a turn."""
    sine: Literal["instead", "beside"] = "instead"
    """Whether the teeth stand instead of the spline's tooth amplitude, or beside it."""

    def build(self, name: str, module: float, teeth: int) -> GradedTeeth:
        """The record of the spline `name` with so many `teeth` of this `module`, mm."""
        single, cumulative, of_class = self.single_pitch_um, self.cumulative_pitch_um, self.iso_1328_class
        if of_class is not None and single is None and cumulative is None:
            tolerances = iso_1328_tolerances(of_class, module, teeth)
        elif of_class is None and single is not None and cumulative is not None:
            tolerances = PitchTolerances(single / 1000, cumulative / 1000)
            pitch = 1000 * math.pi * module
            if single > pitch / 2:
                raise HdoptError(
                    f"[tolerances] {name}: a single pitch may be {single:.6g} um off at a pitch of {pitch:.0f} um; "
                    "half the pitch is the most: give um"
                )
        else:
            raise HdoptError(
                f"[tolerances] {name}: give either iso_1328_class, or both single_pitch_um and cumulative_pitch_um"
            )
        return GradedTeeth(tolerances, self.share, self.spectrum, self.sine == "beside")


class TolerancesBase(Section):
    """[tolerances]: any error by its study key, `cs_teeth` and `fs_teeth` by pitch, and `correlation`, a list of groups
    of errors."""

    correlation: list[CorrelationRow] = Field(default_factory=list)
    """Groups of errors that vary together."""
    cs_teeth: GradedTeethRow | None = None
    """Tolerances of pitch that the circular spline's teeth are drawn from."""
    fs_teeth: GradedTeethRow | None = None
    """The same of the flexspline's."""

    def graded(self, geometry: DriveGeometry) -> dict[str, GradedTeeth]:
        """By spline of `geometry`, the tolerances of pitch that its teeth are drawn from."""
        teeth = geometry.circular_spline_teeth, geometry.flexspline_teeth
        rows = {"cs_teeth": self.cs_teeth, "fs_teeth": self.fs_teeth}
        return {
            name: row.build(name, geometry.module, number)
            for (name, row), number in zip(rows.items(), teeth, strict=True)
            if row is not None
        }

    @property
    def rows(self) -> dict[str, AnyRow]:
        """The errors that vary, in the order of `STUDY_KEYS`."""
        return {key: row for key in STUDY_KEYS if (row := getattr(self, key)) is not None}

    def distributions(self, folder: Path) -> dict[str, Distribution]:
        """Distribution by study key. A position zone brings its direction with it."""
        built: dict[str, Distribution] = {}
        for key, row in self.rows.items():
            try:
                built[key] = row.build(folder)
                _check_size(key, built[key])
            except HdoptError as error:
                raise HdoptError(f"[tolerances] {key}: {error}") from error
        for size, direction in PHASE_OF.items():
            row = getattr(self, study_key(size))
            if isinstance(row, PositionZoneRow):
                built.setdefault(study_key(direction), Uniform(lower=0.0, upper=360.0))
        return built

    def costs(self) -> dict[str, Cost]:
        return {key: row.cost for key, row in self.rows.items() if row.cost is not None}


NEARLY_ALL = (0.00135, 0.99865)
"""Six standard deviations of a normal distribution: its tails beyond have no end."""


def _check_size(key: str, distribution: Distribution) -> None:
    """Raise `HdoptError` where most errors of the study key `key` would be larger than [errors] may have."""
    if key in map(study_key, PHASE_OF.values()):
        return
    largest, unit = (STEEPEST_DEG, "deg") if key.endswith("_deg") else (LARGEST_ERROR_MM, "mm")
    low, high = distribution.quantile(np.array(NEARLY_ALL))
    if max(-low, high) > largest:
        raise HdoptError(
            f"nearly all drives (99.73 %) would have {low:.6g} to {high:.6g} {unit}; at most {largest:g} {unit} can be "
            "computed, as in [errors]"
        )


def _row(key: str) -> Any:
    """The type of the row of the error `key`."""
    return AnyRow if key.endswith("_eccentricity_mm") else RowWithoutZone


_ROWS: dict[str, Any] = {key: (_row(key) | None, None) for key in STUDY_KEYS}
"""Fields as pydantic takes them; its types know no fields whose names are data."""
TolerancesSection = create_model("TolerancesSection", __base__=TolerancesBase, **_ROWS)
"""[tolerances] with a field for every error, so that a misspelt one is refused with the nearest."""


class RequirementSection(Section):
    """[requirement]: the largest peak-to-peak, the share of drives that must keep it, and whose k_e counts."""

    peak_to_peak_arcmin: Positive
    """Largest converged peak-to-peak of the kinematic error that a drive may have."""
    required_yield: float = Field(default=0.9973, gt=0, lt=1, alias="yield")
    """Share of drives that must keep it."""
    homogenization: Literal["single_tooth", "contact"] = "single_tooth"
    """Whose error the limit is for: of a single tooth pair (k_e = 1), or evened out by the teeth in contact."""


class ContributorRow(Section):
    """One drawing callout."""

    callout: str
    """coaxiality, total_runout, perpendicularity, parallelism, fit_clearance or total_cumulative_pitch."""
    value_mm: Positive
    """The callout's value, as on the drawing."""
    feeds: str
    """A vector error (axis_eccentricity, axis_tilt, ...) or the study key of one of its parts."""
    length_mm: Positive | None = None
    """What a perpendicularity or parallelism is measured over."""
    spread: Positive | None = None
    """Standard deviation of the plane deviation as a share of the value; a third if omitted."""
    cost: Cost | None = None
    """What tightening costs; for `hdopt allocate`."""

    @model_validator(mode="after")
    def _can_be_built(self) -> ContributorRow:
        try:
            self.build("")
        except HdoptError as error:
            raise ValueError(str(error).removeprefix("contributor '': ")) from error
        return self

    def build(self, name: str) -> tuple[Contributor, Distribution]:
        contributor = Contributor(name, self.callout, self.value_mm, vector_of(self.feeds), self.length_mm)
        return contributor, contributor_distribution(self.value_mm, self.spread)


def vector_of(name: str) -> str:
    """The vector error that a name or the study key of one of its parts means."""
    if name in VECTORS:
        return name
    parts = {study_key(part): vector for vector, (_, *both) in VECTORS.items() for part in both}
    if name in parts:
        return parts[name]
    raise HdoptError(unknown_name("error to feed", name, [*VECTORS, *parts]))


class ContributorsSection(Section):
    """[contributors]: drawing callouts by name, each with the error that it feeds, in place of its tolerance."""

    model_config = ConfigDict(extra="allow", frozen=True)
    __pydantic_extra__: dict[str, ContributorRow]

    @property
    def rows(self) -> dict[str, ContributorRow]:
        return dict(self.__pydantic_extra__)

    def build(self) -> dict[Contributor, Distribution]:
        return dict(row.build(name) for name, row in self.rows.items())

    def costs(self) -> Mapping[str, Cost]:
        return {name: row.cost for name, row in self.rows.items() if row.cost is not None}


class DimensionRow(Section):
    """One dimension of a linear stack: its tolerance to either side, and how the gap changes with it."""

    sensitivity: float = 1.0
    """Change of the gap for a unit of the dimension."""
    tolerance: Positive
    """Tolerance to either side."""
    cost: Cost | None = None
    """Without a cost the tolerance is fixed."""
    sigmas: Positive = 3.0
    """Standard deviations of the dimension (normal, truncated at its tolerance) within the tolerance."""


class LinearStackSection(Section):
    """[linear_stack]: any stack that is a sum of dimensions times sensitivities."""

    unit: str = "mm"
    """Unit of the dimensions."""
    gap_tolerance: Positive
    """What the stack's deviation must keep, to either side."""
    required_yield: float = Field(default=0.9973, gt=0, lt=1)
    """Share of assemblies that must keep the gap."""
    dimensions: dict[str, DimensionRow] = Field(min_length=1)
    """A table for each dimension, by its name."""
