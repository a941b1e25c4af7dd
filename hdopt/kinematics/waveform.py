"""From deepest points to the kinematic error over the input angle (Jia 2021, Eqs. (24)-(32))."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from hdopt.arrays import Array
from hdopt.drive.errors import DriveErrors, Values
from hdopt.drive.geometry import Drive
from hdopt.kinematics import closed_form, exact
from hdopt.kinematics.branches import Branches, DeepestPoints
from hdopt.kinematics.closed_form import tooth_deviation

Geometry = Callable[[Drive, DriveErrors, ArrayLike], DeepestPoints]

EXACT, CLOSED_FORM = "exact", "closed form"
"""The two methods: the exact geometry of Jia 2021, Eqs. (16)-(23), and its expansion to second order in the errors."""

DEFAULT_METHOD = EXACT
"""The method of everything that is said of one drive. Many drives at once take the compiled closed form."""

GEOMETRIES: dict[str, Geometry] = {CLOSED_FORM: closed_form.deepest_points, EXACT: exact.deepest_points}
BRANCHES: dict[str, Callable[[Drive, DriveErrors, ArrayLike], Branches]] = {
    CLOSED_FORM: closed_form.branches,
    EXACT: exact.branches,
}


def geometry_for(drive: Drive, geometry: str = DEFAULT_METHOD) -> Geometry:
    """The deepest points by the `geometry` named; the closed form is refused for a `drive` without smooth tips."""
    if geometry not in GEOMETRIES:
        raise ValueError(f"geometry is {geometry!r}; it must be one of {', '.join(GEOMETRIES)}")
    if geometry == CLOSED_FORM and not drive.wave_generator.profile.tip_is_smooth:
        raise ValueError(f"the closed form needs smooth tips; take {EXACT!r} for a measured profile")
    return GEOMETRIES[geometry]


def circular_spline_term(errors: DriveErrors, points: DeepestPoints, theta: ArrayLike) -> Array:
    """Deviation of the CS teeth with these `errors` met in each zone, mm of arc, shape (2, ...); `points` are the
    deepest ones at input angles `theta` (rad) (Jia 2021, Eqs. (31a), (31b))."""
    return _teeth(errors.cs_tooth_amplitude, errors.cs_tooth_phase, np.asarray(theta, float), points.offset_cs)


def flexspline_term(drive: Drive, errors: DriveErrors, points: DeepestPoints, theta: ArrayLike) -> Array:
    """Deviation of the FS teeth met in each zone, mm of arc, shape (2, ...) (Jia 2021, Eqs. (31a), (31b)).

    `drive` with `errors`; `points` and `theta` as in `circular_spline_term`. The FS tooth under the major axis advances
    by Z_CS/Z_FS of the input angle; the half turn to zone 2 is not scaled.
    """
    turned = drive.geometry.flexspline_advance * np.asarray(theta, float)
    return _teeth(errors.fs_tooth_amplitude, errors.fs_tooth_phase, turned, points.offset_fs)


def _teeth(amplitude: Values, phase: Values, angle: Array, offsets: Array) -> Array:
    cos_part, sin_part, cos, sin = amplitude * np.sin(phase), amplitude * np.cos(phase), np.cos(angle), np.sin(angle)
    zones = zip((1.0, -1.0), offsets, strict=True)
    return np.stack([tooth_deviation(cos_part, sin_part, cos, sin, s, np.cos(o), np.sin(o)) for s, o in zones])


def zone_deviation(drive: Drive, errors: DriveErrors, theta: ArrayLike, geometry: str = DEFAULT_METHOD) -> Array:
    """tau_1 and tau_2: circumferential deviation in each meshing zone, mm of arc, shape (2, ...).

    Misalignment makes an arc delta tan(alpha) (Jia 2021, Eqs. (24)-(26)); tooth deviations add to it ((31a), (31b)).
    `drive` with `errors`; `theta` in rad; `geometry` "exact" or "closed form". For the exact geometry `errors` must be
    scalars and `theta` of shape (n,).
    """
    return deviation_at(drive, errors, theta, geometry_for(drive, geometry)(drive, errors, theta))


def deviation_at(
    drive: Drive,
    errors: DriveErrors,
    theta: ArrayLike,
    points: DeepestPoints,
    misalignment: float = 1.0,
    sine_share: float = 1.0,
) -> Array:
    """tau_1 and tau_2 of `drive` with `errors` at `theta` (rad) for deepest `points` that are known already, mm of arc,
    shape (2, ...).

    Where the teeth in contact share a term, `misalignment` multiplies what misalignment makes and `sine_share` the
    sines; measured teeth are shared in their table.
    """
    sines = circular_spline_term(errors, points, theta) + flexspline_term(drive, errors, points, theta)
    tan_alpha = misalignment * np.tan(drive.geometry.pressure_angle)
    deviation: Array = points.depth * tan_alpha + sine_share * sines
    return deviation + measured_term(drive, points, theta) if drive.has_measured_teeth else deviation


def measured_term(drive: Drive, points: DeepestPoints, theta: ArrayLike) -> Array:
    """Mean deviation of the measured teeth of `drive` in contact in each zone, mm of arc, shape (2, ...); `points` are
    the deepest ones at input angles `theta` (rad)."""
    from hdopt.kinematics.essential import on_table
    from hdopt.kinematics.load_sharing import mesh_tables

    turned = np.asarray(theta, float), drive.geometry.flexspline_advance * np.asarray(theta, float)
    total = np.zeros(np.shape(points.depth))
    for table, angle, offsets in zip(mesh_tables(drive), turned, (points.offset_cs, points.offset_fs), strict=True):
        if len(table):
            total += [on_table(table, angle + offsets[0]), on_table(table, angle + np.pi - offsets[1])]
    return total


def kinematic_error_arcmin(
    drive: Drive,
    errors: DriveErrors,
    theta: ArrayLike,
    geometry: str = DEFAULT_METHOD,
    homogenization: float = 1.0,
) -> Array:
    """Kinematic error over input angles `theta` (rad), arcmin, same shape: k_e (2 pi/l_FS) max(tau_1, tau_2), Jia 2021,
    Eq. (32).

    tau_1 and tau_2 are the deviations of both zones of `drive` with the `errors` of one drive. The zone with the larger
    deviation drives. The values are those of the model, their mean is kept. `homogenization` is k_e: 1 for a single
    pair of teeth. `geometry`: "exact" or "closed form".
    """
    deviation = zone_deviation(drive, errors, theta, geometry)
    error: Array = homogenization * drive.geometry.arcmin_per_mm * np.max(deviation, axis=0)
    return error


def full_turn(drive: Drive, samples_per_turn: int) -> Array:
    """Input angles of one full relative turn of FS and CS of `drive` (N input turns for even Z_FS), rad, end left out,
    `samples_per_turn` an input turn."""
    turns = drive.geometry.beat_phases
    return np.arange(turns * samples_per_turn, dtype=np.float64) * (2 * np.pi / samples_per_turn)


def relative_turn(
    drive: Drive, errors: DriveErrors, samples_per_turn: int, geometry: str = DEFAULT_METHOD
) -> tuple[Array, Array]:
    """Input angles (rad) and kinematic error (arcmin, k_e = 1) over one full relative turn of `drive` with `errors`, at
    `samples_per_turn` angles an input turn, by the `geometry` named; shapes (n,)."""
    theta, deviation = relative_turn_deviation(drive, errors, samples_per_turn, geometry)
    return theta, drive.geometry.arcmin_per_mm * np.max(deviation, axis=0)


def relative_turn_deviation(
    drive: Drive, errors: DriveErrors, samples_per_turn: int, geometry: str = DEFAULT_METHOD
) -> tuple[Array, Array]:
    """Input angles (rad, shape (n,)) of one full relative turn, and tau_1 and tau_2 there, mm of arc, shape (2, n).

    Arguments as in `relative_turn`: `drive`, `errors`, `samples_per_turn`, `geometry`. The deepest points repeat every
    input turn and are found once; only the FS teeth met differ from turn to turn.
    """
    theta, points = relative_turn_points(drive, errors, samples_per_turn, geometry)
    return theta, deviation_at(drive, errors, theta, points)


def relative_turn_points(
    drive: Drive, errors: DriveErrors, samples_per_turn: int, geometry: str = DEFAULT_METHOD
) -> tuple[Array, DeepestPoints]:
    """Input angles (rad, shape (n,)) of one full relative turn, and the deepest points there; arguments as in
    `relative_turn`: `drive`, `errors`, `samples_per_turn`, `geometry`."""
    theta = full_turn(drive, samples_per_turn)
    one_turn = geometry_for(drive, geometry)(drive, errors, theta[:samples_per_turn])
    turns = drive.geometry.beat_phases
    repeated = (np.tile(v, turns) for v in (one_turn.depth, one_turn.offset_cs, one_turn.offset_fs, one_turn.rim))
    return theta, DeepestPoints(*repeated)
