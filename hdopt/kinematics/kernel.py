"""The compiled kernel: converged peak-to-peak of one drive in well under a microsecond.

To first order every branch of tau (zone s, rim k) is one sinusoid of the input angle. With t = tan(alpha) T_a and
d = tan(alpha) E_a + the CS term, both c + R cos(theta - psi), the driving zone over all FS phases reaches

    |t| + |d| + a_FS  at most,        |t| + max(0, |d| - a_FS)  at least.

The extremes of these two lie at known angles: peaks and troughs of |t| +- |d|, zeros of t, and where |d| = a_FS.
The second-order terms of the closed form and the discrete FS phases move them a little. So around the few candidates
that can still win, every branch is a parabola with the closed form's own value and slope: a peak is raised by a Newton
step, and a minimum is the lowest point of the higher zone on each stretch between changes of the deepest rim, its ends
included, for the FS phases next to where both zones drive equally.
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

import numpy as np

from hdopt.arrays import Array
from hdopt.kinematics.closed_form import ErrorComponents, RigidMotion, RimConstants, TipGeometry
from hdopt.kinematics.compiled_closed_form import (
    compiled,
    entry,
    inlined,
    motion_at,
    rigid_motion,
    rim_constants,
    rim_depth,
    tooth_deviation,
)

REACH = 0.12
"""How far, in rad, an extreme may lie from its first-order place."""
NEAR = 0.03
"""How far, in rad, the parabolas of a polishing step reach."""
POLISHES = 1
PARABOLA_SHARE = 0.1
"""Share of the second-order terms by which a parabola over `REACH` may be wrong: what lies within it is polished."""
TIE = 1e-10
"""Stretches shorter than this, rad, are ties of rounding: rims that meet in no real angle."""
SCRATCH = (16, 3)
"""Work space for the first-order minima: bound, cos, sin."""


@inlined
def _angle(sin: float, cos: float) -> float:
    """atan2 to 2e-7 rad by a polynomial, several times faster: a phase needs no more."""
    steep = abs(sin) > abs(cos)
    x = abs(cos) / abs(sin) if steep else abs(sin) / abs(cos)
    x2 = x * x
    angle = x * (
        0.99999611
        + x2
        * (
            -0.33317376
            + x2 * (0.19807880 + x2 * (-0.13233510 + x2 * (0.07962632 + x2 * (-0.03360627 + x2 * 0.00681245))))
        )
    )
    angle = math.pi / 2 - angle if steep else angle
    angle = math.pi - angle if cos < 0.0 else angle
    return -angle if sin < 0.0 else angle


@inlined
def _tan(x: float) -> float:
    """tan, by its series where that is exact to rounding (tilts are small)."""
    x2 = x * x
    if x2 > 1e-3:
        return math.tan(x)
    return x * (1 + x2 / 3 * (1 + x2 * 0.4 * (1 + x2 * 17 / 42)))


Sinusoid: TypeAlias = tuple[float, float, float]
"""Cosine part, sine part and constant over the input angle."""


class Rim(NamedTuple):
    """One rim in one zone at one angle: tau without its FS term, with slope and curvature over theta; the depth."""

    value: float
    slope: float
    bend: float
    offset_fs: float
    depth: float
    depth_slope: float


@inlined
def _sinusoid_derivative(cos_part: float, sin_part: float, cos: float, sin: float) -> float:
    return sin_part * cos - cos_part * sin


@inlined
def _rim(
    rim: RimConstants,
    motion: RigidMotion[float],
    cs_cos: float,
    cs_sin: float,
    tan_alpha: float,
    cos: float,
    sin: float,
    s: float,
    k: float,
) -> Rim:
    """tau without its FS term, its slope and curvature over theta, the FS offset o' and the depth, of zone s, rim k."""
    e_a, e_l, t_a, t_l = motion_at(motion, cos, sin)
    e_a1 = _sinusoid_derivative(motion.ea_cos, motion.ea_sin, cos, sin)
    e_l1 = _sinusoid_derivative(motion.el_cos, motion.el_sin, cos, sin)
    t_a1 = _sinusoid_derivative(motion.ta_cos, motion.ta_sin, cos, sin)
    t_l1 = _sinusoid_derivative(motion.tl_cos, motion.tl_sin, cos, sin)
    depth, o, o_fs = rim_depth(rim, e_a, e_l, t_a, t_l, s, k)
    q1 = e_l1 + s * k * t_l1 - s * rim.tilt_gain * (t_a1 * t_l + t_a * t_l1)
    depth1 = s * e_a1 + k * t_a1 - 2 * rim.bow * t_a * t_a1 + o * q1
    cs = cs_cos * cos + cs_sin * sin
    cs1 = cs_sin * cos - cs_cos * sin
    value = tan_alpha * depth + tooth_deviation(cs_cos, cs_sin, cos, sin, s, 1 - 0.5 * o * o, o)
    slope = tan_alpha * depth1 + s * (cs1 - s * o * cs) * (1 + s * q1 * rim.per_flatness)
    bend = -tan_alpha * (s * (e_a - motion.ea_0) + k * (t_a - motion.ta_0)) - s * cs
    return Rim(value, slope, bend, o_fs, depth, depth1)


