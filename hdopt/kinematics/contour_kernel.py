"""The compiled kernel of drives on a measured cam: the exact geometry of its own contour, drive after drive.

Jia 2021, Eqs. (16)-(23), as `hdopt.kinematics.exact` writes them, without its search at every input angle: where a rim
reaches farthest depends on how far it is moved across the major axis, which is tabulated once for a contour, and two
Newton steps from there find the place. `beat_lanes` walks the beat on what that gives.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from hdopt.arrays import Array
from hdopt.drive.geometry import Drive
from hdopt.kinematics.beat_bounds import CIRCULAR, DEPTH, ON_CS, ON_FS, fill_circular
from hdopt.kinematics.beat_grid import grid_angles, new_work, walk_of
from hdopt.kinematics.beat_lanes import extremes_in_lanes
from hdopt.kinematics.beat_tables import WRAPPED, circle, differences, fill_comb, new_teeth, with_sine, wrap
from hdopt.kinematics.exact import GRID_POINTS, LONGEST_STEP, NEWTON_STEPS, ZONE_HALF_WIDTH
from hdopt.kinematics.inner import inner
from hdopt.kinematics.load_sharing import PLACES_PER_TOOTH

CONTOUR_PLACES = 8192
"""Places of a turn at which points and slopes of the contour are tabulated; cubics between them leave 1e-12 mm of an
ellipse, and 1e-10 mm of a wave of 50 a turn and 2 um."""
SEARCHED_EVERY = 4
"""Places of that table between two of those where a place to start from is looked for."""
ACROSS_PLACES = 2048
"""Motions across the major axis for which the place to start from is tabulated."""
ACROSS_REACH = 0.25
"""mm: how far they go to either side. Beyond, the place is searched for each input angle, as `exact` does it."""
STEPS = 2
"""Newton steps from a tabulated place, which is right to the second order of the errors."""
FEWEST_ANGLES, ANGLES_PER_TOOTH = 240, 1.5
"""Grid angles of one input turn at least, and for each tooth of the circular spline: twice those of smooth tips."""

compiled = inner(error_model="numpy", fastmath=False)


class ContourConstants(NamedTuple):
    """What the kernel knows of a design: the contour's `points` (4, n), x and y (mm, y along the major axis) and their
    slopes (mm a place); the place where each zone's rim reaches farthest by its motion across, `starts` (2, K); L_W and
    b/2 (mm); which eccentricity is passed; tan of the pressure angle times the share of misalignment; the factor of
    tooth sines; Z_CS/Z_FS; the number of FS phases; cos and sin of the grid angles, (2, m + 4), and of the places of
    either spline's table, (2, 12 Z) each."""

    points: Array
    starts: Array
    semi_major: float
    half_width: float
    passes_major: float
    passes_minor: float
    tan_alpha: float
    sine_share: float
    advance: float
    phases: int
    angles: Array
    cs_circle: Array
    fs_circle: Array


class Rim(NamedTuple):
    """One edge of the wave generator at an input angle: a contour point (x, y) comes to lie by a x + b y + c mm along
    the major axis (u) and across it (v), seen from the circular spline's centre."""

    u_x: float
    u_y: float
    u_0: float
    v_x: float
    v_y: float
    v_0: float


def contour_constants(drive: Drive, misalignment: float = 1.0, sine_share: float = 1.0) -> ContourConstants:
    """The constants of `drive`, of any profile; `misalignment` and `sine_share` multiply what it makes, and what tooth
    sines make, where the teeth in contact share them."""
    gear, generator = drive.geometry, drive.wave_generator
    m = max(FEWEST_ANGLES, int(ANGLES_PER_TOOTH * gear.circular_spline_teeth))
    phi = np.arange(CONTOUR_PLACES) * (2 * math.pi / CONTOUR_PLACES)
    r, slope = generator.profile.radius(phi), generator.profile.radius(phi, 1)
    sin, cos, step = np.sin(phi), np.cos(phi), phi[1]
    points = np.stack([r * sin, r * cos, (slope * sin + r * cos) * step, (slope * cos - r * sin) * step])
    starts = np.empty((2, ACROSS_PLACES))
    _fill_starts(points, starts)
    return ContourConstants(
        points,
        starts,
        float(generator.profile.semi_major),
        generator.width / 2,
        float(generator.structure.passes_major),
        float(generator.structure.passes_minor),
        misalignment * math.tan(gear.pressure_angle),
        sine_share,
        gear.flexspline_advance,
        gear.beat_phases,
        grid_angles(m),
        circle(PLACES_PER_TOOTH * gear.circular_spline_teeth),
        circle(PLACES_PER_TOOTH * gear.flexspline_teeth),
    )


