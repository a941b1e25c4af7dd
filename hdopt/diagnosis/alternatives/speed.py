"""What follows the speed as no effect does: alike in both directions, at once or late."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.alternatives.base import Alternative, of_largest
from hdopt.diagnosis.alternatives.late import lagging, lags, within_reach
from hdopt.effects.base import terms_at
from hdopt.effects.conditions import Conditions, varies
from hdopt.effects.probe import Probe, best_terms
from hdopt.effects.term import Term


class EvenSpeed(Alternative):
    """A function of speed that is the same in both directions, at once or with a lag, as of what heats itself by
    friction: slower and slower towards what this speed leads to, from rest at the start of each recording.
    """

    id = "_even_in_speed"
    domain = "speed"

    def lacks(self, samples: Conditions) -> str | None:
        if samples.locked or samples.speed is None:
            return "speed that varies"
        return None if varies(np.abs(samples.speed), self.settings.speed_levels) else "speed that varies"

    def search(self, probe: Probe) -> list[Term]:
        s, samples = self.settings, probe.samples
        powers = [{"power": p} for p in (1.0, 2.0)]
        found = best_terms(probe, terms_at(self, samples, powers))
        if samples.time is None:
            return found
        late = [power | {"lag_s": lag} for power in powers for lag in lags(samples, s)]
        return [*found, *best_terms(probe, terms_at(self, samples, late))]

    def term(self, samples: Conditions, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        s, kept = self.settings, dict(shape)
        own = np.abs(of_largest(samples.speed, len(samples)))
        column, steps, trials = own ** shape["power"], {}, s.speed_forms
        if "lag_s" in shape:
            kept["lag_s"] = within_reach(samples, shape["lag_s"], s)
            column = lagging(samples, column, kept["lag_s"])
            steps, trials = {"lag_s": s.lag_derivative * kept["lag_s"]}, s.speed_forms * len(s.lags)
        return Term(self.id, kept, columns=column[:, None], steps=steps, trials=trials, odds=s.odds, doubtful=True)
