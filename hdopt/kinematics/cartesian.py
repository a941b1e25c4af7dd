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
from numba import njit

from hdopt.arrays import Array, Index
from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Drive
from hdopt.kinematics.closed_form import ErrorComponents, TipGeometry, tip_geometry
from hdopt.kinematics.compiled_closed_form import motion_at, rigid_motion, rim_constants, rim_depth, tooth_deviation
from hdopt.kinematics.essential import between
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
SLOPE_CELLS = 0.01
"""Half the step, in places of a table of measured teeth, over which its slope is taken."""


Evaluated: TypeAlias = tuple[Array, Index, Array]
"""KE (arcmin, n), the driving zone (0 or 1, n) and dKE/derrors (arcmin/mm, n x 12)."""


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
    def half_width(self) -> float:
        """b/2 of the wave generator, mm."""
        return self.tip.half_width

    def rotation(self, theta: Array) -> Array:
        """cos and sin of the input angle (n,) rad, and of the FS teeth's advance: (n, 4), for `evaluate_at`."""
        advance = self.advance * np.asarray(theta, float)
        return np.column_stack([np.cos(theta), np.sin(theta), np.cos(advance), np.sin(advance)])

    def evaluate(self, theta: Array, errors: Array, extra: Array | None = None) -> Evaluated:
        """`evaluate_at` for input angles `theta` (n,) rad."""
        return self.evaluate_at(self.rotation(theta), errors, extra)

    def evaluate_at(self, rotation: Array, errors: Array, extra: Array | None = None) -> Evaluated:
        """KE (arcmin, n), the driving zone (0 or 1, n) and dKE/derrors (arcmin/mm, n x 12) at a `rotation` (n, 4).

        `errors` (12,) mm. `extra` (2, n) in mm is added to the deviation of each zone before the
        larger one is taken. The slope is that of the branch that drives: it jumps where the zone or the rim changes.
        """
        if extra is None:
            extra = np.zeros((2, 1))
        return _evaluate(
            rotation,
            self.tip,
            self.tan_alpha,
            self.arcmin_per_mm,
            np.asarray(errors, float),
            np.ascontiguousarray(extra),
            self.cs_table,
            self.fs_table,
        )


@njit(cache=True, error_model="numpy")
def _sine_cosine(x: float) -> tuple[float, float]:
    """sin and cos; below 0.05 rad, where every real drive's offsets lie, by series to 1e-14."""
    if abs(x) > 0.05:
        return math.sin(x), math.cos(x)
    y = x * x
    return (
        x * (1 - y / 6 * (1 - y / 20 * (1 - y / 42 * (1 - y / 72)))),
        1 - y / 2 * (1 - y / 12 * (1 - y / 30 * (1 - y / 56))),
    )


@njit(cache=True, error_model="numpy")
def _measured(table: Array, sin: float, cos: float, beyond: float) -> tuple[float, float]:
    """A table of measured teeth (mm of arc) at the angle of this `sin` and `cos`, `beyond` (rad) further, and its slope
    (mm/rad); 0 for an empty one."""
    n = len(table)
    if n == 0:
        return 0.0, 0.0
    place = (math.atan2(sin, cos) + beyond) / (2 * math.pi) * n
    rise = between(table, place + SLOPE_CELLS) - between(table, place - SLOPE_CELLS)
    return between(table, place), rise / (2 * SLOPE_CELLS) * n / (2 * math.pi)


