"""Semantic tolerances of a STEP AP242 file: sizes, datums and geometric tolerances on the faces they belong to.

They are those of the drawing's callouts. Open CASCADE's XCAF writes them; `hdopt.geometry.part21` reads the file's text
to see that they are there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any  # Any: objects of OCP whose types it does not name

from hdopt.geometry.callouts import Callout, Cylinder, Face, Flank, Frame, Level
from hdopt.geometry.surface import is_upright

if TYPE_CHECKING:
    import cadquery as cq
    from OCP.TDF import TDF_Label
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopoDS import TopoDS_Face

NEAR = 1e-6
"""How far a face may lie from where a callout says it does, mm."""

SYMBOLS = {
    "profile": "ProfileOfSurface",
    "cylindricity": "Cylindricity",
    "coaxiality": "Coaxiality",
    "position": "Position",
    "perpendicularity": "Perpendicularity",
    "parallelism": "Parallelism",
    "symmetry": "Symmetry",
}


def shape_label(document: TDocStd_Document, name: str) -> TDF_Label:
    """The label of a part's shape in an XCAF document, found by the part's name."""
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDF import TDF_LabelSequence
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    labels = TDF_LabelSequence()
    shapes.GetShapes(labels)
    for index in range(1, labels.Length() + 1):
        label, said = labels.Value(index), TDataStd_Name()
        if not shapes.IsAssembly_s(label) and label.FindAttribute(TDataStd_Name.GetID_s(), said):
            if said.Get().ToExtString() in (name, f"{name}_part"):
                return label
    raise RuntimeError(f"Open CASCADE's document has no shape that is called {name}")


def annotate(document: TDocStd_Document, whole: TDF_Label, callouts: Sequence[Callout]) -> None:
    """Put the callouts of a part on its faces in an XCAF document; `whole` is the label of its shape."""
    import cadquery as cq
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    tolerances = XCAFDoc_DocumentTool.DimTolTool_s(document.Main())
    solid = cq.Shape.cast(shapes.GetShape_s(whole))
    datums: dict[str, Any] = {}
    for callout in callouts:
        if callout.datum:
            labels = _labels(shapes, whole, solid, callout.datum_faces or callout.faces)
            datums[callout.datum] = _sequence(labels)
    for callout in callouts:
        labels = _labels(shapes, whole, solid, callout.faces) if callout.size or callout.frames else []
        if callout.size is not None:
            first = callout.faces[0]
            ends = (
                [shapes.AddSubShape(whole, face) for face in opposite(solid, first)] if isinstance(first, Flank) else []
            )
            _add_size(tolerances, labels, callout, ends)
        for frame in callout.frames:
            _add_frame(tolerances, labels, frame, datums)


def _labels(shapes: Any, whole: TDF_Label, solid: cq.Shape, faces: Sequence[Face]) -> list[TDF_Label]:
    """The labels of a solid's faces, added where they are new."""
    found = [face for wanted in faces for face in faces_of(solid, wanted)]
    return [shapes.AddSubShape(whole, face) for face in found]


def faces_of(solid: cq.Shape, wanted: Face) -> list[TopoDS_Face]:
    """The faces of a `solid` that match the one `wanted`, as a callout describes it."""
    faces = [face.wrapped for face in solid.Faces()]
    if isinstance(wanted, Cylinder | Level | Flank):
        return [face for face in faces if _is(face, wanted)]
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_SurfaceType

    spline = GeomAbs_SurfaceType.GeomAbs_BSplineSurface
    return [face for face in faces if BRepAdaptor_Surface(face).GetType() == spline and is_upright(face)]


def _is(face: TopoDS_Face, wanted: Cylinder | Level | Flank) -> bool:
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_SurfaceType

    surface = BRepAdaptor_Surface(face)
    if isinstance(wanted, Cylinder):
        if surface.GetType() != GeomAbs_SurfaceType.GeomAbs_Cylinder:
            return False
        cylinder = surface.Cylinder()
        place = cylinder.Axis().Location()
        off = math.hypot(place.X() - wanted.axis[0], place.Y() - wanted.axis[1])
        return abs(cylinder.Radius() - wanted.radius) < NEAR and off < NEAR
    if surface.GetType() != GeomAbs_SurfaceType.GeomAbs_Plane:
        return False
    plane = surface.Plane()
    normal, place = plane.Axis().Direction(), plane.Location()
    if isinstance(wanted, Level):
        return bool(abs(normal.Z()) > 1 - NEAR and abs(place.Z() - wanted.z) < NEAR)
    along = normal.X() * math.sin(wanted.direction) + normal.Y() * math.cos(wanted.direction)
    distance = abs(normal.X() * place.X() + normal.Y() * place.Y())
    return bool(abs(abs(along) - 1) < NEAR and abs(distance - wanted.distance) < NEAR)


