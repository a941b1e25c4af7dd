"""What compiled kernels know of a drive besides its errors."""

from __future__ import annotations

import math
from typing import NamedTuple

from hdopt.drive.geometry import Drive
from hdopt.kinematics.closed_form import TipGeometry, tip_geometry


class Gearing(NamedTuple):
    """The constants of a drive: its `tip`, `tan_alpha` of the pressure angle, `advance` (Z_CS/Z_FS), the input `turns`
    of a full relative turn, and `scale`, arcmin per mm of arc times k_e."""

    tip: TipGeometry
    tan_alpha: float
    advance: float
    turns: int
    scale: float


def gearing_of(drive: Drive, homogenization: float = 1.0) -> Gearing:
    """The constants of `drive`; `homogenization` is k_e."""
    gear = drive.geometry
    scale = homogenization * gear.arcmin_per_mm
    tan_alpha = math.tan(gear.pressure_angle)
    return Gearing(tip_geometry(drive), tan_alpha, gear.flexspline_advance, gear.beat_phases, scale)
