"""Bending and stretch of the flexspline's ring by the wave generator: change of curvature, stresses, safety."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from hdopt.arrays import Array
from hdopt.drive.geometry import Drive, DriveGeometry, Material
from hdopt.drive.profiles import WaveGeneratorProfile, perimeter_error, polar_curvature
from hdopt.errors import MissingValue

QUARTER = np.linspace(0.0, math.pi / 2, 3601)
"""Angles over which extremes are taken: profiles are symmetric about both axes; 0.025 deg finds them to 1e-7."""


def ring_wall(geometry: DriveGeometry) -> float:
    """Wall thickness s of the flexspline's ring of `geometry`, mm; raises `MissingValue` where it is not given."""
    if geometry.flexspline_wall is None:
        raise MissingValue("bending of the ring", "drive.flexspline_wall_mm")
    return geometry.flexspline_wall


def curvature_change(geometry: DriveGeometry, profile: WaveGeneratorProfile, phi: ArrayLike) -> Array:
    """Change of curvature of the ring's neutral line at `phi` (rad from the major axis), 1/mm; same shape.

    Bent is the ring of `geometry` by the wave generator's `profile`, which is its inner wall. The neutral line lies
    half a wall (s/2) outside that wall, R_b being its undeformed radius, and takes the same deflection w:
    kappa(R_b + s/2 + w) - 1/(R_b + s/2), exact curvature. For small w it tends to -(w + w'')/R^2, which is 3 w0/R^2
    at the tip of w = w0 cos 2 phi (Timoshenko, Theory of Plates and Shells, Sec. 114). Raises `MissingValue` where
    the geometry has no wall.
    """
    half_wall = ring_wall(geometry) / 2
    bent = polar_curvature(profile.radius(phi) + half_wall, profile.radius(phi, 1), profile.radius(phi, 2))
    return bent - 1 / (geometry.flexspline_inner_radius + half_wall)


def max_curvature_change(geometry: DriveGeometry, profile: WaveGeneratorProfile) -> float:
    """Largest magnitude of `curvature_change` along the ring of `geometry` on `profile`, 1/mm.

    Sought at steps of 0.025 deg over a quarter of the ring, or over all of it where the tips are not alike.
    """
    phi = QUARTER if profile.tip_is_smooth else np.concatenate([QUARTER + k * math.pi / 2 for k in range(4)])
    return float(np.abs(curvature_change(geometry, profile, phi)).max())


def bending_stress(material: Material, wall: float, change: ArrayLike, plate: bool = False) -> Array:
    """Stress at the wall's surface where the curvature has the given `change` (1/mm), N/mm^2; shape of `change`.

    E s (change)/2 for an isotropic ring of `material` and wall thickness `wall` (s, mm) whose lengthwise strain is
    free. As a `plate` that strain is held (wide ring), which makes it 1/(1 - nu^2) times as large.
    """
    factor = 1 / (1 - material.poisson**2) if plate else 1.0
    return factor * material.modulus * wall * np.asarray(change) / 2


def hoop_stress(material: Material, geometry: DriveGeometry, profile: WaveGeneratorProfile) -> float:
    """Stress of the ring of `geometry` and `material` that `profile` stretches, N/mm^2; 0 where it does not.

    E (P - 2 pi R_b)/(2 pi R_b) at the inner wall, where it is largest: P is the perimeter of the profile, which that
    wall takes (radius R_b before). Of a free ring that follows the profile all round.
    """
    unstretched = 2 * math.pi * geometry.flexspline_inner_radius
    return material.modulus * max(perimeter_error(profile, geometry.flexspline_inner_radius) / unstretched, 0.0)


def fatigue_safety(endurance: float, notched_amplitude: float, mean: float, sensitivity: float) -> float:
    """Safety n = sigma_-1/(K_sigma sigma_a + psi sigma_m) against fatigue by an alternating stress on a mean one.

    `endurance` is sigma_-1, `notched_amplitude` K_sigma sigma_a, the alternating stress times its notch factor, `mean`
    sigma_m (all N/mm^2) and `sensitivity` psi (none): a straight line in Haigh's diagram. A steady tension is not
    raised by the notch factor, as it yields there.
    """
    return endurance / (notched_amplitude + sensitivity * mean)


def max_bending_stress(drive: Drive, plate: bool = False) -> float:
    """Largest bending stress along the ring of this `drive`, N/mm^2; `plate` as in `bending_stress`.

    Raises `MissingValue` where the drive has no material or its flexspline no wall.
    """
    if drive.material is None:
        raise MissingValue("bending stress", "material.modulus_mpa", "material.poisson")
    change = max_curvature_change(drive.geometry, drive.wave_generator.profile)
    return float(bending_stress(drive.material, ring_wall(drive.geometry), change, plate))
