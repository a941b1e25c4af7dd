"""The robust covariance against its definition, a double sum over all pairs of scores."""

import numpy as np
import pytest

from hdopt.diagnosis.inference.newey_west import newey_west, reach_95


@pytest.mark.parametrize("lags", [0, 1, 4])
def test_it_is_the_weighted_sum_over_all_pairs(lags):
    """To rounding. Would catch a weight that is off by a lag, or a pair counted once."""
    scores = np.random.default_rng(0).normal(size=(30, 3))
    wanted = np.zeros((3, 3))
    for s, one in enumerate(scores):
        for t, other in enumerate(scores):
            wanted += max(0.0, 1 - abs(s - t) / (lags + 1)) * np.outer(one, other)
    np.testing.assert_allclose(newey_west(scores, lags), wanted, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("count", "lags"), [(40, 7), (100, 9), (200, 9)])
def test_an_interval_of_few_independent_neighbours_reaches_farther(count, lags):
    """Means of white noise lie within so many standard deviations of zero in 95 of 100 samples; with 1.96 they do in 87
    to 93. Of 20,000 samples the share is known to 0.15 %; the polynomial is for many scores, of which a share hangs
    together: 1 % for 40 of them.
    """
    noise = np.random.default_rng(1).standard_normal((20_000, count))
    scores = noise - noise.mean(axis=1, keepdims=True)
    variance = sum(
        (1 if lag == 0 else 2 * (1 - lag / (lags + 1))) * np.sum(scores[:, lag:] * scores[:, : count - lag], axis=1)
        for lag in range(lags + 1)
    )
    away = np.abs(noise.sum(axis=1)) / np.sqrt(variance)
    assert np.mean(away < reach_95(lags, count)) == pytest.approx(0.95, abs=0.01)
    assert np.mean(away < 1.96) < 0.94


def test_an_interval_of_many_scores_is_that_of_the_normal_distribution():
    assert reach_95(10, 10**9) == pytest.approx(1.96, abs=1e-6)
    assert reach_95(5, 3) == reach_95(2, 3) == pytest.approx(4.813)
