"""Functions that compiled ones call and Python does not: compiled without what Python would call them through.

Numba makes two ways in from outside for each function, and LLVM puts the whole function into either of them: half of
the time in which a kernel of a hundred such functions is compiled.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import update_wrapper
from typing import TYPE_CHECKING, Any, Generic, ParamSpec, TypeVar, cast  # Any: numba's options are of several kinds

from numba import njit

if TYPE_CHECKING:
    from numba.core.dispatcher import Dispatcher

P = ParamSpec("P")
R = TypeVar("R")
Function = TypeVar("Function", bound=Callable[..., object])


class Inner(Generic[P, R]):
    """A `function` compiled by numba's `options` for other compiled functions to call. From Python its `py_func` runs,
    as Python; called by itself it raises `TypeError`, where numba would leave the process to crash.
    """

    def __init__(self, function: Callable[P, R], **options: Any) -> None:
        self.py_func = function
        alone: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        self.compiled: Dispatcher[Callable[P, R]] = njit(**alone, **options)(function)
        update_wrapper(self, function)

    @property
    def _numba_type_(self) -> Any:
        from numba.core.types import Dispatcher

        return Dispatcher(self.compiled)

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        name = self.py_func.__name__
        raise TypeError(f"{name} is compiled for other compiled functions to call; from Python, call {name}.py_func")


def inner(**options: Any) -> Callable[[Function], Function]:
    """Decorator: compiled by numba's `options` for other compiled functions to call."""

    def made(function: Function) -> Function:
        return cast("Function", Inner(function, **options))

    return made