@inlined
def _rotate(cos: float, sin: float, x: float) -> tuple[float, float]:
    """(cos, sin) turned by a small angle x (series to x^5; |x| <= 0.25 keeps 3e-7)."""
    x2 = x * x
    c = 1 - x2 / 2 * (1 - x2 / 12)
    s = x * (1 - x2 / 6 * (1 - x2 / 20))
    return cos * c - sin * s, sin * c + cos * s


@inlined
def _switch(upper: Rim, lower: Rim) -> float:
    """Where, seen from here, the deepest rim changes; infinite where it does not."""
    rate = upper.depth_slope - lower.depth_slope
    return (lower.depth - upper.depth) / rate if rate != 0.0 else math.inf


@inlined
def _deeper(upper: Rim, lower: Rim, x: float) -> bool:
    """Whether the upper rim is the deeper one at a distance x from here."""
    return upper.depth + x * upper.depth_slope >= lower.depth + x * lower.depth_slope


@inlined
def _four_rims(
    rim: RimConstants,
    motion: RigidMotion[float],
    cs_cos: float,
    cs_sin: float,
    tan_alpha: float,
    cos: float,
    sin: float,
) -> tuple[tuple[Rim, Rim, Rim, Rim], float, float]:
    """Both rims of zone 1, then of zone 2, and the two distances from here, sorted, at which a deepest rim changes."""
    a = _rim(rim, motion, cs_cos, cs_sin, tan_alpha, cos, sin, 1.0, 1.0)
    b = _rim(rim, motion, cs_cos, cs_sin, tan_alpha, cos, sin, 1.0, -1.0)
    c = _rim(rim, motion, cs_cos, cs_sin, tan_alpha, cos, sin, -1.0, 1.0)
    d = _rim(rim, motion, cs_cos, cs_sin, tan_alpha, cos, sin, -1.0, -1.0)
    first, second = _switch(a, b), _switch(c, d)
    return (a, b, c, d), min(first, second), max(first, second)


class Piece(NamedTuple):
    """A stretch [low, high] of angles on which each zone has one deepest rim, seen from the angle x = 0.

    The driving deviation is mean + |half the gap|; each is given by value, slope and curvature, without FS terms. `h`
    and `d` are half the sum and half the difference of the FS offsets of both zones.
    """

    low: float
    high: float
    mean: float
    mean_slope: float
    mean_bend: float
    gap: float
    gap_slope: float
    gap_bend: float
    h: float
    d: float


@inlined
def _piece(rims: tuple[Rim, Rim, Rim, Rim], low: float, high: float) -> Piece:
    middle = (low + high) / 2
    one = rims[0] if _deeper(rims[0], rims[1], middle) else rims[1]
    two = rims[2] if _deeper(rims[2], rims[3], middle) else rims[3]
    return Piece(
        low,
        high,
        (one.value + two.value) / 2,
        (one.slope + two.slope) / 2,
        (one.bend + two.bend) / 2,
        (one.value - two.value) / 2,
        (one.slope - two.slope) / 2,
        (one.bend - two.bend) / 2,
        (one.offset_fs + two.offset_fs) / 2,
        (one.offset_fs - two.offset_fs) / 2,
    )


