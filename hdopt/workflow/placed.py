"""Where a computation fails over its numbers, its message names the study's value, or the recordings, that they are."""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar, cast  # Any: the arguments of any call

from hdopt.errors import HdoptError, numbers_of
from hdopt.recordings.recording import Recording
from hdopt.study import Study, as_study, place_of_numbers
from hdopt.study.document import Document
from hdopt.study.named import places_named

F = TypeVar("F", bound=Callable[..., Any])

MOST_NAMED = 3
"""Recordings that a message names."""


def numbers_named(work: F) -> F:
    """`work` of a study, its name or its path (its first argument), with the study's farthest value in the message
    where its numbers lead to no result. Other first arguments, records of drives, are handed on."""
    first = _first_name(work)

    @functools.wraps(work)
    def named(*arguments: Any, **options: Any) -> Any:
        given = _first(first, arguments, options)
        if not (given is None or isinstance(given, Study | str | Path)):
            return work(*arguments, **options)
        study = as_study(given)
        options.pop(first, None)
        with _sections_placed(study.document), numbers_of(lambda: place_of_numbers(study.document)):
            return work(study, *arguments[1:], **options)

    return cast(F, named)


_SECTION = re.compile(r"\[(\w+)\]:? ?(\w*)")


@contextmanager
def _sections_placed(document: Document) -> Iterator[None]:
    """Messages that begin with a section of the study, '[tolerances] axis_tilt_y_deg: ...', or show a value or name a
    key of it, get file and line."""
    try:
        yield
    except HdoptError as error:
        if place := _place(str(error), document):
            error.args = (f"{place}: {error}", *error.args[1:])
        raise


def _place(message: str, document: Document) -> str:
    """Where in `document` to look for what `message` says; "" where it says that itself, speaks of nothing in it, or
    begins with another file: numbers are that one's, whatever the study holds."""
    if found := _SECTION.match(message):
        path = tuple(part for part in found.groups() if part)
        return document.where(path).removesuffix(f", {'.'.join(path)}")
    if document.source in message or f"{document.set_by} " in message or _begins_with_a_file(message):
        return ""
    return "; ".join(places_named(document, message)[:MOST_NAMED])


def recordings_named(work: F) -> F:
    """`work` on recordings (its first argument), with their names in the message where their numbers lead to no
    result."""
    first = _first_name(work)

    @functools.wraps(work)
    def named(*arguments: Any, **options: Any) -> Any:
        with numbers_of(lambda: _names(_first(first, arguments, options))):
            return work(*arguments, **options)

    return cast(F, named)


def _first_name(work: Callable[..., Any]) -> str:
    return next(iter(inspect.signature(work).parameters))


def _first(name: str, arguments: tuple[Any, ...], options: Mapping[str, Any]) -> Any:
    return arguments[0] if arguments else options.get(name)


def _names(recordings: Any) -> str:
    given = [recordings] if isinstance(recordings, Recording | str | Path) else list(recordings)
    names = [item.name if isinstance(item, Recording) else str(item) for item in given]
    return ", ".join(names[:MOST_NAMED]) + (f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else "")


_END_OF_NAME = re.compile(r"[:,]? ")
_OF_FILES = re.compile(r"[./\\]")
"""What names of files have, and words that a message begins with have not: asked for where nothing but a space ends the
name."""


def _begins_with_a_file(message: str) -> bool:
    """Whether `message` begins with a file's path: 'cam.csv: ...', 'cam.csv, line 3: ...', 'my cam.csv has ...'."""
    ends = ((message[: end.start()], end[0] != " ") for end in _END_OF_NAME.finditer(message))
    try:
        return any((marked or _OF_FILES.search(name)) and Path(name).is_file() for name, marked in ends)
    except (OSError, ValueError):  # longer than names may be
        return False
