"""Where the deepest rim of a zone changes: there the driving deviation jumps, and may be least beside any trough.

With the rim the zone's offset changes, and with it what teeth it meets. On either side the least of a wave lies at its
trough or at the change itself.
"""

from __future__ import annotations

import math

import numpy as np

from hdopt.arrays import Index, Singles
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.candidates import direction
from hdopt.kinematics.lanes.motion import FS, LANES, Design, motion_of, place_at, rim_gap
from hdopt.kinematics.lanes.single import HALF, ONE, TINY, ZERO, angle_of, clipped, narrowed, rotated, single
from hdopt.simulation.turn import lows
from hdopt.simulation.turn.effects import Turn
from hdopt.simulation.turn.rows import (
    ANGLE,
    D_0,
    D_COS,
    D_SIN,
    LEAST_SEEN,
    LIST,
    MARGIN,
    OFF,
    PER_TURN,
    T_0,
    T_COS,
    T_SIN,
    VALUE,
)

STEPS = 2
"""Newton's steps to a change from where t vanishes to first order."""
FARTHEST = single(0.3)
"""How far, rad, a step may lead: not as far as the other place where t vanishes."""
CROSSINGS, ZONES = 2, 2
"""How often a turn t vanishes at most, each time changing the rim of both zones."""


@compiled
def _find(work: Singles, design: Design, side: float, s: float) -> None:
    """Fill ANGLE of the first area with where the rim of zone `s` changes, next to one of the two places where t
    vanishes (`side` 1 or -1), VALUE with half the difference of the zones there but for FS teeth and effects, and OFF
    with how far t stays from nought, mm of arc, both to first order."""
    for i in range(LANES):
        along, up, size = direction(work[i + T_COS], work[i + T_SIN])
        share = clipped(-work[i + T_0] / max(size, TINY), -ONE, ONE)
        across = side * math.sqrt(max(ZERO, ONE - share * share))
        cos, sin = share * along - across * up, share * up + across * along
        motion = motion_of(work, i, design)
        for _ in range(STEPS):
            gap, rate = rim_gap(place_at(motion, cos, sin), design, s)
            x = clipped(-gap / (rate if abs(rate) > TINY else TINY), -FARTHEST, FARTHEST)
            cos, sin = rotated(cos, sin, x)
        work[i + ANGLE] = angle_of(sin, cos) * PER_TURN
        work[i + VALUE] = work[i + D_COS] * cos + work[i + D_SIN] * sin + work[i + D_0]
        work[i + OFF] = abs(work[i + T_0]) - size


@compiled
def look_at_changes(work: Singles, lanes: Index, design: Design, turn: Turn) -> None:
    """Lower the least of the drives of `work` to what lies where rims change, if that may lie below LEAST_SEEN, under a
    `design` with the effects of a `turn`; `lanes` (LANES,) is room for a list."""
    n, waiting = len(turn.fixed), 0
    for case in range(CROSSINGS * ZONES):
        _find(work, design, ONE if case < ZONES else -ONE, ONE if case & 1 else -ONE)
        for i in range(LANES):
            turns = work[i + ANGLE]
            k = min(int((turns - np.floor(turns)) * narrowed(n)), n - 1)
            one, two = turn.fixed[k, 0], turn.fixed[k, 3]
            apart = max(ZERO, abs(work[i + VALUE] + HALF * (one - two)) - work[i + FS])
            bound = apart + HALF * (one + two) + turn.waves.on_cs - work[i + MARGIN]
            work[LIST + ANGLE + waiting], lanes[waiting] = turns, i
            waiting += 1 if bound < work[LEAST_SEEN + i] and work[i + OFF] < work[i + MARGIN] else 0
            if waiting == LANES:
                lows.look_at_list(work, lanes, waiting, design, turn, 1)
                waiting = 0
    if waiting:
        lows.look_at_list(work, lanes, waiting, design, turn, 1)
