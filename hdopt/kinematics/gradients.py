"""Extremes of the kinematic error with their slopes over the design: what a search with gradients needs.

Over one full relative turn each input angle meets every FS phase. Here the phase is continuous, so that the extremes
are smooth in the design: an envelope that lies above the converged peak-to-peak by what the gaps between the real
phases leave out (up to a few thousandths of an arcmin, `tests/unit/test_kinematics_gradients.py`).

The supremum is the largest of four smooth maxima (zone x rim). The infimum is the least of a few local minima of

    l(theta) = (A_1 + A_2)/2 - a |sin h| sqrt(1 - r^2), r = (A_1 - A_2)/(2 a cos h)    where both zones can drive,
    l(theta) = max(A_1, A_2) - a                                                         where one drives alone,

with A_i the zone's deviation without its FS term, a its amplitude and h half the sum of the offsets o'. By the envelope
theorem an extreme's slope over the design is the partial one at its own angle. At a kink it is the mix of both sides'
that has no slope over theta; where the deepest rim changes, the angle itself moves with the design. Slopes are taken
where an extreme was found; on the way there values alone are.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from hdopt.arrays import Array, Index, Mask
from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Drive
from hdopt.kinematics.closed_form import RigidMotion, TipGeometry, tip_geometry
from hdopt.kinematics.compiled_closed_form import motion_at, motion_of_row, rim_constants, rim_depth, tooth_deviation
from hdopt.kinematics.inner import inner
from hdopt.parallel.shared_memory import in_parts

HIGHS, LOWS = 4, 8
SCAN = 144
KEPT_RANGE = 0.25
"""Local minima within this share of the range of l above its lowest scanned value are refined."""
NEWTON = 12
GOLDEN = 45
BESIDE = 1e-7
"""How far beside a kink, rad, its two sides are looked at."""
STEEP = 1e-9
"""A slope over theta, mm/rad, below which an extreme counts as smooth."""

ALONG_STEP = 1e-3
"""Step of the central difference of the motion along a direction of the errors, as a share of it. The motion is of
second order in them but for their tangents, so that the difference is exact but for 1e-12."""

# Columns: value, then slopes over theta, L_W, rho0, b/2, tan(alpha), and along the direction of the errors.
VALUE, THETA, MAJOR, RHO, HALF, TAN, ALONG = range(7)
COLUMNS = 7

compiled = inner(fastmath=False)


class Extremes(NamedTuple):
    """Local maxima (4,) and minima (8,) of tau, mm of arc, and their slopes over (L_W, rho0, b/2, tan alpha) and along
    a direction of the errors."""

    highs: Array
    high_slopes: Array
    lows: Array
    low_slopes: Array


class ZoneTerms(NamedTuple):
    """All that the deviation of a zone depends on but the angle: wave generator, its motion, the CS teeth's cosine and
    sine part (mm of arc), tan(alpha), the amplitude a of the FS teeth (mm of arc), and the motion a step back and ahead
    along the direction of the errors."""

    tip: TipGeometry
    motion: RigidMotion[float]
    cs_cos: float
    cs_sin: float
    tan_alpha: float
    a_fs: float
    back: RigidMotion[float]
    ahead: RigidMotion[float]


@compiled
def _depth(terms: ZoneTerms, cos: float, sin: float, s: float, k: float) -> tuple[float, float, float]:
    """Depth (mm) and offsets o and o' (rad) of zone s and rim k at the angle of this cosine and sine."""
    e_a, e_l, t_a, t_l = motion_at(terms.motion, cos, sin)
    depth, o, o_fs = rim_depth(rim_constants(terms.tip), e_a, e_l, t_a, t_l, s, k)
    return depth, o, o_fs


@compiled
def _apart(terms: ZoneTerms, theta: float, s: float) -> float:
    """How much deeper the upper rim of zone s lies than the lower one at `theta`, mm."""
    cos, sin = math.cos(theta), math.sin(theta)
    apart: float = _depth(terms, cos, sin, s, 1.0)[0] - _depth(terms, cos, sin, s, -1.0)[0]
    return apart


