"""The checking of a study's sections: what is wrong with them, in the words of whoever wrote the file."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, get_args  # Any: parsed TOML and annotations

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from hdopt.errors import HdoptError, IncompleteStudy, unknown_name
from hdopt.study.base import Section
from hdopt.study.document import Document, leaves
from hdopt.study.nearest import unknown_key
from hdopt.study.schema import ANY_NAME, SECTIONS, known_paths, section_model, step_sections
from hdopt.toml_lines import Keys
from hdopt.words import counted

KINDS = {
    "model_type": "a table",
    "model_attributes_type": "a table",
    "dict_type": "a table",
    "list_type": "a list, in square brackets",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "string_type": "a text, in quotation marks",
    "bool_type": "true or false",
    "finite_number": "a finite number",
}
"""Type of a fault in pydantic's terms -> what should stand there instead."""
DECIMAL_COMMA = re.compile(r"\s*([+-]?\d+),(\d+)\s*")
PER_CENT_FROM = 2
"""A share from here to 100 is one in per cent; just above 1 it may as well be too large."""
WITH_UNIT = re.compile(r"\s*([+-]?\d+(?:\.\d+)?)\s*([A-Za-zµ°]+)\s*")


def check_sections(document: Document) -> dict[str, Section]:
    """Every section of `document`, checked; unknown sections and keys are refused with the nearest known one.

    Raises `IncompleteStudy` where keys are missing and nothing else is wrong, `HdoptError` with all faults otherwise.
    """
    checked: dict[str, Section] = {}
    faulty: dict[str, ValidationError] = {}
    for name, content in document.data.items():
        if name not in SECTIONS and name not in (brought := step_sections()):
            kind = "section" if isinstance(content, Mapping) else "key"
            raise HdoptError(f"{document.where((name,))}: {unknown_name(kind, name, (*SECTIONS, *brought))}")
        if not isinstance(content, Mapping):
            raise HdoptError(f"{document.where((name,))}: is {content!r}; write it as a table, [{name}]")
        try:
            checked[name] = section_model(name).model_validate(dict(content))
        except ValidationError as error:
            faulty[name] = error
    if faulty:
        raise _refusal(faulty, document)
    return checked


def _refusal(faulty: Mapping[str, ValidationError], document: Document) -> HdoptError:
    """The one error that says what is wrong with the `faulty` sections of `document`.

    Unknown keys come first, since a misspelt key is also a missing one; all that is missing stands in one line.
    """
    faults = [(name, fault) for name, error in faulty.items() for fault in error.errors()]
    missing = [(name, fault) for name, fault in faults if fault["type"] == "missing"]
    wrong = [(name, fault) for name, fault in faults if fault["type"] != "missing"]
    wrong.sort(key=lambda item: item[1]["type"] != "extra_forbidden")
    lines = list(dict.fromkeys(_fault(fault, document, name) for name, fault in wrong))
    paths = [_path(fault, document, name) for name, fault in missing]
    if any(path[0] == "drive" for path in paths):
        paths += _also_needed(document)
    lines += _missing_line(paths, document)
    message = "\n".join(lines)
    return HdoptError(message) if wrong else IncompleteStudy(message, [".".join(path) for path in paths])


def _also_needed(document: Document) -> list[Keys]:
    """What a new drive needs besides [drive], where its file does not have it: said at once, not at the next try."""
    if "wave_generator" in document.data:
        return []
    model = section_model("wave_generator")
    return [("wave_generator", name) for name, field in model.model_fields.items() if field.is_required()]


def _missing_line(paths: Sequence[Keys], document: Document) -> list[str]:
    """What is said of the missing keys at `paths`: of those that a set key asks for, then of the others in one line."""
    asked: dict[tuple[Keys, ...], list[Keys]] = {}
    for path in paths:
        asked.setdefault(tuple(document.made_by(path[:-1])), []).append(path)
    paths = asked.pop((), [])
    lines = [_asked_line(by, needed, document) for by, needed in asked.items()]
    return lines + _missing_in_file(paths, document)


def _asked_line(by: Sequence[Keys], needed: Sequence[Keys], document: Document) -> str:
    """What is said where the keys `by` were set, and nothing of what they need beside them stands in the file."""
    keys = ", ".join(".".join(path) for path in needed)
    meant = [".".join(found) for path in by if (found := _likely_meant(path, document))]
    other = f", unless you meant {' or '.join(meant)}" if meant else ""
    place = " with ".join(".".join(path) for path in by)
    return f"{document.set_by} {place}: needs {keys} too, which the study does not give; give {_it(needed)}{other}"


def _it(things: Sequence[object]) -> str:
    return "it" if len(things) == 1 else "them"


def _likely_meant(path: Keys, document: Document) -> Keys | None:
    """The one key that the study writes straight in another section and that the words of the key at `path` name."""
    words = set(path[-1].split("_"))
    named = [
        written
        for written in leaves(document.data)
        if len(written) == 2 and written[0] != path[0] and set(written[1].split("_")) <= words
    ]
    return named[0] if len(named) == 1 else None


