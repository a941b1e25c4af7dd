"""One effect with its numbers, and what is known of each effect besides its physics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hdopt.diagnosis.effect import Effect, Term
from hdopt.diagnosis.effects import EFFECTS
from hdopt.diagnosis.effects.tooth_mesh import SIDEBANDS, ZONE_SIDEBANDS, mesh_order
from hdopt.diagnosis.samples import Samples

Array = NDArray[np.float64]

BENCH = {
    "encoder_input_eccentricity": "the input encoder",
    "encoder_output_eccentricity": "the output encoder",
    "encoder_interpolation": "an encoder",
    "output_coupling": "a coupling between drive and encoder",
    "channel_delay": "the acquisition of both channels",
    "thermal_drift": "the expansion of the bench, drive and bench together",
    "resonance": "the inertia that the bench hangs on the drive",
}
"""Effects that belong to the bench which measures, with the part they come from. All others belong to the drive, as
it was mounted."""

NEEDS = {
    "torsional_windup": {"torque": "output_torque_nm"},
    "channel_delay": {"speed": "speed_rpm"},
    "resonance": {"speed": "speed_rpm"},
}
"""Effect -> the numbers of an `Operation` that it needs, with their keys in a study file's [operation]."""

RADIAL = ("circular_spline_lobing",)
"""Effects that are radial deviations: the pressure angle makes their arc."""

LASTING = {"hysteresis": 1}
"""Effect -> how many of its columns last, where others fade after the start of a recording."""


@dataclass(frozen=True)
class AddedEffect:
    """An effect of the catalogue at given numbers: its `shape` and the coefficients of its columns, as in a `Term`."""

    id: str
    shape: Mapping[str, float]
    coefficients: tuple[float, ...]

    @classmethod
    def fitted(cls, term: Term, coefficients: Array) -> AddedEffect:
        """The effect of a fitted term, without the columns that only describe how a recording began."""
        kept = coefficients[: LASTING.get(term.effect, len(coefficients))]
        return cls(term.effect, dict(term.shape), tuple(map(float, kept)))

    @property
    def effect(self) -> Effect:
        return EFFECTS[self.id]

    @property
    def origin(self) -> str:
        """'bench' or 'drive'."""
        return "bench" if self.id in BENCH else "drive"

    @property
    def needs(self) -> Mapping[str, str]:
        """The numbers of an `Operation` that this effect needs, with their study keys."""
        if self.id == "thermal_drift":
            if "time_constant_s" in self.shape:
                return {"time": "time_s", "speed": "speed_rpm"}
            return {"temperature_difference": "temperature_difference_k"}
        return NEEDS.get(self.id, {})

    @property
    def follows_base(self) -> bool:
        """Whether the drive's own motion drives this effect: it has no value at one angle alone."""
        return hasattr(self.effect, "steady_state")

    @property
    def moves_the_output(self) -> bool:
        """Whether the columns of this effect are a motion of the drive, which excites what swings behind it."""
        return getattr(self.effect, "excites", False)

    def term(self, samples: Samples, base_value: Array | None = None) -> Term:
        """The effect's columns on these rows, by its own physics."""
        physics = getattr(self.effect, "steady_state", getattr(self.effect, "unbounded", self.effect.term))
        return physics(samples, self.shape, base_value)

    def highest_order(self, ratio: float) -> float:
        """The highest order (cycles an input turn) that a sampling of this effect must resolve."""
        if self.id == "tooth_mesh":
            return max(self.orders(ratio))
        if self.id == "local_tooth_defect":
            return 360 / self.shape["width_deg"] / 4  # a Gaussian of this standard deviation rises within a quarter
        return max(self.orders(ratio), default=self.shape.get("order", 0.0))

    def orders(self, ratio: float) -> list[float]:
        """Orders that this effect adds to the spectrum, where it is made of sines."""
        if self.id == "tooth_mesh":
            sides = ZONE_SIDEBANDS if "zones" in self.shape else SIDEBANDS
            return [mesh_order(ratio) + k for k in sides[int(self.shape["sidebands"])]]
        if self.id == "torsional_windup":
            return [2.0] if "angle" in self.shape else []
        named = getattr(self.effect, "orders", None)
        return [] if named is None else [float(o) for o in named(Term(self.id, self.shape), ratio)]