@inlined
def _lowest_of_piece(piece: Piece, a_fs: float, advance: float, cos: float, sin: float) -> tuple[float, float]:
    """The lowest driving deviation on one piece and where it lies, with the FS phase (cos, sin) at x = 0."""
    mean = piece.mean + a_fs * cos * piece.h
    gap = piece.gap + a_fs * (sin + cos * piece.d)
    slope = piece.gap_slope + a_fs * advance * cos
    bend = piece.gap_bend - a_fs * sin
    # A line plus the size of another is lowest where the steeper one vanishes, or else at an end.
    at_end = piece.low if piece.mean_slope > 0.0 else piece.high
    x = -gap / slope if abs(slope) > abs(piece.mean_slope) else at_end
    x = min(piece.high, max(piece.low, x))
    value = mean + x * (piece.mean_slope + x * piece.mean_bend / 2) + abs(gap + x * (slope + x * bend / 2))
    # Where one zone drives alone, its own parabola may be lower.
    side = 1.0 if gap > 0.0 else -1.0
    one_bend = piece.mean_bend + side * bend
    y = -(piece.mean_slope + side * slope) / one_bend if one_bend > 0.0 else 0.0
    y = min(piece.high, max(piece.low, y))
    alone = mean + y * (piece.mean_slope + y * piece.mean_bend / 2) + abs(gap + y * (slope + y * bend / 2))
    if alone < value:
        value, x = alone, y
    return (value, x) if piece.high - piece.low > TIE else (math.inf, 0.0)


@inlined
def _pieces(rims: tuple[Rim, Rim, Rim, Rim], first: float, second: float, reach: float) -> tuple[Piece, Piece, Piece]:
    """The three stretches within `reach`, between the two angles where a deepest rim changes."""
    first, second = min(reach, max(-reach, first)), min(reach, max(-reach, second))
    return _piece(rims, -reach, first), _piece(rims, first, second), _piece(rims, second, reach)


@inlined
def _lowest(
    pieces: tuple[Piece, Piece, Piece], a_fs: float, advance: float, cos: float, sin: float
) -> tuple[float, float]:
    """The lowest driving deviation on all three pieces and where, with the FS phase (cos, sin) at x = 0."""
    best, place = _lowest_of_piece(pieces[0], a_fs, advance, cos, sin)
    value, x = _lowest_of_piece(pieces[1], a_fs, advance, cos, sin)
    if value < best:
        best, place = value, x
    value, x = _lowest_of_piece(pieces[2], a_fs, advance, cos, sin)
    if value < best:
        best, place = value, x
    return best, place


@compiled
def _polished(
    rim: RimConstants,
    motion: RigidMotion[float],
    cs_cos: float,
    cs_sin: float,
    tan_alpha: float,
    a_fs: float,
    advance: float,
    cos: float,
    sin: float,
    fs_cos: float,
    fs_sin: float,
    x: float,
) -> float:
    """The lowest driving deviation near a distance x from (cos, sin), found anew from there, twice."""
    value = math.inf
    for step in range(POLISHES):
        cos, sin = _rotate(cos, sin, x)
        fs_cos, fs_sin = _rotate(fs_cos, fs_sin, advance * x)
        rims, first, second = _four_rims(rim, motion, cs_cos, cs_sin, tan_alpha, cos, sin)
        pieces = _pieces(rims, first, second, NEAR if step == 0 else NEAR / 8)
        value, x = _lowest(pieces, a_fs, advance, fs_cos, fs_sin)
    return value


@inlined
def _first_order_minima(t: Sinusoid, d: Sinusoid, a_fs: float, scratch: Array) -> tuple[int, int]:
    """Fill `scratch` with the angles where the first-order minimum can lie; their number, and the most promising."""
    t_cos, t_sin, t_0 = t
    d_cos, d_sin, d_0 = d
    count, first_place = 0, 0
    best = math.inf
    t_size = math.sqrt(t_cos * t_cos + t_sin * t_sin)
    d_size = math.sqrt(d_cos * d_cos + d_sin * d_sin)
    for case in range(7):
        # Angles where a first-order sinusoid of (c, s) meets a level: its trough, or a pair of crossings.
        if case < 4:
            sign_t, sign_d = (1.0 if case < 2 else -1.0), (1.0 if case % 2 == 0 else -1.0)
            c, s = sign_t * t_cos + sign_d * d_cos, sign_t * t_sin + sign_d * d_sin
            size = math.sqrt(c * c + s * s)
            level = -size
        elif case == 4:
            c, s, size, level = t_cos, t_sin, t_size, -t_0
            if abs(level) > size:
                level = -size if t_0 > 0 else size
        else:
            c, s, size = d_cos, d_sin, d_size
            level = (a_fs if case == 5 else -a_fs) - d_0
        if size == 0.0:
            if count > 0:
                continue
            c, s, size, level = 1.0, 0.0, 1.0, 1.0
        ratio = level / size
        if abs(ratio) > 1.0:
            continue
        c, s = c / size, s / size
        side = math.sqrt(1.0 - ratio * ratio)
        for twin in range(1 if side == 0.0 else 2):
            along = side if twin == 0 else -side
            cos, sin = ratio * c - along * s, ratio * s + along * c
            bound = abs(t_cos * cos + t_sin * sin + t_0)
            bound += max(0.0, abs(d_cos * cos + d_sin * sin + d_0) - a_fs)
            if bound < best:
                best, first_place = bound, count
            scratch[count, 0], scratch[count, 1], scratch[count, 2] = bound, cos, sin
            count += 1
    return count, first_place


