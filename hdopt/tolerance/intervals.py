"""Confidence intervals that fit the sampling: Student's t over independent scramblings, Clopper-Pearson and order
statistics for independent points."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from hdopt.arrays import Array

CONFIDENCE = 0.95


@dataclass(frozen=True)
class IntervalEstimate:
    """A value with its two-sided interval, and how the interval was made."""

    value: float
    low: float
    high: float
    interval: str = ""
    confidence: float = CONFIDENCE

    def to_dict(self) -> dict[str, float]:
        return {"value": self.value, "low": self.low, "high": self.high}

    def map(self, function: Callable[[float], float]) -> IntervalEstimate:
        """The estimate of `function` of the value, which must rise or fall throughout the interval."""
        low, high = sorted((function(self.low), function(self.high)))
        return IntervalEstimate(function(self.value), low, high, self.interval, self.confidence)


def student_half_width(replicates: Sequence[float] | Array, confidence: float = CONFIDENCE) -> float:
    """Half the width of the t-interval of the mean of independent, equally weighted estimates.

    `replicates` (R,), R >= 2, are the estimates; `confidence` is the probability that the two-sided interval holds the
    true mean where they are normal.
    """
    count = len(replicates)
    quantile = float(special.stdtrit(count - 1, 0.5 + confidence / 2))
    return quantile * float(np.std(replicates, ddof=1)) / math.sqrt(count)


def over_scramblings(
    replicates: Sequence[float] | Array, value: float | None = None, confidence: float = CONFIDENCE
) -> IntervalEstimate:
    """t-interval over scramblings, from one estimate of each (`replicates`, shape (R,), R >= 2) at `confidence`.

    `value` is the estimate of all points together where that differs from the mean; the interval lies about it.
    """
    half = student_half_width(replicates, confidence)
    value = float(np.mean(replicates)) if value is None else value
    return IntervalEstimate(
        value, value - half, value + half, f"t over {len(replicates)} independent scramblings", confidence
    )


def clopper_pearson(hits: int, n: int, confidence: float = CONFIDENCE) -> IntervalEstimate:
    """Share of `hits` in `n` independent trials (n >= 1) with its exact interval (Clopper and Pearson 1934).

    Either side misses the true share with a probability of at most (1 - `confidence`)/2, whatever that share is.
    """
    tail = (1 - confidence) / 2
    low = 0.0 if hits == 0 else float(special.betaincinv(hits, n - hits + 1, tail))
    high = 1.0 if hits == n else float(special.betaincinv(hits + 1, n - hits, 1 - tail))
    return IntervalEstimate(hits / n, low, high, "Clopper-Pearson", confidence)


def order_statistic_ranks(q: float, n: int, confidence: float = CONFIDENCE) -> tuple[int, int]:
    """Ranks (from 1) of the sorted sample that enclose the quantile `q`; 0 or n + 1 where no value does.

    The number of values below the quantile is binomial (n, q); each side misses with at most (1 - confidence)/2.
    """
    tail = (1 - confidence) / 2
    mean, spread = n * q, math.sqrt(n * q * (1 - q)) + 1
    first, last = max(int(mean - 10 * spread), 0), min(int(mean + 10 * spread) + 1, n)
    counts = np.arange(first, last + 1)
    below = special.bdtr(counts, n, q)  # P(B <= k)
    low = int(first + np.searchsorted(below, tail, side="right"))  # largest l with P(B <= l - 1) <= tail
    high = int(first + np.searchsorted(below, 1 - tail, side="left")) + 1  # smallest h with P(B <= h - 1) >= 1 - tail
    return low, high


NO_SAMPLE = 10**18
"""Larger than any sample."""


def smallest_n(q: float, confidence: float = CONFIDENCE) -> int:
    """The smallest sample whose order statistics enclose the quantile `q` on both sides at this confidence; `NO_SAMPLE`
    where it would be larger still."""
    tail = (1 - confidence) / 2
    return math.ceil(min(math.log(tail) / math.log1p(-min(q, 1 - q)), NO_SAMPLE))
