"""Standard tolerance grades: ISO 286 IT grades, and gear accuracy grades down to fine pitch."""

from __future__ import annotations

from dataclasses import dataclass

from hdopt.errors import HdoptError, unknown_name


@dataclass(frozen=True)
class GradeValue:
    """A grade's tolerance in mm, and why its standard does not reach here ('' where it does)."""

    name: str
    tolerance: float
    extrapolated: str = ""


IT_SIZES_MM = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
"""Upper ends of the ranges of nominal size, ISO 286-1:2010, Table 1."""

IT_MICRONS: dict[str, tuple[float, ...]] = {
    "IT1": (0.8, 1, 1, 1.2, 1.5, 1.5, 2, 2.5, 3.5, 4.5, 6, 7, 8),
    "IT2": (1.2, 1.5, 1.5, 2, 2.5, 2.5, 3, 4, 5, 7, 8, 9, 10),
    "IT3": (2, 2.5, 2.5, 3, 4, 4, 5, 6, 8, 10, 12, 13, 15),
    "IT4": (3, 4, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20),
    "IT5": (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27),
    "IT6": (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40),
    "IT7": (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63),
    "IT8": (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97),
    "IT9": (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155),
    "IT10": (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250),
    "IT11": (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400),
}
"""Standard tolerances by grade and size range, um; ISO 286-1:2010, Table 1."""


def it_grade(grade: str, nominal_mm: float) -> GradeValue:
    """Standard tolerance, mm, of an IT `grade` such as 'IT7' at the nominal size `nominal_mm` (ISO 286-1:2010, Table
    1).

    Raises `HdoptError` for a grade that the table does not hold (IT1 to IT11) and for sizes beyond 500 mm.
    """
    if grade not in IT_MICRONS:
        raise HdoptError(unknown_name("IT grade", grade, IT_MICRONS))
    if not 0 < nominal_mm <= IT_SIZES_MM[-1]:
        raise HdoptError(f"the nominal size is {nominal_mm!r} mm; the table holds sizes above 0, up to 500 mm")
    column = next(index for index, size in enumerate(IT_SIZES_MM) if nominal_mm <= size)
    return GradeValue(grade, IT_MICRONS[grade][column] / 1000)


ISO_1328_MODULES = (0.5, 70.0)
ISO_1328_CLASSES = range(1, 12)


def iso_1328_pitch(grade: int, diameter_mm: float, module_mm: float) -> GradeValue:
    """Total cumulative pitch tolerance F_pT, mm, of a flank tolerance class of ISO 1328-1:2013:
    (0.002 d + 0.55 sqrt(d) + 0.7 m + 12) sqrt(2)^(A - 5) um.

    `grade` is the class A, `diameter_mm` the pitch diameter d and `module_mm` the module m. The standard starts at
    module 0.5: below, and beyond its classes 1 to 11, the value is extrapolated and says so. Raises `HdoptError` for a
    gear without size.
    """
    _check_gear(diameter_mm, module_mm)
    microns = (0.002 * diameter_mm + 0.55 * diameter_mm**0.5 + 0.7 * module_mm + 12) * 2 ** ((grade - 5) / 2)
    low, high = ISO_1328_MODULES
    reasons = []
    if not low <= module_mm <= high:
        reasons.append(f"ISO 1328-1 holds for modules {low:g} to {high:g} mm, this gear has {module_mm:g} mm")
    if grade not in ISO_1328_CLASSES:
        reasons.append(f"ISO 1328-1 has classes 1 to 11, this is {grade}")
    return GradeValue(f"ISO 1328 class {grade}", microns / 1000, "; ".join(reasons))


JIS_PITCH_MICRONS: tuple[tuple[float, float], ...] = (
    (2.0, 5.6),
    (2.8, 8.0),
    (4.0, 11.2),
    (5.6, 16.0),
    (8.0, 22.4),
    (11.2, 31.5),
    (16.0, 45.0),
    (32.0, 90.0),
    (64.0, 180.0),
)
"""Accumulated pitch error of grades 0 to 8: factor of the tolerance unit W, and constant, um; JIS B 1702-1976,
Table 15-1 as printed in Stock Drive Products' D785 handbook, T131."""

JIS_MODULES = (0.2, 25.0)
"""Modules the tables of JIS B 1702-1976 span."""


def jis_1702_pitch(grade: int, diameter_mm: float, module_mm: float) -> GradeValue:
    """Accumulated pitch error, mm, of a `grade` (0 to 8) of JIS B 1702-1976 (fine pitch included, from module 0.2):
    k W + c um with the tolerance unit W = d^(1/3) + 0.65 m.

    `diameter_mm` is the pitch diameter d, `module_mm` the module m; beyond the standard's modules the value is
    extrapolated and says so. Raises `HdoptError` for another grade, and for a gear without size.
    """
    _check_gear(diameter_mm, module_mm)
    if not 0 <= grade < len(JIS_PITCH_MICRONS):
        raise HdoptError(f"JIS B 1702 grade {grade} does not exist; its grades are 0 to {len(JIS_PITCH_MICRONS) - 1}")
    factor, constant = JIS_PITCH_MICRONS[grade]
    microns = factor * (diameter_mm ** (1 / 3) + 0.65 * module_mm) + constant
    low, high = JIS_MODULES
    reason = (
        ""
        if low <= module_mm <= high
        else (f"JIS B 1702 holds for modules {low:g} to {high:g} mm, this gear has {module_mm:g} mm")
    )
    return GradeValue(f"JIS B 1702 grade {grade}", microns / 1000, reason)


def _check_gear(diameter_mm: float, module_mm: float) -> None:
    if not (diameter_mm > 0 and module_mm > 0):
        raise HdoptError(f"the gear has diameter {diameter_mm!r} mm and module {module_mm!r} mm; both must be above 0")
