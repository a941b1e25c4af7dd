"""Extremes with effects that ripple: cells are bounded by the envelope, and only what is left of them part by part.

What is fast lies between the least and the greatest of its waves in a cell, so that cells need be no finer than what is
slow asks for (`effects._with_parts`). In a cell that may hold an extreme the drives that it may hold it for are taken
side by side, and its parts are bounded with the waves themselves. Waves on the CS are met where each zone stands on it,
which at a tooth's order is a good part of a wave from where the input angle is.
"""

from __future__ import annotations

import numpy as np

from hdopt.arrays import Index, Singles
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.candidates import at_most
from hdopt.kinematics.lanes.minima import GROUP
from hdopt.kinematics.lanes.motion import DESCRIPTION, FS, LANES, Design, motion_of, place_at
from hdopt.kinematics.lanes.single import HALF, HUGE, ONE, TURN, TWO, ZERO, narrowed
from hdopt.simulation.turn import lows, tops
from hdopt.simulation.turn.effects import Turn
from hdopt.simulation.turn.rows import (
    BOUNDS,
    D_0,
    D_COS,
    D_SIN,
    D_THEN,
    FINE_AT,
    GREATEST,
    GREATEST_SEEN,
    HIGH,
    HIGHEST_AT,
    LEAST,
    LEAST_SEEN,
    LOW,
    LOWEST_AT,
    M_THEN,
    MARGIN,
    MET,
    NEAR,
    OFF,
    OFFSET,
    PER_TURN,
    RIM,
    RIM_AT,
    RIM_NEAR,
    SWING,
    T_0,
    T_COS,
    T_SIN,
    T_THEN,
    ZONE,
    ZONE_AT,
    D,
    M,
    T,
    middle,
    offsets,
)
from hdopt.simulation.turn.scan import least_of_cell
from hdopt.simulation.turn.waiting import Waiting, has_room, put, put_crest, put_lowest, take

CASES = 4
"""Zones times rims: what may drive in a part."""


@compiled
def _describe(work: Singles, near: Index, count: int, width: float) -> int:
    """Describe in the third area the drives in the first `count` of `near`: how many lanes that takes."""
    padded = (count + GROUP - 1) // GROUP * GROUP
    for j in range(count, padded):
        near[j] = near[0]
    for row in range(0, DESCRIPTION * LANES, LANES):
        for j in range(padded):
            work[NEAR + row + j] = work[row + near[j]]
    for row in range(T_COS, SWING, LANES):
        for j in range(padded):
            work[NEAR + row + j] = work[row + near[j]]
    for i in range(NEAR, NEAR + padded):
        work[i + RIM_NEAR] = work[i + MARGIN] + width * at_most(work[i + T_COS], work[i + T_SIN])
    return padded


@compiled
def _on_cs(table: Singles, column: int, turns: float) -> float:
    """What a zone meets of the `table` at `turns` of the CS."""
    n = len(table)
    place = (turns - np.floor(turns)) * narrowed(n)
    whole = np.floor(place + HALF)
    j = int(whole)
    j = j - n if j >= n else j
    found: float = table[j, column] + (place - whole) * (TURN / narrowed(n)) * table[j, column + 1]
    return found


@compiled
def _of_rims(upper: float, lower: float, t: float, near: float, sign: float) -> float:
    """What the rim that drives meets; where either may, the lesser, or (`sign` -1) the greater."""
    driving = upper if t > ZERO else lower
    other = lower if t > ZERO else upper
    further = other < driving if sign > ZERO else other > driving
    return other if abs(t) < near and further else driving