@compiled
def _deepest(terms: ZoneTerms, cos: float, sin: float, s: float, side: float) -> tuple[float, float, bool]:
    """tau without FS term and o' of the rim `side` (+-1) of zone s, or (0) of its deepest one; whether the upper one is
    it."""
    upper = side >= 0.0
    depth, o, o_fs = _depth(terms, cos, sin, s, 1.0 if upper else -1.0)
    if side == 0.0:
        lower, lower_o, lower_fs = _depth(terms, cos, sin, s, -1.0)
        upper = depth - lower >= 0.0
        if not upper:
            depth, o, o_fs = lower, lower_o, lower_fs
    turned = tooth_deviation(terms.cs_cos, terms.cs_sin, cos, sin, s, math.cos(o), math.sin(o))
    return terms.tan_alpha * depth + turned, o_fs, upper


@compiled
def _level(terms: ZoneTerms, theta: float, first: float, second: float) -> tuple[float, bool, bool]:
    """l at `theta` with the rims `first` and `second` of the zones (+-1, or 0 for the deepest), and whether they are
    the upper ones. The same to the bit as what `_lowest` finds with slopes."""
    a_fs, cos, sin = terms.a_fs, math.cos(theta), math.sin(theta)
    one, off_one, upper_one = _deepest(terms, cos, sin, 1.0, first)
    two, off_two, upper_two = _deepest(terms, cos, sin, -1.0, second)
    h, gap = (off_one + off_two) / 2, one - two
    cos_h = math.cos(h)
    if abs(gap) >= 2 * a_fs * cos_h * cos_h:
        return (one if gap >= 0 else two) - a_fs, upper_one, upper_two
    r = gap / (2 * a_fs * cos_h)
    c = math.sqrt(max(1 - r * r, 0.0))
    return (one + two) / 2 - a_fs * abs(math.sin(h)) * c, upper_one, upper_two


@compiled
def _branch(terms: ZoneTerms, theta: float, s: float, k: float, out: Array) -> None:
    """Fill `out` (3, 7): tau without FS term, offset o' and depth of zone s and rim k, with all slopes."""
    tip, motion, cs_cos, cs_sin, tan_alpha = terms.tip, terms.motion, terms.cs_cos, terms.cs_sin, terms.tan_alpha
    cos, sin = math.cos(theta), math.sin(theta)
    major, rho, half = tip.semi_major, tip.tip_radius, tip.half_width
    e_a, e_l, t_a, t_l = motion_at(motion, cos, sin)
    value, o, o_fs = rim_depth(rim_constants(tip), e_a, e_l, t_a, t_l, s, k)
    u_a, u_l = t_a / half, t_l / half
    e_a1 = motion.ea_sin * cos - motion.ea_cos * sin
    e_l1 = motion.el_sin * cos - motion.el_cos * sin
    u_a1 = (motion.ta_sin * cos - motion.ta_cos * sin) / half
    u_l1 = (motion.tl_sin * cos - motion.tl_cos * sin) / half
    gap = major - rho
    mean = (major + rho) / 2
    shift, shift1, shift_half = e_l + s * k * t_l, e_l1 + s * k * half * u_l1, s * k * u_l
    q_theta = shift1 - s * mean * (u_a1 * u_l + u_a * u_l1)
    q_major = -s * u_a * u_l / 2
    depth, offset, tau = out[2], out[1], out[0]
    depth[VALUE] = value
    depth[THETA] = s * e_a1 + k * half * u_a1 - major * u_a * u_a1 + o * q_theta
    depth[MAJOR] = -u_a * u_a / 2 + o * q_major - o * o / 2
    depth[RHO] = o * q_major + o * o / 2
    depth[HALF] = k * u_a + o * shift_half
    depth[TAN] = 0.0
    back, ahead, per_step = motion_at(terms.back, cos, sin), motion_at(terms.ahead, cos, sin), 0.5 / ALONG_STEP
    t_a2, t_l2 = per_step * (ahead[2] - back[2]), per_step * (ahead[3] - back[3])
    shift2 = per_step * (ahead[1] - back[1]) + s * k * t_l2
    q_along = shift2 - s * mean * (t_a2 * u_l + u_a * t_l2) / half
    depth[ALONG] = s * per_step * (ahead[0] - back[0]) + k * t_a2 - major * u_a * t_a2 / half + o * q_along
    offset_cos, offset_sin = math.cos(o), math.sin(o)
    o_slopes = (0.0, q_theta / gap, (q_major - o) / gap, (q_major + o) / gap, shift_half / gap, 0.0, q_along / gap)
    offset[VALUE] = o_fs
    offset[THETA] = o_slopes[THETA] - shift1 / major
    offset[MAJOR] = o_slopes[MAJOR] + shift / major**2
    offset[RHO] = o_slopes[RHO]
    offset[HALF] = o_slopes[HALF] - shift_half / major
    offset[TAN] = 0.0
    offset[ALONG] = o_slopes[ALONG] - shift2 / major
    turned = tooth_deviation(cs_cos, cs_sin, cos, sin, s, offset_cos, offset_sin)
    turned1 = tooth_deviation(cs_sin, -cs_cos, cos, sin, s, offset_cos, offset_sin) * s
    tau[VALUE] = tan_alpha * depth[VALUE] + turned
    for j in range(1, COLUMNS):
        tau[j] = tan_alpha * depth[j] + turned1 * o_slopes[j]
    tau[THETA] += s * turned1
    tau[TAN] += depth[VALUE]


