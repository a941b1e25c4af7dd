"""What averaged rows leave of those recorded: the noise there, and what shapes of the low orders may leave in it."""

from dataclasses import replace

import numpy as np
import pytest
from test_cross_validation import RATE, TURN, noisy, rows_of, without_base

from hdopt.diagnosis.inference import noise as noise_model
from hdopt.diagnosis.inference.catalogue import explanations
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise, beneath_lines
from hdopt.diagnosis.search.as_recorded import noise_beside_lines, power_left, power_of_steps
from hdopt.effects import EFFECTS
from hdopt.effects.term import Term

SIGMA = 0.02


def coloured(n, first, seed=5):
    """Noise of standard deviation `SIGMA` of the innovations, each row `first` times the one before it and its own."""
    rng = np.random.default_rng(seed)
    out = np.zeros(n)
    for row, own in enumerate(rng.normal(0, SIGMA, n)):
        out[row] = first * out[row - 1] + own
    return out


def lines(theta, count, size=0.02):
    """So many lines at whole orders below half the rows a turn, together `size` times sqrt(count) rms."""
    rng = np.random.default_rng(7)
    orders = RATE // 2 - 2 - np.arange(count)
    return sum(size * np.sqrt(2) * np.sin(k * theta + rng.uniform(0, TURN)) for k in orders)


@pytest.mark.parametrize("first", [0.0, 0.6])
def test_noise_is_measured_between_many_lines(first):
    """Forty lines, each as large as the noise, which is white or coloured: 60 turns of which a line takes one part in
    sixty of its order's width. Faults caught: the mean of a band for its median, log 2 forgotten, a covariance of half
    the spectrum, the variance of the whole for that of the innovations."""
    n = 60 * RATE
    rows = rows_of(np.zeros(n))
    own = coloured(n, first)
    found = beneath_lines(rows, own + lines(rows.theta, 40))
    assert found.sigma == pytest.approx(SIGMA, rel=0.06)
    assert np.sum(found.ar) == pytest.approx(first, abs=0.06)
    alone = beneath_lines(rows, own)
    assert alone.sigma == pytest.approx(noise_model.estimate(rows, own).sigma, rel=0.04)


def test_rows_without_a_past_have_no_weight_between_lines():
    """As in any noise: fault caught, the filter reaching over the gap."""
    rows = rows_of(np.zeros(20 * RATE))
    rows = replace(rows, piece=(np.arange(len(rows)) > 500).astype(np.int64))
    found = beneath_lines(rows, coloured(len(rows), 0.6))
    weights = noise_model.weights_with_a_past(rows, len(found.ar))
    assert len(found.ar) and not weights[501]
    np.testing.assert_array_equal(found.root_weight, weights)


def bare_of(error):
    return without_base(rows_of(error), 1.0)


def test_many_lines_are_no_noise_and_few_are_taken_out():
    """Three lines five times as large as the noise are met to a quarter of their width, and what they leave is a tenth
    of the noise. Faults caught: the noise between lines left aside, or taken where a few lines are all that there is.
    """
    n = 60 * RATE
    theta = rows_of(np.zeros(n)).theta
    own = coloured(n, 0.0)
    few, many = own + lines(theta, 3, 0.1), own + lines(theta, 40)
    orders = (10.0, 0.49 * RATE)
    assert noise_beside_lines(bare_of(many), orders).sigma == pytest.approx(SIGMA, rel=0.06)
    plain = bare_of(own)
    lines_out = noise_beside_lines(plain, orders).sigma
    assert 0.95 * SIGMA < lines_out < noise_model.estimate(plain.problem.rows, plain.residual).sigma
    beside_few = noise_beside_lines(bare_of(few), orders).sigma
    assert 1.05 * lines_out < beside_few < 1.12 * lines_out


def test_which_happens_suddenly():
    """Of all that may be named, loops and pulses. Faults caught: one forgotten, a delay or waves of the teeth taken for
    sudden."""
    assert {name for name, one in EFFECTS.items() if one.sudden} == {"hysteresis", "lost_motion", "local_tooth_defect"}
    assert not any(one.sudden for name, one in explanations().items() if name not in EFFECTS)


SLOW, LOOP = 0, 1
TURNS_A_LOOP = 4


@pytest.fixture(scope="module")
def low():
    """A delay of 1 arcmin^2 with a ripple of order 12 in the speed, 0.02 arcmin^2, a loop of 4 arcmin^2 that is crossed
    in a tenth of a turn, a step of 1 arcmin, and a drift that nobody asks for."""
    rows = noisy(20)
    problem = FitProblem(rows, None, np.ones((len(rows), 1)), Noise.white(rows, SIGMA))
    slow = np.sqrt(2) * np.sin(2 * rows.theta) + 0.2 * np.sin(12 * rows.theta)
    loop = np.clip(20 / TURN * np.arcsin(np.sin(rows.theta / TURNS_A_LOOP)) * TURNS_A_LOOP, -1, 1)
    terms = [
        Term("channel_delay", {}, columns=slow[:, None]),
        Term("hysteresis", {}, columns=loop[:, None]),
        Term("_jump", {}, columns=(rows.theta > 60)[:, None] * 1.0),
        Term("thermal_drift", {}, columns=np.sin(15 * rows.theta)[:, None]),
    ]
    return evaluate(problem, np.zeros(0), np.zeros(1), terms, [np.ones(1), np.full(1, 2.0), np.ones(1), np.ones(1)])


def test_what_a_smooth_shape_may_leave_at_high_orders(low):
    """What it has there. Faults caught: its whole power, half of the spectrum's, an order of the wrong row rate, terms
    that were not asked for."""
    assert power_left(low, [SLOW], 10.0) == pytest.approx(0.02, rel=1e-3)
    assert power_left(low, [SLOW], 13.0) == pytest.approx(0.0, abs=1e-9)
    assert power_left(low, [], 10.0) == 0.0
    assert power_left(low, [2], 10.0) == pytest.approx(np.var(low.contribution(2)))


def test_a_loop_may_be_as_sharp_as_steps(low):
    """Of 4 arcmin each time that it is crossed, ten times in twenty turns: by the orders from 10 on of such steps,
    which the spectrum of a loop without width shows, within a third for where in its cell a step stands. Faults caught:
    all of its power, what it has itself, both, 1/(2 pi f)^2 on one side of the spectrum, the height for its square."""
    rows = low.problem.rows
    sharp = 2.0 * np.sign(low.contribution(LOOP))
    power = 2 * np.abs(np.fft.rfft(sharp)) ** 2 / len(rows) ** 2
    expected = power[10 * 20 :].sum()
    found = power_left(low, [LOOP], 10.0)
    assert found == pytest.approx(expected, rel=0.35)
    cut = 10.0 / rows.rows_per_turn
    assert found == pytest.approx(power_of_steps(low.contribution(LOOP), cut))
    own = 2 * np.abs(np.fft.rfft(low.contribution(LOOP))) ** 2 / len(rows) ** 2
    assert own[10 * 20 :].sum() < 0.3 * found < 0.1 * np.var(sharp)


def test_a_step_between_two_cells_counts():
    """Fault caught: cells that do not reach to the next one's first row."""
    values = (np.arange(400) >= 200) * 3.0
    for cut in (0.05, 0.051):
        assert power_of_steps(values, cut) == pytest.approx(9 / (2 * np.pi**2 * cut * 400))
