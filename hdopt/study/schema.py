"""The sections a study file may have, and the checking of each with a message that names the place."""

from __future__ import annotations

from collections.abc import Container, Mapping
from importlib import import_module
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints  # Any: values of TOML, and annotations

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from hdopt.errors import HdoptError, unknown_name
from hdopt.study.base import Section
from hdopt.study.document import KIND_KEYS, Document, Keys

SECTIONS: dict[str, str] = {
    "study": "hdopt.study.drive:StudySection",
    "drive": "hdopt.study.drive:DriveSection",
    "wave_generator": "hdopt.study.drive:WaveGeneratorSection",
    "cs_teeth": "hdopt.study.drive:TeethSection",
    "fs_teeth": "hdopt.study.drive:TeethSection",
    "errors": "hdopt.study.drive:ErrorsSection",
    "effects": "hdopt.study.effects:EffectsSection",
    "operation": "hdopt.study.effects:OperationSection",
    "clearances": "hdopt.study.drive:ClearancesSection",
    "material": "hdopt.study.drive:MaterialSection",
    "load": "hdopt.study.drive:LoadSection",
    "tolerances": "hdopt.study.tolerances:TolerancesSection",
    "requirement": "hdopt.study.tolerances:RequirementSection",
    "contributors": "hdopt.study.tolerances:ContributorsSection",
    "linear_stack": "hdopt.study.tolerances:LinearStackSection",
    "allocate": "hdopt.study.costs:AllocateSection",
    "export": "hdopt.study.export:ExportSection",
    "search": "hdopt.study.search:SearchSection",
}
"""Section -> where its model is; a model is imported only when a study has the section."""

STEP_PACKAGES = ("hdopt.studies",)
"""Packages whose steps bring sections of their own: each has a table `SECTIONS` like the one above. They are asked only
about a section that the general schema does not have.
"""


def step_sections() -> dict[str, str]:
    """Section -> where its model is, of the sections that steps bring."""
    return {name: place for package in STEP_PACKAGES for name, place in import_module(package).SECTIONS.items()}


def section_model(name: str) -> type[Section]:
    """The model of the section `name`, imported now."""
    module, _, attribute = (SECTIONS.get(name) or step_sections()[name]).partition(":")
    found: type[Section] = getattr(import_module(module), attribute)
    return found


def known_paths(data: Mapping[str, Any], without: Container[str] = ()) -> set[Keys]:
    """The paths of all keys that a study with this `data` may have, but for the sections `without`. Where a table can
    be of several kinds, all keys of the kind that it says it is count, and of every kind where it says none."""
    found: set[Keys] = set()
    for name in (*SECTIONS, *(step_sections().keys() & data.keys())):
        if name != "study" and name not in without:
            found |= _paths(section_model(name), (name,), data.get(name))
    return found


ANY_NAME = "*"
"""Stands in a path for a name that the study makes up: a callout, a quantity that is limited, a dimension."""


def _paths(model: type[Section], path: Keys, content: Any) -> set[Keys]:
    found: set[Keys] = set()
    for name, field in model.model_fields.items():
        here = (*path, field.alias or name)
        value = content.get(here[-1]) if isinstance(content, Mapping) else None
        named, containers = _sections_in(field.annotation), _containers(field.annotation)
        found.add(here)
        if dict in containers:
            found |= _named_tables(named, here, value)
        elif list not in containers:
            for kind in _kinds(named, value):
                found |= _paths(kind, here, value)
    if model.__annotations__.get("__pydantic_extra__"):
        found |= _named_tables(_sections_in(get_type_hints(model)["__pydantic_extra__"]), path, content)
    return found


def _named_tables(kinds: list[type[Section]], path: Keys, content: Any) -> set[Keys]:
    """The paths in a table of tables whose names the study makes up: those that it has, and any other."""
    found: set[Keys] = set()
    for key, inner in {**(content if isinstance(content, Mapping) else {}), ANY_NAME: None}.items():
        found.add((*path, key))
        for kind in kinds:
            found |= _paths(kind, (*path, key), inner)
    return found


