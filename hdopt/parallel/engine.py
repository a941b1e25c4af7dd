"""Which engine does the work. Results come back in the order of the items, with the same bytes whatever the engine."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import is_dataclass, replace
from typing import Any, Protocol, TypeVar, cast  # Any: an engine of any kind, with one field changed

from hdopt.errors import HdoptError, unknown_name
from hdopt.parallel.local import InTurn, Processes, ThisProcess, Threads
from hdopt.parallel.workers import cores

T = TypeVar("T")
R = TypeVar("R")


class Engine(Protocol):
    """Applies a function to items."""

    @property
    def threads(self) -> int:
        """Threads that pieces sharing the memory of this process may use."""
        ...

    @property
    def elsewhere(self) -> bool:
        """Whether each item has a process of its own, here or on another machine."""
        ...

    def map(self, function: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
        """`function` of every item, in the items' order. Only a few results wait for a caller that takes them one by
        one. `function` and items must be picklable for engines that leave this process."""
        ...


_in_force: ContextVar[Engine | None] = ContextVar("hdopt_engine", default=None)


@contextmanager
def engine_in_force(engine: Engine | str | None) -> Iterator[Engine]:
    """All work that names no engine of its own runs on this one meanwhile (--engine of the command line)."""
    chosen = engine_from(engine)
    token = _in_force.set(chosen)
    try:
        yield chosen
    finally:
        _in_force.reset(token)


ENGINES = ("process", "threads", "processes", "dask://HOST:PORT", "dask+tls://HOST:PORT")
"""What `engine_from` understands; threads and processes also with a number, as in threads:4."""


def engine_from(text: str | Engine | None) -> Engine:
    """The engine that `text` means: 'process' (this one, one item after another), 'threads', 'threads:4', 'processes',
    'processes:4', 'dask://HOST:PORT', 'dask+tls://HOST:PORT'; None means the one in force, threads if there is none.

    Raises `HdoptError` for any other name.
    """
    if text is None:
        return _in_force.get() or Threads()
    if not isinstance(text, str):
        return text
    if text == "process":
        return ThisProcess()
    kind, colon, count = text.partition(":")
    if kind in LOCAL and (not colon or (count.isascii() and count.isdigit() and 0 < len(count) <= DIGITS)):
        workers = int(count) if colon else cores()
        if 0 < workers <= MOST_WORKERS:
            return LOCAL[kind](workers)
    if kind in LOCAL:
        raise HdoptError(f"engine {text[:40]!r}: give 1 to {MOST_WORKERS} workers, as in {kind}:4")
    if kind in ("dask", "dask+tls"):
        host, _, port = count.removeprefix("//").rpartition(":")
        if count.startswith("//") and host and port.isascii() and port.isdigit() and 0 < int(port[:9]) < 65536:
            from hdopt.parallel.cluster import Dask

            return Dask(f"{host}:{port}", secure=kind == "dask+tls")
        raise HdoptError(
            f"engine {text[:80]!r} names no scheduler; write {kind}://HOST:PORT, such as {kind}://localhost:8786"
        )
    raise HdoptError(unknown_name("engine", text, ENGINES))


def for_large_items(engine: Engine) -> Engine:
    """`engine` for items that spread themselves over the threads of a process: one after another where it would stay in
    this process, which keeps its threads for what is inside."""
    if engine.elsewhere:
        return engine
    inner = getattr(engine, "engine", None)  # of an engine that only watches or keeps what another one does
    if inner is not None and is_dataclass(engine) and not isinstance(engine, type):
        changed: Any = replace(engine, engine=for_large_items(inner))
        return cast(Engine, changed)
    return InTurn(engine.threads)


LOCAL: dict[str, type[Threads] | type[Processes]] = {"threads": Threads, "processes": Processes}
MOST_WORKERS = 1024
"""More than any one machine has cores."""
DIGITS = 4
