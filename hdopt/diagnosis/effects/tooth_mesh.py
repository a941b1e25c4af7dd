"""Tooth-to-tooth (short-wave) deviation: a ripple at the tooth-mesh order.

Every input turn the wave generator passes Z_CS teeth of the circular spline and Z_FS (1 + 1/N) = Z_CS of the
flexspline, so single-pitch and profile deviations (ISO 1328-1, f_pt and F_alpha) ripple at order Z_CS, with sidebands
where the depth of mesh varies over the turn (orders Z_CS +- 1, +- 2): the short-wave part that Jia 2021, Sec. 2.2,
leaves out. With two lobes and a tooth difference of 2, Z_CS = 2 (N + 1). Needs more than 2 Z_CS samples a turn.
Units: arcmin at the output.
"""

from __future__ import annotations

import numpy as np

from hdopt.diagnosis.effect import Term, best_terms, sine_columns

SIDEBANDS = ((0,), (0, -2, 2), (0, -1, 1, -2, 2), (0, -2, 2, -4, 4), (0, -1, 1, -2, 2, -3, 3, -4, 4))


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
        return 2.0 * round(samples.ratio + 1)

    def search(self, probe):
        if not probe.order_range[0] < self.order(probe.samples) < probe.order_range[1]:
            return []
        return best_terms(probe, [self.term(probe.samples, {"sidebands": float(i)}) for i in range(len(SIDEBANDS))])

    def term(self, samples, shape, base_value=None):
        orders = self.order(samples) + np.array(SIDEBANDS[int(shape["sidebands"])])
        return Term(self.id, dict(shape), columns=sine_columns(samples.theta, orders), trials=len(SIDEBANDS))

    def parameters(self, term, estimate):
        return {"amplitude_arcmin": estimate.amplitude(0, 1), "phase_deg": estimate.phase_deg(0, 1)}

    def sentence(self, parameters, rms_arcmin):
        return (
            f"A ripple at the tooth-mesh order, {parameters['amplitude_arcmin'].value:.2g} arcmin: "
            "tooth-to-tooth pitch or profile deviation."
        )
