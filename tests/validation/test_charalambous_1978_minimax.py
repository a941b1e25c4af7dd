"""Convex minimax problems CB2 and CB3 of Charalambous and Conn, SIAM J. Numer. Anal. 15 (1978) 162-187.

Optima as listed by Luksan and Vlcek, Test problems for nonsmooth optimization (2000): 1.9522245 and 2.
"""

from __future__ import annotations

import numpy as np
import pytest

from hdopt.optimize.minimax import minimise
from hdopt.optimize.nlopt_adapter import Effort, Evaluation

LOW, SPREAD = np.array([-1.0, -1.0]), 4.0


class CharalambousConn:
    n, pieces, constraints = 2, 3, 0

    def __init__(self, first: int, second: int) -> None:
        self.powers = np.array([first, second])

    def evaluate(self, u, slopes=True):
        x = LOW + SPREAD * u
        tail = 2 * np.exp(x[1] - x[0])
        values = np.array([(x**self.powers).sum(), ((2 - x) ** 2).sum(), tail])
        slopes = np.array([self.powers * x ** (self.powers - 1), -2 * (2 - x), [-tail, tail]])
        return Evaluation(values, slopes * SPREAD, np.empty(0), np.empty((0, 2)))


@pytest.mark.parametrize("algorithm", ("LD_SLSQP", "LD_MMA", "LD_CCSAQ", "LN_COBYLA"))
@pytest.mark.parametrize("powers, optimum, place", (((2, 4), 1.9522245, (1.139038, 0.899560)), ((4, 2), 2.0, (1, 1))))
def test_the_published_optimum_is_found(algorithm, powers, optimum, place):
    outcome = minimise(CharalambousConn(*powers), np.array([0.5, 0.25]), algorithm, Effort(evaluations=2000))
    # The published value has eight digits; the methods stop at steps of 1e-7 of the range.
    assert outcome.evaluation.objective == pytest.approx(optimum, abs=2e-6)
    assert LOW + SPREAD * outcome.u == pytest.approx(place, abs=2e-3)
