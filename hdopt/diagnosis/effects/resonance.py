"""Torsional resonance, excited by the drive's own kinematic error.

Output inertia on the drive's torsional spring, base-excited by the pure kinematic error y (Tuttle and Seering, IEEE
Trans. Robotics and Automation 12 (1996) 368; any text on vibration, e.g. Den Hartog, ch. 2). A share b of the damping
acts on the output's speed (bearing, load), the rest across the spring: the recorded error is x = (2 zeta (1 - b) w s +
w^2)/(s^2 + 2 zeta w s + w^2) y, so what is missing is x - y = -(s^2 + b 2 zeta w s)/(s^2 + 2 zeta w s + w^2) y, whose
amplitude and phase at every order follow speed through one frequency. Units: frequency Hz, damping ratio 1, gain 1 (1
where the whole inertia takes part), share of the damping 1. Prior: frequency within reach of orders 1 to 20 at the
recorded speeds, zeta 0.005 to 0.5.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from hdopt.diagnosis.effect import Term, best_terms
from hdopt.recording import TURN


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
            self.term(samples, {"frequency_hz": f, "damping_ratio": z}, probe.base_value)
            for f in frequencies
            for z in (0.03, 0.12)
        ]
        best = best_terms(probe, coarse)[0].shape
        fine = [
            self.term(samples, {"frequency_hz": best["frequency_hz"] * f, "damping_ratio": z}, probe.base_value)
            for f in (0.95, 0.975, 1.0, 1.025, 1.05)
            for z in (0.015, 0.03, 0.06, 0.12, 0.25)
        ]
        return best_terms(probe, fine)

    def term(self, samples, shape, base_value=None):
        frequency, damping = max(shape["frequency_hz"], 1e-3), min(max(shape["damping_ratio"], 2e-3), 0.9)
        return Term(
            self.id,
            {"frequency_hz": frequency, "damping_ratio": damping},
            columns=relative_responses(samples, base_value, frequency, damping),
            steps={"frequency_hz": 0.003 * frequency, "damping_ratio": 0.05 * damping},
            trials=40.0,
        )

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


def relative_responses(samples, excitation, frequency, damping):
    """x - y for excitation y (arcmin) along the rows' times, (n, 2): e'' + 2 zeta w e' + w^2 e = -y'' with all damping
    across the spring, and = -2 zeta w y', what is added where all of it acts on the output.

    Integrated on an even clock in each contiguous piece by Tustin's rule, prewarped at the resonance.
    """
    from scipy.signal import lfilter

    result = np.zeros((len(samples), 2))
    w = TURN * frequency
    bounds = np.r_[0, np.flatnonzero(np.diff(samples.piece)) + 1, len(samples)]
    for start, end in itertools.pairwise(bounds):
        time = samples.time[start:end]
        if end - start < 8:
            continue
        steps = np.diff(time)
        step = min(float(np.median(steps)), 1 / (12 * frequency))
        count = int(min(max((time[-1] - time[0]) / step, 8), 400_000))
        even = np.linspace(time[0], time[-1], count)
        step = even[1] - even[0]
        if w * step > 2.5:
            continue
        y = np.interp(even, time, excitation[start:end])
        k = w / math.tan(w * step / 2)
        denominator = np.array(
            [k * k + 2 * damping * w * k + w * w, 2 * w * w - 2 * k * k, k * k - 2 * damping * w * k + w * w]
        )
        forces = k * k * np.array([1.0, -2.0, 1.0]), 2 * damping * w * k * np.array([1.0, 0.0, -1.0])
        for column, force in enumerate(forces):
            e = lfilter(-force / denominator[0], denominator / denominator[0], y - y[0])
            result[start:end, column] = np.interp(time, even, e)
    return result


def settled_responses(time, excitation, frequency, damping):
    """x - y as in `relative_responses`, for an excitation (arcmin, n) that repeats after these n even times, s.

    The same equations for a sine of the circular frequency s: E = s^2/(w^2 - s^2 + 2 i zeta w s) Y, and -2 i zeta w s
    in place of s^2.
    """
    n, w = len(time), TURN * frequency
    s = TURN * np.fft.rfftfreq(n, time[1] - time[0])
    response = np.fft.rfft(excitation) / (w**2 - s**2 + 2j * damping * w * s)
    return np.column_stack([np.fft.irfft(force * response, n) for force in (s**2, -2j * damping * w * s)])
