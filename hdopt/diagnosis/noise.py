"""Coloured noise: an autoregressive model of the residual, and the filter that makes it white.

Every fit of the diagnosis is generalized least squares in this filter (Box, Jenkins, "Time Series Analysis", AR(p)),
so that slow wander of the bench is not taken for slow physics. The order is chosen by BIC and kept low: a narrow line
in the residual must stay visible.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from hdopt.diagnosis.samples import Samples

Array = NDArray[np.float64]

HIGHEST_ORDER = 4
STEADIEST = 0.7
"""Largest size of an oscillating pole: beyond it the noise model would swallow a narrow line (mains, a whirling shaft)
that has to stay visible. Slow wander, a real positive pole, is noise at any size.
"""


@dataclass(frozen=True)
class Noise:
    """AR coefficients (x_t = sum a_k x_{t-k} + e_t), standard deviation of e, and a weight for each row (0 where the
    filter would reach over a gap)."""

    ar: Array
    sigma: float
    root_weight: Array

    @classmethod
    def white(cls, samples: Samples, sigma: float = 1.0) -> Noise:
        return cls(np.zeros(0), sigma, np.sqrt(samples.weight))

    def without(self, left_out: NDArray[np.bool_]) -> Noise:
        """The same noise with no weight on the rows `left_out` (n,), nor where the filter would reach into them."""
        touched = left_out.copy()
        for lag in range(1, len(self.ar) + 1):
            touched[lag:] |= left_out[:-lag]
        return replace(self, root_weight=np.where(touched, 0.0, self.root_weight))

    def whiten(self, values: Array) -> Array:
        """`values` (n,) or (n, q), filtered and weighted along the first axis."""
        if not len(self.ar):
            return values * (self.root_weight if values.ndim == 1 else self.root_weight[:, None])
        table = np.ascontiguousarray(values.reshape(len(values), -1))
        return _filtered(table, self.ar, self.root_weight).reshape(values.shape)


SIDE_BY_SIDE = 8
"""Columns from which the filter's sums are taken for all columns side by side."""


@njit(cache=True, nogil=True)
def _filtered(values, ar, root_weight):
    """(x_t - sum a_k x_{t-k}) times the weight of row t, for each column of `values` (n, q)."""
    rows, columns = values.shape
    result = np.empty((rows, columns))
    for t in range(rows):
        lags = min(len(ar), t)
        if columns < SIDE_BY_SIDE:
            for q in range(columns):
                white = values[t, q]
                for k in range(lags):
                    white -= ar[k] * values[t - 1 - k, q]
                result[t, q] = white * root_weight[t]
            continue
        for q in range(columns):
            result[t, q] = values[t, q]
        for k in range(lags):
            for q in range(columns):
                result[t, q] -= ar[k] * values[t - 1 - k, q]
        for q in range(columns):
            result[t, q] *= root_weight[t]
    return result


def without_lines(ar: Array) -> Array:
    """`ar` with its oscillating poles drawn in to `STEADIEST`: a pole near the unit circle is a line, not noise."""
    poles = np.roots(np.r_[1.0, -ar])
    size = np.abs(poles)
    slow = (np.abs(poles.imag) < 1e-9) & (poles.real > 0)
    poles = np.where(slow, poles, poles * np.minimum(1.0, STEADIEST / np.maximum(size, 1e-12)))
    return -np.real(np.poly(poles))[1:] if len(ar) else ar


def estimate(samples: Samples, residual: Array, highest_order: int = HIGHEST_ORDER) -> Noise:
    """AR noise from a residual that holds no structure any more."""
    piece = samples.piece
    n = len(residual)
    longest = np.bincount(piece).max()
    highest = int(min(highest_order, longest // 20))
    covariance = np.empty(highest + 1)
    for lag in range(highest + 1):
        same = piece[lag:] == piece[: n - lag]
        products = residual[lag:][same] * residual[: n - lag][same]
        covariance[lag] = products.mean() if len(products) else 0.0
    best_ar, best_score, error, ar = np.zeros(0), np.inf, covariance[0], np.zeros(0)
    for order in range(highest + 1):
        if order:
            reflection = (
                (covariance[order] - ar @ covariance[order - 1 : 0 : -1]) / error
                if order > 1
                else covariance[1] / error
            )
            reflection = float(np.clip(reflection, -0.995, 0.995))
            ar = np.r_[ar - reflection * ar[::-1], reflection]
            error *= 1 - reflection**2
        score = n * np.log(max(error, 1e-300)) + order * np.log(n)
        if score < best_score - 6:
            best_ar, best_score = ar, score
    best_ar = without_lines(best_ar)
    order = len(best_ar)
    valid = np.ones(n, bool)
    valid[:order] = False
    for lag in range(1, order + 1):
        valid[lag:] &= piece[lag:] == piece[:-lag]
    noise = Noise(best_ar, 1.0, np.where(valid, np.sqrt(samples.weight), 0.0))
    white = noise.whiten(residual)
    return Noise(best_ar, float(np.sqrt(np.sum(white**2) / max(valid.sum(), 1))), noise.root_weight)
