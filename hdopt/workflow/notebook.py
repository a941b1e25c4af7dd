"""A call in a notebook that takes its time says what it does and how long still, in one line that goes with the end."""

from __future__ import annotations

import html
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Protocol  # Any: the arguments of any call

from hdopt.workflow.doing import Doing, told

LOOK_EVERY_S = 1.0
"""Between two looks at the work; work of less than two of them says nothing."""


class Line(Protocol):
    """A line of a cell that can be written anew."""

    def __call__(self, text: str) -> None: ...


def watched(name: str, arguments: dict[str, Any], known: Iterable[str], doing: Doing) -> Callable[[], str]:
    """What sees how far the call of `name` is, from another thread: its words. Sets `progress` in the `arguments` where
    the call takes one, is among the `known`, and was not given; most calls tell `doing`."""
    from hdopt.workflow.allocation_stages import AllocationWatch
    from hdopt.workflow.diagnosis_stages import DiagnosisWatch

    thread = threading.get_ident()
    takes = "progress" in known and "progress" not in arguments
    if name == "diagnose":
        return DiagnosisWatch(thread).words
    if name == "allocate":
        watch = AllocationWatch(thread)
        if takes:
            arguments["progress"] = watch.rules
        return watch.words
    if takes:
        arguments["progress"] = doing.tell if name == "search" else doing.steps
    return doing.words


@contextmanager
def said_in_a_notebook(name: str, arguments: dict[str, Any], known: Mapping[str, Any]) -> Iterator[None]:
    """While the call of `name` with these `arguments`, of the `known` ones, works in a notebook: a line that says what
    is being done and how long still. Nothing anywhere else."""
    begin = _line_of_a_cell()
    if begin is None:
        yield
        return
    doing, ended, start = Doing(), threading.Event(), time.monotonic()
    look = watched(name, arguments, known, doing)

    def show() -> None:
        write: Line | None = None
        while not ended.wait(LOOK_EVERY_S):
            passed = time.monotonic() - start
            if passed < 2 * LOOK_EVERY_S:
                continue
            write = write or begin()
            write(", ".join(filter(None, (f"hdopt.{name}: {look()}".rstrip(": "), f"{passed:.0f} s so far"))))
        if write is not None:
            write("")

    thread = threading.Thread(target=show, daemon=True)
    thread.start()
    try:
        with told(doing):
            yield
    finally:
        ended.set()
        thread.join()


def _line_of_a_cell() -> Callable[[], Line] | None:
    """What begins a line in the cell that runs; None outside of a notebook."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if shell is None or not hasattr(shell, "kernel"):
        return None

    def begin() -> Line:
        import IPython.display

        shown: Any = IPython.display  # types there depend on whether it is installed
        handle = shown.display(shown.HTML(""), display_id=True)
        return lambda text: handle.update(shown.HTML(f"<small>{html.escape(text)}</small>" if text else ""))

    return begin
