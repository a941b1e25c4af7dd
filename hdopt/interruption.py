"""What SIGINT and SIGTERM have raised so far, and whether the work under way answers for it by itself."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar


class Interruption:
    """The signals of one command: what they have raised and nothing has answered (`came`), and whether the work under
    way answers an interruption by itself (`answers`)."""

    def __init__(self) -> None:
        # No dataclass: a signal that comes while `dataclasses` is imported would meet no handler yet.
        self.came: list[BaseException] = []
        self.answers = False


_noted: ContextVar[Interruption | None] = ContextVar("hdopt_interruption", default=None)


@contextmanager
def noting_interruptions() -> Iterator[Interruption]:
    """What signals raise meanwhile, noted by those who catch them."""
    noted = Interruption()
    token = _noted.set(noted)
    try:
        yield noted
    finally:
        _noted.reset(token)


def interruption() -> Interruption:
    """The signals of the command under way; none have come where there is no command."""
    return _noted.get() or Interruption()


@contextmanager
def answering_interruptions() -> Iterator[None]:
    """A block that answers an interruption with what it has: meanwhile nothing is raised a second time, and once the
    block ends as it should, whatever came is answered."""
    noted = interruption()
    noted.answers = True
    try:
        yield
        noted.came.clear()
    finally:
        noted.answers = False
