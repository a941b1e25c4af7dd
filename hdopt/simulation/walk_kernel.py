"""The compiled walk of one drive with effects: its kinematic error over every turn, and extremes near a place.

Effects break the order that lets the base's kernel look at one input turn only. The base is the closed form
(Jia 2021, Eqs. (16) to (32)); effects are interpolated in their tables, those of the splines where each drive's zones
meet them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.kinematics.closed_form import RigidMotion, RimConstants
from hdopt.kinematics.compiled_closed_form import (
    allocating,
    compiled,
    entry,
    inlined,
    motion_at,
    motion_of_row,
    rim_constants,
    rim_depth,
    tooth_deviation,
)
from hdopt.simulation.gearing import Gearing

GOLDEN = (math.sqrt(5) - 1) / 2
CELLS, BISECTIONS, MOST_CUTS = 120, 34, 16
"""Cells of an input turn in which changes of rim are looked for, halvings that place one (within 1e-11 rad), and most.
"""
EDGE = 1e-9
"""Distance from a change of rim (rad) at which either side is evaluated: slopes of 10 arcmin/rad move it by 1e-8."""


class WalkedDrive(NamedTuple):
    """All that the kinematic error at one angle needs: constants and motion of the wave generator, the CS teeth's
    cosine and sine part (mm of arc), tan(alpha), amplitude (mm of arc) and phase (rad) of the FS teeth, Z_CS/Z_FS,
    arcmin per mm of arc times k_e, and the full relative turn (rad of input angle)."""

    rim: RimConstants
    motion: RigidMotion[float]
    cs_cos: float
    cs_sin: float
    tan_alpha: float
    a_fs: float
    fs_phase: float
    advance: float
    scale: float
    span: float


class Added(NamedTuple):
    """Effects of one direction: `zones` (2, m) mm of arc and `beside` (m,) arcmin over the full relative turn, and what
    each zone meets of effects on the CS and on the FS over a turn of that spline, mm of arc, (2, places) each, counted
    from where the zone's end of the major axis stands at input angle 0, on no places where there are none."""

    zones: Array
    beside: Array
    cs: Array
    fs: Array


class Places(NamedTuple):
    """Where least values of `sign` times the kinematic error are looked for: within `half` (rad) of each of the input
    angles `theta` (k,), rad, in the direction of the index `way` (k,), by so many golden-section `steps`."""

    way: Index
    theta: Array
    half: float
    sign: float
    steps: int


@inlined
def on_spline(table: Array, zone: int, angle: float) -> float:
    """What `zone` (0, 1) meets of a `table` (2, places), mm of arc, at an `angle`, rad."""
    n = table.shape[1]
    place = angle / (2 * math.pi)
    place = (place - math.floor(place)) * n
    i = int(place)
    share = place - i
    i = i % n
    here: float = table[zone, i]
    after: float = table[zone, i + 1 if i + 1 < n else 0]
    between: float = here + share * (after - here)
    return between


@compiled
def on_splines(cs: Array, fs: Array, zone: int, theta: float, turned: float, beyond: tuple[float, float]) -> float:
    """What `zone` (0, 1) meets of the tables `cs` and `fs`, mm of arc, at the input angle `theta`, where the FS stands
    at `turned`, and its deepest point lies `beyond` its end by o and o', all in rad."""
    s, found = 1.0 - 2.0 * zone, 0.0
    if cs.shape[1] > 0:
        found += on_spline(cs, zone, theta + s * beyond[0])
    if fs.shape[1] > 0:
        found += on_spline(fs, zone, turned + s * beyond[1])
    return found


@compiled
def rims(drive: WalkedDrive, cos: float, sin: float, s: float) -> tuple[float, float, float]:
    """Deviation (mm of arc) of zone `s` (+1, -1) of a `drive` without its FS teeth, and the offsets o and o', at the
    deeper rim; `cos` and `sin` are those of the input angle."""
    rim = drive.rim
    e_a, e_l, t_a, t_l = motion_at(drive.motion, cos, sin)
    depth, o, o_fs = rim_depth(rim, e_a, e_l, t_a, t_l, s, 1.0)
    other, o_other, o_fs_other = rim_depth(rim, e_a, e_l, t_a, t_l, s, -1.0)
    if other > depth:
        depth, o, o_fs = other, o_other, o_fs_other
    teeth = tooth_deviation(drive.cs_cos, drive.cs_sin, cos, sin, s, math.cos(o), math.sin(o))
    return drive.tan_alpha * depth + teeth, o, o_fs


