"""Tolerances of pitch as shops give them: single pitch and total cumulative pitch, in um or as an ISO 1328-1 class."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hdopt.drive.values import require, require_positive
from hdopt.keywords import names_keywords

CLASSES = (1, 11)
"""The flank tolerance classes of ISO 1328-1:2013, finest and coarsest."""
SCOPE = {"module": (0.5, 70.0), "diameter": (5.0, 15000.0), "teeth": (5.0, 1000.0)}
"""Clause 1 of ISO 1328-1:2013: normal module and reference diameter (mm) and number of teeth that its formulae serve.
The standard does not let them be extrapolated: beyond, maker and buyer agree."""
SOURCE = (
    "ISO 1328-1:2013, formulae (5) and (6); checked against public implementations of them, not the standard's text"
)


@names_keywords
@dataclass(frozen=True)
class PitchTolerances:
    """What the pitch of a spline must keep: `single`, the largest deviation of a single pitch by size (f_p), and
    `cumulative`, the range of the cumulative deviations (F_p), mm of arc. `source` says where they come from, and
    `beyond` each limit of the source's scope that this spline lies outside of."""

    single: float
    cumulative: float
    source: str = "given"
    beyond: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        require_positive(single_pitch=self.single, cumulative_pitch=self.cumulative)


def iso_1328_tolerances(tolerance_class: int, module: float, teeth: int) -> PitchTolerances:
    """f_pT and F_pT of an ISO 1328-1:2013 `tolerance_class` (1 to 11) for a spline of this `module` (mm) and so many
    `teeth`.

    f_pT = (0.001 d + 0.4 m + 5) 2^((A - 5)/2) and F_pT = (0.002 d + 0.55 sqrt(d) + 0.7 m + 12) 2^((A - 5)/2) in um, d
    the reference diameter in mm, rounded as the standard does. They are for involute flanks, which strain wave gears
    seldom have, and begin at module 0.5: `beyond` says so. Raises `DriveError` for a class that is none.
    """
    finest, coarsest = CLASSES
    require(
        finest <= tolerance_class <= coarsest,
        f"ISO 1328-1:2013 has the classes {finest} to {coarsest}, not {tolerance_class}",
    )
    diameter = module * teeth
    step = math.sqrt(2.0) ** (tolerance_class - 5)
    single = (0.001 * diameter + 0.4 * module + 5) * step
    cumulative = (0.002 * diameter + 0.55 * math.sqrt(diameter) + 0.7 * module + 12) * step
    beyond = ["involute flanks (these are of a strain wave gear)"]
    for name, value in (("module", module), ("diameter", diameter), ("teeth", float(teeth))):
        low, high = SCOPE[name]
        if not low <= value <= high:
            beyond.append(f"{name} {low:g} to {high:g} (here {value:.4g})")
    return PitchTolerances(
        _rounded_um(single) / 1000, _rounded_um(cumulative) / 1000, f"class {tolerance_class}, {SOURCE}", tuple(beyond)
    )


def _rounded_um(value: float) -> float:
    """As ISO 1328-1:2013, 5.2.3 rounds: above 10 um to whole, from 5 to halves, below to tenths."""
    step = 1.0 if value > 10 else 0.5 if value >= 5 else 0.1
    return math.floor(value / step + 0.5) * step
