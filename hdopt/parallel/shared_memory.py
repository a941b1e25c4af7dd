"""Pieces of one computation that share the memory of this process: rows of one array, fits of one recording.

They run on as many threads as the engine in force has; inside a worker, in turn. Results keep the order of the items,
so an answer does not depend on how many threads there were. Compiled loops and linear algebra let Python's lock go.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

from hdopt.parallel.engine import engine_from
from hdopt.parallel.workers import become_worker, in_a_worker, one_linear_algebra_thread

Item = TypeVar("Item")
Result = TypeVar("Result")

MOST_THREADS = 4
"""More threads than this wait for Python's lock between the compiled parts of a fit."""
WORTH_SPLITTING = 8
"""Rows a thread must get at least where one call takes microseconds."""


def threads_for(pieces: int) -> int:
    """Threads that `pieces` may use now; 1 where they had better run in turn."""
    if pieces < 2 or in_a_worker():
        return 1
    return min(engine_from(None).threads, pieces)


def each(function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """`function` of every item, in the items' order, on four threads at most."""
    items = list(items)
    threads = min(MOST_THREADS, threads_for(len(items)))
    if threads < 2:
        return [function(item) for item in items]
    with one_linear_algebra_thread():
        return list(_pool(threads).map(function, items))


def in_blocks(rows: int, block: int, work: Callable[[slice], None]) -> None:
    """Call `work` on slices of `block` rows until all `rows` are done; `work` fills arrays that the caller holds."""
    _run([slice(start, min(start + block, rows)) for start in range(0, rows, block)], work)


def in_parts(rows: int, work: Callable[[slice], None]) -> None:
    """Call `work` on one slice of the rows per thread, each of eight rows at least."""
    parts = max(1, threads_for(rows // WORTH_SPLITTING))
    edges = [rows * i // parts for i in range(parts + 1)]
    _run([slice(a, b) for a, b in itertools.pairwise(edges)], work)


def _run(slices: list[slice], work: Callable[[slice], None]) -> None:
    threads = threads_for(len(slices))
    if threads < 2:
        for rows in slices:
            work(rows)
    else:
        list(_pool(threads).map(work, slices))


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    """Kept between calls: a search makes thousands."""
    return ThreadPoolExecutor(threads, thread_name_prefix="hdopt-shared", initializer=become_worker)
