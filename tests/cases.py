"""Drives and errors that many tests use."""

from __future__ import annotations

from math import radians

import numpy as np

from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Drive, DriveGeometry, Structure, WaveGenerator
from hdopt.drive.profiles import Ellipse, MeasuredProfile, Resal, TwoDisk, WaveGeneratorProfile

CSF_25_80 = DriveGeometry(160, 162, 0.396, radians(12), 30.65, 0.277, 0.257, 0.74)
"""Jia 2021, Table 1."""
TABLE_1_ELLIPSE = Ellipse(31.046, 30.318)

BASE_ERRORS = DriveErrors(
    0.010,
    radians(45),
    radians(0.2),
    radians(0.2),
    0.005,
    radians(45),
    radians(0.1),
    radians(0.1),
    0.002,
    0.0,
    0.002,
    0.0,
)
"""Jia 2021, the base case of Table 2."""

TURN = np.arange(720) * np.pi / 360

PROFILES: dict[str, WaveGeneratorProfile] = {
    "ellipse": Ellipse.of_equal_perimeter(30.65, 31.046),
    "resal": Resal(30.65, 0.396),
    "two_disk": TwoDisk(30.65, 0.396, radians(60)),
    "measured": MeasuredProfile(TURN, TABLE_1_ELLIPSE.radius(TURN)),
}
"""One of every registered profile."""


def drive(
    profile: WaveGeneratorProfile = TABLE_1_ELLIPSE,
    structure: Structure = Structure.INTEGRAL,
    width: float = 9.0,
    geometry: DriveGeometry = CSF_25_80,
) -> Drive:
    return Drive(geometry, WaveGenerator(profile, structure, width, 3.0))


def random_errors(n: int, seed: int, scale: float = 1.0) -> DriveErrors:
    """`n` drives of the shipped tolerances' distributions, times `scale`."""
    rng = np.random.default_rng(seed)

    def rayleigh(sigma: float, upper: float):
        return scale * sigma * np.sqrt(-2 * np.log1p(-rng.random(n) * -np.expm1(-((upper / sigma) ** 2) / 2)))

    def normal(sigma_deg: float):
        from scipy.special import ndtr, ndtri

        low = ndtr(-3.0)
        return scale * np.radians(sigma_deg) * ndtri(low + rng.random(n) * (1 - 2 * low))

    def angle():
        return rng.uniform(0, 2 * np.pi, n)

    def tooth():
        return scale * rng.uniform(0.001, 0.003, n)

    return DriveErrors(
        rayleigh(0.005, 0.015),
        angle(),
        normal(0.0667),
        normal(0.0667),
        rayleigh(0.0025, 0.0075),
        angle(),
        normal(0.0333),
        normal(0.0333),
        tooth(),
        angle(),
        tooth(),
        angle(),
    )
