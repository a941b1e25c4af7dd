"""A Dask cluster as an engine: found, checked and watched, so that each failure is a message and none is a wait."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, TypeAlias, TypeVar  # Any: distributed has no types for what is used of it

from hdopt.errors import EngineFailed
from hdopt.parallel.workers import as_worker, cores

Client: TypeAlias = Any  # distributed has no types of its own for what is used here
Future: TypeAlias = Any

T = TypeVar("T")
R = TypeVar("R")

WAITING = 3
"""Items under way or waiting for the caller, per thread of the cluster."""
GLANCE_S = 1.0
"""How often a wait looks whether the cluster is still there."""
MUST_AGREE = ("hdopt", "numpy", "scipy", "numba")
"""Libraries whose version a worker must share: another one may round differently."""


@dataclass(frozen=True)
class Dask:
    """A Dask cluster whose scheduler listens at `address` (HOST:PORT).

    Its workers need the same hdopt, NumPy, SciPy and Numba. `timeout_s`: how long to wait for the scheduler, and for a
    worker where there is none (any more). `secure`: TLS, with the certificates that Dask's own configuration names.
    Raises `EngineFailed` for whatever keeps the cluster from answering; never waits longer than that.
    """

    address: str
    timeout_s: float = 10.0
    secure: bool = False

    @property
    def elsewhere(self) -> bool:
        return True

    @property
    def threads(self) -> int:
        return cores()

    @property
    def url(self) -> str:
        return f"{'tls' if self.secure else 'tcp'}://{self.address}"

    def map(self, function: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
        with self._client() as client:
            threads = self._check_workers(client)
            pending: deque[Future] = deque()
            try:
                for item in items:
                    pending.append(client.submit(_call, function, item, pure=False, retries=0))
                    if len(pending) >= WAITING * threads:
                        yield self._result(client, pending.popleft())
                while pending:
                    yield self._result(client, pending.popleft())
            finally:
                if pending and client.status == "running":
                    client.cancel(list(pending))

    @contextmanager
    def _client(self) -> Iterator[Client]:
        """A client that is connected, or an error within the time-out."""
        self._knock()
        client = self._connect()
        try:
            yield client
        finally:
            # Closing waits for a scheduler that may be gone; nothing that matters is lost by not waiting.
            threading.Thread(target=_close, args=(client,), daemon=True).start()

    def _knock(self) -> None:
        """Whether anything listens at the address: known at once, where Dask would try again and again."""
        import socket

        host, _, port = self.address.rpartition(":")
        try:
            socket.create_connection((host.strip("[]"), int(port)), timeout=self.timeout_s).close()
        except OSError as error:
            raise EngineFailed(
                f"no Dask scheduler answers at {self.address} ({error.strerror or type(error).__name__}); start one "
                "with 'dask scheduler' and give its HOST:PORT, or use --engine threads"
            ) from error

    def _connect(self) -> Client:
        """Connect in a thread of its own: a listener that says nothing must not hold us longer than the time-out."""
        import distributed

        make_client: Any = distributed.Client
        _silence_distributed()
        try:
            return within(
                self.timeout_s + GLANCE_S,
                lambda: make_client(self.url, timeout=self.timeout_s, set_as_default=False),
            )
        except Exception as error:  # whatever a foreign listener provokes, the message is the same
            tls = "" if self.secure else "; a scheduler with TLS needs dask+tls://"
            raise EngineFailed(
                f"what listens at {self.address} is no Dask scheduler of this version ({type(error).__name__} within "
                f"{self.timeout_s:g} s){tls}"
            ) from error

    def _check_workers(self, client: Client) -> int:
        """Threads of the cluster, once every worker has been found to have the same libraries."""
        deadline = time.monotonic() + self.timeout_s
        while not (workers := client.scheduler_info(n_workers=-1)["workers"]):
            if time.monotonic() > deadline:
                raise self._no_workers()
            time.sleep(min(GLANCE_S, self.timeout_s) / 5)
        here = versions()
        try:
            found = within(self.timeout_s, lambda: _versions_there(client))
        except TimeoutError as error:
            raise EngineFailed(
                f"the workers of the scheduler at {self.address} do not answer for {self.timeout_s:g} s; restart them"
            ) from error
        for address, there in found.items():
            if isinstance(there, Exception):
                raise EngineFailed(f"the worker {address} does not answer ({type(there).__name__}); start it again")
            for name in MUST_AGREE:
                if there[name] != here[name]:
                    has = f"has {name} {there[name]}" if there[name] else f"has no {name}"
                    raise EngineFailed(f"the worker {address} {has}, here it is {here[name]}; install the same there")
        return max(1, sum(int(worker["nthreads"]) for worker in workers.values()))

    def _no_workers(self) -> EngineFailed:
        return EngineFailed(
            f"the Dask scheduler at {self.address} has had no workers for {self.timeout_s:g} s; start some with "
            f"'dask worker {self.url}'"
        )

    def _result(self, client: Client, future: Future) -> Any:
        """A future's result; looks meanwhile whether scheduler and workers are still there."""
        from distributed import CancelledError, KilledWorker, TimeoutError

        last_seen = time.monotonic()
        while True:
            try:
                return future.result(timeout=GLANCE_S)
            except KilledWorker as error:
                raise EngineFailed(
                    f"{error.last_worker.address if error.last_worker else 'a worker'} and others before it died over "
                    "the same piece of work, for want of memory most likely; give them more, or fewer threads each"
                ) from error
            except CancelledError as error:
                raise self._lost() from error
            except TimeoutError as error:
                # A function may raise TimeoutError itself; then the future is done.
                if future.status == "error":
                    raise
                if client.status != "running":
                    raise self._lost() from error
                if client.scheduler_info(n_workers=-1)["workers"]:
                    last_seen = time.monotonic()
                elif time.monotonic() - last_seen > self.timeout_s:
                    raise self._no_workers() from error

    def _lost(self) -> EngineFailed:
        return EngineFailed(
            f"the connection to the Dask scheduler at {self.address} was lost in the middle of the work; see whether "
            "it still runs, and start again"
        )


def versions(names: tuple[str, ...] = MUST_AGREE) -> dict[str, str | None]:
    """Versions of the libraries `names`, which must agree; None for one that is not there."""
    from importlib import metadata

    found: dict[str, str | None] = {}
    for name in names:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = None
    return found


# Sent to workers by value, not by name: one that lacks hdopt can then still say so.
versions.__module__ = "__main__"


def _versions_there(client: Client) -> dict[str, Any]:
    """Versions by worker, or the exception that it answered with."""
    found: dict[str, Any] = client.run(versions, on_error="return")
    return found


def _call(function: Callable[[T], R], item: T) -> R:
    with as_worker():
        return function(item)


def within(seconds: float, call: Callable[[], R]) -> R:
    """What `call` returns or raises, or TimeoutError where it has done neither after `seconds`; it is then left alone
    in a thread that does not keep the program from ending."""
    returned: list[R] = []
    raised: list[Exception] = []

    def run() -> None:
        try:
            returned.append(call())
        except Exception as error:  # handed on below
            raised.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(seconds)
    if raised:
        raise raised[0]
    if not returned:
        raise TimeoutError
    return returned[0]


def _close(client: Client) -> None:
    with suppress(Exception):  # what is being left can fail no more
        client.close(timeout=GLANCE_S)


def _silence_distributed() -> None:
    """Dask's own log of failed connections says nothing that the message does not."""
    import logging

    names = ("distributed.client", "distributed.comm", "distributed.core", "distributed.batched", "tornado.application")
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL)
