"""Shapley effects of a linear response to correlated Gaussian inputs: Owen and Prieur 2017, Iooss and Prieur 2019."""

import pytest

from hdopt.errors import HdoptError
from hdopt.tolerance.copula import CorrelationGroup
from hdopt.tolerance.distributions import Normal
from hdopt.tolerance.sensitivity import run_shapley, run_sobol
from hdopt.tolerance.space import InputSpace, Tolerance


@pytest.fixture(scope="module")
def space():
    tolerances = {name: Tolerance(Normal(std=std)) for name, std in (("x1", 1), ("x2", 1), ("x3", 2))}
    return InputSpace(tolerances, (CorrelationGroup(("x2", "x3"), [[1, 0.9], [0.9, 1]]),))


def test_effects_of_three_inputs(space):
    """beta = 1, sigma = (1, 1, 2), rho23 = 0.9."""
    result = run_shapley(lambda x: x.sum(axis=1), space, n=2**15, seed=0)
    values = [effect.value for effect in result.effects.values()]
    assert values == pytest.approx([0.104167, 0.418229, 0.477604], abs=0.001)  # 95 % half width: 0.0003
    assert sum(values) == pytest.approx(1, abs=1e-12)
    # closed form: Var E(Y | X3) / Var Y = (sigma3 + rho sigma2)^2 / 9.6, E Var(Y | X1, X2) = (1 - rho^2) sigma3^2
    assert result.indices["x3"].S1.value == pytest.approx(2.9**2 / 9.6, abs=0.003)
    assert result.indices["x3"].ST.value == pytest.approx((1 - 0.81) * 4 / 9.6, abs=0.003)


def test_sobol_indices_are_refused_for_correlated_inputs(space):
    with pytest.raises(HdoptError, match="x2, x3 are correlated: use Shapley"):
        run_sobol(lambda x: x.sum(axis=1), space)
