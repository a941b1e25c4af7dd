"""The compiled walk: converged peak-to-peak of one drive with effects, whose values over a relative turn are a table.

Effects break the order that lets the base's kernel look at one input turn only, so every turn is walked: on a grid of
angles first, then by golden section around the best local extremes. The base is the closed form (Jia 2021, Eqs. (16)
to (32)); effects are interpolated in their table.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hdopt.kinematics import closed_form

OPTIONS = {"error_model": "numpy", "fastmath": {"contract", "nsz", "arcp", "afn"}}
inlined = njit(inline="always", **OPTIONS)
compiled = njit(**OPTIONS)

rigid_motion = inlined(closed_form.rigid_motion)
rim_depth = inlined(closed_form.rim_depth)

CANDIDATES = 10
"""Local extremes of the grid that are followed, on either side."""
STEPS = 16
"""Golden-section steps: a cell of 2 deg shrinks to 1e-3 deg."""
GOLDEN = (math.sqrt(5) - 1) / 2


@inlined
def _rims(tip, motion, cs_cos, cs_sin, tan_alpha, cos, sin, s):
    """Deviation (mm of arc) of zone s (+1, -1) without its FS teeth, and the FS offset o', at the deeper rim."""
    e_a = motion.ea_cos * cos + motion.ea_sin * sin + motion.ea_0
    e_l = motion.el_cos * cos + motion.el_sin * sin + motion.el_0
    t_a = motion.ta_cos * cos + motion.ta_sin * sin + motion.ta_0
    t_l = motion.tl_cos * cos + motion.tl_sin * sin + motion.tl_0
    depth, o, o_fs = rim_depth(tip, e_a, e_l, t_a, t_l, s, 1.0)
    other, o_other, o_fs_other = rim_depth(tip, e_a, e_l, t_a, t_l, s, -1.0)
    if other > depth:
        depth, o, o_fs = other, o_other, o_fs_other
    cs = cs_cos * cos + cs_sin * sin
    cs1 = cs_sin * cos - cs_cos * sin
    return tan_alpha * depth + s * (cs * math.cos(o) + s * cs1 * math.sin(o)), o_fs


@compiled
def _at(drive, theta, zones, beside):
    """Kinematic error (arcmin) at `theta` (rad), with effects interpolated in `zones` (2, n, mm) and `beside` (n)."""
    tip, motion, cs_cos, cs_sin, tan_alpha, a_fs, fs_phase, advance, scale, span = drive
    cos, sin = math.cos(theta), math.sin(theta)
    one, o_one = _rims(tip, motion, cs_cos, cs_sin, tan_alpha, cos, sin, 1.0)
    two, o_two = _rims(tip, motion, cs_cos, cs_sin, tan_alpha, cos, sin, -1.0)
    n = len(beside)
    place = theta / span
    place = (place - math.floor(place)) * n
    i = int(place) % n
    share = place - int(place)
    j = (i + 1) % n
    phase = advance * theta + fs_phase
    one += a_fs * math.sin(phase + o_one) + zones[0, i] + share * (zones[0, j] - zones[0, i])
    two += -a_fs * math.sin(phase - o_two) + zones[1, i] + share * (zones[1, j] - zones[1, i])
    return scale * max(one, two) + beside[i] + share * (beside[j] - beside[i])


@compiled
def _lowest_near(drive, centre, half, sign, zones, beside, steps):
    """Least of sign times the kinematic error within `half` of `centre`, and where, by golden section."""
    low, high = centre - half, centre + half
    x, y = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_x, at_y = sign * _at(drive, x, zones, beside), sign * _at(drive, y, zones, beside)
    for _ in range(steps):
        if at_x < at_y:
            high, y, at_y = y, x, at_x
            x = high - GOLDEN * (high - low)
            at_x = sign * _at(drive, x, zones, beside)
        else:
            low, x, at_x = x, y, at_y
            y = low + GOLDEN * (high - low)
            at_y = sign * _at(drive, y, zones, beside)
    return (at_x, x) if at_x < at_y else (at_y, y)


@compiled
def _follow(drive, values, sign, zones, beside, best, places):
    """Least of sign times the kinematic error over the turn, from its `values` on an even grid of the turn."""
    n, kept = len(values), 0
    least, worst_kept = math.inf, math.inf
    for i in range(n):
        value = sign * values[i]
        if value >= worst_kept or value > sign * values[i - 1] or value > sign * values[(i + 1) % n]:
            continue
        at = kept if kept < CANDIDATES else CANDIDATES - 1
        while at > 0 and best[at - 1] > value:
            best[at], places[at] = best[at - 1], places[at - 1]
            at -= 1
        best[at], places[at] = value, i
        kept = min(kept + 1, CANDIDATES)
        if kept == CANDIDATES:
            worst_kept = best[kept - 1]
    step = drive[9] / n
    for k in range(kept):
        i = places[k]
        # Within a cell a kink or a trough lies no deeper than the steeper of its sides falls.
        fall = max(sign * values[i - 1], sign * values[(i + 1) % n]) - best[k]
        if best[k] - fall < least:
            found, _ = _lowest_near(drive, i * step, step, sign, zones, beside, STEPS)
            least = min(least, best[k], found)
    return least


