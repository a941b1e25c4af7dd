"""A recording of a drive as every later step takes it: checked arrays in base units, with what was done to them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.drive.geometry import ARCMIN

TURN = 2 * math.pi
OF_ROUNDING = 1 / math.sqrt(12)
"""Standard deviation of what rounding leaves, over the step that is rounded to."""
LOCKED_TURNS = 0.02
"""Input turns below which the input counts as locked: only torque or time moved."""


def turns_with_ends(turns: float, apart: float) -> float:
    """The turns that a record of `turns` between its first and last angle, `apart` turns between neighbours, may have
    made: the last value of a whole turn lies short of where the first one does, and is a rounded count of an encoder.

    Both in turns of one shaft, >= 0.
    """
    return turns + 2 * apart


@dataclass(frozen=True)
class Recording:
    """One checked recording; all arrays have shape (n,).

    `input_angle` rad, unwrapped; `error_arcmin` KE at the output; `time` s, `torque` Nm at the output, `temperature`
    deg C or None; `segment` counts up at each gap. `quantum_arcmin` is the step of the coarser encoder at the output, 0
    where none shows; `output_step_arcmin` that of the output's alone, `input_step_arcmin` that of the input's, at the
    output. `warnings` say what was repaired, `understood`
    how the file was read, a plain sentence each. `sensor_arcmin` is the encoders' standard uncertainty at the output, 0
    where nobody stated it; `output_reversed` says that the output was counted against the input. `scatter_arcmin` is
    what of the error tells nothing of where the output stood, or None: whole steps of a coarse encoder, a few samples
    of many. A wave of the output angle that took them for motion could follow them one by one. `output_zero_arcmin` is
    what of the error is a zero that was set anew, and no motion of the output.
    """

    name: str
    ratio: float
    input_angle: Array
    error_arcmin: Array
    time: Array | None = None
    torque: Array | None = None
    temperature: Array | None = None
    segment: Index | None = None
    quantum_arcmin: float = 0.0
    output_step_arcmin: float = 0.0
    input_step_arcmin: float = 0.0
    warnings: tuple[str, ...] = field(default=())
    understood: tuple[str, ...] = field(default=())
    sensor_arcmin: float = 0.0
    output_reversed: bool = False
    scatter_arcmin: Array | None = None
    output_zero_arcmin: float = 0.0

    def __len__(self) -> int:
        return len(self.input_angle)

    @property
    def output_angle(self) -> Array:
        """Where the output stood, (n,) rad, from a zero of its own."""
        error = self.error_arcmin if self.scatter_arcmin is None else self.error_arcmin - self.scatter_arcmin
        return self.input_angle / self.ratio - (error - self.output_zero_arcmin) * ARCMIN

    @property
    def turns(self) -> float:
        """Input turns between the lowest and the highest input angle."""
        return float(np.ptp(self.input_angle)) / TURN

    @property
    def input_locked(self) -> bool:
        """Whether the input hardly moves (a torque sweep against a locked input)."""
        return self.turns < LOCKED_TURNS
