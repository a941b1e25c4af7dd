"""STEP files: written with part names, colours and the study's identity, and read back with nothing else at hand."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hdopt.errors import HdoptError

if TYPE_CHECKING:
    import cadquery as cq

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


def write_step(path: Path, parts: Sequence[tuple[Part, cq.Solid]], identity: Identity, schema: str = "AP214") -> None:
    """Write an assembly of named, coloured parts, in mm."""
    import cadquery as cq
    from cadquery.occ_impl.assembly import toCAF
    from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.Interface import Interface_Static
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_StepModelType
    from OCP.TCollection import TCollection_HAsciiString
    from OCP.XSControl import XSControl_WorkSession

    assembly = cq.Assembly(name=_ascii(identity.title))
    for part, solid in parts:
        assembly.add(solid, name=part.name, color=cq.Color(*part.colour))
    _, document = toCAF(assembly, True)

    Interface_Static.SetCVal_s("write.step.schema", SCHEMAS[schema][0])
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    Interface_Static.SetCVal_s("xstep.cascade.unit", "MM")
    # Curves on surfaces repeat what the surfaces say and double the file; readers make them anew.
    Interface_Static.SetIVal_s("write.surfacecurve.mode", 0)
    writer = STEPCAFControl_Writer(XSControl_WorkSession(), False)
    writer.SetColorMode(True)
    writer.SetNameMode(True)
    if not writer.Transfer(document, STEPControl_StepModelType.STEPControl_AsIs):
        raise RuntimeError("Open CASCADE could not translate the parts to STEP")

    header = APIHeaderSection_MakeHeader(writer.ChangeWriter().Model())

    def text(value: str) -> TCollection_HAsciiString:
        return TCollection_HAsciiString(_ascii(value))

    header.SetName(text(identity.title))
    header.SetDescriptionValue(1, text(identity.description))
    header.SetAuthorValue(1, text("hdopt"))
    header.SetOrganizationValue(1, text(""))
    header.SetOriginatingSystem(text(f"hdopt {identity.version}"))
    header.SetAuthorisation(text(""))
    if writer.Write(str(path)) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise HdoptError(f"cannot write {path}; give a file in a folder that can be written")


def read_step(path: Path) -> StepFile:
    """Read a STEP file from disk: names, colours and solids in their places."""
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
