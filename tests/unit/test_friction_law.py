"""Laws of pre-sliding friction: against their differential equations, and what all of them share."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hdopt.effects._friction_law import LAWS

X = np.linspace(0, 8, 81)


@pytest.mark.parametrize("start", [-1.0, -0.4, 0.3])
@pytest.mark.parametrize(
    ("name", "exponent", "beta"), [("dahl", 1, 1.0), ("bouc_wen", 1, 0.5), ("bouc_wen_square", 2, 0.5)]
)
def test_solves_its_differential_equation(name, exponent, beta, start):
    """Wen 1976 along the motion: dy/dx = 1 - |y|^n (beta sgn y + 1 - beta)."""

    def slope(_, y):
        return 1 - np.abs(y) ** exponent * (beta * np.sign(y) + 1 - beta)

    solved = solve_ivp(slope, (0, X[-1]), [start], t_eval=X, rtol=1e-9, atol=1e-11).y[0]
    np.testing.assert_allclose(LAWS[name].cross(start, X), solved, atol=1e-8)


def test_maxwell_slip_is_the_sum_of_its_elements():
    """After a full reversal: elements of break-away u/2, u even in 0 to 1, each giving way at its own."""
    break_away = (np.arange(4000) + 0.5) / 4000 / 2
    elements = np.clip(X[:, None] - break_away, -break_away, break_away).mean(1) / break_away.mean()
    np.testing.assert_allclose(LAWS["maxwell_slip"].cross(-1.0, X), elements, atol=1e-3)


def test_wide_maxwell_slip_is_the_sum_of_its_elements():
    """Break-away distances whose logarithms are even over a decade, in units of their mean."""
    distance = np.geomspace(1, 10, 4001)
    distance = np.sqrt(distance[1:] * distance[:-1])
    distance /= distance.mean()
    elements = np.minimum(X[:, None] / distance, 1).mean(1)
    np.testing.assert_allclose(LAWS["maxwell_slip_wide"].cross(-1.0, X), 2 * elements - 1, atol=1e-5)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("start", [-1.0, -0.4, 0.3, 1.0])
def test_crosses_from_where_it_reversed_towards_one(name, start):
    state = LAWS[name].cross(start, X)
    assert state[0] == pytest.approx(start)
    assert np.all(np.diff(state) >= 0)
    assert 0.99 < state[-1] <= 1
    assert LAWS[name].cross(-1.0, np.array([LAWS[name].half])) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("name", LAWS)
def test_nine_tenths_of_the_loop_are_crossed_after_the_transition(name):
    """The loop is 2 wide, so from -1 to 0.8. Fault caught: a length of the law given for the transition."""
    assert LAWS[name].cross(-1.0, np.array([LAWS[name].transition])) == pytest.approx(0.8, abs=1e-12)
