"""Where the least driving deviation can lie to first order: ten input angles, each with the deviation there.

With t = tan(alpha) T_a and d = tan(alpha) E_a + the CS term, both c + R cos(theta - psi), the driving zone over all FS
phases is at least |t| + max(0, |d| - a_FS). It is least at the peaks or troughs of d + t or d - t (four angles), where
t vanishes or is nearest to it (two), or where d is a_FS or -a_FS (two each).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from hdopt.arrays import Singles
from hdopt.kinematics.closed_form import RigidMotion
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.motion import AREA, COS, KIND, LANES, SIN, Design, Teeth, motion_of, teeth_of
from hdopt.kinematics.lanes.single import HALF, HUGE, ONE, TINY, TWO, ZERO, clipped, single

CANDIDATES = 10
BOUNDS = AREA
"""Where the candidates' deviations start, in rows of lanes; then their cosines and sines."""
COSINES = BOUNDS + CANDIDATES * LANES
SINES = COSINES + CANDIDATES * LANES
LEADING = SINES + CANDIDATES * LANES
"""Which candidate is the least."""
KINDS = LEADING + LANES
"""The kind of the pair where t vanishes."""
MARGIN = KINDS + LANES
"""By how much terms of second order may lower a candidate, mm."""
ROOM = MARGIN + LANES
"""Numbers of the first work area with its candidates."""

VERTEX, RIM_CHANGE, FLAT, TANGENT, FIXED = (single(float(kind)) for kind in range(5))
"""Kinds of candidates: where the driving deviation is flat, where the deepest rim changes, where t touches zero within
second order, where |d| is a_FS; and places that are looked at as they are."""
MARGIN_SHARE = single(0.5)
"""How much of the bound of second order a candidate is granted: granting all of it takes a tenth longer and
brings a tenth fewer of 4,800 drives at three times the shipped tolerances beyond 1e-3 arcmin."""
RIM_CHANGES, PAST_RIM_CHANGES = TWO + TWO, TWO * (TWO + ONE)
"""Numbers of the first candidate where t vanishes, and of the first after them."""


class FirstOrder(NamedTuple):
    """Cosine part, sine part and constant of t and d, and the FS amplitude; mm of arc."""

    t_cos: float
    t_sin: float
    t_0: float
    d_cos: float
    d_sin: float
    d_0: float
    fs: float


class Candidate(NamedTuple):
    """An input angle by cosine and sine, the first-order deviation there (mm of arc), its number."""

    bound: float
    cos: float
    sin: float
    number: float


class Level(NamedTuple):
    """Where a sinusoid that peaks at (cos, sin) is `share` of its peak."""

    cos: float
    sin: float
    share: float


@compiled
def first_order(motion: RigidMotion[float], teeth: Teeth, tan_alpha: float) -> FirstOrder:
    """t and d of a drive of `motion` and `teeth` under a pressure angle of tangent `tan_alpha`."""
    return FirstOrder(
        tan_alpha * motion.ta_cos,
        tan_alpha * motion.ta_sin,
        tan_alpha * motion.ta_0,
        tan_alpha * motion.ea_cos + teeth.cs_cos,
        tan_alpha * motion.ea_sin + teeth.cs_sin,
        tan_alpha * motion.ea_0,
        teeth.fs,
    )


@compiled
def direction(c: float, s: float) -> tuple[float, float, float]:
    """Where c cos + s sin peaks, by cosine and sine, from its parts `c` and `s`; and the peak. (1, 0) if both are 0."""
    size = math.sqrt(c * c + s * s)
    per_size = ONE / max(size, TINY)
    return (c * per_size if size > TINY else ONE), (s * per_size if size > TINY else ZERO), size


@compiled
def at_most(c: float, s: float) -> float:
    """A bound of the length of (`c`, `s`), 12 % above it at most: cheaper than a root."""
    return max(abs(c), abs(s)) + HALF * min(abs(c), abs(s))


@compiled
def second_order(motion: RigidMotion[float], teeth: Teeth, design: Design) -> float:
    """By how much terms of second order may lower the deviation of a drive of `motion` and `teeth` under a `design`, mm
    of arc."""
    t_max = at_most(motion.ta_cos, motion.ta_sin) + abs(motion.ta_0)
    l_max = at_most(motion.el_cos, motion.el_sin) + abs(motion.el_0)
    l_max += at_most(motion.tl_cos, motion.tl_sin) + abs(motion.tl_0)
    offset = l_max * design.rim.per_flatness
    of_depth = design.rim.bow * t_max * t_max + HALF * l_max * offset
    return design.tan_alpha * of_depth + (at_most(teeth.cs_cos, teeth.cs_sin) + teeth.fs) * offset


