"""The greatest driving deviation, in lanes: the crest of each zone and rim, the best of them looked at again."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hdopt.arrays import Singles
from hdopt.kinematics.closed_form import RigidMotion
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.candidates import direction, first_order
from hdopt.kinematics.lanes.motion import (
    LANES,
    VALUE,
    Branch,
    Design,
    Teeth,
    branch_at,
    motion_of,
    place_at,
    teeth_of,
)
from hdopt.kinematics.lanes.single import (
    HALF,
    HALF_PI,
    ONE,
    PI,
    TINY,
    ZERO,
    angle_of,
    clipped,
    rotated,
    single,
)

FARTHEST = single(0.2)
"""How far, rad, a crest may lie from its first-order place."""


class Angle(NamedTuple):
    """An input angle by cosine and sine, and itself, rad."""

    cos: float
    sin: float
    angle: float


class Crest(NamedTuple):
    """A crest of zone s and rim k: tau by a parabola, its place by cosine and sine, how far the FS phase is from its
    own crest there, the offset o' and how far the crest is from the place; rad."""

    value: float
    cos: float
    sin: float
    s: float
    k: float
    off: float
    offset: float
    step: float


@compiled
def crest_of(at: Branch, teeth: Teeth, design: Design, angle: Angle, s: float, k: float, farthest: float) -> Crest:
    """The crest of zone `s` and rim `k` near an `angle`, over all FS phases of the `teeth` under a `design`, at most
    `farthest` (rad) away; `at` is the branch there."""
    off = design.advance * angle.angle + teeth.fs_phase + s * at.offset - s * HALF_PI
    off = off * design.per_spacing
    off = (off - np.floor(off)) * design.spacing
    rate = design.advance + s * at.offset_slope
    stiffness = max(teeth.fs * rate * rate - at.bend, TINY)
    per_stiffness = ONE / stiffness
    # The next phase is a spacing farther back.
    back = off - design.spacing
    slope, before = at.slope - teeth.fs * rate * off, at.slope - teeth.fs * rate * back
    # A branch that is flat to first order has no stiffness: the step ends somewhere all the same.
    ahead = clipped(slope * per_stiffness, -farthest, farthest)
    astern = clipped(before * per_stiffness, -farthest, farthest)
    gained = ahead * (slope + slope - ahead * stiffness) - teeth.fs * off * off
    gained_before = astern * (before + before - astern * stiffness) - teeth.fs * back * back
    other = gained_before > gained
    step = astern if other else ahead
    value = at.value + HALF * (gained_before if other else gained)
    return Crest(value, angle.cos, angle.sin, s, k, back if other else off, at.offset, step)


@compiled
def _crest(motion: RigidMotion[float], teeth: Teeth, design: Design, angle: Angle, s: float, k: float) -> Crest:
    """The crest of zone s and rim k near the angle, over all FS phases."""
    at = branch_at(place_at(motion, angle.cos, angle.sin), motion, teeth, design, s, k)
    return crest_of(at, teeth, design, angle, s, k, FARTHEST)


@compiled
def _higher(one: Crest, two: Crest) -> Crest:
    other = two.value > one.value
    return Crest(
        two.value if other else one.value,
        two.cos if other else one.cos,
        two.sin if other else one.sin,
        two.s if other else one.s,
        two.k if other else one.k,
        two.off if other else one.off,
        two.offset if other else one.offset,
        two.step if other else one.step,
    )


@compiled
def top_of(at: Branch, teeth: Teeth, design: Design, crest: Crest, farthest: float) -> float:
    """The height of a `crest`, mm of arc, from a parabola of the branch `at` the place to which the first one led, at
    most `farthest` (rad) away; `teeth` and `design` as before."""
    rate = design.advance + crest.s * at.offset_slope
    off = crest.off + design.advance * crest.step + crest.s * (at.offset - crest.offset)
    cos, sin = rotated(ONE, ZERO, off)
    slope = at.slope - teeth.fs * rate * sin
    bend = at.bend - teeth.fs * rate * rate * cos
    step = clipped(slope / max(-bend, TINY), -farthest, farthest)
    return at.value + teeth.fs * cos + step * (slope + HALF * step * bend)


@compiled
def _top(motion: RigidMotion[float], teeth: Teeth, design: Design, crest: Crest) -> float:
    """The height of a crest, at the place to which its first parabola led."""
    cos, sin = rotated(crest.cos, crest.sin, crest.step)
    at = branch_at(place_at(motion, cos, sin), motion, teeth, design, crest.s, crest.k)
    return top_of(at, teeth, design, crest, FARTHEST)


@compiled
def fill_highest(work: Singles, design: Design) -> None:
    """Fill VALUE of the first area of `work` with the greatest driving deviation of its drives under a `design`, mm of
    arc."""
    for i in range(LANES):
        motion, teeth = motion_of(work, i, design), teeth_of(work, i)
        f = first_order(motion, teeth, design.tan_alpha)
        u_c, u_s, _ = direction(f.d_cos + f.t_cos, f.d_sin + f.t_sin)
        v_c, v_s, _ = direction(f.d_cos - f.t_cos, f.d_sin - f.t_sin)
        u, v = Angle(u_c, u_s, angle_of(u_s, u_c)), Angle(v_c, v_s, angle_of(v_s, v_c))
        best = _crest(motion, teeth, design, u, ONE, ONE)
        best = _higher(best, _crest(motion, teeth, design, v, ONE, -ONE))
        best = _higher(best, _crest(motion, teeth, design, Angle(-v.cos, -v.sin, v.angle + PI), -ONE, ONE))
        best = _higher(best, _crest(motion, teeth, design, Angle(-u.cos, -u.sin, u.angle + PI), -ONE, -ONE))
        work[i + VALUE] = _top(motion, teeth, design, best)
