"""The study file as its schema has it: every section and key with kind, range, default and meaning.

`hdopt new` writes its comments from this, and the documentation its page on the study file: neither can lag.
"""

from __future__ import annotations

import ast
import inspect
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any  # Any: JSON schema and defaults of any type

from pydantic_core import PydanticUndefined

from hdopt.drive.errors import STUDY_KEYS, DriveErrors
from hdopt.geometry.options import RULES, ExportOptions
from hdopt.report.cells import UNITS
from hdopt.study.base import Section
from hdopt.study.schema import SECTIONS, containers, section_model, sections_in

KIND_WORDS = {"integer": "whole number", "number": "number", "string": "text", "boolean": "true or false"}


@dataclass(frozen=True)
class KeyReference:
    """One key: its name in the file, what may stand there in words, its unit ('' for none), what holds where it is left
    out ('' where it must be given), and what it means."""

    key: str
    allowed: str
    unit: str
    default: str
    required: bool
    meaning: str


@dataclass(frozen=True)
class TableReference:
    """One table of a study: how its header or its place is written, what it is for, and its keys."""

    name: str
    says: str
    keys: tuple[KeyReference, ...]


def section_reference(name: str) -> tuple[TableReference, ...]:
    """The section `name`, and after it each table that may stand in it."""
    return _tables(section_model(name), name, set())


def study_reference() -> dict[str, tuple[TableReference, ...]]:
    """Section -> its tables, in the order in which a study is best written."""
    return {name: section_reference(name) for name in SECTIONS if name != "effects"}


def _tables(model: type[Section], name: str, seen: set[type[Section]]) -> tuple[TableReference, ...]:
    if model in seen:
        return ()
    seen.add(model)
    keys = tuple(_key(model, field) for field in model.model_fields)
    found = [TableReference(name, _says(model), keys)]
    for field, info in model.model_fields.items():
        inner = sections_in(info.annotation)
        place = f"{name}.{info.alias or field}" + (".NAME" if dict in containers(info.annotation) else "")
        for kind in inner:
            found += _tables(kind, place if len(inner) == 1 else f"{_kind_of(kind)}", seen)
    for kind in _made_up(model):
        found += _tables(kind, f"{name}.NAME", seen)
    return tuple(found)


def _made_up(model: type[Section]) -> list[type[Section]]:
    """The tables of a section whose names the study makes up."""
    if not model.__annotations__.get("__pydantic_extra__"):
        return []
    from typing import get_type_hints

    return sections_in(get_type_hints(model)["__pydantic_extra__"])


def _kind_of(model: type[Section]) -> str:
    """'distribution = "normal"' of a table that says what it is."""
    for key in ("distribution", "model"):
        if key in model.model_fields:
            return f'{key} = "{_schema(model)["properties"][key]["const"]}"'
    return model.__name__


def _says(model: type[Section]) -> str:
    """What a table is for: its own docstring, or of one kind of several what that kind means."""
    for key in ("distribution", "model"):
        if model.__doc__ is None and key in model.model_fields:
            return meaning_of(model, key)
    return " ".join((inspect.getdoc(model) or "").split())


@cache
def _schema(model: type[Section]) -> Mapping[str, Any]:
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a default of infinity is no JSON; it is told below
        return model.model_json_schema(by_alias=True)


def _key(model: type[Section], field: str) -> KeyReference:
    info = model.model_fields[field]
    key = info.alias or field
    schema = _schema(model)
    return KeyReference(
        key,
        _allowed(schema["properties"][key], schema.get("$defs", {})),
        unit_of(key),
        _default(info.default, info.default_factory),
        info.is_required(),
        meaning_of(model, field),
    )


def unit_of(key: str) -> str:
    """The unit that ends the name of a `key`; '' where it has none."""
    endings = [ending for ending in UNITS if key.endswith(f"_{ending}")]
    return UNITS[max(endings, key=len)] if endings else ""


def _allowed(property_: Mapping[str, Any], tables: Mapping[str, Any]) -> str:
    """What may stand under a key, in words."""
    if "const" in property_:
        return f'"{property_["const"]}"'
    if "enum" in property_:
        return ", ".join(f'"{choice}"' for choice in property_["enum"])
    if "$ref" in property_:
        table = tables[property_["$ref"].rpartition("/")[2]]
        return _allowed(table, tables) if "enum" in table else "a table"
    for union in ("anyOf", "oneOf"):
        if union in property_:
            parts = [_allowed(part, tables) for part in property_[union] if part.get("type") != "null"]
            return " or ".join(dict.fromkeys(parts))
    if property_.get("type") == "array":
        return f"list of: {_allowed(property_.get('items', {}), tables)}"
    if property_.get("type") == "object" or "properties" in property_:
        return "tables by name" if "additionalProperties" in property_ and "properties" not in property_ else "a table"
    return KIND_WORDS.get(property_.get("type", ""), "a value") + _range(property_)


def _range(property_: Mapping[str, Any]) -> str:
    words = {
        "exclusiveMinimum": "above",
        "minimum": "from",
        "exclusiveMaximum": "below",
        "maximum": "up to",
    }
    said = [f"{word} {property_[key]:g}" for key, word in words.items() if key in property_]
    return f", {' '.join(said)}" if said else ""


def _default(default: Any, factory: Any) -> str:
    if factory is not None:
        default = factory()
    if default is PydanticUndefined or default is None or isinstance(default, Section):
        return ""
    if isinstance(default, float) and not math.isfinite(default):
        return "none"
    if isinstance(default, bool):
        return str(default).lower()
    if isinstance(default, str):
        return f'"{default}"'
    if isinstance(default, list):
        return "[" + ", ".join(_default(item, None) for item in default) + "]"
    return f"{default:g}" if isinstance(default, float) else str(default)


def meaning_of(model: type[Section], field: str) -> str:
    """What the `field` of a section's `model` means: its docstring, or that of the record that it fills."""
    for base in model.__mro__:
        if base.__module__.startswith("hdopt") and (said := attribute_docstrings(base).get(field)):
            return said
    if field in STUDY_KEYS:
        return attribute_docstrings(DriveErrors)[STUDY_KEYS[field]]
    if field in RULES:
        return f"If omitted: {RULES[field]}."
    return attribute_docstrings(ExportOptions).get(field, "")


@cache
def attribute_docstrings(record: type) -> Mapping[str, str]:
    """Field -> the docstring under it, of the class `record`, on one line each; {} for one made by a program."""
    try:
        tree = ast.parse(Path(inspect.getfile(record)).read_text(encoding="utf-8"))
    except (OSError, TypeError):
        return {}
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and node.name == record.__name__:
            return {
                field.target.id: " ".join(said.value.value.split())
                for field, said in zip(node.body, node.body[1:], strict=False)
                if isinstance(field, ast.AnnAssign)
                and isinstance(field.target, ast.Name)
                and isinstance(said, ast.Expr)
                and isinstance(said.value, ast.Constant)
                and isinstance(said.value.value, str)
            }
    return {}
