"""Sizes of a drive that do not go together: what a number left over from another drive shows as."""

from __future__ import annotations

import math

from hdopt.drive.geometry import Drive
from hdopt.drive.profiles import perimeter_error

DEFLECTION = (0.8, 1.2)
"""Deflection over the module that raises no doubt: one module where the tooth difference is two (Jia 2021, Table 1),
and the room that a design search leaves it."""
ROOT = (0.0, 2.0)
"""Depth of the flexspline's roots below its pitch circle in modules that raises no doubt; a rack has 1.25, the
CSF-25-80 of Jia 2021 0.73."""
ADDENDUM = (0.5, 0.8)
"""Addendum of either spline in modules that raises no doubt: 0.70 and 0.65 in Jia 2021, Table 1; 0.65 (full depth 2
less dedendum 1.35) in Chin. J. Mech. Eng. 34 (2021), 10.1186/s10033-021-00621-z, Table 4. Addenda of an 80:1 drive in
one of 100:1 or 50:1 on the same pitch circle lie outside."""
STRETCH = 0.2
"""By how many modules the radius of the bent ring, its perimeter over 2 pi, may differ from that of the wall without a
doubt: 0.21 of a module of perimeter, 0.083 of radius, in the CSF-25-80 of Jia 2021."""


def doubts(drive: Drive) -> tuple[str, ...]:
    """Sentences on sizes of the `drive` that hardly belong together, () where none do: its deflection and perimeter,
    the pitch circle of its flexspline over the wall, and its addenda. Nothing is refused by them. Lengths in mm."""
    return tuple(filter(None, (_deflection(drive), _perimeter(drive), _root(drive), _addenda(drive))))


def _deflection(drive: Drive) -> str:
    module = drive.geometry.module
    found = (drive.wave_generator.profile.semi_major - drive.geometry.flexspline_inner_radius) / module
    if DEFLECTION[0] <= found <= DEFLECTION[1]:
        return ""
    return (
        f"the wave generator deflects the flexspline by {found * module:.4g} mm, {found:.3g} modules, "
        "where about one is usual: look at semi_major_mm (left out, it is the inner radius plus the module)"
    )


def _perimeter(drive: Drive) -> str:
    inner = drive.geometry.flexspline_inner_radius
    more = perimeter_error(drive.wave_generator.profile, inner) / (2 * math.pi)
    if abs(more) <= STRETCH * drive.geometry.module:
        return ""
    does = "stretch" if more > 0 else "compress"
    return (
        f"the wave generator would {does} the flexspline's wall round its turn, as from {inner:.4g} to "
        f"{inner + more:.4g} mm of radius, where it only bends it: look at semi_minor_mm (left out, the perimeter is "
        "the wall's) and flexspline_inner_radius_mm"
    )


def _root(drive: Drive) -> str:
    geometry = drive.geometry
    if geometry.flexspline_wall is None:
        return ""
    outside = geometry.flexspline_inner_radius + geometry.flexspline_wall
    pitch = geometry.module * geometry.flexspline_teeth / 2
    root = (pitch - outside) / geometry.module
    if ROOT[0] <= root <= ROOT[1]:
        return ""
    side = "beyond" if root > 0 else "inside"
    return (
        f"the flexspline's pitch radius, {geometry.module:g} mm x {geometry.flexspline_teeth} / 2 = {pitch:.4g} mm, "
        f"lies {abs(root):.3g} modules {side} its wall, which ends at {outside:.4g} mm: look at module_mm, the "
        "numbers of teeth, flexspline_inner_radius_mm and flexspline_wall_mm"
    )


def _addenda(drive: Drive) -> str:
    geometry = drive.geometry
    given = {
        "flexspline_addendum_mm": geometry.flexspline_addendum,
        "circular_spline_addendum_mm": geometry.circular_spline_addendum,
    }
    off = {
        key: value / geometry.module
        for key, value in given.items()
        if value is not None and not ADDENDUM[0] <= value / geometry.module <= ADDENDUM[1]
    }
    if not off:
        return ""
    said = " and ".join(f"{key} is {ratio:.3g}" for key, ratio in off.items())
    return (
        f"{said} times the module of {geometry.module:g} mm, where {ADDENDUM[0]:g} to {ADDENDUM[1]:g} is usual: "
        f"look whether {'they were' if len(off) > 1 else 'it was'} written for another module"
    )
