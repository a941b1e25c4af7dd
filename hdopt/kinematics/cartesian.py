"""The kinematic error of one drive in the form that a fit needs: Cartesian errors, driving zone and derivatives.

The closed form (Jia 2021, Eqs. (16)-(32); `hdopt.kinematics.closed_form` inlined) in one compiled pass. The twelve
errors are lengths in mm, so that the model is smooth where an amplitude is zero: (e1 sin beta1, e1 cos beta1), the
input axis's tilt as rim lift (b/2)(tan beta3, tan beta2), (e2 cos alpha1, e2 sin alpha1), the wave generator's tilt
(b/2)(tan alpha2, tan alpha3), teeth (a cos phi, a sin phi) of CS and FS.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Drive
from hdopt.kinematics.cartesian_kernel import Gear, OnSplines, beyond, evaluated
from hdopt.kinematics.closed_form import TipGeometry, tip_geometry
from hdopt.kinematics.load_sharing import NO_TABLE, mesh_tables

CARTESIAN_NAMES = (
    "axis eccentricity x",
    "axis eccentricity y",
    "axis tilt x",
    "axis tilt y",
    "wave-generator eccentricity along its major axis",
    "wave-generator eccentricity along its minor axis",
    "wave-generator tilt major",
    "wave-generator tilt minor",
    "CS tooth sine",
    "CS tooth cosine",
    "FS tooth sine",
    "FS tooth cosine",
)
PARAMETERS = len(CARTESIAN_NAMES)
ONCE_ROUND = (CARTESIAN_NAMES.index("CS tooth sine"), CARTESIAN_NAMES.index("FS tooth sine"))
"""The place of the errors that are a sine and, after it, a cosine once round either spline."""
MOST_WAVES = 64
"""Waves round a spline up to which the compiled pass is a quick way to add them: it goes through all that are fewer."""
NO_WAVES = np.empty((2, 0))
"""Nothing that stands on a spline besides its own teeth."""

Evaluated: TypeAlias = tuple[Array, Index, Array]
"""KE (arcmin, n), the driving zone (0 or 1, n) and dKE/derrors (arcmin/mm, n x 12)."""


def rotation_of(turned: Array) -> Array:
    """cos and sin of both rows of `turned` (2, n), rad, how far the input and the flexspline's teeth
    have turned; (4, n), for `CartesianModel.evaluate_at`."""
    return np.concatenate([[np.cos(angle), np.sin(angle)] for angle in turned])


def to_drive_errors(cartesian: Array, half_width: float) -> DriveErrors:
    """`DriveErrors` from `cartesian` errors (12,) in mm, in the order of `CARTESIAN_NAMES`; `half_width` is b/2 of the
    wave generator, mm."""
    p = np.asarray(cartesian, float)
    return DriveErrors(
        axis_eccentricity=math.hypot(p[0], p[1]),
        axis_eccentricity_direction=math.atan2(p[0], p[1]),
        axis_tilt_y=math.atan(p[3] / half_width),
        axis_tilt_x=math.atan(p[2] / half_width),
        wg_eccentricity=math.hypot(p[4], p[5]),
        wg_eccentricity_direction=math.atan2(p[5], p[4]),
        wg_tilt_major=math.atan(p[6] / half_width),
        wg_tilt_minor=math.atan(p[7] / half_width),
        cs_tooth_amplitude=math.hypot(p[8], p[9]),
        cs_tooth_phase=math.atan2(p[9], p[8]),
        fs_tooth_amplitude=math.hypot(p[10], p[11]),
        fs_tooth_phase=math.atan2(p[11], p[10]),
    )


def to_cartesian(errors: DriveErrors, half_width: float) -> Array:
    """Cartesian errors (12,) in mm from the `DriveErrors` of one drive; `half_width` is b/2, mm."""
    e = errors
    return np.array(
        [
            e.axis_eccentricity * math.sin(e.axis_eccentricity_direction),
            e.axis_eccentricity * math.cos(e.axis_eccentricity_direction),
            half_width * math.tan(e.axis_tilt_x),
            half_width * math.tan(e.axis_tilt_y),
            e.wg_eccentricity * math.cos(e.wg_eccentricity_direction),
            e.wg_eccentricity * math.sin(e.wg_eccentricity_direction),
            half_width * math.tan(e.wg_tilt_major),
            half_width * math.tan(e.wg_tilt_minor),
            e.cs_tooth_amplitude * math.cos(e.cs_tooth_phase),
            e.cs_tooth_amplitude * math.sin(e.cs_tooth_phase),
            e.fs_tooth_amplitude * math.cos(e.fs_tooth_phase),
            e.fs_tooth_amplitude * math.sin(e.fs_tooth_phase),
        ]
    )


@dataclass(frozen=True)
class CartesianModel:
    """Constants of one drive: its wave generator's `tip`, tan of the pressure angle, arcmin per mm of arc, the
    `advance` Z_CS/Z_FS of the FS teeth, and the tables of measured teeth over one turn of each spline (mm of arc; empty
    where a spline's teeth are not measured), which stand beside the errors and are not fitted."""

    tip: TipGeometry
    tan_alpha: float
    arcmin_per_mm: float
    advance: float
    cs_table: Array = field(default_factory=lambda: NO_TABLE)
    fs_table: Array = field(default_factory=lambda: NO_TABLE)

    @classmethod
    def of(cls, drive: Drive) -> CartesianModel:
        geometry = drive.geometry
        return cls(
            tip_geometry(drive),
            math.tan(geometry.pressure_angle),
            float(geometry.arcmin_per_mm),
            geometry.flexspline_advance,
            *mesh_tables(drive),
        )

    @property
    def gear(self) -> Gear:
        """The constants that the compiled pass takes."""
        return Gear(self.tip, self.tan_alpha, self.arcmin_per_mm)

    @property
    def half_width(self) -> float:
        """b/2 of the wave generator, mm."""
        return self.tip.half_width

    def rotation(self, theta: Array) -> Array:
        """cos and sin of the input angle (n,) rad, and of the FS teeth's advance: (4, n), for `evaluate_at`."""
        turned = np.asarray(theta, float)
        return rotation_of(np.stack([turned, self.advance * turned]))

    def evaluate(
        self, theta: Array, errors: Array, extra: Array | None = None, rises: Array | None = None
    ) -> Evaluated:
        """`evaluate_at` for input angles `theta` (n,) rad."""
        return self.evaluate_at(self.rotation(theta), errors, extra, rises)

    def beyond_at(self, rotation: Array, errors: Array) -> Array:
        """How far each zone's deepest point lies beyond its end of the major axis the way the wave generator turns,
        rad, (2, 2, n): first the spline (o seen from the CS centre, o' for the FS), then the zone. `rotation` (4, n),
        `errors` (12,) mm."""
        return beyond(rotation, self.tip, np.asarray(errors, float))

    def evaluate_at(
        self,
        rotation: Array,
        errors: Array,
        extra: Array | None = None,
        rises: Array | None = None,
        waves: tuple[Array, Array] = (NO_WAVES, NO_WAVES),
    ) -> Evaluated:
        """KE (arcmin, n), the driving zone (0 or 1, n) and dKE/derrors (arcmin/mm, n x 12) at a `rotation` (4, n).

        `errors` (12,) mm. `extra` (2, n) in mm is added to the deviation of each zone before the
        larger one is taken, and `rises` (2, 2, n) is its slope over the angle at which each spline (CS, FS) is met,
        mm/rad: the errors move that angle. `waves` stand on CS and FS besides, (2, h) mm of arc for sine and cosine of
        1 to h times the angle at which the spline is met. The slope is that of the branch that drives: it jumps where
        the zone or the rim changes.
        """
        if extra is None:
            extra = np.zeros((2, 1))
        if rises is None:
            rises = np.zeros((2, 2, 1))
        value, zone, slopes = evaluated(
            rotation,
            self.gear,
            np.asarray(errors, float),
            np.ascontiguousarray(extra),
            np.ascontiguousarray(rises),
            OnSplines(self.cs_table, self.fs_table, *waves),
        )
        return value, zone, slopes.T
