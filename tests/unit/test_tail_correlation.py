"""A tail of correlated inputs: the sum of two normals, whose tail is known in closed form."""

import numpy as np
import pytest
from scipy import stats

from hdopt.tolerance.copula import CorrelationGroup
from hdopt.tolerance.distributions import Normal
from hdopt.tolerance.space import InputSpace, Tolerance
from hdopt.tolerance.tail import tail_probability


@pytest.mark.parametrize("rho", [-0.6, 0.0, 0.8])
def test_tail_of_a_sum_of_two_correlated_normals(rho):
    group = (CorrelationGroup(("a", "b"), np.array([[1.0, rho], [rho, 1.0]])),) if rho else ()
    space = InputSpace({name: Tolerance(Normal(std=1.0)) for name in "ab"}, group)
    spread = np.sqrt(2 + 2 * rho)
    limit = 3.5 * spread
    found = tail_probability(lambda x: x.sum(axis=1), space, limit, seed=3, replicates=8, level_size=4000)
    exact = stats.norm.sf(3.5)
    # Eight runs of 4000 points a level, four levels: a standard error near 5 % (Au, Beck 2001), three of them allowed.
    # Without its correlation the tail at rho = 0.8 would be forty times rarer, at -0.6 twelve times more frequent.
    assert found.probability == pytest.approx(exact, rel=0.2)
