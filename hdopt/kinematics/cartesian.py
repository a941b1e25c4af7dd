"""The kinematic error of one drive in the form that a fit needs: Cartesian errors, driving zone and derivatives.

The closed form (Jia 2021, Eqs. (16)-(32)) in one compiled pass. The twelve errors are lengths in mm, so that the model
is smooth where an amplitude is zero: (e1 sin beta1, e1 cos beta1), the input axis's tilt as rim lift (b/2)(tan beta3,
tan beta2), (e2 cos alpha1, e2 sin alpha1), the wave generator's tilt (b/2)(tan alpha2, tan alpha3), teeth (a cos phi,
a sin phi) of CS and FS.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from hdopt.deviations import DriveErrors
from hdopt.drive import Drive
from hdopt.kinematics.closed_form import TipGeometry, tip_geometry
from hdopt.kinematics.kernel import rigid_motion, rim_depth

Array = NDArray[np.float64]

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


def to_drive_errors(cartesian: Array, half_width: float) -> DriveErrors:
    """`DriveErrors` from Cartesian errors (12,) in mm; `half_width` is b/2 of the wave generator, mm."""
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
    """Constants of one drive: its wave generator's `tip`, tan of the pressure angle, arcmin per mm of arc, and the
    `advance` Z_CS/Z_FS of the FS teeth."""

    tip: TipGeometry
    tan_alpha: float
    arcmin_per_mm: float
    advance: float

    @classmethod
    def of(cls, drive: Drive) -> CartesianModel:
        geometry = drive.geometry
        return cls(
            tip_geometry(drive),
            math.tan(geometry.pressure_angle),
            float(geometry.arcmin_per_mm),
            geometry.circular_spline_teeth / geometry.flexspline_teeth,
        )

    @property
    def half_width(self) -> float:
        """b/2 of the wave generator, mm."""
        return self.tip.half_width

    def rotation(self, theta: Array) -> Array:
        """cos and sin of the input angle (n,) rad, and of the FS teeth's advance: (n, 4), for `evaluate_at`."""
        advance = self.advance * np.asarray(theta, float)
        return np.column_stack([np.cos(theta), np.sin(theta), np.cos(advance), np.sin(advance)])

    def evaluate(
        self, theta: Array, errors: Array, extra: Array | None = None
    ) -> tuple[Array, NDArray[np.int64], Array]:
        """`evaluate_at` for input angles `theta` (n,) rad."""
        return self.evaluate_at(self.rotation(theta), errors, extra)

    def evaluate_at(
        self, rotation: Array, errors: Array, extra: Array | None = None
    ) -> tuple[Array, NDArray[np.int64], Array]:
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
        )


@njit(cache=True, error_model="numpy")
def _sine_cosine(x):
    """sin and cos; below 0.05 rad, where every real drive's offsets lie, by series to 1e-14."""
    if abs(x) > 0.05:
        return math.sin(x), math.cos(x)
    y = x * x
    return (
        x * (1 - y / 6 * (1 - y / 20 * (1 - y / 42 * (1 - y / 72)))),
        1 - y / 2 * (1 - y / 12 * (1 - y / 30 * (1 - y / 56))),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _evaluate(rotation, tip, tan_alpha, scale, p, extra):
    half_width, tilt_gain = tip.half_width, (tip.semi_major + tip.tip_radius) / 2 / tip.half_width**2
    per_flatness, bow = 1 / (tip.semi_major - tip.tip_radius), tip.semi_major / 2 / tip.half_width**2
    motion = rigid_motion(
        tip, p[0], p[1], p[2] / half_width, p[3] / half_width, p[4], p[5], p[6] / half_width, p[7] / half_width
    )
    n = len(rotation)
    value = np.empty(n)
    zone = np.empty(n, np.int64)
    jacobian = np.empty((n, 12))
    has_extra = extra.shape[1] == n
    for i in range(n):
        c, s, cf, sf = rotation[i, 0], rotation[i, 1], rotation[i, 2], rotation[i, 3]
        e_a = motion.ea_cos * c + motion.ea_sin * s + motion.ea_0
        e_l = motion.el_cos * c + motion.el_sin * s + motion.el_0
        t_a = motion.ta_cos * c + motion.ta_sin * s + motion.ta_0
        t_l = motion.tl_cos * c + motion.tl_sin * s + motion.tl_0
        best, z, k, o = -math.inf, 1.0, 1.0, 0.0
        so = co = sof = cof = 0.0
        for z_now in (1.0, -1.0):
            depth, o_now, of_now = rim_depth(tip, e_a, e_l, t_a, t_l, z_now, 1.0)
            depth_low, o_low, of_low = rim_depth(tip, e_a, e_l, t_a, t_l, z_now, -1.0)
            k_now = 1.0
            if depth_low > depth:
                depth, o_now, of_now, k_now = depth_low, o_low, of_low, -1.0
            # Offsets o and o': forward in zone 1, backward in zone 2; a half turn away there, unscaled.
            sin_x, cos_x = _sine_cosine(z_now * o_now)
            sin_xf, cos_xf = _sine_cosine(z_now * of_now)
            so_now, co_now = s * cos_x + c * sin_x, c * cos_x - s * sin_x
            sof_now, cof_now = sf * cos_xf + cf * sin_xf, cf * cos_xf - sf * sin_xf
            teeth = p[8] * so_now + p[9] * co_now + p[10] * sof_now + p[11] * cof_now
            tau = depth * tan_alpha + z_now * teeth
            if has_extra:
                tau += extra[0 if z_now > 0 else 1, i]
            if tau > best:
                best, z, k, o = tau, z_now, k_now, o_now
                so, co, sof, cof = so_now, co_now, sof_now, cof_now
        value[i] = scale * best
        zone[i] = 0 if z > 0 else 1
        # d tau = tan_alpha d depth + (d tau/d o) d o + (d tau/d o') d o', where o = q/flatness and o' = o - shift/L_W,
        # first by the motions e_a, e_l, t_a, t_l of the rim.
        slope_cs = p[8] * co - p[9] * so
        slope_fs = p[10] * cof - p[11] * sof
        by_q = tan_alpha * o + (slope_cs + slope_fs) * per_flatness
        by_shift = by_q - slope_fs / tip.semi_major
        by_e_a = scale * tan_alpha * z * tip.passes_major
        by_e_l = scale * by_shift * tip.passes_minor
        by_t_a = scale * (tan_alpha * (k - 2 * bow * t_a) - by_q * z * tilt_gain * t_l)
        by_t_l = scale * (by_shift * z * k - by_q * z * tilt_gain * t_a)
        jacobian[i, 0] = by_e_a * s + by_e_l * c
        jacobian[i, 1] = by_e_a * c - by_e_l * s
        jacobian[i, 2] = by_t_a * s + by_t_l * c
        jacobian[i, 3] = by_t_a * c - by_t_l * s
        jacobian[i, 4] = by_e_a
        jacobian[i, 5] = by_e_l
        jacobian[i, 6] = by_t_a
        jacobian[i, 7] = by_t_l
        jacobian[i, 8] = scale * z * so
        jacobian[i, 9] = scale * z * co
        jacobian[i, 10] = scale * z * sof
        jacobian[i, 11] = scale * z * cof
    return value, zone, jacobian
