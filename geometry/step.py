"""STEP files: written with part names, colours and the study's identity, and read back with nothing else at hand."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any  # Any: objects of OCP whose types it does not name

from hdopt.errors import HdoptError
from hdopt.geometry.part21_repair import repaired
from hdopt.moment import moment

if TYPE_CHECKING:
    import cadquery as cq
    from OCP.TDocStd import TDocStd_Document

    from hdopt.geometry.callouts import Callout
    from hdopt.geometry.part import Colour, Part

SCHEMAS = {"AP214": ("AP214IS", "AUTOMOTIVE_DESIGN"), "AP242": ("AP242DIS", "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING")}
"""Name of a schema in a study -> what Open CASCADE calls it, and how the file's header begins to name it."""


@dataclass(frozen=True)
class Identity:
    """What a file says of its origin."""

    title: str
    study: str
    fingerprint: str
    version: str

    @property
    def description(self) -> str:
        return f"hdopt {self.version}; study {self.study}; fingerprint {self.fingerprint}"


@dataclass(frozen=True)
class StepPart:
    """One part as a file has it, in its place."""

    name: str
    solids: tuple[cq.Solid, ...]
    shape: cq.Shape
    colour: Colour | None


@dataclass(frozen=True)
class StepFile:
    """What a STEP file says."""

    path: Path
    header: str
    schema: str
    in_millimetres: bool
    parts: tuple[StepPart, ...]


@dataclass(frozen=True)
class ProductData:
    """What a file says of one part beside its shape: number, material, density (kg/mm^3), tolerances of its faces; of
    an assembly, the number alone."""

    number: str
    material: str = ""
    density: float = 0.0
    callouts: tuple[Callout, ...] = ()
    assumed: bool = True
    """Whether the material was assumed."""


def write_step(
    path: Path,
    parts: Sequence[tuple[Part, cq.Solid]],
    identity: Identity,
    schema: str = "AP214",
    products: Mapping[str, ProductData] | None = None,
) -> None:
    """Write an assembly of named, coloured `parts`, each with its solid, to `path`, in mm.

    `identity` goes into the header, `schema` is the application protocol, "AP214" or "AP242"; with `products`, by part,
    their data and tolerances are written too.
    """
    import cadquery as cq
    from cadquery.occ_impl.assembly import toCAF
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.Interface import Interface_Static
    from OCP.STEPCAFControl import STEPCAFControl_Controller, STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_StepModelType
    from OCP.XSControl import XSControl_WorkSession

    assembly = cq.Assembly(name=_ascii(identity.title))
    for part, solid in parts:
        assembly.add(solid, name=part.name, color=cq.Color(*part.colour))
    _, document = toCAF(assembly, True)
    for part, _ in parts:
        if products and part.name in products:
            _add_product(document, part.name, products[part.name])

    # The controller registers the parameters when it is made: set before that, they are lost.
    STEPCAFControl_Controller.Init_s()
    parameters = {"write.step.schema": SCHEMAS[schema][0], "write.step.unit": "MM", "xstep.cascade.unit": "MM"}
    for name, value in parameters.items():
        if not Interface_Static.SetCVal_s(name, value):
            raise RuntimeError(f"Open CASCADE does not know the parameter {name}")
    # Curves on surfaces repeat what the surfaces say and double the file; readers make them anew.
    if not Interface_Static.SetIVal_s("write.surfacecurve.mode", 0):
        raise RuntimeError("Open CASCADE does not know the parameter write.surfacecurve.mode")
    session = XSControl_WorkSession()
    writer = STEPCAFControl_Writer(session, False)
    # Open CASCADE writes colours in the order of addresses in memory, which no two processes share.
    writer.SetColorMode(False)
    writer.SetNameMode(True)
    writer.SetDimTolMode(bool(products))
    writer.SetMaterialMode(bool(products))
    if not writer.Transfer(document, STEPControl_StepModelType.STEPControl_AsIs):
        raise RuntimeError("Open CASCADE could not translate the parts to STEP")

    _add_colours(session, document, [part for part, _ in parts])
    _number_products(writer.ChangeWriter().Model(), products or {}, identity)
    _write_header(writer.ChangeWriter().Model(), identity)
    if writer.Write(str(path)) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise HdoptError(f"cannot write {path}; give a file in a folder that can be written")
    path.write_text(repaired(path.read_text(encoding="latin-1")), encoding="latin-1")