@compiled
def _at(points: Array, place: float, rim: Rim) -> tuple[float, float, float, float, float, float]:
    """Where the contour point at a `place` (in places of the table) comes to lie along and across, mm, with first and
    second derivatives by the place."""
    n = points.shape[1]
    whole = math.floor(place)
    t = place - whole
    j = int(whole) % n
    k = j + 1 if j + 1 < n else 0
    x0, x1, dx0, dx1 = points[0, j], points[0, k], points[2, j], points[2, k]
    y0, y1, dy0, dy1 = points[1, j], points[1, k], points[3, j], points[3, k]
    cx, cy = 3 * (x1 - x0) - 2 * dx0 - dx1, 3 * (y1 - y0) - 2 * dy0 - dy1
    ex, ey = 2 * (x0 - x1) + dx0 + dx1, 2 * (y0 - y1) + dy0 + dy1
    x, y = x0 + t * (dx0 + t * (cx + t * ex)), y0 + t * (dy0 + t * (cy + t * ey))
    x_1, y_1 = dx0 + t * (2 * cx + 3 * t * ex), dy0 + t * (2 * cy + 3 * t * ey)
    x_2, y_2 = 2 * cx + 6 * t * ex, 2 * cy + 6 * t * ey
    return (
        rim.u_x * x + rim.u_y * y + rim.u_0,
        rim.v_x * x + rim.v_y * y + rim.v_0,
        rim.u_x * x_1 + rim.u_y * y_1,
        rim.v_x * x_1 + rim.v_y * y_1,
        rim.u_x * x_2 + rim.u_y * y_2,
        rim.v_x * x_2 + rim.v_y * y_2,
    )


@compiled
def _polished(points: Array, place: float, rim: Rim, steps: int) -> float:
    """The place near `place` where the point lies farthest out, by so many Newton steps."""
    longest = LONGEST_STEP / (2 * math.pi) * points.shape[1]
    for _ in range(steps):
        u, v, u_1, v_1, u_2, v_2 = _at(points, place, rim)
        bend = u_1 * u_1 + v_1 * v_1 + u * u_2 + v * v_2
        # Away from a maximum (bend >= 0) a Newton step would leave it: stay there then.
        if bend < 0.0:
            place -= min(max((u * u_1 + v * v_1) / bend, -longest), longest)
    return place


@compiled
def _searched(points: Array, zone: int, rim: Rim, every: int) -> float:
    """The place of the table, of each so many (`every`), that lies farthest out in a `zone`."""
    n = points.shape[1]
    half = int(ZONE_HALF_WIDTH / (2 * math.pi) * n)
    start = zone * n // 2
    best, farthest = float(start), -1.0
    for place in range(start - half, start + half + 1, every):
        x, y = points[0, place % n], points[1, place % n]
        u, v = rim.u_x * x + rim.u_y * y + rim.u_0, rim.v_x * x + rim.v_y * y + rim.v_0
        if u * u + v * v > farthest:
            best, farthest = float(place), u * u + v * v
    return best


@njit(cache=True, nogil=True, error_model="numpy", fastmath=False)
def _fill_starts(points: Array, starts: Array) -> None:
    """Fill `starts` (2, K) with the place in each zone that lies farthest out of a contour that is moved across only,
    for even motions from -`ACROSS_REACH` to `ACROSS_REACH`."""
    last = starts.shape[1] - 1
    for zone in range(2):
        for i in range(last + 1):
            rim = Rim(0.0, 1.0, 0.0, 1.0, 0.0, ACROSS_REACH * (2 * i / last - 1))
            place = _searched(points, zone, rim, SEARCHED_EVERY)
            starts[zone, i] = _polished(points, place, rim, NEWTON_STEPS)


@compiled
def _start(constants: ContourConstants, zone: int, rim: Rim) -> tuple[float, int]:
    """A place to start from in a `zone`, and how many Newton steps are needed from there."""
    side = 1.0 - 2.0 * zone
    # What shears the contour moves its tip across, and turns the normal there by as much again.
    turned = 0.5 * (rim.u_x + rim.v_y)
    across = rim.v_0 + side * 2 * constants.semi_major * turned
    place = (across / ACROSS_REACH + 1) / 2 * (constants.starts.shape[1] - 1) + 0.5
    if place < 0.0 or place >= constants.starts.shape[1]:
        every = 2 * int(ZONE_HALF_WIDTH / (2 * math.pi) * constants.points.shape[1]) // (GRID_POINTS - 1)
        return _searched(constants.points, zone, rim, every), NEWTON_STEPS
    return constants.starts[zone, int(place)], STEPS


@compiled
def _frame(tilt_y: float, tilt_x: float) -> Array:
    """Columns x, y, z of a frame tilted by (t2, t3) = (`tilt_y`, `tilt_x`), rad: (3, 3); Jia 2021, Eq. (16)."""
    z = np.array([math.tan(tilt_x), math.tan(tilt_y), 1.0])
    z /= math.sqrt(z[0] ** 2 + z[1] ** 2 + 1.0)
    y = np.array([0.0, math.cos(tilt_y), -math.sin(tilt_y)])
    x = np.array([y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0]])
    frame = np.empty((3, 3))
    frame[:, 0], frame[:, 1], frame[:, 2] = x, y, z
    return frame


