"""The mating sheet: what housing, shaft and bearing seats must keep, from the bounds of the input axis' errors.

The eccentricity e1 of the input axis and its tilts beta2 and beta3 come from parts that hdopt does not design. Their
bounds are shared out in equal parts, in the worst case, among the features that usually make them; where the study
names its own contributors, those stand here instead.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass

from hdopt.drive.geometry import Drive
from hdopt.files import JsonReady
from hdopt.geometry.budget import CalloutTables
from hdopt.geometry.callouts import FLAT_ZONE, keyway_symmetry
from hdopt.geometry.features import DBore, KeywayBore
from hdopt.geometry.iso286 import deviations
from hdopt.geometry.model import WaveGeneratorModel
from hdopt.geometry.slides import slides_of
from hdopt.tolerance.contributors import CALLOUTS

RIM_FACTOR = 1.15
"""Diameter of the circular spline's mounting face over that of its tips, where nobody gives it."""


@dataclass(frozen=True)
class MatingRow:
    """One requirement on a part that the wave generator meets: value in mm, what it may take of which error."""

    part: str
    feature: str
    requirement: str
    value_mm: float | None
    over_mm: float | None
    feeds: str
    takes: float | None
    unit: str

    def to_dict(self) -> JsonReady:
        return asdict(self)


def mating_rows(
    drive: Drive,
    model: WaveGeneratorModel,
    bounds: Mapping[str, float],
    contributors: CalloutTables,
) -> tuple[MatingRow, ...]:
    """What the parts that meet the wave generator of a `drive` must keep: shaft, housing, bearing seats.

    `model` has its parts and fits; `bounds` are tolerances by study key (mm or deg) or contributor, `contributors` the
    study's callouts.
    """
    return (
        *_shaft(model),
        *_slides(model),
        *_eccentricity(bounds, contributors),
        *_tilt(drive, bounds, contributors),
    )


def _shaft(model: WaveGeneratorModel) -> list[MatingRow]:
    joint, fit = model.plan.joints[0], model.plan.fits[0]
    low, high = fit.shaft_limits
    size = f"diameter {fit.nominal:g} {fit.shaft} ({high * 1e3:+.3g}/{low * 1e3:+.3g} um)"
    play = fit.largest_play / 2
    rows = [
        MatingRow("shaft", "seat of the wave generator", size, fit.nominal, joint.length, "wg_eccentricity", play, "mm")
    ]
    holder = model.part(joint.outer)
    bore = holder.bore
    if isinstance(bore, KeywayBore):
        key = bore.key
        width = deviations("h9", key.width)
        text = f"key {key.name}, groove {key.width:g} N9, t1 = {key.shaft_depth:g}; key {width[0] * 1e3:.3g} um to 0"
        rows.append(MatingRow("shaft", "key", text, key.width, None, "", None, ""))
        zone = keyway_symmetry(bore)
        text = f"symmetry; with the hub's, turns the profile by {math.degrees(zone / bore.radius):.2g} deg at most"
        rows.append(MatingRow("shaft", "groove of the key to the axis", text, zone, None, "", None, ""))
    if isinstance(bore, DBore):
        clear = bore.flat - FLAT_ZONE / 2
        play = math.degrees(2 * FLAT_ZONE / math.sqrt(bore.radius**2 - bore.flat**2))
        text = f"at most this from the axis, at least {FLAT_ZONE:g} less; lets the profile turn by {play:.2g} deg"
        rows.append(MatingRow("shaft", "flat", text, clear, None, "", None, ""))
    return rows


def _slides(model: WaveGeneratorModel) -> list[MatingRow]:
    """The axial play of each slide, which no part has of its own: whoever mounts the wave generator sets it."""
    rows = []
    for slide in slides_of(model.parts):
        names = f"{slide.below.name} and {slide.above.name}".replace("_", " ")
        wide = 2 * slide.block.radius
        takes = math.degrees(math.atan(slide.play / wide))
        text = "largest axial play, set with shims"
        rows.append(MatingRow("assembly", f"slide between {names}", text, slide.play, wide, "wg_tilt", takes, "deg"))
    return rows


def _fed(name: str, bounds: Mapping[str, float], contributors: CalloutTables, unit: str) -> list[MatingRow]:
    """The study's own callouts that feed an error of the input axis."""
    rows = []
    for key, spec in contributors.items():
        if spec.get("feeds") != name:
            continue
        value, length = float(bounds.get(key, spec.get("value_mm", 0.0))), spec.get("length_mm")
        takes = value * CALLOUTS[spec["callout"]].factor(float(length or 1.0))
        takes = math.degrees(takes) if unit == "deg" else takes
        words = str(spec["callout"]).replace("_", " ")
        rows.append(MatingRow("housing or shaft", key.replace("_", " "), words, value, length, name, takes, unit))
    return rows


def _eccentricity(bounds: Mapping[str, float], contributors: CalloutTables) -> list[MatingRow]:
    if own := _fed("axis_eccentricity", bounds, contributors, "mm"):
        return own
    allowed = bounds.get("axis_eccentricity_mm")
    if allowed is None:
        return []
    features = (
        ("housing", "seat of the circular spline: play of its fit", "largest clearance on diameter"),
        ("housing", "bearing seat of the input shaft to the seat of the circular spline", "coaxiality, diameter"),
        ("bearing", "radial clearance in service, and run-out of the inner ring", "together, on diameter"),
        ("shaft", "seat of the wave generator to the bearing seats", "coaxiality, diameter"),
    )
    part = allowed / len(features)
    return [
        MatingRow(owner, name, requirement, 2 * part, None, "axis_eccentricity", part, "mm")
        for owner, name, requirement in features
    ]


def _tilt(drive: Drive, bounds: Mapping[str, float], contributors: CalloutTables) -> list[MatingRow]:
    if own := _fed("axis_tilt", bounds, contributors, "deg"):
        return own
    tilts = [bounds[key] for key in ("axis_tilt_y_deg", "axis_tilt_x_deg") if key in bounds]
    if not tilts:
        return []
    face = RIM_FACTOR * drive.geometry.module * drive.geometry.circular_spline_teeth
    part = min(tilts) / 2
    slope = math.tan(math.radians(part))
    return [
        MatingRow(
            "housing",
            "mounting face of the circular spline to the axis of the bearing seats",
            f"perpendicularity over diameter {face:.4g}",
            face * slope,
            face,
            "axis_tilt",
            part,
            "deg",
        ),
        MatingRow(
            "housing",
            "bearing seats to each other and play of the bearings",
            "offset for each 100 mm between the bearings",
            100 * slope,
            100.0,
            "axis_tilt",
            part,
            "deg",
        ),
    ]
