"""The operating condition that effects of load, speed, temperature, time and direction are evaluated at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdopt.arrays import Array
from hdopt.effects.conditions import Conditions

RPM = 2 * np.pi / 60
"""rad/s in a revolution per minute."""

MOTIONS = {"forward": (1.0,), "backward": (-1.0,), "both": (1.0, -1.0)}
"""Motion -> the directions that it passes through."""


@dataclass(frozen=True)
class Operation:
    """How the drive runs. A number nobody gave is None, and an effect that needs it cannot be evaluated.

    `motion`: 'forward' or 'backward' without end, or 'both': one full relative turn there and back again, over and
    over. `torque` at the output, constant, Nm (the unit of the effects); `speed` of the input, constant, rad/s, above
    0; `temperature_difference` from the reference, K; `time` since the start from cold at which the motion begins, s.
    """

    motion: str = "forward"
    torque: float | None = None
    speed: float | None = None
    temperature_difference: float | None = None
    time: float | None = None

    @property
    def directions(self) -> tuple[float, ...]:
        return MOTIONS[self.motion]

    def conditions(self, ratio: float, theta: Array, direction: float, span: float) -> Conditions:
        """What an effect knows of input angles `theta` (rad, (n,)) passed in `direction` (+1, -1), at `ratio` N.

        A pass runs from 0 to `span` (rad) or back. Of a motion in both directions the first row is an extra one, the
        end of the pass before, from which friction and play take their start; `of_pass` leaves it out again.
        """
        reverses = self.motion == "both"
        start = 0.0 if direction > 0 else span
        if reverses:
            theta = np.concatenate([[start], theta])
        n, travel = len(theta), np.abs(theta - start)
        way = np.full(n, direction)
        first = np.full(n, not reverses)
        if reverses:
            way[0], first[0] = -direction, True
        time = None
        if self.speed is not None:
            waited = span if reverses and direction < 0 else 0.0
            time = (self.time or 0.0) + (waited + travel) / self.speed
        one = np.zeros(n, np.int64)
        return Conditions(
            ratio=ratio,
            theta=theta,
            direction=way,
            travel=np.degrees(travel) / ratio,
            first=first,
            record=one,
            piece=one,
            time=time,
            speed=None if self.speed is None else way * self.speed,
            torque=_constant(self.torque, n),
            temperature=_constant(self.temperature_difference, n),
            output=theta / ratio,  # its reading lacks the error itself, a phase of the encoder's lines
        )

    def of_pass(self, values: Array) -> Array:
        """`values` along `conditions` (last axis) without the row that only stands for the pass before."""
        return values[..., 1:] if self.motion == "both" else values


NO_LOAD = Operation()
"""Forward, with nothing else said."""


def _constant(value: float | None, n: int) -> Array | None:
    return None if value is None else np.full(n, value)
