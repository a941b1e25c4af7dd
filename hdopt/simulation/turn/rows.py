"""The work area of a block with effects, row by row, and what a lane meets of the effects at its place."""

from __future__ import annotations

import math

import numpy as np

from hdopt.arrays import Index, Singles
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.minima import GROUP
from hdopt.kinematics.lanes.motion import (
    DESCRIPTION,
    LANES,
    Branch,
    Design,
    Place,
    branch_at,
    motion_of,
    place_at,
    teeth_of,
)
from hdopt.kinematics.lanes.single import HALF, ONE, TURN, narrowed, sine_cosine, single

PER_TURN = single(1 / (2 * math.pi))

# Rows of an area after those that describe a drive: a place (turns of the input), what is found there (mm of arc), zone
# and rim of a crest by their signs, and what `Crest` says of it.
ANGLE, VALUE, ZONE, RIM, OFF, OFFSET, STEP = (LANES * row for row in range(DESCRIPTION, DESCRIPTION + 7))
MET = LANES * (DESCRIPTION + 7)
"""Where up to four branches meet the CS, in turns."""
CS_MET, FIXED_MET = MET + 4 * LANES, MET + 16 * LANES
"""Value, slope and curvature of the effects that up to four branches meet on the CS, and both zones otherwise."""
FS_AT, FS_MET = MET + 22 * LANES, MET + 26 * LANES
"""The same of the FS, for what does not repeat every turn."""
AREA = MET + 38 * LANES

# Rows of the first area alone: parts of t, d (mm of arc) and of the offset o (rad) at first order.
T_COS, T_SIN, T_0, D_COS, D_SIN, D_0, O_COS, O_SIN, O_0 = (AREA + LANES * row for row in range(9))
MARGIN = AREA + 9 * LANES
"""By how much a cell may lie beyond its bound, mm of arc."""
SWING = MARGIN + LANES
"""By how much t or d differ from their value at a cell's middle, mm of arc."""
T, D, M = (SWING + LANES * row for row in range(1, 4))
"""t, d and the effects' mean at the edge before."""
LOW, HIGH = (SWING + LANES * row for row in range(4, 6))
"""Bounds of the cell in hand."""
LOWEST, LOWEST_AT, HIGHEST, HIGHEST_AT = (SWING + LANES * row for row in range(6, 10))
"""The lowest and the highest bound, and whose they are."""
ZONE_AT, RIM_AT = (SWING + LANES * row for row in range(10, 12))
"""Zone and rim of the crest that was looked at first."""
LEAST, GREATEST, LEAST_SEEN, GREATEST_SEEN = (SWING + LANES * row for row in range(12, 16))
"""What was found so far in mm of arc, and what the first look found."""
LEAST_AT = SWING + 16 * LANES
"""Where the least was found, in turns."""
LEAST_IN = SWING + 17 * LANES
"""In which of the turns, where they differ."""
OFFSETS = SWING + 18 * LANES
"""A bound of the offsets o and o', rad."""
SLACK = SWING + 19 * LANES
"""How far a branch may lie beyond a straight line over a cell, mm of arc."""
T_THEN, D_THEN, M_THEN = (SWING + LANES * row for row in range(20, 23))
"""t, d and the effects' mean at the edge in hand, where cells have parts."""
RIM_NEAR = SWING + 23 * LANES
"""How near to nought t is where either rim may drive, mm of arc."""
FINE_AT = SWING + 24 * LANES
"""Which part was looked at first."""
SLACK_OF_PARTS = SWING + 25 * LANES
"""The same beyond a parabola, where cells of effects that differ from turn to turn have parts."""
LIST = SWING + 26 * LANES
"""The second area: places to look at, dense."""
NEAR = LIST + AREA
"""The third area: drives whose parts of a cell are bounded, dense, with the rows of the first."""
BOUNDS = NEAR + LIST
"""Bounds of all cells: a row of low ones and one of high ones each."""


@compiled
def offsets(place: Place, design: Design, s: float, k: float) -> tuple[float, float]:
    """o of zone `s` and rim `k` at a `place` under a `design`, rad, and its slope."""
    p, rim = place, design.rim
    q = p.e_l + s * k * p.t_l - s * rim.tilt_gain * p.t_a * p.t_l
    q1 = p.e_l1 + s * k * p.t_l1 - s * rim.tilt_gain * (p.t_a1 * p.t_l + p.t_a * p.t_l1)
    return q * rim.per_flatness, q1 * rim.per_flatness


@compiled
def folded(turns: float) -> float:
    """`turns` between -1/2 and 1/2."""
    found: float = turns - np.floor(turns + HALF)
    return found


@compiled
def look_up(table: Singles, column: int, turns: float, work: Singles, at: int) -> None:
    """Put value, slope and curvature of a zone of `table` (n, 6), from `column` on, at `turns` into `work` at `at` and
    the two rows after."""
    n = table.shape[0]
    place = (turns - np.floor(turns)) * narrowed(n)
    whole = np.floor(place + HALF)
    j = int(whole)
    x = (place - whole) * (TURN / narrowed(n))
    j = j - n if j >= n else j
    value, slope, bend = table[j, column], table[j, column + 1], table[j, column + 2]
    work[at], work[at + LANES], work[at + 2 * LANES] = value + x * (slope + HALF * x * bend), slope + x * bend, bend


@compiled
def place_of(work: Singles, i: int, design: Design) -> Place:
    """What both zones pass at the place of lane `i` of `work`, under a `design`."""
    sin, cos = sine_cosine(work[i + ANGLE])
    return place_at(motion_of(work, i, design), cos, sin)


@compiled
def branch_of(work: Singles, i: int, place: Place, design: Design, s: float, k: float, cs: int, fixed: int) -> Branch:
    """The branch of zone `s` and rim `k` of lane `i` at its `place` under a `design`, with the effects that `work`
    holds at `cs` and at `fixed`; the CS is passed faster than the input turns by the offset's slope."""
    branch = branch_at(place, motion_of(work, i, design), teeth_of(work, i), design, s, k)
    rate = ONE + s * offsets(place, design, s, k)[1]
    return Branch(
        branch.value + work[cs] + work[fixed],
        branch.slope + work[cs + LANES] * rate + work[fixed + LANES],
        branch.bend + work[cs + 2 * LANES] * rate * rate + work[fixed + 2 * LANES],
        branch.offset,
        branch.offset_slope,
    )


@compiled
def middle(cell: float, cells: int) -> float:
    """The middle of a `cell` of so many `cells`, in turns between -1/2 and 1/2."""
    return folded((cell + HALF) / narrowed(cells))


@compiled
def fill_list(work: Singles, lanes: Index, count: int) -> int:
    """Describe in the second area of `work` the drives in the first `count` of `lanes`, and fill up the last group; how
    many groups these are."""
    groups = (count + GROUP - 1) // GROUP
    for j in range(count, groups * GROUP):
        lanes[j] = lanes[0]
        for row in range(ANGLE, OFF, LANES):
            work[LIST + row + j] = work[LIST + row]
    for row in range(DESCRIPTION):
        for j in range(groups * GROUP):
            work[LIST + row * LANES + j] = work[row * LANES + lanes[j]]
    return groups
