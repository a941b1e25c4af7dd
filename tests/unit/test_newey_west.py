"""The robust covariance against its definition, a double sum over all pairs of scores."""

import numpy as np
import pytest

from hdopt.diagnosis.inference.newey_west import newey_west


@pytest.mark.parametrize("lags", [0, 1, 4])
def test_it_is_the_weighted_sum_over_all_pairs(lags):
    """To rounding. Would catch a weight that is off by a lag, or a pair counted once."""
    scores = np.random.default_rng(0).normal(size=(30, 3))
    wanted = np.zeros((3, 3))
    for s, one in enumerate(scores):
        for t, other in enumerate(scores):
            wanted += max(0.0, 1 - abs(s - t) / (lags + 1)) * np.outer(one, other)
    np.testing.assert_allclose(newey_west(scores, lags), wanted, rtol=1e-12, atol=1e-12)
