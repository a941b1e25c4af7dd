"""Tooth-to-tooth (short-wave) deviation: a ripple at the tooth-mesh order.

Every input turn the wave generator passes Z_CS teeth of the circular spline and Z_FS (1 + 1/N) = Z_CS of the
flexspline, so single-pitch and profile deviations (ISO 1328-1, f_pt and F_alpha) ripple at order Z_CS, with sidebands
where the depth of mesh varies over the turn (orders Z_CS +- 1, +- 2) and, farther out, where the driving zone changes,
each zone having a phase of its own: the short-wave part that Jia 2021, Sec. 2.2, leaves out. With two lobes and a tooth
difference of 2, Z_CS = 2 (N + 1). Needs more than 2 Z_CS samples a turn. Units: arcmin at the output, or um
of arc where it acts inside the zones (`hdopt.diagnosis.zone_ripple`).
"""

from __future__ import annotations

import numpy as np

from hdopt.diagnosis.effect import Term, best_terms, sine_columns

SIDEBANDS = (
    (0,),
    (0, -2, 2),
    (0, -1, 1, -2, 2),
    (0, -2, 2, -4, 4),
    *((0, *range(-k, 0), *range(1, k + 1)) for k in (4, 7, 11)),
)
FEW = 3
"""So many of the variants have few lines."""
ZONE_SIDEBANDS = ((0,), (0, -1, 1), (0, -1, 1, -2, 2))
"""Inside the zones, whose change needs no sidebands of its own."""


def mesh_order(ratio: float) -> float:
    """Z_CS: teeth that the wave generator passes an input turn, for two lobes."""
    return 2.0 * round(ratio + 1)


class ToothMesh:
    id = "tooth_mesh"
    domain = "order"
    needs_base = False
    high_order = True
    separating = "sample more than twice per tooth, at two speeds: the mesh ripple stays at Z_CS cycles a turn"

    def lacks(self, samples):
        need = 2.05 * self.order(samples)
        if samples.rows_per_turn < need:
            return f"more than {need:.0f} samples an input turn (there are {samples.rows_per_turn:.0f})"
        return None

    @staticmethod
    def order(samples) -> float:
        return mesh_order(samples.ratio)

    def search(self, probe):
        if not probe.order_range[0] < self.order(probe.samples) < probe.order_range[1]:
            return []
        # Not remembered: on the rows as recorded these are the widest columns of all.
        terms = [self.term(probe.samples, {"sidebands": float(i)}) for i in range(len(SIDEBANDS))]
        ranked = best_terms(probe, terms, len(terms))
        # The best of the few-line variants beside the best of all: many sidebands also bend to what is none.
        few = next(term for term in ranked if term.shape["sidebands"] < FEW)
        return [few] if few is ranked[0] else [few, ranked[0]]

    def term(self, samples, shape, base_value=None):
        if "zones" in shape:
            orders = self.order(samples) + np.array(ZONE_SIDEBANDS[int(shape["sidebands"])])
            waves = sine_columns(samples.theta, orders)
            none = np.zeros_like(waves)
            zones = np.stack([np.column_stack([waves, none]), np.column_stack([none, waves])])
            return Term(self.id, dict(shape), zones=zones, trials=len(ZONE_SIDEBANDS))
        orders = self.order(samples) + np.array(SIDEBANDS[int(shape["sidebands"])])
        return Term(self.id, dict(shape), columns=sine_columns(samples.theta, orders), trials=len(SIDEBANDS))

    def parameters(self, term, estimate):
        if "zones" in term.shape:
            second = term.width // 2
            return {
                "zone_1_amplitude_um": estimate.amplitude(0, 1, "um", scale=1e3),
                "zone_1_phase_deg": estimate.phase_deg(0, 1),
                "zone_2_amplitude_um": estimate.amplitude(second, second + 1, "um", scale=1e3),
                "zone_2_phase_deg": estimate.phase_deg(second, second + 1),
            }
        return {"amplitude_arcmin": estimate.amplitude(0, 1), "phase_deg": estimate.phase_deg(0, 1)}

    def sentence(self, parameters, rms_arcmin):
        return (
            f"A ripple at the tooth-mesh order, {rms_arcmin:.2g} arcmin rms: tooth-to-tooth pitch or profile deviation."
        )
