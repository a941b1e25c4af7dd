"""The sections a study file may have, and the checking of each with a message that names the place."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any, get_args

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from hdopt.errors import HdoptError, unknown_name
from hdopt.study.base import Section
from hdopt.study.document import Document, Keys

SECTIONS: dict[str, str] = {
    "study": "hdopt.study.drive:StudySection",
    "drive": "hdopt.study.drive:DriveSection",
    "wave_generator": "hdopt.study.drive:WaveGeneratorSection",
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
    "concealed": "hdopt.study.concealed:ConcealedSection",
    "residuals": "hdopt.study.residuals:ResidualsSection",
    "search": "hdopt.study.search:SearchSection",
}
"""Section -> where its model is; a model is imported only when a study has the section."""


def section_model(name: str) -> type[Section]:
    """The model of a section, imported now."""
    module, _, attribute = SECTIONS[name].partition(":")
    return getattr(import_module(module), attribute)


def check_sections(document: Document) -> dict[str, Section]:
    """Every section of `document`, checked; unknown sections and keys are refused with the nearest known one."""
    checked: dict[str, Section] = {}
    for name, content in document.data.items():
        if name not in SECTIONS:
            kind = "section" if isinstance(content, Mapping) else "key"
            raise HdoptError(f"{document.where((name,))}: {unknown_name(kind, name, SECTIONS)}")
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
        field = model.model_fields.get(part)
        choices = () if field is None else (field.annotation, *get_args(field.annotation))
        tables = [choice for choice in choices if isinstance(choice, type) and issubclass(choice, Section)]
        if len(tables) != 1:
            return ()
        model = tables[0]
    return tuple(model.model_fields)


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
