"""[search]: what a design search may vary, what it minimises and what limits it."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from hdopt.study.base import NotNegative, Positive, Section


class VariableSection(Section):
    """Bounds of one design variable, with `step` or `values` where only some of them can be had."""

    lower: float
    upper: float
    step: Positive | None = None
    values: list[float] | None = None

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
    width_mm: VariableSection | None = None
    module_mm: VariableSection | None = None
    deflection_ratio: VariableSection | None = None
    wrap_angle_deg: VariableSection | None = None

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
    min: float | None = None
    max_of_baseline: Positive | None = None
    min_of_baseline: Positive | None = None

    @model_validator(mode="after")
    def _one(self) -> LimitSection:
        if len(self.model_fields_set) != 1:
            raise ValueError("needs exactly one of max, min, max_of_baseline, min_of_baseline")
        return self


class TradeSection(Section):
    """[search.trade]: constants of the trade's formulas; see `hdopt.mechanics.bearing_life` for their sources."""

    rated_torque_nm: Positive | None = None
    rated_speed_rpm: Positive | None = None
    bearing_l50_h: Positive = 35_000.0
    torque_exponent: Positive = 3.0
    l10_share: Positive = 0.2
    width_exponent: NotNegative = 17 / 15
    friction: NotNegative = 0.07
    notch_factor: Positive = 2.2


class SearchSection(Section):
    """[search]"""

    size: Literal["fixed_tooth_counts", "fixed_outside_diameter"] = "fixed_tooth_counts"
    profiles: list[Literal["ellipse", "resal", "two_disk"]] = Field(
        default=["ellipse", "resal", "two_disk"], min_length=1
    )
    structures: list[Literal["integral", "automatic", "one_way_major", "one_way_minor"]] = Field(
        default=["integral", "automatic", "one_way_major", "one_way_minor"], min_length=1
    )
    objective: str = "peak_to_peak_arcmin"
    second_objective: str | None = "flank_pressure_mpa"
    robust: bool = False
    """Whether the front under the tolerances is made as well."""
    quantile: float = Field(default=0.9973, gt=0.5, lt=1)
    samples: int = Field(default=2048, ge=128, le=1 << 20)
    front_points: int = Field(default=30, ge=2, le=1000)
    perturbation: float = Field(default=0.2, gt=0, lt=1)
    global_algorithm: str | None = None
    local_algorithm: str | None = None
    variables: VariablesSection | None = None
    limits: dict[str, LimitSection] | None = None
    trade: TradeSection = Field(default_factory=TradeSection)


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
    "trailing_flank_room_mm": LimitSection(min_of_baseline=0.5),
}
"""Carries no less than the study's own drive, bends safely and does not jam; where a study does not say."""
