"""A proven upper bound of the peak-to-peak over a box of errors, for the exact geometry of Jia 2021, Eqs. (16)-(32).

M is the in-plane part of the rotation that carries the wave generator, tau its tilt, c its centre in the plane, P a
contour point, b the width. tau is at most the sum of both tilts, |c| at most e1 + e2, nil for the automatic structure.

Supremum. A projected point of a rim is A + c with A = M P +- (b/2) M z. A projection lengthens nothing and |M z| =
sin(tau), so |A| <= L_W + (b/2) sin(tau), the longest radius being L_W, and |A + c| <= |A| + c.A/|A| + |c|^2/(2 |A|).
With c.A/|A| <= |c|, or where the structure leaves only the part across the major axis <= |c| sin(o_A):

  sup max(tau_1, tau_2) <= tan(alpha) [c.A/|A| + |c|^2/(2 |A|) + (b/2) sin(tau)] + a_CS + a_FS.

(Where c.A/|A| is taken as |c|, |A + c| <= |A| + |c| does without the quadratic term.)

Infimum. The tips of opposite rims project to c + V and c - V with V = L_W M y +- (b/2) M z; then delta_1 + delta_2 >=
|V + c| + |V - c| - 2 L_W >= 2 (|V| - L_W), and of both pairs of rims one has |V| >= L_W as long as tan(tau) <= b/L_W,
because y and z stay orthogonal: |V|^2 >= L_W^2 + |y_3| (L_W b cos(tau) - L_W^2 |y_3|) with |y_3| <= sin(tau). The two
zones meet opposite teeth, of which only the offsets o, o' of the deepest points remain:

  inf max(tau_1, tau_2) >= inf (tau_1 + tau_2)/2 >= -(a_CS sin(o_max) + a_FS sin(o'_max)).

At a deepest point the distance is stationary along the contour, H.H' = 0. There P.P' = r r', and all else is at most
|P'| (|c| + (b/2) sin(tau) + r sin(tau)^2), so |r'| <= sqrt(1 + (r'/r)^2) (|c| + (b/2) sin(tau) + L_W sin(tau)^2): near
the tip, where alone |r'| is that small, this limits o', which is the contour angle itself. o differs from it by the
direction of c, of the lifted rim and of M, which is within 2 tau^2 of a plain turn.
"""

from __future__ import annotations

import math

import numpy as np

from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Drive
from hdopt.drive.profiles import WaveGeneratorProfile
from hdopt.kinematics.exact import ZONE_HALF_WIDTH

CONTOUR_POINTS = 20_001
"""Places of the contour within a zone where its slope is looked at; between them the second derivative limits it."""


def peak_to_peak_bound_arcmin(drive: Drive, widest: DriveErrors) -> float | None:
    """Bound (arcmin, k_e = 1) for every `drive` whose errors are at most `widest`, in any direction and phase.

    Proven for the exact geometry, deepest points within 60 deg of the major axis, and profiles whose longest radius is
    at the major axis. None where the tilts are too large for the proof: above b/L_W, 16 deg for the shipped drive.
    """
    wave_generator, geometry = drive.wave_generator, drive.geometry
    profile, width, structure = wave_generator.profile, wave_generator.width, wave_generator.structure
    aligned = not (structure.passes_major or structure.passes_minor)
    centre = 0.0 if aligned else float(widest.axis_eccentricity + widest.wg_eccentricity)
    tilt = sum(
        math.atan(math.hypot(math.tan(major), math.tan(minor)))
        for major, minor in (
            (widest.axis_tilt_y, widest.axis_tilt_x),
            (widest.wg_tilt_major, widest.wg_tilt_minor),
        )
    )
    if tilt >= math.pi / 4 or math.tan(tilt) > width / profile.semi_major or centre > profile.semi_minor / 4:
        return None
    reach = centre + width / 2 * math.sin(tilt)
    offset_fs = _largest_offset(profile, reach + profile.semi_major * math.sin(tilt) ** 2)
    if offset_fs is None:
        return None
    lift = width / 2 * math.sin(tilt)
    nearest = profile.semi_minor * math.cos(tilt) - lift

    def turned(shift: float) -> float:
        """How far a `shift` (mm) and the twist of M can turn a point as seen from the centre, rad."""
        return math.asin(min((shift + 2 * profile.semi_major * tilt**2) / (nearest - centre), 1.0))

    offset_cs = min(offset_fs + turned(reach), math.pi / 2)
    radial = centre
    if structure.passes_minor and not structure.passes_major:
        radial = min(centre, centre * math.sin(min(offset_fs + turned(lift), math.pi / 2)) + centre**2 / (2 * nearest))
    cs, fs = float(widest.cs_tooth_amplitude), float(widest.fs_tooth_amplitude)
    highest = math.tan(geometry.pressure_angle) * (radial + lift) + cs + fs
    lowest = -(cs * math.sin(offset_cs) + fs * math.sin(offset_fs))
    return geometry.arcmin_per_mm * (highest - lowest)


def _largest_offset(profile: WaveGeneratorProfile, slope: float) -> float | None:
    """The largest contour angle (rad) off the major axis at which |r'| can be as small as a deepest point needs with
    `slope` (mm); None where no place within a zone is excluded."""
    phi = np.linspace(0.0, ZONE_HALF_WIDTH, CONTOUR_POINTS)
    radius, first, second = (profile.radius(phi, derivative) for derivative in range(3))
    between = float(np.abs(second).max()) * phi[1] / 2
    allowed = np.abs(first) - between <= slope * np.sqrt(1 + (first / radius) ** 2)
    last = int(np.flatnonzero(allowed)[-1])
    return None if last == len(phi) - 1 else float(phi[last + 1]) if slope > 0 else 0.0
