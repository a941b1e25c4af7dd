"""The file formats of an export, each with how it is written and how the file is checked once it lies on disk."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from hdopt.files import JsonReady

if TYPE_CHECKING:
    from hdopt.geometry.job import Job


class Format(Protocol):
    """A kind of file."""

    @property
    def description(self) -> str: ...

    @property
    def suffixes(self) -> tuple[str, ...]:
        """Endings that a file of this kind may have."""

    @property
    def needs_solids(self) -> bool:
        """Whether writing it takes CadQuery."""

    def write(self, path: Path, job: Job) -> None: ...

    def check(self, path: Path, job: Job, name: str) -> JsonReady:
        """Read the file back and compare it with the model; `CheckFailed` about the file `name` where it differs."""


class Step:
    description = "STEP assembly of all parts (AP214 or AP242)"
    suffixes = (".step", ".stp")
    needs_solids = True

    def write(self, path: Path, job: Job) -> None:
        from hdopt.geometry.part_sheets import product_data
        from hdopt.geometry.step import write_step

        schema = job.options.step_schema
        # AP214 has no semantic tolerances.
        products = product_data(job) if schema == "AP242" else None
        write_step(path, job.solids, job.identity, schema, products)

    def check(self, path: Path, job: Job, name: str) -> JsonReady:
        from hdopt.geometry.callouts import callouts_of
        from hdopt.geometry.check import CheckFailed, check_step, tolerance_failures
        from hdopt.geometry.pmi_practice import departures
        from hdopt.geometry.step import read_step

        schema = job.options.step_schema
        outcome = check_step(read_step(path), job.model, job.identity, schema, name).to_dict()
        if schema == "AP242":
            made = [part for part in job.model.parts if not part.context]
            callouts = [callout for part in made for callout in callouts_of(part, job.model)]
            text = path.read_text(encoding="latin-1")
            if failures := [*tolerance_failures(text, callouts), *departures(text)]:
                raise CheckFailed(name, failures)
            outcome["tolerances"] = sum(len(callout.frames) for callout in callouts)
            outcome["sizes"] = sum(callout.size is not None for callout in callouts)
        return outcome


class Dxf:
    description = "DXF of all parts for wire cutting: through and blind outlines, tolerance zone"
    suffixes = (".dxf",)
    needs_solids = False

    def write(self, path: Path, job: Job) -> None:
        from hdopt.geometry.dxf import write_dxf

        write_dxf(path, job)

    def check(self, path: Path, job: Job, name: str) -> JsonReady:
        from hdopt.geometry.dxf import check_dxf

        return check_dxf(path, job, name)


class Stl:
    description = "STL mesh of all parts in their places, for printing"
    suffixes = (".stl",)
    needs_solids = True

    def write(self, path: Path, job: Job) -> None:
        from hdopt.geometry.mesh import write_stl

        write_stl(path, job)

    def check(self, path: Path, job: Job, name: str) -> JsonReady:
        from hdopt.geometry.mesh import check_stl

        return check_stl(path, job, name)


class ThreeMf:
    description = "3MF mesh with named, coloured parts, for printing"
    suffixes = (".3mf",)
    needs_solids = True

    def write(self, path: Path, job: Job) -> None:
        from hdopt.geometry.mesh import write_3mf

        write_3mf(path, job)

    def check(self, path: Path, job: Job, name: str) -> JsonReady:
        from hdopt.geometry.mesh import check_3mf

        return check_3mf(path, job, name)


class Svg:
    description = "SVG drawing: front view with dimensions, section, key dimensions"
    suffixes = (".svg",)
    needs_solids = True

    def write(self, path: Path, job: Job) -> None:
        from hdopt.geometry.drawing import draw

        path.write_text(draw(job), encoding="utf-8")

    def check(self, path: Path, job: Job, name: str) -> JsonReady:
        from hdopt.geometry.drawing import check_drawing

        return check_drawing(path, job, name)


class Png:
    description = "PNG picture of the parts, pulled apart"
    suffixes = (".png",)
    needs_solids = True

    def write(self, path: Path, job: Job) -> None:
        from hdopt.geometry.picture import write_png

        write_png(path, job)

    def check(self, path: Path, job: Job, name: str) -> JsonReady:
        from hdopt.geometry.picture import check_png

        return check_png(path, job, name)


class Cam:
    description = "cam as a table (CSV): angle, radius, normal, curvature"
    suffixes = (".csv",)
    needs_solids = False

    def write(self, path: Path, job: Job) -> None:
        from hdopt.geometry.cam_table import write_cam

        write_cam(path, job)

    def check(self, path: Path, job: Job, name: str) -> JsonReady:
        from hdopt.geometry.cam_table import check_cam

        return check_cam(path, job, name)


class Gcode:
    description = "G-code for a two-axis cam grinder"
    suffixes = (".ngc", ".nc", ".gcode")
    needs_solids = False

    def write(self, path: Path, job: Job) -> None:
        from hdopt.geometry.grinding import write_gcode

        write_gcode(path, job)

    def check(self, path: Path, job: Job, name: str) -> JsonReady:
        from hdopt.geometry.grinding import check_gcode

        return check_gcode(path, job, name)


class Inspection:
    description = "inspection plan (CSV)"
    suffixes = (".csv",)
    needs_solids = False

    def write(self, path: Path, job: Job) -> None:
        from hdopt.geometry.inspection import write_inspection

        write_inspection(path, job)

    def check(self, path: Path, job: Job, name: str) -> JsonReady:
        from hdopt.geometry.inspection import check_inspection

        return check_inspection(path, job, name)


class Mating:
    description = "mating sheet (CSV): what shaft, housing and bearing seats must keep"
    suffixes = (".csv",)
    needs_solids = False

    def write(self, path: Path, job: Job) -> None:
        from hdopt.geometry.mating_sheet import write_mating

        write_mating(path, job)

    def check(self, path: Path, job: Job, name: str) -> JsonReady:
        from hdopt.geometry.mating_sheet import check_mating

        return check_mating(path, job, name)


class Pdf:
    description = "drawings (PDF): assembly and a sheet for each part"
    suffixes = (".pdf",)
    needs_solids = True

    def write(self, path: Path, job: Job) -> None:
        from hdopt.geometry.part_sheets import sheets
        from hdopt.geometry.sheet_pdf import write_pdf

        write_pdf(path, sheets(job))

    def check(self, path: Path, job: Job, name: str) -> JsonReady:
        from hdopt.geometry.sheet_archive import check_pdf

        return check_pdf(path, job, name)


class Drawings:
    description = "drawings (ZIP): assembly and a sheet for each part, as SVG and DXF"
    suffixes = (".zip",)
    needs_solids = True

    def write(self, path: Path, job: Job) -> None:
        from hdopt.geometry.sheet_archive import write_drawings

        write_drawings(path, job)

    def check(self, path: Path, job: Job, name: str) -> JsonReady:
        from hdopt.geometry.sheet_archive import check_drawings

        return check_drawings(path, job, name)


FORMATS: dict[str, Format] = {
    "step": Step(),
    "dxf": Dxf(),
    "stl": Stl(),
    "3mf": ThreeMf(),
    "svg": Svg(),
    "pdf": Pdf(),
    "drawings": Drawings(),
    "png": Png(),
    "cam": Cam(),
    "gcode": Gcode(),
    "inspection": Inspection(),
    "mating": Mating(),
}
"""Format -> what writes and checks it; the names are the options of `hdopt export`."""
