"""How many workers there are, and what each of them may use: the one place that decides."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


def cores() -> int:
    """Processor cores that this process may use (its affinity where the system knows one); at least 1."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


_here = threading.local()


def in_a_worker() -> bool:
    """Whether this thread is a worker already: what it calls then runs in turn, so cores are not shared out twice."""
    return getattr(_here, "busy", False)


def become_worker() -> None:
    """Mark this thread as a worker for good; for threads and processes that a pool owns."""
    _here.busy = True


@contextmanager
def as_worker() -> Iterator[None]:
    """Mark this thread as a worker for a while, with one thread of linear algebra."""
    before = in_a_worker()
    _here.busy = True
    try:
        with one_linear_algebra_thread():
            yield
    finally:
        _here.busy = before


class _LinearAlgebra:
    """The limit on BLAS threads of this process, held as long as anybody needs it."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.holders = 0
        self.limit: Any = None  # threadpoolctl ships no types
        self.libraries: Any = None  # the same
        self.modules = 0

    def hold(self) -> None:
        with self.lock:
            if not self.holders:
                self.limit = self._found().limit(limits=1, user_api="blas")
            self.holders += 1

    def let_go(self) -> None:
        with self.lock:
            self.holders -= 1
            if not self.holders and self.limit is not None:
                self.limit.restore_original_limits()
                self.limit = None

    def _found(self) -> Any:  # Any: the same
        """The libraries of linear algebra, looked for again only where a module was imported since: a look reads the
        process' whole memory map, milliseconds that a short stack would spend sixteen times."""
        if self.modules != len(sys.modules):
            from threadpoolctl import ThreadpoolController

            self.libraries = ThreadpoolController()
            self.modules = len(sys.modules)
        return self.libraries


_linear_algebra = _LinearAlgebra()


@contextmanager
def one_linear_algebra_thread() -> Iterator[None]:
    """Linear algebra on one thread meanwhile, in the whole process.

    Workers that each start threads of their own wait for each other, and sums in another order round differently: with
    one thread a result has the same bytes on every engine. May be nested and held by several threads at once.
    """
    _linear_algebra.hold()
    try:
        yield
    finally:
        _linear_algebra.let_go()
