"""The greatest driving deviation with effects: the crest in the cell of the highest bound, then what may lie above.

In a cell one zone and rim drive to first order, or several where they lie close together.
"""

from __future__ import annotations

from hdopt.arrays import Index, Singles
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.maxima import Angle, Crest, crest_of, top_of
from hdopt.kinematics.lanes.minima import GROUP
from hdopt.kinematics.lanes.motion import LANES, Branch, Design, teeth_of
from hdopt.kinematics.lanes.single import HUGE, ONE, TURN, TWO, ZERO, narrowed
from hdopt.simulation.turn.effects import Turn
from hdopt.simulation.turn.rows import (
    ANGLE,
    BOUNDS,
    CS_MET,
    D_0,
    D_COS,
    D_SIN,
    FIXED_MET,
    GREATEST,
    GREATEST_SEEN,
    HIGHEST_AT,
    LIST,
    MARGIN,
    MET,
    OFF,
    OFFSET,
    PER_TURN,
    RIM,
    RIM_AT,
    STEP,
    SWING,
    T_0,
    T_COS,
    T_SIN,
    VALUE,
    ZONE,
    ZONE_AT,
    branch_of,
    fill_list,
    folded,
    look_up,
    middle,
    offsets,
    place_of,
)


@compiled
def _branch(work: Singles, i: int, design: Design) -> Branch:
    """The branch of the lane's zone and rim at its place, with its effects."""
    place = place_of(work, i, design)
    return branch_of(work, i, place, design, work[i + ZONE], work[i + RIM], i + CS_MET, i + FIXED_MET)


@compiled
def _meet(work: Singles, count: int, design: Design, turn: Turn) -> None:
    """Look up what the zones of the first `count` lanes of the second area meet of the effects."""
    for group in range(count // GROUP if len(turn.cs) else 0):
        for lane in range(GROUP):
            i = LIST + group * GROUP + lane
            s = work[i + ZONE]
            o = offsets(place_of(work, i, design), design, s, work[i + RIM])[0]
            work[i + MET] = work[i + ANGLE] + s * PER_TURN * o
    for i in range(LIST, LIST + count):
        column = 0 if work[i + ZONE] > ZERO else 3
        if len(turn.cs):
            look_up(turn.cs, column, work[i + MET], work, i + CS_MET)
        look_up(turn.fixed, column, work[i + ANGLE], work, i + FIXED_MET)


@compiled
def _find(work: Singles, groups: int, design: Design, reach: float) -> None:
    """Find the crests near the places of the list, and move the places there."""
    for group in range(groups):
        for lane in range(GROUP):
            i = LIST + group * GROUP + lane
            at, turned = _branch(work, i, design), work[i + ANGLE]
            angle = Angle(ONE, ZERO, TURN * turned)
            crest = crest_of(at, teeth_of(work, i), design, angle, work[i + ZONE], work[i + RIM], reach)
            work[i + OFF], work[i + OFFSET], work[i + STEP] = crest.off, crest.offset, crest.step
            work[i + ANGLE] = folded(turned + PER_TURN * crest.step)


@compiled
def _measure(work: Singles, groups: int, design: Design, reach: float) -> None:
    """Fill VALUE with the height of the crests that were found, mm of arc."""
    for group in range(groups):
        for lane in range(GROUP):
            i = LIST + group * GROUP + lane
            at, s, k = _branch(work, i, design), work[i + ZONE], work[i + RIM]
            crest = Crest(ZERO, ONE, ZERO, s, k, work[i + OFF], work[i + OFFSET], work[i + STEP])
            work[i + VALUE] = top_of(at, teeth_of(work, i), design, crest, reach)


@compiled
def look_at_list(work: Singles, lanes: Index, count: int, design: Design, turn: Turn) -> None:
    """Raise the greatest of the drives in the first `count` of `lanes` to what lies near the places of the list in
    `work`, under a `design` with the effects of a `turn`."""
    groups = fill_list(work, lanes, count)
    _meet(work, groups * GROUP, design, turn)
    _find(work, groups, design, turn.reach)
    _meet(work, groups * GROUP, design, turn)
    _measure(work, groups, design, turn.reach)
    for j in range(count):
        work[GREATEST + lanes[j]] = max(work[GREATEST + lanes[j]], work[LIST + VALUE + j])


@compiled
def _signs(work: Singles, i: int, turn: Turn, g: int) -> tuple[float, float, float, float]:
    """Zone and rim that drive at the middle of a cell, by their signs, and how far zones and rims lie apart there at
    least, mm of arc."""
    cos, sin = turn.scan.mid_cos[g], turn.scan.mid_sin[g]
    t = work[i + T_COS] * cos + work[i + T_SIN] * sin + work[i + T_0]
    d = work[i + D_COS] * cos + work[i + D_SIN] * sin + work[i + D_0] + turn.scan.mid[g]
    zones, rims = max(ZERO, abs(d) - work[i + SWING]), max(ZERO, abs(t) - work[i + SWING])
    return (ONE if d > ZERO else -ONE), (ONE if t > ZERO else -ONE), TWO * zones, TWO * rims


@compiled
def _list_cell(work: Singles, lanes: Index, count: int, turn: Turn, i: int, g: int, above: float) -> int:
    """Append every zone and rim of a cell and lane that may reach `above` what was seen; how many the list has."""
    s, k, zones, rims = _signs(work, i, turn, g)
    first = work[HIGHEST_AT + i] == narrowed(g)
    for case in range(4):
        less = (zones if case & 1 else ZERO) + (rims if case & 2 else ZERO)
        zone, rim = (-s if case & 1 else s), (-k if case & 2 else k)
        seen = first and zone == work[ZONE_AT + i] and rim == work[RIM_AT + i]
        if less < above and not seen:
            work[LIST + ANGLE + count], lanes[count] = middle(narrowed(g), len(turn.scan.below)), i
            work[LIST + ZONE + count], work[LIST + RIM + count] = zone, rim
            count += 1
    return count


@compiled
def find_greatest(work: Singles, lanes: Index, design: Design, turn: Turn) -> None:
    """Fill the greatest of the drives of `work`, mm of arc, whose cells of the `turn` are bounded, under a `design`;
    `lanes` (LANES,) is room for a list."""
    cells, count = len(turn.scan.below), 0
    for i in range(LANES):
        work[GREATEST + i] = -HUGE
        work[LIST + ANGLE + i], lanes[i] = middle(work[HIGHEST_AT + i], cells), i
        s, k, _, _ = _signs(work, i, turn, int(work[HIGHEST_AT + i]))
        work[ZONE_AT + i], work[RIM_AT + i], work[LIST + ZONE + i], work[LIST + RIM + i] = s, k, s, k
    look_at_list(work, lanes, LANES, design, turn)
    for i in range(LANES):
        work[GREATEST_SEEN + i] = work[GREATEST + i] - work[MARGIN + i]
    for g in range(cells):
        slot, above = BOUNDS + 2 * LANES * g + LANES, 0
        for i in range(LANES):
            above += 1 if work[slot + i] > work[GREATEST_SEEN + i] else 0
        if above == 0:
            continue
        for i in range(LANES):
            if work[slot + i] > work[GREATEST_SEEN + i]:
                count = _list_cell(work, lanes, count, turn, i, g, work[slot + i] - work[GREATEST_SEEN + i])
                if count + 4 > LANES:
                    look_at_list(work, lanes, count, design, turn)
                    count = 0
    if count:
        look_at_list(work, lanes, count, design, turn)