def _add_colours(session: Any, document: TDocStd_Document, parts: Sequence[Part]) -> None:
    """The colours of the `parts`, in their order, each as a style of its solid in the model of the `session`."""
    import cadquery as cq
    from OCP.STEPConstruct import STEPConstruct_Styles
    from OCP.StepRepr import StepRepr_HArray1OfRepresentationItem
    from OCP.StepVisual import StepVisual_MechanicalDesignGeometricPresentationRepresentation
    from OCP.TCollection import TCollection_HAsciiString
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    from hdopt.geometry.semantic import shape_label

    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    for part in parts:
        shape = shapes.GetShape_s(shape_label(document, part.name))
        styles = STEPConstruct_Styles(session)
        colour = styles.EncodeColor_s(cq.Color(*part.colour).wrapped.GetRGB())
        seen_through = 1.0 - part.colour[3]
        style = styles.MakeColorPSA(None, colour, None, colour if seen_through else None, seen_through)
        solids = cq.Shape.cast(shape).Solids()
        items = StepRepr_HArray1OfRepresentationItem(1, len(solids))
        for index, solid in enumerate(solids, 1):
            items.SetValue(index, styles.AddStyle(solid.wrapped, style, None))
        presentation = StepVisual_MechanicalDesignGeometricPresentationRepresentation()
        presentation.Init(TCollection_HAsciiString(""), items, styles.FindContext(shape))
        session.Model().AddWithRefs(presentation)


def _write_header(model: Any, identity: Identity) -> None:
    """What the file says of its origin."""
    from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
    from OCP.TCollection import TCollection_HAsciiString

    header = APIHeaderSection_MakeHeader(model)

    def text(value: str) -> TCollection_HAsciiString:
        return TCollection_HAsciiString(_ascii(value))

    header.SetName(text(identity.title))
    header.SetTimeStamp(text(moment().strftime("%Y-%m-%dT%H:%M:%S")))
    header.SetDescriptionValue(1, text(identity.description))
    header.SetAuthorValue(1, text("hdopt"))
    header.SetOrganizationValue(1, text(""))
    header.SetOriginatingSystem(text(f"hdopt {identity.version}"))
    header.SetAuthorisation(text(""))


def _add_product(document: TDocStd_Document, name: str, product: ProductData) -> None:
    """Material and tolerances of a part."""
    from OCP.TCollection import TCollection_HAsciiString
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    from hdopt.geometry.semantic import annotate, shape_label

    label = shape_label(document, name)
    names = [
        TCollection_HAsciiString(_ascii(text))
        for text in (
            product.material,
            "assumed, the study names none" if product.assumed else "named by the study",
            "density measure",
            "POSITIVE_RATIO_MEASURE",
        )
    ]
    # XCAF counts in g/cm^3.
    XCAFDoc_DocumentTool.MaterialTool_s(document.Main()).SetMaterial(
        label, names[0], names[1], 1e6 * product.density, names[2], names[3]
    )
    annotate(document, label, product.callouts)


def _number_products(model: Any, products: Mapping[str, ProductData], identity: Identity) -> None:
    """The products' identifiers are their part numbers, their descriptions the material; their names stay. Each has
    the fingerprint as its revision, and a density has the unit g/cm^3, of which Open CASCADE has other powers."""
    from OCP.StepBasic import (
        StepBasic_DerivedUnitElement,
        StepBasic_Product,
        StepBasic_ProductDefinitionFormation,
        StepBasic_SiUnitAndMassUnit,
    )
    from OCP.TCollection import TCollection_HAsciiString

    for index in range(1, model.NbEntities() + 1):
        entity = model.Value(index)
        if isinstance(entity, StepBasic_Product) and entity.Name().ToCString() in products:
            product = products[entity.Name().ToCString()]
            entity.SetId(TCollection_HAsciiString(_ascii(product.number)))
            entity.SetDescription(TCollection_HAsciiString(_ascii(product.material)))
        elif isinstance(entity, StepBasic_ProductDefinitionFormation):
            entity.SetId(TCollection_HAsciiString(identity.fingerprint))
        elif isinstance(entity, StepBasic_DerivedUnitElement):
            entity.SetExponent(1.0 if isinstance(entity.Unit(), StepBasic_SiUnitAndMassUnit) else -3.0)


def read_step(path: Path) -> StepFile:
    """Read the STEP file at `path` from disk: names, colours and solids in their places."""
    import cadquery as cq

    with open(path, encoding="latin-1") as file:
        content = file.read()
    header = content.split("ENDSEC;", 1)[0]
    # A string of the header may be broken over lines anywhere.
    flat = re.sub(r"\s*\n\s*", "", header)
    schema = re.search(r"FILE_SCHEMA\s*\(\s*\(\s*'([^']*)'", flat)
    # The lengths' unit is the named one without a conversion, next to LENGTH_UNIT.
    millimetres = re.search(r"LENGTH_UNIT\(\)\s*NAMED_UNIT\(\*\)\s*SI_UNIT\(\.MILLI\.,\s*\.METRE\.\)", content)
    root = cq.Assembly.importStep(str(path))
    parts = []
    for child in root.children or [root]:
        shape = child.toCompound()
        colour = child.color.toTuple() if child.color else None
        parts.append(StepPart(child.name, tuple(shape.Solids()), shape, colour))
    return StepFile(Path(path), flat, schema.group(1) if schema else "", bool(millimetres), tuple(parts))


def _ascii(text: str) -> str:
    """STEP strings are ASCII; other characters and quotes are replaced."""
    return text.encode("ascii", "replace").decode().replace("'", "?")
