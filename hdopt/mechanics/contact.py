"""Which teeth are in contact, and what follows from it: contact angle, meshing teeth, homogenization, flank pressure.

Overlap of the tips is necessary for contact, not yet contact of the flanks. Jia 2021 counts tips that overlap; flanks
that carry are fewer. Whatever counts, k_e and flank pressure count the same teeth: those of one `Contact`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from numpy.typing import ArrayLike

from hdopt.arrays import Array
from hdopt.drive.geometry import DriveGeometry
from hdopt.drive.profiles import WaveGeneratorProfile
from hdopt.errors import HdoptError, MissingValue
from hdopt.mechanics.zone_sides import mean_of_sides, zone_sides

TIPS, FLANKS = "tips", "flanks"
"""What counts as contact: tips that overlap, as Jia 2021 counts, or flanks that carry (`Mesh.carrying_angle`)."""


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
    published Resal and two-disk values within 0.03 deg. Of a measured profile, whose two zones may differ and be
    lopsided, it is the mean of the angles on the four sides of both zones (`zone_sides`), so that Z_mp stays the mean
    number of teeth on one side of one zone. Raises `HdoptError` where on any side the tips never overlap, or overlap
    all round (the teeth would not clear each other on the minor axis).
    """
    return mean_of_sides([_angle_on_a_side(geometry, side) for side in zone_sides(profile)])


def _angle_on_a_side(geometry: DriveGeometry, profile: WaveGeneratorProfile) -> float:
    """Angle from the tip, over the first quarter of a turn of `profile`, to where the tips cease to overlap, rad."""
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


@dataclass(frozen=True)
class Contact:
    """The teeth that are in contact: k_e and the mean flank pressure both count these and no others.

    `angle` is the half angle (rad) from the major axis up to which teeth count (on the mean of the four sides of both
    zones, where they differ), `summed_depth` the depth of engagement
    summed over the teeth up to there on the approaching flank of both zones, mm; `counts` says what was counted, `TIPS`
    that overlap or `FLANKS` that carry. Made by `hdopt.mechanics.tooth_path.Mesh.contact`.
    """

    geometry: DriveGeometry
    angle: float
    summed_depth: float
    counts: str

    @property
    def teeth(self) -> float:
        """Teeth in contact in one zone, one side counted (`meshing_teeth`)."""
        return meshing_teeth(self.geometry, self.angle)

    def homogenization(self, base: float = 1.0) -> float:
        """k_e of these teeth, with k_B `base` (`homogenization_coefficient`)."""
        return homogenization_coefficient(self.teeth, base)

    def flank_pressure(self, torque: float, face_width: float) -> float:
        """Mean pressure on the flanks of these teeth under the output `torque` (N mm), N/mm^2; infinite without teeth.

        The wear check of Shen and Ye, "Theory and design of harmonic gear drives" (1985): p = 2 T/(d b h z), load over
        engaged area, with pitch diameter d = m Z_FS, tooth face width b (`face_width`, mm), and h z the summed depth.
        Load and area are both per cos(alpha), which cancels. Valid while all these teeth share the load, a lower bound
        of the true pressure; load factor 1.
        """
        if self.angle <= 0:
            return math.inf  # no flank runs free: none carries
        return 2 * torque / (self.geometry.module * self.geometry.flexspline_teeth * face_width * self.summed_depth)


def _addenda(geometry: DriveGeometry) -> tuple[float, float]:
    """Addenda of flexspline and circular spline, mm."""
    flexspline, circular_spline = geometry.flexspline_addendum, geometry.circular_spline_addendum
    if flexspline is None or circular_spline is None:
        given = {"drive.flexspline_addendum_mm": flexspline, "drive.circular_spline_addendum_mm": circular_spline}
        raise MissingValue("the contact angle", *(key for key, value in given.items() if value is None))
    return flexspline, circular_spline
