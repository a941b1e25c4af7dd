"""Torsional resonance, excited by the motion of the spring's foot: the drive's own error, and every change of speed.

Output inertia on the drive's torsional spring (Tuttle and Seering, IEEE Trans. Robotics and Automation 12 (1996) 368;
any text on vibration, e.g. Den Hartog, ch. 2). The foot moves by theta/N - y, y the pure kinematic error: that of the
model with whatever else its teeth and bearing add, as far as it is fitted beside. A share b of the damping acts on the
output's speed (bearing, load), the rest across the spring: the output follows the foot by G = (2 zeta (1 - b) w s +
w^2)/(s^2 + 2 zeta w s + w^2), the recorded error is theta/N - G (theta/N - y), and what is missing is (G - 1)(y -
theta/N) with G - 1 = -(s^2 + b 2 zeta w s)/(s^2 + 2 zeta w s + w^2). Amplitude and phase at every order follow speed
through one frequency; at a steady acceleration a of theta/N the output lags by a/w^2; a steady speed does nothing but
wind up the damper on the output. Where the input's own changes of speed do not reach the spring (a soft coupling before
it, or an error that was computed), y alone excites: the other kind of foot. Units: frequency Hz, damping ratio 1, gain
1 (1 where the whole inertia takes part), share of the damping 1. Prior: 1 Hz to 2 kHz (a size 25's 3.1e4 Nm/rad with
1e-4 to 800 kg m^2), zeta 0.002 to 0.3, gain 0.7 to 1.3.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import ClassVar

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.geometry import DriveGeometry
from hdopt.effects._oscillator import changes_of_speed, relative_responses, settled_drag, settled_responses
from hdopt.effects.base import Effect, Keys
from hdopt.effects.conditions import TURN, Conditions
from hdopt.effects.declared import Category, Quantity, needed
from hdopt.effects.estimate import FitEstimate, Parameter
from hdopt.effects.prior import outside_prior
from hdopt.effects.probe import Probe, best_terms
from hdopt.effects.term import Shape, Term

TRIALS = 40.0
"""Different shapes that a search looks at, for each kind of foot."""
HIGHEST_HZ = 2e3
"""Of a drive's output on its spring."""
MOST_DAMPING = 0.3
"""Of critical: above it nothing swings."""
MOST_GAIN = 1.3
"""The whole inertia, and what a gain is off by."""
SURE = 2.0
"""Intervals by which a part of the damping must be neither none nor all of it."""
EACH = np.eye(2)
"""The two columns, alone."""
LEAST_SPEED_RANGE = 1.15
"""Highest over lowest speed from which a frequency in Hz shows."""


class Foot(StrEnum):
    """What moves the foot of the spring."""

    WHOLE_MOTION = "whole_motion"
    ERROR = "error"


