"""The file formats of an export, each with how it is written and how the file is checked once it lies on disk."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from hdopt.geometry.export import Job


class Format(Protocol):
    """A kind of file."""

    @property
    def description(self) -> str: ...

    @property
    def needs_solids(self) -> bool:
        """Whether writing it takes CadQuery."""

    def write(self, path: Path, job: Job) -> None: ...

    def check(self, path: Path, job: Job, name: str) -> dict[str, Any]:
        """Read the file back and compare it with the model; `CheckFailed` about the file `name` where it differs."""


class Step:
    description = "STEP assembly of all parts (AP214 or AP242)"
    needs_solids = True

    def write(self, path: Path, job: Job) -> None:
        from hdopt.geometry.step import write_step

        write_step(path, job.solids, job.identity, job.options.step_schema)

    def check(self, path: Path, job: Job, name: str) -> dict[str, Any]:
        from hdopt.geometry.check import check_step
        from hdopt.geometry.step import read_step

        return check_step(read_step(path), job.model, job.identity, job.options.step_schema, name).to_dict()


class Dxf:
    description = "DXF of the profile for wire cutting, with bore and tolerance zone"
    needs_solids = False

    def write(self, path: Path, job: Job) -> None:
        from hdopt.geometry.dxf import write_dxf

        write_dxf(path, job)

    def check(self, path: Path, job: Job, name: str) -> dict[str, Any]:
        from hdopt.geometry.dxf import check_dxf

        return check_dxf(path, job, name)


class Stl:
    description = "STL mesh of all parts in their places, for printing"
    needs_solids = True

    def write(self, path: Path, job: Job) -> None:
        from hdopt.geometry.mesh import write_stl

        write_stl(path, job)

    def check(self, path: Path, job: Job, name: str) -> dict[str, Any]:
        from hdopt.geometry.mesh import check_stl

        return check_stl(path, job, name)


class ThreeMf:
    description = "3MF mesh with named, coloured parts, for printing"
    needs_solids = True

    def write(self, path: Path, job: Job) -> None:
        from hdopt.geometry.mesh import write_3mf

        write_3mf(path, job)

    def check(self, path: Path, job: Job, name: str) -> dict[str, Any]:
        from hdopt.geometry.mesh import check_3mf

        return check_3mf(path, job, name)


class Svg:
    description = "SVG drawing: front view with dimensions, section, key dimensions"
    needs_solids = True

    def write(self, path: Path, job: Job) -> None:
        from hdopt.geometry.drawing import draw

        path.write_text(draw(job), encoding="utf-8")

    def check(self, path: Path, job: Job, name: str) -> dict[str, Any]:
        from hdopt.geometry.drawing import check_drawing

        return check_drawing(path, job, name)


class Png:
    description = "PNG picture of the parts, pulled apart"
    needs_solids = True

    def write(self, path: Path, job: Job) -> None:
        from hdopt.geometry.picture import write_png

        write_png(path, job)

    def check(self, path: Path, job: Job, name: str) -> dict[str, Any]:
        from hdopt.geometry.picture import check_png

        return check_png(path, job, name)


FORMATS: dict[str, Format] = {
    "step": Step(),
    "dxf": Dxf(),
    "stl": Stl(),
    "3mf": ThreeMf(),
    "svg": Svg(),
    "png": Png(),
}
"""Format -> what writes and checks it; the names are the options of `hdopt export`."""
