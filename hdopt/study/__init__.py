"""A study: one TOML file, checked at the edge, as frozen records inside."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar  # Any: what a study file holds, of TOML's several kinds

from hdopt.errors import (
    HdoptError,
    MissingSection,
    MissingValue,
    NoResult,
    WrongCall,
    numbers_of,
    shown,
    unknown_name,
)
from hdopt.files import files_of_work
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
    from hdopt.drive.errors import DriveErrors
    from hdopt.drive.geometry import Drive
    from hdopt.drive.teeth import MeasuredTeeth
    from hdopt.simulation import EffectValues, Operation
    from hdopt.study.base import Section

S = TypeVar("S", bound="Section")

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
    recipe: Mapping[str, Any] = field(default_factory=dict, repr=False, compare=False)
    """The arguments of `load_study` that give this study again; {} for one that was made otherwise."""

    def find(self, name: str, kind: type[S]) -> S | None:
        """The section `name`, which is of this `kind` of model; None where the study has none."""
        section = self.sections.get(name)
        if section is not None and not isinstance(section, kind):
            raise TypeError(f"[{name}] is a {type(section).__name__}, not a {kind.__name__}")
        return section

    def section(self, name: str, kind: type[S], needed_by: str = "this") -> S:
        """The section `name`, which is of this `kind` of model; where the study has none, a message that says it is
        `needed_by` what."""
        found = self.find(name, kind)
        if found is None:
            raise MissingSection(needed_by, self.source, name)
        return found

    def require(self, names: Sequence[str], needed_by: str) -> None:
        """Raise one `MissingSection` for all of the sections `names` that the study has not, which are `needed_by`
        what."""
        missing = [name for name in names if name not in self.sections]
        if missing:
            raise MissingSection(needed_by, self.source, *missing)

    @cached_property
    def drive(self) -> Drive:
        """The drive: geometry, wave generator, clearances, material, load."""
        from hdopt.drive.geometry import Drive
        from hdopt.study.drive import (
            ClearancesSection,
            DriveSection,
            LoadSection,
            MaterialSection,
            RoundnessSection,
            WaveGeneratorSection,
        )

        with self._placed("drive"):
            geometry = self.section("drive", DriveSection, "a drive").build()
        with self._placed("wave_generator"):
            wave_generator = self.section("wave_generator", WaveGeneratorSection, "a drive").build(
                geometry, self.folder
            )
        with self._placed("clearances"):
            clearances = (self.find("clearances", ClearancesSection) or ClearancesSection()).build()
        with self._placed("material"):
            given = self.find("material", MaterialSection)
            material = None if given is None else given.build()
        with self._placed("load"):
            load = (self.find("load", LoadSection) or LoadSection()).build()
        cs_teeth = self._teeth("cs_teeth", geometry.circular_spline_teeth, geometry.module)
        fs_teeth = self._teeth("fs_teeth", geometry.flexspline_teeth, geometry.module)
        with self._placed("cs_roundness"):
            ring = self.find("cs_roundness", RoundnessSection)
            roundness = None if ring is None else ring.build(geometry.module, self.folder)
        return Drive(geometry, wave_generator, clearances, material, load, cs_teeth, fs_teeth, roundness)

    def _teeth(self, name: str, teeth: int, module: float) -> MeasuredTeeth | None:
        from hdopt.study.drive import TeethSection

        with self._placed(name):
            section = self.find(name, TeethSection)
            return None if section is None else section.build(teeth, module, self.folder)

    @property
    def measured_instead(self) -> tuple[str, ...]:
        """Names of the tooth amplitudes in [errors] and [tolerances] that measured teeth stand instead of."""
        from hdopt.study.drive import TeethSection

        measured = {spline: self.find(f"{spline}_teeth", TeethSection) for spline in ("cs", "fs")}
        return tuple(
            f"{spline}_tooth_amplitude"
            for spline, section in measured.items()
            if section is not None and section.sine == "instead"
        )

    @cached_property
    def errors(self) -> DriveErrors:
        """The errors of the one drive in [errors]."""
        from hdopt.study.drive import ErrorsSection

        with self._placed("errors"):
            errors = self.section("errors", ErrorsSection).build()
        return errors.with_(**dict.fromkeys(self.measured_instead, 0.0))

    @cached_property
    def effects(self) -> tuple[EffectValues, ...]:
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
        from hdopt.simulation import Operation

        if "operation" not in self.sections:
            return Operation()
        from hdopt.study.effects import OperationSection

        with self._placed("operation"):
            return self.section("operation", OperationSection).build()

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the study's numbers: all that ships and every --set merged in, keys in order. Layout, comments and
        the order of keys in the file do not change it."""
        text = json.dumps(self.data, sort_keys=True, separators=(",", ":"), default=str)
        return hashlib.sha256(text.encode()).hexdigest()

    def with_(self, changes: Mapping[str, Any] | None = None, /, **more: Any) -> Study:
        """This study with other values: `changes` by dotted path or last name of the key, `more` by last name.

        `study.with_(width_mm=8)` and `study.with_({"wave_generator.width_mm": 8})` are the same; a section's name with
        a table takes the section's place. The new study is checked like a file, and no file is read again. Raises
        `HdoptError` for an unknown or ambiguous key.
        """
        if not isinstance(changes, Mapping | None) or not all(isinstance(key, str) for key in changes or ()):
            raise WrongCall(
                f"study.with_: {shown(str(changes))} holds no keys; give KEY=VALUE, or a dictionary of dotted path "
                'and value, as in study.with_({"wave_generator.width_mm": 8})'
            )
        values = {**(changes or {}), **more}
        return study_of(with_values(self.document, values.items(), "study.with_"), self.name, self.folder)

    @property
    def title(self) -> str:
        from hdopt.study.drive import StudySection

        section = self.find("study", StudySection)
        return (section.title if section else None) or self.name

    @contextmanager
    def _placed(self, name: str) -> Iterator[None]:
        """Messages of what is built from the section `name` say where in the file that section stands."""
        try:
            with numbers_of(lambda: self.document.where((name,))):
                yield
        except MissingValue as error:
            error.args = (f"{self.document.where((name,))}: {error}",)  # which keys it names stays known
            raise
        except NoResult:
            raise
        except HdoptError as error:
            raise HdoptError(f"{self.document.where((name,))}: {error}") from error