class Resonance(Effect):
    id = "resonance"
    place = 140
    domain = "speed"
    needs_base = True
    driven = True
    has_parts = True
    acts = "beside, excited by KE with all effects of teeth and bearing"
    bench_part = "the inertia that the bench hangs on the drive"
    needs: ClassVar[Mapping[str, str]] = {"speed": "speed_rpm"}
    separating = (
        "run up slowly through the speed range, or repeat at three speeds: a resonance stays at one frequency in Hz"
    )
    declared = (
        Quantity(
            "frequency_hz", "Hz", "of the output's inertia on the drive's spring", "f", (1.0, HIGHEST_HZ), above=0.0
        ),
        Quantity("damping_ratio", "1", "of critical", "ζ", (0.002, MOST_DAMPING), above=0.0, below=1.0),
        Quantity("gain", "1", "1: the whole inertia takes part", "g", (0.7, MOST_GAIN), 1.0),
        Quantity(
            "output_share_of_damping",
            "1",
            "part of the damping that acts on the output, not across the spring",
            "b",
            default=0.0,
        ),
        Category("foot", Foot, "what swings it: also changes of speed, or the error alone", default=Foot.WHOLE_MOTION),
    )
    examples = (
        {"frequency_hz": 3.0, "damping_ratio": 0.05, "gain": 0.9, "output_share_of_damping": 0.4},
        {"frequency_hz": 5.0, "damping_ratio": 0.02, "foot": "error"},
    )

    def lacks(self, conditions: Conditions) -> str | None:
        if conditions.time is None or conditions.speed is None:
            return "a time column"
        low, high = np.quantile(np.abs(conditions.speed), [0.05, 0.95])
        return "speeds that differ by more than 15 %" if high < LEAST_SPEED_RANGE * max(low, 1e-9) else None

    def search(self, probe: Probe) -> Sequence[Term]:
        samples = probe.samples
        low, high = np.quantile(np.abs(samples.known_speed), [0.1, 0.95]) / TURN
        frequencies = np.geomspace(max(0.8 * low, 0.05 * high), 16 * high, 36)
        return best_terms(probe, [self._of_foot(probe, frequencies, foot) for foot in Foot], len(Foot))

    def _of_foot(self, probe: Probe, frequencies: Array, foot: Foot) -> Term:
        """The best resonance with this kind of foot, on a grid of `frequencies` and finer around its best."""

        def at(frequency: float, damping: float) -> Term:
            shape = {"frequency_hz": frequency, "damping_ratio": damping, "foot": foot}
            return self.term(probe.samples, shape, probe.motion)

        best = best_terms(probe, [at(f, z) for f in frequencies for z in (0.03, 0.12)])[0].shape["frequency_hz"]
        fine = [at(best * f, z) for f in (0.95, 0.975, 1.0, 1.025, 1.05) for z in (0.015, 0.03, 0.06, 0.12, 0.25)]
        return best_terms(probe, fine)[0]

    def term(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        frequency, damping = max(shape["frequency_hz"], 1e-3), min(max(shape["damping_ratio"], 2e-3), 0.9)
        foot = shape.get("foot", Foot.ERROR)
        excitation, drag = self._excitation(motion), np.zeros(len(conditions))
        if foot is Foot.WHOLE_MOTION:
            changes, rate = changes_of_speed(conditions)
            excitation, drag = excitation + changes, settled_drag(rate, frequency, damping)
        columns = relative_responses(conditions, excitation[:, None], frequency, damping, EACH)[:, 0]
        columns[:, 1] += drag
        return Term(
            self.id,
            {"frequency_hz": frequency, "damping_ratio": damping, "foot": foot},
            columns=columns,
            steps={"frequency_hz": 0.003 * frequency, "damping_ratio": 0.05 * damping},
            trials=TRIALS if foot is Foot.ERROR else len(Foot) * TRIALS,
        )

    def every_part_shows(self, term: Term, estimate: FitEstimate) -> bool:
        """Whether its numbers may be those of an inertia on a spring: with a gain of nothing and a drag instead, or a
        damping that lets nothing swing, it bends to a delay, a drift or a loop. A damping need not be so certainly:
        what does not swing shows no damping either, and its interval holds every one.
        """
        outside = outside_prior(self, self.parameters(term, estimate))
        return not any(one.certainly or one.name == "damping_ratio" for one in outside)

    def may_imitate(self, term: Term, estimate: FitEstimate) -> bool:
        """Whether what drags is besides a part of its damping, of 0 to 1, and of an inertia of a gain that drives
        have.
        """
        drag = estimate.parameter(1, "1")
        return drag.low <= MOST_GAIN and drag.high >= 0 and self.every_part_shows(term, estimate)

    def may_be_part_of(self, parameters: Mapping[str, Parameter]) -> tuple[str, ...]:
        """A delay, where the damping would act on the output in part: what drags it lags by 2 zeta b/w as well."""
        share = parameters["output_share_of_damping"]
        low, high = (share.value + SURE * (end - share.value) for end in (share.low, share.high))
        return ("channel_delay",) if low > 0 and high < 1 else ()

    def beyond_search(self, probe: Probe) -> Sequence[Term]:
        """Stiff ones, that swing too fast to be seen and only drag, as a delay does."""
        lowest = 16 * float(np.quantile(np.abs(probe.samples.known_speed), 0.95)) / TURN
        shapes = [
            {"frequency_hz": float(f), "damping_ratio": MOST_DAMPING, "foot": Foot.WHOLE_MOTION}
            for f in np.geomspace(lowest, max(HIGHEST_HZ, lowest), 12)
        ]
        return [self.term(probe.samples, shape, probe.motion) for shape in shapes]

    def _excitation(self, motion: Array | None) -> Array:
        if motion is None:
            raise ValueError(f"{self.id} follows the drive's motion, which was not given")
        return motion

    def response(self, conditions: Conditions, shape: Shape, coefficients: Array, motions: Array) -> Array:
        """What the term adds at these coefficients where each of the columns `motions` (n, k) excites it."""
        frequency, damping = shape["frequency_hz"], shape["damping_ratio"]
        return relative_responses(conditions, motions, frequency, damping, coefficients[:, None])[:, :, 0]

    def predict(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        """The term at constant speed once the start has died away; the rows are one whole period, even in time."""
        excitation = self._excitation(motion)
        columns = settled_responses(conditions.known_time, excitation, shape["frequency_hz"], shape["damping_ratio"])
        return Term(self.id, dict(shape), columns=columns)

    def remark(self, shape: Shape, both_ways: bool) -> str | None:
        if both_ways:
            return f"{self.id} is that of steady running in each direction, without what a reversal stirs up"
        return None

    def values(self, keys: Keys, gear: DriveGeometry) -> tuple[Shape, tuple[float, ...]]:
        shape: dict[str, object] = {name: needed(keys, name) for name in ("frequency_hz", "damping_ratio")}
        shape["foot"] = Foot(str(keys["foot"]))
        gain = needed(keys, "gain")
        return shape, (gain, gain * needed(keys, "output_share_of_damping"))

    def keys(self, shape: Shape, coefficients: Sequence[float], gear: DriveGeometry) -> dict[str, object]:
        return {
            "frequency_hz": shape["frequency_hz"],
            "damping_ratio": shape["damping_ratio"],
            "gain": coefficients[0],
            "output_share_of_damping": coefficients[1] / coefficients[0],
            "foot": str(shape["foot"]),
        }

    def parameters(self, term: Term, estimate: FitEstimate) -> dict[str, Parameter]:
        return {
            "gain": estimate.parameter(0, "1"),
            "output_share_of_damping": estimate.derived(lambda v: float(v[1] / v[0]), "1"),
            "frequency_hz": estimate.parameter(2, "Hz"),
            "damping_ratio": estimate.parameter(3, "1"),
        }

    def sentence(self, shape: Shape, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        excites = "own error" if shape.get("foot") is Foot.ERROR else "motion, its error and its changes of speed,"
        return (
            f"The drive's {excites} excites a torsional resonance at {parameters['frequency_hz'].value:.3g} Hz "
            f"(damping ratio {parameters['damping_ratio'].value:.2g})."
        )
