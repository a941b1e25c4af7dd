"""Troughs and crests of a ripple that both zones share, as all drives of a block take them: bounded, listed, kept.

Bounds are those of first order where a place is (`simulation.turn.scan`), so that no cell's width enters. Of crests all
is negative, and so the lower is the better. Which places a drive may have is kept in bits, side by side for all drives.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hdopt.arrays import Bits, Index, Singles
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.motion import DESCRIPTION, FS, LANES
from hdopt.kinematics.lanes.single import HALF, HUGE, ONE, ZERO, narrowed, single
from hdopt.simulation.turn.rows import (
    ANGLE,
    BOUNDS,
    D_0,
    D_COS,
    D_SIN,
    FS_MET,
    LEAST_SEEN,
    LIST,
    LOW,
    LOWEST,
    LOWEST_AT,
    O_0,
    O_COS,
    O_SIN,
    OFF,
    STEP,
    T_0,
    T_COS,
    T_SIN,
    VALUE,
)
from hdopt.simulation.turn.waves import Places, Waves

AT_COS, AT_SIN, MET_ONE, MET_TWO, CS_ONE, CS_TWO, BEND = (FS_MET + LANES * row for row in range(7))
"""Rows of the second area: what `Places` says of the place."""
MARK = STEP
"""How a place stands: whether the base is too steep there (1), and of crests zone (2) and rim (4), by bits."""
FOUR = single(4.0)
BITS = 32
"""Places of a drive in a word."""
NO_BIT, ONE_BIT = np.uint32(0), np.uint32(1)
DE_BRUIJN, TOP_BITS = np.uint32(0x077CB531), np.uint32(27)
"""The upper five bits of this number times a power of two tell which power: a sequence of de Bruijn."""
BIT_OF = np.argsort([(0x077CB531 << bit) % 2**32 >> 27 for bit in range(BITS)])
STEEP = single(0.9)
"""A slope of the base over the steepest of a wave above which a drive is bounded part by part: up to there the least of
a wave is no more than 1.12 rad of it from its trough, where two parabolas, each followed for half a radian, come near
enough to tell it."""
GAIN = single(0.55)
"""What a slope lowers a wave by, times the wave's curvature over the slope's square: a half, and what a sine goes
beyond its parabola up to STEEP."""


class Found(NamedTuple):
    """Room for places that may hold an extreme: whose they are (lane) and which, (n,); the deviation there and what it
    may come to near by, mm of arc, (n,); how they stand (`MARK`), (n,); a word of bits for each lane."""

    lanes: Index
    places: Index
    values: Singles
    bounds: Singles
    marks: Index
    bits: Bits


def room_for(waves: Waves) -> Found:
    """Room for all troughs or all crests of `waves` in a block of drives."""
    # One more for each drive's first place, and one that is written before it is known to count.
    n = LANES * (max(len(waves.troughs.turns), len(waves.crests.turns)) + 1) + 1
    lanes, places, marks = (np.zeros(n, np.int64) for _ in range(3))
    return Found(lanes, places, np.zeros(n, np.float32), np.zeros(n, np.float32), marks, np.zeros(LANES, np.uint32))


@compiled
def list_lowest(work: Singles, found: Found, places: Places, crests: bool) -> None:
    """Fill the bounds of all `places`, troughs or `crests`, for the drives of `work`, mm of arc, and list each lane's
    lowest in `found`."""
    for i in range(LANES):
        work[i + LOWEST], work[i + LOWEST_AT] = HUGE, ZERO
    for k in range(len(places.turns)):
        cos, sin, met, slot = places.cos[k], places.sin[k], places.met, BOUNDS + LANES * k
        m_k, d_k = HALF * (met[k, 0] + met[k, 1]), HALF * (met[k, 0] - met[k, 1])
        # Zone 2 meets the CS at its end less o.
        m_o, d_o = HALF * (met[k, 2] - met[k, 3]), HALF * (met[k, 2] + met[k, 3])
        at = narrowed(k)
        for i in range(LANES):
            o = work[i + O_COS] * cos + work[i + O_SIN] * sin + work[i + O_0]
            t = work[i + T_COS] * cos + work[i + T_SIN] * sin + work[i + T_0]
            d = work[i + D_COS] * cos + work[i + D_SIN] * sin + work[i + D_0] + d_k + o * d_o
            m, fs = m_k + o * m_o, work[i + FS]
            low = -(abs(t) + m + abs(d) + fs) if crests else abs(t) + m + max(ZERO, abs(d) - fs)
            less = low < work[i + LOWEST]
            work[i + LOW] = low
            work[i + LOWEST] = low if less else work[i + LOWEST]
            work[i + LOWEST_AT] = at if less else work[i + LOWEST_AT]
        for i in range(LANES):
            work[slot + i] = work[LOW + i]
    for i in range(LANES):
        found.lanes[i], found.places[i] = i, int(work[LOWEST_AT + i])


@compiled
def list_others(work: Singles, found: Found, count: int) -> int:
    """List in `found`, after each lane's first, all of the `count` places whose bound in `work` lies below LEAST_SEEN;
    how many are listed then."""
    listed = LANES
    for first in range(0, count, BITS):
        for i in range(LANES):
            found.bits[i] = NO_BIT
        for k in range(first, min(first + BITS, count)):
            slot, bit = BOUNDS + LANES * k, ONE_BIT << np.uint32(k - first)
            for i in range(LANES):
                found.bits[i] |= bit if work[slot + i] < work[LEAST_SEEN + i] else NO_BIT
        for i in range(LANES):
            left = found.bits[i]
            while left:
                lowest = left & (~left + ONE_BIT)
                left ^= lowest
                k = first + BIT_OF[np.uint32(lowest * DE_BRUIJN) >> TOP_BITS]
                found.lanes[listed], found.places[listed] = i, k
                listed += 1 if k != found.places[i] else 0
    return listed


@compiled
def fetch(work: Singles, found: Found, start: int, count: int, places: Places) -> None:
    """Describe in the second area of `work` drives and `places` of `found`, `count` of them from `start` on."""
    for row in range(DESCRIPTION):
        for j in range(count):
            work[LIST + row * LANES + j] = work[row * LANES + found.lanes[start + j]]
    for j in range(count):
        i, k = LIST + j, found.places[start + j]
        work[i + ANGLE], work[i + AT_COS], work[i + AT_SIN] = places.turns[k], places.cos[k], places.sin[k]
        work[i + MET_ONE], work[i + MET_TWO] = places.met[k, 0], places.met[k, 1]
        work[i + CS_ONE], work[i + CS_TWO], work[i + BEND] = places.met[k, 2], places.met[k, 3], places.bend[k]


@compiled
def keep(work: Singles, found: Found, start: int, count: int) -> None:
    """Keep in `found`, from `start` on, what was found at the first `count` places of the second area of `work`."""
    for j in range(count):
        found.values[start + j], found.bounds[start + j] = work[LIST + VALUE + j], work[LIST + OFF + j]
        found.marks[start + j] = int(work[LIST + MARK + j])


@compiled
def bound_of(value: float, slope: float, bend: float, waves: Waves) -> tuple[float, float]:
    """What a `value`, mm of arc, may come to within its wave of such a curvature (`bend`, mm/rad^2) among `waves` by a
    `slope` of the base, mm/rad; 1 where that is too steep, or 0."""
    steep = slope > STEEP * bend * waves.radian
    # Half a wave is no more than four times its radian.
    lowered = FOUR * slope * waves.radian if steep else GAIN * slope * slope / bend
    return value - lowered, ONE if steep else ZERO


@compiled
def fill_best(work: Singles, found: Found, count: int) -> None:
    """Fill LEAST_SEEN of `work` with the least of each lane's among the first `count` values of `found`, mm of arc."""
    for i in range(LANES):
        work[LEAST_SEEN + i] = found.values[i]
    for j in range(LANES, count):
        at = LEAST_SEEN + found.lanes[j]
        work[at] = min(work[at], found.values[j])
