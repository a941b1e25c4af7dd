"""The numbers that Jia et al. 2021, MMT 155, 104122 publish, and the designs they belong to."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Drive, Structure
from hdopt.drive.profiles import Ellipse, Resal, TwoDisk, WaveGeneratorProfile

SOURCE = "Jia 2021, MMT 155, 104122"
SAMPLING_DEG = 10.0
TURNS = 80

Change = Callable[[Drive, DriveErrors], tuple[Drive, DriveErrors]]


@dataclass(frozen=True)
class PublishedCase:
    """A published peak-to-peak, arcmin (k_e = 1): what it varies, and from the base case how to get there."""

    name: str
    published_arcmin: float
    change: Change


def _errors(**changes: float) -> Change:
    return lambda drive, errors: (drive, errors.with_(**changes))


def _pressure_angle(angle_deg: float) -> Change:
    return lambda drive, errors: (
        replace(drive, geometry=replace(drive.geometry, pressure_angle=_deg(angle_deg))),
        errors,
    )


def _module(module: float) -> Change:
    return lambda drive, errors: (replace(drive, geometry=replace(drive.geometry, module=module)), errors)


def _structure(structure: Structure) -> Change:
    return lambda drive, errors: (
        replace(drive, wave_generator=replace(drive.wave_generator, structure=structure)),
        errors,
    )


def _deg(value: float) -> float:
    return math.radians(value)


CASES = (
    PublishedCase("base case, integral WG", 1.3290, _errors()),
    PublishedCase("automatic alignment WG", 1.0241, _structure(Structure.AUTOMATIC)),
    PublishedCase("alpha1 = 0 deg", 1.36, _errors(wg_eccentricity_direction=0.0)),
    PublishedCase("alpha1 = 90 deg", 1.25, _errors(wg_eccentricity_direction=_deg(90))),
    PublishedCase("alpha2 = 0.05 deg", 1.24, _errors(wg_tilt_major=_deg(0.05))),
    PublishedCase("alpha2 = 0.15 deg", 1.43, _errors(wg_tilt_major=_deg(0.15))),
    PublishedCase("alpha3 = 0.05 deg", 1.33, _errors(wg_tilt_minor=_deg(0.05))),
    PublishedCase("alpha3 = 0.15 deg", 1.33, _errors(wg_tilt_minor=_deg(0.15))),
    PublishedCase("e1 = 0.008 mm", 1.28, _errors(axis_eccentricity=0.008)),
    PublishedCase("e1 = 0.012 mm", 1.38, _errors(axis_eccentricity=0.012)),
    PublishedCase("e2 = 0.003 mm", 1.29, _errors(wg_eccentricity=0.003)),
    PublishedCase("e2 = 0.007 mm", 1.36, _errors(wg_eccentricity=0.007)),
    PublishedCase("alpha = 10 deg", 1.17, _pressure_angle(10)),
    PublishedCase("alpha = 14 deg", 1.50, _pressure_angle(14)),
    PublishedCase("m = 0.386 mm", 1.36, _module(0.386)),
    PublishedCase("m = 0.406 mm", 1.30, _module(0.406)),
    PublishedCase("a_CS = 0.001 mm", 1.25, _errors(cs_tooth_amplitude=0.001)),
    PublishedCase("a_CS = 0.003 mm", 1.42, _errors(cs_tooth_amplitude=0.003)),
    PublishedCase("a_FS = 0.001 mm", 1.22, _errors(fs_tooth_amplitude=0.001)),
    PublishedCase("a_FS = 0.003 mm", 1.44, _errors(fs_tooth_amplitude=0.003)),
)
"""Tables 2 and 3. Where m varies, L_W and D_W stay as they are."""

NO_TOOTH_ERROR_ARCMIN = 0.99
"""E1 + E2 without tooth errors, read off a figure: it belongs to a fine grid."""


@dataclass(frozen=True)
class PublishedProfile:
    """A row of Table 4 (k_B = 1): contact angle, k_e, and peak-to-peak of a single tooth pair and times k_e."""

    name: str
    contact_angle_deg: float
    k_e: float
    single_tooth_arcmin: float
    minimum_arcmin: float
    profile: Callable[[Drive], WaveGeneratorProfile]


PROFILES = (
    PublishedProfile("resal", 54.99, 0.201, 1.329, 0.2671, lambda drive: Resal(*_ring(drive))),
    PublishedProfile("two_disk, 60 deg", 57.71, 0.196, 1.331, 0.2609, lambda drive: TwoDisk(*_ring(drive), _deg(60))),
    PublishedProfile(
        "ellipse",
        55.54,
        0.200,
        1.328,
        0.2656,
        lambda drive: Ellipse.of_equal_perimeter(_ring(drive)[0], sum(_ring(drive))),
    ),
)


def _ring(drive: Drive) -> tuple[float, float]:
    """Undeformed radius and greatest deflection of the drive's wave generator, mm."""
    radius = drive.geometry.flexspline_inner_radius
    return radius, drive.wave_generator.profile.semi_major - radius
