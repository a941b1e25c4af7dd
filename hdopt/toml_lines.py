"""On which lines of a TOML text its keys stand, for the messages that point there."""

from __future__ import annotations

import re
from collections.abc import Mapping

Keys = tuple[str, ...]

LONGEST_HEAD = 1000
"""Letters of a line that are searched for its key."""
DEEPEST_PART = 16
"""Levels of a dotted key that are found singly: more than any file of hdopt has."""

_TABLE = re.compile(r"^\s*\[\[?\s*([^\]]+?)\s*\]\]?\s*(#.*)?$")
_PART = re.compile(r"\"[^\"]*\"|'[^']*'|[^.]+")
_KEY = re.compile(r"^\s*((?:\"[^\"]*\"|'[^']*'|[A-Za-z0-9_.-])+)\s*=")
_ENDLESS = re.compile(r"^\s*(\[\[?)?\s*((?:\"[^\"]*\"|'[^']*'|[A-Za-z0-9_.-])+)")
"""What a line begins with whose key does not end within its head."""


def key_lines(text: str) -> dict[Keys, int]:
    """Line of every table header and of every key that starts a line of the TOML `text`, and of the tables that stand
    nowhere but in the dotted keys of others: the first of these."""
    lines: dict[Keys, int] = {}
    within: dict[Keys, int] = {}
    table: Keys = ()
    for number, whole in enumerate(text.split("\n"), 1):
        line = whole[:LONGEST_HEAD]
        if header := _TABLE.match(line):
            path = table = _split(header.group(1))
        elif key := _KEY.match(line):
            path = table + _split(key.group(1))
        elif len(whole) > LONGEST_HEAD and (begun := _ENDLESS.match(line)):
            path = (() if begun.group(1) else table) + _split(begun.group(2))
            table = path if begun.group(1) else table
        else:
            continue
        lines.setdefault(path, number)
        for depth in range(1, min(len(path), DEEPEST_PART)):
            within.setdefault(path[:depth], number)
    return {**within, **lines}


def closest_line(lines: Mapping[Keys, int], path: Keys) -> int:
    """Of `lines`, as `key_lines` gives them, that of the key `path`, else of what it stands in, else the first."""
    return next((lines[path[:depth]] for depth in range(len(path), 0, -1) if path[:depth] in lines), 1)


def first_too_deep(data: Mapping[str, object], levels: int) -> Keys | None:
    """The first key of parsed TOML `data` that lies deeper than so many `levels` of tables and arrays, None where none
    does: what code that calls itself for every level, `repr` with it, cannot go down."""
    todo: list[tuple[Keys, object]] = [((), data)]
    while todo:
        path, value = todo.pop()
        if len(path) > levels:
            return path
        if isinstance(value, Mapping):
            todo += [((*path, key), item) for key, item in value.items()]
        elif isinstance(value, list):
            todo += [((*path, str(number)), item) for number, item in enumerate(value)]
    return None


def _split(dotted: str) -> Keys:
    return tuple(part.strip().strip("\"'") for part in _PART.findall(dotted))
