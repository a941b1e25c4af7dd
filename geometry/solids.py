"""Outlines to CadQuery solids: splines through exact points with exact end tangents, ruled between parallel curves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import singledispatch
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdopt.errors import HdoptError
from hdopt.geometry.contour import Circle, Contour, ParallelCurve

if TYPE_CHECKING:
    import cadquery as cq
    from OCP.TopoDS import TopoDS_Wire

BUILD_TOLERANCE = 1e-6
"""Largest distance between a curve and the spline that stands for it, mm: a fiftieth of what the check allows."""

MOST_SPANS = 16384

Station = tuple[float, float]
"""z and how far inside its contour a solid lies there, mm."""


@singledispatch
def loft(contour: Contour, stations: Sequence[Station]) -> cq.Solid:
    """The solid whose section at each station's z is the contour's parallel at its inset, straight in between."""
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


def spans_needed(curve: ParallelCurve) -> int:
    """Spline spans for one turn that keep the spline within `BUILD_TOLERANCE` of the curve, measured between points."""
    from scipy.interpolate import BSpline

    spans = 64
    while spans <= MOST_SPANS:
        worst = 0.0
        for start, end in zip(curve.breaks[:-1], curve.breaks[1:], strict=True):
            knots, coefficients = spline_piece(curve, start, end, spans)
            spline = BSpline(_full_knots(knots), coefficients, 3)
            between = knots[:-1, None] + np.diff(knots)[:, None] * np.array([0.21, 0.5, 0.79])
            worst = max(worst, np.abs(curve.deviation(spline(between.ravel()))).max())
        if worst <= BUILD_TOLERANCE:
            return spans
        spans *= 2
    raise HdoptError(
        f"the {curve.profile.name} profile is too rough for a smooth surface: {MOST_SPANS} spline spans still miss it "
        f"by {worst * 1e3:.2g} um; give the points' scatter as noise, so that the profile is smoothed"
    )


def spline_piece(curve: ParallelCurve, start: float, end: float, spans: int) -> tuple[NDArray, NDArray]:
    """Knots and control points of the cubic spline for one smooth piece of a curve, exact in end tangents."""
    from scipy.interpolate import make_interp_spline

    count = max(8, math.ceil(spans * (end - start) / (2 * math.pi)))
    phi = np.linspace(start, end, count + 1)
    # Ends are approached from inside the piece: at its ends the third derivative may jump.
    tangents = curve.tangents([start, end])
    spline = make_interp_spline(phi, curve.points(phi), k=3, bc_type=([(1, tangents[0])], [(1, tangents[1])]))
    return phi, spline.c


def _full_knots(knots: NDArray) -> NDArray:
    return np.concatenate([[knots[0]] * 3, knots, [knots[-1]] * 3])


def _wire(curve: ParallelCurve, z: float, spans: int) -> TopoDS_Wire:
    """The curve at height z as one closed wire; neighbouring edges share their vertex."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeVertex, BRepBuilderAPI_MakeWire
    from OCP.gp import gp_Pnt

    pieces = list(zip(curve.breaks[:-1], curve.breaks[1:], strict=True))
    corners = [
        BRepBuilderAPI_MakeVertex(gp_Pnt(*map(float, curve.points(start)[0]), z)).Vertex() for start, _ in pieces
    ]
    wire = BRepBuilderAPI_MakeWire()
    for index, (start, end) in enumerate(pieces):
        spline = _occ_spline(*spline_piece(curve, start, end, spans), z)
        edge = BRepBuilderAPI_MakeEdge(spline, corners[index], corners[(index + 1) % len(corners)])
        wire.Add(edge.Edge())
    return wire.Wire()


def _occ_spline(knots: NDArray, points: NDArray, z: float):
    from OCP.Geom import Geom_BSplineCurve
    from OCP.gp import gp_Pnt
    from OCP.TColgp import TColgp_Array1OfPnt
    from OCP.TColStd import TColStd_Array1OfInteger, TColStd_Array1OfReal

    poles = TColgp_Array1OfPnt(1, len(points))
    for index, (x, y) in enumerate(points.tolist(), 1):
        poles.SetValue(index, gp_Pnt(x, y, z))
    values, multiplicities = TColStd_Array1OfReal(1, len(knots)), TColStd_Array1OfInteger(1, len(knots))
    for index, knot in enumerate(knots.tolist(), 1):
        values.SetValue(index, knot)
        multiplicities.SetValue(index, 4 if index in (1, len(knots)) else 1)
    return Geom_BSplineCurve(poles, values, multiplicities, 3)
