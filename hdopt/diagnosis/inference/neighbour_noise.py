"""The noise of single samples, as neighbours show it, and whether more than that can be noise too.

A walk with a return (Ornstein, Uhlenbeck, Phys. Rev. 36, 1930), as of heat and oil, may be many times what neighbours
show, and is rough at every scale: over k rows its second difference has a variance proportional to k, up to where the
walk forgets. A wave, a sweep or whatever else is smooth over some rows has one that grows with the fourth power of k.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.numerical import MAD_TO_SIGMA
from hdopt.diagnosis.settings import WalkSettings
from hdopt.recordings.recording import Recording
from hdopt.recordings.rows import Rows

SECOND_DIFFERENCE = 6
"""Variance of a second difference of white noise over the noise's own: 1 + 4 + 1."""


def noise_between_neighbours(recordings: Sequence[Recording]) -> float:
    """Standard deviation (arcmin) of the noise of one sample of the `recordings` as recorded, from second differences
    of neighbours, in which whatever is smooth over three samples vanishes: the median over the recordings.
    """
    sizes = [np.median(np.abs(np.diff(one.error_arcmin, 2))) for one in recordings]
    return float(np.median(sizes)) * MAD_TO_SIGMA / math.sqrt(SECOND_DIFFERENCE)


def is_a_walk(rows: Rows, left: Array, settings: WalkSettings) -> bool:
    """Whether what is `left` (n,), arcmin, of the `rows` is as rough as white noise or a walk at all scales: whether
    second differences over twice as many rows have at most the `settings`' times the variance, from neighbours on to
    where they reach the scatter. False too where contiguous rows are too short for that.

    Differences count by their median: what happens seldom, a jump or a pulse, adds to the scatter alone.
    """
    reached = settings.reached * float(np.std(left))
    apart, before = 1, math.inf
    while 2 * apart < len(left):
        whole = rows.piece[2 * apart :] == rows.piece[: -2 * apart]
        if np.count_nonzero(whole) < settings.fewest_spans * apart:
            return False
        bends = left[2 * apart :] - 2 * left[apart:-apart] + left[: -2 * apart]
        now = _size(bends[whole]) / math.sqrt(SECOND_DIFFERENCE)
        if now**2 > settings.growth * before**2:
            return False
        if now > reached:
            return True
        apart, before = 2 * apart, now
    return False


def _size(values: Array) -> float:
    """Standard deviation of `values` (n,) about 0, were they normal, from their median size."""
    return float(np.median(np.abs(values))) * MAD_TO_SIGMA