@compiled
def _walk(drive, per_turn, turns, zones, beside, grid, values):
    """Fill `values` (turns * per_turn) with the kinematic error (arcmin) on an even grid of the relative turn.

    Without its FS teeth a zone repeats every input turn; their phase moves on by as much from turn to turn. `grid`
    (6, per_turn) holds, for both zones, that part and the FS teeth's sine and cosine part.
    """
    tip, motion, cs_cos, cs_sin, tan_alpha, a_fs, fs_phase, advance, scale, _ = drive
    for g in range(per_turn):
        theta = 2 * math.pi * g / per_turn
        cos, sin = math.cos(theta), math.sin(theta)
        one, o_one = _rims(tip, motion, cs_cos, cs_sin, tan_alpha, cos, sin, 1.0)
        two, o_two = _rims(tip, motion, cs_cos, cs_sin, tan_alpha, cos, sin, -1.0)
        phase = advance * theta + fs_phase
        grid[0, g], grid[1, g] = one, two
        grid[2, g], grid[3, g] = a_fs * math.sin(phase + o_one), a_fs * math.cos(phase + o_one)
        grid[4, g], grid[5, g] = -a_fs * math.sin(phase - o_two), -a_fs * math.cos(phase - o_two)
    for t in range(turns):
        turned = 2 * math.pi * advance * t
        cos, sin = math.cos(turned), math.sin(turned)
        start = t * per_turn
        for g in range(per_turn):
            one = grid[0, g] + cos * grid[2, g] + sin * grid[3, g] + zones[0, start + g]
            two = grid[1, g] + cos * grid[4, g] + sin * grid[5, g] + zones[1, start + g]
            driving = one if one > two else two
            values[start + g] = scale * driving + beside[start + g]


@compiled
def _drive_of(tip, tan_alpha, advance, turns, scale, e):
    """All that the kinematic error at one angle needs; `e` (12) holds the errors as in ERROR_NAMES."""
    motion = rigid_motion(
        tip,
        e[0] * math.sin(e[1]),
        e[0] * math.cos(e[1]),
        math.tan(e[3]),
        math.tan(e[2]),
        e[4] * math.cos(e[5]),
        e[4] * math.sin(e[5]),
        math.tan(e[6]),
        math.tan(e[7]),
    )
    cs_cos, cs_sin = e[8] * math.sin(e[9]), e[8] * math.cos(e[9])
    return (tip, motion, cs_cos, cs_sin, tan_alpha, e[10], e[11], advance, scale, 2 * math.pi * turns)


@njit(cache=True, nogil=True, **OPTIONS)
def extended_block(tip, tan_alpha, advance, turns, scale, matrix, zones, beside, coarse_zones, coarse_beside, out):
    """Fill `out` (n,) with the peak-to-peak (arcmin) of each row of `matrix` (n, 12), errors as in ERROR_NAMES.

    `zones` (d, 2, m) in mm and `beside` (d, m) in arcmin are the effects on an even grid of the relative turn of
    `turns` input turns, for each of d directions of motion; `coarse_...` the same on the grid that is walked first.
    """
    directions, walked = coarse_beside.shape
    per_turn = walked // turns
    values, grid = np.empty(walked), np.empty((6, per_turn))
    best, places = np.empty(CANDIDATES), np.empty(CANDIDATES, np.int64)
    for row in range(matrix.shape[0]):
        drive = _drive_of(tip, tan_alpha, advance, turns, scale, matrix[row])
        lowest, highest = math.inf, -math.inf
        for d in range(directions):
            _walk(drive, per_turn, turns, coarse_zones[d], coarse_beside[d], grid, values)
            lowest = min(lowest, _follow(drive, values, 1.0, zones[d], beside[d], best, places))
            highest = max(highest, -_follow(drive, values, -1.0, zones[d], beside[d], best, places))
        out[row] = highest - lowest


@njit(cache=True, nogil=True, **OPTIONS)
def extended_walk(tip, tan_alpha, advance, turns, scale, row, coarse_zones, coarse_beside):
    """Kinematic error (arcmin) of one drive on the grid of the first walk, for each direction: shape (d, walked)."""
    directions, walked = coarse_beside.shape
    values, grid = np.empty((directions, walked)), np.empty((6, walked // turns))
    drive = _drive_of(tip, tan_alpha, advance, turns, scale, row)
    for d in range(directions):
        _walk(drive, walked // turns, turns, coarse_zones[d], coarse_beside[d], grid, values[d])
    return values


@njit(cache=True, nogil=True, **OPTIONS)
def extended_near(tip, tan_alpha, advance, turns, scale, row, zones, beside, way, theta, half, sign, steps):
    """Least of sign times the kinematic error (arcmin) within `half` (rad) of each of `theta` (k) in the direction
    `way` (k), and where: shape (2, k)."""
    found = np.empty((2, len(theta)))
    drive = _drive_of(tip, tan_alpha, advance, turns, scale, row)
    for k in range(len(theta)):
        d = way[k]
        found[0, k], found[1, k] = _lowest_near(drive, theta[k], half, sign, zones[d], beside[d], steps)
    return found
