"""The wave generator as it is to be made: its parts in their places, and what had to be assumed of them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from hdopt.drive.geometry import Structure
from hdopt.geometry.budget import Plan
from hdopt.geometry.part import Part, ProfiledPart

CAM_STEP_DEG, WHEEL_RADIUS = 0.5, 200.0
"""Step of the cam's table and radius of the grinding wheel (mm) where nobody gives them; the files name them."""


@dataclass(frozen=True)
class Assumption:
    """A value that the study does not give: the study `key`, the `value` taken, and the `reason`, which is a rule."""

    key: str
    value: Any  # of the option's own type: a size, a name, whether there is a hub
    reason: str

    @property
    def written(self) -> str:
        """The value as a study file gives it."""
        return json.dumps(self.value) if isinstance(self.value, bool | str) else str(self.value)

    def __str__(self) -> str:
        return f"{self.key} = {self.written} ({self.reason})"


@dataclass(frozen=True)
class WaveGeneratorModel:
    """The parts in their places, lowest first, and what had to be assumed."""

    structure: Structure
    parts: tuple[Part, ...]
    assumptions: tuple[Assumption, ...]
    profile_zone: float
    """Full width of the profile's tolerance zone, mm."""
    plan: Plan
    """Its fits, and the budgets of eccentricity and tilt that they keep."""
    notes: tuple[str, ...] = ()
    cam_resolution_deg: float = CAM_STEP_DEG
    """Step of the cam's table."""
    wheel_radius: float = WHEEL_RADIUS
    """Of the grinding wheel, mm."""

    def part(self, name: str) -> Part:
        """The part of this `name`, of which there must be one."""
        return next(part for part in self.parts if part.name == name)

    @property
    def journal_zone(self) -> float:
        """Diameter of the position zone of eccentric journals, mm: without a bound of the eccentricity, they share the
        discs' zone."""
        return self.plan.zone("eccentric_hub", "wg_eccentricity") or self.profile_zone / 2

    @property
    def profiled(self) -> tuple[ProfiledPart, ...]:
        """The parts that carry the flexible bearing: the cam, or the two discs."""
        return tuple(part for part in self.parts if isinstance(part, ProfiledPart))
