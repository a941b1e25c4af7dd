"""Torsional resonance, excited by the drive's own kinematic error.

Output inertia on the drive's torsional spring, base-excited by the pure kinematic error y (Tuttle and Seering, IEEE
Trans. Robotics and Automation 12 (1996) 368; any text on vibration, e.g. Den Hartog, ch. 2): that of the model with
whatever else its teeth and bearing add, as far as it is fitted beside. A share b of the damping acts on the output's
speed (bearing, load), the rest across the spring: the recorded error is x = (2 zeta (1 - b) w s + w^2)/(s^2 +
2 zeta w s + w^2) y, so what is missing is x - y = -(s^2 + b 2 zeta w s)/(s^2 + 2 zeta w s + w^2) y, whose amplitude and
phase at every order follow speed through one frequency. Units: frequency Hz, damping ratio 1, gain 1 (1 where the whole
inertia takes part), share of the damping 1. Prior: frequency within reach of orders 1 to 20 at the recorded speeds,
zeta 0.005 to 0.5.
"""

from __future__ import annotations

import numpy as np

from hdopt.diagnosis.effect import Term, best_terms
from hdopt.diagnosis.effects._oscillator import relative_responses, settled_responses
from hdopt.recording import TURN

EACH = np.eye(2)
"""The two columns, alone."""


class Resonance:
    id = "resonance"
    domain = "speed"
    needs_base = True
    separating = (
        "run up slowly through the speed range, or repeat at three speeds: a resonance stays at one frequency in Hz"
    )

    def lacks(self, samples):
        if samples.time is None or samples.speed is None:
            return "a time column"
        low, high = np.quantile(np.abs(samples.speed), [0.05, 0.95])
        if high < 1.15 * max(low, 1e-9):
            return "speeds that differ by more than 15 %"
        return None

    def search(self, probe):
        samples = probe.samples
        low, high = np.quantile(np.abs(samples.speed), [0.1, 0.95]) / TURN
        frequencies = np.geomspace(max(0.8 * low, 0.05 * high), 16 * high, 36)
        coarse = [
            self.term(samples, {"frequency_hz": f, "damping_ratio": z}, probe.motion)
            for f in frequencies
            for z in (0.03, 0.12)
        ]
        best = best_terms(probe, coarse)[0].shape
        fine = [
            self.term(samples, {"frequency_hz": best["frequency_hz"] * f, "damping_ratio": z}, probe.motion)
            for f in (0.95, 0.975, 1.0, 1.025, 1.05)
            for z in (0.015, 0.03, 0.06, 0.12, 0.25)
        ]
        return best_terms(probe, fine)

    def term(self, samples, shape, base_value=None):
        frequency, damping = max(shape["frequency_hz"], 1e-3), min(max(shape["damping_ratio"], 2e-3), 0.9)
        return Term(
            self.id,
            {"frequency_hz": frequency, "damping_ratio": damping},
            columns=relative_responses(samples, base_value[:, None], frequency, damping, EACH)[:, 0],
            steps={"frequency_hz": 0.003 * frequency, "damping_ratio": 0.05 * damping},
            trials=40.0,
        )

    def response(self, samples, shape, coefficients, motions):
        """What the term adds at these coefficients where each of the columns `motions` (n, k) excites it."""
        weights = coefficients[:, None]
        return relative_responses(samples, motions, shape["frequency_hz"], shape["damping_ratio"], weights)[:, :, 0]

    def steady_state(self, samples, shape, base_value):
        """The term at constant speed once the start has died away; the rows are one whole period, even in time."""
        columns = settled_responses(samples.time, base_value, shape["frequency_hz"], shape["damping_ratio"])
        return Term(self.id, dict(shape), columns=columns)

    def parameters(self, term, estimate):
        return {
            "gain": estimate.parameter(0, "1"),
            "output_share_of_damping": estimate.derived(lambda v: v[1] / v[0], "1"),
            "frequency_hz": estimate.parameter(2, "Hz"),
            "damping_ratio": estimate.parameter(3, "1"),
        }

    def sentence(self, parameters, rms_arcmin):
        return (
            f"The drive's own error excites a torsional resonance at {parameters['frequency_hz'].value:.3g} Hz "
            f"(damping ratio {parameters['damping_ratio'].value:.2g})."
        )
