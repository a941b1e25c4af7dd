"""What this machine can multiply and add: the peak that compiled lanes are held against."""

from __future__ import annotations

import numpy as np
from numba import njit

VALUES, ROUNDS = 4096, 400
CHAIN = 16
"""Fused multiply-adds of one value, one after the other; lanes and loop turns run beside each other."""


@njit(fastmath={"contract"})
def _chains(values, factor, term, rounds):
    for _ in range(rounds):
        for i in range(len(values)):
            x = values[i]
            x = x * factor + term
            x = x * factor + term
            x = x * factor + term
            x = x * factor + term
            x = x * factor + term
            x = x * factor + term
            x = x * factor + term
            x = x * factor + term
            x = x * factor + term
            x = x * factor + term
            x = x * factor + term
            x = x * factor + term
            x = x * factor + term
            x = x * factor + term
            x = x * factor + term
            x = x * factor + term
            values[i] = x


def multiply_adds_per_ns(seconds_of, dtype=np.float32) -> float:
    """Fused multiply-adds a nanosecond on one thread, of numbers of `dtype`; `seconds_of` times a call."""
    values, factor, term = np.ones(VALUES, dtype), dtype(0.999), dtype(0.001)
    _chains(values, factor, term, 1)
    return VALUES * CHAIN * ROUNDS / seconds_of(lambda: _chains(values, factor, term, ROUNDS)) * 1e-9
