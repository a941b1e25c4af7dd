"""Fronts: dominated points, hypervolume, and that the epsilon-constraint front is the true one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hdopt.optimize.design_space import Combination, Structure
from hdopt.optimize.objectives import find_quantity
from hdopt.optimize.pareto import front, front_ends, hypervolume, non_dominated
from hdopt.optimize.problem import Limit
from hdopt.optimize.solve import Method, solve
from hdopt.study import load_study
from hdopt.workflow.search import search
from hdopt.workflow.search_setup import setup_of

SECOND = "flank_pressure_mpa"


@given(arrays(float, st.tuples(st.integers(1, 25), st.just(2)), elements=st.integers(0, 6).map(float)))
def test_dominated_points_against_the_definition(points):
    kept = non_dominated(points)
    for i, point in enumerate(points):
        beaten = any((other <= point).all() and (other < point).any() for other in points)
        repeated = any((other == point).all() for other in points[:i])
        assert kept[i] == (not beaten and not repeated)


@given(arrays(float, st.tuples(st.integers(1, 20), st.just(2)), elements=st.floats(0, 1)))
def test_hypervolume_against_pymoo(points):
    from pymoo.indicators.hv import HV

    assert hypervolume(points, (1.1, 1.1)) == pytest.approx(HV(ref_point=np.array([1.1, 1.1]))(points), abs=1e-12)


def test_hypervolume_of_two_steps():
    assert hypervolume([(0.0, 0.5), (0.5, 0.0), (0.6, 0.6)], (1.0, 1.0)) == pytest.approx(0.75)
    assert hypervolume([(2.0, 0.0)], (1.0, 1.0)) == 0.0


@pytest.fixture(scope="module")
def traced():
    problem = setup_of(load_study("csf-25-80"), 1).problem(Combination("ellipse", Structure.AUTOMATIC))
    problem = type(problem)(
        problem.space,
        problem.trade,
        problem.combination,
        problem.objective,
        tuple(limit for limit in problem.limits if limit.quantity != SECOND),
    )
    ends, _ = front_ends(problem, SECOND, Method(), problem.space.baseline_values)
    found = front(problem, SECOND, 12, Method(), *ends)
    points = np.array([(s.objective, pressure(problem, s.values)) for s in found])
    return problem, points


def pressure(problem, values) -> float:
    return find_quantity(SECOND).value(problem.trade, problem.space.design(problem.combination, values))


def test_the_front_falls_and_holds_no_dominated_point(traced):
    _, points = traced
    assert len(points) == 12
    assert (np.diff(points[:, 0]) > -1e-6).all()
    assert (np.diff(points[:, 1]) < 0).all()


def least_at(problem, start, bound) -> float:
    """The least objective with the second quantity at most `bound`, by one limited search."""
    solution = solve(problem.with_limits(Limit(SECOND, bound)), Method(), [start])
    assert solution.feasible
    return solution.objective


def test_no_sampled_design_lies_below_it(traced):
    """Dense sampling knows nothing of slopes, epsilon-constraints or warm starts."""
    problem, _ = traced
    rng = np.random.default_rng(3)
    checked = 0
    for u in rng.random((1200, problem.n)):
        found = problem.evaluate(u, slopes=False)
        if found.violation > 0:
            continue
        checked += 1
        values = problem.values(u)
        assert found.objective > least_at(problem, values, pressure(problem, values)) - 1e-6
    assert checked > 10


@pytest.mark.slow
def test_nsga_ii_finds_the_same_front(traced):
    """pymoo's NSGA-II, a population method without slopes, on the same problem."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import ElementwiseProblem
    from pymoo.optimize import minimize

    problem, points = traced

    class Trade(ElementwiseProblem):
        def __init__(self):
            super().__init__(n_var=problem.n, n_obj=2, n_ieq_constr=problem.constraints, xl=0.0, xu=1.0)

        def _evaluate(self, u, out):
            found = problem.evaluate(u, slopes=False)
            out["F"] = [found.objective, pressure(problem, problem.values(u))]
            out["G"] = found.constraints

    genetic = minimize(Trade(), NSGA2(pop_size=40), ("n_gen", 100), seed=1)
    gaps = []
    for (objective, y), u in zip(genetic.F, genetic.X, strict=True):
        least = least_at(problem, problem.values(u), y)
        assert objective > least - 1e-6
        gaps.append(objective / least - 1)
    assert np.median(gaps) < 0.02  # its designs come near ours: both see one front
    reference = 1.01 * points.max(axis=0)
    # 12 points lose the triangles between them, 40 evolved ones their distance from the front.
    assert hypervolume(genetic.F, reference) / hypervolume(points, reference) == pytest.approx(1.0, abs=0.1)


def test_a_limit_on_the_second_quantity_is_replaced_not_doubled(traced):
    problem, _ = traced
    limited = problem.with_limits(Limit(SECOND, 9.0)).with_limits(Limit(SECOND, 8.0))
    assert [limit.bound for limit in limited.limits if limit.quantity == SECOND] == [8.0]


def test_the_search_reports_its_front():
    study = load_study(
        "csf-25-80",
        ('search.profiles=["ellipse"]', 'search.structures=["automatic", "integral"]', "search.front_points=4"),
    )
    result = search(study)
    (made,) = result.fronts
    values = [(d.quantities[made.second], d.quantities[made.objective]) for d in made.designs]
    assert len(values) >= 4
    assert non_dominated(values).all()
    assert made.hypervolume > 0
    assert {d.structure for d in made.designs} == {"automatic"}
    assert len(result.to_frame()) == len(result.to_dict()["front"])
