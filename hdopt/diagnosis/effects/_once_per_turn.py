"""Shared by the effects that are plain sines of a shaft angle: eccentric encoders and bent couplings."""

from __future__ import annotations

import numpy as np

from hdopt.diagnosis.effect import Term, sine_columns, terms_at

LEAST_PART = 0.1
"""Size of the first order over the largest from which it is there."""


class ShaftSine:
    """Sines of input or output angle; `variants` lists the orders of each variant with its log prior odds."""

    id = ""
    domain = "order"
    needs_base = False
    exact_shape = True
    """Its orders are known: nothing of it is left for another effect to explain."""
    separating = ""
    variants: tuple[tuple[tuple[str, int], ...], ...] = ()
    odds: tuple[float, ...] = ()

    def least_turns(self, samples) -> float:
        return 1.0

    def lacks(self, samples):
        need = self.least_turns(samples)
        if samples.span_turns >= need:
            return None
        return f"at least {need:.0f} input turns (there are {samples.span_turns:.1f})"

    def search(self, probe):
        return terms_at(self, probe.samples, [{"variant": float(i)} for i in range(len(self.variants))])

    def term(self, samples, shape, base_value=None):
        index = int(shape["variant"])
        orders = [k if shaft == "input" else k / samples.ratio for shaft, k in self.variants[index]]
        return Term(
            self.id,
            dict(shape),
            columns=sine_columns(samples.theta, orders),
            trials=float(len(self.variants)),
            odds=self.odds[index],
        )

    @staticmethod
    def every_part_shows(term, estimate):
        """The first order must be there: the second without it would be another effect's."""
        size = np.hypot(estimate.values[0 : term.width : 2], estimate.values[1 : term.width : 2])
        return bool(size[0] > LEAST_PART * size.max())

    def orders(self, term, ratio):
        return [k if shaft == "input" else k / ratio for shaft, k in self.variants[int(term.shape["variant"])]]

    def parameters(self, term, estimate):
        found = {"amplitude_arcmin": estimate.amplitude(0, 1), "phase_deg": estimate.phase_deg(0, 1)}
        for i, (shaft, k) in enumerate(self.variants[int(term.shape["variant"])][1:], start=1):
            found[f"amplitude_{shaft}_{k}_arcmin"] = estimate.amplitude(2 * i, 2 * i + 1)
            found[f"phase_{shaft}_{k}_deg"] = estimate.phase_deg(2 * i, 2 * i + 1)
        return found
