"""Shared by the effects that are plain sines of a shaft angle: eccentric encoders and bent couplings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from hdopt.arrays import Array
from hdopt.effects.base import Effect, terms_at
from hdopt.effects.conditions import Conditions
from hdopt.effects.declared import Shaft
from hdopt.effects.estimate import FitEstimate, Parameter
from hdopt.effects.probe import Probe
from hdopt.effects.sines import sine_columns
from hdopt.effects.term import Shape, Term

LEAST_PART = 0.1
"""Size of the first order over the largest from which it is there."""


class ShaftSine(Effect):
    """Sines of input or output angle; `variants` lists what may turn, each with its log prior odds.

    Its orders are known: nothing of it is left for another effect to explain. The first order of a variant must be
    there: the second without it would be another effect's.
    """

    domain = "order"
    exact_shape = True
    has_parts = True
    variants: ClassVar[tuple[tuple[Shaft, tuple[int, ...]], ...]]
    """The shaft of each variant, and its orders in cycles a turn of that shaft."""
    odds: ClassVar[tuple[float, ...]] = (0.0,)
    least_output_turns: ClassVar[float] = 0.0
    """Turns of the output that a recording must hold; 0: one input turn."""

    @staticmethod
    def shape_of(shaft: Shaft, orders: tuple[int, ...]) -> Shape:
        """The shape of these orders of a shaft."""
        return {"shaft": shaft, "orders": orders}

    def lacks(self, conditions: Conditions) -> str | None:
        need = self.least_output_turns * conditions.ratio or 1.0
        if conditions.span_turns >= need:
            return None
        return f"at least {need:.0f} input turns (there are {conditions.span_turns:.1f})"

    def search(self, probe: Probe) -> Sequence[Term]:
        return terms_at(self, probe.samples, [self.shape_of(*variant) for variant in self.variants])

    def term(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        return Term(
            self.id,
            dict(shape),
            columns=sine_columns(conditions.theta, self.orders(shape, conditions.ratio)),
            trials=float(len(self.variants)),
            odds=self.odds[self.variants.index((shape["shaft"], shape["orders"]))],
        )

    def every_part_shows(self, term: Term, estimate: FitEstimate) -> bool:
        size = estimate.sizes(term.width // 2)
        return bool(size[0] > LEAST_PART * size.max())

    def reads_input(self, shape: Shape) -> bool:
        return bool(shape.get("shaft") == Shaft.INPUT)

    def orders(self, shape: Shape, ratio: float) -> list[float]:
        return [k if shape["shaft"] == Shaft.INPUT else k / ratio for k in shape["orders"]]

    def parameters(self, term: Term, estimate: FitEstimate) -> dict[str, Parameter]:
        found = {"amplitude_arcmin": estimate.amplitude(0, 1), "phase_deg": estimate.phase_deg(0, 1)}
        for i, k in enumerate(term.shape["orders"][1:], start=1):
            name = f"{term.shape['shaft']}_{k}"
            found[f"amplitude_{name}_arcmin"] = estimate.amplitude(2 * i, 2 * i + 1)
            found[f"phase_{name}_deg"] = estimate.phase_deg(2 * i, 2 * i + 1)
        return found