@compiled
def _at(drive: WalkedDrive, theta: float, added: Added) -> float:
    """Kinematic error (arcmin) at `theta` (rad), with the effects `added`."""
    zones, beside = added.zones, added.beside
    a_fs, fs_phase, advance, scale, span = drive.a_fs, drive.fs_phase, drive.advance, drive.scale, drive.span
    cos, sin = math.cos(theta), math.sin(theta)
    one, cs_one, o_one = rims(drive, cos, sin, 1.0)
    two, cs_two, o_two = rims(drive, cos, sin, -1.0)
    n = len(beside)
    place = theta / span
    place = (place - math.floor(place)) * n
    i = int(place) % n
    share = place - int(place)
    j = (i + 1) % n
    phase = advance * theta + fs_phase
    one += a_fs * math.sin(phase + o_one) + zones[0, i] + share * (zones[0, j] - zones[0, i])
    two += -a_fs * math.sin(phase - o_two) + zones[1, i] + share * (zones[1, j] - zones[1, i])
    one += on_splines(added.cs, added.fs, 0, theta, advance * theta, (cs_one, o_one))
    two += on_splines(added.cs, added.fs, 1, theta, advance * theta, (cs_two, o_two))
    error: float = scale * max(one, two) + beside[i] + share * (beside[j] - beside[i])
    return error


@compiled
def rims_apart(drive: WalkedDrive, theta: float, s: float) -> float:
    """How much deeper (mm) rim 1 than rim 2 lies in zone `s` of a `drive` at `theta`, rad."""
    e_a, e_l, t_a, t_l = motion_at(drive.motion, math.cos(theta), math.sin(theta))
    depth, _, _ = rim_depth(drive.rim, e_a, e_l, t_a, t_l, s, 1.0)
    other, _, _ = rim_depth(drive.rim, e_a, e_l, t_a, t_l, s, -1.0)
    return depth - other


@compiled
def _switches(drive: WalkedDrive, cuts: Array) -> int:
    """Angles of an input turn (rad) at which the deeper rim of a zone changes, into `cuts`; how many.

    There the deepest point jumps along the tooth, and with it what the teeth add: an extreme may stand at either side.
    """
    found, cell = 0, 2 * math.pi / CELLS
    for s in (1.0, -1.0):
        before = rims_apart(drive, 0.0, s) > 0
        for k in range(1, CELLS + 1):
            right = k * cell
            after = rims_apart(drive, right, s) > 0
            if after != before and found < len(cuts):
                left = right - cell
                for _ in range(BISECTIONS):
                    middle = 0.5 * (left + right)
                    if (rims_apart(drive, middle, s) > 0) == before:
                        left = middle
                    else:
                        right = middle
                cuts[found] = 0.5 * (left + right)
                found += 1
            before = after
    return found


@compiled
def _between(cuts: Array, centre: float, half: float, ends: Array) -> int:
    """`centre` - `half`, those of `cuts` (one turn's) that lie within, rising, and `centre` + `half`; how many."""
    ends[0] = centre - half
    found = 1
    for k in range(len(cuts)):
        off = cuts[k] - centre
        off -= 2 * math.pi * round(off / (2 * math.pi))
        if abs(off) < half:
            at = found
            while at > 1 and ends[at - 1] > centre + off:
                ends[at] = ends[at - 1]
                at -= 1
            ends[at] = centre + off
            found += 1
    ends[found] = centre + half
    return found + 1


@compiled
def _lowest_between(
    drive: WalkedDrive, low: float, high: float, sign: float, added: Added, steps: int
) -> tuple[float, float]:
    """Least of sign times the kinematic error between `low` and `high`, ends included, and where, by golden section."""
    left, right = sign * _at(drive, low, added), sign * _at(drive, high, added)
    least, where = (left, low) if left < right else (right, high)
    x, y = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_x, at_y = sign * _at(drive, x, added), sign * _at(drive, y, added)
    for _ in range(steps):
        if at_x < at_y:
            high, y, at_y = y, x, at_x
            x = high - GOLDEN * (high - low)
            at_x = sign * _at(drive, x, added)
        else:
            low, x, at_x = x, y, at_y
            y = low + GOLDEN * (high - low)
            at_y = sign * _at(drive, y, added)
    inner, place = (at_x, x) if at_x < at_y else (at_y, y)
    return (inner, place) if inner < least else (least, where)


@allocating
def _lowest_near(
    drive: WalkedDrive, cuts: Array, centre: float, half: float, sign: float, added: Added, steps: int
) -> tuple[float, float]:
    """Least of sign times the kinematic error within `half` of `centre`, and where: between the changes of rim."""
    ends = np.empty(len(cuts) + 2)
    count = _between(cuts, centre, half, ends)
    least, where = math.inf, centre
    for k in range(count - 1):
        if ends[k + 1] - ends[k] > 4 * EDGE:
            low, high = ends[k] + EDGE, ends[k + 1] - EDGE
            value, place = _lowest_between(drive, low, high, sign, added, steps)
            if value < least:
                least, where = value, place
    return least, where


