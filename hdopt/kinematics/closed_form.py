"""The deepest points in closed form: the exact geometry expanded to second order in the errors.

Re-derived from Jia 2021, Eqs. (16)-(23), for a profile whose tip has the radius of curvature rho0. `rigid_motion`,
`motion_at`, `rim_depth` and `tooth_deviation` are the one place that writes the deviation of a meshing zone. They are
plain arithmetic without number literals that would widen single precision: NumPy calls them on arrays, every compiled
kernel inlines them. Against the exact geometry the depth is right to about 1e-4 arcmin (as kinematic error) for errors
of the size of the shipped tolerances; the error grows with the third power of the errors
(`tests/unit/test_kinematics.py` measures it).
"""

from __future__ import annotations

from typing import Generic, NamedTuple, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from hdopt.arrays import Array
from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Drive
from hdopt.drive.profiles import tip_radius_of_curvature
from hdopt.kinematics.branches import Branches, DeepestPoints, deepest

HALF = cast("float", np.float32(0.5))
"""A half that does not widen single precision, and is exact."""

V = TypeVar("V", float, Array)
"""Numbers of one drive at one angle, as compiled kernels have them, or arrays of any shapes that broadcast."""


class TipGeometry(NamedTuple):
    """What the closed form knows of a wave generator: L_W, rho0 and b/2 in mm, and which eccentricity it passes."""

    semi_major: float
    tip_radius: float
    half_width: float
    passes_major: float
    passes_minor: float


class RimConstants(NamedTuple):
    """Constants of `rim_depth`, made from `TipGeometry`; G = L_W - rho0."""

    tilt_gain: float
    """(L_W + rho0)/2/(b/2)^2, 1/mm: how far tilt about both axes moves the tip sideways."""
    bow: float
    """L_W/2/(b/2)^2, 1/mm: how much tilt shortens the projected major axis."""
    per_flatness: float
    """1/G, 1/mm."""
    half_per_flatness: float
    """1/(2 G), 1/mm."""
    per_major: float
    """1/L_W, 1/mm."""


class ErrorComponents(NamedTuple, Generic[V]):
    """Errors of input axis and wave generator by Cartesian components; eccentricities in mm.

    Angles as in Jia 2021: beta1 to beta3 of the input axis, alpha1 to alpha3 of the wave generator.
    """

    e1_x: V
    """e1 sin(beta1), of the input axis."""
    e1_y: V
    """e1 cos(beta1)."""
    tan_tilt_x: V
    """tan(beta3), of the input axis."""
    tan_tilt_y: V
    """tan(beta2)."""
    e2_major: V
    """e2 cos(alpha1), of the wave generator along its major axis."""
    e2_minor: V
    """e2 sin(alpha1)."""
    tan_wg_major: V
    """tan(alpha2), of the wave generator."""
    tan_wg_minor: V
    """tan(alpha3)."""


class RigidMotion(NamedTuple, Generic[V]):
    """Coefficients of the wave generator's offset and tilt over one turn, mm.

    E_a = a_cos cos + a_sin sin + a_0 along the major axis, E_l = l_cos cos + l_sin sin + l_0 along the minor one;
    the same with t for the rim's lift by tilt, T_a and T_l, and for the twist (rad) that two tilts make together.
    """

    ea_cos: V
    ea_sin: V
    ea_0: V
    el_cos: V
    el_sin: V
    el_0: V
    ta_cos: V
    ta_sin: V
    ta_0: V
    tl_cos: V
    tl_sin: V
    tl_0: V
    twist_cos: V
    twist_sin: V
    twist_0: V


def tip_geometry(drive: Drive) -> TipGeometry:
    """The constants of the closed form for the wave generator of `drive`; profiles with a smooth tip only."""
    wave_generator = drive.wave_generator
    return TipGeometry(
        semi_major=wave_generator.profile.semi_major,
        tip_radius=tip_radius_of_curvature(wave_generator.profile),
        half_width=wave_generator.width / 2,
        passes_major=float(wave_generator.structure.passes_major),
        passes_minor=float(wave_generator.structure.passes_minor),
    )


def rim_constants(tip: TipGeometry) -> RimConstants:
    """The constants of `rim_depth` for a wave generator's `tip`."""
    flatness, square = tip.semi_major - tip.tip_radius, tip.half_width * tip.half_width
    return RimConstants(
        (tip.semi_major + tip.tip_radius) / 2 / square,
        tip.semi_major / 2 / square,
        1 / flatness,
        0.5 / flatness,
        1 / tip.semi_major,
    )


def rigid_motion(tip: TipGeometry, errors: ErrorComponents[V]) -> RigidMotion[V]:
    """The `RigidMotion` that `errors` give the wave generator of `tip`: projections on u = (sin theta, cos theta) along
    the major axis and v = (cos theta, -sin theta) along the minor one (Jia 2021, Eqs. (16)-(23), to second order)."""
    lift_x, lift_y = tip.half_width * errors.tan_tilt_x, tip.half_width * errors.tan_tilt_y
    return RigidMotion(
        ea_cos=tip.passes_major * errors.e1_y,
        ea_sin=tip.passes_major * errors.e1_x,
        ea_0=tip.passes_major * errors.e2_major,
        el_cos=tip.passes_minor * errors.e1_x,
        el_sin=-tip.passes_minor * errors.e1_y,
        el_0=tip.passes_minor * errors.e2_minor,
        ta_cos=lift_y,
        ta_sin=lift_x,
        ta_0=tip.half_width * errors.tan_wg_major,
        tl_cos=lift_x,
        tl_sin=-lift_y,
        tl_0=tip.half_width * errors.tan_wg_minor,
        twist_cos=(errors.tan_tilt_y * errors.tan_wg_minor - errors.tan_tilt_x * errors.tan_wg_major) * HALF,
        twist_sin=(errors.tan_tilt_x * errors.tan_wg_minor + errors.tan_tilt_y * errors.tan_wg_major) * HALF,
        twist_0=(errors.tan_tilt_x * errors.tan_tilt_y + errors.tan_wg_major * errors.tan_wg_minor) * HALF,
    )