def _missing_in_file(paths: Sequence[Keys], document: Document) -> list[str]:
    if not paths:
        return []
    if len(paths) == 1:
        return [f"{document.where(paths[0])}: is missing; give it"]
    keys = ", ".join(".".join(path) for path in paths)
    whole = "'hdopt new NAME' writes a whole study"
    return [f"{document.source}: {counted(len(paths), 'key is', 'keys are')} missing: {keys}; give them ({whole})"]


def _path(fault: ErrorDetails, document: Document, section: str) -> Keys:
    """Where a fault stands: union members and tags stand in pydantic's path but not in the file's."""
    return (section, *(str(part) for part in _path_in_file(fault["loc"], document.data.get(section))))


def _fault(fault: ErrorDetails, document: Document, section: str) -> str:
    path = _path(fault, document, section)
    where = document.where(path)
    kind, value = fault["type"], fault["input"]
    if kind == "extra_forbidden":
        known = _known_keys(section_model(section), path[1:-1]) or _keys_of_its_kind(document, path)
        return f"{where}: {unknown_key(path[-1], known, _elsewhere(document, path))}"
    if kind == "union_tag_not_found":
        return f"{where}: does not say its {_tag(fault)}; give it"
    if kind == "union_tag_invalid":
        choices = fault["ctx"]["expected_tags"].replace("'", "")
        where = document.where((*path, _tag(fault)))
        return f"{where}: is {fault['ctx']['tag']!r}; it must be one of {choices}"
    if kind in ("model_type", "model_attributes_type") and not isinstance(value, Mapping):
        return f"{where}: is {value!r}; {_as_table(path)}"
    hint = _number_hint(value) if kind in ("float_type", "int_type", "float_parsing", "int_parsing") else None
    if hint is not None:
        return f"{where}: is {value!r}; {hint}"
    if kind in ("less_than", "less_than_equal") and 1 in fault["ctx"].values() and PER_CENT_FROM <= value <= 100:
        return f"{where}: is {value!r}, in per cent as it seems; it is a share: write {value / 100:.6g}"
    if kind in KINDS:
        return f"{where}: is {value!r}; it must be {KINDS[kind]}"
    message = fault["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
    if isinstance(value, Mapping) or message[0].isupper():
        # A value of --set stands in the table that was given as one.
        return f"{where}: {message}" if where.endswith(path[-1]) else f"{where}, {path[-1]}: {message}"
    return f"{where}: is {value!r}; it must be {message}"


def _tag(fault: ErrorDetails) -> str:
    """The key that says which kind of table one is."""
    return str(fault["ctx"]["discriminator"]).strip("'")


def _as_table(path: Keys) -> str:
    """How a table is written where something else stands."""
    if path[:2] == ("search", "limits") and len(path) == 3:
        return "give its bound as a table, such as { max = 60 }"
    if path[0] == "tolerances" and len(path) == 2:
        return 'give its distribution, as in { distribution = "normal", std = 0.03, lower = -0.1, upper = 0.1 }'
    return f"write it as a table, [{'.'.join(path)}]"


def _number_hint(value: Any) -> str | None:
    """What to write instead of a text that was meant as a number; None where that cannot be told."""
    if not isinstance(value, str):
        return None
    if comma := DECIMAL_COMMA.fullmatch(value):
        return f"a decimal point is needed, not a comma: {comma[1]}.{comma[2]}"
    if unit := WITH_UNIT.fullmatch(value):
        return f"a number stands alone, {unit[1]}, in the unit that ends the key's name"
    return None


def _elsewhere(document: Document, path: Keys) -> list[Keys]:
    """The sections one level up that have the key at the end of `path`."""
    paths = known_paths(document.data, without=("effects",))
    return sorted(found for found in paths if found[-1] == path[-1] and len(found) == 2)


def _known_keys(model: Any, path: Keys) -> tuple[str, ...]:
    """The keys that the table at `path` of a section may have; () where that depends on its kind."""
    for part in path:
        if part.isdecimal():  # a place in a list, of which all rows are alike
            continue
        field = {field.alias or name: field for name, field in model.model_fields.items()}.get(part)
        choices = () if field is None else (field.annotation, *get_args(field.annotation))
        tables = [choice for choice in choices if isinstance(choice, type) and issubclass(choice, Section)]
        if len(tables) != 1:
            return ()
        model = tables[0]
    return tuple(field.alias or name for name, field in model.model_fields.items())


def _keys_of_its_kind(document: Document, path: Keys) -> tuple[str, ...]:
    """The keys beside that at the end of `path` that a table may have which says what kind it is."""
    paths = known_paths(document.data)
    return tuple(sorted(found[-1] for found in paths if found[:-1] == path[:-1] and found[-1] != ANY_NAME))


def _path_in_file(location: tuple[Any, ...], content: Any) -> Keys:
    path = []
    if location and location[-1] == "[key]":  # pydantic's word for the name itself, which stands before it
        location = location[:-1]
    for part in location:
        if isinstance(content, Mapping) and part in content:
            content = content[part]
        elif isinstance(content, list) and isinstance(part, int):
            content = content[part] if part < len(content) else None
        elif part is not location[-1]:
            continue
        path.append(part)
    return tuple(path)
