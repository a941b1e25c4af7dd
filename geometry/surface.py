"""Points on a solid that was read from a file, found from its faces alone."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any  # Any: OCP surfaces, whose kinds share no type

import numpy as np

from hdopt.arrays import Array

if TYPE_CHECKING:
    import cadquery as cq
    from OCP.TopoDS import TopoDS_Face

BETWEEN = (0.23, 0.5, 0.77)
"""Where a spline's span is sampled: between the points that it was made from, where it is least held."""

SPANS_OF_A_CYLINDER = 90
UPRIGHT = 1e-7
"""Largest z component of an upright face's normal."""


@dataclass(frozen=True)
class Wall:
    """Points (n, 3) on one closed ring of upright faces, mm."""

    points: Array

    @property
    def largest_gap(self) -> float:
        """Largest angle about the wall's own middle without a point, rad."""
        x, y = (self.points[:, :2] - self.points[:, :2].mean(0)).T
        angles = np.sort(np.arctan2(x, y))
        return float(np.diff(np.append(angles, angles[0] + 2 * math.pi)).max())


def walls(solid: cq.Solid, shares: Sequence[float] = BETWEEN) -> list[Wall]:
    """The rings of upright faces of a `solid` that are joined to each other, as points at these `shares` (0 to 1) of
    spline spans; widest along y first."""
    upright = [face for face in (face.wrapped for face in solid.Faces()) if is_upright(face)]
    rings = [Wall(np.concatenate([_wall_points(face, shares) for face in ring])) for ring in _rings(upright)]
    return sorted(rings, key=lambda wall: -np.ptp(wall.points[:, 1]))


def face_points(solid: cq.Solid, per_side: int = 5) -> Array:
    """Points (n, 3) spread over all faces of a `solid`, mm, `per_side` squared of each; those that fall into a face's
    holes are left out."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepTopAdaptor import BRepTopAdaptor_FClass2d
    from OCP.gp import gp_Pnt2d
    from OCP.TopAbs import TopAbs_State

    points = []
    shares = (np.arange(per_side) + 0.5) / per_side
    for face in (face.wrapped for face in solid.Faces()):
        surface, domain = BRepAdaptor_Surface(face), BRepTopAdaptor_FClass2d(face, 1e-9)
        u0, u1, v0, v1 = _bounds(face)
        for u in (u0 + shares * (u1 - u0)).tolist():
            for v in (v0 + shares * (v1 - v0)).tolist():
                if domain.Perform(gp_Pnt2d(u, v)) == TopAbs_State.TopAbs_IN:
                    point = surface.Value(u, v)
                    points.append((point.X(), point.Y(), point.Z()))
    return np.array(points)


def is_upright(face: TopoDS_Face) -> bool:
    """Whether the normal of a `face` is square to the z axis, at four points of a curved one."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_SurfaceType
    from OCP.gp import gp_Pnt, gp_Vec

    surface = BRepAdaptor_Surface(face)
    if surface.GetType() == GeomAbs_SurfaceType.GeomAbs_Plane:
        return bool(abs(surface.Plane().Axis().Direction().Z()) < UPRIGHT)
    u0, u1, v0, v1 = _bounds(face)
    for u in (0.2, 0.7):
        for v in (0.2, 0.7):
            point, along, across = gp_Pnt(), gp_Vec(), gp_Vec()
            surface.D1(u0 + u * (u1 - u0), v0 + v * (v1 - v0), point, along, across)
            normal = along.Crossed(across)
            if abs(normal.Z()) > UPRIGHT * normal.Magnitude():
                return False
    return True


def _rings(faces: list[TopoDS_Face]) -> list[list[TopoDS_Face]]:
    """Faces joined by common edges."""
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer

    owners = defaultdict(list)
    for index, face in enumerate(faces):
        edges = TopExp_Explorer(face, TopAbs_ShapeEnum.TopAbs_EDGE)
        while edges.More():
            owners[edges.Current().__hash__()].append(index)
            edges.Next()
    group = list(range(len(faces)))

    def root(index: int) -> int:
        while group[index] != index:
            index = group[index]
        return index

    for indices in owners.values():
        for other in indices[1:]:
            group[root(other)] = root(indices[0])
    rings = defaultdict(list)
    for index, face in enumerate(faces):
        rings[root(index)].append(face)
    return list(rings.values())


def _wall_points(face: TopoDS_Face, shares: Sequence[float]) -> Array:
    from OCP.BRepAdaptor import BRepAdaptor_Surface

    surface = BRepAdaptor_Surface(face)
    u0, u1, v0, v1 = _bounds(face)
    values = (_samples(surface, "U", u0, u1, shares), _samples(surface, "V", v0, v1, shares))
    points = [surface.Value(u, v) for u in values[0] for v in values[1]]
    return np.array([(p.X(), p.Y(), p.Z()) for p in points])


def _samples(surface: Any, axis: str, low: float, high: float, shares: Sequence[float]) -> list[float]:
    """Parameters between the knots of a spline surface; evenly spread on any other."""
    from OCP.GeomAbs import GeomAbs_SurfaceType

    if surface.GetType() == GeomAbs_SurfaceType.GeomAbs_BSplineSurface:
        spline = surface.BSpline()
        count = getattr(spline, f"Nb{axis}Knots")()
        knots = np.array([getattr(spline, f"{axis}Knot")(index) for index in range(1, count + 1)])
    else:
        knots = np.linspace(low, high, SPANS_OF_A_CYLINDER + 1 if axis == "U" else 2)
    knots = np.unique(np.clip(knots, low, high))
    between = knots[:-1, None] + np.diff(knots)[:, None] * np.array(shares)
    return [float(value) for value in between.ravel()]


def _bounds(face: TopoDS_Face) -> tuple[float, float, float, float]:
    from OCP.BRepTools import BRepTools

    u0, u1, v0, v1 = BRepTools.UVBounds_s(face)
    return u0, u1, v0, v1
