"""Points of a closed curve by their angles: the one that closes the turn, and angles that come twice."""

from __future__ import annotations

import math
from decimal import Decimal

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.values import require

SAME_ANGLE = 1e-9
"""Rad: below it two angles are one; 0.03 nm along a rim of 30 mm."""
SAME_RADIUS = 1e-6
"""Mm: a nanometre, which no gauge of such parts resolves; tables that were computed close to some 1e-14 mm only."""


def last_place(text: str) -> float:
    """Unit of the last digit of a number's `text`: 0.001 of "20.800", 1.0 of "20": what it was rounded to."""
    return 10.0 ** int(Decimal(text).as_tuple().exponent)


def without_closing_point(angles: Array, radii: Array, rounding: float, where: str) -> tuple[Array, Array]:
    """Points without a last one that comes a whole turn from the first and repeats it.

    `angles` in rad and `radii` in mm, (n,) each, as a file has them; `rounding` (mm) is the unit of the last digit of
    its radii, and `where` names the file in the message. Raises `DriveError` where both radii differ by more than
    rounding: one of the two is no point of the part.
    """
    if len(angles) < 2 or not math.isclose(abs(angles[-1] - angles[0]), 2 * math.pi, abs_tol=SAME_ANGLE):
        return angles, radii
    apart = float(abs(radii[-1] - radii[0]))
    # Either is off by half a unit of the last place at most; their difference has rounding of its own.
    allowed = max(rounding, SAME_RADIUS)
    require(
        apart <= allowed * (1 + 1e-6),
        f"{where} closes the turn with the radius {radii[-1]:.8g} mm, where its first point has {radii[0]:.8g} mm: "
        f"{1000 * apart:.4g} um apart, more than the rounding of the file; keep the point that is right",
    )
    return angles[:-1], radii[:-1]


def require_one_point_an_angle(angles: Array, where: str) -> None:
    """Raise `DriveError` where two of the `angles` (rad, (n,), of one turn or more) are the same but for whole turns;
    `where` names their file in the message."""
    turned = np.sort(np.mod(np.asarray(angles, float), 2 * math.pi))
    gaps = np.diff(np.append(turned, turned[0] + 2 * math.pi))
    require(
        gaps.min() > SAME_ANGLE,
        f"{where} gives the angle {math.degrees(turned[gaps.argmin()]):.6g} deg twice; keep one point an angle",
    )
