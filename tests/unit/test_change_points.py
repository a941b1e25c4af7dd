"""Steps of a residual: where they stand, how high they are, and what is none."""

import numpy as np
import pytest

from hdopt.diagnosis.inference.change_points import _step, find_steps

NOISE = np.random.default_rng(6).normal(0, 0.1, 2000)
ROW = np.arange(2000)


def test_a_step_is_taken_out_where_it_stands_and_as_high_as_it_is():
    rows, left = find_steps(NOISE + 1.5 * (ROW >= 731))
    assert rows == [731]
    assert np.std(left) == pytest.approx(np.std(NOISE), rel=0.02)


def test_two_steps_and_the_clearer_first():
    rows, left = find_steps(NOISE + 0.8 * (ROW >= 400) - 2.0 * (ROW >= 1500))
    assert rows == [1500, 400]
    assert np.std(left) == pytest.approx(np.std(NOISE), rel=0.02)


@pytest.mark.parametrize("slope", [0.0, 0.002, 0.01])
def test_noise_and_a_slope_are_no_steps(slope):
    assert find_steps(NOISE + slope * ROW)[0] == []


def test_a_slope_within_a_window_is_no_step():
    """Halves of a ramp differ as those of a step do, but a straight line leaves nothing."""
    assert _step(np.linspace(0, 3, 160), 8)[1] is None
    at, height = _step(np.where(np.arange(160) >= 71, 3.0, 1.0), 8)
    assert (at, height) == (71, pytest.approx(2.0))
