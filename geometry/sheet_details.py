"""Detail views of undercuts: where a cylinder meets a shoulder, enlarged, with what makes the corner."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hdopt.arrays import Array
from hdopt.geometry.contour import Circle
from hdopt.geometry.part import Part, Prism
from hdopt.geometry.sheet import INK, SMALL, TEXT, Label, Point, Sheet
from hdopt.geometry.sheet_room import is_free
from hdopt.geometry.undercut import AT_SHOULDER, RUN_OUT, Undercut

LETTERS = "ZYX"
"""What details are called: far from the letters of datums and of the section."""

RING = 2.6
"""Radius of the ring round an undercut in the section, mm."""

SCALES = ((0.5, 20.0), (0.0, 50.0))
"""From which length of an undercut on, mm, it is enlarged by how much."""

MARGIN, DEEP = 9.0, 10.0
"""What is drawn beside an undercut, and below its bottom, mm of the sheet."""


def undercuts_of(part: Part) -> dict[Undercut, list[tuple[float, float, int]]]:
    """The undercuts of a `part`, each with the corners that it lies in: z, y in the section, and on which side along z
    the cylinder lies (+1: above its shoulder). A corner is where the neighbour stands above the cylinder."""
    found: dict[Undercut, list[tuple[float, float, int]]] = {}
    for index, piece in enumerate(part.body):
        if not (isinstance(piece, Prism) and isinstance(piece.outline, Circle)):
            continue
        ends = ((piece.foot, piece.bottom, index - 1, 1), (piece.head, piece.top, index + 1, -1))
        for recess, z, beside, away in ends:
            if recess is None:
                continue
            low, high, other = piece.outline.box[1], piece.outline.box[3], part.body[beside]
            stands_above = not isinstance(other, Prism) or other.outline.box[3] > high
            found.setdefault(recess, []).append((z, high if stands_above else low, away))
    return found


def mark_details(sheet: Sheet, part: Part, origin: Point, scale: float) -> None:
    """A ring with its letter round each undercut of a `part` in its section, whose z = 0 and axis lie at `origin` on
    the `sheet`, enlarged by `scale`. The letter stands where no line runs, over the cylinder if there is room."""
    for letter, corners in zip(LETTERS, undercuts_of(part).values(), strict=False):
        for z, y, away in corners:
            x, level = origin[0] + scale * z, origin[1] - scale * y
            sheet.circle((x, level), RING, "thin")
            out = 1 if y >= 0 else -1
            turns = [away * step for step in (45, 60, 30, 75, 90, 110, 130, 15, 0, 150, 180, 210, 240, 270, 300, 330)]
            places = [
                (x + reach * math.sin(math.radians(turn)), level - out * reach * math.cos(math.radians(turn)) + 1.1)
                for reach in (5.0, 7.5, 10.0)
                for turn in turns
            ]
            labels = (Label(at, letter, TEXT, "middle", 0.0, True, INK) for at in places)
            sheet.marks.append(next(label for label in labels if is_free(sheet, label)))


def draw_details(sheet: Sheet, part: Part, corner: Point) -> None:
    """The detail views of a `part`, side by side, the first with its upper left at `corner` of the `sheet`."""
    for index, (letter, undercut) in enumerate(zip(LETTERS, undercuts_of(part), strict=False)):
        _detail(sheet, (corner[0] + 66.0 * index, corner[1]), letter, undercut)


def outline(undercut: Undercut) -> Array:
    """The outline (n, 2) of an `undercut` from its shoulder to the cylinder: mm along the axis from the shoulder, mm
    above the cylinder's surface."""
    _, flat, slope = undercut.stretches(0.0, 0.0, 1)
    turn, r = np.linspace(math.pi, 1.5 * math.pi, 41), undercut.radius
    arc = np.column_stack([r + r * np.cos(turn), undercut.rise + r * np.sin(turn)])
    return np.vstack([arc, [(flat[2][1], flat[2][0]), (slope[2][1], slope[2][0])]])


def _detail(sheet: Sheet, corner: Point, letter: str, undercut: Undercut) -> None:
    scale = next(scale for least, scale in SCALES if undercut.length >= least)
    margin, deep = MARGIN / scale, DEEP / scale
    left, top = corner[0] + 12.0, corner[1] + 11.0 + scale * undercut.rise + MARGIN

    def placed(points: Array | Sequence[Point]) -> Array:
        return np.asarray(points, float) * (scale, -scale) + (left + MARGIN, top)

    name = "DIN 509-E0.2×0.1" if undercut == AT_SHOULDER else "relief"
    sheet.text((corner[0], corner[1] + 3.0), f"{letter}  {scale:g}:1  {name}", TEXT, bold=True)
    made = outline(undercut)
    high, length = undercut.rise + margin, undercut.length
    seen = np.vstack([[(0.0, high)], made, [(length + margin, 0.0)]])
    low = -undercut.depth - deep
    fill = sheet.hatch("section", "#30506a", 45, 1.9)
    sheet.region(placed(np.vstack([seen, [(length + margin, low), (-margin, low), (-margin, high)]])), [], fill)
    sheet.polyline(placed(seen))
    (x0, y0), (x1, _) = placed([(0.0, 0.0), (length, 0.0)]).tolist()
    bottom = float(placed([(0.0, low)])[0, 1])
    sheet.dimension((x0, y0), (x1, y0), bottom + 6.0, f"{length:g}", False)
    edge = length + margin
    (xr, yr), (_, yd) = placed([(edge, 0.0), (edge, -undercut.depth)]).tolist()
    foot = placed(made[-2:-1])[0].tolist()
    sheet.dimension((foot[0], yd), (xr, yr), xr + 5.0, f"{undercut.depth:g}", True, 2.6 if yr < yd else -1.6)
    turn = math.radians(225)
    r = undercut.radius
    tip = placed([(r + r * math.cos(turn), undercut.rise + r * math.sin(turn))])[0].tolist()
    sheet.leader((tip[0], tip[1]), (tip[0] + 7.0, tip[1] - 13.5), [f"R{r:g}"], SMALL)
    slope = placed(made[-2:]).mean(axis=0).tolist()
    sheet.leader((slope[0], slope[1]), (slope[0] + 6.0, slope[1] - 7.0), [f"{math.degrees(RUN_OUT):g}°"], SMALL)
