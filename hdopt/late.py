"""Functions compiled once there is enough for them to do: loading the compiler and one of them costs half a second.

A command that looks at one drive calls them a few times, and runs them as the Python they are. Both give the same
numbers to the bit, since the compiler neither reorders nor contracts here; but `hypot` and powers, which it works out
in its own way, may differ in the last.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from functools import cached_property, update_wrapper
from typing import TYPE_CHECKING, Any, Generic, ParamSpec, TypeVar, cast  # Any: what numba has no types for

import numpy as np

if TYPE_CHECKING:
    from numba.core.dispatcher import Dispatcher

P = ParamSpec("P")
R = TypeVar("R")

CALLS = 16
"""Calls from Python before a function is compiled."""

_inside = threading.local()
"""Whether this thread is inside of a function that runs as Python: what it calls does so too."""


class Late(Generic[P, R]):
    """A function that runs as Python for its first `calls` calls, unless the compiler is loaded, then compiled.

    Compiled functions may call it: they see what it is compiled to.
    """

    def __init__(self, function: Callable[P, R], calls: int) -> None:
        self.py_func, self.left = function, calls
        update_wrapper(self, function)

    @cached_property
    def compiled(self) -> Dispatcher:
        """The function compiled, kept on disk; runs beside other threads."""
        from numba import njit

        # Said, not left out: unsaid, it is taken from whatever kernel calls the function first.
        return njit(cache=True, nogil=True, error_model="numpy", fastmath=False)(self.py_func)

    @property
    def _numba_type_(self) -> Any:
        from numba.core.types import Dispatcher

        return Dispatcher(self.compiled)

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        if getattr(_inside, "python", False):
            return self.py_func(*args, **kwargs)
        if "numba" in sys.modules or self.left <= 0:
            return cast("R", self.compiled(*args, **kwargs))
        self.left -= 1
        return self.plain(*args, **kwargs)

    def plain(self, *args: P.args, **kwargs: P.kwargs) -> R:
        """The function run as Python, with all that it calls; numbers come back as Python's, as from compiled code."""
        _inside.python = True
        try:
            with np.errstate(all="ignore"):
                return cast("R", _numbers(self.py_func(*args, **kwargs)))
        finally:
            _inside.python = False


def _numbers(value: object) -> object:
    if isinstance(value, tuple):
        return tuple(map(_numbers, value))
    return value.item() if isinstance(value, np.generic) else value


def late(calls: int = CALLS) -> Callable[[Callable[P, R]], Late[P, R]]:
    """Decorator: compiled after its first `calls` calls from Python."""

    def wrapped(function: Callable[P, R]) -> Late[P, R]:
        return Late(function, calls)

    return wrapped
