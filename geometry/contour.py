"""The outlines of a wave generator's parts in one plane: parallel curves of a profile, and circles.

Frame of every part: that of the circular spline at input angle 0 (Jia 2021, Sec. 2). +y is the major axis, x the minor
one, z the axis of rotation; an angle phi counts clockwise from +y, so a point is r (sin phi, cos phi). Lengths in mm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from hdopt.arrays import Array
from hdopt.drive.profiles import MeasuredProfile, TwoDisk, WaveGeneratorProfile, curvature
from hdopt.errors import HdoptError

Box = tuple[float, float, float, float]
"""x_min, y_min, x_max, y_max in mm."""

_GRID = 4096
_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(32)


class Contour(Protocol):
    """A closed curve with exact parallels: what a part's outline has to offer."""

    @property
    def area(self) -> float: ...

    @property
    def perimeter(self) -> float: ...

    @property
    def box(self) -> Box: ...

    @property
    def least_radius(self) -> float:
        """Radius of the largest circle about the axis that stays inside the curve, mm."""

    def inward(self, distance: float) -> Contour:
        """The parallel curve at `distance` inside this one, mm (outside where negative)."""

    def deviation(self, points: ArrayLike) -> Array:
        """Signed distance of points of shape (n, 2) from the curve along its normal, mm; positive outside."""


@dataclass(frozen=True)
class ParallelCurve:
    """The curve at a constant distance inside a profile (outside where `distance` is negative), exact.

    With the profile's point P, outward unit normal n and curvature kappa at phi, the curve is P - distance n, its
    derivative P' (1 - distance kappa). It has no corner and does not cross itself as long as the distance stays below
    the profile's least radius of curvature; otherwise it is refused with `HdoptError`.
    """

    profile: WaveGeneratorProfile
    distance: float

    def __post_init__(self) -> None:
        kappa = self._curvature_grid
        tightest = kappa.max() if self.distance > 0 else kappa.min()
        if 1 - self.distance * tightest <= 0:
            side = "inside" if self.distance > 0 else "outside"
            scattered = isinstance(self.profile, MeasuredProfile)
            noise = ", or, where measured points scatter, by how much as wave_generator.noise_um" if scattered else ""
            raise HdoptError(
                f"a parallel curve {abs(self.distance):.4g} mm {side} the {self.profile.name} profile crosses itself: "
                f"the profile's least radius of curvature is {1 / abs(tightest):.4g} mm; "
                "give a thinner bearing (wave_generator.bearing_thickness_mm), or a profile that bends less sharply"
                f"{noise}"
            )

    @cached_property
    def _curvature_grid(self) -> Array:
        grid = np.arange(_GRID) * (2 * math.pi / _GRID)
        return curvature(self.profile, np.concatenate([grid, self.breaks]))

    @cached_property
    def breaks(self) -> Array:
        """Angles in 0..2 pi, ends included, between which the profile is smooth; the axes are among them."""
        return np.array([*sorted({0.0, *break_angles(self.profile)}), 2 * math.pi])

    def points(self, phi: ArrayLike) -> Array:
        """Points (x, y) of the curve, mm: shape (n, 2) for n angles in rad."""
        point, _, normal = self._frame(phi)
        return point - self.distance * normal

    def tangents(self, phi: ArrayLike) -> Array:
        """Derivative of `points` by phi, mm/rad; shape (n, 2)."""
        _, tangent, _ = self._frame(phi)
        return tangent * (1 - self.distance * curvature(self.profile, phi))[:, None]

    def curvature(self, phi: ArrayLike) -> Array:
        """Curvature of the parallel curve, 1/mm: kappa/(1 - distance kappa)."""
        kappa = curvature(self.profile, phi)
        return np.asarray(kappa / (1 - self.distance * kappa))

    def _frame(self, phi: ArrayLike) -> tuple[Array, Array, Array]:
        """The profile's point, its derivative and its outward unit normal."""
        phi = np.atleast_1d(np.asarray(phi, float))
        radial, across = np.stack([np.sin(phi), np.cos(phi)], 1), np.stack([np.cos(phi), -np.sin(phi)], 1)
        r, r1 = self.profile.radius(phi)[:, None], self.profile.radius(phi, 1)[:, None]
        tangent = r1 * radial + r * across
        normal = np.stack([-tangent[:, 1], tangent[:, 0]], 1) / np.hypot(r, r1)
        return r * radial, tangent, normal

    @property
    def perimeter(self) -> float:
        """Steiner: the profile's perimeter less 2 pi times the distance."""
        return self.profile.perimeter() - 2 * math.pi * self.distance

    @cached_property
    def area(self) -> float:
        """Steiner: A - distance P + pi distance^2, with area A and perimeter P of the profile."""
        return _profile_area(self) - self.distance * self.profile.perimeter() + math.pi * self.distance**2

    @cached_property
    def box(self) -> Box:
        """Exact extremes: those of the profile, moved by the distance."""
        right, top, left, bottom = (_support(self.profile, angle) - self.distance for angle in (90, 0, 270, 180))
        return -left, -bottom, right, top

    @cached_property
    def least_radius(self) -> float:
        return float(np.hypot(*self.points(np.arange(_GRID) * (2 * math.pi / _GRID)).T).min())

    def inward(self, distance: float) -> ParallelCurve:
        return ParallelCurve(self.profile, self.distance + distance)

    def deviation(self, points: ArrayLike) -> Array:
        """Measured from the profile itself, not from `points()`: its nearest point is found by Newton's method."""
        points = np.asarray(points, float)
        phi = np.arctan2(points[:, 0], points[:, 1])
        for _ in range(8):
            point, tangent, _ = self._frame(phi)
            r, r1, r2 = (self.profile.radius(phi, order) for order in (0, 1, 2))
            radial, across = np.stack([np.sin(phi), np.cos(phi)], 1), np.stack([np.cos(phi), -np.sin(phi)], 1)
            second = (r2 - r)[:, None] * radial + 2 * r1[:, None] * across
            away = points - point
            phi = phi - _dot(away, tangent) / (_dot(away, second) - _dot(tangent, tangent))
        point, _, normal = self._frame(phi)
        return np.asarray(_dot(points - point, normal) + self.distance)


