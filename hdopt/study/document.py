"""The study file as text: parsed TOML, where each key stands in it, and the merging and setting of keys."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hdopt.errors import HdoptError

Keys = tuple[str, ...]

SET_ON_COMMAND_LINE = 0
"""Stands for the line of a key that --set gave."""

_TABLE = re.compile(r"^\s*\[\[?\s*([^\]]+?)\s*\]\]?\s*(#.*)?$")
_KEY = re.compile(r"^\s*((?:\"[^\"]*\"|'[^']*'|[A-Za-z0-9_.-])+)\s*=")


@dataclass(frozen=True)
class Document:
    """A parsed study file: its nested `data`, and the `source` and `lines` that messages point to."""

    data: Mapping[str, Any]
    source: str
    lines: Mapping[Keys, int]

    def where(self, path: Keys) -> str:
        """'FILE, line N, a.b': the closest place in the file to the key `path`."""
        if self.lines.get(path) == SET_ON_COMMAND_LINE:
            return f"--set {'.'.join(path)}"
        for depth in range(len(path), 0, -1):
            if self.lines.get(path[:depth], SET_ON_COMMAND_LINE) != SET_ON_COMMAND_LINE:
                return f"{self.source}, line {self.lines[path[:depth]]}, {'.'.join(path)}"
        return f"{self.source}, {'.'.join(path)}" if path else self.source


def read_document(path: Path) -> Document:
    """Read and parse a TOML file; every failure is one sentence with the place."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise HdoptError(
            f"{path} is not a text file (byte {error.start} is not UTF-8); give a TOML study file"
        ) from error
    except OSError as error:
        raise HdoptError(f"cannot read {path}: {error.strerror}; give an existing TOML study file") from error
    return parse_document(text, str(path))


def parse_document(text: str, source: str) -> Document:
    """Parse TOML `text`; `source` names it in messages."""
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise HdoptError(f"{source} is not valid TOML: {error}") from error
    return Document(data, source, _key_lines(text))


def _key_lines(text: str) -> dict[Keys, int]:
    """Line of every table header and of every key that starts a line."""
    lines: dict[Keys, int] = {}
    table: Keys = ()
    for number, line in enumerate(text.splitlines(), 1):
        if header := _TABLE.match(line):
            table = _split(header.group(1))
            lines.setdefault(table, number)
        elif key := _KEY.match(line):
            lines.setdefault(table + _split(key.group(1)), number)
    return lines


def _split(dotted: str) -> Keys:
    return tuple(part.strip().strip("\"'") for part in dotted.split("."))


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
    """Paths of all values that are not tables."""
    for key, value in data.items():
        if isinstance(value, Mapping):
            yield from leaves(value, (*path, key))
        else:
            yield (*path, key)


def set_value(data: dict[str, Any], path: Keys, value: Any) -> None:
    """Set one key, making the tables on the way."""
    for part in path[:-1]:
        data = data.setdefault(part, {})
    data[path[-1]] = value


def parse_value(text: str) -> Any:
    """A value as TOML writes it; what is not TOML is taken as a string."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text
