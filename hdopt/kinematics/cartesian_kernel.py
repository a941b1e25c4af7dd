"""The compiled pass behind `hdopt.kinematics.cartesian`: value, driving zone and slopes at many angles at once.

Angles are worked on in blocks, side by side and without branches, so that the compiler gives each of them a lane of
the processor's vectors: first both zones, then the teeth that were measured, then the zone that drives and its slopes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.kinematics.closed_form import ErrorComponents, RigidMotion, RimConstants, TipGeometry
from hdopt.kinematics.compiled_closed_form import (
    allocating,
    compiled,
    entry,
    inlined,
    motion_at,
    rigid_motion,
    rim_constants,
    rim_depth,
    tooth_deviation,
)
from hdopt.kinematics.essential import between

SLOPE_CELLS = 0.01
"""Half the step, in places of a table of measured teeth, over which its slope is taken."""
BLOCK = 128
"""Angles worked on at a time: all that is known of them stays in the nearest cache."""

# Rows of the work array, each of BLOCK numbers: a constant distance apart, so that the compiler sees that they do not
# overlap. First what comes in, then what is known of either zone, then what goes out.
COS, SIN, COS_FS, SIN_FS, EXTRA, RISE = (BLOCK * row for row in (0, 1, 2, 3, 4, 6))
ZONE = 10 * BLOCK
TAU, RIM, OFFSET, OFFSET_FS, SIN_O, COS_O, SIN_OF, COS_OF, RISE_CS, RISE_FS = (BLOCK * row for row in range(10))
ZONE_ROWS = 10 * BLOCK
VALUE = ZONE + 2 * ZONE_ROWS
DRIVES = VALUE + BLOCK
SLOPES = DRIVES + BLOCK
PARAMETERS = 12
SINE = SLOPES + PARAMETERS * BLOCK
COSINE, MULTIPLE_SINE, MULTIPLE_COSINE = SINE + BLOCK, SINE + 2 * BLOCK, SINE + 3 * BLOCK
WORK = SINE + 4 * BLOCK


class OnSplines(NamedTuple):
    """Deviations that stand on the splines, mm of arc: over one turn of CS and FS as their measured teeth have them
    (empty where they were not measured), and, (2, h), of sine and cosine of 1 to h times the angle at which CS and FS
    are met (of no columns where there are none)."""

    cs_table: Array
    fs_table: Array
    cs_waves: Array
    fs_waves: Array


class Gear(NamedTuple):
    """Constants of a gear's wave generator, tan of its pressure angle, and arcmin per mm of arc (`scale`)."""

    tip: TipGeometry
    tan_alpha: float
    scale: float


class Found(NamedTuple):
    """The error (arcmin, n), the driving zone (0 or 1, n) and the slopes (arcmin/mm, 12 x n)."""

    value: Array
    zone: Index
    slopes: Array


@inlined
def _sine_cosine(x: float) -> tuple[float, float]:
    """sin and cos of `x` (rad) to 1e-13 by their series, after the nearest multiple of pi is taken out: no branch."""
    half_turns = np.floor(x * (1 / math.pi) + 0.5)
    x = x - half_turns * math.pi
    sign = 1.0 - 2.0 * (half_turns - 2.0 * np.floor(half_turns * 0.5))
    y = x * x
    sine = 1 - y / 110 * (1 - y / 156 * (1 - y / 210 * (1 - y / 272 * (1 - y / 342))))
    sine = x * (1 - y / 6 * (1 - y / 20 * (1 - y / 42 * (1 - y / 72 * sine))))
    cosine = 1 - y / 90 * (1 - y / 132 * (1 - y / 182 * (1 - y / 240 * (1 - y / 306 * (1 - y / 380)))))
    cosine = 1 - y / 2 * (1 - y / 12 * (1 - y / 30 * (1 - y / 56 * cosine)))
    return sign * sine, sign * cosine


@inlined
def _one_of(other: bool, there: float, here: float) -> float:
    """`there` where `other`, else `here`; both are known, so that the compiler needs no branch."""
    return there if other else here


@inlined
def _motion_of(tip: TipGeometry, p: Array) -> RigidMotion[float]:
    """What the errors `p` (12,) mm make of the wave generator of `tip`."""
    half = tip.half_width
    return rigid_motion(
        tip, ErrorComponents(p[0], p[1], p[2] / half, p[3] / half, p[4], p[5], p[6] / half, p[7] / half)
    )


