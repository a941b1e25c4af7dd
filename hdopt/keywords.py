"""Calls with an argument that does not exist, is missing or is too many: refused in words that name the nearest one."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar  # Any: the arguments of any call

from hdopt.errors import WrongCall, unknown_name

C = TypeVar("C", bound=type)

UNITS = {"_mm": "mm", "_um": "mm", "_deg": "rad", "_nm": "N mm", "_rpm": "rad/s", "_mpa": "MPa"}
"""How the name of a key in another unit ends -> the unit of the argument without that ending."""
MARK = "_keywords_named"
"""What a function carries whose calls are looked at already."""


def bound(
    what: str,
    known: inspect.Signature,
    arguments: Sequence[Any],
    options: Mapping[str, Any],
    unknown: Callable[[str, inspect.Signature], str] | None = None,
) -> inspect.BoundArguments:
    """`arguments` and `options` of a call of `what` as its parameters `known` take them.

    Raises `WrongCall` for one that is unknown (`unknown` says what was meant), missing or too many.
    """
    for name in options:
        if name not in known.parameters and not _takes_any(known):
            raise WrongCall(f"{what}: {(unknown or nearest)(name, known)}")
    try:
        return known.bind(*arguments, **options)
    except TypeError as error:
        raise WrongCall(f"{what}: {_misfit(str(error), known)}") from None


def _takes_any(known: inspect.Signature) -> bool:
    return any(one.kind is one.VAR_KEYWORD for one in known.parameters.values())


def _misfit(said: str, known: inspect.Signature) -> str:
    """What Python `said` of a call, with the arguments that it could have."""
    if said.startswith("missing"):
        return f"{said}; it takes {', '.join(known.parameters)}"
    if said.startswith("too many"):
        first = [one.name for one in known.parameters.values() if one.kind is not one.KEYWORD_ONLY]
        beside = [f"{name}=..." for name in known.parameters if name not in first]
        by_name = f"; by name {', '.join(beside)}" if beside else ""
        return f"{said}; it takes {', '.join(first) or 'none'}{by_name}"
    return said


def nearest(name: str, known: inspect.Signature) -> str:
    """What to say of an argument `name` that is not among the `known`: the nearest one, with its unit where `name` says
    another."""
    for ending, unit in UNITS.items():
        stem = name.removesuffix(ending)
        is_elsewhere = any(one.endswith(ending) for one in known.parameters)
        if stem != name and stem in known.parameters and not is_elsewhere:
            return f"unknown argument {name!r}; did you mean {stem!r}, in {unit}?"
    if not known.parameters:
        return f"unknown argument {name!r}; it takes none"
    return unknown_name("argument", name, known.parameters)


def names_keywords(record: C) -> C:
    """Class decorator: `record` and its public methods refuse a call that they do not take as `bound` does, by a
    `WrongCall`, which is a `TypeError`. A call that is right costs no look at its arguments."""
    for kind in record.__mro__:
        if kind.__module__.partition(".")[0] != "hdopt":
            continue
        for name, member in list(vars(kind).items()):
            if name == "__init__" or not name.startswith("_"):
                _watch(kind, name, member)
    return record


def _watch(kind: type, name: str, member: Any) -> None:
    is_of_class = isinstance(member, classmethod)
    work = member.__func__ if is_of_class else member
    if not inspect.isfunction(work) or hasattr(work, MARK):
        return
    watched = _named(work)
    setattr(kind, name, classmethod(watched) if is_of_class else watched)


def _named(work: Callable[..., Any]) -> Callable[..., Any]:
    """`work`, a function with a first argument of its own, that looks at a call only once Python has refused it."""

    @functools.wraps(work)
    def call(*arguments: Any, **options: Any) -> Any:
        try:
            return work(*arguments, **options)
        except WrongCall:
            raise
        except TypeError:
            bound(_title(arguments, work), _without_first(work), arguments[1:], options)
            raise

    setattr(call, MARK, True)
    return call


def _title(arguments: Sequence[Any], work: Callable[..., Any]) -> str:
    own = arguments[0] if arguments else work
    kind = own if isinstance(own, type) else type(own)
    return kind.__name__ if work.__name__ == "__init__" else f"{kind.__name__}.{work.__name__}"


def _without_first(work: Callable[..., Any]) -> inspect.Signature:
    known = inspect.signature(work)
    return known.replace(parameters=list(known.parameters.values())[1:])
