"""What an effect knows of a motion: neutral arrays of conditions, row by row, whether recorded or simulated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hdopt.arrays import Array, Index, Mask
from hdopt.effects.sines import sine_columns

if TYPE_CHECKING:
    from collections.abc import Hashable

    from hdopt.effects.term import Term


TURN = 2 * math.pi
"""rad in a turn."""
ROWS_OF_THE_START = 5
"""Rows from which the speed is taken with which a piece begins."""


def varies(values: Array | None, share: float) -> bool:
    """Whether a channel is known, and its `values` (n,) have a standard deviation above this `share` of the largest."""
    return values is not None and bool(np.std(values) > share * np.max(np.abs(values)))


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """Rows of one motion or of several recordings; every array has shape (n,), in order of time.

    `ratio` N; `theta` input angle, rad; `output` output angle as its encoder read it, rad (its zero is arbitrary);
    `direction` of the motion, +1 or -1; `travel` output angle since the last reversal, deg; `first` rows before the
    first reversal; `record` the recording, 0, 1, ...; `piece` contiguous rows, 0, 1, ...; `time`, s; `speed` of the
    input, rad/s, with its sign; `torque` at the output, Nm, above 0 where it opposes positive rotation;
    `temperature`, deg C, or K from a reference; each of the last four None where nobody knows it. `locked`: the input
    stands still and the torque moves. `averaged`: samples behind a row, on average. `output_step`: step of the output's
    encoder, arcmin, where it is coarser than all else, else 0. `input_read`: input angle as its encoder read it, rad,
    where `theta` is another, at which the drive stood; else None.
    """

    ratio: float
    theta: Array
    output: Array
    direction: Array
    travel: Array
    first: Mask
    record: Index
    piece: Index
    time: Array | None
    speed: Array | None
    torque: Array | None
    temperature: Array | None
    locked: bool = False
    averaged: float = 1.0
    output_step: float = 0.0
    input_read: Array | None = None

    def __len__(self) -> int:
        return len(self.theta)

    @cached_property
    def remembered(self) -> dict[Hashable, Term]:
        """Terms made for these rows at shapes that every search looks at."""
        return {}

    @property
    def input_as_read(self) -> Array:
        """Input angle as its encoder read it, rad, (n,)."""
        return self.theta if self.input_read is None else self.input_read

    def waves_of_input(self, most: int) -> Array:
        """sin and cos of one to so many waves an input turn (`most`), (n, 2 most), made once: what follows the motion
        asks for them at every step of a fit.
        """
        if most not in self._waves_of_input:
            self._waves_of_input[most] = sine_columns(self.theta, range(1, most + 1))
        return self._waves_of_input[most]

    @cached_property
    def _waves_of_input(self) -> dict[int, Array]:
        return {}

    @cached_property
    def pieces(self) -> Index:
        """First row of each contiguous piece, and the row after its last, (q, 2)."""
        bounds = np.r_[0, np.flatnonzero(np.diff(self.piece)) + 1, len(self)]
        return np.column_stack([bounds[:-1], bounds[1:]])

    @cached_property
    def starting_motion(self) -> tuple[Array, Array]:
        """Input speed with which each contiguous piece begins, rad/s, (n,), and the input angle less what that speed
        alone would make of it, rad, (n,).
        """
        speed, beyond = np.zeros(len(self)), np.zeros(len(self))
        for start, end in self.pieces:
            time = self.known_time[start:end] - self.known_time[start]
            first = slice(start, min(start + ROWS_OF_THE_START, end))
            if np.ptp(self.known_time[first]) > 0:
                speed[start:end] = np.polyfit(time[:ROWS_OF_THE_START], self.theta[first], 1)[0]
            beyond[start:end] = self.theta[start:end] - self.theta[start] - speed[start] * time
        return speed, beyond

    @cached_property
    def records(self) -> int:
        """Number of recordings."""
        return int(self.record[-1]) + 1

    @property
    def known_torque(self) -> Array:
        """The torque, Nm, (n,), of conditions that have one. Raises `ValueError` for others."""
        return _known("torque", self.torque)

    @property
    def known_speed(self) -> Array:
        """The input speed, rad/s, (n,), of conditions that have one. Raises `ValueError` for others."""
        return _known("speed", self.speed)

    @property
    def known_time(self) -> Array:
        """The time, s, (n,), of conditions that have one. Raises `ValueError` for others."""
        return _known("time", self.time)

    @property
    def known_temperature(self) -> Array:
        """The temperature (n,) of conditions that have one. Raises `ValueError` for others."""
        return _known("temperature", self.temperature)

    @cached_property
    def reverses(self) -> bool:
        """Whether both directions are there, one row in fifty each at least."""
        forward, backward = (self.direction > 0).mean(), (self.direction < 0).mean()
        return bool(min(forward, backward) > 0.02)

    @cached_property
    def span_turns(self) -> float:
        """Input turns between the lowest and the highest angle of any one recording."""
        return max(float(np.ptp(self.theta[self.record == r])) for r in range(self.records)) / TURN

    @cached_property
    def rows_per_turn(self) -> float:
        """Usual number of rows in an input turn."""
        step = np.abs(np.diff(self.theta))
        step = step[(np.diff(self.piece) == 0) & (step > 0)]
        return TURN / float(np.median(step)) if len(step) else 1.0

    @property
    def are_averages(self) -> bool:
        """Whether neighbouring samples were averaged into the rows."""
        return self.averaged > 1.15

    @property
    def highest_order(self) -> float:
        """Orders up to which the rows can be trusted: the mean of a few neighbours dims what lies higher."""
        return self.rows_per_turn * (0.35 if self.are_averages else 0.45)


def _known(name: str, values: Array | None) -> Array:
    if values is None:
        raise ValueError(f"these conditions have no {name}, which the effect needs; ask `lacks` first")
    return values
