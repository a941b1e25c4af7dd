"""A place in one turn looked at: the base's parabolas, to which the effects of that turn add theirs."""

from __future__ import annotations

import numpy as np

from hdopt.arrays import Index, Singles
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.minima import GROUP, Zone, lowest_of_turn, rim_change
from hdopt.kinematics.lanes.motion import LANES, Branch, Design, Place, Teeth, teeth_of
from hdopt.kinematics.lanes.single import HALF, ONE, TINY, TURN, ZERO, clipped, narrowed, sine_cosine, single
from hdopt.simulation.beat.effects import Beat
from hdopt.simulation.turn.rows import (
    ANGLE,
    CS_MET,
    FIXED_MET,
    FS_AT,
    FS_MET,
    GREATEST,
    LEAST,
    LEAST_AT,
    LEAST_IN,
    LIST,
    MET,
    PER_TURN,
    RIM,
    VALUE,
    ZONE,
    branch_of,
    fill_list,
    folded,
    look_up,
    offsets,
    place_of,
)

IN, PHASE = ZONE, RIM
"""Rows of a place that stand for zone and rim elsewhere: which turn it is in, and the FS phase at its start, rad."""
BESIDE = single(1e-3)
"""How near to the end of the last turn a lane goes, and to the start of the first, in places: not to rounding."""
LOOKS = 2
"""Times that a place is looked at."""


@compiled
def _mark(work: Singles, i: int, place: Place, design: Design, s: float, k: float, number: int) -> None:
    """Note where the branch of zone s and rim k, which is this number of the four, meets CS and FS, in turns."""
    o = offsets(place, design, s, k)[0]
    on_fs = o - (place.e_l + s * k * place.t_l) * design.rim.per_major
    work[i + MET + number * LANES] = work[i + ANGLE] + s * PER_TURN * o
    turned = design.advance * work[i + ANGLE] + PER_TURN * (work[i + PHASE] + s * on_fs)
    work[i + FS_AT + number * LANES] = turned


@compiled
def _look_up_turn(table: Singles, per_turn: int, zone: int, work: Singles, i: int) -> None:
    """Put what a zone meets of a `table` of all turns in the turn of lane i into its rows."""
    n, at, column = len(table), i + FIXED_MET + 3 * zone * LANES, 3 * zone
    place = work[i + ANGLE] * narrowed(per_turn)
    whole = np.floor(place + HALF)
    # What ends with the last turn is not told from the first.
    whole = min(whole, -ONE) if place < ZERO and work[i + IN] == ZERO else whole
    j, x = int(work[i + IN]) * per_turn + int(whole), (place - whole) * (TURN / narrowed(per_turn))
    j = j + n if j < 0 else j
    j = j - n if j >= n else j
    value, slope, bend = table[j, column], table[j, column + 1], table[j, column + 2]
    work[at], work[at + LANES], work[at + 2 * LANES] = value + x * (slope + HALF * x * bend), slope + x * bend, bend


@compiled
def _mark_all(work: Singles, groups: int, design: Design, reach: float) -> None:
    """Note where both rims of both zones meet CS and FS, in the first groups of the second area."""
    for group in range(groups):
        for lane in range(GROUP):
            i = LIST + group * GROUP + lane
            place = place_of(work, i, design)
            _, k_one, _ = rim_change(place, design, ONE, reach)
            _, k_two, _ = rim_change(place, design, -ONE, reach)
            _mark(work, i, place, design, ONE, k_one, 0)
            _mark(work, i, place, design, ONE, -k_one, 1)
            _mark(work, i, place, design, -ONE, k_two, 2)
            _mark(work, i, place, design, -ONE, -k_two, 3)


