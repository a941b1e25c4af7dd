"""Where no design keeps all limits, the one shown breaks none that it could keep, and nothing is said to hold it."""

from __future__ import annotations

import numpy as np
import pytest

import hdopt
from hdopt.optimize.nearest import nearest
from hdopt.optimize.search import method_of
from hdopt.optimize.solve import solve
from hdopt.optimize.summary import result_lines
from hdopt.study import load_study
from hdopt.workflow.search_setup import setup_of

ONE = ('search.profiles=["ellipse"]', 'search.structures=["integral"]')
TWO = ("search.variables={pressure_angle_deg={lower=8.0, upper=16.0}, width_mm={lower=8.0, upper=10.0}}",)
"""Neither changes the bending stress of the flexspline."""
BROKEN = "bending_safety={min=50.0}"


def searched(limits, *more):
    return hdopt.search(load_study("csf-25-80", (*ONE, *TWO, f"search.limits={{{limits}}}", *more)), fronts=False)


@pytest.mark.parametrize(
    "kept",
    [
        "flank_pressure_mpa={max_of_baseline=1.0}",
        "carrying_teeth={min_of_baseline=1.0}, flank_pressure_mpa={max_of_baseline=1.0}",
        "peak_to_peak_arcmin={max=1.3}",
    ],
)
def test_beside_a_limit_that_nothing_keeps_the_others_are_kept(kept):
    """And within them the error is the least, as if the hopeless limit were not there."""
    hopeless, without = searched(f"{BROKEN}, {kept}"), searched(kept)
    assert without.feasible and not hopeless.feasible
    assert hopeless.best.broken_limits == ("Safety against bending fatigue at least 50",)
    least, found = (r.best.quantities["peak_to_peak_arcmin"] for r in (without, hopeless))
    assert found == pytest.approx(least, rel=1e-3)  # both are converged peak-to-peaks of one local optimum


def test_limits_that_exclude_each_other_are_shared_out_by_the_largest_break():
    """No width has both: the largest break is the least there is, by trying all designs."""
    result = searched("flank_pressure_mpa={max_of_baseline=0.9}, peak_to_peak_arcmin={max=0.6}")
    setup = result.setup
    problem = setup.problem(result.chosen.combination)
    grid = np.linspace(0.0, 1.0, 21)
    least = min(problem.evaluate(np.array([x, y]), slopes=False).violation for x in grid for y in grid)
    assert result.chosen.violation <= least + 1e-4


def test_nothing_is_said_to_hold_a_design_that_breaks_a_limit():
    """Multipliers are those of an optimum; a limit that is broken was said to be worth 0 arcmin a unit."""
    result = searched(BROKEN)
    assert result.active == ()
    assert result.to_dict()["optimality_residual"] != result.to_dict()["optimality_residual"]  # not a number
    lines = "\n".join(result_lines(result))
    assert "is worth" not in lines and "held by" not in lines


def test_an_interrupt_while_the_nearest_is_looked_for_keeps_what_was_found(monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("hdopt.optimize.search.nearest", interrupted)
    result = searched(BROKEN)
    assert result.interrupted and not result.feasible
    assert result.best.broken_limits


def test_of_a_feasible_solution_the_nearest_is_itself():
    setup = setup_of(load_study("csf-25-80", (*ONE, *TWO)), seed=1)
    method = method_of(setup, 1)
    problem = setup.problem(setup.space.combinations[0])
    solution = solve(problem, method)
    assert nearest(problem, solution, method).values == solution.values
