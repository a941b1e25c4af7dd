"""What is turned into a round outline: undercuts at shoulders and grooves of retaining rings, with their volumes.

A cutter or a grinding wheel has a corner radius: where a cylinder meets a shoulder it needs room below the surface.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

RUN_OUT = math.radians(15)
"""Slope at which an undercut comes back to the surface (DIN 509, forms E and F)."""

Place = tuple[float, float]
"""Distance from the axis of the outline and z, mm."""

Stretch = tuple[Place, Place | None, Place]
"""A piece of an outline: start, a point between where it is an arc, end."""


@dataclass(frozen=True)
class Undercut:
    """A relief of a cylinder beside a shoulder: `length` with its run-out, `depth` below the surface, corner `radius`,
    mm.

    A radius greater than the depth (DIN 509) rises above the surface beside the shoulder: the part that is to lie there
    has a chamfer.
    """

    length: float
    depth: float
    radius: float

    @property
    def rise(self) -> float:
        """How far the corner's radius rises above the surface at the shoulder, mm."""
        return self.radius - self.depth

    def removed_volume(self, radius: float) -> float:
        """mm^3 that it takes off a cylinder of `radius` mm, less what its corner leaves above the surface.

        A slice at depth d below the surface takes pi (2 R d - d^2); the arc, the flat and the slope have their
        integrals of d and d^2 in closed form.
        """
        t, r = self.depth, self.radius
        slope = t / math.tan(RUN_OUT)
        flat = self.length - r - slope
        first = -self.rise * r + math.pi * r**2 / 4 + t * flat + t * slope / 2
        second = self.rise**2 * r - self.rise * math.pi * r**2 / 2 + 2 * r**3 / 3 + t**2 * flat + t**2 * slope / 3
        return math.pi * (2 * radius * first - second)

    def stretches(self, radius: float, shoulder: float, away: int) -> list[Stretch]:
        """Its outline on a cylinder of `radius` mm from the `shoulder` at that z, toward `away` (+1: up, -1: down)."""
        low, r = radius - self.depth, self.radius
        middle = (low + r - r * math.sin(math.pi / 4), shoulder + away * r * (1 - math.cos(math.pi / 4)))
        corner, foot = (
            (low, shoulder + away * r),
            (low, shoulder + away * (self.length - self.depth / math.tan(RUN_OUT))),
        )
        end = (radius, shoulder + away * self.length)
        return [((low + r, shoulder), middle, corner), (corner, None, foot), (foot, None, end)]


AT_SHOULDER = Undercut(1.0, 0.1, 0.2)
"""DIN 509-E0.2x0.1."""

IN_CORNER = Undercut(0.6, 0.1, 0.1)
"""Where nothing may stand above the surface: the step between two eccentric journals, or a mate without a chamfer."""

SMALL = Undercut(0.3, 0.05, 0.05)
"""Where a longer one would leave too little of a short seat."""


@dataclass(frozen=True)
class RingGroove:
    """The groove of a retaining ring: z of its lower wall, width and depth, mm."""

    bottom: float
    width: float
    depth: float

    def removed_volume(self, radius: float) -> float:
        """mm^3 that it takes off a cylinder of `radius` mm."""
        return math.pi * (radius**2 - (radius - self.depth) ** 2) * self.width

    def stretches(self, radius: float) -> list[Stretch]:
        """Its outline on a cylinder of `radius` mm, upward."""
        low, top = radius - self.depth, self.bottom + self.width
        corners = [(radius, self.bottom), (low, self.bottom), (low, top), (radius, top)]
        return [(start, None, end) for start, end in itertools.pairwise(corners)]