@compiled
def _meet(work: Singles, count: int, design: Design, beat: Beat) -> None:
    """Look up what both rims of both zones meet of the effects, in the first `count` lanes of the second area."""
    table, cs, fs, per_turn = beat.turn.fixed, beat.turn.cs, beat.fs, beat.per_turn
    if len(cs) or len(fs):
        _mark_all(work, count // GROUP, design, beat.turn.reach)
    for branch in range(4):
        column, step = (0 if branch < 2 else 3), branch * LANES
        for i in range(LIST, LIST + count if len(cs) else LIST):
            look_up(cs, column, work[i + MET + step], work, i + CS_MET + 3 * step)
        for i in range(LIST, LIST + count if len(fs) else LIST):
            look_up(fs, column, work[i + FS_AT + step], work, i + FS_MET + 3 * step)
    for i in range(LIST, LIST + count):
        _look_up_turn(table, per_turn, 0, work, i)
        _look_up_turn(table, per_turn, 1, work, i)


@compiled
def _branch(work: Singles, i: int, place: Place, design: Design, s: float, k: float, number: int) -> Branch:
    """The branch of zone s and rim k with its effects, which are those of this number of the four."""
    cs, fixed = i + CS_MET + 3 * number * LANES, i + FIXED_MET + 3 * (number // 2) * LANES
    b, fs = branch_of(work, i, place, design, s, k, cs, fixed), i + FS_MET + 3 * number * LANES
    rate = design.advance + s * b.offset_slope
    return Branch(
        b.value + work[fs],
        b.slope + work[fs + LANES] * rate,
        b.bend + work[fs + 2 * LANES] * rate * rate,
        b.offset,
        b.offset_slope,
    )


@compiled
def _reaches(work: Singles, i: int, reach: float, per_turn: int) -> tuple[float, float]:
    """How far, rad, lane i may follow parabolas down and up: not past where the last turn ends and the first begins,
    since what fits no whole number of waves jumps there."""
    angle, joins, beside = work[i + ANGLE], work[i + IN] == ZERO, BESIDE / narrowed(per_turn)
    low = -clipped(TURN * (angle - beside), ZERO, reach) if joins and angle >= ZERO else -reach
    return low, (clipped(-TURN * (angle + beside), ZERO, reach) if joins and angle < ZERO else reach)


@compiled
def _crest(
    at: Branch, teeth: Teeth, design: Design, s: float, phase: float, low: float, high: float
) -> tuple[float, float]:
    """How high a branch of zone s rises from `low` to `high` (rad) in the turn of this FS `phase`, mm of arc, and
    where."""
    sin, cos = sine_cosine(folded((phase + s * at.offset) * PER_TURN))
    rate = design.advance + s * at.offset_slope
    slope = at.slope + s * teeth.fs * rate * cos
    bend = at.bend - s * teeth.fs * rate * rate * sin
    x = clipped(slope / max(-bend, TINY), low, high)
    return at.value + s * teeth.fs * sin + x * (slope + HALF * x * bend), x


@compiled
def _look(work: Singles, groups: int, design: Design, reach: float, per_turn: int, high: bool) -> None:
    """Fill VALUE of the groups of the second area with the least near ANGLE, or (`high`) the greatest, negative, and
    move that there."""
    for group in range(groups):
        for lane in range(GROUP):
            i = LIST + group * GROUP + lane
            place, teeth = place_of(work, i, design), teeth_of(work, i)
            first, k_one, rate_one = rim_change(place, design, ONE, reach)
            second, k_two, rate_two = rim_change(place, design, -ONE, reach)
            a, b = _branch(work, i, place, design, ONE, k_one, 0), _branch(work, i, place, design, ONE, -k_one, 1)
            c, d = _branch(work, i, place, design, -ONE, k_two, 2), _branch(work, i, place, design, -ONE, -k_two, 3)
            low, up = _reaches(work, i, reach, per_turn)
            phase = teeth.fs_phase + design.advance * TURN * work[i + ANGLE] + work[i + PHASE]
            if high:
                most, x = _crest(a, teeth, design, ONE, phase, low, up)
                value, at = _crest(b, teeth, design, ONE, phase, low, up)
                most, x = (value, at) if value > most else (most, x)
                value, at = _crest(c, teeth, design, -ONE, phase, low, up)
                most, x = (value, at) if value > most else (most, x)
                value, at = _crest(d, teeth, design, -ONE, phase, low, up)
                most, x = (value, at) if value > most else (most, x)
                work[i + VALUE] = -most
                work[i + ANGLE] += PER_TURN * x
            else:
                one, two = Zone(first, rate_one, a, b), Zone(second, rate_two, c, d)
                least = lowest_of_turn(one, two, teeth.fs, phase, design.advance, low, up)
                work[i + VALUE] = least.value
                work[i + ANGLE] += PER_TURN * least.x


@compiled
def look_at_list(work: Singles, lanes: Index, count: int, design: Design, beat: Beat, high: bool) -> None:
    """Lower the least (or, `high`, the negative of the greatest) of the drives in the first `count` of `lanes` to what
    lies near the places of the list in `work`, under a `design` and with the effects of a `beat`."""
    groups = fill_list(work, lanes, count)
    found = GREATEST if high else LEAST
    for _ in range(LOOKS):
        _meet(work, groups * GROUP, design, beat)
        _look(work, groups, design, beat.turn.reach, beat.per_turn, high)
    for j in range(count):
        lane, value = lanes[j], work[LIST + VALUE + j]
        if value < work[found + lane]:
            work[found + lane] = value
            if not high:
                work[LEAST_AT + lane], work[LEAST_IN + lane] = work[LIST + ANGLE + j], work[LIST + IN + j]


@compiled
def look_again(work: Singles, lanes: Index, design: Design, beat: Beat) -> None:
    """Look once more where the least of the drives of `work` was found, with `lanes`, `design` and `beat` as before:
    seen from afar it may have seemed too low."""
    phases = beat.phases
    for i in range(LANES):
        lanes[i] = i
        work[LIST + ANGLE + i], work[LIST + IN + i] = work[LEAST_AT + i], work[LEAST_IN + i]
        work[LIST + PHASE + i] = phases[int(work[LEAST_IN + i])]
    groups = fill_list(work, lanes, LANES)
    _meet(work, LANES, design, beat)
    _look(work, groups, design, beat.turn.reach, beat.per_turn, False)
    for i in range(LANES):
        work[LEAST + i] = work[LIST + VALUE + i]
