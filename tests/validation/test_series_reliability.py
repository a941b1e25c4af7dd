"""Rare events with several design points, whose probabilities others published or quadrature gives."""

import numpy as np
import pytest

from hdopt.tolerance.distributions import Normal
from hdopt.tolerance.space import InputSpace, Tolerance
from hdopt.tolerance.tail import tail_probability

STANDARD = InputSpace({name: Tolerance(Normal(std=1.0)) for name in ("x", "y")})


def two_planes(u):
    """Two planes at distance 3 whose normals have the cosine 1/sqrt 3: P(max > 3) = 1 - Phi2(3, 3; 1/sqrt 3)."""
    rho = 1 / np.sqrt(3)
    return np.maximum(u[:, 0], rho * u[:, 0] + np.sqrt(1 - rho**2) * u[:, 1])


def four_branches(u, p=7.0):
    """The four-branch series system (Waarts 2000), p = 7; failure above 0."""
    x, y = u.T
    bowl = 3 + 0.1 * (x - y) ** 2
    along, across = (x + y) / np.sqrt(2), x - y
    return -np.minimum.reduce([bowl - along, bowl + along, across + p / np.sqrt(2), p / np.sqrt(2) - across])


@pytest.mark.parametrize(
    ("response", "limit", "probability"),
    [(two_planes, 3.0, 2.5755978e-3), (four_branches, 0.0, 2.2227950662e-3)],
)
def test_probability(response, limit, probability):
    result = tail_probability(response, STANDARD, limit, seed=0, level_size=60_000)
    assert result.probability == pytest.approx(probability, rel=0.03)  # the interval's half width is about 1.5 %
    assert (result.high - result.low) / 2 < 0.03 * probability
    assert result.method == "subset simulation"


@pytest.mark.parametrize(
    ("response", "limit", "probability"),
    [(two_planes, 3.0, 2.5755978e-3), (four_branches, 0.0, 2.2227950662e-3)],
)
def test_intervals_cover_the_truth(response, limit, probability):
    """24 seeds at 95 %: fewer than 20 hits come up once in 200 trials of an honest interval."""
    results = [tail_probability(response, STANDARD, limit, seed=seed, level_size=4000) for seed in range(24)]
    assert sum(result.low <= probability <= result.high for result in results) >= 20


def test_probability_of_one_in_ten_million():
    """A plane at distance 5.2 in twelve dimensions: 1 - Phi(5.2) = 9.9644e-8."""
    space = InputSpace({f"x{i}": Tolerance(Normal(std=1.0)) for i in range(12)})
    results = [
        tail_probability(lambda u: u.sum(axis=1) / np.sqrt(12), space, 5.2, seed=seed, level_size=4000)
        for seed in range(6)
    ]
    runs = np.concatenate([result.replicates for result in results])
    assert abs(runs.mean() - 9.9644e-8) < 4 * runs.std() / np.sqrt(len(runs))  # four standard errors of 96 runs
    assert runs.std() / np.sqrt(len(runs)) < 0.05 * 9.9644e-8
    # fewer than 4 of 6 intervals of 95 % miss once in 400 trials
    assert sum(result.low <= 9.9644e-8 <= result.high for result in results) >= 4
