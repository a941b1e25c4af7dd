"""A Gaussian process on what the base leaves (Rasmussen, Williams 2006, Eqs. (2.23)-(2.24), (5.8)). It names nothing.

The kernel is a product of squared exponentials over angle (as a point on the circle), output angle, direction, speed,
torque and time; length scales and noise are those of the highest marginal likelihood.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any  # Any: values of JSON

import numpy as np
import pandas as pd
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from hdopt.bench.arrays import Array
from hdopt.bench.baselines.rows import Rows, answer, base_columns, fitted, rows_of

TRAINED, STEPS = 250, 25
# The held-out error must fall by this share before the model is said to lack something.
GAIN = 0.05


def inputs(rows: Rows) -> Array:
    """Inputs of the process over `rows`, each about one wide; those that do not vary are left out."""
    angle, output = rows.theta, rows.theta / rows.ratio
    found = [np.cos(angle), np.sin(angle), np.cos(output), np.sin(output), np.sign(rows.speed), rows.speed]
    columns = np.column_stack([*found, rows.torque, rows.temperature, rows.time])
    wide = columns.std(0)
    result: Array = columns[:, wide > 0] / wide[wide > 0]
    return result


def kernel(one: Array, other: Array, log_scales: Array) -> Array:
    """Squared exponential of `one` (n, d) and `other` (m, d) with length scales exp(`log_scales`) (d,)."""
    one, other = one / np.exp(log_scales), other / np.exp(log_scales)
    square = (one**2).sum(1)[:, None] + (other**2).sum(1) - 2 * one @ other.T
    found: Array = np.exp(-0.5 * np.maximum(square, 0))
    return found


def gaussian_process(tables: Sequence[pd.DataFrame], ratio: float) -> dict[str, Any]:
    """Answer to the case of `tables`, of a gear of `ratio`: adequate, or unknown."""
    rows = rows_of(tables, ratio)
    out, base, place = rows.held_out, base_columns(rows), inputs(rows)
    if out.all() or not out.any():
        return answer("insufficient")
    left = rows.error - base @ fitted(base[~out], rows.error[~out])
    chosen = np.flatnonzero(~out)[:: max(1, int((~out).sum() / TRAINED))]
    x, y, size = place[chosen], left[chosen], max(float(left[chosen].std()), 1e-12)

    def cost(parameters: Array) -> float:
        covariance = kernel(x, x, parameters[:-1]) + (np.exp(parameters[-1]) + 1e-8) * np.eye(len(x))
        factor = cho_factor(covariance, lower=True)
        return float(0.5 * (y / size) @ cho_solve(factor, y / size) + np.log(np.diag(factor[0])).sum())

    start = np.r_[np.full(x.shape[1], 1.0), np.log(0.3)]
    bounds = [(-2.0, 4.0)] * x.shape[1] + [(-8.0, 2.0)]
    best = minimize(cost, start, bounds=bounds, method="L-BFGS-B", options={"maxiter": STEPS}).x
    covariance = kernel(x, x, best[:-1]) + (np.exp(best[-1]) + 1e-8) * np.eye(len(x))
    weights = np.linalg.solve(covariance, y)
    before = float(np.sqrt(np.mean(left[out] ** 2)))
    after = float(np.sqrt(np.mean((left[out] - kernel(place[out], x, best[:-1]) @ weights) ** 2)))
    return answer("unknown" if after < (1 - GAIN) * before else "adequate", base=before, said=min(before, after))
