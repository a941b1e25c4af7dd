"""A study as TOML text: what is written here reads back as the same study (tomlkit quotes and escapes)."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any  # Any: what a study file holds, of TOML's several kinds

import tomlkit
from tomlkit.items import InlineTable, Item, Table

PATH_KEY = "file"
"""The key under which sections name a file, relative to the study's own."""

Comments = Mapping[tuple[str, ...], Iterable[str]]


def study_toml(
    data: Mapping[str, Any],
    head: Iterable[str] = (),
    comments: Comments | None = None,
    above: Comments | None = None,
) -> str:
    """Text of a study file with the sections and keys of `data`; keys whose value is None are left out.

    `head` are comment lines at the beginning. `comments` are lines by place: under the header of a table, or at the end
    of a key's line, and at the end of the file under (); those of `above` stand in lines before a key, or under the
    header. Line breaks in comments become blanks.
    """
    notes = _Notes(comments or {}, above or {})
    document = tomlkit.document()
    for line in head:
        document.add(tomlkit.comment(_one_line(line)))
    for key, value in data.items():
        if value is not None and not isinstance(value, Mapping):
            document.add(key, tomlkit.item(value))
    for key, value in data.items():
        if isinstance(value, Mapping):
            document.add(key, _table(value, (key,), notes))
    for line in (*notes.beside.get((), ()), *notes.above.get((), ())):
        document.add(tomlkit.nl())
        document.add(tomlkit.comment(_one_line(line)))
    return tomlkit.dumps(document)


@dataclass(frozen=True)
class _Notes:
    """Comments by place, `beside` and `above` it."""

    beside: Comments
    above: Comments


def _add_lines(place: Table, lines: Iterable[str]) -> None:
    for line in lines:
        place.add(tomlkit.comment(_one_line(line)))


def _table(content: Mapping[str, Any], path: tuple[str, ...], notes: _Notes) -> Table:
    """A section; in [effects], each effect is a table of its own, elsewhere inner tables stand on one line."""
    table = tomlkit.table(is_super_table=path == ("effects",))
    _add_lines(table, (*notes.above.get(path, ()), *notes.beside.get(path, ())))
    for key, value in content.items():
        if value is None:
            continue
        place = (*path, key)
        if path == ("effects",) and isinstance(value, Mapping):
            table.add(key, _table(value, place, notes))
            continue
        _add_lines(table, notes.above.get(place, ()))
        item = _item(value)
        if beside := _within(notes.beside, place):
            item.comment(_one_line("; ".join(beside)))
        table.add(key, item)
    return table


def _within(comments: Comments, place: tuple[str, ...]) -> list[str]:
    """The comments at `place` and, as it stands on one line, those of what lies inside it, with its name."""
    found = []
    for path, lines in comments.items():
        if path[: len(place)] == place:
            inside = ".".join(path[len(place) :])
            found += [f"{inside}: {line}" if inside else line for line in lines]
    return found


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