AnyStudy = Study | str | Path | None
"""What every command takes: a study, the name of a shipped one, the path of a file; None for the shipped CSF-25-80."""


def as_study(study: AnyStudy) -> Study:
    """The `study` itself, or the one that a path or a shipped name means; the shipped CSF-25-80 for None."""
    return study if isinstance(study, Study) else load_study(study)


def study_of_drive(drive: Drive, errors: DriveErrors, name: str = "drive") -> Study:
    """A study of the records of one `drive` and its `errors`, called `name`, for calls that take a study: it has no
    file, no tolerances and no effects."""
    study = Study(name, {}, {}, Path(), name, Document({}, name, {}))
    # the properties that a file's sections would be built into, filled from the records
    study.__dict__.update(drive=drive, errors=errors)
    return study


def shipped_drives() -> tuple[str, ...]:
    """Names of the drives that ship with hdopt."""
    return _names(resources.files("hdopt.drive") / "data")


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
    key's last name or dotted path; a file that they name lies beside the study, or where hdopt was called. Raises
    `HdoptError` with file, line and key for anything that cannot be used.
    """
    document, name, folder = study_document(source, drive)
    given = str(Path(source).resolve()) if source is not None and _is_file(Path(source)) else source
    overrides = [_with_whole_path(override, folder) for override in overrides]
    recipe = {"source": given, "overrides": overrides, "drive": drive}
    return replace(study_of(apply_overrides(document, overrides), name, folder), recipe=recipe)


def _with_whole_path(override: str, folder: Path) -> str:
    """KEY=VALUE with the whole path where the key is a file's, which does not lie in the study's `folder` but where
    hdopt was called: there a shell completes what is typed."""
    key, _, value = override.partition("=")
    path = Path(value.strip().strip("\"'"))
    if (
        key.strip().rpartition(".")[2] != "file"
        or path.is_absolute()
        or (folder / path).is_file()
        or not path.is_file()
    ):
        return override
    return f"{key}={path.resolve()}"


def study_document(source: str | Path | None = None, drive: str | None = None) -> tuple[Document, str, Path]:
    """The document of the study that `source` and `drive` mean, as `load_study` takes them, with all that ships merged
    in and nothing checked yet; its name and its folder."""
    if source is None:
        name = drive or DEFAULT_STUDY
        document, folder = _shipped_drive(name), Path()
    else:
        document, folder, name = _document(source)
        if drive is not None:
            shipped = {key: value for key, value in _shipped_drive(drive).data.items() if key in DRIVE_SECTIONS}
            document = replace(document, data={**document.data, **shipped}, texts=())
    if isinstance(document.data.get("drive"), str):
        own = {key: value for key, value in document.data.items() if key != "drive"}
        base = _shipped_drive(document.data["drive"], document.where(("drive",)))
        document = replace(
            document,
            data=merge(base.data, own),
            texts=(*base.texts, *document.texts),
            shipped=document.data["drive"],
            beneath=base.data,
        )
    return document, name, folder


def study_of(document: Document, name: str, folder: Path) -> Study:
    """The study called `name` in a `document` whose shipped parts are merged in already; file names in it are relative
    to `folder`. Raises `HdoptError` with file, line and key for an unknown section or key and for values that no
    study may have."""
    from hdopt.study.check import check_sections

    study = Study(name, check_sections(document), document.data, folder, document.source, document)
    if (work := files_of_work()) is not None:
        work.facts |= {"study": name, "study_sha256": study.sha256, "source": document.source}
        work.place = lambda: place_of_numbers(document)
        work.values = lambda message: _places_named(document, message)
    return study


def _places_named(document: Document, message: str) -> tuple[str, ...]:
    from hdopt.study.named import places_named

    return places_named(document, message)


def place_of_numbers(document: Document) -> str:
    """Where to look in `document` when its numbers lead to no result: its value that is farthest from the usual."""
    from hdopt.study.farthest import farthest

    return farthest(document, _shipped_drive(DEFAULT_STUDY).data)


def _document(source: str | Path) -> tuple[Document, Path, str]:
    path = Path(source)
    if path.suffix == ".toml" or _is_file(path):
        return read_document(path), path.parent, path.stem
    names = shipped_studies()
    if str(source) not in names:
        raise HdoptError(f"{unknown_name('study', str(source), names)} (the path of a .toml file is allowed too)")
    file = resources.files("hdopt.studies") / f"{source}.toml"
    return parse_document(file.read_text(encoding="utf-8"), f"{source}.toml"), Path(str(file)).parent, str(source)


def _is_file(path: Path) -> bool:
    """Whether `path` is a file; a name that no file can have is none."""
    try:
        return path.is_file()
    except OSError:
        return False


def _shipped_drive(name: str, where: str = "") -> Document:
    if name not in shipped_drives():
        raise HdoptError(f"{where + ': ' if where else ''}{unknown_name('drive', name, shipped_drives())}")
    file = resources.files("hdopt.drive") / "data" / f"{name}.toml"
    return parse_document(file.read_text(encoding="utf-8"), f"{name}.toml")


def apply_overrides(document: Document, overrides: Sequence[str]) -> Document:
    """`document` with each of `overrides`, KEY=VALUE, set; messages then name --set as the place."""
    values = []
    for override in overrides:
        key, equals, value = override.partition("=")
        if not equals:
            raise HdoptError(f"--set {override!r} has no '='; write KEY=VALUE, as in --set wave_generator.width_mm=8")
        try:
            values.append((key.strip(), parse_value(value.strip())))
        except HdoptError as error:
            raise HdoptError(f"--set {shown(key.strip())}: {error}") from error
    return with_values(document, values)


def with_values(document: Document, values: Iterable[tuple[str, Any]], place: str = "--set") -> Document:
    """`document` with each (key, value) of `values` set; messages name `place` as the one that asked for it."""
    from hdopt.study.schema import SECTIONS

    data, lines = merge({}, document.data), dict(document.lines)
    for key, value in values:
        path = (key,) if key in SECTIONS and isinstance(value, Mapping) else _resolve(key, data, place)
        set_value(data, path, value)
        lines = {held: line for held, line in lines.items() if held[: len(path)] != path}
        lines[path] = SET_ON_COMMAND_LINE
    return replace(document, data=data, lines=lines, set_by=place)


def _resolve(key: str, data: Mapping[str, Any], place: str) -> tuple[str, ...]:
    """The dotted path that a key's last name or path means; an unknown or ambiguous one is an error."""
    from hdopt.study.nearest import near_keys, unknown_key
    from hdopt.study.schema import ANY_NAME, SECTIONS, known_paths, section_model

    parts = tuple(key.split("."))
    if parts[0] == "study" and len(parts) == 2:
        known = sorted(section_model("study").model_fields)
        if parts[1] in known:
            return parts
        raise HdoptError(f"{place} [study]: {unknown_key(parts[1], known)}")
    if len(parts) == 1 and key in SECTIONS:
        raise HdoptError(f"{place} {key}: is a section; give a table of its keys, or one of them, {key}.KEY")
    if parts[0] != "effects":
        # The effects compile: they are asked only about what no other section has.
        found = _match(key, parts, data, known_paths(data, without=("effects",)), place)
        if found:
            return found
    possible = known_paths(data)
    found = _match(key, parts, data, possible, place)
    if found:
        return found
    possible = {path for path in possible if ANY_NAME not in path}
    beside = sorted({path[-1] for path in known_paths(data) if _same(path[:-1], parts[:-1], ANY_NAME)} - {ANY_NAME})
    if len(parts) > 2 and beside:
        raise HdoptError(f"{place} {'.'.join(parts[:-1])}: {unknown_key(parts[-1], beside)}")
    names = {path[-1] for path in possible} if len(parts) == 1 else {".".join(path) for path in possible}
    if len(parts) > 1 and not near_keys(key, names):
        names = {name for name in names if name.startswith(f"{parts[0]}.")}
        if not names:
            raise HdoptError(f"{place} unknown key {shown(key)}; it may begin with {', '.join(SECTIONS)}")
    raise HdoptError(f"{place} {unknown_key(key, sorted(names))}")


