"""The scan of one turn, all lanes at a time: what each cell's driving deviation cannot fall below, nor exceed.

To first order the driving zone over all FS phases is at least |t| + m + max(0, |d| - a_FS) and at most
|t| + m + |d| + a_FS (`kinematics.lanes.candidates`); effects add their mean m, and half their difference to d. Within a
cell all are taken as straight lines. Then the lower one is convex, so that it is least at an edge, where t vanishes or
where |d| is a_FS; the upper one is largest at an edge. What lines leave out is the margin.
"""

from __future__ import annotations

from hdopt.arrays import Singles
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.candidates import MARGIN_SHARE, at_most, first_order, second_order
from hdopt.kinematics.lanes.motion import FS, LANES, Design, motion_of, teeth_of
from hdopt.kinematics.lanes.single import HALF, HUGE, ONE, TINY, ZERO, clipped, narrowed
from hdopt.simulation.turn.effects import Turn
from hdopt.simulation.turn.rows import (
    BOUNDS,
    D_0,
    D_COS,
    D_SIN,
    HIGH,
    HIGHEST,
    HIGHEST_AT,
    LOW,
    LOWEST,
    LOWEST_AT,
    MARGIN,
    O_0,
    O_COS,
    O_SIN,
    SWING,
    T_0,
    T_COS,
    T_SIN,
    D,
    M,
    T,
)


@compiled
def fill_parts(work: Singles, design: Design, turn: Turn) -> None:
    """Fill the parts of t, d and o, the margin and the swing of the drives that `work` describes, under a `design`,
    with the effects of a `turn`."""
    for i in range(LANES):
        motion, teeth = motion_of(work, i, design), teeth_of(work, i)
        f, per = first_order(motion, teeth, design.tan_alpha), design.rim.per_flatness
        work[i + T_COS], work[i + T_SIN], work[i + T_0] = f.t_cos, f.t_sin, f.t_0
        work[i + D_COS], work[i + D_SIN], work[i + D_0] = f.d_cos, f.d_sin, f.d_0
        work[i + O_COS], work[i + O_SIN], work[i + O_0] = per * motion.el_cos, per * motion.el_sin, per * motion.el_0
        o = per * (at_most(motion.el_cos, motion.el_sin) + abs(motion.el_0))
        rims = per * (at_most(motion.tl_cos, motion.tl_sin) + abs(motion.tl_0))
        # Which rim is deepest, and terms in o^2, the scan leaves out.
        on_cs = min(turn.cs_bend * HALF * (o + rims) * (o + rims) + turn.cs_slope * rims, turn.cs_range)
        swing = at_most(f.t_cos, f.t_sin) + at_most(f.d_cos, f.d_sin)
        work[i + MARGIN] = MARGIN_SHARE * second_order(motion, teeth, design) + turn.scan.sag * swing + on_cs
        work[i + SWING] = turn.scan.half * swing + turn.scan.step


@compiled
def least_of_cell(work: Singles, i: int, t: float, d: float, m: float) -> float:
    """The least of the lower bound of lane `i` of `work` between the edge before and one with these `t`, `d` and `m`,
    mm of arc."""
    t0, d0, m0, a = work[i + T], work[i + D], work[i + M], work[i + FS]
    dt, dd, dm = t - t0, d - d0, m - m0
    least = min(abs(t0) + m0 + max(ZERO, abs(d0) - a), abs(t) + m + max(ZERO, abs(d) - a))
    x = clipped(-t0 / (dt if abs(dt) > TINY else TINY), ZERO, ONE)
    least = min(least, abs(t0 + x * dt) + m0 + x * dm + max(ZERO, abs(d0 + x * dd) - a))
    per = ONE / (dd if abs(dd) > TINY else TINY)
    x = clipped((a - d0) * per, ZERO, ONE)
    least = min(least, abs(t0 + x * dt) + m0 + x * dm + max(ZERO, abs(d0 + x * dd) - a))
    x = clipped((-a - d0) * per, ZERO, ONE)
    last: float = min(least, abs(t0 + x * dt) + m0 + x * dm + max(ZERO, abs(d0 + x * dd) - a))
    return last


@compiled
def scan(work: Singles, turn: Turn) -> None:
    """Fill the bounds of all cells of a `turn` for the drives of `work`, and which are the lowest and the highest."""
    for i in range(LANES):
        work[i + LOWEST], work[i + HIGHEST], work[i + LOWEST_AT], work[i + HIGHEST_AT] = HUGE, -HUGE, ZERO, ZERO
    for g in range(-1, len(turn.scan.below)):
        cos, sin = turn.scan.cos[g + 1], turn.scan.sin[g + 1]
        m_g, d_g = turn.scan.edges[g + 1, 0], turn.scan.edges[g + 1, 1]
        m_o, d_o = turn.scan.edges[g + 1, 2], turn.scan.edges[g + 1, 3]
        below, above, cell = turn.scan.below[max(g, 0)], turn.scan.above[max(g, 0)], narrowed(g)
        for i in range(LANES):
            o = work[i + O_COS] * cos + work[i + O_SIN] * sin + work[i + O_0]
            t = work[i + T_COS] * cos + work[i + T_SIN] * sin + work[i + T_0]
            d = work[i + D_COS] * cos + work[i + D_SIN] * sin + work[i + D_0] + d_g + o * d_o
            m = m_g + o * m_o
            low = least_of_cell(work, i, t, d, m) - below
            before = abs(work[i + T]) + work[i + M] + abs(work[i + D])
            high = max(before, abs(t) + m + abs(d)) + work[i + FS] + above
            work[i + T], work[i + D], work[i + M], work[i + LOW], work[i + HIGH] = t, d, m, low, high
            # The first edge has no cell before it.
            less = low < work[i + LOWEST] and cell >= ZERO
            work[i + LOWEST] = low if less else work[i + LOWEST]
            work[i + LOWEST_AT] = cell if less else work[i + LOWEST_AT]
            more = high > work[i + HIGHEST] and cell >= ZERO
            work[i + HIGHEST] = high if more else work[i + HIGHEST]
            work[i + HIGHEST_AT] = cell if more else work[i + HIGHEST_AT]
        slot = BOUNDS + 2 * LANES * max(g, 0)
        for i in range(LANES):
            work[slot + i] = work[LOW + i]
            work[slot + LANES + i] = work[HIGH + i]
