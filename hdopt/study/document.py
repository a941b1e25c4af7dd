"""The study file as text: parsed TOML, where each key stands in it, and the merging and setting of keys."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any  # Any: what a study file holds, of TOML's several kinds

from hdopt.errors import HdoptError, shown
from hdopt.files import line_of, line_of_depth, read_text
from hdopt.study.toml_faults import why_no_toml
from hdopt.toml_lines import Keys, key_lines

SET_ON_COMMAND_LINE = 0
"""Stands for the line of a key that --set, or `Study.with_`, gave."""

DEEPEST = 12
"""Levels of tables and arrays; the deepest study that ships has five."""
LONGEST_KEY = 200
LARGEST_INTEGER = 2**63 - 1


@dataclass(frozen=True)
class Document:
    """A parsed study file: its nested `data`, and the `source` and `lines` that messages point to; `texts` are those of
    the files that it was read from, what lies below first. `set_by` is what keys without a line were set by. What the
    file does not give stands as in `beneath`, the data of the `shipped` drive that it starts from; "" for none."""

    data: Mapping[str, Any]
    source: str
    lines: Mapping[Keys, int]
    texts: tuple[str, ...] = ()
    set_by: str = "--set"
    shipped: str = ""
    beneath: Mapping[str, Any] = field(default_factory=dict)

    def where(self, path: Keys) -> str:
        """'FILE, line N, a.b': the closest place in the file to the key `path`, or what set it or all in it."""
        if path not in self.lines and (made := self.made_by(path)):
            return f"{self.set_by} {' with '.join('.'.join(one) for one in made)}"
        for depth in range(len(path), 0, -1):
            line = self.lines.get(path[:depth])
            if line == SET_ON_COMMAND_LINE:
                return f"{self.set_by} {'.'.join(path)}"
            if line is not None:
                return f"{self.source}, line {line}, {'.'.join(path)}"
        return f"{self.source}, {'.'.join(path)}" if path else self.source

    def made_by(self, table: Keys) -> list[Keys]:
        """The keys that were set, where all that the `table` holds is what they set; [] where the file has a part."""
        held: Any = self.data
        for part in table:
            held = held.get(part) if isinstance(held, Mapping) else None
        if not isinstance(held, Mapping):
            return []
        found = {path[:depth] for path in leaves(held, table) for depth in (self._set_depth(path),)}
        return sorted(found) if () not in found else []

    def kept_of_shipped(self, section: str) -> dict[str, Any]:
        """What stays of the shipped drive's `section` beside what the file gives there itself; {} where it gives
        nothing."""
        below = self.beneath.get(section)
        given = any(path[0] == section and line != SET_ON_COMMAND_LINE for path, line in self.lines.items())
        if not given or not isinstance(below, Mapping):
            return {}
        return {key: value for key, value in below.items() if not any(p[:2] == (section, key) for p in self.lines)}

    def _set_depth(self, path: Keys) -> int:
        """How many parts of `path` name what set it; 0 where the file holds it."""
        known = (depth for depth in range(len(path), 0, -1) if path[:depth] in self.lines)
        depth = next(known, 0)
        return depth if self.lines.get(path[:depth]) == SET_ON_COMMAND_LINE else 0


def read_document(path: Path) -> Document:
    """Read and parse the TOML file `path`; every failure is one sentence with the place."""
    return parse_document(read_text(path, "an existing TOML study file"), str(path))


def parse_document(text: str, source: str) -> Document:
    """Parse TOML `text`; `source` names it in messages."""
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise HdoptError(f"{source} {why_no_toml(error, text)}") from error
    except RecursionError as error:
        place = f"{source}, line {line_of_depth(text)}"
        raise HdoptError(f"{place}: is nested too deeply; a study has {DEEPEST} levels at most") from error
    except ValueError as error:  # Python refuses integers of more than 4300 digits
        digits = re.search(r"\d{4300}", text)
        place = f"{source}, line {line_of(text, digits.group() if digits else '')}"
        raise HdoptError(f"{place}: holds an integer of more than 4300 digits; TOML allows 64 bits") from error
    document = Document(data, source, key_lines(text), (text,))
    _check_size(document)
    return document


def _check_size(document: Document) -> None:
    """Refuse what no study needs and other code trips over: deep nesting, integers beyond 64 bits, endless names."""
    todo: list[tuple[Keys, Any]] = [((), document.data)]
    while todo:
        path, value = todo.pop()
        if len(path) > DEEPEST:
            raise HdoptError(
                f"{document.where(path[:3])}: is nested {len(path)} levels deep; a study has {DEEPEST} levels at most"
            )
        if path and len(path[-1]) > LONGEST_KEY:
            place = f"{document.source}, line {line_of(document.texts[-1], path[-1])}"
            raise HdoptError(f"{place}: has a name of {len(path[-1])} letters; at most {LONGEST_KEY} are allowed")
        if isinstance(value, int) and abs(value) > LARGEST_INTEGER:
            raise HdoptError(f"{document.where(path)}: is an integer of {len(hex(value)) * 4} bits; TOML allows 64")
        if isinstance(value, Mapping):
            todo += [((*path, key), item) for key, item in value.items()]
        elif isinstance(value, list):
            todo += [((*path, str(number)), item) for number, item in enumerate(value)]


KIND_KEYS = ("distribution", "model", "callout")
"""Keys that say what a table is; the keys beside them depend on it."""


def merge(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """`base` with the keys of `changes` in place of its own, table by table; neither is changed.

    A table that says what it is (a distribution, a cost model) takes the place of the other one whole: half of one
    distribution's parameters and half of another's make neither.
    """
    merged = deepcopy(dict(base))
    for key, value in changes.items():
        says_kind = isinstance(value, Mapping) and any(kind in value for kind in KIND_KEYS)
        if isinstance(value, Mapping) and isinstance(merged.get(key), Mapping) and not says_kind:
            merged[key] = merge(merged[key], value)
        else:
            merged[key] = deepcopy(value)
    return merged


def leaves(data: Mapping[str, Any], path: Keys = ()) -> Iterator[Keys]:
    """Paths of all values in `data` that are not tables, each after `path`."""
    for key, value in data.items():
        if isinstance(value, Mapping):
            yield from leaves(value, (*path, key))
        else:
            yield (*path, key)


def set_value(data: dict[str, Any], path: Keys, value: Any) -> None:
    """Set the key at `path` of `data` to `value`, making the tables on the way."""
    for part in path[:-1]:
        data = data.setdefault(part, {})
    data[path[-1]] = value


def parse_value(text: str) -> Any:
    """The value that `text` is in TOML; what is not TOML is taken as a string."""
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return text
    if isinstance(value, int) and abs(value) > LARGEST_INTEGER:
        raise HdoptError(f"the value {shown(text)} is an integer of {len(text)} digits; TOML allows 64 bits")
    return value
