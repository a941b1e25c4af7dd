"""What one lane knows: its drive's motion and teeth, and a branch of the deviation with slope and curvature."""

from __future__ import annotations

from typing import NamedTuple

from hdopt.arrays import Singles
from hdopt.kinematics.closed_form import ErrorComponents, RigidMotion, RimConstants, TipGeometry
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.compiled import motion_at, rigid_motion, rim_depth, tooth_deviation
from hdopt.kinematics.lanes.single import HALF, ONE, TWO

LANES = 128
"""Drives of a block: all that is known of them fits in the first-level cache."""

# Rows of a work area, each of LANES numbers: what describes a drive, and the place that is looked at.
E1_X, E1_Y, TAN_X, TAN_Y, E2_MAJOR, E2_MINOR, TAN_MAJOR, TAN_MINOR = (LANES * row for row in range(8))
CS_COS, CS_SIN, FS, FS_PHASE = (LANES * row for row in range(8, 12))
DESCRIPTION = 12
"""Rows that describe a drive."""
COS, SIN, KIND, VALUE, MOVED = (LANES * row for row in range(12, 17))
AREA = LANES * 17
"""Numbers of a work area."""


class Design(NamedTuple):
    """What all drives of a block share, in single precision.

    The wave generator's tip and rims, tan of the pressure angle, Z_CS/Z_FS, the angle between two FS phases (rad) and
    its reciprocal.
    """

    tip: TipGeometry
    rim: RimConstants
    tan_alpha: float
    advance: float
    spacing: float
    per_spacing: float


class Teeth(NamedTuple):
    """Cosine and sine part of the CS tooth deviation, amplitude (mm of arc) and phase (rad) of the FS one."""

    cs_cos: float
    cs_sin: float
    fs: float
    fs_phase: float


class Place(NamedTuple):
    """An input angle by cosine and sine, with E_a, E_l, T_a, T_l there (mm) and their slopes over it."""

    cos: float
    sin: float
    e_a: float
    e_l: float
    t_a: float
    t_l: float
    e_a1: float
    e_l1: float
    t_a1: float
    t_l1: float


class Branch(NamedTuple):
    """tau of one zone and rim without its FS term (mm of arc), slope and curvature over the input angle; o' and its
    slope."""

    value: float
    slope: float
    bend: float
    offset: float
    offset_slope: float


@compiled
def motion_of(work: Singles, at: int, design: Design) -> RigidMotion[float]:
    """The rigid motion of the drive whose description starts at `at` in `work`, under a `design`."""
    components = ErrorComponents(
        work[at + E1_X],
        work[at + E1_Y],
        work[at + TAN_X],
        work[at + TAN_Y],
        work[at + E2_MAJOR],
        work[at + E2_MINOR],
        work[at + TAN_MAJOR],
        work[at + TAN_MINOR],
    )
    return rigid_motion(design.tip, components)


@compiled
def teeth_of(work: Singles, at: int) -> Teeth:
    """The teeth of the drive whose description starts at `at` in `work`."""
    return Teeth(work[at + CS_COS], work[at + CS_SIN], work[at + FS], work[at + FS_PHASE])


@compiled
def place_at(motion: RigidMotion[float], cos: float, sin: float) -> Place:
    """The drive of `motion` at the input angle with cosine `cos` and sine `sin`."""
    e_a, e_l, t_a, t_l = motion_at(motion, cos, sin)
    e_a1 = motion.ea_sin * cos - motion.ea_cos * sin
    twist = motion.twist_cos * cos + motion.twist_sin * sin + motion.twist_0
    twist1 = motion.twist_sin * cos - motion.twist_cos * sin
    e_l1 = motion.el_sin * cos - motion.el_cos * sin - e_a1 * twist - e_a * twist1
    t_a1 = motion.ta_sin * cos - motion.ta_cos * sin
    t_l1 = motion.tl_sin * cos - motion.tl_cos * sin
    return Place(cos, sin, e_a, e_l, t_a, t_l, e_a1, e_l1, t_a1, t_l1)


@compiled
def branch_at(place: Place, motion: RigidMotion[float], teeth: Teeth, design: Design, s: float, k: float) -> Branch:
    """The branch of zone `s` and rim `k` (+1 or -1) at a `place` of the drive of `motion` and `teeth`, under a
    `design`.

    The curvature holds what is of first order and the bow of the contour.
    """
    p, rim = place, design.rim
    depth, o, offset = rim_depth(rim, p.e_a, p.e_l, p.t_a, p.t_l, s, k)
    value = design.tan_alpha * depth
    value += tooth_deviation(teeth.cs_cos, teeth.cs_sin, p.cos, p.sin, s, ONE - HALF * o * o, o)
    shift1 = p.e_l1 + s * k * p.t_l1
    q1 = shift1 - s * rim.tilt_gain * (p.t_a1 * p.t_l + p.t_a * p.t_l1)
    depth1 = s * p.e_a1 + k * p.t_a1 - TWO * rim.bow * p.t_a * p.t_a1 + o * q1
    cs = teeth.cs_cos * p.cos + teeth.cs_sin * p.sin
    cs1 = teeth.cs_sin * p.cos - teeth.cs_cos * p.sin
    o1 = q1 * rim.per_flatness
    slope = design.tan_alpha * depth1 + s * (cs1 - s * o * cs) * (ONE + s * o1)
    bend = -design.tan_alpha * (s * (p.e_a - motion.ea_0) + k * (p.t_a - motion.ta_0) - q1 * o1) - s * cs
    return Branch(value, slope, bend, offset, o1 - shift1 * rim.per_major)


@compiled
def rim_gap(place: Place, design: Design, s: float) -> tuple[float, float]:
    """Half of what the upper rim lies deeper than the lower one in zone `s` at a `place`, mm, and its
    slope, under a `design`.

    Written without the difference of two depths, so that rims that change together do so to the last digit.
    """
    p, rim = place, design.rim
    across = p.e_l - s * rim.tilt_gain * p.t_a * p.t_l
    across1 = p.e_l1 - s * rim.tilt_gain * (p.t_a1 * p.t_l + p.t_a * p.t_l1)
    gap = p.t_a + s * across * p.t_l * rim.per_flatness
    return gap, p.t_a1 + s * (across1 * p.t_l + across * p.t_l1) * rim.per_flatness
