"""Thermal expansion of bench and drive: a slow drift.

It follows the recorded temperature, coefficient times (T - mean T), or, where none was recorded, the warming of one
thermal mass: A (1 - exp(-t/tau)) (lumped capacitance; Incropera, "Fundamentals of Heat and Mass Transfer", ch. 5).
Units: coefficient arcmin/K, amplitude arcmin, tau s. Prior: tau from 1/20 of the record to 5 records.
"""

from __future__ import annotations

import numpy as np

from hdopt.diagnosis.effect import Term, best_terms, terms_at


class ThermalDrift:
    id = "thermal_drift"
    domain = "time"
    needs_base = False
    separating = "record the temperature beside the angles, and once more after the bench has warmed through"

    def lacks(self, samples):
        if samples.temperature is None and samples.time is None:
            return "a time or temperature column"
        return None

    def search(self, probe):
        samples = probe.samples
        found = []
        if samples.temperature is not None and np.ptp(samples.temperature) > 0.02:
            found.append(self.term(samples, {}))
        if samples.time is not None:
            duration = float(np.ptp(elapsed(samples)))
            shapes = [{"time_constant_s": f * duration} for f in np.geomspace(0.05, 5, 12)]
            found += best_terms(probe, terms_at(self, samples, shapes))
        return found

    def term(self, samples, shape, base_value=None):
        if "time_constant_s" not in shape:
            return Term(self.id, {}, columns=(samples.temperature - samples.temperature.mean())[:, None], odds=1.0)
        duration = float(np.ptp(samples.time))
        tau = min(max(shape["time_constant_s"], 0.01 * duration), 10 * duration)
        return Term(
            self.id,
            {"time_constant_s": tau},
            columns=warming(elapsed(samples), tau),
            steps={"time_constant_s": 0.02 * tau},
            trials=8.0,
        )

    def unbounded(self, samples, shape, base_value=None):
        """The term where `temperature` is the difference from the reference, and `time` counts from cold."""
        tau = shape.get("time_constant_s")
        columns = samples.temperature[:, None] if tau is None else warming(samples.time, tau)
        return Term(self.id, dict(shape), columns=columns)

    def parameters(self, term, estimate):
        if "time_constant_s" not in term.shape:
            return {"coefficient_arcmin_per_k": estimate.parameter(0, "arcmin/K")}
        return {"amplitude_arcmin": estimate.parameter(0, "arcmin"), "time_constant_s": estimate.parameter(1, "s")}

    def sentence(self, parameters, rms_arcmin):
        if "coefficient_arcmin_per_k" in parameters:
            return f"The error follows the temperature, {parameters['coefficient_arcmin_per_k'].value:.2g} arcmin/K."
        return (
            f"The error drifts by {parameters['amplitude_arcmin'].value:.2g} arcmin with a time constant of "
            f"{parameters['time_constant_s'].value:.3g} s, as of something warming up."
        )


def warming(time, time_constant):
    """1 - exp(-t/tau), shape (n, 1): one thermal mass that warms up."""
    return (1 - np.exp(-time / time_constant))[:, None]


def elapsed(samples):
    """Time since the start of the first recording where the recordings follow each other, else of each recording."""
    starts = [samples.time[samples.record == r][0] for r in range(samples.records)]
    ends = [samples.time[samples.record == r][-1] for r in range(samples.records)]
    follow = all(end <= start for end, start in zip(ends[:-1], starts[1:], strict=True))
    return samples.time - (starts[0] if follow else np.array(starts)[samples.record])