def _containers(annotation: Any) -> set[Any]:
    """`dict` and `list` where an annotation, or a part of its union, is one."""
    parts = get_args(annotation) if get_origin(annotation) in (Union, UnionType) else (annotation,)
    return {get_origin(part) for part in parts} & {dict, list}


def _sections_in(annotation: Any) -> list[type[Section]]:
    """The section models that an annotation names, unions, optional ones and containers opened."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return [annotation]
    return [model for part in get_args(annotation) for model in _sections_in(part)]


def _kinds(models: list[type[Section]], value: Any) -> list[type[Section]]:
    """Of the kinds of a table those that its own `value` says it is; all where it does not say."""
    said = {key: value[key] for key in KIND_KEYS if key in value} if isinstance(value, Mapping) else {}
    fitting = [
        model
        for model in models
        if all(
            key not in model.model_fields or x in get_args(model.model_fields[key].annotation)
            for key, x in said.items()
        )
    ]
    return fitting or models


def check_sections(document: Document) -> dict[str, Section]:
    """Every section of `document`, checked; unknown sections and keys are refused with the nearest known one."""
    checked: dict[str, Section] = {}
    for name, content in document.data.items():
        if name not in SECTIONS and name not in (brought := step_sections()):
            kind = "section" if isinstance(content, Mapping) else "key"
            raise HdoptError(f"{document.where((name,))}: {unknown_name(kind, name, (*SECTIONS, *brought))}")
        if not isinstance(content, Mapping):
            raise HdoptError(f"{document.where((name,))}: is {content!r}; write it as a table, [{name}]")
        try:
            checked[name] = section_model(name).model_validate(dict(content))
        except ValidationError as error:
            raise HdoptError(_describe(error, document, name)) from error
    return checked


def _describe(error: ValidationError, document: Document, section: str) -> str:
    """All faults of one section, a line each; unknown keys first, since a misspelt key is also a missing one."""
    faults = sorted(error.errors(), key=lambda fault: fault["type"] != "extra_forbidden")
    return "\n".join(dict.fromkeys(_fault(fault, document, section) for fault in faults))


def _fault(fault: ErrorDetails, document: Document, section: str) -> str:
    # Union members and discriminator tags stand in pydantic's path but not in the file's.
    path = (section, *(str(part) for part in _path_in_file(fault["loc"], document.data.get(section))))
    where = document.where(path)
    if fault["type"] == "extra_forbidden":
        known = _known_keys(section_model(section), path[1:-1])
        with_unit = [key for key in known if key.startswith(f"{path[-1]}_")]
        if len(with_unit) == 1:
            return f"{where}: unknown key {path[-1]!r}; write {with_unit[0]!r}, with its unit"
        return f"{where}: {unknown_name('key', path[-1], known) if known else 'unknown key'}"
    if fault["type"] == "union_tag_not_found":
        return f"{where}: does not say its {fault['ctx']['discriminator'].strip(chr(39))}; give it"
    if fault["type"] == "missing":
        return f"{where}: is missing; give it"
    if fault["type"] == "model_type":
        return f"{where}: is {fault['input']!r}; write it as a table, [{'.'.join(path)}]"
    message = fault["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
    value = fault["input"]
    if isinstance(value, Mapping):
        return f"{where}: {message}"
    if message[0].isupper():
        return f"{where}: {message}"
    return f"{where}: is {value!r}; it must be {message}"


def _known_keys(model: Any, path: Keys) -> tuple[str, ...]:
    """The keys that the table at `path` of a section may have; () where that depends on what else it says."""
    for part in path:
        field = {field.alias or name: field for name, field in model.model_fields.items()}.get(part)
        choices = () if field is None else (field.annotation, *get_args(field.annotation))
        tables = [choice for choice in choices if isinstance(choice, type) and issubclass(choice, Section)]
        if len(tables) != 1:
            return ()
        model = tables[0]
    return tuple(field.alias or name for name, field in model.model_fields.items())


def _path_in_file(location: tuple[Any, ...], content: Any) -> Keys:
    path = []
    for part in location:
        if isinstance(content, Mapping) and part in content:
            content = content[part]
        elif isinstance(content, list) and isinstance(part, int):
            content = content[part] if part < len(content) else None
        elif part is not location[-1]:
            continue
        path.append(part)
    return tuple(path)
