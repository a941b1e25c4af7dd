"""SIGINT and SIGTERM: an exception, raised again where it got lost, and at last the end of the process.

Compiled libraries that call back, destructors and hooks of imports drop what is raised inside of them, some with a
traceback on the terminal. A thread therefore sends the signal again for as long as the command goes on, and what is on
its way already is not raised twice. Into a compiled module that is being imported nothing is raised: some crash. No
exception reaches compiled code that does not come back: after `GRACE_S` the
thread ends the process itself.
"""

from __future__ import annotations

import _thread
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.machinery import ExtensionFileLoader
from types import FrameType
from typing import Any  # Any: what Python gives to its hooks

from hdopt.interruption import Interruption

LOADING = (ExtensionFileLoader.create_module.__code__, ExtensionFileLoader.exec_module.__code__)
"""What imports a compiled module."""
AGAIN_S = 1.0
"""From one signal to the next: a command that cleans up in order is through by then, mostly."""
GRACE_S = 15.0
"""What clean-up may take before the process ends without it."""


class Terminated(BaseException):
    """SIGTERM came: whatever is half-written is cleaned up on the way out, as on Ctrl-C."""


RAISED: dict[int, type[BaseException]] = {signal.SIGINT: KeyboardInterrupt, signal.SIGTERM: Terminated}
End = Callable[[BaseException], object]
"""Ends the process at once, for what a signal raised."""


@contextmanager
def signals_raise(noted: Interruption, end: End | None) -> Iterator[None]:
    """SIGTERM as an exception, as SIGINT is, so that what is half-written goes; what came is `noted`, and raised again
    until the block ends. `end` is for a process of our own: it is called where nothing else helps.

    Only the main thread may ask for that, and a SIGINT that is ignored stays so.
    """
    watch = _Watch(noted, end)
    try:
        before = {signal.SIGTERM: signal.signal(signal.SIGTERM, watch.caught)}
    except ValueError:  # not the main thread
        yield
        return
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        before[signal.SIGINT] = signal.signal(signal.SIGINT, watch.caught)
    try:
        with _quiet_hooks(noted, stay=end is not None):
            yield
    finally:
        with watch.sending:
            watch.ended = True
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if end and noted.came else handler)


class _Watch:
    """Raises what came, and sees that it arrives."""

    def __init__(self, noted: Interruption, end: End | None) -> None:
        self.noted, self.end, self.ended = noted, end, False
        self.main = _thread.get_ident()
        self.sending = _thread.allocate_lock()
        self.later = False

    def caught(self, number: int, frame: FrameType | None) -> None:
        """Python's handler of both signals."""
        if _on_its_way(self.noted.came):
            return  # the second Ctrl-C of somebody in a hurry, or a signal sent again for nothing
        first = not (self.noted.came or self.later)
        self.later = _is_loading(frame)
        if not self.later:
            self.noted.came.append(RAISED[number]())
        if first:
            # Not `threading`, one of whose locks the interrupted code may hold.
            _thread.start_new_thread(self.send_again, (number,))
        if not self.later:
            raise self.noted.came[-1]

    def send_again(self, number: int) -> None:
        """The signal, time and again, until the command has ended or has answered it."""
        last = time.monotonic() + GRACE_S
        while (self.noted.came or self.later) and not self.ended:
            time.sleep(AGAIN_S / 20 if self.later else AGAIN_S)
            if self.noted.answers and not self.later:
                last = time.monotonic() + GRACE_S
                continue
            with self.sending:
                if not (self.noted.came or self.later) or self.ended:
                    return
                signal.pthread_kill(self.main, number)
            if self.end and time.monotonic() > last:
                self.end(RAISED[number]())


def _is_loading(frame: FrameType | None) -> bool:
    """Whether `frame` runs within the import of a compiled module."""
    while frame is not None:
        if frame.f_code in LOADING:
            return True
        frame = frame.f_back
    return False


def _on_its_way(came: list[BaseException]) -> bool:
    """Whether one of those that `came` is being handled where the signal arrived: clean-up is at work."""
    error, seen = sys.exception(), 0
    while error is not None and seen < 1000:
        if any(error is one for one in came):
            return True
        error, seen = error.__context__, seen + 1
    return False


@contextmanager
def _quiet_hooks(noted: Interruption, stay: bool) -> Iterator[None]:
    """Nothing printed by Python itself once a signal came: where it got lost, the hooks would print its traceback.
    Where the process ends with the command, they `stay` so."""
    import threading

    def quiet(hook: Any) -> Any:
        return lambda *what: None if noted.came else hook(*what)

    if os.environ.get("HDOPT_TRACEBACK"):
        yield
        return
    before = sys.excepthook, sys.unraisablehook, threading.excepthook
    sys.excepthook, sys.unraisablehook, threading.excepthook = map(quiet, before)
    try:
        yield
    finally:
        if not (stay and noted.came):
            sys.excepthook, sys.unraisablehook, threading.excepthook = before
