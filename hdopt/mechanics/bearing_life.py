"""What torque asks of the wave generator's bearing: radial and axial force, and life over pressure angle and width."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hdopt.drive.geometry import DriveGeometry
from hdopt.mechanics.bending import ring_wall

SOURCE = "Harmonic Drive SE, Engineering Data HFUS-2A, 1019658 11/2014"


@dataclass(frozen=True)
class BearingConstants:
    """Constants of the life formula, each with where it comes from in `SOURCES`. Torque in N mm, speed in rad/s."""

    rated_torque: float
    rated_speed: float
    rated_life_h: float = 35_000.0
    torque_exponent: float = 3.0
    l10_share: float = 0.2
    capacity_exponent: float = 17 / 15
    friction: float = 0.07


SOURCES = {
    "rated_life_h": f"cited: {SOURCE}, Table 21.1 (HFUS, CSF, CSD and others)",
    "torque_exponent": f"cited: {SOURCE}, Eq. 21.2",
    "l10_share": f"cited: {SOURCE}, Eq. 21.3 (L10 about a fifth of L50)",
    "capacity_exponent": "assumed: the makers' formula holds no width. ISO 281: C grows with Z^(2/3) Dw^1.8; balls as "
    "wide as the bearing asks and a full row on the same circle, Z ~ 1/Dw, make C ~ width^(17/15)",
    "friction": f"cited: {SOURCE}, Eq. 34.5",
    "rated_torque": "the study's [search.trade], or its load",
    "rated_speed": "the study's [search.trade], or its load",
}


def radial_force(geometry: DriveGeometry, torque: float) -> float:
    """Force that presses the flanks out of mesh and onto the wave generator, N: F_r = 2 T tan(alpha)/d.

    `torque` at the output, N mm; d the pitch diameter m Z_FS of the flexspline and alpha the pressure angle, both of
    `geometry`. It is the bracket of the makers' formula of
    the axial force, F_ax = (2 T/D) mu tan(20 deg) for ratios of 80 and above (Harmonic Drive SE, Engineering Data
    HFUS-2A, 1019658 11/2014, Eq. 34.5), with this drive's own pressure angle.
    """
    return 2 * torque * math.tan(geometry.pressure_angle) / (geometry.module * geometry.flexspline_teeth)


def axial_force(geometry: DriveGeometry, torque: float, friction: float) -> float:
    """Axial force on the wave generator, N: `friction` (a coefficient, 0.07 in the source) times the `radial_force` of
    `geometry` under `torque`, N mm (same source, Eq. 34.5)."""
    return friction * radial_force(geometry, torque)


def ring_force(geometry: DriveGeometry, deflection: float, modulus: float, face_width: float) -> float:
    """Force of each of two opposite radial forces that bend the toothed ring by `deflection` (mm) at their feet, N.

    P = w0 E I/(R^3 (pi/4 - 2/pi)), I = b s^3/12 over the tooth face, of a thin free ring whose diameter grows by
    2 w0 (Timoshenko, Strength of Materials, Part I, thin rings: the diameter's change is P R^3/(E I) (pi/4 - 2/pi)).
    R = inner radius + half the wall s, both of `geometry`; `modulus` is Young's, N/mm^2, and `face_width` b, mm. The
    cup's own stiffness is left out. Raises `MissingValue` where the geometry has no wall.
    """
    wall = ring_wall(geometry)
    radius = geometry.flexspline_inner_radius + wall / 2
    inertia = face_width * wall**3 / 12
    return 2 * deflection * modulus * inertia / (radius**3 * (math.pi / 4 - 2 / math.pi))


def bearing_load(geometry: DriveGeometry, torque: float, friction: float, ring: float) -> float:
    """Radial load on the wave generator's bearing, N: (2 T/d) tan(alpha + rho) + the force that bends the ring.

    T is the output `torque`, N mm, d and alpha are those of `geometry`, and `ring` is `ring_force`, N. rho =
    arctan(friction): a tooth that is pushed into its space like a wedge presses harder by its friction
    (standard wedge mechanics; without friction and ring it is `radial_force`).
    """
    tan = math.tan(geometry.pressure_angle + math.atan(friction))
    return 2 * torque * tan / (geometry.module * geometry.flexspline_teeth) + ring


def bearing_life_h(
    load: float, width: float, reference_load: float, reference_width: float, speed: float, constants: BearingConstants
) -> float:
    """L10 of the wave generator's bearing, hours, under a radial `load` (N) at input `speed` (rad/s), `width` in mm.

    Makers: L50 = 35,000 h (n_N/n)(T_N/T)^3, L10 about L50/5 (source above, Eqs. 21.2, 21.3), for the drive they rate:
    `reference_load` is its `bearing_load` under the rated torque, `reference_width` its width, mm. Their formula holds
    neither width nor pressure angle; its numbers are `constants`. Assumed here: load as in `bearing_load`, capacity as
    width^(17/15) (see `SOURCES`), and life with (capacity/load)^3 (ISO 281).
    """
    rated = constants.rated_life_h * (constants.rated_speed / speed)
    capacity = (width / reference_width) ** constants.capacity_exponent
    strength: float = (capacity * reference_load / load) ** constants.torque_exponent
    return constants.l10_share * rated * strength
