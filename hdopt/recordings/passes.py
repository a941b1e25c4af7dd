"""Passes, turns and conditions of a recording, and averages that are synchronous with input or output."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdopt.arrays import Array, Index, Mask
from hdopt.late import late
from hdopt.recordings.recording import TURN, Recording


@dataclass(frozen=True)
class Passes:
    """Monotone travels of the input: `index` counts them up, `direction` is +1 or -1, `since_reversal` is the input
    travel in rad since the last reversal; `first` marks rows before the first reversal, where the history is unknown.
    """

    index: Index
    direction: Array
    since_reversal: Array
    first: Mask

    @property
    def count(self) -> int:
        return int(self.index[-1]) + 1


@late(calls=0)
def _turning_points(angle: Array, threshold: float) -> Index:
    """Indices where the angle turns back by more than `threshold` (zigzag rule)."""
    turns = np.empty(len(angle), np.int64)
    found = 0
    high = low = 0
    heading = 0
    for i in range(1, len(angle)):
        if angle[i] > angle[high]:
            high = i
        if angle[i] < angle[low]:
            low = i
        if heading >= 0 and angle[high] - angle[i] > threshold:
            if heading == 1:
                turns[found] = high
                found += 1
            heading = -1
            low = i
            high = i
        elif heading <= 0 and angle[i] - angle[low] > threshold:
            if heading == -1:
                turns[found] = low
                found += 1
            heading = 1
            high = i
            low = i
    return turns[:found]


def find_passes(angle: Array, threshold: float | None = None) -> Passes:
    """Passes of `angle` (rad). A reversal counts when the angle comes back by `threshold`, by default 1/100 turn
    (or 2 % of the travel where that is less): more than encoder noise, less than a pass."""
    if threshold is None:
        threshold = min(0.01 * TURN, 0.02 * float(np.ptp(angle)))
    reversals = _turning_points(np.ascontiguousarray(angle), max(threshold, 1e-12))
    index = np.zeros(len(angle), np.int64)
    index[reversals + 1] = 1
    index = np.cumsum(index)
    starts = np.r_[0, reversals + 1]
    ends = np.r_[reversals, len(angle) - 1]
    sign = np.sign(angle[ends] - angle[np.maximum(starts - 1, 0)])
    sign[sign == 0] = 1.0
    origin = angle[np.r_[0, reversals]]
    return Passes(index, sign[index], np.abs(angle - origin[index]), index == 0)


@dataclass(frozen=True)
class Condition:
    """One operating condition: direction, mean input speed (rad/s), mean torque (Nm), mean temperature (deg C)."""

    direction: float
    speed: float | None
    torque: float | None
    temperature: float | None
    turns: float


def conditions(recording: Recording) -> list[Condition]:
    """The condition of each pass.

    `recording` needs its time for speeds.
    """
    passes = find_passes(recording.input_angle)
    found = []
    for index in range(passes.count):
        rows = passes.index == index
        travel = float(np.ptp(recording.input_angle[rows]))
        speed = None
        if recording.time is not None and np.ptp(recording.time[rows]) > 0:
            speed = travel / float(np.ptp(recording.time[rows]))
        found.append(
            Condition(
                float(passes.direction[rows][0]),
                speed,
                None if recording.torque is None else float(recording.torque[rows].mean()),
                None if recording.temperature is None else float(recording.temperature[rows].mean()),
                travel / TURN,
            )
        )
    return found


def resample_in_angle(recording: Recording, samples_per_turn: int) -> tuple[Array, Array, Index]:
    """Angle-synchronous resampling: input angles on an even grid (rad), KE (arcmin, mean of the samples in each cell,
    cells without samples left out) and the pass each belongs to.

    `recording` is cut into `samples_per_turn` cells an input turn.
    """
    passes = find_passes(recording.input_angle)
    cell = np.floor(recording.input_angle / TURN * samples_per_turn).astype(np.int64)
    change = np.flatnonzero((np.diff(cell) != 0) | (np.diff(passes.index) != 0)) + 1
    starts = np.r_[0, change]
    counts = np.diff(np.r_[starts, len(cell)])
    mean = np.add.reduceat(recording.error_arcmin, starts) / counts
    return np.asarray((cell[starts] + 0.5) * (TURN / samples_per_turn)), np.asarray(mean), passes.index[starts]


def synchronous_average(angle: Array, values: Array, period: float, bins: int = 180) -> tuple[Array, Array, Array]:
    """Mean of `values` over `angle` modulo `period`: bin centres, means (NaN where empty), standard errors.

    `period` 2 pi in the input angle gives the input-synchronous average, 2 pi N the output-synchronous one.

    `angle` and `period` in rad, `values` (n,), `bins` cells a period.
    """
    cell = np.minimum((np.mod(angle, period) / period * bins).astype(int), bins - 1)
    count = np.bincount(cell, minlength=bins).astype(float)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.bincount(cell, values, bins) / count
        spread = np.bincount(cell, (values - mean[cell]) ** 2, bins) / np.maximum(count - 1, 1)
        return (
            np.asarray((np.arange(bins) + 0.5) * (period / bins)),
            np.asarray(mean),
            np.asarray(np.sqrt(spread / count)),
        )
