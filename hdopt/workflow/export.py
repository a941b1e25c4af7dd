"""`hdopt export`: a study's wave generator as checked files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from hdopt.geometry.dimensions import tolerance_bounds
from hdopt.geometry.export import ExportResult, export_drive
from hdopt.geometry.options import ExportOptions
from hdopt.study import AnyStudy, Study, as_study
from hdopt.study.export import ExportSection
from hdopt.workflow.allocation_file import read_allocation
from hdopt.workflow.placed import numbers_named


@numbers_named
def export(
    study: AnyStudy, files: Mapping[str, str | Path], tolerances: Mapping[str, float] | str | Path | None = None
) -> ExportResult:
    """Write the wave generator of a `study`, or of its name or path, to `files` (a key of `FORMATS` -> path) and
    check each file from disk.

    `tolerances` are those of an allocation, by study key (mm or deg) or contributor, or the JSON file that
    `hdopt allocate` wrote; without them the study's own hold.
    Raises `HdoptError` for input that cannot be made, and `hdopt.geometry.check.CheckFailed` where a file fails its
    check: then no file of this export is left.
    """
    study = as_study(study)
    if isinstance(tolerances, str | Path):
        tolerances = read_allocation(Path(tolerances), study)
    bounds = {**tolerance_bounds(study.data), **(tolerances or {})}
    return export_drive(study.drive, files, export_options(study), study.name, bounds, study.data.get("contributors"))


def export_options(study: Study) -> ExportOptions:
    """What the study's [export] section gives."""
    section = study.find("export", ExportSection)
    return ExportOptions() if section is None else section.build()
