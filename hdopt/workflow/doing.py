"""What a long call is doing, for who looks from another thread: its steps, the cases of a step, how long still."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import TypeVar

T = TypeVar("T")


@dataclass
class Doing:
    """Steps of the work that a call tells of as they begin, and how far the one under way is."""

    names: Sequence[str] = ()
    done: int = 0
    now: str = ""
    begun: float = field(default_factory=time.monotonic)
    within: Callable[[], str] | None = None
    """What says how far the step under way is."""

    def steps(self, names: Iterable[str]) -> Iterator[str]:
        """The `names` one after the other, counted: the `progress` of a call."""
        self.names = list(names)
        for name in self.names:
            self.now = name.replace("_", " ")
            yield name
            self.done += 1

    def tell(self, stage: str) -> None:
        """Work on `stage` begins."""
        self.now = stage

    def words(self) -> str:
        """'concealed physics, case 3 of 20, about 200 s more' or 'search, 2 of 5 done, about 30 s more'; "" where
        nothing is known."""
        total, part = len(self.names), self.within() if self.within else ""
        said = [self.now, part]
        if total > 1:
            said.append(f"{self.done} of {total} done")
            if self.done and not part:
                said.append(still(self.begun, self.done, total))
        return ", ".join(filter(None, said))


def still(begun: float, done: int, total: int) -> str:
    """'about 30 s more' of work that began at `begun` (of `time.monotonic`) and has `done` so many of its `total`
    parts."""
    return f"about {(time.monotonic() - begun) * (total - done) / done:.0f} s more"


_heard: ContextVar[Doing | None] = ContextVar("hdopt_doing", default=None)


@contextmanager
def told(doing: Doing) -> Iterator[Doing]:
    """What is `counted` meanwhile is told to `doing`."""
    token = _heard.set(doing)
    try:
        yield doing
    finally:
        _heard.reset(token)


def counted(parts: Iterable[T], total: int, what: str) -> Iterator[T]:
    """The `parts`, `total` of them, each a `what` ("case"), while whoever listens is told how many are done."""
    heard = _heard.get()
    if heard is None:
        yield from parts
        return
    begun, done = time.monotonic(), 0

    def words() -> str:
        more = f", {still(begun, done, total)}" if done else ""
        return f"{what} {min(done + 1, total)} of {total}{more}"

    heard.within = words
    try:
        for part in parts:
            done += 1
            yield part
    finally:
        heard.within = None