@njit(cache=True, nogil=True, error_model="numpy")
def _evaluate(
    rotation: Array, tip: TipGeometry, tan_alpha: float, scale: float, p: Array, extra: Array, cs: Array, fs: Array
) -> Evaluated:
    """`CartesianModel.evaluate_at`; `scale` is arcmin per mm of arc, `p` the errors (12,), `extra` (2, n) or (2, 1);
    `cs`, `fs` the tables of measured teeth."""
    half_width = tip.half_width
    rim = rim_constants(tip)
    components = ErrorComponents(
        p[0], p[1], p[2] / half_width, p[3] / half_width, p[4], p[5], p[6] / half_width, p[7] / half_width
    )
    motion = rigid_motion(tip, components)
    n = len(rotation)
    value, zone, jacobian = np.empty(n), np.empty(n, np.int64), np.empty((n, 12))
    has_extra = extra.shape[1] == n
    for i in range(n):
        c, s, cf, sf = rotation[i, 0], rotation[i, 1], rotation[i, 2], rotation[i, 3]
        e_a, e_l, t_a, t_l = motion_at(motion, c, s)
        best, z, k, o = -math.inf, 1.0, 1.0, 0.0
        sin_o = sin_of = rise_cs = rise_fs = 0.0
        cos_o = cos_of = 1.0
        for z_now in (1.0, -1.0):
            depth, o_now, of_now = rim_depth(rim, e_a, e_l, t_a, t_l, z_now, 1.0)
            depth_low, o_low, of_low = rim_depth(rim, e_a, e_l, t_a, t_l, z_now, -1.0)
            k_now = 1.0
            if depth_low > depth:
                depth, o_now, of_now, k_now = depth_low, o_low, of_low, -1.0
            sin_now, cos_now = _sine_cosine(o_now)
            sin_f_now, cos_f_now = _sine_cosine(of_now)
            tau = depth * tan_alpha + tooth_deviation(p[9], p[8], c, s, z_now, cos_now, sin_now)
            tau += tooth_deviation(p[11], p[10], cf, sf, z_now, cos_f_now, sin_f_now)
            away = 0.0 if z_now > 0 else math.pi
            on_cs, rise_cs_now = _measured(cs, s, c, z_now * o_now + away)
            on_fs, rise_fs_now = _measured(fs, sf, cf, z_now * of_now + away)
            tau += on_cs + on_fs
            if has_extra:
                tau += extra[0 if z_now > 0 else 1, i]
            if tau > best:
                best, z, k, o = tau, z_now, k_now, o_now
                rise_cs, rise_fs = rise_cs_now, rise_fs_now
                sin_o, cos_o, sin_of, cos_of = sin_now, cos_now, sin_f_now, cos_f_now
        value[i] = scale * best
        zone[i] = 0 if z > 0 else 1
        so, co = s * cos_o + z * c * sin_o, c * cos_o - z * s * sin_o
        sof, cof = sf * cos_of + z * cf * sin_of, cf * cos_of - z * sf * sin_of
        # d tau = tan_alpha d depth + (d tau/d o) d o + (d tau/d o') d o', where o = q/flatness and o' = o - shift/L_W,
        # first by the motions e_a, e_l, t_a, t_l of the rim.
        slope_cs = p[8] * co - p[9] * so + z * rise_cs
        slope_fs = p[10] * cof - p[11] * sof + z * rise_fs
        by_q = tan_alpha * o + (slope_cs + slope_fs) * rim.per_flatness
        by_shift = by_q - slope_fs / tip.semi_major
        by_e_a = scale * tan_alpha * z * tip.passes_major
        by_e_l = scale * by_shift * tip.passes_minor
        by_t_a = scale * (tan_alpha * (k - 2 * rim.bow * t_a) - by_q * z * rim.tilt_gain * t_l)
        by_t_l = scale * (by_shift * z * k - by_q * z * rim.tilt_gain * t_a)
        jacobian[i, 0], jacobian[i, 1] = by_e_a * s + by_e_l * c, by_e_a * c - by_e_l * s
        jacobian[i, 2], jacobian[i, 3] = by_t_a * s + by_t_l * c, by_t_a * c - by_t_l * s
        jacobian[i, 4], jacobian[i, 5], jacobian[i, 6], jacobian[i, 7] = by_e_a, by_e_l, by_t_a, by_t_l
        jacobian[i, 8], jacobian[i, 9] = scale * z * so, scale * z * co
        jacobian[i, 10], jacobian[i, 11] = scale * z * sof, scale * z * cof
    return value, zone, jacobian
