"""A drawing sheet in SVG: lines by their kind, hatched regions, dimensions, leaders, tolerance frames, tables.

Sheet coordinates are mm, x to the right and y DOWN, as SVG has them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from html import escape

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Point = tuple[float, float]

WIDE, NARROW = 0.4, 0.2
"""Line widths of ISO 128, mm."""

TEXT = 3.2
SMALL = 2.6
ARROW = 2.6
INK, GREY = "#16202b", "#5d6b7a"

KINDS = {
    "visible": f'stroke="{INK}" stroke-width="{WIDE}" stroke-linecap="round" stroke-linejoin="round"',
    "thin": f'stroke="{INK}" stroke-width="{NARROW}"',
    "hidden": f'stroke="{GREY}" stroke-width="{NARROW + 0.05}" stroke-dasharray="2.4 1.2"',
    "axis": f'stroke="{GREY}" stroke-width="{NARROW}" stroke-dasharray="7 1.4 1.2 1.4"',
    "frame": f'stroke="{INK}" stroke-width="0.7"',
}


class Sheet:
    """Collects SVG elements; `svg()` gives the text of the file."""

    def __init__(self, width: float, height: float, title: str, description: str) -> None:
        self.width, self.height, self.title, self.description = width, height, title, description
        self._definitions: list[str] = []
        self._elements: list[str] = []

    @contextmanager
    def group(self, name: str) -> Iterator[None]:
        """What is drawn meanwhile can be told from the rest by its name."""
        self._elements.append(f'<g id="{name}">')
        yield
        self._elements.append("</g>")

    def polyline(self, points: Array | Sequence[Point], kind: str = "visible", closed: bool = False) -> None:
        path = "M" + " L".join(f"{x:.3f} {y:.3f}" for x, y in np.asarray(points).tolist()) + ("Z" if closed else "")
        self._elements.append(f'<path d="{path}" fill="none" {KINDS[kind]}/>')

    def line(self, start: Point, end: Point, kind: str = "thin") -> None:
        self.polyline([start, end], kind)

    def circle(self, centre: Point, radius: float, kind: str = "thin", fill: str = "none") -> None:
        self._elements.append(
            f'<circle cx="{centre[0]:.3f}" cy="{centre[1]:.3f}" r="{radius:.3f}" fill="{fill}" {KINDS[kind]}/>'
        )

    def region(self, outer: Array, holes: Sequence[Array], fill: str) -> None:
        """A filled region with holes, without a line round it."""
        rings = [" L".join(f"{x:.3f} {y:.3f}" for x, y in ring.tolist()) for ring in (outer, *holes)]
        path = " ".join(f"M{ring}Z" for ring in rings)
        self._elements.append(f'<path d="{path}" fill="{fill}" fill-rule="evenodd" stroke="none"/>')

    def hatch(self, name: str, colour: str, angle: float, pitch: float = 1.7) -> str:
        """A hatch pattern; returns what to fill a region with."""
        self._definitions.append(
            f'<pattern id="{name}" width="{pitch}" height="{pitch}" patternUnits="userSpaceOnUse" '
            f'patternTransform="rotate({angle})"><rect width="{pitch}" height="{pitch}" fill="{colour}" '
            f'fill-opacity="0.16"/><line x1="0" y1="0" x2="0" y2="{pitch}" stroke="{colour}" '
            f'stroke-width="0.36"/></pattern>'
        )
        return f"url(#{name})"

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
        turned = f' transform="rotate({turn:g} {at[0]:.3f} {at[1]:.3f})"' if turn else ""
        weight = ' font-weight="600"' if bold else ""
        self._elements.append(
            f'<text x="{at[0]:.3f}" y="{at[1]:.3f}" font-size="{size}" text-anchor="{anchor}" fill="{colour}"'
            f"{weight}{turned}>{escape(content)}</text>"
        )

    def arrow(self, tip: Point, direction: float) -> None:
        """A filled arrow head whose tip points to `direction`, rad in sheet coordinates."""
        points = [
            (tip[0] - ARROW * math.cos(direction + turn), tip[1] - ARROW * math.sin(direction + turn))
            for turn in (0.16, -0.16)
        ]
        corners = " ".join(f"{x:.3f},{y:.3f}" for x, y in (tip, *points))
        self._elements.append(f'<polygon points="{corners}" fill="{INK}"/>')

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
        width = max(len(line) for line in lines) * 0.53 * size
        self.line(knee, (knee[0] + side * (width + 1.5), knee[1]))
        for row, line in enumerate(lines):
            # The first line stands on the leader's shelf, the others hang below it.
            y = knee[1] - 1.0 + (row * 1.3 * size + 0.7 if row else 0.0)
            self.text((knee[0] + side * 1.2, y), line, size, "start" if side > 0 else "end")

    def frame(self, at: Point, symbol: str, value: str, datum: str = "") -> float:
        """A tolerance frame (ISO 1101) with its upper left corner `at`; returns its width."""
        height, cells = 5.6, [6.4, 3.0 + 0.56 * TEXT * len(value)] + ([5.6] if datum else [])
        x, y = at
        for width in cells:
            self.polyline([(x, y), (x + width, y), (x + width, y + height), (x, y + height)], "thin", closed=True)
            x += width
        middle = (at[0] + cells[0] / 2, y + height / 2)
        self._symbol(symbol, middle)
        self.text((at[0] + cells[0] + cells[1] / 2, y + height / 2 + 1.15), value, anchor="middle")
        if datum:
            self.text((x - 2.8, y + height / 2 + 1.15), datum, anchor="middle", bold=True)
        return sum(cells)

    def _symbol(self, symbol: str, centre: Point) -> None:
        x, y = centre
        if symbol == "profile":
            turn = np.linspace(math.pi, 2 * math.pi, 25)
            self.polyline(np.column_stack([x + 1.9 * np.cos(turn), y + 1.0 + 1.9 * np.sin(turn)]), "thin")
        elif symbol == "coaxiality":
            self.circle(centre, 1.8)
            self.circle(centre, 1.0)
        elif symbol == "parallelism":
            for shift in (-0.7, 0.7):
                self.line((x + shift - 0.8, y + 1.7), (x + shift + 0.8, y - 1.7))

    def datum(self, at: Point, letter: str, down: bool = True) -> None:
        """A datum triangle at a point of an outline, with its letter in a box below or above."""
        sign = 1 if down else -1
        x, y = at
        corners = f"{x - 1.5:.3f},{y:.3f} {x + 1.5:.3f},{y:.3f} {x:.3f},{y + sign * 2.6:.3f}"
        self._elements.append(f'<polygon points="{corners}" fill="{INK}"/>')
        self.line((x, y + sign * 2.6), (x, y + sign * 6))
        low = y + sign * 6 if down else y - 11
        self.polyline([(x - 2.5, low), (x + 2.5, low), (x + 2.5, low + 5), (x - 2.5, low + 5)], "thin", closed=True)
        self.text((x, low + 3.7), letter, anchor="middle", bold=True)

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
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{self.width:g}mm" height="{self.height:g}mm" '
            f'viewBox="0 0 {self.width:g} {self.height:g}" font-family="Helvetica, Arial, \'DejaVu Sans\', sans-serif">'
            f"<title>{escape(self.title)}</title><desc>{escape(self.description)}</desc>"
            f"<defs>{''.join(self._definitions)}</defs>"
            f'<rect width="100%" height="100%" fill="#ffffff"/>{"".join(self._elements)}</svg>\n'
        )
