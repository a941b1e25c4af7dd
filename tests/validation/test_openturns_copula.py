"""Our Gaussian copula against OpenTURNS' (`NormalCopula`), an independent implementation of the same."""

import numpy as np

from tests.benchmarks.distributions import copulas


def test_the_same_dependent_uniforms():
    """To rounding: both are a Cholesky factor between two normal distribution functions."""
    u = np.random.default_rng(0).random((2000, 3))
    ours, theirs = (transform(u) for transform in copulas().values())
    np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-14)
