"""Input and output are not sampled at the same moment: an offset proportional to speed.

Reading the output later by t_d gives theta(t)/N - psi(t - t_d) = KE + t_d d(theta/N)/dt to first order. Odd in
direction, proportional to speed, and it follows every ripple of the speed. Units: delay s, positive where the output
is late. Prior: 0 to 50 ms.
"""

from __future__ import annotations

import numpy as np

from hdopt.diagnosis.effect import Term
from hdopt.drive import ARCMIN


class ChannelDelay:
    id = "channel_delay"
    domain = "speed"
    needs_base = False
    separating = (
        "repeat at two more speeds in both directions: a delay's offset grows with speed, play and friction stay"
    )

    def lacks(self, samples):
        if samples.speed is None:
            return "a time column"
        if np.std(samples.speed) <= 0.003 * np.max(np.abs(samples.speed)):
            return "speed that varies"
        return None

    def search(self, probe):
        return [self.term(probe.samples, {})]

    def term(self, samples, shape, base_value=None):
        # In arcmin for a delay in ms.
        return Term(self.id, {}, columns=(samples.speed / samples.ratio / ARCMIN * 1e-3)[:, None])

    def parameters(self, term, estimate):
        return {"delay_s": estimate.parameter(0, "s", scale=1e-3)}

    def sentence(self, parameters, rms_arcmin):
        delay = parameters["delay_s"].value
        late = "output" if delay > 0 else "input"
        return (
            f"The {late} channel is read {abs(delay) * 1e3:.3g} ms later than the other: the offset grows with speed."
        )
