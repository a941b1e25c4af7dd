"""Sines of one shaft that are finer than a spline's waves: found at their order, kept at their size, in no table."""

import numpy as np
import pytest

from hdopt.compensation.pursuit import dictionary, pursue
from hdopt.compensation.surface import COARSE, Harmonics, surface_of

RATIO, TURN, NOISE = 80, 2 * np.pi, 0.02
SIZE = 0.03
"""arcmin: in the noise of every row, plain in all of them."""


def travelled(turns, per_turn=100, back=True):
    one = np.arange(round(turns * per_turn)) * TURN / per_turn
    return np.r_[one, one[::-1]] if back else one


def pursued(theta, error, ratio=RATIO):
    noisy = error + np.random.default_rng(1).normal(0, NOISE, len(theta))
    return pursue((theta, theta / ratio), noisy, np.ones((len(theta), 1)), None, dictionary(1.0), 20)


@pytest.mark.parametrize(
    ("pair", "ratio", "turns"),
    [
        ((0, 500), 80, 63),
        ((0, 1000), 80, 80),
        ((0, 2500), 80, 85),
        ((16, 0), 80, 63),
        ((32, 0), 80.5, 90),
        ((0, 200), 7.2, 8),
    ],
)
def test_an_encoders_lines_are_found(pair, ratio, turns):
    """Would catch orders beyond 10 of either shaft left out, and a whole order of the input named by the output."""
    theta = travelled(turns)
    k, j = pair
    error = 0.2 * np.cos(2 * theta) + SIZE * np.cos(k * theta + j * theta / ratio + 0.4)
    found = pursued(theta, error, ratio)
    assert set(zip(found.k.tolist(), found.j.tolist(), strict=True)) == {(2, 0), pair}
    assert found.at(theta, theta / ratio) == pytest.approx(error, abs=0.3 * SIZE)


def test_an_order_beyond_the_rows_is_not_made_up():
    """Of 500 lines 20 rows a turn show 13.75 of an order of 6.25: nothing above 8 orders may be named by them."""
    theta = travelled(63, 20)
    found = pursued(theta, SIZE * np.cos(14 * theta))
    assert (np.abs(found.k + found.j / RATIO) <= 8).all()


def test_what_means_of_samples_dim_is_made_up_for():
    """Two samples a row, 128 rows a turn: order 32 shows 0.92 of itself, order 2 all."""
    true = Harmonics(np.array([2, 0]), np.array([1, 2500]), np.array([0.2, 0.1]), np.array([0.0, 0.1]))
    theta = np.arange(80 * 256) * TURN / 256
    rows = true.at(theta, theta / RATIO).reshape(-1, 2).mean(axis=1)
    middle = theta.reshape(-1, 2).mean(axis=1)
    phases = [k * middle + j * middle / RATIO for k, j in zip(true.k, true.j, strict=True)]
    columns = np.column_stack([*np.cos(phases), *np.sin(phases)])
    fitted = np.linalg.lstsq(columns, rows, rcond=None)[0]
    mended = Harmonics(true.k, true.j, fitted[:2], fitted[2:]).sharpened(RATIO, TURN / 128, 2)
    assert np.hypot(fitted[1], fitted[3]) < 0.95 * np.hypot(true.cos[1], true.sin[1])
    assert mended.cos == pytest.approx(true.cos, abs=1e-9)
    assert mended.sin == pytest.approx(true.sin, abs=1e-9)


def test_a_table_holds_only_what_its_cells_hold():
    """Would catch 500 waves written into 96 cells as a slow wave that is not there."""
    both = Harmonics(np.array([2, 0]), np.array([1, 500]), np.array([0.2, 0.1]), np.array([0.0, 0.0]), back=0.05)
    held, fine = both.for_table(COARSE)
    assert (held.k.tolist(), fine.j.tolist(), held.back, fine.back) == ([2], [500], 0.05, 0.0)
    theta = travelled(80, back=False)
    on_table = surface_of([held]).at(theta, theta / RATIO)
    assert np.ptp(both.at(theta, theta / RATIO) - on_table) < 1.05 * fine.reach
