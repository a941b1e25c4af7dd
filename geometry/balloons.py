"""Numbers in rings beside a view, and the lines that join them to what they speak of."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hdopt.geometry.sheet import Point, Sheet, Solid
from hdopt.geometry.sheet_room import is_clear

RADIUS = 2.6
"""Of the ring round a number, mm."""

APART = math.radians(12)
"""Least angle between two numbers beside a view."""

DOT = 0.6
"""Radius of the dot at a line that ends within an outline (ISO 128-2), mm."""


def draw_balloon(sheet: Sheet, centre: Point, number: int) -> None:
    """A `number` in a ring about a `centre` of the `sheet`."""
    sheet.circle(centre, RADIUS, "thin", "#ffffff")
    sheet.text((centre[0], centre[1] + 1.0), str(number), 2.9, "middle")


def point_out(sheet: Sheet, tip: Point, centre: Point, number: int, on_face: bool) -> None:
    """A `number` in a ring about a `centre` of the `sheet`, joined to the `tip` by a line: that ends in a dot where it
    stands `on_face`, within an outline, else in an arrow."""
    share = RADIUS / max(math.dist(centre, tip), RADIUS)
    sheet.line(tip, (centre[0] + share * (tip[0] - centre[0]), centre[1] + share * (tip[1] - centre[1])))
    if on_face:
        turn = np.linspace(0, 2 * math.pi, 17)[:-1]
        sheet.marks.append(Solid(np.column_stack([tip[0] + DOT * np.cos(turn), tip[1] + DOT * np.sin(turn)])))
    else:
        sheet.arrow(tip, math.atan2(tip[1] - centre[1], tip[0] - centre[0]))
    draw_balloon(sheet, centre, number)


def places_around(sheet: Sheet, tips: Sequence[Point], centre: Point, reach: float) -> list[Point]:
    """A place for each of the `tips` on a ring of radius `reach` round the `centre` of a view on the `sheet`, near its
    own direction: none nearer to another than `APART`, and none where a line runs, if there is such a place.

    The directions of the cutting plane's letters and of the dimension line on the left stay free.
    """
    taken = [math.radians(angle) for angle in (-90, 90, 180)]
    places = []
    for tip in tips:
        wanted = math.atan2(tip[1] - centre[1], tip[0] - centre[0]) if math.dist(tip, centre) > 1e-6 else 0.0
        steps = [sign * step * math.radians(2) for step in range(90) for sign in (1, -1)]
        apart = [wanted + turn for turn in steps if all(_between(wanted + turn, other) >= APART for other in taken)]
        free = (angle for angle in apart if is_clear(sheet, _box(_at(centre, reach, angle))))
        angle = next(free, apart[0])
        taken.append(angle)
        places.append(_at(centre, reach, angle))
    return places


def _at(centre: Point, reach: float, angle: float) -> Point:
    return centre[0] + reach * math.cos(angle), centre[1] + reach * math.sin(angle)


def _box(centre: Point) -> tuple[float, float, float, float]:
    return centre[0] - RADIUS, centre[1] - RADIUS, centre[0] + RADIUS, centre[1] + RADIUS


def _between(first: float, second: float) -> float:
    return abs(math.remainder(first - second, 2 * math.pi))