def motion_at(motion: RigidMotion[V], cos: V, sin: V) -> tuple[V, V, V, V]:
    """E_a, E_l, T_a and T_l, mm, at the input angle with cosine `cos` and sine `sin`; `motion` as in `rigid_motion`.

    Two tilts after each other turn the wave generator a little about its axis, by half the area that they span. An
    eccentricity along the ground's major axis then has a part across the turned one. It is of third order, but where
    automatic alignment removes E_l and T_l it is all that tells at which angle each zone's deepest rim changes. Under
    one-way minor alignment other parts of third order, which the closed form leaves out, are some 60 times as large.
    """
    e_a = motion.ea_cos * cos + motion.ea_sin * sin + motion.ea_0
    twist = motion.twist_cos * cos + motion.twist_sin * sin + motion.twist_0
    return (
        e_a,
        motion.el_cos * cos + motion.el_sin * sin + motion.el_0 - e_a * twist,
        motion.ta_cos * cos + motion.ta_sin * sin + motion.ta_0,
        motion.tl_cos * cos + motion.tl_sin * sin + motion.tl_0,
    )


def rim_depth(rim: RimConstants, e_a: V, e_l: V, t_a: V, t_l: V, zone_sign: float, rim_sign: float) -> tuple[V, V, V]:
    """Depth delta (mm) and offsets o, o' (rad) of one rim's outermost point in one zone.

    Jia 2021, Eqs. (16)-(23), to second order in the errors. `rim` has the constants of the wave generator; `e_a`,
    `e_l`, `t_a`, `t_l` as `motion_at` gives them, mm; `zone_sign` +1 near the + major end, -1 near the opposite one;
    `rim_sign` +1 or -1, counted along the zone's own direction. o is seen from the CS centre, o' from the wave
    generator's, both positive toward +v.
    """
    shift = e_l + zone_sign * rim_sign * t_l
    q = shift - zone_sign * rim.tilt_gain * t_a * t_l
    offset = q * rim.per_flatness
    depth = zone_sign * e_a + rim_sign * t_a - rim.bow * t_a * t_a + q * q * rim.half_per_flatness
    return depth, offset, offset - shift * rim.per_major


def tooth_deviation(
    cos_part: float | V, sin_part: float | V, cos: V, sin: V, zone_sign: float, offset_cos: V, offset_sin: V
) -> V:
    """Deviation of a spline's teeth met in one zone, mm of arc (Jia 2021, Eqs. (31a), (31b)).

    s a sin(x + phi + s o): `cos_part` = a sin(phi), `sin_part` = a cos(phi), mm; `cos`, `sin` of the tooth angle x,
    theta for the CS and Z_CS/Z_FS theta for the FS; `offset_cos`, `offset_sin` of the offset, o (CS) or o' (FS).
    s is `zone_sign`, +1 near the + major end and -1 near the opposite one: the half turn to zone 2 is not scaled, so
    that it is the sign alone.
    """
    here = cos_part * cos + sin_part * sin
    ahead = sin_part * cos - cos_part * sin
    return zone_sign * here * offset_cos + ahead * offset_sin


def error_components(errors: DriveErrors) -> ErrorComponents[Array]:
    """The components of `errors` of one drive or of many, in arrays of their shapes."""
    e = errors
    return ErrorComponents(
        e1_x=np.asarray(e.axis_eccentricity * np.sin(e.axis_eccentricity_direction)),
        e1_y=np.asarray(e.axis_eccentricity * np.cos(e.axis_eccentricity_direction)),
        tan_tilt_x=np.asarray(np.tan(e.axis_tilt_x)),
        tan_tilt_y=np.asarray(np.tan(e.axis_tilt_y)),
        e2_major=np.asarray(e.wg_eccentricity * np.cos(e.wg_eccentricity_direction)),
        e2_minor=np.asarray(e.wg_eccentricity * np.sin(e.wg_eccentricity_direction)),
        tan_wg_major=np.asarray(np.tan(e.wg_tilt_major)),
        tan_wg_minor=np.asarray(np.tan(e.wg_tilt_minor)),
    )


def branches(drive: Drive, errors: DriveErrors, theta: ArrayLike) -> Branches:
    """Every rim's outermost point in both zones of a `drive` with `errors` at input angles `theta`, rad; the two
    broadcast, results have shape (2, 2, ...).

    Valid for drives whose profile has a smooth tip (`tip_is_smooth`) and errors up to about three times the shipped
    tolerances.
    """
    tip = tip_geometry(drive)
    motion = rigid_motion(tip, error_components(errors))
    where = motion_at(motion, np.cos(theta), np.sin(theta))
    rim = rim_constants(tip)
    signs = (1.0, -1.0)
    found = [[np.broadcast_arrays(*rim_depth(rim, *where, zone, k)) for k in signs] for zone in signs]
    return Branches(*(np.array([[of_rim[i] for of_rim in zone] for zone in found]) for i in range(3)))


def deepest_points(drive: Drive, errors: DriveErrors, theta: ArrayLike) -> DeepestPoints:
    """Deepest points of a `drive` with `errors` at input angles `theta`, rad: the deeper rims of `branches`; the two
    broadcast, results have shape (2, ...)."""
    return deepest(branches(drive, errors, theta))
