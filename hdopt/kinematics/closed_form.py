"""The deepest points in closed form: the exact geometry expanded to second order in the errors.

Re-derived from Jia 2021, Eqs. (16)-(23), for a profile whose tip has the radius of curvature rho0. The two formulas
below are plain arithmetic: NumPy calls them on arrays, the compiled kernel on numbers. Against the exact geometry the
depth is right to about 1e-4 arcmin (as kinematic error) for errors of the size of the shipped tolerances; the error
grows with the third power of the errors (`tests/unit/test_closed_form.py` measures it).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hdopt.deviations import DriveErrors
from hdopt.drive import Drive
from hdopt.kinematics.exact import DeepestPoints
from hdopt.profiles import tip_radius_of_curvature


class TipGeometry(NamedTuple):
    """What the closed form knows of a wave generator: L_W, rho0 and b/2 in mm, and which eccentricity it passes."""

    semi_major: float
    tip_radius: float
    half_width: float
    passes_major: float
    passes_minor: float


class RigidMotion(NamedTuple):
    """Coefficients of the wave generator's offset and tilt over one turn, mm.

    E_a = a_cos cos + a_sin sin + a_0 along the major axis, E_l = l_cos cos + l_sin sin + l_0 along the minor one;
    the same with t for the rim's lift by tilt, T_a and T_l.
    """

    ea_cos: ArrayLike
    ea_sin: ArrayLike
    ea_0: ArrayLike
    el_cos: ArrayLike
    el_sin: ArrayLike
    el_0: ArrayLike
    ta_cos: ArrayLike
    ta_sin: ArrayLike
    ta_0: ArrayLike
    tl_cos: ArrayLike
    tl_sin: ArrayLike
    tl_0: ArrayLike


def tip_geometry(drive: Drive) -> TipGeometry:
    """The constants of the closed form for this drive's wave generator."""
    wave_generator = drive.wave_generator
    return TipGeometry(
        semi_major=wave_generator.profile.semi_major,
        tip_radius=tip_radius_of_curvature(wave_generator.profile),
        half_width=wave_generator.width / 2,
        passes_major=float(wave_generator.structure.passes_major),
        passes_minor=float(wave_generator.structure.passes_minor),
    )


def rigid_motion(tip, e1_x, e1_y, tan_tilt_x, tan_tilt_y, e2_major, e2_minor, tan_wg_major, tan_wg_minor):
    """`RigidMotion` from error components: (e1 sin beta1, e1 cos beta1), (tan beta3, tan beta2),
    (e2 cos alpha1, e2 sin alpha1), (tan alpha2, tan alpha3). Projections on u = (sin theta, cos theta) along the major
    axis and v = (cos theta, -sin theta) along the minor one."""
    lift_x, lift_y = tip.half_width * tan_tilt_x, tip.half_width * tan_tilt_y
    return RigidMotion(
        tip.passes_major * e1_y,
        tip.passes_major * e1_x,
        tip.passes_major * e2_major,
        tip.passes_minor * e1_x,
        -tip.passes_minor * e1_y,
        tip.passes_minor * e2_minor,
        lift_y,
        lift_x,
        tip.half_width * tan_wg_major,
        lift_x,
        -lift_y,
        tip.half_width * tan_wg_minor,
    )


def rim_depth(tip, e_a, e_l, t_a, t_l, zone_sign, rim_sign):
    """Depth delta (mm) and offsets o, o' (rad) of one rim's outermost point in one zone (signs +1 or -1)."""
    flatness = tip.semi_major - tip.tip_radius
    shift = e_l + zone_sign * rim_sign * t_l
    q = shift - zone_sign * (tip.semi_major + tip.tip_radius) / 2 * t_a * t_l / tip.half_width**2
    depth = zone_sign * e_a + rim_sign * t_a - tip.semi_major / 2 * (t_a / tip.half_width) ** 2 + q * q / (2 * flatness)
    return depth, q / flatness, q / flatness - shift / tip.semi_major


def deepest_points(drive: Drive, errors: DriveErrors, theta: ArrayLike) -> DeepestPoints:
    """Deepest points at input angles `theta`, rad; `errors` and `theta` broadcast, results have shape (2, ...).

    Valid for profiles with a smooth tip (`tip_is_smooth`) and errors up to about three times the shipped tolerances.
    """
    tip, e = tip_geometry(drive), errors
    motion = rigid_motion(
        tip,
        e.axis_eccentricity * np.sin(e.axis_eccentricity_direction),
        e.axis_eccentricity * np.cos(e.axis_eccentricity_direction),
        np.tan(e.axis_tilt_x),
        np.tan(e.axis_tilt_y),
        e.wg_eccentricity * np.cos(e.wg_eccentricity_direction),
        e.wg_eccentricity * np.sin(e.wg_eccentricity_direction),
        np.tan(e.wg_tilt_major),
        np.tan(e.wg_tilt_minor),
    )
    cos, sin = np.cos(theta), np.sin(theta)
    e_a = motion.ea_cos * cos + motion.ea_sin * sin + motion.ea_0
    e_l = motion.el_cos * cos + motion.el_sin * sin + motion.el_0
    t_a = motion.ta_cos * cos + motion.ta_sin * sin + motion.ta_0
    t_l = motion.tl_cos * cos + motion.tl_sin * sin + motion.tl_0
    zones = []
    for zone_sign in (1.0, -1.0):
        upper = rim_depth(tip, e_a, e_l, t_a, t_l, zone_sign, 1.0)
        lower = rim_depth(tip, e_a, e_l, t_a, t_l, zone_sign, -1.0)
        deeper = upper[0] >= lower[0]
        chosen = [np.where(deeper, a, b) for a, b in zip(upper, lower, strict=True)]
        zones.append([*chosen, np.where(deeper, 1.0, -1.0)])
    return DeepestPoints(*(np.stack(pair) for pair in zip(*zones, strict=True)))
