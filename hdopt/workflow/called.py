"""A public call as its users in Python make it: arguments checked at the door, messages in Python's words."""

from __future__ import annotations

import functools
import inspect
import os
import re
import typing
from collections.abc import Callable, Iterator, Mapping, Sequence
from numbers import Integral, Real
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union  # Any: the arguments of any call

from hdopt.errors import HdoptError, WrongCall, shown, unknown_name
from hdopt.keywords import bound, names_keywords, nearest
from hdopt.workflow.notebook import said_in_a_notebook

F = TypeVar("F", bound=Callable[..., Any])

WORDS: dict[Any, str] = {
    str: "text",
    float: "a number",
    int: "a whole number",
    bool: "True or False",
    Path: "a path",
    NoneType: "None",
}
"""What a type is called in a message."""

OF_FILES = ("ratio", "columns", "bench")
"""What says how the files of a drive are read: arguments of `recorded_drive`."""

FILES = {
    "png": "png",
    "gcode": "gcode",
    "write-study": "study",
    "write-bench": "bench",
    "report": "report",
    "csv": "csv",
    "xlsx": "xlsx",
}
"""Options that name a file -> the kind in `files`."""

RENAMED = {"limit": "limits", "serial": "label", "mounting": "mountings"}
"""Options whose argument has another name."""

_OPTION = re.compile(r"(?:\bhdopt (?P<command>[a-z]+) )?--(?P<name>[a-z][a-z-]*)(?: (?P<value>[\w.*]+[=:][^\s;)]+"
                     r"|[A-Z]+\b|none\b|\d[\d.]*\d|\d|bearing\b|threads\b))?")  # fmt: skip
_GEAR = re.compile(r"--drive none (?:with )?--ratio (\w+)")
_SET_KEY = re.compile(r"--set (?P<key>[a-z]\w*(?:\.\w+)+)(?:=(?P<value>[^\s;,]+))?")


class _Unfit(Exception):
    """A value that no hint takes: `args` are the place within the argument and what is wanted there."""


def as_called(work: F, public: Callable[[str], Any]) -> F:
    """`work`, a public function, for callers in Python; `public` gives the types that its annotations name by what the
    package calls them.

    An unknown, missing or surplus argument and one of a wrong type raise `WrongCall`, which is a `TypeError` and an
    `HdoptError`, before anything is done; what is meant by a near type (1e5 for a whole number, NumPy's scalars, an
    iterator for a list, any path) is made one. Messages that speak of the command line's options speak of arguments.
    """
    known = inspect.signature(work)

    @functools.wraps(work)
    def call(*arguments: Any, **options: Any) -> Any:
        given = bound(f"hdopt.{work.__name__}", known, arguments, options, _unknown)
        hints = hints_of(work, public)
        for name, value in given.arguments.items():
            if type(value) in _exact(hints[name]):
                continue
            try:
                given.arguments[name] = _taken(value, hints[name], name)
            except _Unfit as error:
                place, wanted = error.args
                raise WrongCall(f"hdopt.{work.__name__}: {place}; give {wanted}{_hint(value, wanted)}") from None
        try:
            with said_in_a_notebook(work.__name__, given.arguments, known.parameters):
                result = work(*given.args, **given.kwargs)
        except HdoptError as error:
            error.args = (in_python(str(error), work.__name__, tuple(known.parameters)), *error.args[1:])
            raise
        names_keywords(type(result))
        return result

    call.__module__ = "hdopt"  # where pickle finds it again
    return typing.cast(F, call)


def _unknown(name: str, known: inspect.Signature) -> str:
    """What to say of an argument that a call has not: which one was meant, or where it goes."""
    said = nearest(name, known)
    if "did you mean" in said:
        return said
    if name in OF_FILES and "drive" in known.parameters:
        return f"{name} says how the drive's files are read; give drive=hdopt.recorded_drive(drive, {name}=...)"
    if "study" in known.parameters and _is_study_key(name):
        return f"{name} is a value of the study; give study.with_({name}=...), of study = hdopt.load_study(...)"
    return said


def _is_study_key(name: str) -> bool:
    from hdopt.study.schema import known_paths

    return any(path[-1] == name for path in known_paths({}, without=("effects",)))


class _Names(dict[str, Any]):
    """Names in annotations that a module imports for type checkers only: `public` ones, and pandas."""

    def __init__(self, public: Callable[[str], Any]) -> None:
        super().__init__()
        self._public = public

    def __missing__(self, name: str) -> Any:
        if name == "pd":
            import pandas

            return pandas
        if name[:1].isupper():
            return self._public(name)
        raise KeyError(name)


@functools.cache
def hints_of(work: Callable[..., Any], public: Callable[[str], Any]) -> dict[str, Any]:
    """The type of each argument of `work`; `public` gives what its module names for type checkers only."""
    written = {name: hint for name, hint in work.__annotations__.items() if name != "return"}
    space = inspect.unwrap(work).__globals__
    return {
        name: eval(hint, space, _Names(public)) if isinstance(hint, str) else hint for name, hint in written.items()
    }


@functools.cache
def _exact(hint: Any) -> frozenset[type]:
    """Types whose values `hint` takes as they are: a look at most calls, whose arguments are right."""
    return frozenset(kind for kind in _kinds(hint) if isinstance(kind, type))


