"""Covariance of a sum of scores that hang together over some neighbours (Newey and West, Econometrica 55, 1987).

The same to the last digit as statsmodels' `S_hac_groupsum`, which would bring 63 MB for these four lines:
`python -m tests.benchmarks.robust_covariance` (it needs statsmodels).
"""

from __future__ import annotations

from hdopt.arrays import Array


def newey_west(scores: Array, lags: int) -> Array:
    """Covariance (q, q) of the sum of `scores` (n, q), in order, each hanging together with `lags` before and behind
    it, by Bartlett's falling weights."""
    covariance: Array = scores.T @ scores
    for lag in range(1, lags + 1):
        across = scores[lag:].T @ scores[:-lag]
        covariance += (1 - lag / (lags + 1)) * (across + across.T)
    return covariance
