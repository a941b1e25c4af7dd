"""Torque sweeps: torsional stiffness K1 to K3 with knees, hysteresis loss, starting torque.

As makers define them (Harmonic Drive engineering data): stiffness in three straight parts of the torsion curve, knees
T1 and T2, hysteresis loss the width of the loop at zero torque.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.geometry import ARCMIN
from hdopt.recordings.figures import neighbour_noise
from hdopt.recordings.passes import find_passes
from hdopt.recordings.recording import OF_ROUNDING, Recording

GRID = 24
"""Places tried for each knee, evenly over the torque; the best is refined between its neighbours."""


@dataclass(frozen=True)
class Torsion:
    """Stiffness (Nm/rad) below, between and above the knees (Nm), `hysteresis_loss_arcmin` the loop's width at zero
    torque (None where the sweep does not come back) and `loss_sigma_arcmin` its standard uncertainty by the scatter of
    single samples, the encoder's step and what is stated of the sensors, `rms_arcmin` what the three lines leave,
    `torque` and `windup` (arcmin) the mean curve of both directions that was fitted."""

    stiffness: tuple[float, float, float]
    knees: tuple[float, float]
    hysteresis_loss_arcmin: float | None
    loss_sigma_arcmin: float
    rms_arcmin: float
    torque: Array
    windup: Array


def torsion_of(recording: Recording) -> Torsion | None:
    """The torsion curve of a `recording` with a locked input; None where there is no torque or the input moved."""
    torque = recording.torque
    if torque is None or not recording.input_locked or np.ptp(torque) <= 0:
        return None
    passes = find_passes(torque, 0.05 * float(np.ptp(torque)))
    grid = np.linspace(float(np.quantile(torque, 0.01)), float(np.quantile(torque, 0.99)), 161)
    branches: dict[float, list[Array]] = {1.0: [], -1.0: []}
    for index in range(passes.count):
        rows = np.flatnonzero(passes.index == index)
        if len(rows) < 10 or (passes.first[rows[0]] and passes.count > 2):
            continue
        order = rows[np.argsort(torque[rows])]
        curve = np.interp(grid, torque[order], recording.error_arcmin[order], left=np.nan, right=np.nan)
        branches[float(passes.direction[rows[0]])].append(curve)
    means = [mean_where_known(curves) for curves in branches.values() if curves]
    both = mean_where_known(means)
    seen = np.isfinite(both)
    loss = None
    if len(means) == 2 and grid[0] < 0 < grid[-1]:
        width = np.abs(means[0] - means[1])
        loss = float(np.interp(0.0, grid, width)) if np.isfinite(np.interp(0.0, grid, width)) else None
    stiffness, knees, left = _three_lines(grid[seen], both[seen])
    one = neighbour_noise(recording.error_arcmin) ** 2 + (recording.quantum_arcmin * OF_ROUNDING) ** 2
    sigma = math.sqrt(sum(one / max(len(curves), 1) for curves in branches.values()) + 2 * recording.sensor_arcmin**2)
    return Torsion(stiffness, knees, loss, sigma, left, grid[seen], both[seen])


def mean_where_known(curves: Sequence[Array]) -> Array:
    """The mean of the `curves`, (n,) each, at each place over those that are known there; nan where none is."""
    known = np.isfinite(curves)
    total, count = np.where(known, curves, 0.0).sum(axis=0), known.sum(axis=0)
    return np.asarray(np.divide(total, count, out=np.full(len(total), np.nan), where=count > 0), np.float64)


def _hinges(torque: Array, first: float, second: float) -> Array:
    """Columns of a curve that is odd in the torque but for an offset, straight in three parts."""
    size, sign = np.abs(torque), np.sign(torque)
    parts = [np.minimum(size, first), np.clip(size - first, 0, second - first), np.maximum(size - second, 0)]
    return np.column_stack([np.ones_like(torque), *(sign * part for part in parts)])


def _three_lines(torque: Array, windup: Array) -> tuple[tuple[float, float, float], tuple[float, float], float]:
    top = float(np.abs(torque).max())

    def left(first: float, second: float) -> float:
        columns = _hinges(torque, first, second)
        off = windup - columns @ np.linalg.lstsq(columns, windup, rcond=None)[0]
        return float(off @ off)

    places = top * np.arange(1, GRID) / GRID
    best = min(((left(a, b), a, b) for i, a in enumerate(places) for b in places[i + 1 :]), key=lambda entry: entry[0])
    step = top / GRID
    for _ in range(12):
        step /= 2
        trials = [
            (best[1] + i * step, best[2] + j * step)
            for i in (-1, 0, 1)
            for j in (-1, 0, 1)
            if 0 < best[1] + i * step < best[2] + j * step < top
        ]
        best = min([best, *((left(a, b), a, b) for a, b in trials)], key=lambda entry: entry[0])
    slopes = np.linalg.lstsq(_hinges(torque, best[1], best[2]), windup, rcond=None)[0][1:]
    k1, k2, k3 = (float(1 / (abs(slope) * ARCMIN)) if slope else math.inf for slope in slopes)
    return (k1, k2, k3), (best[1], best[2]), math.sqrt(best[0] / len(torque))


def starting_torque_nm(recording: Recording) -> float | None:
    """Torque (Nm) at which a drive at rest begins to turn: the largest before the input has moved by a degree.

    None where `recording` has no torque, does not begin at rest, or never moves.
    """
    if recording.torque is None or recording.input_locked:
        return None
    moved = np.abs(recording.input_angle - recording.input_angle[0]) > math.radians(1.0)
    if not moved.any():
        return None
    first = int(np.argmax(moved))
    if first < max(20, len(recording) // 100):
        return None
    return float(np.abs(recording.torque[: first + 1] - recording.torque[0]).max())
