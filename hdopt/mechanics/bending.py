"""Bending of the flexspline's ring by the wave generator: change of curvature and the stress it makes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from hdopt.arrays import Array
from hdopt.drive.geometry import Drive, DriveGeometry, Material
from hdopt.drive.profiles import WaveGeneratorProfile, polar_curvature
from hdopt.errors import MissingValue

QUARTER = np.linspace(0.0, math.pi / 2, 3601)
"""Angles over which extremes are taken: profiles are symmetric about both axes; 0.025 deg finds them to 1e-7."""


def curvature_change(geometry: DriveGeometry, profile: WaveGeneratorProfile, phi: ArrayLike) -> Array:
    """Change of curvature of the ring's neutral line at `phi` (rad from the major axis), 1/mm; same shape.

    The neutral line lies half a wall outside the inner wall and takes the same deflection w:
    kappa(R_b + s/2 + w) - 1/(R_b + s/2), exact curvature. For small w it tends to -(w + w'')/R^2, which is 3 w0/R^2
    at the tip of w = w0 cos 2 phi (Timoshenko, Theory of Plates and Shells, Sec. 114).
    """
    if geometry.flexspline_wall is None:
        raise MissingValue("bending of the ring", "drive.flexspline_wall_mm")
    half_wall = geometry.flexspline_wall / 2
    bent = polar_curvature(profile.radius(phi) + half_wall, profile.radius(phi, 1), profile.radius(phi, 2))
    return bent - 1 / (geometry.flexspline_inner_radius + half_wall)


def max_curvature_change(geometry: DriveGeometry, profile: WaveGeneratorProfile) -> float:
    """Largest magnitude of `curvature_change` along the ring, 1/mm."""
    phi = QUARTER if profile.tip_is_smooth else np.concatenate([QUARTER + k * math.pi / 2 for k in range(4)])
    return float(np.abs(curvature_change(geometry, profile, phi)).max())


def bending_stress(material: Material, wall: float, change: ArrayLike, plate: bool = False) -> Array:
    """Stress at the wall's surface, E s (change of curvature)/2, N/mm^2; as a plate times 1/(1 - nu^2).

    An isotropic ring of wall thickness `wall` (mm) whose lengthwise strain is free; a plate's is held (wide ring).
    """
    factor = 1 / (1 - material.poisson**2) if plate else 1.0
    return factor * material.modulus * wall * np.asarray(change) / 2


def max_bending_stress(drive: Drive, plate: bool = False) -> float:
    """Largest bending stress along the ring of this drive, N/mm^2."""
    if drive.material is None:
        raise MissingValue("bending stress", "material.modulus_mpa", "material.poisson")
    change = max_curvature_change(drive.geometry, drive.wave_generator.profile)
    return float(bending_stress(drive.material, drive.geometry.flexspline_wall, change, plate))
