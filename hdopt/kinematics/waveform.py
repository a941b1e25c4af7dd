"""From deepest points to the kinematic error over the input angle (Jia 2021, Eqs. (24)-(32))."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hdopt.deviations import DriveErrors
from hdopt.drive import Drive
from hdopt.kinematics import closed_form, exact
from hdopt.kinematics.exact import DeepestPoints

Array = NDArray[np.float64]
Geometry = Callable[[Drive, DriveErrors, ArrayLike], DeepestPoints]

GEOMETRIES: dict[str, Geometry] = {"closed form": closed_form.deepest_points, "exact": exact.deepest_points}


def geometry_for(drive: Drive, geometry: str | None = None) -> Geometry:
    """The geometry named, or the one that fits: the closed form where the profile's tips are smooth, else the exact."""
    if geometry is None:
        geometry = "closed form" if drive.wave_generator.profile.tip_is_smooth else "exact"
    if geometry not in GEOMETRIES:
        raise ValueError(f"geometry is {geometry!r}; it must be one of {', '.join(GEOMETRIES)}")
    return GEOMETRIES[geometry]


def circular_spline_term(errors: DriveErrors, points: DeepestPoints, theta: ArrayLike) -> Array:
    """Deviation of the CS teeth met in each zone, mm of arc, shape (2, ...) (Jia 2021, Eqs. (31a), (31b))."""
    phase = np.asarray(theta) + errors.cs_tooth_phase
    zone_1, zone_2 = points.offset_cs
    return errors.cs_tooth_amplitude * np.stack([np.sin(phase + zone_1), np.sin(phase + np.pi - zone_2)])


def flexspline_term(drive: Drive, errors: DriveErrors, points: DeepestPoints, theta: ArrayLike) -> Array:
    """Deviation of the FS teeth met in each zone, mm of arc, shape (2, ...) (Jia 2021, Eqs. (31a), (31b)).

    The FS tooth under the major axis advances by Z_CS/Z_FS of the input angle; the half turn to zone 2 is not scaled.
    """
    geometry = drive.geometry
    advance = geometry.circular_spline_teeth / geometry.flexspline_teeth
    phase = advance * np.asarray(theta) + errors.fs_tooth_phase
    zone_1, zone_2 = points.offset_fs
    return errors.fs_tooth_amplitude * np.stack([np.sin(phase + zone_1), np.sin(phase + np.pi - zone_2)])


def zone_deviation(drive: Drive, errors: DriveErrors, theta: ArrayLike, geometry: str | None = None) -> Array:
    """tau_1 and tau_2: circumferential deviation in each meshing zone, mm of arc, shape (2, ...).

    Misalignment makes an arc delta tan(alpha) (Jia 2021, Eqs. (24)-(26)); tooth deviations add to it ((31a), (31b)).
    `theta` in rad; for the exact geometry `errors` must be scalars and `theta` of shape (n,).
    """
    return deviation_at(drive, errors, theta, geometry_for(drive, geometry)(drive, errors, theta))


def deviation_at(drive: Drive, errors: DriveErrors, theta: ArrayLike, points: DeepestPoints) -> Array:
    """tau_1 and tau_2 for deepest points that are known already, mm of arc, shape (2, ...)."""
    return (
        points.depth * np.tan(drive.geometry.pressure_angle)
        + circular_spline_term(errors, points, theta)
        + flexspline_term(drive, errors, points, theta)
    )


def kinematic_error_arcmin(
    drive: Drive,
    errors: DriveErrors,
    theta: ArrayLike,
    geometry: str | None = None,
    homogenization: float = 1.0,
) -> Array:
    """Kinematic error over input angles `theta` (rad), arcmin, same shape: k_e (2 pi/l_FS) max(tau_1, tau_2), Eq. (32).

    The zone with the larger deviation drives. The values are those of the model, their mean is kept. `homogenization`
    is k_e: 1 for a single pair of teeth. `geometry`: "closed form", "exact", or None to choose by the profile.
    """
    deviation = zone_deviation(drive, errors, theta, geometry)
    return homogenization * drive.geometry.arcmin_per_mm * np.max(deviation, axis=0)


def full_turn(drive: Drive, samples_per_turn: int) -> Array:
    """Input angles of one full relative turn of FS and CS (N input turns for even Z_FS), rad, end left out."""
    turns = drive.geometry.beat_phases
    return np.arange(turns * samples_per_turn) * (2 * np.pi / samples_per_turn)


def relative_turn(
    drive: Drive, errors: DriveErrors, samples_per_turn: int, geometry: str | None = None
) -> tuple[Array, Array]:
    """Input angles (rad) and kinematic error (arcmin, k_e = 1) over one full relative turn of a drive; shapes (n,)."""
    theta, deviation = relative_turn_deviation(drive, errors, samples_per_turn, geometry)
    return theta, drive.geometry.arcmin_per_mm * np.max(deviation, axis=0)


def relative_turn_deviation(
    drive: Drive, errors: DriveErrors, samples_per_turn: int, geometry: str | None = None
) -> tuple[Array, Array]:
    """Input angles (rad, shape (n,)) of one full relative turn, and tau_1 and tau_2 there, mm of arc, shape (2, n).

    The deepest points repeat every input turn and are found once; only the FS teeth met differ from turn to turn.
    """
    theta = full_turn(drive, samples_per_turn)
    one_turn = geometry_for(drive, geometry)(drive, errors, theta[:samples_per_turn])
    turns = drive.geometry.beat_phases
    points = DeepestPoints(
        *(np.tile(values, turns) for values in (one_turn.depth, one_turn.offset_cs, one_turn.offset_fs, one_turn.rim))
    )
    return theta, deviation_at(drive, errors, theta, points)
