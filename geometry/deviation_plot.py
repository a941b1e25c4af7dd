"""The deviations of a measured cam over its angle, with the tolerance zone, as an SVG."""

from __future__ import annotations

import math

import numpy as np

from hdopt.geometry.compare import CamFit
from hdopt.geometry.sheet import SMALL, Sheet

WIDTH, HEIGHT = 190.0, 100.0
LEFT, RIGHT, TOP, BOTTOM = 20.0, 182.0, 16.0, 84.0


def deviation_plot(fit: CamFit, zone: float, title: str, description: str) -> str:
    """Text of an SVG that shows the deviations of a `fit` over the angle; `zone` is the full width of the profile's
    tolerance zone, mm. `title` stands above, `description` goes with the file."""
    sheet = Sheet(WIDTH, HEIGHT, title, description)
    half = 1e3 * zone / 2
    reach = 1.15 * max(half, 1e3 * fit.largest)
    step = _round_step(reach)

    def y(deviation: float) -> float:
        return (TOP + BOTTOM) / 2 - deviation / reach * (BOTTOM - TOP) / 2

    def x(degrees: float) -> float:
        return LEFT + degrees / 360 * (RIGHT - LEFT)

    sheet.text((LEFT, 9.5), title, 4.2, bold=True)
    sheet.polyline([(LEFT, TOP), (RIGHT, TOP), (RIGHT, BOTTOM), (LEFT, BOTTOM)], "thin", closed=True)
    for degrees in range(0, 361, 45):
        sheet.line((x(degrees), BOTTOM), (x(degrees), BOTTOM + 1.4))
        sheet.text((x(degrees), BOTTOM + 5.0), f"{degrees}", SMALL, "middle")
    tick = -math.floor(reach / step) * step
    while tick <= reach:
        sheet.line((LEFT - 1.4, y(tick)), (LEFT, y(tick)))
        sheet.text(
            (LEFT - 2.2, y(tick) + 0.9),
            f"{tick:.3g}".replace("-0", "0") if abs(tick) < 1e-9 else f"{tick:.3g}",
            SMALL,
            "end",
        )
        tick = round(tick + step, 9)
    sheet.line((LEFT, y(0)), (RIGHT, y(0)), "axis")
    for bound in (-half, half):
        sheet.line((LEFT, y(bound)), (RIGHT, y(bound)), "hidden")
    points = np.column_stack(
        [LEFT + np.degrees(fit.angles) / 360 * (RIGHT - LEFT), [y(value) for value in (1e3 * fit.deviations).tolist()]]
    )
    sheet.polyline(points, "visible")
    sheet.text(((LEFT + RIGHT) / 2, BOTTOM + 10.5), "angle from the major axis, deg", SMALL, "middle")
    sheet.text((7.0, (TOP + BOTTOM) / 2), "deviation along the normal, µm", SMALL, "middle", turn=-90)
    sheet.text((RIGHT, 9.5), f"dashed: tolerance zone of {1e3 * zone:.3g} µm", SMALL, "end")
    return sheet.svg()


def _round_step(reach: float) -> float:
    """A step of 1, 2 or 5 times a power of ten that gives about four ticks to either side."""
    power = 10.0 ** math.floor(math.log10(reach / 4))
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= reach / 4)
