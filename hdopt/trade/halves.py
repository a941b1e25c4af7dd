"""Two threads for compiled code that lets go of Python's lock; the numbers do not depend on it."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache

WORTH_SPLITTING = 8


@cache
def _pool(workers: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(workers, thread_name_prefix="hdopt-search")


def in_parts(n: int, work: Callable[[slice], None]) -> None:
    """Call `work` on slices that share out `n` rows over the cores."""
    workers = min(os.cpu_count() or 1, n // WORTH_SPLITTING)
    if workers <= 1:
        work(slice(0, n))
        return
    edges = [n * i // workers for i in range(workers + 1)]
    list(_pool(workers).map(work, [slice(a, b) for a, b in itertools.pairwise(edges)]))
