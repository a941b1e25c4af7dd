"""Progress where standard error is no terminal, as in a log: a line now and then that says what is being done."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import contextmanager
from typing import TypeVar

T = TypeVar("T")

EVERY_S = 60.0
"""Between two lines; work of less than that says nothing."""


class Log:
    """What is being done, for the thread that writes the lines."""

    def __init__(self, label: str, total: int | None, every: float, look: Callable[[], str] | None = None) -> None:
        self.label, self.total, self.every = label, total, every
        self.done, self.now, self.start = 0, "", time.monotonic()
        self._look = look

    def begin(self, what: str) -> None:
        """Work on `what` begins; what was under way is done."""
        self.done += bool(self.now)
        self.now = what

    def line(self) -> str:
        """'csf-25-80: search, 2 of 5 done, 130 s so far, about 200 s more'."""
        elapsed = time.monotonic() - self.start
        now = self.now if self._look is None else self._look()
        says = [now] if now else []
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
def lines_in_a_log(
    label: str, total: int | None = None, every: float | None = None, look: Callable[[], str] | None = None
) -> Iterator[Log]:
    """A `Log` that writes itself to standard error every `EVERY_S` seconds (or `every`) until the work is done; what is
    being done is what it was told, or what `look` sees."""
    log, ended = Log(label, total, EVERY_S if every is None else every, look), threading.Event()
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


LOOK_EVERY_S = 1.0
"""Between two looks at work whose stage a terminal shows."""


@contextmanager
def looked_at(label: str, look: Callable[[], str]) -> Iterator[None]:
    """Shows what `look` sees of the work meanwhile: one line that changes on a terminal, else lines in a log."""
    if not sys.stderr.isatty():
        with lines_in_a_log(label, look=look):
            yield
        return
    from tqdm import tqdm

    with tqdm(bar_format="{desc}", file=sys.stderr, leave=False) as bar:
        log, ended = Log(label, None, LOOK_EVERY_S, look), threading.Event()

        def show() -> None:
            while not ended.wait(LOOK_EVERY_S):
                bar.set_description_str(log.line())

        thread = threading.Thread(target=show, daemon=True)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()
