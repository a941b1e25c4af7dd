"""[search]: what a design search may vary, what it minimises and what limits it."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from hdopt.study.base import NotNegative, Positive, Section

StructureName = Literal["integral", "automatic", "one_way_major", "one_way_minor"]


class VariableSection(Section):
    """Bounds of one design variable, with `step` or `values` where only some of them can be had."""

    lower: float
    """Smallest value."""
    upper: float
    """Largest value."""
    step: Positive | None = None
    """Only lower, lower + step, ... can be had."""
    values: list[float] | None = None
    """Only these can be had."""

    @model_validator(mode="after")
    def _consistent(self) -> VariableSection:
        if self.lower >= self.upper:
            raise ValueError(f"runs from {self.lower:g} to {self.upper:g}; lower must be below upper")
        if self.step is not None and self.values is not None:
            raise ValueError("has both step and values; give one of them")
        if self.values is not None and not any(self.lower <= value <= self.upper for value in self.values):
            raise ValueError(f"has no value between lower = {self.lower:g} and upper = {self.upper:g}")
        return self

    def allowed(self) -> tuple[float, ...]:
        """The values that can be had; () for any."""
        if self.values is not None:
            return tuple(sorted({value for value in self.values if self.lower <= value <= self.upper}))
        if self.step is None:
            return ()
        count = int(np.floor((self.upper - self.lower) / self.step + 1e-9)) + 1
        return tuple(float(x) for x in np.round(self.lower + self.step * np.arange(count), 12))


class VariablesSection(Section):
    """[search.variables]: those that are left out keep the drive's own value."""

    pressure_angle_deg: VariableSection | None = None
    """Pressure angle."""
    width_mm: VariableSection | None = None
    """Width of the wave generator."""
    module_mm: VariableSection | None = None
    """Module."""
    deflection_ratio: VariableSection | None = None
    """Greatest deflection over the module."""
    wrap_angle_deg: VariableSection | None = None
    """Wrap angle of the two-disk profile."""

    @model_validator(mode="after")
    def _possible(self) -> VariablesSection:
        for name, low, high in (
            ("pressure_angle_deg", 0.0, 45.0),
            ("width_mm", 0.0, np.inf),
            ("module_mm", 0.0, np.inf),
            ("deflection_ratio", 0.0, 2.0),
            ("wrap_angle_deg", 0.0, 90.0),
        ):
            given = getattr(self, name)
            if given is not None and not (low < given.lower and given.upper < high):
                raise ValueError(
                    f"{name} runs from {given.lower:g} to {given.upper:g}; it must lie in {low:g} to {high:g}"
                )
        return self


class LimitSection(Section):
    """A limit on a quantity: a number, or a share of what the study's own drive has."""

    max: float | None = None
    """Largest value allowed."""
    min: float | None = None
    """Smallest value allowed."""
    max_of_baseline: Positive | None = None
    """Largest value allowed, as a multiple of what the study's own drive has."""
    min_of_baseline: Positive | None = None
    """Smallest value allowed, as a multiple of what the study's own drive has."""

    @model_validator(mode="after")
    def _one(self) -> LimitSection:
        if len(self.model_fields_set) != 1:
            raise ValueError("needs exactly one of max, min, max_of_baseline, min_of_baseline")
        return self