@dataclass(frozen=True)
class Circle:
    """A circle whose centre lies on the major axis, `offset` mm from the axis of rotation."""

    radius: float
    offset: float = 0.0

    @property
    def perimeter(self) -> float:
        return 2 * math.pi * self.radius

    @property
    def area(self) -> float:
        return math.pi * self.radius**2

    @property
    def box(self) -> Box:
        return -self.radius, self.offset - self.radius, self.radius, self.offset + self.radius

    @property
    def least_radius(self) -> float:
        return self.radius - abs(self.offset)

    def points(self, phi: ArrayLike) -> Array:
        """Points (x, y) of the circle, mm: shape (n, 2) for n angles about its own centre, rad."""
        phi = np.atleast_1d(np.asarray(phi, float))
        return np.stack([self.radius * np.sin(phi), self.offset + self.radius * np.cos(phi)], 1)

    def inward(self, distance: float) -> Circle:
        if distance >= self.radius:
            raise HdoptError(
                f"a circle of radius {self.radius:.4g} mm has no parallel {distance:.4g} mm inside it; "
                "give a thinner bearing (wave_generator.bearing_thickness_mm) or a smaller chamfer"
            )
        return Circle(self.radius - distance, self.offset)

    def deviation(self, points: ArrayLike) -> Array:
        points = np.asarray(points, float)
        return np.asarray(np.hypot(points[:, 0], points[:, 1] - self.offset) - self.radius)


def break_angles(profile: WaveGeneratorProfile) -> list[float]:
    """Angles in [0, 2 pi) where an edge of a solid with this `profile` has to end: where r''' jumps, and the axes of
    symmetric profiles.

    Resal's curve carries a point force at either tip and the two-disk curve leaves its disc at the wrap angle: there
    the curvature has a corner, which one polynomial spline cannot follow.
    """
    quarters = [0.0, math.pi / 2, math.pi, 3 * math.pi / 2]
    if isinstance(profile, MeasuredProfile):
        return [0.0, math.pi]
    if isinstance(profile, TwoDisk):
        gamma = profile.wrap_angle
        return sorted({*quarters, gamma, math.pi - gamma, math.pi + gamma, 2 * math.pi - gamma} - {2 * math.pi})
    return quarters


def _profile_area(curve: ParallelCurve) -> float:
    """Area inside the profile, mm^2: half the integral of r^2, by Gauss quadrature between its smooth pieces."""
    profile = curve.profile
    edges = curve.breaks if not isinstance(profile, MeasuredProfile) else np.append(curve.breaks, profile.angles)
    pieces = np.unique(np.concatenate([edges, np.linspace(0, 2 * math.pi, 33)]))
    half = np.diff(pieces) / 2
    phi = pieces[:-1, None] + half[:, None] * (1 + _GAUSS_NODES)
    return float(np.sum(half * (profile.radius(phi) ** 2 @ _GAUSS_WEIGHTS)) / 2)


def _support(profile: WaveGeneratorProfile, direction_deg: float) -> float:
    """How far the profile reaches in a direction, mm."""
    direction = math.radians(direction_deg)
    near = direction + 2 * math.pi / _GRID * np.arange(-_GRID // 4, _GRID // 4)
    phi = float(near[np.argmax(profile.radius(near) * np.cos(near - direction))])
    for _ in range(4):
        # Newton's method for the angle at which r cos(phi - direction) has no slope.
        r, r1, r2 = (float(profile.radius(phi, order)) for order in (0, 1, 2))
        cos, sin = math.cos(phi - direction), math.sin(phi - direction)
        phi -= (r1 * cos - r * sin) / ((r2 - r) * cos - 2 * r1 * sin)
    return float(profile.radius(phi)) * math.cos(phi - direction)


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("ij,ij->i", a, b))
