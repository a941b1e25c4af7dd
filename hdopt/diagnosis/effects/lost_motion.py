"""Lost motion: play between input and output, a step of the error at each reversal.

Jia 2021, Eqs. (33)-(35): the output lags by the play of the gear flanks, 2 pi (e_t - tau)/l_FS, and of the
cross-slide's two slots, the sum of e_b/(N r_i), whose lever arms vary over the input turn. While the play is crossed
the output stands still, so the error changes by the full step over as much input travel as makes the same output
angle. With the input locked the play is crossed where the torque that the flanks feel changes its sign: at the recorded
torque's zero, or beyond it by the friction that holds the output. Units: lost_motion arcmin, full step between the two
directions. Prior: 0 to 10 arcmin.
"""

from __future__ import annotations

import numpy as np

from hdopt.diagnosis.effect import Term, best_terms


class LostMotion:
    id = "lost_motion"
    domain = "reversal"
    needs_base = False
    separating = "reverse slowly at several input angles and speeds: play steps at once, and alike at every speed"

    def lacks(self, samples):
        if samples.locked:
            crossed = samples.torque is not None and np.min(samples.torque) < 0 < np.max(samples.torque)
            return None if crossed else "torque of both signs"
        return None if samples.reverses else "a reversal"

    def search(self, probe):
        if probe.samples.locked:
            reached = float(np.max(np.abs(probe.samples.torque)))
            at = [self.term(probe.samples, {"friction_nm": f * reached}) for f in (0.0, 0.05, 0.1, 0.15, 0.25, 0.4)]
            return best_terms(probe, at)
        # The crossing is as long as the play itself, which a first estimate gives.
        _, size = probe.solve(self.term(probe.samples, {"ramp_arcmin": 0.5}))
        ramp = min(max(abs(float(size[0])), 0.05), 60.0)
        plain = self.term(probe.samples, {"ramp_arcmin": ramp})
        varying = [self.term(probe.samples, {"ramp_arcmin": ramp, "order": k}) for k in (1.0, 2.0, 4.0)]
        return [plain, *best_terms(probe, varying)]

    def term(self, samples, shape, base_value=None):
        if samples.locked:
            side = np.sign(samples.torque - shape["friction_nm"] * samples.direction)
            return Term(self.id, dict(shape), columns=0.5 * side[:, None], trials=6.0)
        # In crossing the play the travel in arcmin equals the play itself.
        crossing = np.clip(samples.travel * 60 / max(shape["ramp_arcmin"], 1e-3), 0, 1)
        crossing = np.where(samples.first, 1.0, crossing)
        step = samples.direction * (crossing - 0.5)
        columns = [step]
        if "order" in shape:
            angle = shape["order"] * samples.theta
            columns += [step * np.sin(angle), step * np.cos(angle)]
        return Term(self.id, dict(shape), columns=np.column_stack(columns), trials=3.0 if "order" in shape else 1.0)

    def parameters(self, term, estimate):
        found = {"lost_motion_arcmin": estimate.derived(lambda v: abs(v[0]), "arcmin")}
        if "order" in term.shape:
            found["variation_arcmin"] = estimate.amplitude(1, 2)
        return found

    def sentence(self, parameters, rms_arcmin):
        varies = " and varies over the input turn" if "variation_arcmin" in parameters else ""
        return f"Play: at each reversal the output lags by {parameters['lost_motion_arcmin'].value:.2g} arcmin{varies}."