@compiled
def _least(
    rim: RimConstants,
    motion: RigidMotion[float],
    cs_cos: float,
    cs_sin: float,
    tan_alpha: float,
    a_fs: float,
    fs_phase: float,
    advance: float,
    phases: float,
    t: Sinusoid,
    d: Sinusoid,
    second_order: float,
    scratch: Array,
) -> float:
    """Infimum over one full relative turn, mm of arc. `t`, `d`: (cos, sin, constant) of the first-order parts."""
    d_cos, d_sin, d_0 = d
    count, first_place = _first_order_minima(t, d, a_fs, scratch)
    spacing = 2 * math.pi / phases
    least, margin = math.inf, PARABOLA_SHARE * second_order
    for i in range(-1, count):
        # The most promising first: then most of the others cannot sink below what is found already.
        at = first_place if i < 0 else i
        if i == first_place or scratch[at, 0] - second_order > least:
            continue
        cos, sin = scratch[at, 1], scratch[at, 2]
        rims, first, second = _four_rims(rim, motion, cs_cos, cs_sin, tan_alpha, cos, sin)
        pieces = _pieces(rims, first, second, REACH)
        phase = advance * _angle(sin, cos) + fs_phase
        # FS phase at which both zones drive equally, or the trough of the zone that drives alone.
        wanted = -(d_cos * cos + d_sin * sin + d_0) / a_fs if a_fs > 0.0 else 0.0
        wanted = min(1.0, max(-1.0, wanted))
        other = math.sqrt(1.0 - wanted * wanted)
        target = _angle(wanted, other)
        for crossing in range(2 if other > 0.0 else 1):
            if crossing == 1:
                target, other = math.pi - target, -other
            off = (phase - target) / spacing
            off = (off - math.floor(off)) * spacing
            for neighbour in range(2):
                fs_cos, fs_sin = _rotate(other, wanted, off - neighbour * spacing)
                value, x = _lowest(pieces, a_fs, advance, fs_cos, fs_sin)
                if value - margin < least:
                    found = _polished(
                        rim, motion, cs_cos, cs_sin, tan_alpha, a_fs, advance, cos, sin, fs_cos, fs_sin, x
                    )
                    least = min(least, found)
    return least


@inlined
def _uphill(at: Rim, a_fs: float, advance: float, x: float) -> tuple[float, float]:
    """The Newton step to the peak of a branch whose FS phase is `x` beyond its own peak, and what it gains."""
    pull = at.slope - a_fs * advance * math.sin(x)
    stiffness = a_fs * advance * advance * math.cos(x) - at.bend
    step = min(REACH, max(-REACH, pull / stiffness)) if stiffness > 0.0 else 0.0
    return step, step * (pull - step * stiffness / 2)


