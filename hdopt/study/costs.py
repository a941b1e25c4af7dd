"""Costs of tolerances in a study file, and [allocate]."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field

from hdopt.allocation.cost import CostModel, Exponential, Grade, GradeTable, Piecewise, Power, Reciprocal
from hdopt.allocation.grades import GradeValue, iso_1328_pitch, it_grade, jis_1702_pitch
from hdopt.errors import HdoptError, MissingValue
from hdopt.study.base import NotNegative, Positive, Section

PER_MM = {
    "nm": 1e6,
    "um": 1e3,
    "\u00b5m": 1e3,
    "\u03bcm": 1e3,
    "mm": 1.0,
    "cm": 0.1,
    "m": 1e-3,
    "in": 1 / 25.4,
    "inch": 1 / 25.4,
    "mil": 1e3 / 25.4,
    "thou": 1e3 / 25.4,
}
"""Units of length in which grades in mm can be given: how many make a mm."""


class CostRow(Section):
    """What every cost may carry: where its numbers come from, and how far the tolerance may go."""

    source: str = "assumed"
    """Where the numbers come from."""
    tightest: NotNegative | None = None
    """Smallest tolerance that can be made, in the error's unit."""
    widest: Positive | None = None
    """Largest tolerance that may be allocated."""


class ReciprocalRow(CostRow):
    model: Literal["reciprocal"]
    """a + b/t at tolerance t."""
    a: float = 0.0
    """Cost that does not depend on the tolerance."""
    b: Positive
    """Cost times tolerance."""

    def build(self, gear: tuple[float, float] | None, unit: str = "mm") -> CostModel:
        return Reciprocal(self.a, self.b)


class PowerRow(CostRow):
    model: Literal["power"]
    """a + b/t^k at tolerance t."""
    a: float = 0.0
    """Cost that does not depend on the tolerance."""
    b: Positive
    """Factor."""
    k: Positive
    """Exponent."""

    def build(self, gear: tuple[float, float] | None, unit: str = "mm") -> CostModel:
        return Power(self.a, self.b, self.k)


class ExponentialRow(CostRow):
    model: Literal["exponential"]
    """fixed + a exp(-t/b) at tolerance t."""
    a: Positive
    """Cost at tolerance 0 beyond the fixed one."""
    b: Positive
    """Tolerance over which the cost beyond the fixed one falls to 1/e."""
    fixed: float = 0.0
    """Cost that does not depend on the tolerance."""

    def build(self, gear: tuple[float, float] | None, unit: str = "mm") -> CostModel:
        return Exponential(self.a, self.b, self.fixed)


class PiecewiseRow(CostRow):
    model: Literal["piecewise"]
    """Straight lines between points."""
    points: list[list[float]] = Field(min_length=2)
    """[tolerance, cost] pairs, tolerances rising."""

    def build(self, gear: tuple[float, float] | None, unit: str = "mm") -> CostModel:
        if any(len(point) != 2 for point in self.points):
            raise HdoptError(f"the piecewise cost has points {self.points}; each must be a pair [tolerance, cost]")
        return Piecewise(tuple((t, c) for t, c in self.points))


class GradeRow(Section):
    """One grade: its cost, and its tolerance unless a standard gives it."""

    grade: str | int
    """Name of the grade, or its number in the standard."""
    cost: float
    """Its cost."""
    tolerance: Positive | None = None
    """Its tolerance, in the error's unit, where no standard gives it."""


class TableRow(CostRow):
    """A choice of grades; `system` names the standard that gives their tolerances."""

    model: Literal["table"]
    """A choice of grades."""
    grades: list[GradeRow] = Field(min_length=1)
    """The grades that can be had."""
    system: Literal["iso286", "iso1328", "jis1702"] | None = None
    """The standard that gives their tolerances."""
    nominal_mm: Positive | None = None
    """Nominal size, for ISO 286."""
    factor: Positive = 1.0
    """Tolerance of this input over the grade's: 0.5 for an eccentricity by a coaxiality, or F_p as one sine. Where the
    input is no length, its tolerance in its own unit (deg) for each mm of the grade's, which must be given then."""

    def build(self, gear: tuple[float, float] | None, unit: str = "mm") -> CostModel:
        """The grades as choices, tolerances in `unit`; `gear` is (module, pitch diameter), mm, for gear grades."""
        if self.system is None:
            return GradeTable(tuple(Grade(str(row.grade), self._own(row), row.cost) for row in self.grades))
        per_mm = self._per_mm(unit)
        values = [(self._standard(row.grade, gear), row.cost) for row in self.grades]
        return GradeTable(tuple(Grade(v.name, per_mm * v.tolerance, cost, v.extrapolated) for v, cost in values))

    @staticmethod
    def _own(row: GradeRow) -> float:
        if row.tolerance is None:
            raise MissingValue(f"grade {row.grade}", "tolerance (or system, the standard that gives it)")
        return row.tolerance

    def _per_mm(self, unit: str) -> float:
        """Tolerance of this input, in `unit`, for each mm of the grade's."""
        given = "factor" in self.model_fields_set
        if unit not in PER_MM:
            if given:
                return self.factor
            raise HdoptError(
                f'the grades of system = "{self.system}" are lengths, and this tolerance is in {unit!r}, which is no '
                f"length ({', '.join(PER_MM)}); write factor = the tolerance in {unit} for each mm of the grade's"
                + (" (57.3/L for a tilt over a length of L mm)" if unit == "deg" else "")
            )
        if given and unit != "mm" and math.isclose(self.factor, PER_MM[unit], rel_tol=1e-3):
            raise HdoptError(
                f"factor is {self.factor:g}, the {unit} in a mm; grades are taken in {unit} without it: leave it out"
            )
        return self.factor * PER_MM[unit]

    def _standard(self, grade: str | int, gear: tuple[float, float] | None) -> GradeValue:
        if self.system == "iso286":
            if self.nominal_mm is None:
                raise MissingValue("an ISO 286 grade", "nominal_mm")
            return it_grade(str(grade), self.nominal_mm)
        if gear is None:
            raise HdoptError(f"a gear grade ({self.system}) needs the drive's module and teeth; add [drive]")
        if not isinstance(grade, int):
            raise HdoptError(f"the gear grade {grade!r} is not a whole number; {self.system} grades are numbers")
        module, diameter = gear
        return (iso_1328_pitch if self.system == "iso1328" else jis_1702_pitch)(grade, diameter, module)


Cost = Annotated[
    ReciprocalRow | PowerRow | ExponentialRow | PiecewiseRow | TableRow,
    Field(discriminator="model"),
]


class AllocateSection(Section):
    """[allocate]: which rule decides, what is compared, and how the result is verified."""

    rule: Literal["worst_case", "rss", "yield"] = "yield"
    """Which rule decides: worst case, root sum square, or yield."""
    compare: bool = True
    """Also the other rules and equal scaling, in one table."""
    verify_n: int = Field(default=2**20, ge=2**14)
    """Samples of the one verification; fixed before it."""
    curve: list[Positive] = Field(default_factory=list)
    """Limits of the cost curve, as multiples of the requirement."""