def _sequence(labels: Sequence[TDF_Label]) -> Any:
    from OCP.TDF import TDF_LabelSequence

    sequence = TDF_LabelSequence()
    for label in labels:
        sequence.Append(label)
    return sequence


def opposite(solid: cq.Shape, flank: Flank) -> tuple[TopoDS_Face, TopoDS_Face]:
    """A face of a `solid` on either side of its axis that matches a `flank`: a bore cuts each side of a slot in two, so
    that the first two faces may lie in one plane."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface

    sides: dict[bool, TopoDS_Face] = {}
    for face in faces_of(solid, flank):
        place = BRepAdaptor_Surface(face).Plane().Location()
        sides.setdefault(place.X() * math.sin(flank.direction) + place.Y() * math.cos(flank.direction) > 0, face)
    return sides[True], sides[False]


def _add_size(tolerances: Any, labels: Sequence[TDF_Label], callout: Callout, ends: Sequence[TDF_Label]) -> None:
    from OCP.XCAFDimTolObjects import XCAFDimTolObjects_DimensionObject, XCAFDimTolObjects_DimensionType
    from OCP.XCAFDoc import XCAFDoc_Dimension

    assert callout.size is not None
    nominal, lower, upper = callout.size
    label = tolerances.AddDimension()
    dimension = XCAFDimTolObjects_DimensionObject()
    kinds = XCAFDimTolObjects_DimensionType
    across = isinstance(callout.faces[0], Flank)
    dimension.SetType(
        kinds.XCAFDimTolObjects_DimensionType_Location_LinearDistance
        if across
        else kinds.XCAFDimTolObjects_DimensionType_Size_Diameter
    )
    dimension.SetValue(nominal)
    # XCAF keeps the size of the lower deviation and writes it with its sign changed.
    dimension.SetUpperTolValue(upper)
    dimension.SetLowerTolValue(-lower)
    if across:
        tolerances.SetDimension(_sequence(ends[:1]), _sequence(ends[1:]), label)
    else:
        tolerances.SetDimension(_sequence(labels), _sequence([]), label)
    XCAFDoc_Dimension.Set_s(label).SetObject(dimension)


def _add_frame(tolerances: Any, labels: Sequence[TDF_Label], frame: Frame, datums: dict[str, Any]) -> None:
    from OCP import XCAFDimTolObjects as objects
    from OCP.XCAFDoc import XCAFDoc_GeomTolerance

    label = tolerances.AddGeomTolerance()
    tolerances.SetGeomTolerance(_sequence(labels), label)
    tolerance = objects.XCAFDimTolObjects_GeomToleranceObject()
    kind = f"XCAFDimTolObjects_GeomToleranceType_{SYMBOLS[frame.symbol]}"
    tolerance.SetType(getattr(objects.XCAFDimTolObjects_GeomToleranceType, kind))
    tolerance.SetValue(frame.zone)
    values = objects.XCAFDimTolObjects_GeomToleranceTypeValue
    if frame.diameter:
        tolerance.SetTypeOfValue(values.XCAFDimTolObjects_GeomToleranceTypeValue_Diameter)
    XCAFDoc_GeomTolerance.Set_s(label).SetObject(tolerance)
    for place, letter in enumerate(frame.datums, 1):
        _refer(tolerances, label, letter, place, datums[letter])


def _refer(tolerances: Any, label: TDF_Label, letter: str, place: int, faces: Any) -> None:
    """Give a tolerance one of its datums, on its faces, at its place in the frame."""
    from OCP.TCollection import TCollection_HAsciiString
    from OCP.XCAFDimTolObjects import XCAFDimTolObjects_DatumObject
    from OCP.XCAFDoc import XCAFDoc_Datum

    datum_label = tolerances.AddDatum()
    tolerances.SetDatum(faces, datum_label)
    datum = XCAFDimTolObjects_DatumObject()
    datum.SetName(TCollection_HAsciiString(letter))
    datum.SetPosition(place)
    XCAFDoc_Datum.Set_s(datum_label).SetObject(datum)
    tolerances.SetDatumToGeomTol(datum_label, label)
