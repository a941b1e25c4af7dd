"""How work is spread: in this process, over threads, or over a Dask cluster. Results come back in the order asked for,
so a result does not depend on who computed it."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Protocol, TypeVar

from hdopt.errors import HdoptError, unknown_name

T = TypeVar("T")
R = TypeVar("R")


class Engine(Protocol):
    """Applies a function to items and gives the results in the items' order."""

    def map(self, function: Callable[[T], R], items: Iterable[T]) -> Iterator[R]: ...


@dataclass(frozen=True)
class ThisProcess:
    """One item after another, here."""

    def map(self, function: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
        return map(function, items)


@dataclass(frozen=True)
class Threads:
    """Threads of this process: compiled code and NumPy release the lock. No more than `workers` items are under way,
    so results that the caller folds up one by one do not pile up."""

    workers: int | None = None

    def map(self, function: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
        from collections import deque
        from concurrent.futures import ThreadPoolExecutor

        workers = self.workers or len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else self.workers
        with ThreadPoolExecutor(workers) as pool:
            pending: deque = deque()
            for item in items:
                pending.append(pool.submit(function, item))
                if len(pending) > 2 * (workers or 1):
                    yield pending.popleft().result()
            while pending:
                yield pending.popleft().result()


@dataclass(frozen=True)
class Dask:
    """A Dask cluster whose scheduler listens at `address` (HOST:PORT); its workers need hdopt installed."""

    address: str
    timeout_s: float = 10.0

    def map(self, function: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
        from distributed import Client

        try:
            client = Client(f"tcp://{self.address}", timeout=self.timeout_s, set_as_default=False)
        except (OSError, ValueError) as error:
            raise HdoptError(
                f"no Dask scheduler answers at {self.address} ({type(error).__name__}); start one with 'dask "
                "scheduler' and give its HOST:PORT, or use --engine threads"
            ) from error
        with client:
            futures = client.map(function, list(items), pure=False)
            for future in futures:
                yield future.result()


ENGINES = ("process", "threads", "dask://HOST:PORT")


def engine_from(text: str | Engine | None) -> Engine:
    """The engine a command names: 'process', 'threads' (also 'threads:N'), 'dask://HOST:PORT'; None means threads."""
    if text is None:
        return Threads()
    if not isinstance(text, str):
        return text
    if text == "process":
        return ThisProcess()
    kind, _, count = text.partition(":")
    if kind == "threads" and (not count or (count.isdigit() and int(count) > 0)):
        return Threads(int(count) if count else None)
    if text.startswith("dask://"):
        host, _, port = text.removeprefix("dask://").rpartition(":")
        if host and port.isdigit():
            return Dask(f"{host}:{port}")
        raise HdoptError(f"engine {text!r} names no scheduler; write dask://HOST:PORT, such as dask://localhost:8786")
    raise HdoptError(unknown_name("engine", text, ENGINES))