@compiled
def _found(f: FirstOrder, cos: float, sin: float, number: float) -> Candidate:
    t = f.t_cos * cos + f.t_sin * sin + f.t_0
    d = f.d_cos * cos + f.d_sin * sin + f.d_0
    return Candidate(abs(t) + max(ZERO, abs(d) - f.fs), cos, sin, number)


@compiled
def _better(work: Singles, slot: int, found: Candidate, best: Candidate) -> Candidate:
    """The better of `best` and `found`, which is stored at a `slot` of `work`."""
    work[slot + BOUNDS], work[slot + COSINES], work[slot + SINES] = found.bound, found.cos, found.sin
    less = found.bound < best.bound
    return Candidate(
        found.bound if less else best.bound,
        found.cos if less else best.cos,
        found.sin if less else best.sin,
        found.number if less else best.number,
    )


@compiled
def _best_of_pair(work: Singles, slot: int, f: FirstOrder, level: Level, number: float, best: Candidate) -> Candidate:
    """The better of `best` and both angles of a `level`, stored at a `slot` and the next one."""
    share = clipped(level.share, -ONE, ONE)
    # A level that is never reached has no angle.
    barred = ZERO if abs(level.share) <= ONE else HUGE
    side = math.sqrt(max(ZERO, ONE - share * share))
    c, s = share * level.cos, share * level.sin
    one = _found(f, c - side * level.sin, s + side * level.cos, number)
    two = _found(f, c + side * level.sin, s - side * level.cos, number + ONE)
    one = Candidate(one.bound + barred, one.cos, one.sin, one.number)
    two = Candidate(two.bound + barred, two.cos, two.sin, two.number)
    return _better(work, slot + LANES, two, _better(work, slot, one, best))


@compiled
def fill_candidates(work: Singles, design: Design) -> None:
    """Fill the candidates of all lanes of `work`, whose drives are described in its first area, under a `design`; the
    least of each becomes the place that is looked at."""
    for i in range(LANES):
        motion, teeth = motion_of(work, i, design), teeth_of(work, i)
        f = first_order(motion, teeth, design.tan_alpha)
        u_c, u_s, _ = direction(f.d_cos + f.t_cos, f.d_sin + f.t_sin)
        v_c, v_s, _ = direction(f.d_cos - f.t_cos, f.d_sin - f.t_sin)
        best = Candidate(HUGE + HUGE, ONE, ZERO, ZERO)
        best = _better(work, i, _found(f, u_c, u_s, ZERO), best)
        best = _better(work, i + LANES, _found(f, -u_c, -u_s, ONE), best)
        best = _better(work, i + 2 * LANES, _found(f, v_c, v_s, TWO), best)
        best = _better(work, i + 3 * LANES, _found(f, -v_c, -v_s, TWO + ONE), best)
        c, s, size = direction(f.t_cos, f.t_sin)
        share = -f.t_0 / max(size, TINY)
        margin = MARGIN_SHARE * second_order(motion, teeth, design)
        beyond = abs(f.t_0) - size
        kind = VERTEX if beyond > ZERO else RIM_CHANGE
        kind = FLAT if abs(beyond) < margin else kind
        nearest = Level(c, s, clipped(share, -ONE, ONE))
        best = _best_of_pair(work, i + 4 * LANES, f, nearest, TWO + TWO, best)
        c, s, size = direction(f.d_cos, f.d_sin)
        per_size = ONE / max(size, TINY)
        above = Level(c, s, (f.fs - f.d_0) * per_size)
        best = _best_of_pair(work, i + 6 * LANES, f, above, TWO * (TWO + ONE), best)
        below = Level(c, s, (-f.fs - f.d_0) * per_size)
        best = _best_of_pair(work, i + 8 * LANES, f, below, TWO * (TWO + TWO), best)
        work[i + COS], work[i + SIN], work[i + LEADING] = best.cos, best.sin, best.number
        later = kind if best.number < PAST_RIM_CHANGES else TANGENT
        work[i + KIND] = VERTEX if best.number < RIM_CHANGES else later
        work[i + KINDS], work[i + MARGIN] = kind, margin
