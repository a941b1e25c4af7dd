"""What surrounds a wave generator, for pictures and a check of room: races, flexspline ring, circular spline.

These parts show the deformed shapes as the model has them; they are not meant to be made.
"""

from __future__ import annotations

from hdopt.drive.geometry import Drive
from hdopt.errors import HdoptError, MissingValue
from hdopt.geometry.contour import Circle, ParallelCurve
from hdopt.geometry.part import Colour, Part, Prism

RACE = (0.72, 0.74, 0.78, 0.55)
FLEXSPLINE = (0.86, 0.62, 0.22, 0.45)
CIRCULAR_SPLINE = (0.45, 0.47, 0.52, 0.35)

RIM_SHARE = 0.15
"""Radial thickness of the circular spline's ring as a share of its inner radius: for the picture only."""


def context_parts(drive: Drive, bearing: float, race_share: float, clear: float) -> tuple[Part, ...]:
    """Races, flexspline ring and circular spline of a drive.

    `bearing` is the flexible bearing's thickness and `race_share` that of either race in it; `clear` mm is how far the
    whole stands off the profile, so that discs which lie outside it by so much do not cut into it.
    """
    profile, half = drive.wave_generator.profile, drive.wave_generator.width / 2
    wall, addendum = drive.geometry.flexspline_wall, drive.geometry.circular_spline_addendum
    missing = {
        "drive.flexspline_wall_mm": wall,
        "drive.circular_spline_addendum_mm": addendum,
    }
    if wall is None or addendum is None:
        lacking = [key for key, value in missing.items() if value is None]
        raise MissingValue("the context of an export", *lacking)
    race = race_share * bearing
    tips = drive.geometry.module * drive.geometry.circular_spline_teeth / 2 - addendum
    if profile.semi_major + clear + wall >= tips:
        raise HdoptError(
            f"the flexspline ring reaches {profile.semi_major + wall:.4f} mm, the circular spline's tips are at "
            f"{tips:.4f} mm: they collide; check drive.flexspline_wall_mm and drive.circular_spline_addendum_mm"
        )

    def ring(name: str, colour: Colour, inside: float, outside: float) -> Part:
        outline = ParallelCurve(profile, outside - clear)
        body = Prism(outline, -half, half, inner=ParallelCurve(profile, inside - clear))
        return Part(name, colour, (body,), contour=outline, context=True)

    rim = Circle(tips * (1 + RIM_SHARE))
    circular = Prism(rim, -half, half, inner=Circle(tips))
    return (
        ring("bearing_inner_race", RACE, bearing, bearing - race),
        ring("bearing_outer_race", RACE, race, 0.0),
        ring("flexspline_ring", FLEXSPLINE, 0.0, -wall),
        Part("circular_spline", CIRCULAR_SPLINE, (circular,), contour=rim, context=True),
    )
