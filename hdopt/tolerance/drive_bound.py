"""A proven upper bound of the peak-to-peak over a box of errors.

With the closed form of the deepest points (`hdopt.kinematics.closed_form`) and the zone-wise deviations tau_1, tau_2
of Jia 2021, Eqs. (24)-(32), for any drive in the box:

  E_a <= e1 + e2,  |T_a| <= |t1| + t2_y,  |q| <= E_l + T_l + (L_W/2)(1 + rho0/L_W) T_a T_l/(b/2)^2 = Q, so

  sup max(tau_1, tau_2) <= tan(alpha) [E_a + |T_a| - (L_W/2)(T_a/(b/2))^2 + Q^2/(2 G)] + a_CS + a_FS.

The deepest rim lies at least as deep as the one on the lifted side, so (delta_1 + delta_2)/2 >= |T_a| -
(L_W/2)(T_a/(b/2))^2 >= 0 while |T_a| <= 2 (b/2)^2/L_W; and the two zones meet opposite teeth, of which only the offsets
remain:

  inf max(tau_1, tau_2) >= inf (tau_1 + tau_2)/2 >= -(a_CS Q/G + a_FS (Q/G + (E_l + T_l)/L_W)).

The difference of both bounds the peak-to-peak of the closed form; the closed form itself is right to about 3e-3 arcmin
at three times the shipped tolerances.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hdopt.deviations import ERROR_NAMES, DriveErrors
from hdopt.drive import Drive
from hdopt.profiles import tip_radius_of_curvature

Array = NDArray[np.float64]


def widest_errors(response, lower: Array, upper: Array) -> DriveErrors:
    """The largest absolute value of every error over a box of inputs (directions mean nothing here).

    `response` is a `DriveResponse`, `lower` and `upper` of shape (d,).
    """
    errors = {name: abs(float(getattr(response.held, name))) for name in ERROR_NAMES}
    largest = np.maximum(np.abs(lower), np.abs(upper))
    for feed in response.feeds:
        feed.widest(largest, errors)
    return DriveErrors(**{name: float(np.squeeze(value)) for name, value in errors.items()})


def peak_to_peak_bound_arcmin(drive: Drive, widest: DriveErrors) -> float | None:
    """Bound (arcmin, k_e = 1) for all drives whose errors are at most `widest`, in any direction and phase.

    None where the tilts leave the closed form's range (lift above 2 (b/2)^2/L_W).
    """
    wave_generator, geometry = drive.wave_generator, drive.geometry
    profile, half_width = wave_generator.profile, wave_generator.width / 2
    semi_major, rho = profile.semi_major, tip_radius_of_curvature(profile)
    flatness = semi_major - rho
    eccentricity = widest.axis_eccentricity + widest.wg_eccentricity
    e_a = eccentricity * wave_generator.structure.passes_major
    e_l = eccentricity * wave_generator.structure.passes_minor
    axis_lift = half_width * math.hypot(math.tan(widest.axis_tilt_x), math.tan(widest.axis_tilt_y))
    t_a = axis_lift + half_width * math.tan(widest.wg_tilt_major)
    t_l = axis_lift + half_width * math.tan(widest.wg_tilt_minor)
    if t_a > 2 * half_width**2 / semi_major:
        return None
    q = e_l + t_l + (semi_major + rho) / 2 * t_a * t_l / half_width**2
    deepest_lift = min(t_a, half_width**2 / semi_major)
    depth = e_a + deepest_lift - semi_major / 2 * (deepest_lift / half_width) ** 2 + q * q / (2 * flatness)
    teeth = widest.cs_tooth_amplitude + widest.fs_tooth_amplitude
    highest = math.tan(geometry.pressure_angle) * depth + teeth
    lowest = -(teeth * q / flatness + widest.fs_tooth_amplitude * (e_l + t_l) / semi_major)
    return geometry.arcmin_per_mm * (highest - lowest)
