"""Slow waves, wander and sudden steps, part by part: what counts as slow, as a line, as a step, and where."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from hdopt.diagnosis.checks import slow_wander, step_detection
from hdopt.diagnosis.settings import DEFAULT

WANDER, STEPS = DEFAULT.wander, DEFAULT.steps
TURN = 2 * np.pi


class Rows(SimpleNamespace):
    def __len__(self):
        return len(self.theta)


def rows_of(turns=40, rate=60, direction=None, piece=None):
    theta = np.arange(turns * rate) * TURN / rate
    n = len(theta)
    return Rows(
        theta=theta,
        direction=np.ones(n) if direction is None else direction,
        piece=np.zeros(n, int) if piece is None else piece,
        record=np.zeros(n, int),
        rows_per_turn=float(rate),
        ratio=80.0,
    )


def test_means_are_of_quarters_of_a_turn_and_end_at_reversals_and_gaps():
    """Four a turn; a row on the border belongs to the next. A reversal and a gap within a quarter begin new ones."""
    assert np.array_equal(slow_wander._cells(rows_of(2, 8), 4), np.arange(16) // 2)
    turned = rows_of(1, 16, direction=np.r_[np.ones(6), -np.ones(10)], piece=(np.arange(16) >= 9).astype(int))
    cells = slow_wander._cells(turned, 4)
    assert set(np.flatnonzero(np.diff(cells)) + 1) == {4, 6, 8, 9, 12}
    means = slow_wander._Means(rows_of(2, 8), WANDER)
    np.testing.assert_allclose(means.of(np.arange(16.0)), np.arange(8) * 2 + 0.5)
    np.testing.assert_allclose(means.of(np.column_stack([np.arange(16.0)] * 2))[:, 1], np.arange(8) * 2 + 0.5)


@pytest.mark.parametrize(("cycles", "slow"), [(1.0, True), (8.0, True), (20.0, False), (40.0, False)])
def test_slow_is_what_means_over_two_turns_still_hold_half_of(cycles, slow):
    """Waves of so many cycles in forty turns: the mean over two turns keeps sinc^2(cycles/20) of their power, half of
    it at nine. Fault caught: a locked input, of which nothing is slow, and another term than the one asked of."""
    rows = rows_of()
    rows.locked = False
    wave = np.sin(TURN * cycles * np.arange(len(rows)) / len(rows) + 0.3) + 2.0
    problem = SimpleNamespace(rows=rows, settings=SimpleNamespace(wander=WANDER))
    fit = SimpleNamespace(problem=problem, contribution=[np.zeros(len(rows)), wave].__getitem__)
    assert slow_wander.is_slow(fit, 1) is slow
    rows.locked = True
    assert not slow_wander.is_slow(fit, 1)


def line_of(size, cycles=20, n=400, seed=0):
    """A wave of so many cycles in a wander of 1; means every 0.25 s."""
    noise = np.random.default_rng(seed).normal(size=n)
    wander = np.zeros(n)
    for i in range(1, n):
        wander[i] = 0.6 * wander[i - 1] + noise[i]
    along = np.arange(n) / n
    return slow_wander._line(0.25 * np.arange(n), wander + size * np.sin(TURN * cycles * along + 0.4), WANDER)


def test_a_line_far_above_the_wander_beside_it_has_its_period_and_size():
    """2.5 arcmin in 20 cycles over 100 s: 5 s each. What its neighbours add to the rms is the wander there."""
    wave = line_of(2.5)
    assert wave.period == pytest.approx(5.0, rel=0.01)
    assert wave.rms == pytest.approx(2.5 / np.sqrt(2), rel=0.1)
    assert line_of(0.0) is None
    assert line_of(0.3) is None
    assert line_of(1.6) is None  # thirty times the wander beside it, of sixty that are asked


def test_a_line_is_not_of_fewer_than_three_periods_nor_faster_than_a_turn():
    """Two periods are a trend; of four means a turn 100 turns hold 100 cycles at most."""
    assert line_of(20.0, cycles=2) is None
    assert line_of(5.0, cycles=130) is None
    assert line_of(5.0, cycles=90) is not None
    assert line_of(5.0, cycles=5, n=WANDER.fewest_means - 1) is None


def test_a_walk_keeps_its_root_where_a_trend_was_fitted():
    """The coefficient by least squares, and Kendall's bias of (2 + 4 a)/n added, no further than to a walk."""
    rng = np.random.default_rng(1)
    n = 300
    values = np.zeros(n)
    for i in range(1, n):
        values[i] = 0.5 * values[i - 1] + rng.normal()
    ar, usable = slow_wander._autoregression(values, np.zeros(n, int), 1)
    plain = values[1:] @ values[:-1] / (values[:-1] @ values[:-1])
    assert usable.tolist() == [False] + [True] * (n - 1)
    assert ar == pytest.approx([plain + (2 + 4 * plain) / (n - 1)])
    walk, _ = slow_wander._autoregression(np.cumsum(rng.normal(size=60)) + 40.0, np.zeros(60, int), 1)
    assert walk[0] <= 1.0
    white, _ = slow_wander._autoregression(rng.normal(size=n), np.zeros(n, int), 2)
    assert len(white) == 0


