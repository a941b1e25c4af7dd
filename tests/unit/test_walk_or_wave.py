"""What may be noise though it is many times what neighbours show: a walk, and nothing that is smooth."""

from types import SimpleNamespace

import numpy as np
import pytest

from hdopt.diagnosis.inference.neighbour_noise import is_a_walk
from hdopt.diagnosis.settings import DEFAULT

ROWS = 12_000
TIME = np.arange(ROWS)
RNG = np.random.default_rng(11)
WHITE = 0.01 * RNG.normal(size=ROWS)


def walk(length):
    """A walk with a return, of scatter 0.1, that forgets over `length` rows (Ornstein, Uhlenbeck 1930)."""
    keeps = np.exp(-1 / length)
    x = np.empty(ROWS)
    x[0] = 0.1 * RNG.normal()
    for i, step in enumerate(0.1 * np.sqrt(1 - keeps**2) * RNG.normal(size=ROWS - 1)):
        x[i + 1] = keeps * x[i] + step
    return x


def is_walk(left, pieces=1):
    rows = SimpleNamespace(piece=np.repeat(np.arange(pieces), len(left) // pieces))
    return is_a_walk(rows, left, DEFAULT.walk)


@pytest.mark.parametrize("length", [20, 60, 150])
@pytest.mark.parametrize("sensor", [0.0, 1.0])
def test_a_walk_of_any_memory_may_be_noise(length, sensor):
    """Scatter 5 to 15 times that of neighbours. Fault caught: noise with a memory of a turn is called unknown."""
    assert is_walk(walk(length) + sensor * WHITE)


def test_white_noise_may_be_noise():
    assert is_walk(WHITE)


WAVES = {
    "sweep": 0.14 * np.sin(2 * np.pi * TIME * (0.005 + 0.03 * TIME / ROWS)),
    "tone": 0.14 * np.sin(0.11 * TIME),
    "square": 0.1 * np.sign(np.sin(0.013 * TIME)),
    "drift": 0.3 * (TIME / ROWS) ** 2,
    "jumps": 0.3 * (np.searchsorted([3000, 5000, 9000], TIME) % 2),
    "pulses": np.where(RNG.random(ROWS) < 0.02, 1.0, 0.0),
    "band": np.convolve(RNG.normal(size=ROWS), np.hanning(60) * np.cos(0.4 * np.arange(60)), "same") / 40,
    "sum of a walk": 0.05 * np.convolve(walk(5), np.ones(40), "same"),
}


@pytest.mark.parametrize("name", WAVES)
def test_what_is_smooth_or_seldom_is_no_noise(name):
    """Fault caught: a sweep of frequencies is taken for the bench's noise."""
    assert not is_walk(WAVES[name] + WHITE)
    assert not is_walk(WAVES[name] + 0.1 * WHITE)


def test_a_difference_reaches_over_no_gap():
    """One walk cut into pieces at other levels, which hold enough rows for short differences only."""
    left = walk(60)
    assert is_walk(left, pieces=4)
    assert not is_walk(left, pieces=ROWS // 6)