@compiled
def _lowest(work: Array, a_fs: float, out: Array) -> None:
    """l and its slopes from both zones' rows of `work` into `out` (7,)."""
    first, second = work[0, 0], work[1, 0]
    h = (work[0, 1, VALUE] + work[1, 1, VALUE]) / 2
    gap = first[VALUE] - second[VALUE]
    cos_h, sin_h = math.cos(h), math.sin(h)
    if abs(gap) >= 2 * a_fs * cos_h * cos_h:
        for j in range(COLUMNS):
            out[j] = first[j] if gap >= 0 else second[j]
        out[VALUE] -= a_fs
        return
    r = gap / (2 * a_fs * cos_h)
    c = math.sqrt(max(1 - r * r, 0.0))
    lean = abs(sin_h) * r / (2 * c * cos_h) if c > 0 else 0.0
    over_h = -a_fs * math.copysign(cos_h, sin_h) * c
    if c > 0:
        over_h += a_fs * abs(sin_h) * r * r * sin_h / (cos_h * c)
    out[VALUE] = (first[VALUE] + second[VALUE]) / 2 - a_fs * abs(sin_h) * c
    for j in range(1, COLUMNS):
        slope_h = (work[0, 1, j] + work[1, 1, j]) / 2
        out[j] = (0.5 + lean) * first[j] + (0.5 - lean) * second[j] + over_h * slope_h


@compiled
def _maxima(terms: ZoneTerms, work: Array, values: Array, slopes: Array) -> None:
    """Four smooth maxima, one a zone and rim: Newton from the first-order peak. A branch that is not the deeper rim
    at its own peak lies below another branch there, so it never wins and does no harm."""
    motion, cs_cos, cs_sin, tan_alpha, a_fs = terms.motion, terms.cs_cos, terms.cs_sin, terms.tan_alpha, terms.a_fs
    index = 0
    for zone in range(2):
        s = 1.0 if zone == 0 else -1.0
        for rim in range(2):
            k = 1.0 if rim == 0 else -1.0
            c = tan_alpha * (s * motion.ea_cos + k * motion.ta_cos) + s * cs_cos
            n = tan_alpha * (s * motion.ea_sin + k * motion.ta_sin) + s * cs_sin
            size = math.hypot(c, n)
            theta = math.atan2(n, c) if size > 0 else 0.0
            best, best_theta = -math.inf, theta
            step = 1e-4
            for _ in range(NEWTON):
                _branch(terms, theta, s, k, work[zone])
                value, slope = work[zone, 0, VALUE], work[zone, 0, THETA]
                if value > best:
                    best, best_theta = value, theta
                _branch(terms, theta + step, s, k, work[2])
                bend = (work[2, 0, THETA] - slope) / step
                if bend >= -1e-3 * size or abs(slope) < 1e-13 * size:
                    break
                theta += min(max(-slope / bend, -0.3), 0.3)
            _branch(terms, best_theta, s, k, work[zone])
            values[index] = work[zone, 0, VALUE] + a_fs
            slopes[index] = work[zone, 0, MAJOR:]
            index += 1


@compiled
def _rim_change(terms: ZoneTerms, s: float, low: float, high: float) -> float:
    """Angle between `low` and `high` where the deepest rim of zone s changes, by bisection."""
    start = _apart(terms, low, s) >= 0
    for _ in range(53):
        middle = (low + high) / 2
        if (_apart(terms, middle, s) >= 0) == start:
            low = middle
        else:
            high = middle
    return (low + high) / 2


@compiled
def _fill(terms: ZoneTerms, theta: float, sides: tuple[float, float], work: Array, out: Array) -> None:
    """Fill `out` (7,) with l and its slopes at `theta`, with these rims of both zones."""
    _branch(terms, theta, 1.0, sides[0], work[0])
    _branch(terms, theta, -1.0, sides[1], work[1])
    _lowest(work, terms.a_fs, out)


