"""Coloured noise: an autoregressive model of the residual, and the filter that makes it white.

Every fit of the diagnosis is generalized least squares in this filter (Box, Jenkins, "Time Series Analysis", AR(p)),
so that slow wander of the bench is not taken for slow physics. The order is chosen by BIC and kept low: a narrow line
in the residual must stay visible.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise

import numpy as np
from numba import njit

from hdopt.arrays import Array, Index, Mask
from hdopt.diagnosis.numerical import TINY
from hdopt.diagnosis.settings import DEFAULT, NoiseSettings
from hdopt.recordings.rows import Rows


@dataclass(frozen=True)
class Noise:
    """AR coefficients (x_t = sum a_k x_{t-k} + e_t), standard deviation of e, and a weight for each row (0 where the
    filter would reach over a gap)."""

    ar: Array
    sigma: float
    root_weight: Array

    @classmethod
    def white(cls, rows: Rows, sigma: float = 1.0) -> Noise:
        """Noise without colour on `rows`, of standard deviation `sigma` (arcmin)."""
        return cls(np.zeros(0), sigma, np.sqrt(rows.weight))

    def without(self, left_out: Mask) -> Noise:
        """The same noise with no weight on the rows `left_out` (n,), nor where the filter would reach into them."""
        touched = left_out.copy()
        for lag in range(1, len(self.ar) + 1):
            touched[lag:] |= left_out[:-lag]
        return replace(self, root_weight=np.where(touched, 0.0, self.root_weight))

    def on(self, rows: Rows) -> Noise:
        """The same noise on other `rows`."""
        return replace(self, root_weight=weights_with_a_past(rows, len(self.ar)))

    def whiten(self, values: Array) -> Array:
        """`values` (n,) or (n, q), filtered and weighted along the first axis."""
        if values.ndim > 1:
            return self.whitened([values])
        white = np.empty(len(values))
        self.whiten_rows(values[None], white[None])
        return white

    def whitened(self, blocks: Sequence[Array]) -> Array:
        """`blocks` of columns, each (n, k), filtered and weighted, beside each other, (n, q); every column lies in one
        piece, as products read it.
        """
        ends = list(accumulate((block.shape[1] for block in blocks), initial=0))
        rows = np.empty((ends[-1], len(self.root_weight)))
        for block, (start, end) in zip(blocks, pairwise(ends), strict=True):
            self.whiten_rows(block.T, rows[start:end])
        return rows.T

    def whiten_rows(self, columns: Array, result: Array) -> None:
        """`columns`, each a row (q, n), filtered and weighted into `result` (q, n), another array."""
        if len(self.ar):
            filtered(np.ascontiguousarray(columns), self.ar, self.root_weight, result)
        else:
            np.multiply(columns, self.root_weight, out=result)


GROUP = 4
"""Lags that the filter takes in one pass: speed alone, the sums are the same."""
ROUNDING = 1e-9
"""Imaginary part below which a pole is real."""


@njit(cache=True, nogil=True, fastmath=False)
def filtered(columns: Array, ar: Array, root_weight: Array, result: Array) -> None:
    """x_t - sum a_k x_{t-k} times the `root_weight` (n,) of row t, for each of the `columns` (q, n), rows of which lie
    side by side, into `result` (q, n). `ar` (p,) are the a_k, none for white noise."""
    count, rows = columns.shape
    # Lags are taken in groups, by shifted views in place of shifted indices: several rows are worked on at once.
    groups = -(-len(ar) // GROUP)
    weights = np.zeros(GROUP * groups)
    for k in range(len(ar)):  # One by one: of slices, what they may raise takes seconds to compile.
        weights[k] = ar[k]
    lags = min(GROUP * groups, rows)
    for q in range(count):
        column, white = columns[q], result[q]
        if groups == 0:
            for t in range(rows):
                white[t] = column[t] * root_weight[t]
        for t in range(lags):
            white[t] = column[t]
            for k in range(min(len(ar), t)):
                white[t] -= ar[k] * column[t - 1 - k]
            white[t] *= root_weight[t]
        for g in range(groups):
            a, b, c, d = weights[GROUP * g : GROUP * (g + 1)]
            one = lags - GROUP * g - 1
            two = one - 1
            three = two - 1
            four = three - 1
            now = column[lags:] if g == 0 else white[lags:]
            later, weight = white[lags:], root_weight[lags:]
            first, second, third, fourth = column[one:], column[two:], column[three:], column[four:]
            for t in range(rows - lags):
                left = now[t] - a * first[t] - b * second[t] - c * third[t] - d * fourth[t]
                later[t] = left * weight[t] if g == groups - 1 else left


def without_lines(ar: Array, largest_pole: float = DEFAULT.noise.largest_oscillating_pole) -> Array:
    """`ar` (p,) with its oscillating poles drawn in to `largest_pole`: one near the unit circle is a line, not noise.
    Slow wander, a real positive pole, is noise at any size.
    """
    poles = np.roots(np.r_[1.0, -ar])
    size = np.abs(poles)
    slow = (np.abs(poles.imag) < ROUNDING) & (poles.real > 0)
    poles = np.where(slow, poles, poles * np.minimum(1.0, largest_pole / np.maximum(size, TINY)))
    return -np.real(np.poly(poles))[1:] if len(ar) else ar


def estimate(rows: Rows, residual: Array, settings: NoiseSettings = DEFAULT.noise) -> Noise:
    """AR noise of `rows` from a `residual` (n,), arcmin, that holds no structure any more. `settings` are the
    thresholds.
    """
    piece = rows.piece
    n = len(residual)
    ar = without_lines(
        autoregression(_covariance(piece, residual, settings), n, settings), settings.largest_oscillating_pole
    )
    noise = Noise(ar, 1.0, weights_with_a_past(rows, len(ar)))
    white = noise.whiten(residual)
    return Noise(ar, float(np.sqrt(np.sum(white**2) / max((noise.root_weight > 0).sum(), 1))), noise.root_weight)


def beneath_lines(rows: Rows, residual: Array, settings: NoiseSettings = DEFAULT.noise) -> Noise:
    """AR noise of `rows` from a `residual` (n,), arcmin, in which many narrow lines stand: by its power between them.
    In each of some bands that is the median of the periodogram over log 2, whatever lines take less than half of the
    band (of noise a power has an exponential distribution, whose median is log 2 of its mean). `settings` are the
    thresholds.
    """
    n = len(residual)
    power = np.abs(np.fft.rfft(residual))[1:] ** 2 / n
    bands = np.array_split(power, min(settings.bands, len(power)))
    level = np.concatenate([np.full(len(band), np.median(band)) for band in bands]) / math.log(2)
    lags = _highest_order(rows.piece, settings) + 1
    covariance = np.fft.irfft(np.r_[level[0], level], 2 * len(level))[:lags]
    ar = autoregression(covariance, n, settings)
    filtered_by = np.r_[1.0, -without_lines(ar, settings.largest_oscillating_pole)]
    apart = np.arange(len(filtered_by))
    variance = filtered_by @ covariance[np.abs(apart[:, None] - apart)] @ filtered_by
    return Noise(-filtered_by[1:], math.sqrt(max(float(variance), TINY)), weights_with_a_past(rows, len(ar)))


def predictable_share(rows: Rows, residual: Array, settings: NoiseSettings = DEFAULT.noise) -> float:
    """Share of the power of a `residual` (n,) that the `rows` before tell, by an autoregression of the order that
    Schwarz's criterion prefers: 0 for white noise. `settings` are the thresholds.
    """
    covariance = _covariance(rows.piece, residual, settings)
    ar = autoregression(covariance, len(residual), settings)
    return float(ar @ covariance[1 : len(ar) + 1] / max(covariance[0], TINY))


def weights_with_a_past(rows: Rows, order: int) -> Array:
    """Root weights (n,) of the `rows` that have so many (`order`) before them in their own piece; 0 for the others."""
    piece = rows.piece
    valid = np.ones(len(piece), bool)
    valid[:order] = False
    for lag in range(1, order + 1):
        valid[lag:] &= piece[lag:] == piece[:-lag]
    return np.where(valid, np.sqrt(rows.weight), 0.0)


def _covariance(piece: Index, residual: Array, settings: NoiseSettings) -> Array:
    """Mean products of `residual` (n,) with itself some rows later, over no gap between the contiguous `piece`s."""
    n = len(residual)
    highest = _highest_order(piece, settings)
    covariance = np.empty(highest + 1)
    for lag in range(highest + 1):
        same = piece[lag:] == piece[: n - lag]
        products = residual[lag:][same] * residual[: n - lag][same]
        covariance[lag] = products.mean() if len(products) else 0.0
    return covariance


def _highest_order(piece: Index, settings: NoiseSettings) -> int:
    """The longest memory that rows of these contiguous `piece`s (n,) can tell."""
    return int(min(settings.highest_order, np.bincount(piece).max() // settings.rows_a_lag))


def autoregression(covariance: Array, rows: int, settings: NoiseSettings = DEFAULT.noise) -> Array:
    """Coefficients of the autoregression with a given `covariance` (p + 1,) at lags 0 to p, by the recursion of
    Levinson and Durbin, of the order that Schwarz's criterion prefers for so many `rows`.

    The same numbers as `statsmodels.tsa.stattools.levinson_durbin` gives; its estimators (`yule_walker`, `burg`,
    `ar_select_order`) know neither gaps nor weights, by which this covariance was taken. `settings` are the
    thresholds.
    """
    best, best_score, error, ar = np.zeros(0), np.inf, covariance[0], np.zeros(0)
    for order in range(len(covariance)):
        if order:
            reflection = (covariance[order] - ar @ covariance[order - 1 : 0 : -1]) / error
            reflection = float(np.clip(reflection, -settings.largest_reflection, settings.largest_reflection))
            ar = np.r_[ar - reflection * ar[::-1], reflection]
            error *= 1 - reflection**2
        score = rows * np.log(max(error, TINY)) + order * np.log(rows)
        if score < best_score - settings.bic_margin:
            best, best_score = ar, score
    return best
