"""Progress where standard error is no terminal, as in a log: a line now and then that says what is being done."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterable, Iterator, Sized
from contextlib import contextmanager
from typing import TypeVar

T = TypeVar("T")

EVERY_S = 60.0
"""Between two lines; work of less than that says nothing."""


class Log:
    """What is being done, for the thread that writes the lines."""

    def __init__(self, label: str, total: int | None, every: float) -> None:
        self.label, self.total, self.every = label, total, every
        self.done, self.now, self.start = 0, "", time.monotonic()

    def begin(self, what: str) -> None:
        """Work on `what` begins; what was under way is done."""
        self.done += bool(self.now)
        self.now = what

    def line(self) -> str:
        """'csf-25-80: search, 2 of 5 done, 130 s so far, about 200 s more'."""
        elapsed = time.monotonic() - self.start
        says = [self.now] if self.now else []
        if self.total:
            says.append(f"{self.done} of {self.total} done")
        elif self.done:
            says.append(f"{self.done} done")
        says.append(f"{elapsed:.0f} s so far")
        if self.total and self.done:
            says.append(f"about {elapsed * (self.total - self.done) / self.done:.0f} s more")
        return f"{self.label}: {', '.join(says)}"

    def write_until(self, ended: threading.Event) -> None:
        """A line each `every` seconds, until `ended` is set."""
        while not ended.wait(self.every):
            print(self.line(), file=sys.stderr, flush=True)


@contextmanager
def lines_in_a_log(label: str, total: int | None = None, every: float | None = None) -> Iterator[Log]:
    """A `Log` that writes itself to standard error every `EVERY_S` seconds (or `every`) until the work is done."""
    log, ended = Log(label, total, EVERY_S if every is None else every), threading.Event()
    thread = threading.Thread(target=log.write_until, args=(ended,), daemon=True)
    thread.start()
    try:
        yield log
    finally:
        ended.set()
        thread.join()


def logged(items: Iterable[T], label: str, total: int | None = None) -> Iterator[T]:
    """`items`, while lines in a log say how far they are; `total` where they cannot be counted. Steps that are words
    are named."""
    count = len(items) if total is None and isinstance(items, Sized) else total
    with lines_in_a_log(label, count) as log:
        for item in items:
            if isinstance(item, str):
                log.begin(item)
            yield item
            if not isinstance(item, str):
                log.done += 1
