"""Torsional compliance: the output winds up under torque.

Catalogues of strain wave gears (Harmonic Drive AG, CSF/CSG engineering data, "Torsional stiffness") approximate the
curve by three straight lines: stiffness K1 up to torque T1, K2 from T1 to T2, K3 above. Windup phi(T), odd in T: phi
= T/K1; T1/K1 + (T - T1)/K2; T1/K1 + (T2 - T1)/K2 + (T - T2)/K3. A curve
that bends smoothly is a cubic spring, T = K1 phi (1 + (K1 phi/Th)^2): Th is the torque of its linear part where the
cubic part carries as much. Compliance may vary with the wave generator's angle (the meshing teeth turn with it), the
whole curve alike: phi(T) (1 + c cos 2 theta + s sin 2 theta). Where the curve is straight, c/K and s/K are
coefficients; where it bends, c and s are of the shape.

Units: stiffness Nm/rad, knees and Th Nm, torque at the output. Prior: K 1e2 to 1e6 Nm/rad, knees inside the torque
that was reached, Th a hundredth of it to three times.
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
HARDENING, HARDENING_KEY = "hardening", "hardening_torque_nm"
"""Shape and study key of a curve that bends smoothly."""
HARDENING_RANGE = (0.01, 3.0)
"""Where it is looked for, of the torque that was reached: from 3, the curve is straight to 3 % at that torque."""
TURNS = ("cosine", "sine")
"""Shape of a compliance that varies over the turn beside knees: shares of the whole curve."""

TURN_STEP = 0.01
"""Step of a share of the curve, for its derivative."""


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
            HARDENING_KEY,
            "Nm",
            "of a curve without knees: torque of its linear part where its cubic part carries as much",
            "Th",
            default=None,
            above=0.0,
            reported="hardening",
        ),
        Quantity(
            "variation_over_turn",
            "1",
            "v of a compliance times 1 + v sin(2θ + phase)",
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
        {"stiffness_1_nm_per_rad": 31000.0, HARDENING_KEY: 30.0},
        {
            "stiffness_1_nm_per_rad": 31000.0,
            "stiffness_2_nm_per_rad": 50000.0,
            "knee_1_nm": 14.0,
            "variation_over_turn": 0.2,
            "variation_phase_deg": -40.0,
        },
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
        best_two = best_terms(probe, terms_at(self, samples, two))
        knees = [best_one, *best_two]
        if samples.locked:
            # It stands at one angle, and the friction ahead of the spring is written for a curve of straight lines.
            return [*best_terms(probe, terms), *knees]
        smooth = [{HARDENING: f * reached} for f in np.geomspace(*HARDENING_RANGE, 13)]
        bent = [*knees, *best_terms(probe, terms_at(self, samples, smooth))]
        return [*best_terms(probe, terms), *bent, *(self._turning(probe, term) for term in bent)]

    def _turning(self, probe: Probe, term: Term) -> Term:
        """`term`, whose curve bends, with the variation over the turn that suits its curve."""
        samples = probe.samples
        stretches = _stretches(samples.known_torque, term.shape)
        curve = stretches @ probe.solve(term)[1]
        turn = [curve * np.cos(2 * samples.theta), curve * np.sin(2 * samples.theta)]
        _, both = probe.solve(Term(self.id, {}, columns=np.column_stack([stretches, *turn])))
        return self.term(samples, {**term.shape, **dict(zip(TURNS, map(float, both[-2:]), strict=True))})

    def term(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        reached = float(np.max(np.abs(conditions.known_torque)))
        kept = {k: min(max(v, 0.02 * reached), 0.98 * reached) if k in KNEES else v for k, v in shape.items()}
        steps = {name: 0.01 * reached for name in KNEES if name in shape}
        if HARDENING in shape:
            kept[HARDENING] = float(
                np.clip(shape[HARDENING], HARDENING_RANGE[0] * reached, HARDENING_RANGE[1] * reached)
            )
            steps[HARDENING] = 0.01 * kept[HARDENING]
        steps |= {name: TURN_STEP for name in TURNS if name in shape}
        return replace(self.predict(conditions, kept), steps=steps, trials=10.0 ** len(steps))

    def predict(self, conditions: Conditions, shape: Shape, motion: Array | None = None) -> Term:
        """The term where a knee may lie beyond the torque that is reached."""
        columns = _stretches(conditions.known_torque, shape)
        if _varies(shape):
            twice = np.column_stack([np.cos(2 * conditions.theta), np.sin(2 * conditions.theta)])
            if "angle" in shape:
                columns = np.column_stack([columns, columns * twice])
            else:
                columns = columns * (1 + twice @ [shape[name] for name in TURNS])[:, None]
        return Term(self.id, dict(shape), columns=columns)

    def orders(self, shape: Shape, ratio: float) -> list[float]:
        return [2.0] if _varies(shape) else []

    def orders_of_columns(self, term: Term, ratio: float) -> list[float]:
        """None: they follow the torque."""
        return []

    def named_orders(self, shape: Shape, ratio: float) -> list[float]:
        return []

    def remark(self, shape: Shape, both_ways: bool) -> str | None:
        if _varies(shape):
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
        hardening = number(keys, HARDENING_KEY)
        if hardening is not None:
            if shape:
                raise HdoptError(f"effects.{self.id} has both knees and {HARDENING_KEY}; give one of them")
            shape[HARDENING] = hardening
        variation = sine_and_cosine(self.id, keys, "variation_over_turn", "variation_phase_deg")
        if variation is not None:
            sine, cosine = variation
            if shape:
                shape |= {"cosine": cosine, "sine": sine}
            else:
                shape["angle"] = True
                compliances += [compliances[0] * cosine, compliances[0] * sine]
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
        found: dict[str, object] = {
            f"stiffness_{i + 1}_nm_per_rad": 1 / (COMPLIANCE * c) for i, c in enumerate(coefficients)
        }
        found |= {f"knee_{i + 1}_nm": knee for i, knee in enumerate(knees)}
        if HARDENING in shape:
            found[HARDENING_KEY] = shape[HARDENING]
        if "cosine" in shape:
            size, phase = polar(shape["sine"], shape["cosine"])
            found |= {"variation_over_turn": size, "variation_phase_deg": phase}
        return found

    def parameters(self, term: Term, estimate: FitEstimate) -> dict[str, Parameter]:
        found = {}
        for i in range(1 + sum(k in term.shape for k in KNEES)):
            found[f"stiffness_{i + 1}"] = estimate.derived(partial(_stiffness_of, i), "Nm/rad")
        free = {name: term.width + at for at, name in enumerate(term.steps)}
        for name in (name for name in (*KNEES, HARDENING) if name in free):
            found[name] = estimate.parameter(free[name], "Nm")
        if "cosine" in free:
            found["variation_over_turn"] = estimate.amplitude(free["sine"], free["cosine"], "1")
        if "angle" in term.shape:
            found["variation_over_turn"] = estimate.derived(lambda v: float(np.hypot(v[1], v[2]) / abs(v[0])), "1")
        return found

    def sentence(self, shape: Shape, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        text = ", ".join(f"{p.value:.3g} Nm/rad" for n, p in parameters.items() if n.startswith("stiffness"))
        knees = ", ".join(f"{p.value:.3g} Nm" for n, p in parameters.items() if n.startswith("knee"))
        if HARDENING in parameters:
            text += f" about zero, stiffer from {parameters[HARDENING].value:.3g} Nm on"
        return f"The output winds up under torque: stiffness {text}" + (f", knees at {knees}." if knees else ".")


def _stretches(torque: Array, shape: Shape) -> Array:
    """Windup (arcmin, one column a stretch between the knees of `shape`) under `torque` (n,), Nm, at `COMPLIANCE`."""
    if HARDENING in shape:
        return smooth_windup(torque, shape[HARDENING])[:, None] * (COMPLIANCE / ARCMIN)
    edges = [0.0, *sorted(shape[k] for k in KNEES if k in shape), np.inf]
    size, sign = np.abs(torque), np.sign(torque)
    parts = [sign * np.clip(size - low, 0, high - low) for low, high in itertools.pairwise(edges)]
    return np.column_stack(parts) * (COMPLIANCE / ARCMIN)


def smooth_windup(torque: Array, hardening: float) -> Array:
    """Torque of the linear part, Nm, (n,), of a spring that carries `torque` (n,), Nm, and whose linear part carries
    `hardening`, Nm above 0, where its cubic part carries as much: x of x + x^3 = T / Th, times Th.
    """
    x = 2 / math.sqrt(3) * np.sinh(np.arcsinh(1.5 * math.sqrt(3) * torque / hardening) / 3)
    return np.asarray(hardening * x, np.float64)


def _varies(shape: Shape) -> bool:
    """Whether the compliance varies over the turn."""
    return "angle" in shape or "cosine" in shape


def _stiffness_of(i: int, values: Array) -> float:
    """Stiffness (Nm/rad) of stretch `i` from the coefficients."""
    return float(1 / (COMPLIANCE * max(abs(values[i]), 1e-9)))