def _taken(value: Any, hint: Any, place: str) -> Any:
    """`value` as `hint` takes it; raises `_Unfit` with its `place` where it does not."""
    kinds = list(_kinds(hint))
    for kind in kinds:
        fits, taken = _of_kind(value, kind)
        if fits:
            return taken
    for kind in kinds:
        origin = typing.get_origin(kind) or kind
        inner = typing.get_args(kind)
        if origin is Sequence and _is_listed(value):
            return [_taken(item, inner[0], f"{place}[{number}]") for number, item in enumerate(value)]
        if origin is Mapping and isinstance(value, Mapping):
            _names_are_text(value, place)
            return {key: _taken(item, inner[1], f"{place}[{key!r}]") for key, item in value.items()}
    for kind in kinds:
        if typing.get_origin(kind) is Literal and isinstance(value, str):
            raise WrongCall(unknown_name(place, value, typing.get_args(kind)))
    kind_of = type(value).__name__
    raise _Unfit(f"{place} is {'None' if value is None else f'{shown(str(value))} ({kind_of})'}", _in_words(kinds))


def _kinds(hint: Any) -> Iterator[Any]:
    if typing.get_origin(hint) in (Union, UnionType):
        for inner in typing.get_args(hint):
            yield from _kinds(inner)
    else:
        yield hint


def _of_kind(value: Any, kind: Any) -> tuple[bool, Any]:
    """Whether `value` is of a plain `kind`, and what is handed on."""
    origin = typing.get_origin(kind)
    if origin is Literal:
        return value in typing.get_args(kind), value
    if origin is Callable or kind is Callable:
        return callable(value), value
    if origin is not None:
        return False, value
    if kind in (int, float, bool):
        return _number(value, kind)
    if kind is Path:
        return (True, Path(os.fspath(value))) if isinstance(value, os.PathLike) else (False, value)
    if getattr(kind, "_is_protocol", False):
        asked = [name for name in vars(kind) if not name.startswith("_")]
        return all(hasattr(value, name) for name in asked), value
    return isinstance(value, kind), value


def _number(value: Any, kind: type) -> tuple[bool, Any]:
    is_bool = isinstance(value, bool) or type(value).__name__ in ("bool_", "bool")
    if kind is bool or is_bool:
        return (True, bool(value)) if kind is bool and is_bool else (False, value)
    if kind is float:
        return (True, float(value)) if isinstance(value, Real) else (False, value)
    if isinstance(value, Integral):
        return True, int(value)
    return (True, int(float(value))) if isinstance(value, Real) and float(value).is_integer() else (False, value)


def _is_listed(value: Any) -> bool:
    """Whether `value` is a list of things: a list, tuple, array or series, or an iterator of them."""
    if isinstance(value, str | bytes | Mapping) or hasattr(value, "columns"):
        return False
    return isinstance(value, Iterator) or (hasattr(value, "__getitem__") and hasattr(value, "__len__"))


def _names_are_text(value: Mapping[Any, Any], place: str) -> None:
    for key in value:
        if not isinstance(key, str):
            raise _Unfit(f"{place} has the name {shown(str(key))} ({type(key).__name__})", "names that are text")


def _in_words(kinds: Sequence[Any]) -> str:
    words: list[str] = []
    for kind in kinds:
        word = _word(kind)
        if word not in words:
            words.append(word)
    words.sort(key=lambda word: word == "None")
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"


def _word(kind: Any) -> str:
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin is Literal:
        return " or ".join(map(repr, inner))
    if origin is Callable or kind is Callable:
        return "a function"
    if origin is Sequence:
        return f"a list (each {_in_words(list(_kinds(inner[0])))})"
    if origin is Mapping:
        return f"a dictionary (from text to {_in_words(list(_kinds(inner[1])))})"
    name = getattr(kind, "__name__", str(kind))
    if name == "HasTables":
        return "a result with tables"
    return WORDS.get(kind, f"an {name}" if name[0] in "AEIOU" else f"a {name}")


def _hint(value: Any, wanted: str) -> str:
    """What to do with a value of a wrong type that is a near miss."""
    if type(value).__name__ == "DataFrame" and "Recording" in wanted:
        return "; hdopt.recording_from_table makes a Recording of a table"
    return ""


def in_python(message: str, name: str, arguments: Sequence[str]) -> str:
    """A `message` in the words of who calls the public function `name`, which has these `arguments`: options of
    the command line as arguments, `--set` as `study.with_`."""
    if name == "load_study":
        message = message.replace("as in --set ", "as in ").replace("--set ", "override ")
    message = message.replace("add it to the study file or with --set", "add it to the study: study.with_(KEY=VALUE)")
    message = message.replace("add them to the study file or with --set", "add them to the study: study.with_(...)")
    ratio = 'drive="none", ratio=' if "ratio" in arguments else 'drive=hdopt.recorded_drive("none", ratio='
    message = _GEAR.sub(lambda found: f"{ratio}{found[1]}{')' if '(' in ratio else ''}", message)
    message = _SET_KEY.sub(_set_in_python, message)
    return _OPTION.sub(lambda found: _option_in_python(found, arguments), message)


def _set_in_python(found: re.Match[str]) -> str:
    key, value = found["key"], found["value"]
    return f'study.with_({{"{key}": {value!r}}})' if value else f"{key}, as set"


def _option_in_python(found: re.Match[str], arguments: Sequence[str]) -> str:
    option, value = found["name"], found["value"]
    if option in FILES and "files" in arguments:
        return f'files={{"{FILES[option]}": PATH}}'
    if found["command"]:
        return found[0]
    name = RENAMED.get(option, option.replace("-", "_"))
    if value is None:
        said = name
    else:
        said = f"{name}={value}" if re.fullmatch(r"[\d.]+|[A-Z]", value) else f'{name}="{value}"'
    if name in OF_FILES and name not in arguments and value is not None:
        return f"drive=hdopt.recorded_drive(..., {said})"
    return said