@inlined
def _copy(given: Array, out: Array, at: int) -> None:
    """Copy `given` (n,) into `out` from `at` on. What an assignment of slices may raise takes seconds to compile."""
    for i in range(len(given)):
        out[at + i] = given[i]


@compiled
def _both_zones(work: Array, rim: RimConstants, motion: RigidMotion[float], p: Array, tan_alpha: float) -> None:
    """Deviation (mm of arc), deeper rim and offsets of either zone at the angles in `work`, without measured teeth;
    `rim` has the wave generator's constants, `motion` what the errors `p` (12,) make of it."""
    cs_cos, cs_sin, fs_cos, fs_sin = p[9], p[8], p[11], p[10]
    for number in range(2):
        z, at = 1.0 - 2.0 * number, ZONE + number * ZONE_ROWS
        extra = EXTRA + number * BLOCK
        for i in range(BLOCK):
            c, s, cf, sf = work[COS + i], work[SIN + i], work[COS_FS + i], work[SIN_FS + i]
            e_a, e_l, t_a, t_l = motion_at(motion, c, s)
            high, o_high, of_high = rim_depth(rim, e_a, e_l, t_a, t_l, z, 1.0)
            low, o_low, of_low = rim_depth(rim, e_a, e_l, t_a, t_l, z, -1.0)
            lower = low > high
            depth, o, of = (low if lower else high), (o_low if lower else o_high), (of_low if lower else of_high)
            sin_o, cos_o = _sine_cosine(o)
            sin_of, cos_of = _sine_cosine(of)
            tau = depth * tan_alpha + tooth_deviation(cs_cos, cs_sin, c, s, z, cos_o, sin_o)
            tau += tooth_deviation(fs_cos, fs_sin, cf, sf, z, cos_of, sin_of)
            work[at + TAU + i] = tau + work[extra + i]
            work[at + RIM + i] = -1.0 if lower else 1.0
            work[at + OFFSET + i], work[at + OFFSET_FS + i] = o, of
            work[at + SIN_O + i], work[at + COS_O + i] = sin_o, cos_o
            work[at + SIN_OF + i], work[at + COS_OF + i] = sin_of, cos_of
            work[at + RISE_CS + i] = work[RISE + number * BLOCK + i]
            work[at + RISE_FS + i] = work[RISE + (2 + number) * BLOCK + i]


@compiled
def _add_measured(work: Array, table: Array, cos: int, sin: int, offset: int, rise: int) -> None:
    """Adds a `table` of measured teeth (mm of arc over a turn) to the deviation of either zone in `work`, and its slope
    (mm/rad) to the row `rise`; `cos`, `sin` are the rows of the teeth's angle, `offset` that of what lies beyond."""
    n = len(table)
    for number in range(2):
        z, at = 1.0 - 2.0 * number, ZONE + number * ZONE_ROWS
        for i in range(BLOCK):
            beyond = z * work[at + offset + i] + number * math.pi
            place = (math.atan2(work[sin + i], work[cos + i]) + beyond) / (2 * math.pi) * n
            slope = between(table, place + SLOPE_CELLS) - between(table, place - SLOPE_CELLS)
            work[at + TAU + i] += between(table, place)
            work[at + rise + i] += slope / (2 * SLOPE_CELLS) * n / (2 * math.pi)


@compiled
def _add_waves(work: Array, waves: Array, cos: int, sin: int, cos_o: int, sin_o: int, rise: int) -> None:
    """Adds `waves` round a spline (2, h), mm of arc, of sine and cosine of 1 to h times the angle at which it is met,
    to the deviation of either zone in `work`, and their slope (mm/rad) to the row `rise`; `cos`, `sin` are the rows of
    the teeth's angle, `cos_o`, `sin_o` those of what lies beyond."""
    for number in range(2):
        z, at = 1.0 - 2.0 * number, ZONE + number * ZONE_ROWS
        for i in range(BLOCK):
            c, s, co, so = work[cos + i], work[sin + i], work[at + cos_o + i], work[at + sin_o + i]
            work[SINE + i] = work[MULTIPLE_SINE + i] = z * s * co + c * so
            work[COSINE + i] = work[MULTIPLE_COSINE + i] = z * c * co - s * so
        for h in range(waves.shape[1]):
            a, b, multiple = waves[0, h], waves[1, h], h + 1.0
            for i in range(BLOCK):
                s, c = work[MULTIPLE_SINE + i], work[MULTIPLE_COSINE + i]
                work[at + TAU + i] += a * s + b * c
                work[at + rise + i] += multiple * (a * c - b * s)
                work[MULTIPLE_SINE + i] = s * work[COSINE + i] + c * work[SINE + i]
                work[MULTIPLE_COSINE + i] = c * work[COSINE + i] - s * work[SINE + i]


