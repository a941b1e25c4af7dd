"""What a wave generator's solids need beyond the model of the drive: sizes that a study's `[export]` section may give.

A size that is None was not given; a rule (`RULES`) then finds it, and whoever exports is told the
reason that stands here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Mount = Literal["keyway", "d_bore", "plain"]
Thread = Literal["M2", "M3", "M4", "M5", "M6", "M8"]
Schema = Literal["AP214", "AP242"]


@dataclass(frozen=True)
class ExportOptions:
    """Sizes in mm and degrees as their names say; `RULES` has what holds where one is None."""

    bore_mm: float | None = None
    mount: Mount | None = None
    d_flat_mm: float | None = None
    hub: bool | None = None
    hub_seat_mm: float | None = None
    hub_flange_thickness_mm: float | None = None
    bolt_count: int | None = None
    bolt_thread: Thread | None = None
    bolt_circle_mm: float | None = None
    chamfer_mm: float | None = None
    bore_chamfer_mm: float | None = None
    lead_in_length_mm: float | None = None
    lead_in_angle_deg: float | None = None
    minimum_wall_mm: float | None = None
    slot_depth_mm: float | None = None
    disc_thickness_mm: float | None = None
    axial_gap_mm: float | None = None
    cross_slide_travel_mm: float | None = None
    disc_gap_mm: float | None = None
    journal_clearance_mm: float | None = None
    journal_radius_mm: float | None = None
    profile_tolerance_mm: float | None = None
    shaft_fit: str | None = None
    """Fit of the bore on the shaft, as "H6/n5"; None: the loosest that keeps the budget."""
    seat_fit: str | None = None
    """Fit of the cam or the discs on their hub."""
    part_number: str | None = None
    """What the numbers of assembly and parts begin with, before their place in the parts list."""
    cam_material: str | None = None
    """Of the cam or both discs, as the sheets and the STEP file name it."""
    cam_hardness: str | None = None
    """As the sheets name it, "58-62 HRC"."""
    cam_density_g_cm3: float | None = None
    hub_material: str | None = None
    hub_hardness: str | None = None
    hub_density_g_cm3: float | None = None
    input_disc_material: str | None = None
    input_disc_hardness: str | None = None
    input_disc_density_g_cm3: float | None = None
    floating_disc_material: str | None = None
    floating_disc_hardness: str | None = None
    floating_disc_density_g_cm3: float | None = None
    cam_resolution_deg: float | None = None
    wheel_radius_mm: float | None = None
    race_share: float | None = None
    context: bool = False
    """Whether bearing races, flexspline ring and circular spline are shown."""
    step_schema: Schema = "AP214"
    """Application protocol of the STEP file."""


RULES: dict[str, str] = {
    "bore_mm": "preferred size next to a quarter of the cam's minor diameter",
    "mount": "keyway of DIN 6885-1, which begins at 6 mm; a D-bore below",
    "d_flat_mm": "flat 0.8 bore radii from the axis",
    "hub": "integral type: the cam is screwed to a flanged hub on the shaft, where there is room",
    "hub_seat_mm": "bore or keyway plus twice the least wall, next even number",
    "hub_flange_thickness_mm": "0.4 of the width, to 0.5 mm, or what its screws need",
    "bolt_count": "six with a hub, none without",
    "bolt_thread": "by the size of the cam; holes ISO 273 medium, tap drills ISO 2306",
    "bolt_circle_mm": "diameter that leaves 1.2 holes beside the seat or bore",
    "chamfer_mm": "45 degree chamfer of outer edges; 0.3 mm, at most 0.04 widths",
    "bore_chamfer_mm": "45 degree countersink; 0.5 mm, at most 0.05 bores and 0.1 widths",
    "lead_in_length_mm": "taper to press the bearing on, at the end away from input; 1 mm, at most 0.12 widths",
    "lead_in_angle_deg": "angle of that taper to the axis",
    "minimum_wall_mm": "least wall left anywhere; 2 mm, in small cams 0.08 radii",
    "slot_depth_mm": "a third of the width, to 0.5 mm",
    "disc_thickness_mm": "slot depth and twice the least wall",
    "axial_gap_mm": "axial play between parts that slide on each other; 0.1 mm, at most their part of the tilt",
    "cross_slide_travel_mm": "how far a slide may move from the middle",
    "disc_gap_mm": "axial gap between the two discs",
    "journal_clearance_mm": "none: the fit of disc and journal is chosen from the budget",
    "journal_radius_mm": "bore or keyway, eccentricity and twice the least wall, next size of DIN 471's rings",
    "profile_tolerance_mm": "profile of a surface (ISO 1101), width of the zone; 10 um, at most what the budget gives",
    "part_number": "WG and eight digits of the fingerprint",
    "cam_material": "100Cr6, hardened",
    "cam_hardness": "58-62 HRC of the material that is assumed; none beside a material that the study names",
    "cam_density_g_cm3": "that of steel, 7.85",
    "hub_material": "42CrMo4, quenched and tempered",
    "hub_hardness": "28-32 HRC of the material that is assumed; none beside a material that the study names",
    "hub_density_g_cm3": "that of steel, 7.85",
    "input_disc_material": "CuSn12-C",
    "input_disc_hardness": "90 HB of the material that is assumed; none beside a material that the study names",
    "input_disc_density_g_cm3": "that of bronze, 8.8",
    "floating_disc_material": "42CrMo4, nitrided",
    "floating_disc_hardness": "600 HV of the material that is assumed; none beside a material that the study names",
    "floating_disc_density_g_cm3": "that of steel, 7.85",
    "cam_resolution_deg": "step of the cam's table",
    "wheel_radius_mm": "radius of the grinding wheel that the G-code is for",
    "race_share": "thickness of either race as a share of the bearing's",
}
"""Option -> the rule that holds where nobody gives it."""
