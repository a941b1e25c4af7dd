"""Circular spline out of round, as by clamping with n bolts.

A radial deviation w cos(n theta + phi) of the circular spline changes the meshing depth in each zone by as much, and
so the arc by w tan(alpha) (Jia 2021, Eqs. (24)-(26)); zone 2 meets it half a turn on. Clamping by n bolts makes n
lobes. Units: um of radius; prior 0 to 50 um, n 2 to 16.
"""

from __future__ import annotations

from hdopt.diagnosis.effect import Parameter, Term, best_terms, terms_at
from hdopt.diagnosis.effects._zone_harmonics import zone_harmonics

LOBES = range(2, 17)


class CircularSplineLobing:
    id = "circular_spline_lobing"
    domain = "order"
    needs_base = True
    separating = (
        "loosen the clamping bolts and tighten them again evenly, or turn the circular spline: lobes made by "
        "clamping stay with the bolts, tooth errors turn with the spline"
    )

    def lacks(self, samples):
        return None if samples.span_turns >= 1 else "a whole input turn"

    def search(self, probe):
        limit = 0.4 * probe.samples.rows_per_turn
        return best_terms(probe, terms_at(self, probe.samples, [{"lobes": float(n)} for n in LOBES if n < limit]), 2)

    def term(self, samples, shape, base_value=None):
        n = int(shape["lobes"])
        # Two or three lobes are also what a cumulative pitch error makes first; bolt circles start at four.
        odds = -2.0 if n < 4 else 0.0
        return Term(
            self.id,
            dict(shape),
            zones=zone_harmonics(samples.theta, (n,)),
            trials=float(len(LOBES)),
            odds=odds,
        )

    def orders(self, term, ratio):
        return [term.shape["lobes"]]

    def parameters(self, term, estimate):
        n = term.shape["lobes"]
        return {
            "lobes": Parameter(n, n, n, "1"),
            "arc_amplitude_um": estimate.amplitude(0, 1, "um", scale=1e3),
            "phase_deg": estimate.phase_deg(0, 1),
        }

    def sentence(self, parameters, rms_arcmin):
        return (
            f"The circular spline is out of round with {parameters['lobes'].value:.0f} lobes, as bolts make "
            f"it: {rms_arcmin:.2g} arcmin rms."
        )
