"""Where flexspline and circular spline overlap: contact angle, meshing teeth, homogenization, mean flank pressure.

Overlap of the tips is necessary for contact, not yet contact of the flanks: the numbers here are upper bounds of it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from hdopt.arrays import Array
from hdopt.drive.geometry import Drive, DriveGeometry
from hdopt.drive.profiles import WaveGeneratorProfile
from hdopt.errors import HdoptError, MissingValue


def tip_overlap(geometry: DriveGeometry, profile: WaveGeneratorProfile, phi: ArrayLike) -> Array:
    """Radial overlap of FS tip curve and CS tip circle at angles `phi` (rad, from the major axis), mm; same shape.

    FS tip: pitch radius m Z_FS/2, plus the deflection w(phi) that `profile` gives the inner wall, plus h_aF, radially.
    CS tip circle: m Z_CS/2 - h_aC; all sizes of `geometry`. Above zero the tips overlap. Jia 2021, Sec. 3 (physics of
    Table 4). Raises `MissingValue` where an addendum is not given.
    """
    flexspline_addendum, circular_spline_addendum = _addenda(geometry)
    deflection = profile.radius(phi) - geometry.flexspline_inner_radius
    flexspline_tip = geometry.module * geometry.flexspline_teeth / 2 + deflection + flexspline_addendum
    return flexspline_tip - (geometry.module * geometry.circular_spline_teeth / 2 - circular_spline_addendum)


def contact_angle(geometry: DriveGeometry, profile: WaveGeneratorProfile) -> float:
    """Half angle from the major axis to where the tips cease to overlap, rad (Jia 2021, Table 4).

    The tips are those of `geometry`, the flexspline deflected by `profile` as in `tip_overlap`. Reproduces the
    published Resal and two-disk values within 0.03 deg. Raises `HdoptError` where the tips never overlap, or overlap
    all round (the teeth would not clear each other on the minor axis).
    """
    from scipy.optimize import brentq

    at_major, at_minor = tip_overlap(geometry, profile, [0.0, math.pi / 2])
    if at_major <= 0:
        raise HdoptError(
            f"the teeth never reach each other: their tips miss by {-at_major:.4g} mm on the major axis; "
            "check module, addenda and wave-generator size"
        )
    if at_minor >= 0:
        raise HdoptError(
            f"the teeth overlap all round: by {at_minor:.4g} mm on the minor axis; "
            "deepen the deflection or shorten the addenda"
        )
    return float(brentq(lambda phi: float(tip_overlap(geometry, profile, phi)), 0.0, math.pi / 2, xtol=1e-14))


def meshing_teeth(geometry: DriveGeometry, angle: float) -> float:
    """Z_mp = Z_CS angle/(2 pi): teeth in mesh in one zone, one side counted, as Jia 2021, Eq. (13) does.

    Z_CS of `geometry`; `angle` is the half angle of contact, rad.
    """
    return geometry.circular_spline_teeth * angle / (2 * math.pi)


def homogenization_coefficient(teeth_in_mesh: float, base: float = 1.0) -> float:
    """k_e = k_B/sqrt(Z_mp): how far many teeth in mesh even out the error of one (Jia 2021, Eq. (13)).

    `teeth_in_mesh` is Z_mp, as `meshing_teeth` counts it; `base` is k_B, 0.8 to 1.0 (`HdoptError` outside). The square
    root is lost in common copies of the paper; it reproduces Table 4.
    """
    if not 0.8 <= base <= 1.0:
        raise HdoptError(f"k_B is {base!r}; Jia 2021, Eq. (13) gives 0.8 to 1.0")
    return base / math.sqrt(teeth_in_mesh)


def mean_flank_pressure(drive: Drive, torque: float | None = None) -> float:
    """Mean pressure on the engaged tooth flanks under the output `torque` (N mm; the drive's own if None), N/mm^2.

    The wear check of Shen and Ye, "Theory and design of harmonic gear drives" (1985): p = 2 T/(d b h z), load over
    engaged area, with pitch diameter d = m Z_FS, tooth face width b, and h z the summed depth of all engaged teeth,
    here the tip overlap summed over the approaching flank of both zones. Load and area are both per cos(alpha), which
    cancels. Valid while all overlapped teeth of the `drive` share the load, a lower bound of the true pressure; load
    factor 1. Raises `MissingValue` where torque, face width or an addendum is not given.
    """
    geometry, load = drive.geometry, drive.load
    torque = load.torque if torque is None else torque
    if torque is None:
        raise MissingValue("the flank pressure", "load.torque_nm")
    if load.tooth_face_width is None:
        raise MissingValue("the flank pressure", "load.tooth_face_width_mm")
    profile = drive.wave_generator.profile
    angle = contact_angle(geometry, profile)
    nodes, weights = np.polynomial.legendre.leggauss(32)
    phi = angle / 2 * (1 + nodes)
    mean_depth = float(weights @ tip_overlap(geometry, profile, phi)) / 2
    summed_depth = 2 * meshing_teeth(geometry, angle) * mean_depth
    return 2 * torque / (geometry.module * geometry.flexspline_teeth * load.tooth_face_width * summed_depth)


def _addenda(geometry: DriveGeometry) -> tuple[float, float]:
    """Addenda of flexspline and circular spline, mm."""
    flexspline, circular_spline = geometry.flexspline_addendum, geometry.circular_spline_addendum
    if flexspline is None or circular_spline is None:
        given = {"drive.flexspline_addendum_mm": flexspline, "drive.circular_spline_addendum_mm": circular_spline}
        raise MissingValue("the contact angle", *(key for key, value in given.items() if value is None))
    return flexspline, circular_spline
