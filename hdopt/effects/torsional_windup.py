"""Torsional compliance: the output winds up under torque.

Catalogues of strain wave gears (Harmonic Drive AG, CSF/CSG engineering data, "Torsional stiffness") approximate the
curve by three straight lines: stiffness K1 up to torque T1, K2 from T1 to T2, K3 above. Windup phi(T), odd in T: phi
= T/K1; T1/K1 + (T - T1)/K2; T1/K1 + (T2 - T1)/K2 + (T - T2)/K3. Compliance may vary with the wave generator's angle
(the meshing teeth turn with it): T/K (1 + c cos 2 theta + s sin 2 theta). Units: stiffness Nm/rad, knees Nm, torque
at the output. Prior: K 1e2 to 1e6 Nm/rad, knees inside the torque that was reached.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import ClassVar

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.geometry import ARCMIN, DriveGeometry
from hdopt.effects.base import Effect, Keys, terms_at
from hdopt.effects.conditions import Conditions
from hdopt.effects.declared import REQUIRED, Quantity, needed, number, polar, sine_and_cosine
from hdopt.effects.estimate import FitEstimate, Parameter
from hdopt.effects.probe import Probe, best_terms
from hdopt.effects.requirements import varying_torque
from hdopt.effects.term import Shape, Term
from hdopt.errors import HdoptError, MissingValue

COMPLIANCE = 1e-5
"""rad/Nm that a coefficient of one stands for: of order one for size-25 drives, in arcmin."""
KNEES = ("knee_1", "knee_2")


def _stiffness(i: int, meaning: str, default: object) -> Quantity:
    return Quantity(
        f"stiffness_{i}_nm_per_rad",
        "Nm/rad",
        meaning,
        f"K{i}",
        (1e2, 1e6),
        default,
        reported=f"stiffness_{i}",
        scale=1.0,
    )


def _knee(i: int) -> Quantity:
    meaning = f"torque from which stiffness_{i + 1} holds"
    return Quantity(f"knee_{i}_nm", "Nm", meaning, f"T{i}", default=None, above=0.0, reported=f"knee_{i}")


class TorsionalWindup(Effect):
    id = "torsional_windup"
    place = 40
    domain = "torque"
    separating = "hold the angle and sweep the torque both ways, or repeat the turns at two torques"
    needs: ClassVar[Mapping[str, str]] = {"torque": "output_torque_nm"}
    declared = (
        _stiffness(1, "below zero: the torque was counted the other way", REQUIRED),
        _stiffness(2, "above knee_1", None),
        _stiffness(3, "above knee_2", None),
        _knee(1),
        _knee(2),
        Quantity(
            "variation_over_turn",
            "1",
            "v of a compliance times 1 + v sin(2θ + phase), without knees",
            "v",
            (0.0, 1.0),
            None,
            at_least=0.0,
        ),
        Quantity("variation_phase_deg", "deg", "its phase", "φ", default=None),
    )
    examples = (
        {
            "stiffness_1_nm_per_rad": 31000.0,
            "stiffness_2_nm_per_rad": 50000.0,
            "stiffness_3_nm_per_rad": 57000.0,
            "knee_1_nm": 14.0,
            "knee_2_nm": 48.0,
        },
        {"stiffness_1_nm_per_rad": -31000.0, "variation_over_turn": 0.1, "variation_phase_deg": 25.0},
    )

    def lacks(self, conditions: Conditions) -> str | None:
        return varying_torque(conditions)

    def search(self, probe: Probe) -> Sequence[Term]:
        samples = probe.samples
        reached = float(np.quantile(np.abs(samples.known_torque), 0.99))
        terms = terms_at(self, samples, [{}, {"angle": True}])
        one = terms_at(self, samples, [{"knee_1": f * reached} for f in np.linspace(0.1, 0.9, 9)])
        best_one = best_terms(probe, one)[0]
        two = [
            {"knee_1": a * reached, "knee_2": b * reached}
            for a in (0.1, 0.2, 0.3, 0.45)
            for b in (0.4, 0.55, 0.7, 0.85)
            if b > a + 0.1
        ]
        return [*best_terms(probe, terms), best_one, *best_terms(probe, terms_at(self, samples, two))]

    def term(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        reached = float(np.max(np.abs(conditions.known_torque)))
        kept = {k: min(max(v, 0.02 * reached), 0.98 * reached) if k in KNEES else v for k, v in shape.items()}
        steps = {name: 0.01 * reached for name in KNEES if name in shape}
        return replace(self.predict(conditions, kept), steps=steps, trials=10.0 ** len(steps))

    def predict(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        """The term where a knee may lie beyond the torque that is reached."""
        torque = conditions.known_torque
        edges = [0.0, *sorted(shape[k] for k in KNEES if k in shape), np.inf]
        size, sign = np.abs(torque), np.sign(torque)
        parts = [sign * np.clip(size - low, 0, high - low) for low, high in itertools.pairwise(edges)]
        if "angle" in shape:
            parts += [torque * np.cos(2 * conditions.theta), torque * np.sin(2 * conditions.theta)]
        return Term(self.id, dict(shape), columns=np.column_stack(parts) * (COMPLIANCE / ARCMIN))

    def orders(self, shape: Shape, ratio: float) -> list[float]:
        return [2.0] if "angle" in shape else []

    def named_orders(self, shape: Shape, ratio: float) -> list[float]:
        return []

    def remark(self, shape: Shape, both_ways: bool) -> str | None:
        if "angle" in shape:
            return None
        return f"{self.id} only shifts the error here, since the operating condition is constant"

    def values(self, keys: Keys, gear: DriveGeometry) -> tuple[Shape, tuple[float, ...]]:
        stiffness = [number(keys, f"stiffness_{i}_nm_per_rad") for i in (1, 2, 3)]
        if 0.0 in stiffness:
            raise HdoptError(
                f"effects.{self.id} has a stiffness of 0; give one above 0, or below 0 for a torque counted the other "
                "way"
            )
        shape: dict[str, object] = {}
        compliances = [1 / (COMPLIANCE * needed(keys, "stiffness_1_nm_per_rad"))]
        for i in (1, 2):
            knee, beyond = number(keys, f"knee_{i}_nm"), stiffness[i]
            names = f"effects.{self.id}.knee_{i}_nm", f"effects.{self.id}.stiffness_{i + 1}_nm_per_rad"
            if (knee is None) != (beyond is None):
                raise MissingValue(*(names[::-1] if knee is None else names))
            if knee is not None and beyond is not None:
                shape[f"knee_{i}"] = knee
                compliances.append(1 / (COMPLIANCE * beyond))
        if "knee_2" in shape and needed(keys, "knee_2_nm") <= (number(keys, "knee_1_nm") or math.inf):
            raise HdoptError(
                f"effects.{self.id}.knee_2_nm is {needed(keys, 'knee_2_nm'):g}; it must lie above a knee_1_nm"
            )
        variation = sine_and_cosine(self.id, keys, "variation_over_turn", "variation_phase_deg")
        if variation is not None:
            if shape:
                raise HdoptError(f"effects.{self.id} has both knees and variation_over_turn; give one of them")
            shape["angle"] = True
            sine, cosine = (compliances[0] * c for c in variation)
            compliances += [cosine, sine]
        return shape, tuple(compliances)

    def keys(self, shape: Shape, coefficients: Sequence[float], gear: DriveGeometry) -> dict[str, object]:
        if "angle" in shape:
            first, cosine, sine = coefficients
            size, phase = polar(sine / first, cosine / first)
            return {
                "stiffness_1_nm_per_rad": 1 / (COMPLIANCE * first),
                "variation_over_turn": size,
                "variation_phase_deg": phase,
            }
        # A free fit may pass its knees in the other order: the stretches are of the knees in theirs.
        knees = sorted(shape[k] for k in KNEES if k in shape)
        found = {f"stiffness_{i + 1}_nm_per_rad": 1 / (COMPLIANCE * c) for i, c in enumerate(coefficients)}
        return found | {f"knee_{i + 1}_nm": knee for i, knee in enumerate(knees)}

    def parameters(self, term: Term, estimate: FitEstimate) -> dict[str, Parameter]:
        found = {}
        for i in range(1 + sum(k in term.shape for k in KNEES)):
            found[f"stiffness_{i + 1}"] = estimate.derived(partial(_stiffness_of, i), "Nm/rad")
        for at, name in enumerate(term.steps):
            found[name] = estimate.parameter(term.width + at, "Nm")
        if "angle" in term.shape:
            found["variation_over_turn"] = estimate.derived(lambda v: float(np.hypot(v[1], v[2]) / abs(v[0])), "1")
        return found

    def sentence(self, shape: Shape, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        text = ", ".join(f"{p.value:.3g} Nm/rad" for n, p in parameters.items() if n.startswith("stiffness"))
        knees = ", ".join(f"{p.value:.3g} Nm" for n, p in parameters.items() if n.startswith("knee"))
        return f"The output winds up under torque: stiffness {text}" + (f", knees at {knees}." if knees else ".")


def _stiffness_of(i: int, values: Array) -> float:
    """Stiffness (Nm/rad) of stretch `i` from the coefficients."""
    return float(1 / (COMPLIANCE * max(abs(values[i]), 1e-9)))
