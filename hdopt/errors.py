"""How hdopt says no: one exception for unusable input, and messages that name the nearest thing that exists."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager


class HdoptError(ValueError):
    """Unusable input. The message says what came, what is allowed, and what to do next."""


class WrongCall(HdoptError, TypeError):
    """A call of a public function with an argument that it does not take."""


class MissingValue(HdoptError):
    """A number is needed that nobody gave."""

    def __init__(self, needed_by: str, *keys: str) -> None:
        self.keys = keys
        names = " and ".join(keys)
        given = "which is not given; add it" if len(keys) == 1 else "which are not given; add them"
        super().__init__(f"{needed_by} needs {names}, {given} to the study file or with --set")


class MissingSection(MissingValue):
    """Whole sections of the study are needed that it does not have; `keys` holds their names in brackets."""

    def __init__(self, needed_by: str, source: str, *sections: str) -> None:
        self.keys = tuple(f"[{section}]" for section in sections)
        what, them = (f"a {self.keys[0]} section", "it") if len(sections) == 1 else (" and ".join(self.keys), "them")
        HdoptError.__init__(self, f"{needed_by} needs {what}, which {source} does not have; add {them}")


class IncompleteStudy(MissingValue):
    """A study file without keys that its sections cannot do without: `keys`, dotted paths."""

    def __init__(self, message: str, keys: Iterable[str]) -> None:
        HdoptError.__init__(self, message)
        self.keys = tuple(keys)


class MissingLibrary(HdoptError):
    """A library of the system is needed that this machine lacks. The message names its package."""


class EngineFailed(HdoptError):
    """What does the work cannot do it, whatever the input: a cluster out of reach, a worker that died."""


class NoResult(HdoptError):
    """Numbers, each allowed by itself, that lead to no result together; `placed` once the message says where they
    stand."""

    placed = False


@contextmanager
def numbers_of(place: Callable[[], str]) -> Iterator[None]:
    """Say of numbers that lead to no result meanwhile where they stand: `place` says it, and is asked only then."""
    try:
        yield
    except NoResult as error:
        if error.placed:
            raise
        raise _placed(f"{place()}: {error}") from error
    except HdoptError:
        raise
    except (ValueError, ArithmeticError) as error:
        said = _printable(str(error.args[-1] if error.args else type(error).__name__))
        raise _placed(
            f"{place()}: these numbers lead to no result ({said}); see whether each has the unit its name says"
        ) from error


def _placed(message: str) -> NoResult:
    error = NoResult(message)
    error.placed = True
    return error


MOST_LINES = 3
LONGEST_LINE = 600
LONGEST_NAME = 60


def in_brief(message: str, lines: int = MOST_LINES) -> str:
    """`message` in at most `lines` lines of bounded length, with control characters written out: whatever came in."""
    kept = message.split("\n")
    if len(kept) > lines:
        kept = [*kept[: lines - 1], f"and {len(kept) - lines + 1} more faults of this kind"]
    return "\n".join(_shortened(_printable(line), LONGEST_LINE) for line in kept)


def shown(text: str) -> str:
    """`text`, a name or a value from outside, in quotes; short whatever its length."""
    return repr(_shortened(text, LONGEST_NAME))


def _shortened(text: str, most: int) -> str:
    if len(text) <= most:
        return text
    half = (most - 5) // 2
    return f"{text[:half]} ... {text[-half:]}"


def _printable(line: str) -> str:
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in line)


def unknown_name(kind: str, name: str, known: Iterable[str]) -> str:
    """'unknown `kind` `name`', with the nearest of the `known`, or all of them where none is near."""
    import difflib

    known = list(known)
    near = difflib.get_close_matches(name[:LONGEST_NAME], known, n=1, cutoff=0.6)
    hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(map(str, known))}"
    return f"unknown {kind} {shown(name)}; {hint}"
