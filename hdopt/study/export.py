"""The study section `[export]`: what a wave generator's solids need beyond the model of the drive.

Every key has a value to fall back on, and whoever exports is told which of them were assumed (`Field.description` is
what they read). A key without a number here has a rule that depends on the drive; `hdopt.geometry.assembly` holds it.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from hdopt.study.base import Section

_Length = float | None


class ExportSection(Section):
    """[export]"""

    bore_mm: _Length = Field(None, gt=0, description="preferred size next to a quarter of the cam's minor diameter")
    mount: Literal["keyway", "d_bore", "plain"] | None = Field(
        None, description="keyway of DIN 6885-1, which begins at 6 mm; a D-bore below"
    )
    d_flat_mm: _Length = Field(None, gt=0, description="flat 0.8 bore radii from the axis")
    hub: bool | None = Field(
        None,
        description="integral type: the cam is screwed to a flanged hub on the shaft, where there is room",
    )
    hub_seat_mm: _Length = Field(None, gt=0, description="bore or keyway plus twice the least wall, next even number")
    hub_flange_thickness_mm: _Length = Field(None, gt=0, description="0.4 of the width, to 0.5 mm")
    bolt_count: int | None = Field(None, ge=0, le=48, description="six with a hub, none without")
    bolt_thread: Literal["M2", "M3", "M4", "M5", "M6", "M8"] | None = Field(
        None, description="by the size of the cam; holes ISO 273 medium, tap drills ISO 2306"
    )
    bolt_circle_mm: _Length = Field(None, gt=0, description="diameter that leaves 1.2 holes beside the seat or bore")
    chamfer_mm: _Length = Field(None, ge=0, description="45 degree chamfer of outer edges; 0.3 mm, at most 0.04 widths")
    bore_chamfer_mm: _Length = Field(None, ge=0, description="45 degree countersink; 0.5 mm, at most 0.05 bores")
    lead_in_length_mm: _Length = Field(
        None, ge=0, description="taper to press the bearing on, at the end away from input; 1 mm, at most 0.12 widths"
    )
    lead_in_angle_deg: float = Field(15.0, gt=0, le=45, description="angle of that taper to the axis")
    minimum_wall_mm: _Length = Field(None, gt=0, description="least wall left anywhere; 2 mm, in small cams 0.08 radii")
    slot_depth_mm: _Length = Field(None, gt=0, description="a third of the width, to 0.5 mm")
    disc_thickness_mm: _Length = Field(None, gt=0, description="slot depth and twice the least wall")
    axial_gap_mm: float = Field(0.1, ge=0, description="axial play between parts that slide on each other")
    cross_slide_travel_mm: float = Field(0.5, gt=0, description="how far a slide may move from the middle")
    disc_gap_mm: float = Field(0.2, ge=0, description="axial gap between the two discs")
    journal_clearance_mm: float = Field(0.02, ge=0, description="radial clearance of a disc on its journal")
    journal_radius_mm: _Length = Field(None, gt=0, description="bore or keyway, eccentricity and twice the least wall")
    profile_tolerance_mm: float = Field(0.010, gt=0, description="profile of a line (ISO 1101), width of the zone")
    race_share: float = Field(0.25, gt=0, lt=0.5, description="thickness of either race as a share of the bearing's")
    context: bool = Field(False, description="no bearing races, flexspline ring and circular spline")
    step_schema: Literal["AP214", "AP242"] = Field("AP214", description="application protocol of the STEP file")