class TradeSection(Section):
    """[search.trade]: constants of the trade's formulas; see `hdopt.mechanics.bearing_life` for their sources."""

    rated_torque_nm: Positive | None = None
    """Torque at which the bearing's life is rated; that of [load] if omitted."""
    rated_speed_rpm: Positive | None = None
    """Input speed at which it is rated; that of [load] if omitted."""
    bearing_l50_h: Positive = 35_000.0
    """Median life of the flexible bearing at the rated load."""
    torque_exponent: Positive = 3.0
    """Exponent of the torque in the life."""
    l10_share: Positive = 0.2
    """L10 life over median life."""
    width_exponent: NotNegative = 17 / 15
    """Exponent of the width in the bearing's capacity."""
    friction: NotNegative = 0.07
    """Coefficient of friction of the flanks."""
    notch_factor: Positive = 2.2
    """Notch factor of the bending stress under the teeth."""
    mean_stress_sensitivity: NotNegative = 0.2
    """How much of the steady hoop stress counts beside the alternating bending in the safety."""
    structure_cost_percent: dict[StructureName, NotNegative] = Field(default_factory=dict)
    """What a structure costs in stiffness and efficiency, as the share of the objective you would give to be without
    it, in per cent; it weighs in the choice only. No formula is known: the designer's own number."""
    wg_tilt_major_over: Literal["bore", "shoulder"] = "bore"
    """What the wave generator's tilt along its major axis is a callout over: its fit on the shaft, whose length follows
    its width, or a shoulder's diameter, which does not. The input axis tilts over its bearings' span."""
    wg_tilt_minor_over: Literal["bore", "shoulder"] = "bore"
    """The same of its tilt along its minor axis."""


class SearchSection(Section):
    """[search]: what a design search may vary, what it minimises and what limits it."""

    size: Literal["fixed_tooth_counts", "fixed_outside_diameter"] = "fixed_tooth_counts"
    """What stays while the module changes: tooth counts, or the outside diameter."""
    profiles: list[Literal["ellipse", "resal", "two_disk"]] = Field(
        default=["ellipse", "resal", "two_disk"], min_length=1
    )
    """Profiles that may be chosen."""
    structures: list[StructureName] = Field(
        default=["integral", "automatic", "one_way_major", "one_way_minor"], min_length=1
    )
    """Structures that may be chosen."""
    objective: str = "peak_to_peak_arcmin"
    """Quantity that is minimised."""
    second_objective: str | None = "flank_pressure_mpa"
    """Quantity of the second axis of the fronts."""
    robust: bool = False
    """Whether the front under the tolerances is made as well."""
    quantile: float = Field(default=0.9973, gt=0.5, lt=1)
    """Share of drives that the robust objective speaks of."""
    samples: int = Field(default=2048, ge=128, le=1 << 20)
    """Drives that make a quantile."""
    front_points: int = Field(default=30, ge=2, le=1000)
    """Points of a front."""
    regions: bool = False
    """Whether constants are followed to where another choice is the better: a few times a search's processor time."""
    perturbation: float = Field(default=0.5, ge=0.05, le=3)
    """How far each constant is followed to see where the choice changes: 0.5 is down to 1/1.5 and up to 1.5 times."""
    global_algorithm: str | None = None
    """Name of NLopt's algorithm for the global stage; its own choice if omitted."""
    local_algorithm: str | None = None
    """The same for the local stage."""
    variables: VariablesSection | None = None
    """Bounds of what varies."""
    limits: dict[str, LimitSection] | None = None
    """Limits by quantity; those that carry no less than the study's drive if omitted."""
    trade: TradeSection = Field(default_factory=TradeSection)
    """Constants of the formulas."""


DEFAULT_VARIABLES = VariablesSection(
    pressure_angle_deg=VariableSection(lower=5.0, upper=20.0),
    width_mm=VariableSection(lower=5.0, upper=14.0),
    deflection_ratio=VariableSection(lower=0.95, upper=1.2),
    wrap_angle_deg=VariableSection(lower=15.0, upper=75.0),
)
"""What varies where a study does not say."""

DEFAULT_LIMITS = {
    "flank_pressure_mpa": LimitSection(max_of_baseline=1.0),
    "bearing_life_h": LimitSection(min_of_baseline=1.0),
    "bending_safety": LimitSection(min=1.5),
    "carrying_teeth": LimitSection(min_of_baseline=1.0),
    "trailing_flank_room_mm": LimitSection(min=0.0),
}
"""Carries no less than the study's own drive, bends safely and does not jam; where a study does not say."""
