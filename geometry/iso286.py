"""Fits of ISO 286 between a hole H and a shaft, with their limits and the play that they can leave.

Fundamental deviations of shafts: ISO 286-1:2010, Tables 4 and 5; sizes up to 180 mm.
"""

from __future__ import annotations

from dataclasses import dataclass

from hdopt.allocation.grades import it_grade
from hdopt.errors import HdoptError

SIZES_MM = (3, 6, 10, 18, 30, 50, 80, 120, 180)
"""Upper ends of the ranges of nominal size."""

SHAFT_MICRONS: dict[str, tuple[float, ...]] = {
    "g": (-2, -4, -5, -6, -7, -9, -10, -12, -14),
    "h": (0, 0, 0, 0, 0, 0, 0, 0, 0),
    "k": (0, 1, 1, 1, 2, 2, 2, 3, 3),
    "m": (2, 4, 6, 7, 8, 9, 11, 13, 15),
    "n": (4, 8, 10, 12, 15, 17, 20, 23, 27),
    "p": (6, 12, 15, 18, 22, 26, 32, 37, 43),
}
"""Fundamental deviation, um: the upper one of g and h, the lower one of k (grades 4 to 7), m, n and p."""

COARSE_MICRONS: dict[str, tuple[float, ...]] = {
    "12": (100, 120, 150, 180, 210, 250, 300, 350, 400),
    "13": (140, 180, 220, 270, 330, 390, 460, 540, 630),
}
"""Standard tolerances of grooves and clearances, um: the grades that an allocation does not choose from."""

LADDER = ("H7/h6", "H6/h5", "H6/js5", "H6/k5", "H6/m5", "H6/n5", "H6/p5")
"""Fits to choose from, the loosest first."""


@dataclass(frozen=True)
class Fit:
    """A hole of class H and a shaft of one nominal size, mm."""

    nominal: float
    hole: str
    shaft: str

    @property
    def name(self) -> str:
        return f"{self.hole}/{self.shaft}"

    @property
    def hole_limits(self) -> tuple[float, float]:
        """Lower and upper deviation of the hole, mm."""
        return deviations(self.hole, self.nominal)

    @property
    def shaft_limits(self) -> tuple[float, float]:
        """Lower and upper deviation of the shaft, mm."""
        return deviations(self.shaft, self.nominal)

    @property
    def largest_play(self) -> float:
        """Largest clearance on diameter, mm; 0 where the parts always press."""
        return max(0.0, self.hole_limits[1] - self.shaft_limits[0])


def fit_of(name: str, nominal: float) -> Fit:
    """The fit of this `name`, such as 'H6/n5', at a `nominal` size, mm; `HdoptError` for one that is not in
    `LADDER`."""
    if name not in LADDER:
        raise HdoptError(f"the fit {name!r} is not known; give one of {', '.join(LADDER)}")
    hole, shaft = name.split("/")
    return Fit(nominal, hole, shaft)


def deviations(tolerance_class: str, nominal: float) -> tuple[float, float]:
    """Lower and upper deviation, mm, of a `tolerance_class` such as 'H7', 'n5' or 'js9' at a `nominal` size, mm;
    `HdoptError` for one that the table does not have."""
    letter, grade = tolerance_class.rstrip("0123456789"), tolerance_class.lstrip("HJSabcdefghijklmnopqrstuvwxyz")
    width = _width(grade, nominal)
    if letter == "H":
        return 0.0, width
    if letter.lower() == "js":
        return -width / 2, width / 2
    if letter not in SHAFT_MICRONS or nominal > SIZES_MM[-1]:
        raise HdoptError(
            f"{tolerance_class} at {nominal:g} mm is not in the table; give H, js, {', '.join(SHAFT_MICRONS)} at "
            f"sizes up to {SIZES_MM[-1]} mm"
        )
    column = next(index for index, size in enumerate(SIZES_MM) if nominal <= size)
    fundamental = SHAFT_MICRONS[letter][column] / 1000
    return (fundamental - width, fundamental) if letter in "gh" else (fundamental, fundamental + width)


def _width(grade: str, nominal: float) -> float:
    if grade in COARSE_MICRONS and nominal <= SIZES_MM[-1]:
        return COARSE_MICRONS[grade][next(index for index, size in enumerate(SIZES_MM) if nominal <= size)] / 1000
    return it_grade(f"IT{grade}", nominal).tolerance


def loosest_fit(nominal: float, play: float) -> Fit:
    """At a `nominal` size, mm, the loosest fit of `LADDER` whose largest clearance is at most `play`, mm; the tightest
    one always presses."""
    return next(fit for name in LADDER if (fit := fit_of(name, nominal)).largest_play <= play)
