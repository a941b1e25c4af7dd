"""Outlines to CadQuery solids: splines through exact points with exact end tangents, ruled between parallel curves."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from functools import singledispatch
from typing import TYPE_CHECKING

import numpy as np

from hdopt.arrays import Array
from hdopt.errors import HdoptError
from hdopt.geometry.contour import Circle, Contour, ParallelCurve
from hdopt.geometry.undercut import Place, Stretch

if TYPE_CHECKING:
    import cadquery as cq
    from OCP.Geom import Geom_BSplineCurve
    from OCP.TopoDS import TopoDS_Wire

BUILD_TOLERANCE = 1e-6
"""Largest distance between a curve and the spline that stands for it, mm: a fiftieth of what the check allows."""

MOST_SPANS = 16384

Station = tuple[float, float]
"""z and how far inside its contour a solid lies there, mm."""


@singledispatch
def loft(contour: Contour, stations: Sequence[Station]) -> cq.Solid:
    """The solid whose section at each of `stations`, (z, inset) in mm with z rising, is the parallel of the `contour`
    at that inset, straight in between. `TypeError` for a contour of no known kind."""
    raise TypeError(f"no solid is known for a {type(contour).__name__}")


@loft.register(Circle)
def _(contour: Circle, stations: Sequence[Station]) -> cq.Solid:
    import cadquery as cq

    half = [(contour.radius - inset, z) for z, inset in stations]
    outline = [(0.0, stations[0][0]), *half, (0.0, stations[-1][0])]
    edges = cq.Wire.makePolygon([cq.Vector(r, 0, z) for r, z in outline], close=True)
    solid = cq.Solid.revolve(cq.Face.makeFromWires(edges), 360, cq.Vector(), cq.Vector(0, 0, 1))
    return solid.moved(cq.Location(cq.Vector(0, contour.offset, 0)))


@loft.register(ParallelCurve)
def _(contour: ParallelCurve, stations: Sequence[Station]) -> cq.Solid:
    """Both curves of a ruled face share their parameter phi, so a broken edge has exactly its slope everywhere."""
    import cadquery as cq
    from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections

    curves = [contour.inward(inset) for _, inset in stations]
    spans = spans_needed(contour)
    builder = BRepOffsetAPI_ThruSections(True, True, 1e-7)
    builder.CheckCompatibility(False)
    for (z, _), curve in zip(stations, curves, strict=True):
        builder.AddWire(_wire(curve, z, spans))
    builder.Build()
    return cq.Solid(builder.Shape())


def turn(circle: Circle, side: Sequence[Stretch]) -> cq.Solid:
    """The solid that turns about the axis of a `circle`, whose `side` is given from the bottom up; neighbouring
    stretches are joined by straight lines, and the ends by planes."""
    import cadquery as cq

    def at(place: Place) -> cq.Vector:
        return cq.Vector(place[0], 0.0, place[1])

    edges, last = [], (0.0, side[0][0][1])
    for start, middle, end in side:
        if math.dist(last, start) > 1e-9:
            edges.append(cq.Edge.makeLine(at(last), at(start)))
        if middle is not None:
            edges.append(cq.Edge.makeThreePointArc(at(start), at(middle), at(end)))
        elif math.dist(start, end) > 1e-9:
            edges.append(cq.Edge.makeLine(at(start), at(end)))
        last = end
    top, bottom = (0.0, last[1]), (0.0, side[0][0][1])
    edges += [cq.Edge.makeLine(at(last), at(top)), cq.Edge.makeLine(at(top), at(bottom))]
    face = cq.Face.makeFromWires(cq.Wire.assembleEdges(edges))
    solid = cq.Solid.revolve(face, 360, cq.Vector(), cq.Vector(0, 0, 1))
    return solid.moved(cq.Location(cq.Vector(0, circle.offset, 0)))


def spans_needed(curve: ParallelCurve) -> int:
    """Spline spans for one turn that keep the spline within `BUILD_TOLERANCE` of the curve, measured between points."""
    spans, worst = 64, math.inf
    while spans <= MOST_SPANS:
        worst = max(_error_between(curve, start, end, spans) for start, end in _pieces(curve))
        if worst <= BUILD_TOLERANCE:
            return spans
        spans *= 2
    raise HdoptError(
        f"the {curve.profile.name} profile is too rough for a smooth surface: {MOST_SPANS} spline spans still miss it "
        f"by {worst * 1e3:.2g} um; give the points' scatter as wave_generator.noise_um, so that the profile is smoothed"
    )


def _pieces(curve: ParallelCurve) -> list[tuple[float, float]]:
    return list(itertools.pairwise(curve.breaks.tolist()))


def _parameters(start: float, end: float, spans: int) -> Array:
    """The angles at which a piece of a curve is held, for so many spans in a whole turn."""
    return np.linspace(start, end, max(8, math.ceil(spans * (end - start) / (2 * math.pi))) + 1)


def _spline(curve: ParallelCurve, start: float, end: float, spans: int, z: float) -> Geom_BSplineCurve:
    """The cubic spline through points of one smooth piece, with the curve's end tangents; its parameter is phi.

    Both tangents are the curve's own, so neighbouring pieces join smoothly although the third derivative jumps there.
    """
    from OCP.GeomAPI import GeomAPI_Interpolate
    from OCP.gp import gp_Pnt, gp_Vec
    from OCP.TColgp import TColgp_HArray1OfPnt
    from OCP.TColStd import TColStd_HArray1OfReal

    phi = _parameters(start, end, spans)
    points, parameters = TColgp_HArray1OfPnt(1, len(phi)), TColStd_HArray1OfReal(1, len(phi))
    for index, ((x, y), angle) in enumerate(zip(curve.points(phi).tolist(), phi.tolist(), strict=True), 1):
        points.SetValue(index, gp_Pnt(x, y, z))
        parameters.SetValue(index, angle)
    interpolation = GeomAPI_Interpolate(points, parameters, False, 1e-9)
    first, last = (gp_Vec(x, y, 0.0) for x, y in curve.tangents([start, end]).tolist())
    interpolation.Load(first, last, False)
    interpolation.Perform()
    return interpolation.Curve()


def _error_between(curve: ParallelCurve, start: float, end: float, spans: int) -> float:
    """Largest distance of the spline from the curve at points between those that it was made from, mm."""
    spline = _spline(curve, start, end, spans, 0.0)
    phi = _parameters(start, end, spans)
    between = phi[:-1, None] + np.diff(phi)[:, None] * np.array([0.21, 0.5, 0.79])
    points = [spline.Value(angle) for angle in between.ravel().tolist()]
    return float(np.abs(curve.deviation([(point.X(), point.Y()) for point in points])).max())


def _wire(curve: ParallelCurve, z: float, spans: int) -> TopoDS_Wire:
    """The curve at height z as one closed wire; neighbouring edges share their vertex."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeVertex, BRepBuilderAPI_MakeWire
    from OCP.gp import gp_Pnt

    pieces = _pieces(curve)
    corners = [BRepBuilderAPI_MakeVertex(gp_Pnt(*curve.points(start)[0].tolist(), z)).Vertex() for start, _ in pieces]
    wire = BRepBuilderAPI_MakeWire()
    for index, (start, end) in enumerate(pieces):
        spline = _spline(curve, start, end, spans, z)
        edge = BRepBuilderAPI_MakeEdge(spline, corners[index], corners[(index + 1) % len(corners)])
        wire.Add(edge.Edge())
    return wire.Wire()


JOINING_MM = (None, 1e-6, 1e-4)
"""Distances, mm, within which faces are taken as one, from none to a fiftieth of the narrowest zone on a drawing: the
kernel sometimes leaves journals apart whose undercuts end in one plane."""


def joined(pieces: Sequence[cq.Shape], name: str) -> cq.Shape:
    """One solid of all `pieces` of the part called `name`; what is written is held to the closed-form volume after.

    Raises `HdoptError` where the geometry kernel does not join them.
    """
    first, *more = pieces
    for within in JOINING_MM if more else ():
        shape = first.fuse(*more, tol=within)
        if len(shape.Solids()) == 1:
            return shape
    if more:
        raise HdoptError(
            f"the pieces of the {name} could not be joined into one solid by the geometry kernel; "
            "change a width or a diameter in [export] by 0.1 mm"
        )
    return first
