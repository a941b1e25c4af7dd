"""The comments of a study's text, by the key that they stand at."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any  # Any: tomlkit's containers, whose items are of many kinds

import tomlkit
from tomlkit.items import Comment, Table, Whitespace

from hdopt.study.document import SET_ON_COMMAND_LINE, Document
from hdopt.toml_lines import Keys

SET = "set beside the file"
"""Said of a key that --set or `with_` gave: what the file says of its value no longer holds."""


@dataclass(frozen=True)
class StudyComments:
    """Comments without their #: `beside` a key or a table's header, `above` it, and those of the `head` of the file."""

    beside: Mapping[Keys, tuple[str, ...]] = field(default_factory=dict)
    above: Mapping[Keys, tuple[str, ...]] = field(default_factory=dict)
    head: tuple[str, ...] = ()


def comments_of(document: Document) -> StudyComments:
    """The comments of the study file of a `document` and of the shipped drive below it, a key's own where both speak of
    one; of a key that was set beside the file, that it was."""
    found = StudyComments()
    for text in document.texts:
        own = comments_of_text(text)
        said = {*_keys(tomlkit.parse(text))}
        kept = [{key: value for key, value in part.items() if key not in said} for part in (found.beside, found.above)]
        found = StudyComments({**kept[0], **own.beside}, {**kept[1], **own.above}, own.head or found.head)
    was_set = {path: (SET,) for path, line in document.lines.items() if line == SET_ON_COMMAND_LINE}
    above = {path: lines for path, lines in found.above.items() if path not in was_set}
    return StudyComments({**found.beside, **was_set}, above, found.head)


def comments_of_text(text: str) -> StudyComments:
    """The comments of the TOML `text`. Lines above a key or a table belong to it, those before the first blank line of
    the file to its head."""
    beside: dict[Keys, tuple[str, ...]] = {}
    above: dict[Keys, tuple[str, ...]] = {}
    head: list[str] = []

    def walk(container: Any, path: Keys, waiting: list[str]) -> list[str]:
        for key, item in container.body:
            if isinstance(item, Comment):
                waiting = [*waiting, _bare(item.trivia.comment)]
            elif isinstance(item, Whitespace):
                if not above and not beside and not head and not path and waiting:
                    head.extend(waiting)
                    waiting = []
            elif key is not None:
                place = (*path, key.key)
                if waiting:
                    above[place], waiting = tuple(waiting), []
                if item.trivia.comment and not (isinstance(item, Table) and item.is_super_table()):
                    beside[place] = (_bare(item.trivia.comment),)
                if isinstance(item, Table):
                    waiting = walk(item.value, place, waiting)
        return waiting

    left = walk(tomlkit.parse(text), (), [])
    if left:
        above[()] = tuple(left)
    return StudyComments(beside, above, tuple(head))


def _bare(comment: str) -> str:
    return comment.lstrip("#").strip()


def _keys(container: Mapping[str, Any], path: Keys = ()) -> Iterable[Keys]:
    """Paths of all keys that are no tables of their own."""
    for key, value in container.items():
        if isinstance(value, Table):
            yield from _keys(value, (*path, key))
        else:
            yield (*path, key)
