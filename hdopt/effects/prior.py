"""Whether estimated numbers of an effect lie where real drives and benches have them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from hdopt.effects.base import Effect
from hdopt.effects.declared import Quantity
from hdopt.effects.estimate import Parameter


@dataclass(frozen=True)
class OutsidePrior:
    """A number of `effect` whose `value` lies outside its prior range from `low` to `high`, all in `unit`.

    `certainly`: no end of its 95 % interval reaches into the range.
    """

    effect: str
    name: str
    value: float
    low: float
    high: float
    unit: str
    certainly: bool

    @property
    def says(self) -> str:
        """In plain words."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        return (
            f"{self.effect} has {self.name} = {self.value:.3g}{unit}; drives and benches have {self.low:g} to "
            f"{self.high:g}{unit}: check the units, signs and columns of the recording, or doubt the name"
        )


def prior_ranges(effect: Effect) -> dict[str, Quantity]:
    """The numbers of an `effect` that have a prior range, by their names in a diagnosis."""
    return {item.name: item for item in effect.flat_declared() if isinstance(item, Quantity) and item.prior is not None}


def outside_prior(effect: Effect, parameters: Mapping[str, Parameter]) -> list[OutsidePrior]:
    """Those of the estimated `parameters` of an `effect`, by their names in a diagnosis, that lie outside their priors.

    A frequency that no drive has, a gain far from 1 or a delay of seconds is what another physics, another unit or
    another sign leaves: such a name must not stand plainly.
    """
    found = []
    for name, quantity in prior_ranges(effect).items():
        if name not in parameters or quantity.prior is None:
            continue
        low, high = quantity.prior
        estimate = parameters[name]
        if not low <= estimate.value <= high:
            certainly = estimate.high < low or estimate.low > high
            found.append(OutsidePrior(effect.id, name, estimate.value, low, high, quantity.unit, certainly))
    return found
