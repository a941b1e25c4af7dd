"""Circular-spline tooth deviation that is not one sine round the rim.

Jia 2021, Eqs. (31a), (31b) take the long-wave tangential composite deviation as a_CS sin(theta + phi); cumulative pitch
deviation of a real gear (ISO 1328-1, F_p) has further harmonics a_h sin(h theta + phi_h), h = 2, 3, ... Each zone meets
them at its own angle; even ones act directly, odd ones through the change of the driving zone. Jia 2021, Sec. 5, names
this as a cause of the mismatch with its own rig. Units: amplitude um of arc at the pitch line, prior 0 to 10 um.
"""

from __future__ import annotations

import numpy as np

from hdopt.diagnosis.effect import Term, terms_at, widest_that_pays
from hdopt.diagnosis.effects._zone_harmonics import zone_harmonics

SETS = ((2,), (3,), *(tuple(range(2, k + 1)) for k in (3, 4, 5, 8, 14, 24, 40)))


class CircularSplineToothHarmonics:
    id = "cs_tooth_harmonics"
    domain = "order"
    needs_base = True
    separating = (
        "turn the circular spline in its housing by a quarter turn and record again: its tooth errors turn with it, "
        "the housing's clamping does not"
    )
    spline = "circular spline"

    def lacks(self, samples):
        return None if samples.span_turns >= 1 else "a whole input turn"

    def phase(self, samples):
        return samples.theta

    def search(self, probe):
        terms = terms_at(self, probe.samples, [{"harmonics": float(i)} for i in range(len(SETS))])
        return widest_that_pays(probe, [term for term in terms if term.width <= probe.samples.rows_per_turn])

    def term(self, samples, shape, base_value=None):
        harmonics = SETS[int(shape["harmonics"])]
        return Term(self.id, dict(shape), zones=zone_harmonics(self.phase(samples), harmonics), trials=len(SETS))

    def orders(self, term, ratio):
        return list(SETS[int(term.shape["harmonics"])])

    def parameters(self, term, estimate):
        found = {}
        for i, h in enumerate(SETS[int(term.shape["harmonics"])]):
            found[f"amplitude_{h}_um"] = estimate.derived(
                lambda v, i=i: 1e3 * float(np.hypot(v[2 * i], v[2 * i + 1])), "um"
            )
            found[f"phase_{h}_deg"] = estimate.phase_deg(2 * i, 2 * i + 1)
        return found

    def sentence(self, parameters, rms_arcmin):
        parts = [
            f"{p.value:.2g} um at {name.split('_')[1]} waves a turn"
            for name, p in parameters.items()
            if name.startswith("amplitude")
        ]
        return (
            f"The {self.spline}'s teeth deviate from their place by more than one wave round the rim: "
            f"{', '.join(parts)} ({rms_arcmin:.2g} arcmin rms at the output)."
        )
