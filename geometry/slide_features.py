"""The slot and the block of a cross-slide, with corners that a cutter makes and edges that pass over them.

Corners are bevelled at 45 degrees, as a cutter with a corner chamfer leaves them; a corner radius of the same size
leaves less. A radius would meet bore and rim in curves that no STEP file gives exactly.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hdopt.geometry.areas import obround, strip_of_disc
from hdopt.geometry.features import Bore, bar, cylinder

if TYPE_CHECKING:
    import cadquery as cq

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(32)

LARGEST_CORNER = 0.2
"""Of inside corners, mm: the corner chamfer or radius of common end mills."""

OVER = 1.5
"""Chamfer of an outside edge over the corner that it passes."""


@dataclass(frozen=True)
class SlideEdges:
    """Bevels at 45 degrees, mm: of inside corners (a slot's bottom, a block's foot) and of the outside edges that lie
    there (a block's top, a slot's mouth)."""

    corner: float = 0.0
    chamfer: float = 0.0

    @classmethod
    def of(cls, width: float, depth: float) -> SlideEdges:
        """Those of a slot of this `width` and `depth`, mm: smaller in small slots."""
        corner = round(min(LARGEST_CORNER, 0.1 * depth, 0.05 * width), 3)
        return cls(corner, round(OVER * corner, 3))

    def volume(self, width: float, height: float, side: int, area: Callable[[float], float]) -> float:
        """mm^3 of what is `width` wide and `height` high (mm), where a slice w mm wide has `area` (w), mm^2.

        `side` is +1 for a block, whose corners add to its foot, and -1 for a slot, whose corners are left at its
        bottom; the chamfers do the contrary at the other end.
        """
        full = area(width)
        volume = full * height
        for bevel, wider in ((self.corner, side), (self.chamfer, -side)):
            offs = (bevel * (1 + _NODES) / 2).tolist()
            extra = np.array([area(width + 2 * wider * off) - full for off in offs])
            volume += float(_WEIGHTS @ extra) * bevel / 2
        return volume


@dataclass(frozen=True)
class Slot:
    """A cross-slide slot `width` mm wide, cut `depth` deep into a part's back along `direction`.

    `half_length` is where its straight flanks end, from the axis; `closed` slots end round, in the part, open ones run
    out of a disc of `disc_radius`.
    """

    width: float
    depth: float
    half_length: float
    direction: float
    disc_radius: float
    closed: bool
    edges: SlideEdges = SlideEdges()

    @property
    def reach(self) -> float:
        return self.half_length + self.width / 2 if self.closed else self.disc_radius

    @property
    def mouth_reach(self) -> float:
        """Largest distance from the axis that the chamfer of a closed one comes to, mm."""
        return self.reach + self.edges.chamfer

    @property
    def area(self) -> float:
        return self._area(self.width)

    def _area(self, width: float) -> float:
        """mm^2 of a slice that is `width` mm wide: the parallel of its outline."""
        return obround(2 * self.half_length, width) if self.closed else strip_of_disc(width, self.disc_radius)

    def volume_beside(self, bore: Bore | None) -> float:
        """mm^3 that it takes off a part beyond what the `bore` has taken."""

        def area(width: float) -> float:
            return self._area(width) - (bore.area_in_strip(width) if bore is not None else 0.0)

        return self.edges.volume(self.width, self.depth, -1, area)

    def tool(self, face: float) -> list[cq.Shape]:
        """The milling cutter's path, from below `face` up into the part, and that of its mouth's chamfer."""
        edges = self.edges
        deep = self._path(self.width, face - 1.0, face + self.depth)
        if edges.corner:
            deep = deep.chamfer(edges.corner, None, self._upper_edges(deep))
        paths: list[cq.Shape] = [deep]
        if edges.chamfer:
            mouth = self._path(self.width + 2 * edges.chamfer, face - 1.0, face + edges.chamfer)
            paths.append(mouth.chamfer(edges.chamfer, None, self._upper_edges(mouth)))
        return [_turned(path, self.direction) for path in paths]

    def _path(self, width: float, bottom: float, top: float) -> cq.Solid:
        """What a cutter of this `width` takes out along +y."""
        import cadquery as cq

        if not self.closed:
            return bar(-2 * self.disc_radius, 2 * self.disc_radius, width, bottom, top, 0.0)
        half, end = width / 2, self.half_length
        corners = [cq.Vector(x, y, bottom) for x, y in ((half, -end), (half, end), (-half, end), (-half, -end))]
        outer = cq.Vector(0, end + half, bottom), cq.Vector(0, -end - half, bottom)
        wire = cq.Wire.assembleEdges(
            [
                cq.Edge.makeLine(corners[0], corners[1]),
                cq.Edge.makeThreePointArc(corners[1], outer[0], corners[2]),
                cq.Edge.makeLine(corners[2], corners[3]),
                cq.Edge.makeThreePointArc(corners[3], outer[1], corners[0]),
            ]
        )
        return cq.Solid.extrudeLinear(wire, [], cq.Vector(0, 0, top - bottom))

    def _upper_edges(self, path: cq.Solid) -> list[cq.Edge]:
        """The edges round the top of a `path`, but for those across the ends of an open one."""
        top = path.BoundingBox().zmax
        level = [edge for edge in path.Edges() if abs(edge.Center().z - top) < 1e-6]
        return level if self.closed else [edge for edge in level if abs(edge.Center().x) > 1e-6]


@dataclass(frozen=True)
class Tongue:
    """The block of a cross-slide: the strip of `width` along `direction` of a disc of `radius`."""

    radius: float
    width: float
    direction: float
    bottom: float
    top: float
    edges: SlideEdges = SlideEdges()

    @property
    def height(self) -> float:
        return self.top - self.bottom

    @property
    def area(self) -> float:
        """mm^2 of a slice between its foot and its upper edges."""
        return strip_of_disc(self.width, self.radius)

    @property
    def volume(self) -> float:
        return self.edges.volume(self.width, self.height, 1, lambda width: strip_of_disc(width, self.radius))

    def bore_volume(self, bore: Bore) -> float:
        return self.edges.volume(self.width, self.height, 1, bore.area_in_strip)

    def build(self) -> cq.Shape:
        import cadquery as cq

        half, r, c = self.width / 2, self.edges.corner, self.edges.chamfer
        right = [(half + r, self.bottom), (half, self.bottom + r), (half, self.top - c), (half - c, self.top)]
        corners = [*right, *((-x, z) for x, z in right[::-1])]
        drawn = cq.Wire.makePolygon([cq.Vector(x, -2 * self.radius, z) for x, z in dict.fromkeys(corners)], close=True)
        strip = cq.Solid.extrudeLinear(drawn, [], cq.Vector(0, 4 * self.radius, 0))
        return cylinder(self.radius, self.bottom, self.top).intersect(_turned(strip, self.direction))


def _turned(shape: cq.Shape, direction: float) -> cq.Shape:
    """A `shape` that lies along +y turned to `direction`, rad, clockwise."""
    import cadquery as cq

    return shape.rotate(cq.Vector(), cq.Vector(0, 0, 1), -math.degrees(direction))
