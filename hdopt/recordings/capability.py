"""Many drives of one type: performance against a limit, outliers, and the share of the gauge in the scatter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

FEWEST_FOR_PPK = 8
"""Fewer drives say too little of a scatter to give a performance."""
OUTLIER_SCORE = 3.5
"""Modified z-score beyond which a drive is named (Iglewicz and Hoaglin, 1993)."""
REFERENCE = 3.0
"""Standard deviations of the logarithm up to X99.865."""


@dataclass(frozen=True)
class Performance:
    """Ppk of an upper limit (ISO 22514-2, percentiles of a log-normal distribution), with its 95 % interval."""

    ppk: float
    low: float
    high: float
    n: int


def performance(values: Sequence[float], limit: float, seed: int = 1) -> Performance | None:
    """Ppk of positive `values` against an upper `limit`; None below eight drives, and where all are alike: without any
    scatter nothing is said of the next drive.

    (U - X50)/(X99.865 - X50) of a log-normal distribution fitted to the values: a peak-to-peak is positive and skewed.
    The interval is a parametric bootstrap of 2000 draws from `seed`.
    """
    log = np.log(np.asarray(values, float))
    n = len(log)
    if n < FEWEST_FOR_PPK or not np.isfinite(log).all() or np.ptp(log) == 0:
        return None
    mean, spread = float(log.mean()), float(log.std(ddof=1))
    rng = np.random.default_rng(seed)
    draws = rng.normal(mean, spread, (2000, n))
    means, spreads = draws.mean(axis=1), draws.std(axis=1, ddof=1)
    # The basic bootstrap on log scale: the parametric one alone is biased for small n.
    found = np.array([_ppk(m, s, limit) for m, s in zip(means, spreads, strict=True)])
    low, high = np.quantile(found, [0.025, 0.975])
    return Performance(_ppk(mean, spread, limit), float(low), float(high), n)


def _ppk(mean: float, spread: float, limit: float) -> float:
    median, upper = math.exp(mean), math.exp(mean + REFERENCE * spread)
    return (limit - median) / (upper - median) if upper > median else math.inf


def outliers(values: Sequence[float]) -> list[int]:
    """Numbers of those `values` (positive) whose logarithm lies far from the median, by the modified z-score."""
    log = np.log(np.asarray(values, float))
    if len(log) < 5:
        return []
    off = log - np.median(log)
    scale = float(np.median(np.abs(off)))
    if scale == 0:
        return [int(k) for k in np.flatnonzero(off != 0)]
    return [int(k) for k in np.flatnonzero(np.abs(0.6745 * off / scale) > OUTLIER_SCORE)]


@dataclass(frozen=True)
class Gauge:
    """Repeatability and reproducibility (standard deviations, arcmin) of repeated mountings, one-way analysis of
    variance (ISO 22514-7, random effects)."""

    repeatability: float
    reproducibility: float
    mountings: int
    repeats: int

    @property
    def total(self) -> float:
        """Both together, arcmin."""
        return math.hypot(self.repeatability, self.reproducibility)


def gauge(values: Sequence[float], mounting: Sequence[str]) -> Gauge | None:
    """Scatter within and between mountings of `values` (arcmin), `mounting` the label of each.

    None where there are not two mountings, one of them with two recordings.
    """
    groups = [
        np.array([v for v, m in zip(values, mounting, strict=True) if m == name]) for name in dict.fromkeys(mounting)
    ]
    n = sum(len(g) for g in groups)
    if len(groups) < 2 or n <= len(groups):
        return None
    within = sum(float(((g - g.mean()) ** 2).sum()) for g in groups) / (n - len(groups))
    mean = float(np.concatenate(groups).mean())
    between = sum(len(g) * (float(g.mean()) - mean) ** 2 for g in groups) / (len(groups) - 1)
    size = (n - sum(len(g) ** 2 for g in groups) / n) / (len(groups) - 1)
    return Gauge(math.sqrt(within), math.sqrt(max(between - within, 0.0) / size), len(groups), n)