@compiled
def _greatest(
    rim: RimConstants,
    motion: RigidMotion[float],
    cs_cos: float,
    cs_sin: float,
    tan_alpha: float,
    a_fs: float,
    fs_phase: float,
    advance: float,
    phases: float,
    t: Sinusoid,
    d: Sinusoid,
    second_order: float,
) -> float:
    """Supremum over one full relative turn, mm of arc."""
    t_cos, t_sin, t_0 = t
    d_cos, d_sin, d_0 = d
    best = -math.inf
    for case in range(4):
        s, k = (1.0 if case < 2 else -1.0), (1.0 if case % 2 == 0 else -1.0)
        c, n = s * d_cos + k * t_cos, s * d_sin + k * t_sin
        best = max(best, s * d_0 + k * t_0 + math.sqrt(c * c + n * n))
    spacing = 2 * math.pi / phases
    greatest = -math.inf
    for case in range(4):
        s, k = (1.0 if case < 2 else -1.0), (1.0 if case % 2 == 0 else -1.0)
        c, n = s * d_cos + k * t_cos, s * d_sin + k * t_sin
        size = math.sqrt(c * c + n * n)
        if s * d_0 + k * t_0 + size < best - 2 * second_order:
            continue
        cos, sin = (c / size, n / size) if size > 0.0 else (1.0, 0.0)
        at = _rim(rim, motion, cs_cos, cs_sin, tan_alpha, cos, sin, s, k)
        # The phase's distance x from the peak of s sin(X + s o') is within half a spacing: take the nearer two.
        off = (advance * _angle(sin, cos) + fs_phase + s * at.offset_fs - s * math.pi / 2) / spacing
        off = (off - math.floor(off)) * spacing
        for neighbour in range(2):
            x = off - neighbour * spacing
            step, gain = _uphill(at, a_fs, advance, x)
            value = at.value + a_fs * math.cos(x)
            if value + gain + PARABOLA_SHARE * second_order < greatest:
                continue
            there_cos, there_sin = _rotate(cos, sin, step)
            there = _rim(rim, motion, cs_cos, cs_sin, tan_alpha, there_cos, there_sin, s, k)
            x += advance * step + s * (there.offset_fs - at.offset_fs)
            greatest = max(greatest, value, there.value + a_fs * math.cos(x) + _uphill(there, a_fs, advance, x)[1])
    return greatest


@compiled
def _one(tip: TipGeometry, tan_alpha: float, advance: float, phases: float, row: Array, scratch: Array) -> float:
    """Peak-to-peak of one drive, mm of arc; `row` holds its errors in the order of ERROR_NAMES."""
    beta1, alpha1, phi_cs, a_fs = row[1], row[5], row[9], row[10]
    components = ErrorComponents(
        row[0] * math.sin(beta1),
        row[0] * math.cos(beta1),
        _tan(row[3]),
        _tan(row[2]),
        row[4] * math.cos(alpha1),
        row[4] * math.sin(alpha1),
        _tan(row[6]),
        _tan(row[7]),
    )
    motion = rigid_motion(tip, components)
    cs_cos, cs_sin = row[8] * math.sin(phi_cs), row[8] * math.cos(phi_cs)
    t = tan_alpha * motion.ta_cos, tan_alpha * motion.ta_sin, tan_alpha * motion.ta_0
    d = tan_alpha * motion.ea_cos + cs_cos, tan_alpha * motion.ea_sin + cs_sin, tan_alpha * motion.ea_0
    t_max = math.sqrt(motion.ta_cos**2 + motion.ta_sin**2) + abs(motion.ta_0)
    l_max = math.sqrt(motion.el_cos**2 + motion.el_sin**2) + abs(motion.el_0)
    l_max += math.sqrt(motion.tl_cos**2 + motion.tl_sin**2) + abs(motion.tl_0)
    rim = rim_constants(tip)
    offset = l_max * rim.per_flatness
    second_order = tan_alpha * (rim.bow * t_max * t_max + l_max * offset / 2)
    second_order += (row[8] + a_fs) * offset
    low = _least(rim, motion, cs_cos, cs_sin, tan_alpha, a_fs, row[11], advance, phases, t, d, second_order, scratch)
    high = _greatest(rim, motion, cs_cos, cs_sin, tan_alpha, a_fs, row[11], advance, phases, t, d, second_order)
    return high - low


@entry
def peak_to_peak_block(
    tip: TipGeometry, tan_alpha: float, advance: float, phases: float, matrix: Array, out: Array
) -> None:
    """Fill `out` (n,) with the peak-to-peak of each row of `matrix` (n, 12), mm of arc.

    `tip` has the wave generator's constants, `tan_alpha` is the tangent of the pressure angle, `advance` Z_CS/Z_FS and
    `phases` the number of FS phases of the beat. Rows hold errors in the order of ERROR_NAMES, mm and rad; valid where
    the closed form is.
    """
    scratch = np.empty(SCRATCH)
    for i in range(matrix.shape[0]):
        out[i] = _one(tip, tan_alpha, advance, phases, matrix[i], scratch)
