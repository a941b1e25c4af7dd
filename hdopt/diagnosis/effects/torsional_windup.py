"""Torsional compliance: the output winds up under torque.

Catalogues of strain wave gears (Harmonic Drive AG, CSF/CSG engineering data, "Torsional stiffness") approximate the
curve by three straight lines: stiffness K1 up to torque T1, K2 from T1 to T2, K3 above. Windup phi(T), odd in T: phi
= T/K1; T1/K1 + (T - T1)/K2; T1/K1 + (T2 - T1)/K2 + (T - T2)/K3. Compliance may vary with the wave generator's angle
(the meshing teeth turn with it): T/K (1 + c cos 2 theta + s sin 2 theta). Units: stiffness Nm/rad, knees Nm, torque
at the output. Prior: K 1e2 to 1e6 Nm/rad, knees inside the torque that was reached.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from hdopt.diagnosis.effect import Term, best_terms, terms_at
from hdopt.drive import ARCMIN

COMPLIANCE = 1e-5
"""rad/Nm that a coefficient of one stands for."""


class TorsionalWindup:
    id = "torsional_windup"
    domain = "torque"
    needs_base = False
    separating = "hold the angle and sweep the torque both ways, or repeat the turns at two torques"

    def lacks(self, samples):
        if samples.torque is None:
            return "a torque column"
        if np.std(samples.torque) <= 0.02 * np.max(np.abs(samples.torque)) or np.std(samples.torque) == 0:
            return "torque that varies"
        return None

    def search(self, probe):
        samples = probe.samples
        reached = float(np.quantile(np.abs(samples.torque), 0.99))
        terms = terms_at(self, samples, [{}, {"angle": 1.0}])
        one = terms_at(self, samples, [{"knee_1": f * reached} for f in np.linspace(0.1, 0.9, 9)])
        best_one = best_terms(probe, one)[0]
        two = [
            {"knee_1": a * reached, "knee_2": b * reached}
            for a in (0.1, 0.2, 0.3, 0.45)
            for b in (0.4, 0.55, 0.7, 0.85)
            if b > a + 0.1
        ]
        return [*best_terms(probe, terms), best_one, *best_terms(probe, terms_at(self, samples, two))]

    def term(self, samples, shape, base_value=None):
        reached = float(np.max(np.abs(samples.torque)))
        shape = {
            k: min(max(v, 0.02 * reached), 0.98 * reached) if k.startswith("knee") else v for k, v in shape.items()
        }
        steps = {name: 0.01 * reached for name in ("knee_1", "knee_2") if name in shape}
        return replace(self.unbounded(samples, shape), steps=steps, trials=10.0 ** len(steps))

    def unbounded(self, samples, shape, base_value=None):
        """The term where a knee may lie beyond the torque that is reached."""
        torque = samples.torque
        knees = sorted(shape[k] for k in ("knee_1", "knee_2") if k in shape)
        edges = [0.0, *knees, np.inf]
        size, sign = np.abs(torque), np.sign(torque)
        parts = [sign * np.clip(size - low, 0, high - low) for low, high in itertools.pairwise(edges)]
        if "angle" in shape:
            parts += [torque * np.cos(2 * samples.theta), torque * np.sin(2 * samples.theta)]
        # In arcmin for a compliance in rad/Nm scaled by 1e-5: coefficients of order one for size-25 drives.
        columns = np.column_stack(parts) * (COMPLIANCE / ARCMIN)
        return Term(self.id, dict(shape), columns=columns)

    def parameters(self, term, estimate):
        segments = 1 + ("knee_1" in term.shape) + ("knee_2" in term.shape)
        found = {}
        for i in range(segments):
            stiffness = estimate.derived(lambda v, i=i: 1 / (COMPLIANCE * max(abs(v[i]), 1e-9)), "Nm/rad")
            found[f"stiffness_{i + 1}"] = stiffness
        free = list(term.steps)
        for name in free:
            found[name] = estimate.parameter(term.width + free.index(name), "Nm")
        if "angle" in term.shape:
            found["variation_over_turn"] = estimate.derived(lambda v: float(np.hypot(v[1], v[2]) / abs(v[0])), "1")
        return found

    def sentence(self, parameters, rms_arcmin):
        text = ", ".join(f"{p.value:.3g} Nm/rad" for n, p in parameters.items() if n.startswith("stiffness"))
        knees = ", ".join(f"{p.value:.3g} Nm" for n, p in parameters.items() if n.startswith("knee"))
        return f"The output winds up under torque: stiffness {text}" + (f", knees at {knees}." if knees else ".")
