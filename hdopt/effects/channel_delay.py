"""Input and output are not sampled at the same moment: an offset proportional to speed.

Reading the output later by t_d gives theta(t)/N - psi(t - t_d) = KE + t_d d(theta/N)/dt to first order. Odd in
direction, proportional to speed, and it follows every ripple of the speed. Whichever channel is late, the input angle
was not read when the output was: the drive stood t_d dtheta/dt behind it then, 0.3 deg of the input for 0.1 arcmin at
the output and N = 160, a quarter of a tooth's pitch. Units: delay s, positive where the output is late. Prior: 0 to
50 ms either way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.geometry import ARCMIN
from hdopt.effects.base import Effect
from hdopt.effects.conditions import Conditions
from hdopt.effects.declared import Quantity
from hdopt.effects.estimate import Parameter
from hdopt.effects.probe import Probe
from hdopt.effects.term import Shape, Term

MS = 1e-3
"""s that a coefficient of one stands for."""
OTHER_POWERS = (0.5, 2.0, 3.0)
"""Powers of the speed by which drag grows, of oil and of air: a delay's is 1."""


class ChannelDelay(Effect):
    id = "channel_delay"
    place = 160
    domain = "speed"
    separating = (
        "repeat at two more speeds in both directions: a delay's offset grows with speed, play and friction "
        "stay; drag on the output goes when the load is taken off"
    )
    bench_part = "the acquisition of both channels"
    needs: ClassVar[Mapping[str, str]] = {"speed": "speed_rpm"}
    shifts_one_way = True
    declared = (Quantity("delay_s", "s", "above zero: the output is read late", "t_d", prior=(-0.05, 0.05), scale=MS),)
    examples = ({"delay_s": 0.002},)

    def columns(self, conditions: Conditions, shape: Shape) -> Array:
        return (conditions.known_speed / conditions.ratio / ARCMIN * MS)[:, None]

    def reads_input(self, shape: Shape) -> bool:
        return True

    def search(self, probe: Probe) -> Sequence[Term]:
        return [self.term(probe.samples, {})]

    def other_laws(self, conditions: Conditions, term: Term, motion: Array) -> Mapping[str, Sequence[Array]]:
        speed = conditions.known_speed
        largest = float(np.max(np.abs(speed)))
        part = speed / largest if largest > 0 else speed
        return {"speed": [(np.sign(part) * np.abs(part) ** power)[:, None] for power in OTHER_POWERS]}

    def sentence(self, shape: Shape, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        delay = parameters["delay_s"].value
        late = "output" if delay > 0 else "input"
        return (
            f"The {late} channel is read {abs(delay) * 1e3:.3g} ms later than the other: the offset grows with speed."
        )