@compiled
def _driving(
    work: Array,
    tip: TipGeometry,
    rim: RimConstants,
    motion: RigidMotion[float],
    p: Array,
    tan_alpha: float,
    scale: float,
) -> None:
    """The zone that drives at the angles in `work`, the error (arcmin) and its slopes (arcmin/mm); `rim` and
    `motion` as for `_both_zones`, the others as for `evaluated`."""
    first, second = ZONE, ZONE + ZONE_ROWS
    cs_cos, cs_sin, fs_cos, fs_sin = p[9], p[8], p[11], p[10]
    for i in range(BLOCK):
        c, s, cf, sf = work[COS + i], work[SIN + i], work[COS_FS + i], work[SIN_FS + i]
        other = work[second + TAU + i] > work[first + TAU + i]
        z = -1.0 if other else 1.0
        k = _one_of(other, work[second + RIM + i], work[first + RIM + i])
        o = _one_of(other, work[second + OFFSET + i], work[first + OFFSET + i])
        sin_o = _one_of(other, work[second + SIN_O + i], work[first + SIN_O + i])
        cos_o = _one_of(other, work[second + COS_O + i], work[first + COS_O + i])
        sin_of = _one_of(other, work[second + SIN_OF + i], work[first + SIN_OF + i])
        cos_of = _one_of(other, work[second + COS_OF + i], work[first + COS_OF + i])
        rise_cs = _one_of(other, work[second + RISE_CS + i], work[first + RISE_CS + i])
        rise_fs = _one_of(other, work[second + RISE_FS + i], work[first + RISE_FS + i])
        _, _, t_a, t_l = motion_at(motion, c, s)
        so, co = s * cos_o + z * c * sin_o, c * cos_o - z * s * sin_o
        sof, cof = sf * cos_of + z * cf * sin_of, cf * cos_of - z * sf * sin_of
        # d tau = tan_alpha d depth + (d tau/d o) d o + (d tau/d o') d o', where o = q/flatness and o' = o - shift/L_W,
        # first by the motions e_a, e_l, t_a, t_l of the rim.
        slope_cs = cs_sin * co - cs_cos * so + z * rise_cs
        slope_fs = fs_sin * cof - fs_cos * sof + z * rise_fs
        by_q = tan_alpha * o + (slope_cs + slope_fs) * rim.per_flatness
        by_shift = by_q - slope_fs / tip.semi_major
        by_e_a = scale * tan_alpha * z * tip.passes_major
        by_e_l = scale * by_shift * tip.passes_minor
        by_t_a = scale * (tan_alpha * (k - 2 * rim.bow * t_a) - by_q * z * rim.tilt_gain * t_l)
        by_t_l = scale * (by_shift * z * k - by_q * z * rim.tilt_gain * t_a)
        work[VALUE + i] = scale * _one_of(other, work[second + TAU + i], work[first + TAU + i])
        work[DRIVES + i] = 1.0 if other else 0.0
        work[SLOPES + i] = by_e_a * s + by_e_l * c
        work[SLOPES + BLOCK + i] = by_e_a * c - by_e_l * s
        work[SLOPES + 2 * BLOCK + i] = by_t_a * s + by_t_l * c
        work[SLOPES + 3 * BLOCK + i] = by_t_a * c - by_t_l * s
        work[SLOPES + 4 * BLOCK + i] = by_e_a
        work[SLOPES + 5 * BLOCK + i] = by_e_l
        work[SLOPES + 6 * BLOCK + i] = by_t_a
        work[SLOPES + 7 * BLOCK + i] = by_t_l
        work[SLOPES + 8 * BLOCK + i] = scale * z * so
        work[SLOPES + 9 * BLOCK + i] = scale * z * co
        work[SLOPES + 10 * BLOCK + i] = scale * z * sof
        work[SLOPES + 11 * BLOCK + i] = scale * z * cof


