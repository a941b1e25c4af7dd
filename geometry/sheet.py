"""A drawing sheet: lines by their kind, hatched regions, dimensions, leaders, tolerance frames, tables.

Sheet coordinates are mm, x to the right and y DOWN, as SVG has them. What is drawn is kept as marks, which
`Sheet.svg`, `hdopt.geometry.sheet_pdf` and `hdopt.geometry.sheet_dxf` turn into files.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from html import escape

import numpy as np

from hdopt.arrays import Array

Point = tuple[float, float]

WIDE, NARROW = 0.4, 0.2
"""Line widths of ISO 128, mm."""

TEXT = 3.2
SMALL = 2.6
ARROW = 2.6
INK, GREY = "#16202b", "#5d6b7a"


@dataclass(frozen=True)
class Kind:
    """A kind of line: colour, width in mm, dashes in mm."""

    colour: str
    width: float
    dashes: tuple[float, ...] = ()


KINDS = {
    "visible": Kind(INK, WIDE),
    "thin": Kind(INK, NARROW),
    "hidden": Kind(GREY, NARROW + 0.05, (2.4, 1.2)),
    "axis": Kind(GREY, NARROW, (7, 1.4, 1.2, 1.4)),
    "frame": Kind(INK, 0.7),
}


@dataclass(frozen=True)
class Line:
    """A polyline through `points` (n, 2)."""

    points: Array
    kind: str
    closed: bool = False


@dataclass(frozen=True)
class Ring:
    """A circle."""

    centre: Point
    radius: float
    kind: str
    fill: str = "none"


@dataclass(frozen=True)
class Area:
    """A region with holes, filled with the hatch of a name."""

    outer: Array
    holes: tuple[Array, ...]
    hatch: str


@dataclass(frozen=True)
class Solid:
    """A filled polygon."""

    points: Array


@dataclass(frozen=True)
class Label:
    """Text at a point of its base line; `anchor` is start, middle or end; `turn` in degrees, clockwise on the sheet."""

    at: Point
    content: str
    size: float
    anchor: str
    turn: float
    bold: bool
    colour: str


@dataclass(frozen=True)
class Hatch:
    """Parallel lines: colour, angle in degrees, pitch in mm."""

    colour: str
    angle: float
    pitch: float


@dataclass(frozen=True)
class Group:
    """The beginning of a named group, or its end where the name is None."""

    name: str | None


Mark = Line | Ring | Area | Solid | Label | Group


class Sheet:
    """Collects marks; `svg()` gives the text of an SVG file."""

    def __init__(self, width: float, height: float, title: str, description: str) -> None:
        self.width, self.height, self.title, self.description = width, height, title, description
        self.hatches: dict[str, Hatch] = {}
        self.marks: list[Mark] = []

    @contextmanager
    def group(self, name: str) -> Iterator[None]:
        """What is drawn meanwhile can be told from the rest by its name."""
        self.marks.append(Group(name))
        yield
        self.marks.append(Group(None))

    @property
    def labels(self) -> list[Label]:
        return [mark for mark in self.marks if isinstance(mark, Label)]

    def polyline(self, points: Array | Sequence[Point], kind: str = "visible", closed: bool = False) -> None:
        self.marks.append(Line(np.asarray(points, float), kind, closed))

    def line(self, start: Point, end: Point, kind: str = "thin") -> None:
        self.polyline([start, end], kind)

    def circle(self, centre: Point, radius: float, kind: str = "thin", fill: str = "none") -> None:
        self.marks.append(Ring(centre, radius, kind, fill))

    def region(self, outer: Array, holes: Sequence[Array], fill: str) -> None:
        """A region with holes, filled with a hatch, without a line round it."""
        self.marks.append(Area(outer, tuple(holes), fill))

    def hatch(self, name: str, colour: str, angle: float, pitch: float = 1.7) -> str:
        """A hatch; returns what to fill a region with."""
        self.hatches[name] = Hatch(colour, angle, pitch)
        return name

    def text(
        self,
        at: Point,
        content: str,
        size: float = TEXT,
        anchor: str = "start",
        turn: float = 0.0,
        bold: bool = False,
        colour: str = INK,
    ) -> None:
        self.marks.append(Label(at, content, size, anchor, turn, bold, colour))

    def arrow(self, tip: Point, direction: float) -> None:
        """A filled arrow head whose tip points to `direction`, rad in sheet coordinates."""
        points = [
            (tip[0] - ARROW * math.cos(direction + turn), tip[1] - ARROW * math.sin(direction + turn))
            for turn in (0.16, -0.16)
        ]
        self.marks.append(Solid(np.array([tip, *points])))

    def dimension(self, start: Point, end: Point, at: float, text: str, vertical: bool, text_at: float = 0.5) -> None:
        """A linear dimension between two points; its line lies at x (vertical) or y (horizontal) `at`."""
        first, last = ((at, start[1]), (at, end[1])) if vertical else ((start[0], at), (end[0], at))
        for point, foot in ((start, first), (end, last)):
            away = math.atan2(foot[1] - point[1], foot[0] - point[0])
            gap, past = 0.8, 1.6
            self.line(
                (point[0] + gap * math.cos(away), point[1] + gap * math.sin(away)),
                (foot[0] + past * math.cos(away), foot[1] + past * math.sin(away)),
            )
        along = math.atan2(last[1] - first[1], last[0] - first[0])
        length = math.dist(first, last)
        if length > 3.2 * ARROW:
            self.line(first, last)
            self.arrow(first, along + math.pi)
            self.arrow(last, along)
        else:
            # No room between the arrows: they point at each other from outside.
            out = 2.2 * ARROW
            unit = (math.cos(along), math.sin(along))
            self.line(
                (first[0] - out * unit[0], first[1] - out * unit[1]), (last[0] + out * unit[0], last[1] + out * unit[1])
            )
            self.arrow(first, along)
            self.arrow(last, along + math.pi)
        x, y = first[0] + text_at * (last[0] - first[0]), first[1] + text_at * (last[1] - first[1])
        if vertical:
            self.text((x - 1.1, y), text, anchor="middle", turn=-90)
        else:
            self.text((x, y - 1.1), text, anchor="middle")

    def leader(self, tip: Point, knee: Point, lines: Sequence[str], size: float = TEXT) -> None:
        """An arrow from text at `knee` to `tip`; the text runs away from the tip."""
        self.line(tip, knee)
        self.arrow(tip, math.atan2(tip[1] - knee[1], tip[0] - knee[0]))
        side = 1 if knee[0] >= tip[0] else -1
        width = max(text_width(line, size) for line in lines)
        self.line(knee, (knee[0] + side * (width + 1.5), knee[1]))
        for row, line in enumerate(lines):
            # The first line stands on the leader's shelf, the others hang below it.
            y = knee[1] - 1.0 + (row * 1.3 * size + 0.7 if row else 0.0)
            self.text((knee[0] + side * 1.2, y), line, size, "start" if side > 0 else "end")

    def frame(self, at: Point, symbol: str, value: str, datum: str = "") -> float:
        """A tolerance frame (ISO 1101) with its upper left corner `at`; returns its width."""
        height, cells = FRAME_HEIGHT, [6.4, 3.0 + text_width(value, TEXT)] + [5.6] * len(datum)
        x, y = at
        for width in cells:
            self.polyline([(x, y), (x + width, y), (x + width, y + height), (x, y + height)], "thin", closed=True)
            x += width
        middle = (at[0] + cells[0] / 2, y + height / 2)
        self._symbol(symbol, middle)
        self.text((at[0] + cells[0] + cells[1] / 2, y + height / 2 + 1.15), value, anchor="middle")
        left = at[0] + cells[0] + cells[1]
        for index, letter in enumerate(datum):
            self.text((left + 5.6 * index + 2.8, y + height / 2 + 1.15), letter, anchor="middle", bold=True)
        return sum(cells)

    def _symbol(self, symbol: str, centre: Point) -> None:
        x, y = centre
        if symbol == "profile":
            turn = np.linspace(math.pi, 2 * math.pi, 25)
            self.polyline(np.column_stack([x + 1.9 * np.cos(turn), y + 1.0 + 1.9 * np.sin(turn)]), "thin", closed=True)
        elif symbol == "position":
            self.circle(centre, 1.3)
            self.line((x - 2.2, y), (x + 2.2, y))
            self.line((x, y - 2.2), (x, y + 2.2))
        elif symbol == "perpendicularity":
            self.line((x - 1.9, y + 1.7), (x + 1.9, y + 1.7))
            self.line((x, y + 1.7), (x, y - 1.9))
        elif symbol == "symmetry":
            for shift, reach in ((-1.1, 1.2), (0.0, 2.0), (1.1, 1.2)):
                self.line((x - reach, y + shift), (x + reach, y + shift))
        elif symbol == "cylindricity":
            self.circle(centre, 1.1)
            lean, lift = math.cos(math.pi / 3), math.sin(math.pi / 3)
            for side in (-1.1, 1.1):  # two tangents that lean by 60 degrees
                at_x, at_y = x + side * lift, y + side * lean
                self.line((at_x - 2 * lean, at_y + 2 * lift), (at_x + 2 * lean, at_y - 2 * lift))
        elif symbol == "coaxiality":
            self.circle(centre, 1.8)
            self.circle(centre, 1.0)
        elif symbol == "parallelism":
            for shift in (-0.7, 0.7):
                self.line((x + shift - 0.8, y + 1.7), (x + shift + 0.8, y - 1.7))

    def table(
        self, at: Point, widths: Sequence[float], rows: Sequence[Sequence[str]], row_height: float = 4.7
    ) -> float:
        """A ruled table whose first row is its heading; returns the y below it."""
        x0, y = at
        total = sum(widths)
        for index, row in enumerate(rows):
            x = x0
            for width, cell in zip(widths, row, strict=True):
                if not cell:
                    x += width
                    continue
                numeric = cell[:1].isdigit() and cell.replace(".", "").isdigit()
                place = (x + width - 1.5, "end") if numeric else (x + 1.5, "start")
                self.text(
                    (place[0], y + row_height - 0.28 * row_height),
                    cell,
                    min(SMALL, 0.6 * row_height),
                    place[1],
                    bold=index == 0,
                )
                x += width
            y += row_height
            if index == 0:
                self.line((x0, y), (x0 + total, y), "thin")
        self.polyline([(x0, at[1]), (x0 + total, at[1]), (x0 + total, y), (x0, y)], "thin", closed=True)
        x = x0
        for width in widths[:-1]:
            x += width
            self.line((x, at[1]), (x, y))
        return y

    def svg(self) -> str:
        family = "'DejaVu Sans', Verdana, sans-serif"
        definitions = "".join(_pattern(name, hatch) for name, hatch in self.hatches.items())
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{self.width:g}mm" height="{self.height:g}mm" '
            f'viewBox="0 0 {self.width:g} {self.height:g}" font-family="{family}">'
            f"<title>{escape(self.title)}</title><desc>{escape(self.description)}</desc>"
            f"<defs>{definitions}</defs>"
            f'<rect width="100%" height="100%" fill="#ffffff"/>{"".join(map(_element, self.marks))}</svg>\n'
        )


FRAME_HEIGHT = 5.6
"""Height of a tolerance frame, mm."""


@lru_cache(maxsize=4096)
def text_width(content: str, size: float, bold: bool = False) -> float:
    """Width of the text `content` in DejaVu Sans, `bold` or not, at a font `size`, both in mm."""
    from matplotlib.font_manager import FontProperties, findfont, get_font

    font = get_font(findfont(FontProperties(family="DejaVu Sans", weight="bold" if bold else "normal")))
    font.set_size(100, 72)
    font.set_text(content, 0.0)
    return float(font.get_width_height()[0]) / 64 / 100 * size


def label_box(label: Label) -> tuple[float, float, float, float]:
    """Left, top, right and bottom of a label on the sheet, mm (upright or turned by a quarter)."""
    width = text_width(label.content, label.size, label.bold)
    start = {"start": 0.0, "middle": -width / 2, "end": -width}[label.anchor]
    x, y = label.at
    up, down = 0.74 * label.size, 0.12 * label.size
    if label.turn:
        return x - up, y - start - width, x + down, y - start
    return x + start, y - up, x + start + width, y + down


def _stroke(kind: str) -> str:
    line = KINDS[kind]
    dashes = f' stroke-dasharray="{" ".join(f"{dash:g}" for dash in line.dashes)}"' if line.dashes else ""
    caps = ' stroke-linecap="round" stroke-linejoin="round"' if kind == "visible" else ""
    return f'stroke="{line.colour}" stroke-width="{line.width:g}"{caps}{dashes}'


def _pattern(name: str, hatch: Hatch) -> str:
    pitch, colour = hatch.pitch, hatch.colour
    return (
        f'<pattern id="{name}" width="{pitch}" height="{pitch}" patternUnits="userSpaceOnUse" '
        f'patternTransform="rotate({hatch.angle})"><rect width="{pitch}" height="{pitch}" fill="{colour}" '
        f'fill-opacity="0.16"/><line x1="0" y1="0" x2="0" y2="{pitch}" stroke="{colour}" '
        f'stroke-width="0.36"/></pattern>'
    )


def _ring_path(points: Array) -> str:
    return "M" + " L".join(f"{x:.3f} {y:.3f}" for x, y in points.tolist())


def _element(mark: Mark) -> str:
    if isinstance(mark, Line):
        return f'<path d="{_ring_path(mark.points)}{"Z" if mark.closed else ""}" fill="none" {_stroke(mark.kind)}/>'
    if isinstance(mark, Ring):
        x, y = mark.centre
        return f'<circle cx="{x:.3f}" cy="{y:.3f}" r="{mark.radius:.3f}" fill="{mark.fill}" {_stroke(mark.kind)}/>'
    if isinstance(mark, Area):
        path = " ".join(f"{_ring_path(ring)}Z" for ring in (mark.outer, *mark.holes))
        return f'<path d="{path}" fill="url(#{mark.hatch})" fill-rule="evenodd" stroke="none"/>'
    if isinstance(mark, Solid):
        corners = " ".join(f"{x:.3f},{y:.3f}" for x, y in mark.points.tolist())
        return f'<polygon points="{corners}" fill="{INK}"/>'
    if isinstance(mark, Label):
        return _text_element(mark)
    return "</g>" if mark.name is None else f'<g id="{mark.name}">'


def _text_element(label: Label) -> str:
    x, y = label.at
    turned = f' transform="rotate({label.turn:g} {x:.3f} {y:.3f})"' if label.turn else ""
    weight = ' font-weight="600"' if label.bold else ""
    return (
        f'<text x="{x:.3f}" y="{y:.3f}" font-size="{label.size}" text-anchor="{label.anchor}" fill="{label.colour}"'
        f"{weight}{turned}>{escape(label.content)}</text>"
    )
