"""Covariance of a sum of scores that hang together over some neighbours (Newey and West, Econometrica 55, 1987), and
how far an interval must reach that rests on it (Kiefer and Vogelsang, Econometric Theory 21, 2005).

The same to the last digit as statsmodels' `S_hac_groupsum`, which would bring 63 MB for these four lines:
`python -m tests.benchmarks.robust_covariance` (it needs statsmodels).
"""

from __future__ import annotations

from hdopt.arrays import Array

BARTLETT_95 = (1.9600, 2.9694, 0.4160, -0.5324)
"""Two-sided 95 % point as a polynomial of the share that the weights reach over (there Table 1, Bartlett's kernel)."""


def newey_west(scores: Array, lags: int) -> Array:
    """Covariance (q, q) of the sum of `scores` (n, q), in order, each hanging together with `lags` before and behind
    it, by Bartlett's falling weights."""
    covariance: Array = scores.T @ scores
    for lag in range(1, lags + 1):
        across = scores[lag:].T @ scores[:-lag]
        covariance += (1 - lag / (lags + 1)) * (across + across.T)
    return covariance


def reach_95(lags: int, count: int) -> float:
    """Standard deviations by `newey_west` to either side that make a 95 % interval, of `count` scores that hang
    together over so many `lags`, up to all of them: 1.96 where the scores are many, 4.81 where all count with each."""
    share = min((lags + 1) / count, 1.0)
    return sum(factor * share**power for power, factor in enumerate(BARTLETT_95))
