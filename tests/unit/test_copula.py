"""The Gaussian copula: marginals stay, correlation arrives, impossible matrices are refused."""

import numpy as np
import pytest
from scipy import special

from hdopt.errors import HdoptError
from hdopt.tolerance.copula import CorrelationGroup, GaussianCopula

NAMES = ("a", "b", "c")
MATRIX = [[1, -0.6], [-0.6, 1]]


def test_correlates_its_group_and_nothing_else():
    copula = GaussianCopula(NAMES, (CorrelationGroup(("c", "a"), MATRIX),))
    u = np.random.default_rng(0).random((200_000, 3))
    scores = special.ndtri(copula.correlate(u))
    # 200000 pairs: the correlation's standard error is 0.0022 at most
    assert np.corrcoef(scores.T) == pytest.approx(copula.correlation, abs=0.01)
    assert scores.std(axis=0) == pytest.approx(1, abs=0.01)
    assert copula.correlate(u)[:, 1] == pytest.approx(u[:, 1])


def test_conditional_draws_have_the_joint_distribution():
    copula = GaussianCopula(NAMES, (CorrelationGroup(NAMES, [[1, 0.5, 0.2], [0.5, 1, -0.4], [0.2, -0.4, 1]]),))
    noise = np.random.default_rng(1).standard_normal((2, 200_000, 3))
    scores = copula.condition((), noise[0], noise[0])
    redrawn = copula.condition((1,), scores, noise[1])
    assert redrawn[:, 1] == pytest.approx(scores[:, 1])
    assert np.corrcoef(redrawn.T) == pytest.approx(copula.correlation, abs=0.01)
    assert copula.condition((0, 1, 2), scores, noise[1]) == pytest.approx(scores)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: CorrelationGroup(NAMES, [[1, 0.9, -0.9], [0.9, 1, 0.9], [-0.9, 0.9, 1]]), "not positive definite"),
        (lambda: CorrelationGroup(("a", "b"), [[1, 0.2], [0.3, 1]]), "not symmetric"),
        (lambda: CorrelationGroup(("a", "b"), [[2, 0.2], [0.2, 1]]), "every entry there must be 1"),
        (lambda: CorrelationGroup(("a", "b"), np.eye(3)), r"has shape \(3, 3\); it must be 2 x 2"),
        (lambda: CorrelationGroup(("a", "a"), MATRIX), "at least two, each once"),
        (lambda: GaussianCopula(NAMES, (CorrelationGroup(("a", "d"), MATRIX),)), "unknown input in a correlation"),
        (
            lambda: GaussianCopula(NAMES, (CorrelationGroup(("a", "b"), MATRIX), CorrelationGroup(("b", "c"), MATRIX))),
            "b is in two correlation groups",
        ),
    ],
)
def test_bad_matrices(make, message):
    with pytest.raises(HdoptError, match=message):
        make()
