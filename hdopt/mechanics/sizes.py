"""Sizes of a drive that do not go together: what a number left over from another drive shows as."""

from __future__ import annotations

from hdopt.drive.geometry import Drive

DEFLECTION = (0.8, 1.2)
"""Deflection over the module that raises no doubt: one module where the tooth difference is two (Jia 2021, Table 1),
and the room that a design search leaves it."""
ROOT = (0.0, 2.0)
"""Depth of the flexspline's roots below its pitch circle in modules that raises no doubt; a rack has 1.25, the
CSF-25-80 of Jia 2021 0.73."""


def doubts(drive: Drive) -> tuple[str, ...]:
    """Sentences on sizes of the `drive` that hardly belong together, () where none do: its deflection, and the pitch
    circle of its flexspline over the wall. Nothing is refused by them. Lengths in mm."""
    geometry, found = drive.geometry, []
    module = geometry.module
    deflection = (drive.wave_generator.profile.semi_major - geometry.flexspline_inner_radius) / module
    if not DEFLECTION[0] <= deflection <= DEFLECTION[1]:
        found.append(
            f"the wave generator deflects the flexspline by {deflection * module:.4g} mm, {deflection:.3g} modules, "
            "where about one is usual: look at semi_major_mm (left out, it is the inner radius plus the module)"
        )
    if geometry.flexspline_wall is not None:
        outside = geometry.flexspline_inner_radius + geometry.flexspline_wall
        pitch = module * geometry.flexspline_teeth / 2
        root = (pitch - outside) / module
        if not ROOT[0] <= root <= ROOT[1]:
            side = "beyond" if root > 0 else "inside"
            found.append(
                f"the flexspline's pitch radius, {module:g} mm x {geometry.flexspline_teeth} / 2 = {pitch:.4g} mm, "
                f"lies {abs(root):.3g} modules {side} its wall, which ends at {outside:.4g} mm: look at module_mm, the "
                "numbers of teeth, flexspline_inner_radius_mm and flexspline_wall_mm"
            )
    return tuple(found)
