"""Exponential costs under one sum: the multiplier's closed form t_i = b_i (ln(a_i/b_i) - ln(lambda))."""

import numpy as np
import pytest

from hdopt.allocation.convex import Item, solve, worst_case_rule
from hdopt.allocation.cost import Exponential

A, B, TOTAL = np.array([3, 5, 2.0]), np.array([0.01, 0.02, 0.015]), 0.08


def test_least_cost():
    items = [Item(f"t{i}", Exponential(a, b), TOTAL / 3) for i, (a, b) in enumerate(zip(A, B, strict=True))]
    solution = solve(items, worst_case_rule([1.0] * 3, TOTAL))
    log_multiplier = ((B * np.log(A / B)).sum() - TOTAL) / B.sum()
    closed_form = B * (np.log(A / B) - log_multiplier)
    assert closed_form == pytest.approx([0.0212912, 0.0389360, 0.0197728], abs=5e-8)
    assert list(solution.tolerances.values()) == pytest.approx(closed_form, abs=1e-7)
    assert solution.total_cost == pytest.approx(1.6057164, abs=5e-8)
    assert solution.marginal_cost == pytest.approx(np.exp(log_multiplier), rel=1e-6)
