"""The study section `[export]`: what a wave generator's solids need beyond the model of the drive.

Every key may be left out; whoever exports is told which sizes were then found by a rule, and by which
(`RULES` in `hdopt.geometry.options`).
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from hdopt.geometry.options import ExportOptions, Mount, Schema, Thread
from hdopt.study.base import NotNegative, Positive, Section

Words = Annotated[str, Field(min_length=1, max_length=60)]
"""A text that has its place in a title block."""


class ExportSection(Section):
    """[export]: sizes of the wave generator's solids; one that is left out follows a rule, which is printed."""

    bore_mm: Positive | None = None
    mount: Mount | None = None
    d_flat_mm: Positive | None = None
    hub: bool | None = None
    hub_seat_mm: Positive | None = None
    hub_flange_thickness_mm: Positive | None = None
    bolt_count: int | None = Field(default=None, ge=0, le=48)
    bolt_thread: Thread | None = None
    bolt_circle_mm: Positive | None = None
    chamfer_mm: NotNegative | None = None
    bore_chamfer_mm: NotNegative | None = None
    lead_in_length_mm: NotNegative | None = None
    lead_in_angle_deg: float | None = Field(default=None, gt=0, le=45)
    minimum_wall_mm: Positive | None = None
    slot_depth_mm: Positive | None = None
    disc_thickness_mm: Positive | None = None
    axial_gap_mm: NotNegative | None = None
    cross_slide_travel_mm: Positive | None = None
    disc_gap_mm: NotNegative | None = None
    journal_clearance_mm: NotNegative | None = None
    journal_radius_mm: Positive | None = None
    profile_tolerance_mm: Positive | None = None
    shaft_fit: str | None = None
    seat_fit: str | None = None
    part_number: Words | None = None
    cam_material: Words | None = None
    cam_hardness: Words | None = None
    cam_density_g_cm3: Positive | None = None
    hub_material: Words | None = None
    hub_hardness: Words | None = None
    hub_density_g_cm3: Positive | None = None
    input_disc_material: Words | None = None
    input_disc_hardness: Words | None = None
    input_disc_density_g_cm3: Positive | None = None
    floating_disc_material: Words | None = None
    floating_disc_hardness: Words | None = None
    floating_disc_density_g_cm3: Positive | None = None
    cam_resolution_deg: Positive | None = None
    wheel_radius_mm: Positive | None = None
    race_share: float | None = Field(default=None, gt=0, lt=0.5)
    context: bool = False
    step_schema: Schema = "AP214"

    def build(self) -> ExportOptions:
        """The options as the geometry takes them."""
        return ExportOptions(**self.model_dump())
