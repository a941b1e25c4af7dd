"""What is off about a recording, or a drive as built, and is told: a scale, two clocks, a new zero, a contact."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.alternatives.base import Alternative
from hdopt.drive.geometry import ARCMIN
from hdopt.effects.conditions import Conditions, varies
from hdopt.effects.estimate import FitEstimate
from hdopt.effects.probe import Probe, best_terms
from hdopt.effects.term import Shape, Term


class Scale(Alternative):
    """A ratio that is not quite the one given, or an encoder whose count is not quite a turn: an error in proportion to
    the input angle. No physics of the drive, and no sign of something unknown: it is told as what it is.
    """

    id = "_scale"
    domain = "time"
    exact_shape = True

    def lacks(self, samples: Conditions) -> str | None:
        least = self.settings.scale_turns
        return None if not samples.locked and samples.span_turns >= least else f"at least {least:g} input turns"

    def search(self, probe: Probe) -> list[Term]:
        return [self.term(probe.samples, {})]

    def term(self, samples: Conditions, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        """The column is in arcmin for an error of one per rad of input."""
        columns = (samples.theta - samples.theta.mean())[:, None] / ARCMIN
        return Term(self.id, {}, columns=columns, odds=self.settings.scale_odds)


class Skew(Alternative):
    """Two clocks that run apart: a delay between the channels that grows with time. Where it does not grow it is an
    effect, `channel_delay`; at one speed one way it is a scale.
    """

    id = "_skew"
    domain = "time"
    exact_shape = True

    def lacks(self, samples: Conditions) -> str | None:
        if samples.locked or samples.speed is None or samples.time is None:
            return "time and speed"
        return None if varies(samples.speed, self.settings.speed_levels) else "speed that varies"

    def reads_input(self, shape: Shape) -> bool:
        return True

    def search(self, probe: Probe) -> list[Term]:
        return [self.term(probe.samples, {})]

    def term(self, samples: Conditions, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        """The column is in arcmin for a delay that grows by one second a second."""
        time = samples.known_time
        columns = ((time - time[0]) * samples.known_speed / samples.ratio / ARCMIN)[:, None]
        return Term(self.id, {}, columns=columns, odds=self.settings.skew_odds)


class NewZero(Alternative):
    """Recordings of which one or more were begun with a zero of their own, a little off the first's: larger ones are
    seen before anything is fitted, and are always free.
    """

    id = "_zero"
    domain = "time"
    exact_shape = True
    aside = True

    def lacks(self, samples: Conditions) -> str | None:
        return None if samples.records > 1 else "two recordings"

    def search(self, probe: Probe) -> list[Term]:
        return [self.term(probe.samples, {})]

    def term(self, samples: Conditions, shape: Mapping[str, float], motion: Array | None = None) -> Term:
        """The columns are in arcmin, one for each recording but the first. What differs from recording to recording by
        direction, speed or load is an effect's first.
        """
        columns = (samples.record[:, None] == np.arange(1, samples.records)).astype(float)
        return Term(self.id, {}, columns=columns, odds=self.settings.zero_odds, doubtful=True)


class VaryingContact(Alternative):
    """A k_e that varies round the input's turn, as the number of teeth in mesh does where the wave generator's two ends
    differ: the drive's own error, larger and smaller with the input angle. Drives as built are so, and it is told.
    """

    id = "_varying_contact"
    domain = "angle"
    needs_base = True
    exact_shape = True
    aside = True
    has_parts = True
    driven = True
    at_once = True

    def lacks(self, samples: Conditions) -> str | None:
        least = self.settings.least_turns
        return None if not samples.locked and samples.span_turns >= least else f"at least {least:g} input turns"

    def search(self, probe: Probe) -> list[Term]:
        shapes = [{"waves": float(waves)} for waves in range(1, self.settings.contact_waves + 1)]
        return best_terms(probe, [self.term(probe.samples, shape, probe.motion) for shape in shapes])

    def term(self, samples: Conditions, shape: Mapping[str, float], motion: Array | None = None) -> Term:
        """The columns are in arcmin for a share of one: sine and cosine of each of 1 to `waves` waves a turn."""
        if motion is None:
            raise ValueError(f"{self.id} follows the drive's motion, which was not given")
        columns = motion[:, None] * self._waves(samples, shape)
        return Term(self.id, dict(shape), columns=columns, odds=self.settings.contact_odds)

    def every_part_shows(self, term: Term, estimate: FitEstimate) -> bool:
        """Whether it is no more than a contact varies."""
        return bool(np.abs(estimate.values[: term.width]).max() < self.settings.contact_most)

    def response(self, conditions: Conditions, shape: Shape, coefficients: Array, motions: Array) -> Array:
        return motions * (self._waves(conditions, shape) @ coefficients)[:, None]

    def _waves(self, samples: Conditions, shape: Shape) -> Array:
        return samples.waves_of_input(int(shape["waves"]))
