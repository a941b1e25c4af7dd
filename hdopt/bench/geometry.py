"""The drives of the bench, from exact rotated contours and per-tooth arrays (Jia 2021, Eqs. (16)-(32)).

Angles are in rad and count clockwise from +y, lengths in mm. The two rim curves of the wave generator are moved by the
full rotation matrices; on a rim the squared radius is a trigonometric polynomial of the contour parameter, whose
maximum Newton's method finds to rounding. Tooth deviations are arrays, one value a tooth, interpolated in between.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from hdopt.bench.arrays import Array
from hdopt.bench.gears import CSF, PRESSURE_ANGLE, Gear

FS_TEETH, CS_TEETH, RATIO = CSF.fs_teeth, CSF.cs_teeth, CSF.ratio
ARCMIN = np.pi / 10800


Pair: TypeAlias = tuple[float, float]
"""A magnitude and its direction (rad), or the two components of a tilt (rad)."""


@dataclass(frozen=True)
class BaseErrors:
    """The twelve errors of one drive; eccentricities and tooth deviations as two components each (mm, rad)."""

    axis_x_mm: float
    axis_y_mm: float
    axis_tilt_y: float
    axis_tilt_x: float
    wg_x_mm: float
    wg_y_mm: float
    wg_tilt_major: float
    wg_tilt_minor: float
    cs_sin_mm: float
    cs_cos_mm: float
    fs_sin_mm: float
    fs_cos_mm: float

    def vector(self) -> Array:
        return np.array([getattr(self, field.name) for field in fields(self)])

    @classmethod
    def from_polar(cls, axis: Pair, axis_tilts: Pair, wg: Pair, wg_tilts: Pair, cs: Pair, fs: Pair) -> BaseErrors:
        """From (magnitude, direction) pairs and pairs of tilts; a deviation is a sin(angle + phase)."""
        return cls(
            axis[0] * np.sin(axis[1]),
            axis[0] * np.cos(axis[1]),
            *axis_tilts,
            wg[0] * np.sin(wg[1]),
            wg[0] * np.cos(wg[1]),
            *wg_tilts,
            cs[0] * np.cos(cs[1]),
            cs[0] * np.sin(cs[1]),
            fs[0] * np.cos(fs[1]),
            fs[0] * np.sin(fs[1]),
        )


# One-sided steps for numerical derivatives: a few per mille of each error's tolerance.
ERROR_STEPS = np.array([2e-5, 2e-5, 5e-6, 5e-6, 1e-5, 1e-5, 3e-6, 3e-6, 4e-6, 4e-6, 4e-6, 4e-6])
# The sizes of the errors: the bounds of the shipped tolerances.
ERROR_BOUNDS = np.array([0.015, 0.015, *np.deg2rad([0.2, 0.2]), 0.0075, 0.0075, *np.deg2rad([0.1, 0.1]), *[0.003] * 4])


def _below(draw: Callable[[], float], upper: float) -> float:
    value = draw()
    while abs(value) > upper:
        value = draw()
    return value


def _two_below(draw: Callable[[], float], upper: float) -> Pair:
    return _below(draw, upper), _below(draw, upper)


def draw_errors(rng: np.random.Generator) -> BaseErrors:
    """Errors of one drive, drawn by `rng` from the tolerances that ship with csf-25-80.

    Eccentricities are Rayleigh and tilts normal, both cut at their bound (`ERROR_BOUNDS`); amplitudes of the teeth are
    uniform from 1 to 3 um, directions and phases over the turn.
    """
    turn = 2 * np.pi
    tilt = np.deg2rad([0.2, 0.1])
    return BaseErrors.from_polar(
        (_below(lambda: rng.rayleigh(0.005), 0.015), rng.uniform(0, turn)),
        _two_below(lambda: rng.normal(0, tilt[0] / 3), tilt[0]),
        (_below(lambda: rng.rayleigh(0.0025), 0.0075), rng.uniform(0, turn)),
        _two_below(lambda: rng.normal(0, tilt[1] / 3), tilt[1]),
        (rng.uniform(0.001, 0.003), rng.uniform(0, turn)),
        (rng.uniform(0.001, 0.003), rng.uniform(0, turn)),
    )


def _tilt_frame(t2: float, t3: float) -> Array:
    z = np.array([np.tan(t3), np.tan(t2), 1.0])
    z /= np.linalg.norm(z)
    y = np.array([0.0, np.cos(t2), -np.sin(t2)])
    return np.column_stack([np.cross(y, z), y, z])


@dataclass(frozen=True)
class Zones:
    """Meshing zones 1 and 2 (first axis) at every wave-generator angle (second axis).

    `depth_mm` is the extra meshing depth |H| - L_W, `cs_angle` the deepest point's angle in the ground, `fs_angle` its
    angle on the flexspline, which has turned back by theta/N.
    """

    depth_mm: Array
    cs_angle: Array
    fs_angle: Array


def find_zones(errors: BaseErrors, theta: ArrayLike, gear: Gear = CSF) -> Zones:
    """Deepest point of each zone, over both rims, at wave-generator angles `theta` (n,) (rad, unwrapped) of `gear` with
    `errors` (Jia 2021, Eqs. (16)-(23), exactly)."""
    theta = np.asarray(theta, dtype=float)
    sin, cos = np.sin(theta), np.cos(theta)
    axis_frame = _tilt_frame(errors.axis_tilt_y, errors.axis_tilt_x)
    wg_frame = _tilt_frame(errors.wg_tilt_major, errors.wg_tilt_minor)

    def to_ground(vector: Array) -> Array:
        turned = np.stack([cos * vector[0] + sin * vector[1], cos * vector[1] - sin * vector[0]])
        result: Array = axis_frame[:2, :2] @ turned + axis_frame[:2, 2:] * vector[2]
        return result

    minor = to_ground(wg_frame[:, 0])
    major = to_ground(wg_frame[:, 1])
    centre = to_ground(np.array([errors.wg_x_mm, errors.wg_y_mm, 0.0]))
    centre += np.array([[errors.axis_x_mm], [errors.axis_y_mm]])
    # A cross-slide takes the eccentricity along its slot away.
    along = 0.0 if gear.floats_major else centre[0] * sin + centre[1] * cos
    across = 0.0 if gear.floats_minor else centre[0] * cos - centre[1] * sin
    centre = np.stack([along * sin + across * cos, along * cos - across * sin])
    half = to_ground(0.5 * gear.width_mm * wg_frame[:, 2])

    depth, cs_angle, fs_angle = (np.full((2, theta.size), -np.inf) for _ in range(3))
    for zone, tip in enumerate((0.0, np.pi)):
        for rim in (1.0, -1.0):
            rim_centre = centre + rim * half
            u = np.full(theta.size, tip)
            for _ in range(5):  # quadratic from a start within 0.1 rad: rounding after four steps
                (across, along), (across_1, along_1), (across_2, along_2) = gear.contour(u)
                point = rim_centre + across * minor + along * major
                slope = across_1 * minor + along_1 * major
                bend = across_2 * minor + along_2 * major
                step = (point * slope).sum(0) / ((slope * slope).sum(0) + (point * bend).sum(0))
                u -= step
            across, along = gear.contour(u)[0]
            point = rim_centre + across * minor + along * major
            here = np.hypot(point[0], point[1]) - gear.semi_major_mm
            deeper = here > depth[zone]
            arm = point - rim_centre
            depth[zone] = np.where(deeper, here, depth[zone])
            cs_angle[zone] = np.where(deeper, np.arctan2(point[0], point[1]), cs_angle[zone])
            fs_angle[zone] = np.where(deeper, np.arctan2(arm[0], arm[1]) + theta / gear.ratio, fs_angle[zone])
    return Zones(depth, cs_angle, fs_angle)


def base_teeth(errors: BaseErrors, gear: Gear = CSF) -> tuple[Array, Array]:
    """Per-tooth tangential deviations (mm) of both splines of `gear` with `errors`: circular spline, flexspline.

    One sine over each circumference, and the pitch errors that the gear was built with.
    """
    cs = 2 * np.pi * np.arange(gear.cs_teeth) / gear.cs_teeth
    fs = 2 * np.pi * np.arange(gear.fs_teeth) / gear.fs_teeth
    return (
        errors.cs_sin_mm * np.sin(cs) + errors.cs_cos_mm * np.cos(cs) + np.array(gear.cs_pitch_mm or 0.0),
        errors.fs_sin_mm * np.sin(fs) + errors.fs_cos_mm * np.cos(fs) + np.array(gear.fs_pitch_mm or 0.0),
    )


def at_angle(teeth_mm: Array, angle: Array) -> Array:
    """Deviation of a spline at `angle` (rad), interpolated between the teeth around it; the shape of `angle`.

    `teeth_mm` (z,) holds the deviation of each tooth, the first at 0 rad.
    """
    place = np.asarray(angle) * (teeth_mm.size / (2 * np.pi))
    below = np.floor(place)
    part = place - below
    index = below.astype(np.int64) % teeth_mm.size
    closed = np.append(teeth_mm, teeth_mm[0])
    return closed[index] * (1 - part) + closed[index + 1] * part


def zone_deviation_mm(
    zones: Zones, cs_teeth_mm: Array, fs_teeth_mm: Array, extra_depth_mm: Array | float = 0.0
) -> Array:
    """Tangential deviation tau (mm) of both `zones`, shape (2, n): depth times tan(alpha), and the teeth.

    `cs_teeth_mm` and `fs_teeth_mm` are per-tooth deviations of both splines; `extra_depth_mm` is added to the meshing
    depth, one number or (2, n).
    """
    depth = (zones.depth_mm + extra_depth_mm) * np.tan(PRESSURE_ANGLE)
    result: Array = depth + at_angle(cs_teeth_mm, zones.cs_angle) + at_angle(fs_teeth_mm, zones.fs_angle)
    return result


def kinematic_error(errors: BaseErrors, theta: Array, gear: Gear = CSF) -> Array:
    """Kinematic error (rad at the output) of the base drive `gear` with `errors` at `theta` (rad): the zone that
    deviates more drives."""
    zones = find_zones(errors, theta, gear)
    result: Array = gear.rad_per_mm(theta) * zone_deviation_mm(zones, *base_teeth(errors, gear)).max(axis=0)
    return result