@compiled
def _motion(constants: ContourConstants, row: Array, axis: Array, own: Array, j: int, out: Array) -> None:
    """Fill `out` (2, 4) with how the contour lies at grid angle `j` along and across: factors of x, of y and of the
    height, and the offset (mm). `axis` and `own` are the frames of input axis and wave generator, `row` the errors."""
    cos, sin = constants.angles[0, j], constants.angles[1, j]
    x, y = row[4] * math.sin(row[5]), row[4] * math.cos(row[5])
    x, y = x * cos + y * sin, y * cos - x * sin
    centre_x = axis[0, 0] * x + axis[0, 1] * y + row[0] * math.sin(row[1])
    centre_y = axis[1, 0] * x + axis[1, 1] * y + row[0] * math.cos(row[1])
    for across in range(2):
        on_x, on_y = (cos, -sin) if across == 1 else (sin, cos)
        a, b = on_x * axis[0, 0] + on_y * axis[1, 0], on_x * axis[0, 1] + on_y * axis[1, 1]
        c = on_x * axis[0, 2] + on_y * axis[1, 2]
        a, b = a * cos - b * sin, a * sin + b * cos
        for i in range(3):
            out[across, i] = a * own[0, i] + b * own[1, i] + c * own[2, i]
        passed = constants.passes_minor if across == 1 else constants.passes_major
        out[across, 3] = passed * (centre_x * on_x + centre_y * on_y)


@compiled
def _sample(constants: ContourConstants, row: Array, branches: Array) -> None:
    """Fill the `branches` (3, 2, 2, m + 4) of one drive on the grid angles."""
    points, n = constants.points, constants.points.shape[1]
    axis, own = _frame(row[2], row[3]), _frame(row[6], row[7])
    at = np.empty((2, 4))
    for j in range(constants.angles.shape[1]):
        _motion(constants, row, axis, own, j, at)
        for zone in range(2):
            side = 1.0 - 2.0 * zone
            for k in range(2):
                # Rims are counted along the zone's own direction.
                height = side * (1.0 - 2.0 * k) * constants.half_width
                rim = Rim(
                    at[0, 0], at[0, 1], at[0, 2] * height + at[0, 3], at[1, 0], at[1, 1], at[1, 2] * height + at[1, 3]
                )
                start, steps = _start(constants, zone, rim)
                place = _polished(points, start, rim, steps)
                u, v, _, _, _, _ = _at(points, place, rim)
                branches[DEPTH, zone, k, j] = math.sqrt(u * u + v * v) - constants.semi_major
                branches[ON_CS, zone, k, j] = math.atan2(v, side * u)
                branches[ON_FS, zone, k, j] = side * (place - zone * n / 2) * (2 * math.pi / n)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=False)
def contour_extremes_block(constants: ContourConstants, cs: Array, fs: Array, rows: Array, out: Array) -> None:
    """Fill `out` (n, 2) with the essential infimum and supremum of each row of errors `rows` (n, 12), mm of arc.

    `constants` of the design; `cs`, `fs` tables over one turn of the splines, (1, 12 Z) for all drives or (n, 12 Z).
    """
    m, phases = constants.angles.shape[1] - WRAPPED, constants.phases
    n_cs, n_fs = cs.shape[1], fs.shape[1]
    stride_cs, stride_fs = (n_cs + m - 1) // m, (n_fs + m - 1) // m
    branches = np.empty((3, 2, 2, m + WRAPPED))
    work = new_work(m, phases)
    teeth = new_teeth(n_fs, phases)
    on_cs, on_fs, wrapped = np.empty(n_cs), np.empty(n_fs), np.empty(n_cs + WRAPPED)
    rows_cs = np.empty((CIRCULAR, 2, m + WRAPPED), np.float32)
    for i in range(len(rows)):
        row, share = rows[i], constants.sine_share
        with_sine(cs[i if len(cs) > 1 else 0], share * row[8], row[9], constants.cs_circle, on_cs)
        with_sine(fs[i if len(fs) > 1 else 0], share * row[10], row[11], constants.fs_circle, on_fs)
        wrap(on_cs, wrapped)
        comb = fill_comb(on_fs, phases, stride_fs, teeth)
        _sample(constants, row, branches)
        circular = fill_circular(wrapped, differences(on_cs, stride_cs), rows_cs)
        walk = walk_of(branches, circular, constants.tan_alpha, constants.advance, comb, work)
        out[i, 0], out[i, 1] = extremes_in_lanes(walk, work)