@compiled
def _walk(drive: WalkedDrive, per_turn: int, turns: int, added: Added, grid: Array, values: Array) -> None:
    """Fill `values` (turns * per_turn) with the kinematic error (arcmin) on an even grid of the relative turn.

    Without its FS teeth a zone repeats every input turn; their phase moves on by as much from turn to turn. `grid`
    (8, per_turn) holds, for both zones, that part, the FS teeth's sine and cosine part, and the offset o'.
    """
    a_fs, fs_phase, advance, scale = drive.a_fs, drive.fs_phase, drive.advance, drive.scale
    for g in range(per_turn):
        theta = 2 * math.pi * g / per_turn
        cos, sin = math.cos(theta), math.sin(theta)
        one, cs_one, o_one = rims(drive, cos, sin, 1.0)
        two, cs_two, o_two = rims(drive, cos, sin, -1.0)
        phase = advance * theta + fs_phase
        if added.cs.shape[1] > 0:
            one += on_spline(added.cs, 0, theta + cs_one)
            two += on_spline(added.cs, 1, theta - cs_two)
        grid[0, g], grid[1, g], grid[6, g], grid[7, g] = one, two, o_one, o_two
        grid[2, g], grid[3, g] = a_fs * math.sin(phase + o_one), a_fs * math.cos(phase + o_one)
        grid[4, g], grid[5, g] = -a_fs * math.sin(phase - o_two), -a_fs * math.cos(phase - o_two)
    for t in range(turns):
        turned = 2 * math.pi * advance * t
        cos, sin = math.cos(turned), math.sin(turned)
        start = t * per_turn
        for g in range(per_turn):
            one = grid[0, g] + cos * grid[2, g] + sin * grid[3, g] + added.zones[0, start + g]
            two = grid[1, g] + cos * grid[4, g] + sin * grid[5, g] + added.zones[1, start + g]
            if added.fs.shape[1] > 0:
                along = turned + advance * (2 * math.pi * g / per_turn)
                one += on_spline(added.fs, 0, along + grid[6, g])
                two += on_spline(added.fs, 1, along - grid[7, g])
            driving = one if one > two else two
            values[start + g] = scale * driving + added.beside[start + g]


@compiled
def drive_of(gearing: Gearing, e: Array) -> WalkedDrive:
    """All that the kinematic error at one angle needs, of a drive of `gearing` whose errors are `e` (12,), as in
    ERROR_NAMES."""
    motion, cs_cos, cs_sin = motion_of_row(gearing.tip, e)
    rim, span = rim_constants(gearing.tip), 2 * math.pi * gearing.turns
    tan_alpha, advance, scale = gearing.tan_alpha, gearing.advance, gearing.scale
    return WalkedDrive(rim, motion, cs_cos, cs_sin, tan_alpha, e[10], e[11], advance, scale, span)


@entry
def extended_walk(gearing: Gearing, row: Array, added: Added) -> Array:
    """Kinematic error (arcmin) of one drive of `gearing` on the grid of the first walk, for each direction: shape
    (d, walked).

    `row` (12,) holds its errors as in ERROR_NAMES; of `added` zones and beside have one more axis in front, that of the
    directions.
    """
    directions, walked = added.beside.shape
    turns = gearing.turns
    values, grid = np.empty((directions, walked)), np.empty((8, walked // turns))
    drive = drive_of(gearing, row)
    for d in range(directions):
        of_direction = Added(added.zones[d], added.beside[d], added.cs, added.fs)
        _walk(drive, walked // turns, turns, of_direction, grid, values[d])
    return values


@entry
def extended_near(gearing: Gearing, row: Array, added: Added, places: Places) -> Array:
    """Least of sign times the kinematic error (arcmin) near each of the k `places`, and where (rad): shape (2, k).

    `gearing`, `row` and `added` as in `extended_walk`.
    """
    found = np.empty((2, len(places.theta)))
    drive = drive_of(gearing, row)
    every_cut = np.empty(MOST_CUTS)
    cuts = every_cut[: _switches(drive, every_cut)]
    for k in range(len(places.theta)):
        d = places.way[k]
        of_direction = Added(added.zones[d], added.beside[d], added.cs, added.fs)
        found[0, k], found[1, k] = _lowest_near(
            drive, cuts, places.theta[k], places.half, places.sign, of_direction, places.steps
        )
    return found