@allocating
def evaluated_into(
    rotation: Array, gear: Gear, p: Array, extra: Array, rises: Array, teeth: OnSplines, found: Found
) -> None:
    """As `evaluated`, into the arrays of `found`; `rotation`, `gear`, `p`, `extra`, `rises` and `teeth` as there."""
    cs, fs, waves_cs, waves_fs = teeth
    tip, tan_alpha, scale = gear
    value, zone, slopes = found
    n = rotation.shape[1]
    work = np.zeros(WORK)
    rim, motion = rim_constants(tip), _motion_of(tip, p)
    has_rises = rises.shape[2] == n and n > 1
    for k in range(4):
        at = RISE + k * BLOCK
        work[at : at + BLOCK] = 0.0 if has_rises else rises[k // 2, k % 2, 0]
    has_extra = extra.shape[1] == n and n > 1
    for number in range(2):
        work[EXTRA + number * BLOCK : EXTRA + (number + 1) * BLOCK] = 0.0 if has_extra else extra[number, 0]
    for start in range(0, n, BLOCK):
        rows = min(BLOCK, n - start)
        for row in range(4):
            _copy(rotation[row, start : start + rows], work, row * BLOCK)
        if has_extra:
            for number in range(2):
                _copy(extra[number, start : start + rows], work, EXTRA + number * BLOCK)
        if has_rises:
            for k in range(4):
                _copy(rises[k // 2, k % 2, start : start + rows], work, RISE + k * BLOCK)
        _both_zones(work, rim, motion, p, tan_alpha)
        if len(cs) > 0:
            _add_measured(work, cs, COS, SIN, OFFSET, RISE_CS)
        if len(fs) > 0:
            _add_measured(work, fs, COS_FS, SIN_FS, OFFSET_FS, RISE_FS)
        if waves_cs.shape[1] > 0:
            _add_waves(work, waves_cs, COS, SIN, COS_O, SIN_O, RISE_CS)
        if waves_fs.shape[1] > 0:
            _add_waves(work, waves_fs, COS_FS, SIN_FS, COS_OF, SIN_OF, RISE_FS)
        _driving(work, tip, rim, motion, p, tan_alpha, scale)
        _copy(work[VALUE : VALUE + rows], value, start)
        for i in range(rows):
            zone[start + i] = np.int64(work[DRIVES + i])
        for row in range(PARAMETERS):
            at = SLOPES + row * BLOCK
            _copy(work[at : at + rows], slopes[row], start)


@entry
def evaluated(
    rotation: Array, gear: Gear, p: Array, extra: Array, rises: Array, teeth: OnSplines
) -> tuple[Array, Index, Array]:
    """The error (arcmin, n), the driving zone (0 or 1, n) and the slopes (arcmin/mm, 12 x n) of a `gear` at a
    `rotation` (4, n).

    `p` are the errors (12,) mm, `extra` what is added to either zone, (2, n) or (2, 1), mm of arc, and `rises` its
    slope over the angle at which CS and FS are met, (2, 2, n) or (2, 2, 1), mm/rad; `teeth` is what stands on the
    splines besides the errors' sines.
    """
    n = rotation.shape[1]
    found = Found(np.empty(n), np.empty(n, np.int64), np.empty((PARAMETERS, n)))
    evaluated_into(rotation, gear, p, extra, rises, teeth, found)
    return found.value, found.zone, found.slopes


@entry
def beyond(rotation: Array, tip: TipGeometry, p: Array) -> Array:
    """How far the deepest point of each zone lies beyond its end of the major axis, rad, (2, 2, n): s o and s o', first
    the spline (CS, FS), then the zone with s +1 and -1. `rotation`, `tip` and `p` as for `evaluated`."""
    n = rotation.shape[1]
    found = np.empty((2, 2, n))
    rim, motion = rim_constants(tip), _motion_of(tip, p)
    for number in range(2):
        z = 1.0 - 2.0 * number
        for i in range(n):
            e_a, e_l, t_a, t_l = motion_at(motion, rotation[0, i], rotation[1, i])
            high, o_high, of_high = rim_depth(rim, e_a, e_l, t_a, t_l, z, 1.0)
            low, o_low, of_low = rim_depth(rim, e_a, e_l, t_a, t_l, z, -1.0)
            lower = low > high
            found[0, number, i] = z * (o_low if lower else o_high)
            found[1, number, i] = z * (of_low if lower else of_high)
    return found
