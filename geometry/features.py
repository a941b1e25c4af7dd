"""What is cut into a part: bores with their keyway or flat, bolt circles, broken edges.

Every feature knows its area in closed form (for the check of a file) and its cutting tool as a CadQuery shape. A
feature that has a direction has it at `direction` rad, clockwise from the major axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from hdopt.errors import HdoptError
from hdopt.geometry.areas import round_corner, segment_of_disc, slot_outside_disc, strip_of_disc
from hdopt.geometry.din6885 import Key

if TYPE_CHECKING:
    import cadquery as cq

_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(32)


@dataclass(frozen=True)
class BrokenEdge:
    """An outer edge cut back by `radial` over the last `axial` mm: a chamfer where both are alike, else a lead-in."""

    axial: float = 0.0
    radial: float = 0.0

    @classmethod
    def chamfer(cls, size: float) -> BrokenEdge:
        return cls(size, size)

    @classmethod
    def lead_in(cls, length: float, angle: float) -> BrokenEdge:
        return cls(length, length * math.tan(angle))

    def removed_volume(self, perimeter: float) -> float:
        """Volume taken off a prism whose outline has this perimeter: its parallels have the area A - P s + pi s^2."""
        return self.axial * (perimeter * self.radial / 2 - math.pi * self.radial**2 / 3)


class Bore(Protocol):
    """A hole through the middle of a part."""

    @property
    def radius(self) -> float: ...

    @property
    def reach(self) -> float:
        """Largest distance from the axis that the hole comes to, mm."""

    @property
    def depth_of_countersink(self) -> float:
        """How far below the mouth's chamfer its cone still cuts, mm."""

    def area_with_disc(self, radius: float) -> float:
        """Area of the hole united with a disc of `radius` about the axis (a slice of the countersink)."""

    def area_in_strip(self, width: float) -> float:
        """Area of the hole within a strip of `width` through the axis, square to the feature's direction."""

    def tool(self, bottom: float, top: float) -> list[cq.Shape]: ...


@dataclass(frozen=True)
class PlainBore:
    radius: float

    @property
    def reach(self) -> float:
        return self.radius

    @property
    def depth_of_countersink(self) -> float:
        return 0.0

    def area_with_disc(self, radius: float) -> float:
        return math.pi * max(radius, self.radius) ** 2

    def area_in_strip(self, width: float) -> float:
        return strip_of_disc(width, self.radius)

    def tool(self, bottom: float, top: float) -> list[cq.Shape]:
        return [cylinder(self.radius, bottom, top)]


@dataclass(frozen=True)
class KeywayBore:
    """A bore with one keyway of DIN 6885-1, whose bottom has round corners."""

    radius: float
    key: Key
    direction: float = 0.0

    @property
    def bottom(self) -> float:
        """Distance of the keyway's bottom from the axis, mm."""
        return self.radius + self.key.hub_depth

    @property
    def reach(self) -> float:
        return self._to_corner + self.key.corner

    @property
    def _to_corner(self) -> float:
        """Distance of the middle of a round corner from the axis, mm."""
        return math.hypot(self.bottom - self.key.corner, self.key.width / 2 - self.key.corner)

    @property
    def depth_of_countersink(self) -> float:
        return 0.0

    def area_with_disc(self, radius: float) -> float:
        radius = max(radius, self.radius)
        if radius >= self.reach:
            return math.pi * radius**2
        if radius > self._to_corner:
            raise HdoptError(
                f"a countersink of radius {radius:.4g} mm ends in the corners of the keyway, {self._to_corner:.4g} to "
                f"{self.reach:.4g} mm from the axis; give a smaller export.bore_chamfer_mm"
            )
        corners = 2 * round_corner(self.key.corner, self.key.corner)
        return math.pi * radius**2 + slot_outside_disc(self.key.width, self.bottom, radius) - corners

    def area_in_strip(self, width: float) -> float:
        start = math.sqrt(self.radius**2 - self.key.width**2 / 4)
        end = min(width / 2, self.bottom)
        area = strip_of_disc(width, self.radius)
        if end > start:
            round_part = segment_of_disc(self.radius, start) - segment_of_disc(self.radius, end)
            area += self.key.width * (end - start) - round_part
        into = min(max(0.0, end - self.bottom + self.key.corner), self.key.corner)
        return area - 2 * round_corner(self.key.corner, into)

    def tool(self, bottom: float, top: float) -> list[cq.Shape]:
        return [
            cylinder(self.radius, bottom, top),
            self._keyway(bottom, top),
        ]

    def _keyway(self, bottom: float, top: float) -> cq.Solid:
        """The broach's path, from the axis outward, with round corners."""
        import cadquery as cq

        slot = cq.Solid.makeBox(self.key.width, self.bottom, top - bottom, cq.Vector(-self.key.width / 2, 0.0, bottom))
        edges = [
            edge for edge in slot.Edges() if abs(edge.Center().y - self.bottom) < 1e-9 and abs(edge.Center().x) > 1e-9
        ]
        rounded = slot.fillet(self.key.corner, edges)
        turned: cq.Solid = rounded.rotate(cq.Vector(), cq.Vector(0, 0, 1), -math.degrees(self.direction)).Solids()[0]
        return turned


