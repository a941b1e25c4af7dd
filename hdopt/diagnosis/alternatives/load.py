"""What follows the torque as no effect does: alike for both signs, late, or as the drive moves under it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.alternatives.base import Alternative, of_largest
from hdopt.diagnosis.alternatives.late import lagging, lags, within_reach
from hdopt.effects.base import terms_at
from hdopt.effects.conditions import Conditions, varies
from hdopt.effects.probe import Probe, best_terms
from hdopt.effects.sines import sine_columns
from hdopt.effects.term import Term

LOADS = (np.positive, np.abs)
"""What of the torque enters a product with the motion."""


class UnderLoad(Alternative):
    """Something that follows the torque."""

    domain = "torque"

    def lacks(self, samples: Conditions) -> str | None:
        return None if samples.torque is not None and np.std(samples.torque) > 0 else "torque that varies"


class EvenLoad(UnderLoad):
    """An even function of torque, or an order whose size follows the torque."""

    id = "_even_in_torque"

    def search(self, probe: Probe) -> list[Term]:
        kinds = [{"kind": float(k)} for k in range(self.settings.load_forms)]
        return best_terms(probe, terms_at(self, probe.samples, kinds))

    def term(self, samples: Conditions, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        torque = of_largest(samples.torque, len(samples))
        forms = (
            lambda: np.abs(torque)[:, None],
            lambda: (torque**2)[:, None],
            lambda: torque[:, None] * sine_columns(samples.theta, [1.0]),
            lambda: torque[:, None] * sine_columns(samples.theta, [2.0]),
        )
        columns = forms[int(shape["kind"]) % len(forms)]()
        trials = float(self.settings.load_forms)
        return Term(self.id, dict(shape), columns=columns, trials=trials, odds=self.settings.odds, doubtful=True)


class LateLoad(UnderLoad):
    """What gives way to the torque late, as of a joint that creeps: slower and slower towards what this torque leads
    to, from rest at the start of each recording.
    """

    id = "_late_in_torque"

    def lacks(self, samples: Conditions) -> str | None:
        return super().lacks(samples) or (None if samples.time is not None else "a time column")

    def search(self, probe: Probe) -> list[Term]:
        shapes = [{"lag_s": lag} for lag in lags(probe.samples, self.settings)]
        return best_terms(probe, terms_at(self, probe.samples, shapes))

    def term(self, samples: Conditions, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        s, lag = self.settings, within_reach(samples, shape["lag_s"], self.settings)
        column = lagging(samples, of_largest(samples.torque, len(samples)), lag)
        steps, trials = {"lag_s": s.lag_derivative * lag}, float(len(s.lags))
        return Term(
            self.id, {"lag_s": lag}, columns=column[:, None], steps=steps, trials=trials, odds=s.odds, doubtful=True
        )


class LoadInMotion(UnderLoad):
    """Torque, or its size, times the direction, the speed or its size: as of friction that grows with the load."""

    id = "_torque_in_motion"

    def lacks(self, samples: Conditions) -> str | None:
        if missing := super().lacks(samples):
            return missing
        return None if any(self._motions(samples)) else "an input that reverses or changes its speed"

    def search(self, probe: Probe) -> list[Term]:
        motions = [k for k, differs in enumerate(self._motions(probe.samples)) if differs]
        shapes = [{"load": float(load), "motion": float(k)} for load in range(len(LOADS)) for k in motions]
        return best_terms(probe, terms_at(self, probe.samples, shapes))

    def term(self, samples: Conditions, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        torque, speed = (of_largest(known, len(samples)) for known in (samples.torque, samples.speed))
        motion = (samples.direction, speed, np.abs(speed))[int(shape["motion"])]
        column = LOADS[int(shape["load"])](torque) * motion
        trials = float(len(LOADS) * sum(self._motions(samples)))
        odds = self.settings.odds
        return Term(self.id, dict(shape), columns=column[:, None], trials=trials, odds=odds, doubtful=True)

    def _motions(self, samples: Conditions) -> tuple[bool, bool, bool]:
        """Whether the direction, the speed and the size of the speed differ along `samples`, each from the others."""
        size = None if samples.locked or samples.speed is None else np.abs(samples.speed)
        changes = varies(size, self.settings.speed_levels)
        reverses = samples.reverses and not samples.locked
        return reverses, changes, changes and reverses
