"""A study as TOML text: what is written here reads back as the same study (tomlkit quotes and escapes)."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any  # Any: what a study file holds, of TOML's several kinds

import tomlkit
from tomlkit.items import InlineTable, Item, Table

PATH_KEY = "file"
"""The key under which sections name a file, relative to the study's own."""

Comments = Mapping[tuple[str, ...], Iterable[str]]


def study_toml(data: Mapping[str, Any], head: Iterable[str] = (), comments: Comments | None = None) -> str:
    """Text of a study file with the sections and keys of `data`; keys whose value is None are left out.

    `head` are comment lines at the beginning. `comments` are lines by place: under the header of a table, or at the end
    of a key's line, and at the end of the file under (). Line breaks in comments become blanks.
    """
    comments = comments or {}
    document = tomlkit.document()
    for line in head:
        document.add(tomlkit.comment(_one_line(line)))
    for key, value in data.items():
        if value is not None and not isinstance(value, Mapping):
            document.add(key, tomlkit.item(value))
    for key, value in data.items():
        if isinstance(value, Mapping):
            document.add(key, _table(value, (key,), comments))
    for line in comments.get((), ()):
        document.add(tomlkit.nl())
        document.add(tomlkit.comment(_one_line(line)))
    return tomlkit.dumps(document)


def _table(content: Mapping[str, Any], path: tuple[str, ...], comments: Comments) -> Table:
    """A section; in [effects], each effect is a table of its own, elsewhere inner tables stand on one line."""
    table = tomlkit.table(is_super_table=path == ("effects",))
    for line in comments.get(path, ()):
        table.add(tomlkit.comment(_one_line(line)))
    for key, value in content.items():
        if value is None:
            continue
        if path == ("effects",) and isinstance(value, Mapping):
            table.add(key, _table(value, (*path, key), comments))
            continue
        item = _item(value)
        for line in comments.get((*path, key), ()):
            item.comment(_one_line(line))
        table.add(key, item)
    return table


def _item(value: Any) -> Item:
    if isinstance(value, Mapping):
        inline: InlineTable = tomlkit.inline_table()
        for key, inner in value.items():
            if inner is not None:
                inline.add(key, _item(inner))
        return inline
    if isinstance(value, list | tuple):
        array = tomlkit.array()
        for inner in value:
            array.append(_item(inner))
        return array
    item: Item = tomlkit.item(value)
    return item


def _one_line(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text)


def with_moved_paths(data: Mapping[str, Any], old: Path, new: Path | None = None) -> dict[str, Any]:
    """`data` of a study in the folder `old`, with every file that it names said relative to the folder `new`; absolute
    where `new` is None."""

    def moved(value: Any) -> Any:
        if isinstance(value, Mapping):
            return {key: _moved_path(inner) if _is_path(key, inner) else moved(inner) for key, inner in value.items()}
        if isinstance(value, list | tuple):
            return [moved(inner) for inner in value]
        return value

    def _moved_path(file: str) -> str:
        whole = os.path.abspath(old / file)
        return whole if new is None or os.path.isabs(file) else os.path.relpath(whole, os.path.abspath(new))

    def _is_path(key: str, value: Any) -> bool:
        return key == PATH_KEY and isinstance(value, str)

    result: dict[str, Any] = moved(data)
    return result
