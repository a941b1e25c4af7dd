"""Least-cost tolerances of Chase's shaft and housing: Chase, "Tolerance allocation methods for designers", ADCATS
Report 99-6 (1999); inches and relative cost."""

import pytest

from hdopt.allocation.convex import Infeasible, Item, rss_rule, solve, total_cost, worst_case_rule
from hdopt.allocation.cost import Power

NAMES = ("shaft", "first sleeve", "housing", "second sleeve")
B = (0.15997, 0.07202, 0.12576, 0.07202)
K = (0.43899, 0.46823, 0.46537, 0.46823)
ORIGINAL = (0.008, 0.002, 0.006, 0.002)
FIXED = (0.0015, 0.0025, 0.0025)
ITEMS = [Item(name, Power(1.0, b, k), scale) for name, b, k, scale in zip(NAMES, B, K, ORIGINAL, strict=True)]


def test_cost_of_the_original_tolerances():
    assert total_cost(ITEMS, dict(zip(NAMES, ORIGINAL, strict=True))) == pytest.approx(9.3359, abs=5e-5)


@pytest.mark.parametrize(
    ("rule", "cost", "tolerances"),
    [
        (worst_case_rule, 11.07783, (0.00253711, 0.001734, 0.00249489, 0.001734)),
        (rss_rule, 8.053611, (0.00811423, 0.0063818, 0.00793439, 0.0063818)),
    ],
)
def test_least_cost(rule, cost, tolerances):
    solution = solve(ITEMS, rule([1.0] * 4, 0.015, FIXED))
    assert solution.total_cost == pytest.approx(cost, abs=5e-6)  # the printed digits
    assert list(solution.tolerances.values()) == pytest.approx(tolerances, abs=6e-9)
    assert solution.optimality_gap < 1e-9
    assert 0 <= solution.slack < 1e-9


def test_marginal_cost_is_the_slope_of_the_cost_curve():
    step = 1e-6
    below, at, above = (
        solve(ITEMS, worst_case_rule([1.0] * 4, limit, FIXED)) for limit in (0.015 - step, 0.015, 0.015 + step)
    )
    assert at.marginal_cost == pytest.approx((below.total_cost - above.total_cost) / (2 * step), rel=1e-5)


def test_fixed_tolerances_alone_can_exceed_the_requirement():
    with pytest.raises(Infeasible, match=r"cannot be met by the worst case rule.*fixed part alone is 0\.0065"):
        solve(ITEMS, worst_case_rule([1.0] * 4, 0.006, FIXED))
