"""Export of a wave generator: build, write under a passing name, read back, check, and only then name the file.

A file that has not passed its check never bears its name; a file of an earlier export stays as it was.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hdopt.drive import Drive
from hdopt.errors import HdoptError, MissingLibrary, unknown_name
from hdopt.geometry.assembly import WaveGeneratorModel, wave_generator_model
from hdopt.geometry.dimensions import Dimension, key_dimensions, tolerance_bounds
from hdopt.geometry.formats import FORMATS
from hdopt.geometry.step import Identity
from hdopt.study.export import ExportSection

if TYPE_CHECKING:
    import cadquery as cq

    from hdopt.geometry.part import Part
    from hdopt.study import Study


@dataclass(frozen=True)
class Job:
    """What every format needs to write its file: the model, its solids (built once), and what the files say."""

    drive: Drive
    model: WaveGeneratorModel
    options: ExportSection
    dimensions: tuple[Dimension, ...]
    identity: Identity

    @cached_property
    def solids(self) -> tuple[tuple[Part, cq.Solid], ...]:
        return tuple((part, part.build()) for part in self.model.parts)


@dataclass(frozen=True)
class ExportResult:
    """What was written, as it was found in the files."""

    files: Mapping[str, Path]
    checks: Mapping[str, Mapping[str, Any]]
    model: WaveGeneratorModel
    dimensions: tuple[Dimension, ...]
    identity: Identity

    @property
    def profile_deviation_um(self) -> float | None:
        """Largest deviation of a profile in any file from its analytic curve, um; None where no file shows one."""
        found = [check.get("max_profile_deviation_um") for check in self.checks.values()]
        return max((value for value in found if value is not None), default=None)

    def to_dict(self) -> dict[str, Any]:
        step = self.checks.get("step", {})
        parts = step.get("parts") or [
            {"name": part.name, "volume_mm3": part.volume, "bounding_box_mm": list(part.size), "context": part.context}
            for part in self.model.parts
        ]
        first = next(iter(self.files.values()), None)
        return {
            "file": str(self.files.get("step", first)) if self.files else None,
            "files": {kind: str(path) for kind, path in self.files.items()},
            "structure": self.model.structure.value,
            "parts": parts,
            "max_profile_deviation_um": self.profile_deviation_um,
            "dimensions": [dimension.to_dict() for dimension in self.dimensions],
            "checks": dict(self.checks),
            "assumptions": {assumption.key: assumption.value for assumption in self.model.assumptions},
            "notes": list(self.model.notes),
            "fingerprint": self.identity.fingerprint,
        }


def export(
    study: Study, files: Mapping[str, str | Path], tolerances: Mapping[str, float] | None = None
) -> ExportResult:
    """Write a study's wave generator to `files` (a key of `FORMATS` -> path) and check each file from disk.

    `tolerances` are those of an allocation, by study key (mm or deg) or contributor; without them the study's own hold.
    Raises `HdoptError` for input that cannot be made, and `hdopt.geometry.check.CheckFailed` where a file fails its
    check: then no file of this export is left.
    """
    section = study.sections.get("export", ExportSection())
    bounds = {**tolerance_bounds(study.data), **(tolerances or {})}
    return export_drive(study.drive, files, section, study.name, bounds, study.data.get("contributors"))


def export_drive(
    drive: Drive,
    files: Mapping[str, str | Path],
    options: ExportSection | None = None,
    name: str = "wave generator",
    bounds: Mapping[str, float] | None = None,
    contributors: Mapping[str, Any] | None = None,
) -> ExportResult:
    """The same for a drive at hand; `name` is what the files call their study."""
    options = options or ExportSection()
    for kind in files:
        if kind not in FORMATS:
            raise HdoptError(unknown_name("file format", kind, FORMATS))
    targets = {kind: Path(path) for kind, path in files.items()}
    if len({path.resolve() for path in targets.values()}) < len(targets):
        raise HdoptError("two files of the export have the same name; give each its own")
    job = make_job(drive, options, name, bounds, contributors)
    if any(FORMATS[kind].needs_solids for kind in targets):
        require_cadquery()
    checks = {}
    with staged(targets) as passing:
        for kind, path in passing.items():
            FORMATS[kind].write(path, job)
        for kind, path in passing.items():
            checks[kind] = FORMATS[kind].check(path, job, targets[kind].name)
    return ExportResult(targets, checks, job.model, job.dimensions, job.identity)


def make_job(
    drive: Drive,
    options: ExportSection,
    name: str,
    bounds: Mapping[str, float] | None = None,
    contributors: Mapping[str, Any] | None = None,
) -> Job:
    """Everything that is known before a solid is made: the parts, their key dimensions, and what files will say."""
    model = wave_generator_model(drive, options)
    identity = Identity(f"wave generator {name}", name, fingerprint(drive, options), version("hdopt"))
    width, zone = drive.wave_generator.width, options.profile_tolerance_mm
    table = key_dimensions(model.structure, model.parts, width, zone, bounds or {}, contributors)
    return Job(drive, model, options, table, identity)


def require_cadquery() -> None:
    """`HdoptError` that says what to install, where CadQuery's libraries do not load."""
    try:
        import cadquery  # noqa: F401
    except ImportError as error:
        raise MissingLibrary(
            f"CadQuery cannot be loaded ({error}); on Debian install libgl1, then try again"
        ) from error


def fingerprint(drive: Drive, options: ExportSection) -> str:
    """Twelve digits that change with any number the solids are made from."""
    plain = json.dumps([_plain(drive.wave_generator), _plain(drive.clearances), options.model_dump()], sort_keys=True)
    return hashlib.sha256(plain.encode()).hexdigest()[:12]


def _plain(value: Any) -> Any:
    if is_dataclass(value):
        numbers = {field.name: getattr(value, field.name) for field in fields(value) if not field.name.startswith("_")}
        value = {"kind": type(value).__name__, **numbers}
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, Enum):
        return value.value
    return value.tolist() if hasattr(value, "tolist") else value


@contextmanager
def staged(targets: Mapping[str, Path]) -> Iterator[dict[str, Path]]:
    """Passing names beside the targets; they become the targets' at the end, all of them, unless anything fails."""
    passing = {kind: path.with_name(f".{path.name}.unchecked-{os.getpid()}") for kind, path in targets.items()}
    try:
        for kind, path in passing.items():
            _require_writable(path, targets[kind])
        yield passing
        for kind, path in passing.items():
            os.replace(path, targets[kind])
    finally:
        for path in passing.values():
            if path.exists():
                path.unlink()


def _require_writable(passing: Path, target: Path) -> None:
    """Create the passing file, or say in one sentence why that cannot be done."""
    if target.is_dir():
        raise HdoptError(f"cannot write {target}: it is a folder; give the name of a file")
    try:
        passing.touch()
    except OSError as error:
        raise HdoptError(
            f"cannot write {target}: {error.strerror}; give a file in a folder that exists and can be written"
        ) from error
