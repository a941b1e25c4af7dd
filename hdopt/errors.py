"""How hdopt says no: one exception for unusable input, and messages that name the nearest thing that exists."""

from __future__ import annotations

from collections.abc import Iterable


class HdoptError(ValueError):
    """Unusable input. The message says what came, what is allowed, and what to do next."""


class MissingValue(HdoptError):
    """A number is needed that nobody gave."""

    def __init__(self, needed_by: str, *keys: str) -> None:
        self.keys = keys
        names = " and ".join(keys)
        super().__init__(f"{needed_by} needs {names}, which is not given; add it to the study file or with --set")


class MissingLibrary(HdoptError):
    """A library of the system is needed that this machine lacks. The message names its package."""


def unknown_name(kind: str, name: str, known: Iterable[str]) -> str:
    """'unknown KIND 'NAME'', with the nearest known one, or all of them where none is near."""
    import difflib

    known = list(known)
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(map(str, known))}"
    return f"unknown {kind} {name!r}; {hint}"
