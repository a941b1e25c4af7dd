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

    def evaluate(
        self, theta: Array, errors: Array, extra: Array | None = None
    ) -> tuple[Array, NDArray[np.int64], Array]:
        """KE (arcmin, n), the driving zone (0 or 1, n) and dKE/derrors (arcmin/mm, n x 12).

        `theta` (n,) rad, `errors` (12,) mm. `extra` (2, n) in mm is added to the deviation of each zone before the
        larger one is taken. The slope is that of the branch that drives: it jumps where the zone or the rim changes.
        """
        theta = np.ascontiguousarray(theta, float)
        if extra is None:
            extra = np.zeros((2, 1))
        return _evaluate(
            theta,
            self.tip,
            self.tan_alpha,
            self.arcmin_per_mm,
            self.advance,
            np.asarray(errors, float),
            np.ascontiguousarray(extra),
        )


@njit(cache=True)
def _evaluate(theta, tip, tan_alpha, scale, advance, p, extra):
    half_width, tilt_gain = tip.half_width, (tip.semi_major + tip.tip_radius) / 2 / tip.half_width**2
    flatness, bow = tip.semi_major - tip.tip_radius, tip.semi_major / 2 / tip.half_width**2
    motion = rigid_motion(
        tip, p[0], p[1], p[2] / half_width, p[3] / half_width, p[4], p[5], p[6] / half_width, p[7] / half_width
    )
    n = len(theta)
    value = np.empty(n)
    zone = np.empty(n, np.int64)
    jacobian = np.empty((n, 12))
    has_extra = extra.shape[1] == n
    for i in range(n):
        c, s = math.cos(theta[i]), math.sin(theta[i])
        cf, sf = math.cos(advance * theta[i]), math.sin(advance * theta[i])
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
            x, xf = z_now * o_now, z_now * of_now
            cos_x, sin_x, cos_xf, sin_xf = math.cos(x), math.sin(x), math.cos(xf), math.sin(xf)
            cs_sin, cs_cos = s * cos_x + c * sin_x, c * cos_x - s * sin_x
            fs_sin, fs_cos = sf * cos_xf + cf * sin_xf, cf * cos_xf - sf * sin_xf
            tau = depth * tan_alpha + z_now * (p[8] * cs_sin + p[9] * cs_cos + (p[10] * fs_sin + p[11] * fs_cos))
            if has_extra:
                tau += extra[0 if z_now > 0 else 1, i]
            if tau > best:
                best, z, k, o = tau, z_now, k_now, o_now
                so, co, sof, cof = cs_sin, cs_cos, fs_sin, fs_cos
        value[i] = scale * best
        zone[i] = 0 if z > 0 else 1
        # d tau = tan_alpha d depth + (d tau/d o) d o + (d tau/d o') d o', where o = q/flatness and o' = o - shift/L_W.
        slope_cs = p[8] * co - p[9] * so
        slope_fs = p[10] * cof - p[11] * sof
        by_q = tan_alpha * o + (slope_cs + slope_fs) / flatness
        by_shift = -slope_fs / tip.semi_major
        for j in range(8):
            de_a = de_l = dt_a = dt_l = 0.0
            if j == 0:
                de_a, de_l = tip.passes_major * s, tip.passes_minor * c
            elif j == 1:
                de_a, de_l = tip.passes_major * c, -tip.passes_minor * s
            elif j == 2:
                dt_a, dt_l = s, c
            elif j == 3:
                dt_a, dt_l = c, -s
            elif j == 4:
                de_a = tip.passes_major
            elif j == 5:
                de_l = tip.passes_minor
            elif j == 6:
                dt_a = 1.0
            else:
                dt_l = 1.0
            dshift = de_l + z * k * dt_l
            dq = dshift - z * tilt_gain * (t_a * dt_l + dt_a * t_l)
            jacobian[i, j] = scale * (
                tan_alpha * (z * de_a + k * dt_a - 2 * bow * t_a * dt_a) + by_q * dq + by_shift * dshift
            )
        jacobian[i, 8] = scale * z * so
        jacobian[i, 9] = scale * z * co
        jacobian[i, 10] = scale * z * sof
        jacobian[i, 11] = scale * z * cof
    return value, zone, jacobian
