"""The greatest driving deviation with a ripple that both zones share: what lies at its crests, the best looked at."""

from __future__ import annotations

import numpy as np

from hdopt.arrays import Index, Singles
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.compiled import motion_at, rim_depth, tooth_deviation
from hdopt.kinematics.lanes.minima import GROUP
from hdopt.kinematics.lanes.motion import LANES, Design, Teeth, motion_of, teeth_of
from hdopt.kinematics.lanes.single import HALF, HALF_PI, HUGE, ONE, TURN, TWO, ZERO
from hdopt.simulation.turn import tops
from hdopt.simulation.turn.effects import Turn
from hdopt.simulation.turn.places import (
    AT_COS,
    AT_SIN,
    BEND,
    CS_ONE,
    CS_TWO,
    FOUR,
    MARK,
    MET_ONE,
    MET_TWO,
    Found,
    bound_of,
    fetch,
    fill_best,
    keep,
    list_lowest,
    list_others,
)
from hdopt.simulation.turn.rows import ANGLE, GREATEST, LEAST_SEEN, LIST, MARGIN, OFF, RIM, VALUE, ZONE
from hdopt.simulation.turn.troughs import slopes_at


@compiled
def _of_phase(teeth: Teeth, offset: float, s: float, turns: float, design: Design) -> float:
    """What the FS phase that is nearest to the crest of zone `s` adds there, mm of arc, where the rim's `offset` is o',
    rad, at so many `turns` of the input."""
    off = (design.advance * TURN * turns + teeth.fs_phase + s * (offset - HALF_PI)) * design.per_spacing
    off = (off - np.floor(off + HALF)) * design.spacing
    found: float = teeth.fs * (ONE - HALF * off * off)
    return found


@compiled
def _measure(work: Singles, found: Found, start: int, count: int, design: Design, turn: Turn) -> None:
    """Fill what `found` tells of its crests, `count` of them from `start` on: the zone and rim that drive."""
    fetch(work, found, start, count, turn.waves.crests)
    for group in range((count + GROUP - 1) // GROUP):
        for lane in range(GROUP):
            i = LIST + group * GROUP + lane
            motion, teeth, rim = motion_of(work, i, design), teeth_of(work, i), design.rim
            cos, sin, best, mark, slope = work[i + AT_COS], work[i + AT_SIN], -HUGE, ZERO, ZERO
            t1, d1 = slopes_at(motion, teeth, design, cos, sin)
            e_a, e_l, t_a, t_l = motion_at(motion, cos, sin)
            for case in range(4):
                first, upper = case < 2, case & 1 == 0
                s, k = (ONE if first else -ONE), (ONE if upper else -ONE)
                depth, o, offset = rim_depth(rim, e_a, e_l, t_a, t_l, s, k)
                value = design.tan_alpha * depth
                value += tooth_deviation(teeth.cs_cos, teeth.cs_sin, cos, sin, s, ONE - HALF * o * o, o)
                value += work[i + (MET_ONE if first else MET_TWO)]
                value += s * o * work[i + (CS_ONE if first else CS_TWO)]
                value += _of_phase(teeth, offset, s, work[i + ANGLE], design)
                more = value > best
                best = value if more else best
                mark = (TWO if first else ZERO) + (FOUR if upper else ZERO) if more else mark
                slope = abs(s * d1 + k * t1) if more else slope
            slope += teeth.fs * HALF * design.spacing + turn.waves.slope
            bound, steep = bound_of(-best, slope, work[i + BEND], turn.waves)
            work[i + VALUE], work[i + OFF], work[i + MARK] = -best, bound, mark + steep
    keep(work, found, start, count)


@compiled
def find_greatest_of_waves(work: Singles, lanes: Index, found: Found, design: Design, turn: Turn, steep: Index) -> None:
    """Fill the greatest of the drives of `work`, with `lanes`, `found`, `design`, `turn` and `steep` as for the
    least."""
    crests, waiting = turn.waves.crests, 0
    list_lowest(work, found, crests, True)
    _measure(work, found, 0, LANES, design, turn)
    for i in range(LANES):
        work[GREATEST + i], work[LEAST_SEEN + i] = -HUGE, found.values[i] + work[MARGIN + i]
    count = list_others(work, found, len(crests.turns))
    for start in range(LANES, count, LANES):
        _measure(work, found, start, min(LANES, count - start), design, turn)
    fill_best(work, found, count)
    for j in range(count):
        i, mark = found.lanes[j], found.marks[j]
        if found.bounds[j] <= work[LEAST_SEEN + i]:
            work[LIST + ANGLE + waiting], lanes[waiting] = crests.turns[found.places[j]], i
            work[LIST + ZONE + waiting] = ONE if mark & 2 else -ONE
            work[LIST + RIM + waiting] = ONE if mark & 4 else -ONE
            steep[i] += mark & 1
            waiting += 1
            if waiting == LANES:
                tops.look_at_list(work, lanes, waiting, design, turn)
                waiting = 0
    if waiting:
        tops.look_at_list(work, lanes, waiting, design, turn)
