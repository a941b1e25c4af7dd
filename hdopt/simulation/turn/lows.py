"""The least driving deviation with effects: the cell of the lowest bound, then those that may still lie below.

Each place is looked at twice: parabolas of the base and of the effects lead to where the least lies, and are laid anew
there.
"""

from __future__ import annotations

from hdopt.arrays import Index, Singles
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.minima import GROUP, Look, Zone, lowest_of_branches, rim_change
from hdopt.kinematics.lanes.motion import LANES, Branch, Design, Place, teeth_of
from hdopt.kinematics.lanes.single import HUGE, ONE, TURN, narrowed
from hdopt.simulation.turn.effects import Turn
from hdopt.simulation.turn.rows import (
    ANGLE,
    BOUNDS,
    CS_MET,
    FIXED_MET,
    LEAST,
    LEAST_AT,
    LEAST_SEEN,
    LIST,
    LOWEST_AT,
    MARGIN,
    MET,
    PER_TURN,
    VALUE,
    branch_of,
    fill_list,
    folded,
    look_up,
    middle,
    offsets,
    place_of,
)

LOOKS = 2
"""Times that a place is looked at: once where the best of them is looked at again."""


@compiled
def _meet(work: Singles, count: int, design: Design, turn: Turn) -> None:
    """Look up what both rims of both zones meet of the effects, in the first `count` lanes of the second area."""
    for group in range(count // GROUP if len(turn.cs) else 0):
        for lane in range(GROUP):
            i = LIST + group * GROUP + lane
            place = place_of(work, i, design)
            _, k_one, _ = rim_change(place, design, ONE, turn.reach)
            _, k_two, _ = rim_change(place, design, -ONE, turn.reach)
            work[i + MET] = work[i + ANGLE] + PER_TURN * offsets(place, design, ONE, k_one)[0]
            work[i + MET + LANES] = work[i + ANGLE] + PER_TURN * offsets(place, design, ONE, -k_one)[0]
            work[i + MET + 2 * LANES] = work[i + ANGLE] - PER_TURN * offsets(place, design, -ONE, k_two)[0]
            work[i + MET + 3 * LANES] = work[i + ANGLE] - PER_TURN * offsets(place, design, -ONE, -k_two)[0]
    for branch in range(4 if len(turn.cs) else 0):
        for i in range(LIST, LIST + count):
            at = i + CS_MET + 3 * branch * LANES
            look_up(turn.cs, 0 if branch < 2 else 3, work[i + MET + branch * LANES], work, at)
    for zone in range(2):
        for i in range(LIST, LIST + count):
            look_up(turn.fixed, 3 * zone, work[i + ANGLE], work, i + FIXED_MET + 3 * zone * LANES)


@compiled
def _branch(work: Singles, i: int, place: Place, design: Design, s: float, k: float, number: int) -> Branch:
    """The branch of zone s and rim k with its effects, which are those of this number of the four."""
    cs, fixed = i + CS_MET + 3 * number * LANES, i + FIXED_MET + 3 * (number // 2) * LANES
    return branch_of(work, i, place, design, s, k, cs, fixed)


@compiled
def _look(work: Singles, groups: int, design: Design, reach: float) -> None:
    """Fill VALUE of the groups of the second area with the least near ANGLE, and move that there."""
    for group in range(groups):
        for lane in range(GROUP):
            i = LIST + group * GROUP + lane
            place, teeth = place_of(work, i, design), teeth_of(work, i)
            first, k_one, rate_one = rim_change(place, design, ONE, reach)
            second, k_two, rate_two = rim_change(place, design, -ONE, reach)
            before, after = (
                _branch(work, i, place, design, ONE, k_one, 0),
                _branch(work, i, place, design, ONE, -k_one, 1),
            )
            one = Zone(first, rate_one, before, after)
            before, after = (
                _branch(work, i, place, design, -ONE, k_two, 2),
                _branch(work, i, place, design, -ONE, -k_two, 3),
            )
            two = Zone(second, rate_two, before, after)
            phase = teeth.fs_phase + design.advance * TURN * work[i + ANGLE]
            least = lowest_of_branches(one, two, teeth.fs, phase, design, Look(reach, True))
            work[i + VALUE] = least.value
            work[i + ANGLE] = folded(work[i + ANGLE] + PER_TURN * least.x)


@compiled
def look_at_list(work: Singles, lanes: Index, count: int, design: Design, turn: Turn, looks: int = LOOKS) -> None:
    """Lower the least of the drives in the first `count` of `lanes` to what lies near the places of the list in
    `work`, under a `design` with the effects of a `turn`, each looked at so many times (`looks`)."""
    groups = fill_list(work, lanes, count)
    for _ in range(looks):
        _meet(work, groups * GROUP, design, turn)
        _look(work, groups, design, turn.reach)
    for j in range(count):
        lane, value = lanes[j], work[LIST + VALUE + j]
        less = value < work[LEAST + lane]
        work[LEAST + lane] = value if less else work[LEAST + lane]
        work[LEAST_AT + lane] = work[LIST + ANGLE + j] if less else work[LEAST_AT + lane]


@compiled
def look_again(work: Singles, lanes: Index, design: Design, turn: Turn) -> None:
    """Look once more where the least of the drives of `work` was found, with `lanes`, `design` and `turn` as before:
    seen from afar it may have seemed too low."""
    for i in range(LANES):
        work[LIST + ANGLE + i], lanes[i] = work[LEAST_AT + i], i
    groups = fill_list(work, lanes, LANES)
    _meet(work, LANES, design, turn)
    _look(work, groups, design, turn.reach)
    for i in range(LANES):
        work[LEAST + i] = work[LIST + VALUE + i]


@compiled
def find_least(work: Singles, lanes: Index, design: Design, turn: Turn) -> None:
    """Fill the least of the drives of `work`, mm of arc, whose cells of the `turn` are bounded, under a `design`;
    `lanes` (LANES,) is room for a list."""
    cells, count = len(turn.scan.below), 0
    for i in range(LANES):
        work[LEAST + i] = HUGE
        work[LIST + ANGLE + i], lanes[i] = middle(work[LOWEST_AT + i], cells), i
    look_at_list(work, lanes, LANES, design, turn)
    # Against what the first look found: so no drive's value depends on when the list was full.
    for i in range(LANES):
        work[LEAST_SEEN + i] = work[LEAST + i] + work[MARGIN + i]
    for g in range(cells):
        slot, cell, below = BOUNDS + 2 * LANES * g, narrowed(g), 0
        for i in range(LANES):
            below += 1 if work[slot + i] < work[LEAST_SEEN + i] else 0
        if below == 0:
            continue
        for i in range(LANES):
            if work[slot + i] < work[LEAST_SEEN + i] and work[LOWEST_AT + i] != cell:
                work[LIST + ANGLE + count], lanes[count] = middle(cell, cells), i
                count += 1
                if count == LANES:
                    look_at_list(work, lanes, count, design, turn)
                    count = 0
    if count:
        look_at_list(work, lanes, count, design, turn)
    look_again(work, lanes, design, turn)