def _match(
    key: str, parts: tuple[str, ...], data: Mapping[str, Any], possible: set[tuple[str, ...]], place: str
) -> tuple[str, ...] | None:
    """The one of the `possible` paths that `parts` means, None where there is none."""
    from hdopt.study.schema import ANY_NAME

    made_up = {path for path in possible if ANY_NAME in path}
    if any(_same(path, parts, ANY_NAME) for path in made_up):
        return parts
    possible = possible - made_up
    # a key that the study writes, or one a level below its section, comes before those deeper in the schema
    for known in ({*leaves(data), *(path for path in possible if len(path) <= 2)}, possible):
        matches = sorted(path for path in known if path[-len(parts) :] == parts)
        values = [path for path in matches if not isinstance(_get(data, path), Mapping)]
        matches = values or matches
        if len(matches) > 1:
            options = " or ".join(".".join(path) for path in matches)
            raise HdoptError(f"{place} {key}: ambiguous; write {options}")
        if matches:
            return matches[0]
    return None


def _same(path: tuple[str, ...], parts: tuple[str, ...], any_name: str) -> bool:
    return len(path) == len(parts) and all(a in (any_name, b) for a, b in zip(path, parts, strict=True))


def _get(data: Any, path: tuple[str, ...]) -> Any:
    """The value at `path`, None where there is none."""
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
