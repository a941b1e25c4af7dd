"""The base model in the form that a fit needs: waveform, driving zone and derivatives in one compiled pass.

The physics is that of `hdopt.kinematics` (closed form, Jia 2021, Eqs. (16)-(32)); a test holds the two together. Here
the twelve errors are Cartesian lengths in mm, so that the model is smooth where an amplitude is zero: (e1 sin b1, e1
cos b1), input-axis tilt as rim lift (b/2)(tan b3, tan b2), (e2 cos a1, e2 sin a1), wave-generator tilt (b/2)(tan a2,
tan a3), teeth (a cos phi, a sin phi) of CS and FS.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from hdopt.drive import Drive
from hdopt.profiles import tip_radius_of_curvature

Array = NDArray[np.float64]

PARAMETERS = 12


@dataclass(frozen=True)
class BaseModel:
    """Constants of one drive: `constants` is (L_W, rho0, b/2, tan alpha, arcmin per mm, Z_CS/Z_FS, passes E_a, passes
    E_l).
    """

    constants: Array

    @classmethod
    def of(cls, drive: Drive) -> BaseModel:
        wave_generator, geometry = drive.wave_generator, drive.geometry
        return cls(
            np.array(
                [
                    wave_generator.profile.semi_major,
                    tip_radius_of_curvature(wave_generator.profile),
                    wave_generator.width / 2,
                    math.tan(geometry.pressure_angle),
                    geometry.arcmin_per_mm,
                    geometry.circular_spline_teeth / geometry.flexspline_teeth,
                    float(wave_generator.structure.passes_major),
                    float(wave_generator.structure.passes_minor),
                ]
            )
        )

    @property
    def arcmin_per_mm(self) -> float:
        return float(self.constants[4])

    def evaluate(self, theta: Array, parameters: Array, extra: Array | None = None):
        """KE (arcmin, n), the driving zone (0 or 1, n) and dKE/dparameters (arcmin/mm, n x 12).

        `extra` (2, n) in mm is added to the deviation of each zone before the larger one is taken.
        """
        theta = np.ascontiguousarray(theta, float)
        if extra is None:
            extra = np.zeros((2, 1))
        return _evaluate(theta, self.constants, np.asarray(parameters, float), np.ascontiguousarray(extra))


@njit(cache=True)
def _evaluate(theta, constants, p, extra):
    semi_major, tip_radius, half_width, tan_alpha, scale, advance, pass_a, pass_l = constants
    flatness = semi_major - tip_radius
    tilt_gain = (semi_major + tip_radius) / 2 / half_width**2
    bow = semi_major / 2 / half_width**2
    n = len(theta)
    value = np.empty(n)
    zone = np.empty(n, np.int64)
    jacobian = np.zeros((n, 12))
    has_extra = extra.shape[1] == n
    for i in range(n):
        c, s = math.cos(theta[i]), math.sin(theta[i])
        cf, sf = math.cos(advance * theta[i]), math.sin(advance * theta[i])
        e_a = pass_a * (p[0] * s + p[1] * c + p[4])
        e_l = pass_l * (p[0] * c - p[1] * s + p[5])
        t_a = p[2] * s + p[3] * c + p[6]
        t_l = p[2] * c - p[3] * s + p[7]
        best = -1e300
        best_q = best_shift = best_z = best_k = 0.0
        for z in (1.0, -1.0):
            depth = -1e300
            for k in (1.0, -1.0):
                shift_k = e_l + z * k * t_l
                q_k = shift_k - z * tilt_gain * t_a * t_l
                d_k = z * e_a + k * t_a - bow * t_a * t_a + q_k * q_k / (2 * flatness)
                if d_k > depth:
                    depth, q, shift, rim = d_k, q_k, shift_k, k
            # Offsets o and o': forward in zone 1, backward in zone 2; a half turn away there, unscaled.
            o, of = z * q / flatness, z * (q / flatness - shift / semi_major)
            cs = z * (p[8] * (s * math.cos(o) + c * math.sin(o)) + p[9] * (c * math.cos(o) - s * math.sin(o)))
            fs = z * (p[10] * (sf * math.cos(of) + cf * math.sin(of)) + p[11] * (cf * math.cos(of) - sf * math.sin(of)))
            tau = depth * tan_alpha + cs + fs
            if has_extra:
                tau += extra[0 if z > 0 else 1, i]
            if tau > best:
                best, best_q, best_shift, best_z, best_k = tau, q, shift, z, rim
        value[i] = scale * best
        z, k = best_z, best_k
        zone[i] = 0 if z > 0 else 1
        o, of = z * best_q / flatness, z * (best_q / flatness - best_shift / semi_major)
        so, co = s * math.cos(o) + c * math.sin(o), c * math.cos(o) - s * math.sin(o)
        sof, cof = sf * math.cos(of) + cf * math.sin(of), cf * math.cos(of) - sf * math.sin(of)
        # d tau = tan_alpha d depth + (d tau/d o) d o + (d tau/d o') d o'
        slope_cs = z * (p[8] * co - p[9] * so)
        slope_fs = z * (p[10] * cof - p[11] * sof)
        by_q = tan_alpha * best_q / flatness + (slope_cs + slope_fs) * z / flatness
        by_shift = -slope_fs * z / semi_major
        for j in range(8):
            de_a = de_l = dt_a = dt_l = 0.0
            if j == 0:
                de_a, de_l = pass_a * s, pass_l * c
            elif j == 1:
                de_a, de_l = pass_a * c, -pass_l * s
            elif j == 2:
                dt_a, dt_l = s, c
            elif j == 3:
                dt_a, dt_l = c, -s
            elif j == 4:
                de_a = pass_a
            elif j == 5:
                de_l = pass_l
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
