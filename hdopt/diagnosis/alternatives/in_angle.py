"""Orders that no effect has: a sine at any order, and a whole order whose size changes with time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.alternatives.base import Alternative
from hdopt.effects.base import terms_at
from hdopt.effects.conditions import Conditions
from hdopt.effects.probe import Probe, best_terms, strongest_orders
from hdopt.effects.sines import sine_columns
from hdopt.effects.term import Term


class OfOrder(Alternative):
    """Something at an order, which takes some input turns to tell."""

    def lacks(self, samples: Conditions) -> str | None:
        least = self.settings.least_turns
        return None if samples.span_turns >= least else f"at least {least:g} input turns"


class AnyOrder(OfOrder):
    """One sine, or three neighbours (a modulated sine), at any order."""

    id = "_sine_in_angle"
    domain = "asynchronous order"

    def search(self, probe: Probe) -> list[Term]:
        s, rows = self.settings, probe.samples
        span = rows.span_turns
        highest = min(s.order_share * rows.rows_per_turn, probe.order_range[1])
        lowest = max(s.lowest_cycles / span, probe.order_range[0])
        lines = strongest_orders(probe, s.lines, lowest=lowest, highest=highest)
        if not lines:
            return []
        found = []
        for line in lines[: s.refined_lines]:
            beside = np.linspace(-s.resolution, s.resolution, s.resolution_steps)
            found += best_terms(probe, [self.term(rows, {"order": line + d / span}) for d in beside])
        best = best_terms(probe, found)[0]
        order = best.shape["order"]
        sides = np.unique(np.round(np.geomspace(s.closest_side / span, s.farthest_side, s.sides), s.side_digits))
        modulated = [self.term(rows, {"order": order, "side": side}) for side in sides if side < order]
        return [best, *best_terms(probe, modulated)]

    def term(self, samples: Conditions, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        s = self.settings
        orders = [shape["order"]]
        if "side" in shape:
            orders += [shape["order"] - shape["side"], shape["order"] + shape["side"]]
        span = max(samples.span_turns, 1.0)
        trials = s.trials_a_step * span * s.order_share * samples.rows_per_turn * (s.sides if "side" in shape else 1)
        return Term(
            self.id,
            dict(shape),
            columns=sine_columns(samples.theta, orders),
            steps={"order": s.derivative / span},
            trials=trials,
            odds=s.odds,
            doubtful=True,
        )


class ChangingOrder(OfOrder):
    """A whole order, or a whole order of the flexspline, whose amplitude changes steadily over the recording."""

    id = "_changing_order"
    domain = "time"

    def search(self, probe: Probe) -> list[Term]:
        ratio = probe.samples.ratio
        orders = [k * f for k in range(1, self.settings.growing_orders + 1) for f in (1.0, 1 + 1 / ratio)]
        return best_terms(probe, terms_at(self, probe.samples, [{"order": o} for o in orders]))

    def term(self, samples: Conditions, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        along = np.linspace(-1, 1, len(samples))[:, None]
        columns = along * sine_columns(samples.theta, [shape["order"]])
        trials = self.settings.growing_trials
        return Term(self.id, dict(shape), columns=columns, trials=trials, odds=self.settings.odds, doubtful=True)
