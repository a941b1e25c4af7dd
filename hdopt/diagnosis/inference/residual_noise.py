"""The noise of what a fit leaves: an autoregression of what neither the fit nor a basis without physics explains."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.diagnosis.inference import noise as noise_model
from hdopt.diagnosis.inference.change_points import find_steps, step_columns
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.inference.generic_basis import generic_columns
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.inference.normal_equations import sums_of_groups
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.numerical import LEAST_SQUARES_RANK, TINY


@dataclass(frozen=True)
class MeasuredNoise:
    """AR `noise`, and by how much what it describes is rougher turn by turn (`inflation`, 1 or more)."""

    noise: Noise
    inflation: float


def measure_noise(fit: Fit) -> MeasuredNoise:
    """The noise of the rows of `fit`, its lines, smooth structure and steps taken out first."""
    settings, rows = fit.problem.settings, fit.problem.rows
    probe = FitProbe(replace(fit, problem=fit.problem.with_noise(Noise.white(rows, fit.problem.noise.sigma))))
    columns, _ = generic_columns(rows, probe)
    # Steps would be taken for wander, whose colour then hides them.
    steps = [] if rows.locked else find_steps(probe.residual, settings.change_points)[0]
    white = probe.project(probe.noise.whiten(np.column_stack([columns, step_columns(len(rows), steps)])))
    scale = np.sqrt(np.maximum((white**2).sum(0), TINY))
    solution = np.linalg.lstsq(white / scale, probe.white_residual, rcond=LEAST_SQUARES_RANK)[0]
    residual = probe.white_residual - white / scale @ solution
    residual = residual / np.maximum(probe.noise.root_weight, settings.noise.smallest_weight)
    noise = noise_model.estimate(rows, residual, settings.noise)
    inflation = roughness(noise, noise.whiten(residual), noise.whiten(columns), rows.block)
    return MeasuredNoise(noise, float(np.clip(inflation, 1.0, settings.noise.largest_inflation)))


def roughness(noise: Noise, whitened: Array, columns: Array, block: Index) -> float:
    """Power of the scores of smooth whitened `columns` (n, q) on the `whitened` residual (n,), summed over each turn
    (`block`, (n,)), against what white noise of the same size would give: the median over the columns.
    """
    scores = sums_of_groups(columns, block, whitened, block[-1] + 1)
    expected = noise.sigma**2 * (columns**2).sum(0)
    return float(np.median((scores**2).sum(0) / np.maximum(expected, TINY)))
