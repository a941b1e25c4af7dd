"""Thermal expansion of bench and drive: a slow drift.

It follows the recorded temperature, coefficient times (T - mean T), or, where none was recorded, the warming of one
thermal mass: A (1 - exp(-t/tau)) (lumped capacitance; Incropera, "Fundamentals of Heat and Mass Transfer", ch. 5).
Several recordings whose clocks each begin anew are those of a cold start each, or of one warming: then each begins as
warm as it happens to be, and warms by an amplitude of its own. Units: coefficient arcmin/K, amplitude arcmin, tau s.
Prior: tau from 1/20 of the record to 5 records, 2 arcmin/K.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.geometry import DriveGeometry
from hdopt.effects.base import Effect, Keys, terms_at
from hdopt.effects.conditions import Conditions
from hdopt.effects.declared import Quantity, needed, number
from hdopt.effects.estimate import FitEstimate, Parameter
from hdopt.effects.probe import Probe, best_terms
from hdopt.effects.requirements import varying_temperature
from hdopt.effects.term import Shape, Term
from hdopt.errors import HdoptError

OWN_STARTS = "own_starts"
"""Of a shape: each recording warms by an amplitude of its own, from where it happens to be."""


class ThermalDrift(Effect):
    id = "thermal_drift"
    place = 130
    domain = "time"
    separating = "record the temperature beside the angles, and once more after the bench has warmed through"
    bench_part = "the expansion of the bench, drive and bench together"
    nuisance = "drift"
    signed_by_error = ("coefficient_arcmin_per_k", "amplitude_arcmin")
    needs_said = "temperature; or time and speed"
    declared = (
        Quantity("coefficient_arcmin_per_k", "arcmin/K", "alone: it follows the temperature", "c", (-2.0, 2.0), None),
        Quantity("amplitude_arcmin", "arcmin", "or: what it warms to", "A", (-20.0, 20.0), None),
        Quantity("time_constant_s", "s", "of that", "τ", (1.0, 1e5), None, above=0.0),
    )
    examples = ({"coefficient_arcmin_per_k": 0.03}, {"amplitude_arcmin": 0.5, "time_constant_s": 60.0})

    def lacks(self, conditions: Conditions) -> str | None:
        if conditions.temperature is None and conditions.time is None:
            return "a time or temperature column"
        return None

    def search(self, probe: Probe) -> Sequence[Term]:
        samples = probe.samples
        found = []
        if varying_temperature(samples) is None:
            found.append(self.term(samples, {}))
        if samples.time is not None:
            duration = float(np.ptp(elapsed(samples)))
            shapes: list[Shape] = [{"time_constant_s": f * duration} for f in np.geomspace(0.05, 5, 12)]
            found += best_terms(probe, terms_at(self, samples, shapes))
            if not follow_each_other(samples):
                found += best_terms(probe, terms_at(self, samples, [{**shape, OWN_STARTS: True} for shape in shapes]))
        return found

    def term(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        if "time_constant_s" not in shape:
            temperature = conditions.known_temperature
            return Term(self.id, {}, columns=(temperature - temperature.mean())[:, None], odds=1.0)
        duration = float(np.ptp(conditions.known_time))
        tau = min(max(shape["time_constant_s"], 0.01 * duration), 10 * duration)
        since = elapsed(conditions)
        apart = shape.get(OWN_STARTS, False)
        return Term(
            self.id,
            {"time_constant_s": tau} | ({OWN_STARTS: True} if apart else {}),
            columns=left_to_warm(since, tau, conditions) if apart else warming(since, tau),
            steps={"time_constant_s": 0.02 * tau},
            trials=8.0,
        )

    def predict(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        """The term where `temperature` is the difference from the reference, and `time` counts from cold."""
        if "time_constant_s" not in shape:
            return Term(self.id, dict(shape), columns=conditions.known_temperature[:, None])
        return Term(self.id, dict(shape), columns=warming(conditions.known_time, shape["time_constant_s"]))

    def needs_of(self, shape: Shape) -> Mapping[str, str]:
        if "time_constant_s" in shape:
            return {"time": "time_s", "speed": "speed_rpm"}
        return {"temperature_difference": "temperature_difference_k"}

    def remark(self, shape: Shape, both_ways: bool) -> str | None:
        if "time_constant_s" in shape:
            return None
        return f"{self.id} only shifts the error here, since the operating condition is constant"

    def values(self, keys: Keys, gear: DriveGeometry) -> tuple[Shape, tuple[float, ...]]:
        coefficient = number(keys, "coefficient_arcmin_per_k")
        amplitude, tau = number(keys, "amplitude_arcmin"), number(keys, "time_constant_s")
        if coefficient is not None and amplitude is None and tau is None:
            return {}, (coefficient,)
        if coefficient is None and amplitude is not None and tau is not None:
            return {"time_constant_s": needed(keys, "time_constant_s")}, (amplitude,)
        raise HdoptError(
            f"effects.{self.id} follows either the temperature or time; give coefficient_arcmin_per_k alone, or "
            "amplitude_arcmin and time_constant_s"
        )

    def keys(self, shape: Shape, coefficients: Sequence[float], gear: DriveGeometry) -> dict[str, object]:
        if "time_constant_s" not in shape:
            return {"coefficient_arcmin_per_k": coefficients[0]}
        return {"amplitude_arcmin": coefficients[0], "time_constant_s": shape["time_constant_s"]}

    def parameters(self, term: Term, estimate: FitEstimate) -> dict[str, Parameter]:
        if "time_constant_s" not in term.shape:
            return {"coefficient_arcmin_per_k": estimate.parameter(0, "arcmin/K")}
        return {
            "amplitude_arcmin": estimate.parameter(0, "arcmin"),
            "time_constant_s": estimate.parameter(term.width, "s"),
        }

    def sentence(self, shape: Shape, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        if "coefficient_arcmin_per_k" in parameters:
            return f"The error follows the temperature, {parameters['coefficient_arcmin_per_k'].value:.2g} arcmin/K."
        drifts = (
            f"The error drifts by {parameters['amplitude_arcmin'].value:.2g} arcmin with a time constant of "
            f"{parameters['time_constant_s'].value:.3g} s, as of something warming up"
        )
        if shape.get(OWN_STARTS, False):
            return f"{drifts}, in the first recording; each of the others begins as warm as it happens to be."
        return f"{drifts}."


def warming(time: Array, time_constant: float) -> Array:
    """1 - exp(-t/tau) of `time` (n,) and `time_constant`, s: shape (n, 1): one thermal mass that warms up."""
    return np.asarray((1 - np.exp(-time / time_constant))[:, None])


def left_to_warm(time: Array, time_constant: float, conditions: Conditions) -> Array:
    """-exp(-t/tau) of `time` (n,) and `time_constant`, s, in each recording of the `conditions` (n rows, r recordings)
    by itself: shape (n, r). The coefficient of each is by how much it still warms; what all warm to is their zero."""
    own = conditions.record[:, None] == np.arange(conditions.records)
    return np.asarray(-np.exp(-time / time_constant)[:, None] * own)


def follow_each_other(conditions: Conditions) -> bool:
    """Whether the clock of the `conditions` goes on from each recording to the next; so it does where there is one."""
    time, record = conditions.known_time, conditions.record
    starts = [time[record == r][0] for r in range(conditions.records)]
    ends = [time[record == r][-1] for r in range(conditions.records)]
    return all(end <= start for end, start in zip(ends[:-1], starts[1:], strict=True))


def elapsed(conditions: Conditions) -> Array:
    """Time of the `conditions` (n,), s, since the start of the first recording where the recordings follow each other,
    else of each.
    """
    time, record = conditions.known_time, conditions.record
    starts = np.array([time[record == r][0] for r in range(conditions.records)])
    return np.asarray(time - (starts[0] if follow_each_other(conditions) else starts[record]))
