"""The compiled count of values in equal bins."""

from __future__ import annotations

import numpy as np
from numba import njit

from hdopt.arrays import Array, Index


@njit(cache=True, nogil=True, error_model="numpy", fastmath=False)
def count_in_bins(values: Array, low: float, width: float, counts: Index) -> int:
    """Add to `counts` (b,) how many of `values` (n,) lie in each of b equal bins from `low`, each `width` wide.

    Gives how many lie in any.
    """
    inside = 0
    for value in values:
        place = np.floor((value - low) / width)
        if 0 <= place < len(counts):
            counts[int(place)] += 1
            inside += 1
    return inside