def test_a_past_is_of_ones_own_recording():
    values = np.random.default_rng(1).normal(size=20)
    _, usable = slow_wander._autoregression(values, np.repeat([0, 1], 10), 2)
    assert np.flatnonzero(~usable).tolist() == [0, 1, 10, 11]
    filtered = slow_wander._filtered(values, np.array([0.5, 0.2]), usable)
    expected = [values[i] - 0.5 * values[i - 1] - 0.2 * values[i - 2] for i in np.flatnonzero(usable)]
    np.testing.assert_allclose(filtered, expected)


def test_what_columns_leave_over_does_not_depend_on_their_size():
    target = np.random.default_rng(2).normal(size=50)
    columns = np.column_stack([np.ones(50), 1e-9 * np.arange(50.0), np.zeros(50)])
    line = np.polyfit(np.arange(50.0), target, 1)
    left = target - np.polyval(line, np.arange(50.0))
    assert slow_wander._left_over(columns, target) == pytest.approx(left @ left)


# sudden steps


def test_a_scatter_is_that_of_the_bulk():
    values = np.random.default_rng(0).normal(0, 0.3, 100_000)
    values[::50] = 100.0
    assert step_detection._scatter(values) == pytest.approx(0.3, rel=0.05)


def test_a_step_is_scored_by_its_trace_in_units_of_its_turn():
    """White rows of 0.1 in one turn and 0.4 in the next, in each a single row of 2: 20 and 5 of its scatter."""
    rng = np.random.default_rng(0)
    block = np.arange(2000) // 1000
    white = rng.normal(0, np.where(block, 0.4, 0.1))
    white[[500, 1500]] = 2.0
    scores = step_detection._scores(white, np.eye(16)[0], block)
    assert scores[[500, 1500]] == pytest.approx([20.0, 5.0], rel=0.1)
    assert len(scores) == 2000 - 15


def test_rows_about_a_reversal_are_left_out():
    """Sixteen before it, a twentieth of a turn after it."""
    direction = np.r_[np.ones(300), -np.ones(300)]
    near = step_detection._near_an_edge(rows_of(10, 60, direction=direction), STEPS)
    assert np.flatnonzero(near).tolist() == list(range(300 - STEPS.reach, 303))


def test_the_largest_of_neighbouring_rows_is_the_step():
    size = np.zeros(60)
    size[[20, 22, 40]] = 6.0, 9.0, 7.0
    assert step_detection._separate(size, size > 0, 16).tolist() == [22, 40]
    assert step_detection._separate(size, size > 8, 16).tolist() == [22]


@pytest.mark.parametrize(
    ("angle", "set_by"),
    [
        (lambda k: TURN * k + 0.1 * np.sin(9 * k), True),
        (lambda k: np.pi * k + 0.1 * np.sin(9 * k), True),
        (lambda k: (TURN * k + 0.1 * np.sin(9 * k)) / (1 + 1 / 80), True),
        (lambda k: TURN * k * 0.618, False),
    ],
)
def test_steps_that_come_back_at_an_angle_are_the_drives(angle, set_by):
    """Of the input or the flexspline, once or twice a turn; by the golden section at none."""
    record = SimpleNamespace(theta=angle(np.arange(200)), ratio=80.0)
    rows = np.arange(30) * 5
    assert step_detection._set_by_angle(record, rows, STEPS) is set_by
    few = step_detection._set_by_angle(record, rows[:8], STEPS)
    assert few is False
