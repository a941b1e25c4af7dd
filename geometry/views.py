"""Views and sections of solids as plain lines: hidden lines removed by Open CASCADE, coordinates in mm of the view."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hdopt.arrays import Array

if TYPE_CHECKING:
    import cadquery as cq

Vector = tuple[float, float, float]

SAGITTA = 0.002
"""Largest distance of a drawn polyline from its curve, mm."""


@dataclass(frozen=True)
class View:
    """Lines of one view, each of shape (n, 2): x to the right, y up."""

    visible: tuple[Array, ...]

    @property
    def box(self) -> tuple[float, float, float, float]:
        points = np.concatenate(self.visible)
        return (*points.min(0).tolist(), *points.max(0).tolist())


@dataclass(frozen=True)
class Region:
    """A cut face: its outer line and its holes, each of shape (n, 2)."""

    outer: Array
    holes: tuple[Array, ...]


def seen_from(solids: Sequence[cq.Shape], eye: Vector, right: Vector) -> View:
    """What is seen of the solids from the direction `eye`, with the direction `right` to the right."""
    import cadquery as cq
    from OCP.BRepLib import BRepLib
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
    from OCP.HLRAlgo import HLRAlgo_Projector
    from OCP.HLRBRep import HLRBRep_Algo, HLRBRep_HLRToShape

    algorithm = HLRBRep_Algo()
    for solid in solids:
        # Seams between smooth pieces are no edges of the part.
        BRepLib.EncodeRegularity_s(solid.wrapped)
        algorithm.Add(solid.wrapped)
    algorithm.Projector(HLRAlgo_Projector(gp_Ax2(gp_Pnt(), gp_Dir(*eye), gp_Dir(*right))))
    algorithm.Update()
    algorithm.Hide()
    found = HLRBRep_HLRToShape(algorithm)
    lines = []
    for compound in (found.VCompound(), found.OutLineVCompound()):
        if compound is None or compound.IsNull():
            continue
        BRepLib.BuildCurves3d_s(compound)
        lines += [_polyline(edge)[:, :2] for edge in cq.Shape.cast(compound).Edges()]
    return View(tuple(lines))


def sharp_edges(shape: cq.Shape) -> list[Array]:
    """Points (n, 3), mm, along every edge of a `shape` at which its surface has a corner; an array an edge."""
    import cadquery as cq
    from OCP.BRep import BRep_Tool
    from OCP.BRepLib import BRepLib
    from OCP.GeomAbs import GeomAbs_Shape
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp
    from OCP.TopoDS import TopoDS
    from OCP.TopTools import TopTools_IndexedDataMapOfShapeListOfShape

    BRepLib.EncodeRegularity_s(shape.wrapped)
    owners = TopTools_IndexedDataMapOfShapeListOfShape()
    TopExp.MapShapesAndAncestors_s(shape.wrapped, TopAbs_ShapeEnum.TopAbs_EDGE, TopAbs_ShapeEnum.TopAbs_FACE, owners)
    lines = []
    for index in range(1, owners.Extent() + 1):
        edge, faces = TopoDS.Edge_s(owners.FindKey(index)), list(owners.FindFromIndex(index))
        smooth = len(faces) == 1 or (
            BRep_Tool.Continuity_s(edge, TopoDS.Face_s(faces[0]), TopoDS.Face_s(faces[-1])) != GeomAbs_Shape.GeomAbs_C0
        )
        if not smooth and not BRep_Tool.Degenerated_s(edge):
            lines.append(_polyline(cq.Edge(edge)))
    return lines


def section_at_minor_axis_zero(solid: cq.Shape) -> list[Region]:
    """The cut faces of a solid in the plane x = 0, with z to the right and y up."""
    import cadquery as cq

    plane = cq.Face.makePlane(1000.0, 1000.0, cq.Vector(), cq.Vector(1, 0, 0))
    regions = []
    for face in plane.intersect(solid).Faces():
        outer, *holes = (np.concatenate([_directed(edge)[:-1] for edge in wire]) for wire in _wires(face))
        regions.append(Region(outer, tuple(holes)))
    return regions


def half_behind_minor_axis_zero(solid: cq.Shape) -> cq.Shape:
    """The half of a solid with x >= 0."""
    import cadquery as cq

    box = cq.Solid.makeBox(500, 1000, 1000, cq.Vector(0, -500, -500))
    return solid.intersect(box)


def _wires(face: cq.Face) -> list[list[cq.Edge]]:
    """The edges of each wire of a face in their order, each turned the way it is walked."""
    import cadquery as cq
    from OCP.BRepTools import BRepTools_WireExplorer

    wires = []
    for wire in (face.outerWire(), *face.innerWires()):
        explorer, edges = BRepTools_WireExplorer(wire.wrapped), []
        while explorer.More():
            edges.append(cq.Edge(explorer.Current()))
            explorer.Next()
        wires.append(edges)
    return wires


def _directed(edge: cq.Edge) -> Array:
    """Points of an edge in the order its orientation says, as (z, y)."""
    from OCP.TopAbs import TopAbs_Orientation

    points = _polyline(edge)[:, [2, 1]]
    backward = edge.wrapped.Orientation() == TopAbs_Orientation.TopAbs_REVERSED
    return points[::-1] if backward else points


def _polyline(edge: cq.Edge) -> Array:
    """Points along an edge, in the direction of its curve; shape (n, 3)."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.GCPnts import GCPnts_QuasiUniformDeflection

    curve = BRepAdaptor_Curve(edge.wrapped)
    walk = GCPnts_QuasiUniformDeflection(curve, SAGITTA)
    points = [walk.Value(index) for index in range(1, walk.NbPoints() + 1)]
    return np.array([(point.X(), point.Y(), point.Z()) for point in points])