@compiled
def _move_with_change(terms: ZoneTerms, theta: float, zone: int, work: Array, out: Array) -> None:
    """Add to the slopes of l at the angle where a zone's rim changes what that angle's own motion does."""
    for rim in range(2):
        _branch(terms, theta, 1.0 - 2.0 * zone, 1.0 - 2.0 * rim, work[rim])
    apart = work[0, 2] - work[1, 2]
    if apart[THETA] != 0.0:
        for j in range(2, COLUMNS):
            out[j] -= out[THETA] * apart[j] / apart[THETA]


@compiled
def _minimum_between(
    terms: ZoneTerms, low: float, high: float, ends: Index, work: Array, out: Array, other: Array
) -> None:
    """Least l between two angles with the same rims inside; `ends` the zone whose rim changes there, -1 for none.

    Fills `out` (7,) with value and design slopes. The rims are those of the middle, so that ends are one-sided limits.
    """
    _, upper_one, upper_two = _level(terms, (low + high) / 2, 0.0, 0.0)
    sides = (1.0 if upper_one else -1.0, 1.0 if upper_two else -1.0)
    golden = (math.sqrt(5.0) - 1) / 2
    a, b = low, high
    x1, x2 = b - golden * (b - a), a + golden * (b - a)
    f1 = f2 = 0.0
    at_1 = True
    theta = x1
    best = math.inf
    for step in range(GOLDEN + 4):
        # The two inner points first, then one a step, at last both ends.
        last = step >= GOLDEN + 2
        place = (low if step == GOLDEN + 2 else high) if last else x1 if at_1 else x2
        value = _level(terms, place, sides[0], sides[1])[0]
        if value < best or (last and value <= best + 1e-15):
            best, theta = value, place
        if last:
            continue
        if at_1:
            f1 = value
        else:
            f2 = value
        if step == 0:
            at_1 = False
            continue
        if f1 <= f2:
            b, x2, f2 = x2, x1, f1
            x1, at_1 = b - golden * (b - a), True
        else:
            a, x1, f1 = x1, x2, f2
            x2, at_1 = a + golden * (b - a), False
    changed = -1
    if theta == low or theta == high:
        changed = ends[0] if theta == low else ends[1]
    for step in range(2):
        beside = 0.0 if changed >= 0 else BESIDE * (2 * step - 1)
        _fill(terms, theta + beside, sides, work, out)
        if step == 0:
            other[:] = out
    if changed >= 0:
        _move_with_change(terms, theta, changed, work, out)
        return
    rising, falling = out[THETA], other[THETA]
    share = rising / (rising - falling) if rising > STEEP and falling < -STEEP else 0.5
    for j in range(2, COLUMNS):
        out[j] = share * other[j] + (1 - share) * out[j]
    out[VALUE] = best


@compiled
def _scan(terms: ZoneTerms, marks: Array, level: Array, upper: Mask) -> None:
    """Fill `marks` (SCAN + 1,) with even angles of one turn, `level` with l there, and `upper` (SCAN + 1, 2) with
    whether the upper rim is the deepest one of each zone."""
    step = 2 * math.pi / SCAN
    for i in range(SCAN + 1):
        marks[i] = i * step
        level[i], upper[i, 0], upper[i, 1] = _level(terms, marks[i], 0.0, 0.0)