@compiled
def _meet_cs(work: Singles, count: int, design: Design, turn: Turn, e: int, sign: float) -> None:
    """Add what both zones meet of the CS at edge e of the parts."""
    cos, sin, angle = turn.fine.cos[e], turn.fine.sin[e], narrowed(e) / narrowed(len(turn.fine.below))
    for group in range(count // GROUP):
        for lane in range(GROUP):
            i = NEAR + group * GROUP + lane
            place = place_at(motion_of(work, i, design), cos, sin)
            work[i + MET] = angle + PER_TURN * offsets(place, design, ONE, ONE)[0]
            work[i + MET + LANES] = angle + PER_TURN * offsets(place, design, ONE, -ONE)[0]
            work[i + MET + 2 * LANES] = angle - PER_TURN * offsets(place, design, -ONE, ONE)[0]
            work[i + MET + 3 * LANES] = angle - PER_TURN * offsets(place, design, -ONE, -ONE)[0]
    for branch in range(4):
        for i in range(NEAR + MET + branch * LANES, NEAR + MET + branch * LANES + count):
            work[i] = _on_cs(turn.cs, 0 if branch < 2 else 3, work[i])
    for group in range(count // GROUP):
        for lane in range(GROUP):
            i = NEAR + group * GROUP + lane
            t, near = work[i + T_THEN], work[i + RIM_NEAR]
            one = _of_rims(work[i + MET], work[i + MET + LANES], t, near, sign)
            two = _of_rims(work[i + MET + 2 * LANES], work[i + MET + 3 * LANES], t, near, sign)
            work[i + M_THEN] += HALF * (one + two)
            work[i + D_THEN] += HALF * (one - two)


@compiled
def _reach(work: Singles, count: int, design: Design, turn: Turn, e: int, sign: float) -> None:
    """Leave the edge in hand behind and take edge e of the parts, for the least (`sign` 1) or the greatest (-1)."""
    cos, sin, m_e, d_e = turn.fine.cos[e], turn.fine.sin[e], turn.fine.edges[e, 0], turn.fine.edges[e, 1]
    for group in range(count // GROUP):
        for lane in range(GROUP):
            i = NEAR + group * GROUP + lane
            work[i + T], work[i + D], work[i + M] = work[i + T_THEN], work[i + D_THEN], work[i + M_THEN]
    for group in range(count // GROUP):
        for lane in range(GROUP):
            i = NEAR + group * GROUP + lane
            work[i + T_THEN] = work[i + T_COS] * cos + work[i + T_SIN] * sin + work[i + T_0]
            work[i + D_THEN] = work[i + D_COS] * cos + work[i + D_SIN] * sin + work[i + D_0] + d_e
            work[i + M_THEN] = m_e
    if len(turn.cs):
        _meet_cs(work, count, design, turn, e, sign)


@compiled
def _bound_low(work: Singles, count: int, design: Design, turn: Turn, e: int) -> None:
    """Take edge e, and fill LOW with what the part before it cannot fall below."""
    _reach(work, count, design, turn, e, ONE)
    below = turn.fine.below[max(e - 1, 0)]
    for group in range(count // GROUP):
        for lane in range(GROUP):
            i = NEAR + group * GROUP + lane
            work[i + LOW] = least_of_cell(work, i, work[i + T_THEN], work[i + D_THEN], work[i + M_THEN]) - below


@compiled
def _apart(one: float, two: float, within: float) -> float:
    """How far what goes from `one` to `two` keeps from nought, less what lines leave out."""
    return max(ZERO, min(abs(one), abs(two)) - within) if one * two > ZERO else ZERO


@compiled
def _bound_high(work: Singles, count: int, design: Design, turn: Turn, e: int) -> None:
    """Take edge e, and fill HIGH with what the part before it cannot exceed, ZONE and RIM with what drives there, OFF
    and OFFSET with how far zones and rims lie apart."""
    _reach(work, count, design, turn, e, -ONE)
    g = max(e - 1, 0)
    above, within = turn.fine.above[g], turn.fine.above[g] + turn.fine.below[g]
    for group in range(count // GROUP):
        for lane in range(GROUP):
            i = NEAR + group * GROUP + lane
            t, d, m, t0, d0 = work[i + T_THEN], work[i + D_THEN], work[i + M_THEN], work[i + T], work[i + D]
            work[i + HIGH] = max(abs(t0) + work[i + M] + abs(d0), abs(t) + m + abs(d)) + work[i + FS] + above
            work[i + ZONE], work[i + RIM] = (ONE if d + d0 > ZERO else -ONE), (ONE if t + t0 > ZERO else -ONE)
            work[i + OFF], work[i + OFFSET] = TWO * _apart(d0, d, within), TWO * _apart(t0, t, ZERO)


@compiled
def _list_low_parts(work: Singles, waiting: Waiting, first: int, design: Design, turn: Turn) -> tuple[int, int]:
    """List the parts of cells from the `first` on that may hold less than was seen, as far as there is room; before the
    first cell (-1), each drive's part of the lowest bound in its cell of the lowest. How many these are, and which cell
    is next."""
    parts, every, cells, near = turn.fine.parts, len(turn.fine.below), len(turn.scan.below), waiting.near
    listed, best = 0, first < 0
    for i in range(LANES if best else 0):
        work[LEAST_SEEN + i] = HUGE
    for cell in range(max(first, 0), cells):
        if not has_room(waiting, listed, parts * LANES):
            return listed, cell
        slot, at, count = BOUNDS + 2 * LANES * cell, narrowed(cell), 0
        for i in range(LANES):
            if (work[LOWEST_AT + i] == at) if best else (work[slot + i] < work[LEAST_SEEN + i]):
                near[count] = i
                count += 1
        padded = _describe(work, near, count, turn.fine.width) if count else 0
        for e in range(cell * parts, cell * parts + (parts + 1 if count else 0)):
            _bound_low(work, padded, design, turn, e)
            for k in range(count if e > cell * parts else 0):
                i, part = near[k], narrowed(e - 1)
                if work[NEAR + LOW + k] < work[LEAST_SEEN + i]:
                    if best:
                        work[LEAST_SEEN + i], work[FINE_AT + i] = work[NEAR + LOW + k], part
                    elif work[FINE_AT + i] != part:
                        put(waiting, listed, middle(part, every), i)
                        listed += 1
    if not best:
        return listed, cells
    for i in range(LANES):
        put(waiting, i, middle(work[FINE_AT + i], every), i)
    return LANES, 0


@compiled
def find_least_of_parts(work: Singles, waiting: Waiting, design: Design, turn: Turn) -> None:
    """Fill the least of the drives of `work`, mm of arc, whose cells of the `turn` are bounded, under a `design`;
    `waiting` is room for lists. At last the best is looked at once more, as `lows.look_again` does."""
    cells, cell, looks = len(turn.scan.below), -1, lows.LOOKS
    while cell <= cells:
        if cell == 0:
            for i in range(LANES):
                work[LEAST_SEEN + i] = work[LEAST + i] + work[MARGIN + i]
        if cell < cells:
            count, following = _list_low_parts(work, waiting, cell, design, turn)
        else:
            count, following, looks = put_lowest(work, waiting), cells + 1, 1
        for i in range(LANES if cell < 0 or cell == cells else 0):
            work[LEAST + i] = HUGE
        for start in range(0, count, LANES):
            here = min(LANES, count - start)
            take(work, waiting, start, here)
            lows.look_at_list(work, waiting.at_hand, here, design, turn, looks)
        cell = following


@compiled
def _list_part(work: Singles, waiting: Waiting, listed: int, turn: Turn, k: int, i: int, g: int) -> int:
    """Append every zone and rim of part g and of lane i, the k-th of the third area, that may reach what was seen; how
    many the list has."""
    above, first = work[NEAR + HIGH + k] - work[GREATEST_SEEN + i], work[FINE_AT + i] == narrowed(g)
    s, r, zones, rims = work[NEAR + ZONE + k], work[NEAR + RIM + k], work[NEAR + OFF + k], work[NEAR + OFFSET + k]
    for case in range(CASES):
        less = (zones if case & 1 else ZERO) + (rims if case & 2 else ZERO)
        zone, rim = (-s if case & 1 else s), (-r if case & 2 else r)
        seen = first and zone == work[ZONE_AT + i] and rim == work[RIM_AT + i]
        if less < above and not seen:
            put_crest(waiting, listed, middle(narrowed(g), len(turn.fine.below)), i, zone, rim)
            listed += 1
    return listed


@compiled
def _list_high_parts(work: Singles, waiting: Waiting, first: int, design: Design, turn: Turn) -> tuple[int, int]:
    """List the zones and rims of parts of cells from the `first` on that may reach what was seen, as far as there is
    room; before the first cell (-1), each drive's part of the highest bound in its cell of the highest, with what
    drives there. How many these are, and which cell is next."""
    parts, every, cells, near = turn.fine.parts, len(turn.fine.below), len(turn.scan.below), waiting.near
    listed, best = 0, first < 0
    for i in range(LANES if best else 0):
        work[GREATEST_SEEN + i] = -HUGE
    for cell in range(max(first, 0), cells):
        if not has_room(waiting, listed, CASES * parts * LANES):
            return listed, cell
        slot, at, count = BOUNDS + 2 * LANES * cell + LANES, narrowed(cell), 0
        for i in range(LANES):
            if (work[HIGHEST_AT + i] == at) if best else (work[slot + i] > work[GREATEST_SEEN + i]):
                near[count] = i
                count += 1
        padded = _describe(work, near, count, turn.fine.width) if count else 0
        for e in range(cell * parts, cell * parts + (parts + 1 if count else 0)):
            _bound_high(work, padded, design, turn, e)
            for k in range(count if e > cell * parts else 0):
                i = near[k]
                if work[NEAR + HIGH + k] > work[GREATEST_SEEN + i]:
                    if best:
                        work[GREATEST_SEEN + i], work[FINE_AT + i] = work[NEAR + HIGH + k], narrowed(e - 1)
                        work[ZONE_AT + i], work[RIM_AT + i] = work[NEAR + ZONE + k], work[NEAR + RIM + k]
                    else:
                        listed = _list_part(work, waiting, listed, turn, k, i, e - 1)
    if not best:
        return listed, cells
    for i in range(LANES):
        put_crest(waiting, i, middle(work[FINE_AT + i], every), i, work[ZONE_AT + i], work[RIM_AT + i])
    return LANES, 0


@compiled
def find_greatest_of_parts(work: Singles, waiting: Waiting, design: Design, turn: Turn) -> None:
    """Fill the greatest of the drives of `work`, with `waiting`, `design` and `turn` as for the least."""
    cells, cell = len(turn.scan.below), -1
    for i in range(LANES):
        work[GREATEST + i] = -HUGE
    while cell < cells:
        if cell == 0:
            for i in range(LANES):
                work[GREATEST_SEEN + i] = work[GREATEST + i] - work[MARGIN + i]
        count, cell = _list_high_parts(work, waiting, cell, design, turn)
        for start in range(0, count, LANES):
            here = min(LANES, count - start)
            take(work, waiting, start, here)
            tops.look_at_list(work, waiting.at_hand, here, design, turn)
