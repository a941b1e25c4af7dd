"""Engines of this machine: this process, threads, processes."""

from __future__ import annotations

import signal
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, TypeVar

from hdopt.errors import EngineFailed
from hdopt.parallel.workers import as_worker, become_worker, cores, in_a_worker, one_linear_algebra_thread

T = TypeVar("T")
R = TypeVar("R")

WAITING = 2
"""Items under way or waiting for the caller, per worker: enough that no worker idles, few enough to fit in memory."""


@dataclass(frozen=True)
class ThisProcess:
    """One item after another, here."""

    @property
    def elsewhere(self) -> bool:
        return False

    @property
    def threads(self) -> int:
        return 1

    def map(self, function: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
        for item in items:
            with as_worker():
                result = function(item)
            yield result


@dataclass(frozen=True)
class InTurn:
    """One item after another, each with all the threads of this process."""

    threads: int
    elsewhere: bool = False

    def map(self, function: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
        return map(function, items)


@dataclass(frozen=True)
class Threads:
    """Threads of this process: compiled code and NumPy release the lock."""

    workers: int = field(default_factory=cores)

    @property
    def elsewhere(self) -> bool:
        return False

    @property
    def threads(self) -> int:
        return self.workers

    def map(self, function: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
        if in_a_worker() or self.workers == 1:
            return ThisProcess().map(function, items)
        return self._spread(function, items)

    def _spread(self, function: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
        from concurrent.futures import ThreadPoolExecutor

        with one_linear_algebra_thread():
            pool = ThreadPoolExecutor(self.workers, thread_name_prefix="hdopt", initializer=become_worker)
            yield from in_order(pool, lambda item: pool.submit(function, item), items, WAITING * self.workers)


@dataclass(frozen=True)
class Processes:
    """Processes of this machine, started afresh: for work that holds Python's lock. A script that uses them needs
    `if __name__ == "__main__":`, as with any library that starts processes."""

    workers: int = field(default_factory=cores)

    @property
    def elsewhere(self) -> bool:
        return True

    @property
    def threads(self) -> int:
        return self.workers

    def map(self, function: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
        if in_a_worker():
            return ThisProcess().map(function, items)
        return self._spread(function, items)

    def _spread(self, function: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
        from concurrent.futures import ProcessPoolExecutor
        from concurrent.futures.process import BrokenProcessPool
        from multiprocessing import get_context

        import cloudpickle  # type: ignore[import-untyped]  # ships no types

        try:
            pool = ProcessPoolExecutor(self.workers, get_context("spawn"), initializer=_start_process)
        except (OSError, ImportError, NotImplementedError) as error:
            why = getattr(error, "strerror", None) or error
            raise EngineFailed(
                f"processes need semaphores, which this machine does not give ({why}); see whether /dev/shm can be "
                "written, or use --engine threads"
            ) from error

        def submit(item: T) -> Future[R]:
            pickled = cloudpickle.dumps((function, item))
            with _ctrl_c_later():
                return pool.submit(_call, pickled)

        try:
            yield from in_order(pool, submit, items, WAITING * self.workers)
        except BrokenProcessPool as error:
            raise EngineFailed(
                "a worker process ended in the middle of its work, for want of memory most likely; give fewer workers, "
                f"as in --engine processes:{max(1, self.workers // 2)}"
            ) from error


def in_order(pool: Executor, submit: Callable[[T], Future[R]], items: Iterable[T], most: int) -> Iterator[R]:
    """Results of what `submit` gives to `pool`, in the order of `items`, at most `most` of them under way at a time;
    whatever ends it early waits for no other."""
    pending: deque[Future[R]] = deque()
    finished = False
    try:
        for item in items:
            pending.append(submit(item))
            if len(pending) >= most:
                yield pending.popleft().result()
        while pending:
            yield pending.popleft().result()
        finished = True
    finally:
        pool.shutdown(wait=finished, cancel_futures=True)


@contextmanager
def _ctrl_c_later() -> Iterator[None]:
    """SIGINT comes after the block, and never to the processes that are started in it: a terminal sends Ctrl-C to them
    too, and one that still imports would print its own traceback."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _start_process() -> None:
    """A worker's share of the machine; Ctrl-C is the parent's to answer."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    become_worker()
    threading.current_thread().name = "hdopt worker"


def _call(pickled: bytes) -> Any:  # what any function returns
    import pickle

    function, item = pickle.loads(pickled)
    with as_worker():
        return function(item)
