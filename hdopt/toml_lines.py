"""On which lines of a TOML text its keys stand, for the messages that point there."""

from __future__ import annotations

import re
from collections.abc import Mapping

Keys = tuple[str, ...]

LONGEST_HEAD = 1000
"""Letters of a line that are searched for its key."""

_TABLE = re.compile(r"^\s*\[\[?\s*([^\]]+?)\s*\]\]?\s*(#.*)?$")
_PART = re.compile(r"\"[^\"]*\"|'[^']*'|[^.]+")
_KEY = re.compile(r"^\s*((?:\"[^\"]*\"|'[^']*'|[A-Za-z0-9_.-])+)\s*=")


def key_lines(text: str) -> dict[Keys, int]:
    """Line of every table header and of every key that starts a line of the TOML `text`."""
    lines: dict[Keys, int] = {}
    table: Keys = ()
    for number, whole in enumerate(text.split("\n"), 1):
        line = whole[:LONGEST_HEAD]
        if header := _TABLE.match(line):
            table = _split(header.group(1))
            lines.setdefault(table, number)
        elif key := _KEY.match(line):
            lines.setdefault(table + _split(key.group(1)), number)
    return lines


def closest_line(lines: Mapping[Keys, int], path: Keys) -> int:
    """Of `lines`, as `key_lines` gives them, that of the key `path`, else of what it stands in, else the first."""
    return next((lines[path[:depth]] for depth in range(len(path), 0, -1) if path[:depth] in lines), 1)


def _split(dotted: str) -> Keys:
    return tuple(part.strip().strip("\"'") for part in _PART.findall(dotted))