@compiled
def _minima(terms: ZoneTerms, work: Array, values: Array, slopes: Array) -> None:
    """The lowest local minima of l, at most as many as `values` holds, sorted upward."""
    marks, level, upper = np.empty(SCAN + 1), np.empty(SCAN + 1), np.empty((SCAN + 1, 2), np.bool_)
    out, other = np.empty(COLUMNS), np.empty(COLUMNS)
    _scan(terms, marks, level, upper)
    highest_kept = level.min() + KEPT_RANGE * (level.max() - level.min())
    values[:] = math.inf
    ends = np.empty(2, np.int64)
    for i in range(SCAN):
        if min(level[i], level[i + 1]) > highest_kept:
            continue
        before = level[i - 1] if i > 0 else level[SCAN - 1]
        after = level[i + 2] if i < SCAN - 1 else level[1]
        change0 = change1 = math.nan
        if upper[i, 0] != upper[i + 1, 0]:
            change0 = _rim_change(terms, 1.0, marks[i], marks[i + 1])
        if upper[i, 1] != upper[i + 1, 1]:
            change1 = _rim_change(terms, -1.0, marks[i], marks[i + 1])
        dips = (level[i] <= before and level[i] <= level[i + 1]) or (level[i + 1] <= level[i] and level[i + 1] <= after)
        if not dips and math.isnan(change0) and math.isnan(change1):
            continue
        first, second = change0, change1
        zone_first, zone_second = 0, 1
        if math.isnan(first) or (not math.isnan(second) and second < first):
            first, second, zone_first, zone_second = second, first, 1, 0
        low, zone_low = marks[i], -1
        for piece in range(3):
            if piece == 0:
                high, zone_high = (first, zone_first) if not math.isnan(first) else (marks[i + 1], -1)
            elif piece == 1:
                if math.isnan(first):
                    break
                high, zone_high = (second, zone_second) if not math.isnan(second) else (marks[i + 1], -1)
            else:
                if math.isnan(second) or math.isnan(first):
                    break
                high, zone_high = marks[i + 1], -1
            if high > low:
                ends[0], ends[1] = zone_low, zone_high
                _minimum_between(terms, low, high, ends, work, out, other)
                _insert(values, slopes, out)
            low, zone_low = high, zone_high
    last = 0
    for i in range(len(values)):
        if values[i] < math.inf:
            last = i
        else:
            values[i] = values[last]
            slopes[i] = slopes[last]


@compiled
def _insert(values: Array, slopes: Array, found: Array) -> None:
    """Keep `found` among the lowest, sorted."""
    place = len(values)
    while place > 0 and found[VALUE] < values[place - 1]:
        place -= 1
    if place < len(values):
        for i in range(len(values) - 1, place, -1):
            values[i] = values[i - 1]
            slopes[i] = slopes[i - 1]
        values[place] = found[VALUE]
        slopes[place] = found[MAJOR:]


@njit(cache=True, nogil=True, fastmath=False)
def _extremes(tip: TipGeometry, tan_alpha: float, rows: Array, along: Array, found: Extremes) -> None:
    """Fill the arrays of `found` for each of `rows` (n, 12), with slopes `along` (n, 12) too."""
    work = np.empty((3, 3, COLUMNS))
    for i in range(rows.shape[0]):
        motion, cs_cos, cs_sin = motion_of_row(tip, rows[i])
        step = ALONG_STEP * along[i]
        back, _, _ = motion_of_row(tip, rows[i] - step)
        ahead, _, _ = motion_of_row(tip, rows[i] + step)
        terms = ZoneTerms(tip, motion, cs_cos, cs_sin, tan_alpha, rows[i, 10], back, ahead)
        _maxima(terms, work, found.highs[i], found.high_slopes[i])
        _minima(terms, work, found.lows[i], found.low_slopes[i])


def extremes(drive: Drive, errors: DriveErrors) -> Extremes:
    """Local extremes of the zones' driving deviation for each drive of `errors` (n of them), mm of arc.

    `highs` (n, 4), `lows` (n, 8) sorted upward (repeated where there are fewer), slopes (n, 4, 5) and (n, 8, 5) over
    L_W, rho0, b/2 (per mm) and tan(alpha), the last 0. Smooth-tipped profiles only; valid where the closed form is.
    """
    return extremes_of(tip_geometry(drive), math.tan(drive.geometry.pressure_angle), errors.to_matrix())


def extremes_of(tip: TipGeometry, tan_alpha: float, rows: Array, along: Array | None = None) -> Extremes:
    """The same from the constants `tip` of the closed form, `tan_alpha` of the pressure angle, and `rows` (n, 12) of
    `DriveErrors.to_matrix`. The last slope is over x where the errors are `rows` + x `along` (n, 12), which moves
    eccentricities and tilts alone (its columns of the teeth are 0)."""
    rows = np.ascontiguousarray(rows, float)
    along = np.zeros_like(rows) if along is None else np.ascontiguousarray(along, float)
    n, k = len(rows), COLUMNS - MAJOR
    found = Extremes(np.empty((n, HIGHS)), np.empty((n, HIGHS, k)), np.empty((n, LOWS)), np.empty((n, LOWS, k)))

    def fill(part: slice) -> None:
        _extremes(tip, tan_alpha, rows[part], along[part], Extremes(*(array[part] for array in found)))

    in_parts(n, fill)
    return found
