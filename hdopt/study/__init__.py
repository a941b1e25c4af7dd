"""A study: one TOML file, checked at the edge, as frozen records inside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hdopt.drive import Clearances, Drive, Load
from hdopt.errors import HdoptError, unknown_name
from hdopt.study.document import (
    SET_ON_COMMAND_LINE,
    Document,
    leaves,
    merge,
    parse_document,
    parse_value,
    read_document,
    set_value,
)

if TYPE_CHECKING:
    from hdopt.deviations import DriveErrors
    from hdopt.extended import AddedEffect, Operation
    from hdopt.study.base import Section

DEFAULT_STUDY = "csf-25-80"
"""What a command works on when it is told neither a study nor a drive."""

DRIVE_SECTIONS = ("drive", "wave_generator", "clearances", "material", "load")


@dataclass(frozen=True)
class Study:
    """A checked study.

    `sections` holds the checked section models by name, `data` the merged file they were read from, `folder` the place
    that relative file names start from. Sections become physics records through the properties, on demand.
    """

    name: str
    sections: Mapping[str, Section]
    data: Mapping[str, Any]
    folder: Path
    source: str
    document: Document = field(repr=False)

    def section(self, name: str, needed_by: str = "this") -> Section:
        """The section `name`; a clear error where the study has none."""
        if name not in self.sections:
            raise HdoptError(f"{needed_by} needs a [{name}] section, which {self.source} does not have; add it")
        return self.sections[name]

    @cached_property
    def drive(self) -> Drive:
        """The drive: geometry, wave generator, clearances, material, load."""
        geometry = self._built("drive")
        wave_generator = self._built("wave_generator", geometry, self.folder)
        return Drive(
            geometry,
            wave_generator,
            self._built("clearances") if "clearances" in self.sections else Clearances(),
            self._built("material") if "material" in self.sections else None,
            self._built("load") if "load" in self.sections else Load(),
        )

    @cached_property
    def errors(self) -> DriveErrors:
        """The errors of the one drive in [errors]."""
        return self._built("errors")

    @cached_property
    def effects(self) -> tuple[AddedEffect, ...]:
        """The effects in [effects], which the base model leaves out; () where there are none."""
        if "effects" not in self.sections:
            return ()
        from hdopt.study.effects import added_effects

        built = []
        for name, section in added_effects(self.sections["effects"]).items():
            try:
                built.append(section.build(self.drive.geometry))
            except HdoptError as error:
                raise HdoptError(f"{self.document.where(('effects', name))}: {error}") from error
        return tuple(built)

    @cached_property
    def operation(self) -> Operation:
        """The operating condition in [operation]; forward motion and nothing else where the study does not say."""
        from hdopt.extended import Operation

        return self._built("operation") if "operation" in self.sections else Operation()

    @property
    def title(self) -> str:
        section = self.sections.get("study")
        return (section.title if section else None) or self.name

    def _built(self, name: str, *context: Any) -> Any:
        try:
            return self.section(name, "a drive" if name in DRIVE_SECTIONS else "this").build(*context)
        except HdoptError as error:
            raise HdoptError(f"{self.document.where((name,))}: {error}") from error


def shipped_drives() -> tuple[str, ...]:
    """Names of the drives that ship with hdopt."""
    return _names(resources.files("hdopt") / "data")


def shipped_studies() -> tuple[str, ...]:
    """Names of the studies that ship with hdopt."""
    return _names(resources.files("hdopt.studies"))


def _names(folder: Any) -> tuple[str, ...]:
    return tuple(sorted(item.name.removesuffix(".toml") for item in folder.iterdir() if item.name.endswith(".toml")))


def load_study(source: str | Path | None = None, overrides: Sequence[str] = (), drive: str | None = None) -> Study:
    """Load and check a study.

    `source` is a TOML file or a shipped study's name; `drive` a shipped drive, which takes the place of the study's
    own; with neither, the shipped CSF-25-80. A study that names a shipped drive (`drive = "csf-25-80"`) starts from
    all that ships with it, and its own keys replace the shipped ones, key by key. `overrides` are KEY=VALUE with the
    key's last name or dotted path. Raises `HdoptError` with file, line and key for anything that cannot be used.
    """
    if source is None:
        name = drive or DEFAULT_STUDY
        document, folder = _shipped_drive(name), Path()
    else:
        document, folder, name = _document(source)
        if drive is not None:
            shipped = {key: value for key, value in _shipped_drive(drive).data.items() if key in DRIVE_SECTIONS}
            document = Document({**document.data, **shipped}, document.source, document.lines)
    if isinstance(document.data.get("drive"), str):
        own = {key: value for key, value in document.data.items() if key != "drive"}
        base = _shipped_drive(document.data["drive"], document.where(("drive",))).data
        document = Document(merge(base, own), document.source, document.lines)
    return study_of(apply_overrides(document, overrides), name, folder)


def study_of(document: Document, name: str, folder: Path) -> Study:
    """The study in a document whose shipped parts are merged in already."""
    from hdopt.study.schema import check_sections

    return Study(name, check_sections(document), document.data, folder, document.source, document)


def _document(source: str | Path) -> tuple[Document, Path, str]:
    path = Path(source)
    if path.suffix == ".toml" or path.is_file():
        return read_document(path), path.parent, path.stem
    names = shipped_studies()
    if str(source) not in names:
        raise HdoptError(f"{unknown_name('study', str(source), names)} (the path of a .toml file is allowed too)")
    file = resources.files("hdopt.studies") / f"{source}.toml"
    return parse_document(file.read_text(encoding="utf-8"), f"{source}.toml"), Path(str(file)).parent, str(source)


def _shipped_drive(name: str, where: str = "") -> Document:
    if name not in shipped_drives():
        raise HdoptError(f"{where + ': ' if where else ''}{unknown_name('drive', name, shipped_drives())}")
    file = resources.files("hdopt") / "data" / f"{name}.toml"
    return parse_document(file.read_text(encoding="utf-8"), f"{name}.toml")


def apply_overrides(document: Document, overrides: Sequence[str]) -> Document:
    """`document` with each KEY=VALUE set; messages then name --set as the place."""
    if not overrides:
        return document
    data, lines = merge({}, document.data), dict(document.lines)
    for override in overrides:
        key, equals, value = override.partition("=")
        if not equals:
            raise HdoptError(f"--set {override!r} has no '='; write KEY=VALUE, as in --set wave_generator.width_mm=8")
        path = _resolve(key.strip(), data)
        set_value(data, path, parse_value(value.strip()))
        lines[path] = SET_ON_COMMAND_LINE
    return Document(data, document.source, lines)


def _resolve(key: str, data: Mapping[str, Any]) -> tuple[str, ...]:
    """The dotted path that a key's last name or path means; an unknown or ambiguous one is an error."""
    from hdopt.study.schema import SECTIONS, section_model

    known = {(name, field) for name in SECTIONS if name != "study" for field in section_model(name).model_fields}
    known |= set(leaves(data))
    parts = tuple(key.split("."))
    matches = sorted(path for path in known if path[-len(parts) :] == parts)
    values = [path for path in matches if not isinstance(_get(data, path), Mapping)]
    matches = values or matches
    if len(matches) > 1:
        options = " or ".join(".".join(path) for path in matches)
        raise HdoptError(f"--set {key}: ambiguous; write {options}")
    if not matches:
        names = {path[-1] for path in known} if len(parts) == 1 else {".".join(path) for path in known}
        raise HdoptError(f"--set {unknown_name('key', key, sorted(names))}")
    return matches[0]


def _get(data: Any, path: tuple[str, ...]) -> Any:
    for part in path:
        data = data.get(part) if isinstance(data, Mapping) else None
    return data


def shipped_study_titles() -> dict[str, str]:
    """Name -> title of each shipped study."""
    titles = {}
    for name in shipped_studies():
        document, _, _ = _document(name)
        titles[name] = document.data.get("study", {}).get("title", name)
    return titles
