"""A part: what it is made of, its volume and size in closed form, and the solid that CadQuery makes of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from hdopt.arrays import Array, Mask
from hdopt.geometry.contour import Circle, Contour, ParallelCurve
from hdopt.geometry.features import (
    BoltCircle,
    Bore,
    BrokenEdge,
    countersink_tool,
    countersink_volume,
)
from hdopt.geometry.slide_features import Slot, Tongue
from hdopt.geometry.solids import Station, joined, loft, turn
from hdopt.geometry.undercut import RingGroove, Stretch, Undercut

if TYPE_CHECKING:
    import cadquery as cq

Colour = tuple[float, float, float, float]
"""Red, green, blue, opacity, each 0 to 1."""

SHARP = BrokenEdge()


@dataclass(frozen=True)
class Prism:
    """Material between z = `bottom` and `top` within `outline`, outside `inner`; either outer edge may be broken.

    A round one may have undercuts at its `foot` and `head`, where shoulders stand, and a `groove` for a retaining ring.
    """

    outline: Contour
    bottom: float
    top: float
    bottom_edge: BrokenEdge = SHARP
    top_edge: BrokenEdge = SHARP
    inner: Contour | None = None
    foot: Undercut | None = None
    head: Undercut | None = None
    groove: RingGroove | None = None

    @property
    def height(self) -> float:
        return self.top - self.bottom

    @property
    def recesses(self) -> tuple[Undercut | RingGroove, ...]:
        """What is turned into the outline."""
        return tuple(recess for recess in (self.foot, self.head, self.groove) if recess is not None)

    @property
    def straight(self) -> float:
        """Length along z that its undercuts leave of the outline below a groove, mm; negative where they overlap."""
        low = self.bottom + (self.bottom_edge.axial if self.foot is None else self.foot.length)
        high = self.top - (self.top_edge.axial if self.head is None else self.head.length)
        return (high if self.groove is None else min(high, self.groove.bottom)) - low

    @property
    def volume(self) -> float:
        broken = sum(edge.removed_volume(self.outline.perimeter) for edge in (self.bottom_edge, self.top_edge))
        if isinstance(self.outline, Circle):
            broken += sum(recess.removed_volume(self.outline.radius) for recess in self.recesses)
        return (self.outline.area - (self.inner.area if self.inner else 0.0)) * self.height - broken

    def bore_volume(self, bore: Bore) -> float:
        return bore.area_with_disc(0.0) * self.height

    def contains(self, points: Array, margin: float) -> Mask:
        """Which points (n, 3) lie in a prism with unbroken edges, deeper than `margin` mm."""
        inside = (points[:, 2] > self.bottom + margin) & (points[:, 2] < self.top - margin)
        inside &= self.outline.deviation(points[:, :2]) < -margin
        return inside & (self.inner.deviation(points[:, :2]) > margin) if self.inner else inside

    def stations(self) -> list[Station]:
        stations = [
            (self.bottom, self.bottom_edge.radial),
            (self.bottom + self.bottom_edge.axial, 0.0),
            (self.top - self.top_edge.axial, 0.0),
            (self.top, self.top_edge.radial),
        ]
        return [station for index, station in enumerate(stations) if index == 0 or station[0] > stations[index - 1][0]]

    def _turned(self, outline: Circle) -> list[Stretch]:
        """Its side from the bottom up, where something is turned into it."""
        radius, side = outline.radius, []
        if self.foot is not None:
            side += self.foot.stretches(radius, self.bottom, 1)
        else:
            edge = self.bottom_edge
            side.append(((radius - edge.radial, self.bottom), None, (radius, self.bottom + edge.axial)))
        if self.groove is not None:
            side += self.groove.stretches(radius)
        if self.head is not None:
            side += [(end, middle, start) for start, middle, end in self.head.stretches(radius, self.top, -1)[::-1]]
        else:
            edge = self.top_edge
            side.append(((radius, self.top - edge.axial), None, (radius - edge.radial, self.top)))
        return side

    def build(self) -> cq.Shape:
        if isinstance(self.outline, Circle) and self.recesses:
            return turn(self.outline, self._turned(self.outline))
        solid = loft(self.outline, self.stations())
        if self.inner is None:
            return solid
        return solid.cut(loft(self.inner, [(self.bottom - 1, 0.0), (self.top + 1, 0.0)]))


@dataclass(frozen=True)
class Part:
    """One solid: prisms and tongues stacked along z, less a bore through all of them, a slot and bolt holes.

    The slot is cut into the back (the lowest plane). The bore is countersunk at the planes in `countersunk`, given as
    (z, +1 where the outside is above it, -1 where below). `context` parts show the surroundings and are not made.
    """

    name: str
    colour: Colour
    body: tuple[Prism | Tongue, ...]
    bore: Bore | None = None
    countersink: float = 0.0
    countersunk: tuple[tuple[float, int], ...] = ()
    slot: Slot | None = None
    bolts: BoltCircle | None = None
    contour: Contour | None = None
    context: bool = False
    clearance_hole: bool = False
    """Whether the bore passes the shaft without holding it."""

    @property
    def walls(self) -> tuple[Contour, ...]:
        """The contours that the file's upright walls are checked against, the outermost first."""
        inner = self.body[0].inner if len(self.body) == 1 and isinstance(self.body[0], Prism) else None
        return tuple(contour for contour in (self.contour, inner) if contour is not None)

    @property
    def bottom(self) -> float:
        return self.body[0].bottom

    @property
    def top(self) -> float:
        return self.body[-1].top

    @property
    def volume(self) -> float:
        """mm^3, in closed form from outlines, features and heights."""
        volume = sum(piece.volume for piece in self.body)
        if self.bore:
            volume -= sum(piece.bore_volume(self.bore) for piece in self.body)
            volume -= len(self.countersunk) * countersink_volume(self.bore, self.countersink)
        if self.slot:
            volume -= self.slot.volume_beside(self.bore)
        if self.bolts:
            volume -= self.bolts.area * sum(piece.height for piece in self.body if self.holds_bolts(piece))
        return volume

    def holds_bolts(self, piece: Prism | Tongue) -> bool:
        """Whether the bolt holes lie in this piece (they pass beside a hub's seat)."""
        if self.bolts is None or isinstance(piece, Tongue):
            return False
        return piece.outline.least_radius >= self.bolts.radius + self.bolts.hole / 2

    @property
    def box(self) -> tuple[float, float, float, float, float, float]:
        """x_min, y_min, z_min, x_max, y_max, z_max in mm, exact."""
        boxes = [piece.outline.box for piece in self.body if isinstance(piece, Prism)]
        low = [min(box[axis] for box in boxes) for axis in (0, 1)]
        high = [max(box[axis] for box in boxes) for axis in (2, 3)]
        return low[0], low[1], self.bottom, high[0], high[1], self.top

    @property
    def size(self) -> tuple[float, float, float]:
        """Extent along x, y and z, mm."""
        box = self.box
        return box[3] - box[0], box[4] - box[1], box[5] - box[2]

    def build(self) -> cq.Solid:
        """The solid, made in CadQuery."""
        shape = joined([piece.build() for piece in self.body], self.name)
        if tools := self._tools():
            shape = shape.cut(*tools)
        (solid,) = shape.Solids()
        return solid

    def _tools(self) -> list[cq.Shape]:
        tools: list[cq.Shape] = []
        below, above = self.bottom - 1.0, self.top + 1.0
        if self.bore:
            tools += self.bore.tool(below, above)
            if self.countersink:
                tools += [countersink_tool(self.bore, self.countersink, face, side) for face, side in self.countersunk]
        if self.slot:
            tools += self.slot.tool(self.bottom)
        if self.bolts:
            tools += self.bolts.tool(below, above)
        return tools


@dataclass(frozen=True)
class ProfiledPart(Part):
    """A part that carries the flexible bearing, the cam or a disc: one prism or several within its `contour`."""

    body: tuple[Prism, ...] = field(kw_only=True)
    contour: Circle | ParallelCurve = field(kw_only=True)
