"""The least driving deviation with a ripple that both zones share: what lies at its troughs, and the best looked at.

At all troughs that may hold the least, the driving deviation is computed to second order over all FS phases, without
slopes: a slope lowers a trough by no more than half its square over the ripple's curvature. Only those that may so
become the least are looked at, and changes of rims.
"""

from __future__ import annotations

import math

import numpy as np

from hdopt.arrays import Index, Singles
from hdopt.kinematics.closed_form import RigidMotion
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.compiled import motion_at, rim_depth, tooth_deviation
from hdopt.kinematics.lanes.minima import GROUP
from hdopt.kinematics.lanes.motion import LANES, Design, Teeth, motion_of, teeth_of
from hdopt.kinematics.lanes.single import HALF, HUGE, ONE, PI, TINY, TURN, ZERO, angle_of, clipped, rotated
from hdopt.simulation.turn import lows
from hdopt.simulation.turn.changes import look_at_changes
from hdopt.simulation.turn.effects import Turn
from hdopt.simulation.turn.places import (
    AT_COS,
    AT_SIN,
    BEND,
    CS_ONE,
    CS_TWO,
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
from hdopt.simulation.turn.rows import ANGLE, LEAST, LEAST_SEEN, LIST, MARGIN, OFF, VALUE


@compiled
def _of_phase(gap: float, flat: float, lift: float, cos: float, sin: float) -> float:
    """What an FS phase by its cosine and sine adds to the mean of both zones."""
    return lift * cos + abs(gap + flat * sin)


@compiled
def _over_phases(gap: float, h: float, d: float, teeth: Teeth, turns: float, design: Design) -> float:
    """What the best of all FS phases adds to the mean of both zones, half of whose difference is `gap` without it, mm
    of arc, and whose offsets o' have half the sum `h` and half the difference `d`, rad, at so many input `turns`."""
    flat = teeth.fs * (ONE - HALF * h * h)
    wanted = clipped(-gap / max(flat, TINY), -ONE, ONE)
    other = math.sqrt(max(ZERO, ONE - wanted * wanted))
    target, here, lift = angle_of(wanted, other), teeth.fs_phase + design.advance * TURN * turns + d, flat * h
    # Phases next to the two at which the gap vanishes.
    off = (here - target) * design.per_spacing
    off = (off - np.floor(off)) * design.spacing
    cos, sin = rotated(other, wanted, off)
    least = _of_phase(gap, flat, lift, cos, sin)
    cos, sin = rotated(other, wanted, off - design.spacing)
    least = min(least, _of_phase(gap, flat, lift, cos, sin))
    off = (here - PI + target) * design.per_spacing
    off = (off - np.floor(off)) * design.spacing
    cos, sin = rotated(-other, wanted, off)
    least = min(least, _of_phase(gap, flat, lift, cos, sin))
    cos, sin = rotated(-other, wanted, off - design.spacing)
    return min(least, _of_phase(gap, flat, lift, cos, sin))


@compiled
def slopes_at(motion: RigidMotion[float], teeth: Teeth, design: Design, cos: float, sin: float) -> tuple[float, float]:
    """The slopes of t and d (`lanes.candidates`) of a drive of `motion` and `teeth` under a `design`, at an input angle
    by `cos` and `sin`, mm of arc/rad."""
    t1 = motion.ta_sin * cos - motion.ta_cos * sin
    d1 = motion.ea_sin * cos - motion.ea_cos * sin
    return design.tan_alpha * t1, design.tan_alpha * d1 + teeth.cs_sin * cos - teeth.cs_cos * sin


@compiled
def _zone(
    work: Singles, i: int, motion: RigidMotion[float], teeth: Teeth, design: Design, s: float
) -> tuple[float, float]:
    """What zone `s` meets at the place of lane `i` without FS teeth, mm of arc, and its offset o', rad."""
    cos, sin, rim = work[i + AT_COS], work[i + AT_SIN], design.rim
    e_a, e_l, t_a, t_l = motion_at(motion, cos, sin)
    upper = t_a + s * (e_l - s * rim.tilt_gain * t_a * t_l) * t_l * rim.per_flatness >= ZERO
    depth, o, offset = rim_depth(rim, e_a, e_l, t_a, t_l, s, ONE if upper else -ONE)
    value = design.tan_alpha * depth
    value += tooth_deviation(teeth.cs_cos, teeth.cs_sin, cos, sin, s, ONE - HALF * o * o, o)
    met, on_cs = (work[i + MET_ONE], work[i + CS_ONE]) if s > ZERO else (work[i + MET_TWO], work[i + CS_TWO])
    return value + met + s * o * on_cs, offset


@compiled
def _measure(work: Singles, found: Found, start: int, count: int, design: Design, turn: Turn) -> None:
    """Fill what `found` tells of its troughs, `count` of them from `start` on."""
    fetch(work, found, start, count, turn.waves.troughs)
    for group in range((count + GROUP - 1) // GROUP):
        for lane in range(GROUP):
            i = LIST + group * GROUP + lane
            motion, teeth = motion_of(work, i, design), teeth_of(work, i)
            one, of_one = _zone(work, i, motion, teeth, design, ONE)
            two, of_two = _zone(work, i, motion, teeth, design, -ONE)
            gap, h, d = HALF * (one - two), HALF * (of_one + of_two), HALF * (of_one - of_two)
            value = HALF * (one + two) + _over_phases(gap, h, d, teeth, work[i + ANGLE], design)
            t1, d1 = slopes_at(motion, teeth, design, work[i + AT_COS], work[i + AT_SIN])
            slope = abs(t1) + abs(d1) + teeth.fs + turn.waves.slope
            work[i + VALUE] = value
            work[i + OFF], work[i + MARK] = bound_of(value, slope, work[i + BEND], turn.waves)
    keep(work, found, start, count)


@compiled
def find_least_of_waves(work: Singles, lanes: Index, found: Found, design: Design, turn: Turn, steep: Index) -> None:
    """Fill the least of the drives of `work`, mm of arc, with the waves of a `turn`, under a `design`; `lanes` (LANES,)
    and `found` are room for lists. Count in `steep` (LANES,) where a drive is too steep for its waves."""
    troughs, waiting = turn.waves.troughs, 0
    list_lowest(work, found, troughs, False)
    _measure(work, found, 0, LANES, design, turn)
    for i in range(LANES):
        work[LEAST + i], work[LEAST_SEEN + i] = HUGE, found.values[i] + work[MARGIN + i]
    count = list_others(work, found, len(troughs.turns))
    for start in range(LANES, count, LANES):
        _measure(work, found, start, min(LANES, count - start), design, turn)
    fill_best(work, found, count)
    for j in range(count):
        i = found.lanes[j]
        if found.bounds[j] <= work[LEAST_SEEN + i]:
            work[LIST + ANGLE + waiting], lanes[waiting] = troughs.turns[found.places[j]], i
            steep[i] += found.marks[j]
            waiting += 1
            if waiting == LANES:
                lows.look_at_list(work, lanes, waiting, design, turn, 1)
                waiting = 0
    if waiting:
        lows.look_at_list(work, lanes, waiting, design, turn, 1)
    look_at_changes(work, lanes, design, turn)
    lows.look_again(work, lanes, design, turn)