@dataclass(frozen=True)
class DBore:
    """A bore with one flat, `flat` mm from the axis."""

    radius: float
    flat: float
    direction: float = 0.0

    @property
    def reach(self) -> float:
        return self.radius

    @property
    def depth_of_countersink(self) -> float:
        return self.radius - self.flat

    def area_with_disc(self, radius: float) -> float:
        if radius >= self.radius:
            return math.pi * radius**2
        full = math.pi * self.radius**2 - segment_of_disc(self.radius, self.flat)
        return full + (segment_of_disc(radius, self.flat) if radius > self.flat else 0.0)

    def area_in_strip(self, width: float) -> float:
        cut_off = 0.0
        if width / 2 > self.flat:
            cut_off = segment_of_disc(self.radius, self.flat) - segment_of_disc(self.radius, width / 2)
        return strip_of_disc(width, self.radius) - cut_off

    def tool(self, bottom: float, top: float) -> list[cq.Shape]:
        side = 2 * self.radius
        keep = bar(-side, self.flat, 2 * side, bottom, top, self.direction)
        return [cylinder(self.radius, bottom, top).intersect(keep)]


def countersink_volume(bore: Bore, size: float) -> float:
    """Volume that a 45 degree countersink of `size` mm takes off beyond the bore itself; none where `size` is 0."""
    if size == 0:
        return 0.0
    plain = bore.area_with_disc(0.0)
    shares, weights = (1 + _GAUSS_NODES) / 2, _GAUSS_WEIGHTS / 2
    volume = 0.0
    for low, high in ((bore.radius, bore.radius + size), (bore.radius - bore.depth_of_countersink, bore.radius)):
        # Radii crowd toward the low end, where the area of a disc beyond a flat begins like a power of 3/2.
        extra = [bore.area_with_disc(low + (high - low) * share**2) - plain for share in shares.tolist()]
        volume += float(weights @ (2 * shares * (high - low) * np.array(extra)))
    return volume


def countersink_tool(bore: Bore, size: float, face: float, outward: int) -> cq.Shape:
    """The cone of a 45 degree countersink of `size` mm at the mouth of a `bore`, in the plane z = `face`, whose outside
    lies toward `outward` (+1 or -1)."""
    import cadquery as cq

    depth = size + bore.depth_of_countersink
    margin = 1.0
    return cq.Solid.makeCone(
        bore.radius + size + margin,
        bore.radius + size - depth,
        depth + margin,
        cq.Vector(0, 0, face + outward * margin),
        cq.Vector(0, 0, -outward),
    )


@dataclass(frozen=True)
class BoltCircle:
    """`count` holes of `hole` mm diameter on a circle of radius `radius`, the first half a pitch off the major axis."""

    count: int
    hole: float
    radius: float

    @property
    def area(self) -> float:
        return self.count * math.pi * self.hole**2 / 4

    @property
    def centres(self) -> list[tuple[float, float]]:
        return [polar(self.radius, (k + 0.5) * 2 * math.pi / self.count) for k in range(self.count)]

    def tool(self, bottom: float, top: float) -> list[cq.Shape]:
        return [cylinder(self.hole / 2, bottom, top, centre) for centre in self.centres]


def polar(radius: float, direction: float) -> tuple[float, float]:
    """x, y of a point `radius` from the axis at `direction` rad, clockwise from the major axis."""
    return radius * math.sin(direction), radius * math.cos(direction)


def cylinder(radius: float, bottom: float, top: float, centre: tuple[float, float] = (0.0, 0.0)) -> cq.Solid:
    """A cylinder of `radius` between z = `bottom` and `top`, its axis through `centre` (x, y); mm."""
    import cadquery as cq

    return cq.Solid.makeCylinder(radius, top - bottom, cq.Vector(*centre, bottom))


def bar(start: float, end: float, width: float, bottom: float, top: float, direction: float) -> cq.Solid:
    """A box between z = `bottom` and `top`, along `direction` (rad, clockwise from the major axis) from `start` to
    `end`, `width` across; mm."""
    import cadquery as cq

    box = cq.Solid.makeBox(width, end - start, top - bottom, cq.Vector(-width / 2, start, bottom))
    return box.rotate(cq.Vector(), cq.Vector(0, 0, 1), -math.degrees(direction))
