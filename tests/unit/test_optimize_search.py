"""The search on the drive itself: right optima, honest answers, nothing random that is not seeded."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest

import hdopt
from hdopt.drive.geometry import Structure
from hdopt.errors import HdoptError
from hdopt.optimize.design_space import SIZE_RULES, Combination, Variable, scaled_geometry
from hdopt.optimize.minimax import minimise
from hdopt.optimize.multipliers import prices
from hdopt.optimize.nlopt_adapter import INTERRUPTED
from hdopt.optimize.objectives import QUANTITIES
from hdopt.optimize.search import search_designs
from hdopt.optimize.solve import Method, solve
from hdopt.parallel.cluster import Dask
from hdopt.parallel.engine import engine_in_force
from hdopt.parallel.local import ThisProcess
from hdopt.study import load_study
from hdopt.workflow.search_setup import setup_of

TWO_DISK = Combination("two_disk", Structure.AUTOMATIC)
ELLIPSE = Combination("ellipse", Structure.INTEGRAL)


@pytest.fixture(scope="module")
def setup():
    return setup_of(load_study("csf-25-80"), seed=1)


def only(setup, *variables):
    return replace(setup, space=replace(setup.space, variables=variables))


@pytest.mark.parametrize("key", [key for key in QUANTITIES if key != "peak_to_peak_quantile_arcmin"])
@pytest.mark.parametrize("combination", (TWO_DISK, ELLIPSE))
def test_slopes_of_every_quantity_agree_with_wide_differences(setup, key, combination):
    problem = replace(setup.problem(combination), objective=key, limits=())
    u = np.full(problem.n, 0.45)
    found = problem.evaluate(u)
    top = int(found.pieces.argmax())
    for i in range(problem.n):
        step = np.zeros(problem.n)
        step[i] = 1e-3
        wide = [problem.evaluate(u + sign * step).pieces[top] for sign in (-1, 1)]
        difference = (wide[1] - wide[0]) / 2e-3
        # Differences over 2e-3 of the range keep its square of the third derivative.
        assert found.piece_slopes[top, i] == pytest.approx(difference, abs=3e-4 * max(abs(found.objective), 1e-3))


@pytest.mark.parametrize(
    "variable, key",
    (
        (Variable("pressure_angle_deg", 5.0, 20.0), "carrying_teeth"),
        (Variable("width_mm", 5.0, 14.0), "bearing_life_h"),
        (Variable("deflection_ratio", 0.95, 1.15), "flank_pressure_mpa"),
    ),
)
def test_one_variable_against_a_fine_grid(setup, variable, key):
    problem = only(setup, variable).problem(ELLIPSE)
    limit = [limit for limit in problem.limits if limit.quantity == key]
    objective = "bending_stress_mpa" if key == "flank_pressure_mpa" else problem.objective
    problem = replace(problem, objective=objective, limits=tuple(limit))
    solution = solve(problem, Method())
    grid = np.linspace(0, 1, 1001)
    values = [problem.evaluate(np.array([u])) for u in grid]
    feasible = [(value.objective, u) for value, u in zip(values, grid, strict=True) if value.violation <= 0]
    best, place = min(feasible)
    assert solution.feasible
    assert solution.objective <= best + 1e-9
    assert problem.place(solution.values)[0] == pytest.approx(place, abs=1.1e-3)  # one step of the grid


def test_the_optimum_is_held_by_limits_and_meets_the_first_order_conditions(setup):
    problem = setup.problem(TWO_DISK)
    solution = solve(problem, Method())
    held, residual = prices(problem, solution.values)
    assert residual < 1e-4
    assert all(price.per_unit >= 0 for price in held)
    assert {price.name for price in held} >= {"bending_safety", "trailing_flank_room_mm"}
    # A price is what it says: give way by 1 % and search again.
    safety = next(price for price in held if price.name == "bending_safety")
    eased = tuple(replace(x, bound=0.99 * x.bound) if x.quantity == safety.name else x for x in problem.limits)
    gained = solution.objective - solve(replace(problem, limits=eased), Method(), [solution.values]).objective
    assert gained == pytest.approx(safety.per_unit * 0.01 * safety.at, rel=0.05)  # curvature over 1 %


def test_random_designs_within_the_limits_never_beat_it(setup):
    problem = setup.problem(TWO_DISK)
    best = solve(problem, Method()).objective
    rng = np.random.default_rng(5)
    for u in rng.random((300, problem.n)):
        found = problem.evaluate(u)
        assert found.violation > 0 or found.objective >= best - 1e-9


def test_starts_do_not_matter(setup):
    problem = setup.problem(ELLIPSE)
    ends = [minimise(problem, u) for u in np.random.default_rng(2).random((6, problem.n))]
    values = [end.evaluation.objective for end in ends if end.feasible]
    assert len(values) >= 4
    assert np.ptp(values) < 1e-5


def test_standard_values_are_kept_and_as_good_as_trying_all(setup):
    stepped = tuple(
        replace(v, values=tuple(np.arange(5.0, 14.01, 0.5))) if v.name == "width_mm" else v
        for v in setup.space.variables
    )
    problem = only(setup, *stepped).problem(ELLIPSE)
    solution = solve(problem, Method())
    assert solution.values["width_mm"] in stepped[1].values
    every = [solve(problem.with_fixed(width_mm=b), Method(), [solution.values]) for b in stepped[1].values]
    assert solution.objective == pytest.approx(min(s.objective for s in every if s.feasible), abs=1e-6)


def test_fixed_outside_diameter_takes_whole_teeth_only():
    study = load_study(
        "csf-25-80",
        (
            'search.size="fixed_outside_diameter"',
            'search.profiles=["ellipse"]',
            'search.structures=["automatic"]',
            "search.variables={module_mm={lower=0.38,upper=0.41}, width_mm={lower=5.0,upper=14.0}}",
            "search.limits={bearing_life_h={min_of_baseline=1.0}}",
        ),
    )
    result = hdopt.search(study, fronts=False)
    teeth = 0.396 * 162 / result.best.variables["module_mm"]
    assert teeth == pytest.approx(round(teeth), abs=1e-9)
    assert round(teeth) % 2 == 0
    assert result.best.quantities["pitch_diameter_mm"] == pytest.approx(64.152)
    assert result.best.quantities["ratio"] == round(teeth) / 2 - 1


def test_sizes_follow_the_module(setup):
    gear = setup.space.baseline.geometry
    assert scaled_geometry(gear, SIZE_RULES["fixed_tooth_counts"], gear.module) == gear
    larger = scaled_geometry(gear, SIZE_RULES["fixed_tooth_counts"], 1.1 * gear.module)
    assert larger.flexspline_addendum == pytest.approx(1.1 * gear.flexspline_addendum)
    assert larger.flexspline_wall == gear.flexspline_wall
    # Table 1: h_fF = 0.290 mm is what the pitch radius leaves below the wall.
    dedendum = larger.module * 80 - larger.flexspline_inner_radius - larger.flexspline_wall
    assert dedendum == pytest.approx(1.1 * 0.290, abs=1e-9)


def test_the_same_seed_gives_the_same_result_and_json_keys():
    study = load_study("csf-25-80", ('search.profiles=["ellipse"]', 'search.structures=["automatic"]'))
    first, again = (hdopt.search(study, seed=0, fronts=False).to_dict() for _ in range(2))
    assert first == again
    assert {"best", "front", "evaluations", "algorithm", "stopped_because"} <= set(first)


def test_an_infeasible_problem_says_which_limit_breaks():
    study = load_study(
        "csf-25-80",
        (
            'search.profiles=["ellipse"]',
            'search.structures=["integral"]',
            "search.limits={peak_to_peak_arcmin={max=0.1}, bearing_life_h={min=7000.0}}",
            'search.objective="width_mm"',
        ),
    )
    result = hdopt.search(study, fronts=False)
    assert not result.feasible
    assert any("Peak-to-peak at most 0.1 arcmin" in limit for limit in result.best.broken_limits)


def test_an_interrupt_ends_with_the_best_so_far(monkeypatch):
    study = load_study("csf-25-80", ('search.profiles=["ellipse"]', 'search.structures=["automatic", "integral"]'))
    told = []

    def interrupt_at_the_second(stage):
        told.append(stage)
        if len(told) == 2:
            raise KeyboardInterrupt

    result = hdopt.search(study, progress=interrupt_at_the_second)
    assert result.interrupted
    assert result.stopped_because == INTERRUPTED
    assert result.best.structure == "automatic"
    assert result.feasible


@pytest.mark.parametrize(
    "override, message",
    (
        ('search.objective="peak_to_peek_arcmin"', "unknown quantity 'peak_to_peek_arcmin'; did you mean"),
        ("search.variables={width_mm={lower=9.0, upper=5.0}}", "lower must be below upper"),
        ("search.variables={wrap_angle_deg={lower=20.0, upper=95.0}}", "it must lie in 0 to 90"),
        ("search.limits={width_mm={max=8.0, min=5.0}}", "exactly one of max, min"),
        ("search.limits={widht_mm={max=8.0}}", "unknown quantity 'widht_mm'; did you mean 'width_mm'"),
        ("search.variables={width_mm={lower=5.0, upper=9.0, step=0.5, values=[6.0]}}", "both step and values"),
        ('search.local_algorithm="LD_SLSPQ"', "unknown NLopt algorithm"),
    ),
)
def test_what_cannot_be_searched_is_said(override, message):
    with pytest.raises(HdoptError, match=message):
        hdopt.search(load_study("csf-25-80", (override,)), fronts=False)


def test_a_problem_that_went_to_another_process_is_the_same(setup):
    """Would catch the kept meshes of a design space going along, which cannot be pickled."""
    problem = setup.problem(TWO_DISK)
    u = np.full(problem.n, 0.4)
    here, there = problem.evaluate(u), pickle.loads(pickle.dumps(problem)).evaluate(u)
    np.testing.assert_array_equal(there.pieces, here.pieces)
    np.testing.assert_array_equal(there.constraint_slopes, here.constraint_slopes)


def test_an_interrupted_combination_is_no_finished_part_and_still_counts(setup, monkeypatch):
    """Would catch a search cut short that is kept as finished: --resume would take it."""
    finished = []

    class Keeping(ThisProcess):
        elsewhere = True  # else the drives' own threads would come first

        def map(self, function, items):
            for item in items:
                result = function(item)
                finished.append(result)
                yield result

    whole = solve(setup.problem(ELLIPSE), Method())

    def cut_at_the_second(problem, method):
        return replace(whole, problem=problem, outcome=replace(whole.outcome, interrupted=len(asked) > 1))

    asked = []
    monkeypatch.setattr("hdopt.optimize.search.solve", cut_at_the_second)
    three = replace(setup, space=replace(setup.space, combinations=(ELLIPSE, ELLIPSE, ELLIPSE)))
    with engine_in_force(Keeping()):
        result = search_designs(three, progress=asked.append, fronts=False)
    assert result.interrupted
    assert (len(finished), len(result.solutions)) == (1, 2)


@pytest.mark.slow
def test_a_search_with_random_numbers_is_the_same_on_two_threads_of_a_dask_worker():
    """NLopt's random numbers are a stream a thread, seeded in each."""
    distributed = pytest.importorskip("distributed")
    words = ('search.profiles=["ellipse"]', 'search.structures=["automatic", "integral"]', "search.front_points=7")
    study = load_study("csf-25-80", (*words, 'search.global_algorithm="GN_CRS2_LM"'))
    found = {}
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, protocol="tcp://", dashboard_address=None
    ) as cluster:
        for engine in ("process", Dask(cluster.scheduler_address.removeprefix("tcp://"))):
            with engine_in_force(engine):
                found[engine] = json.dumps(hdopt.search(study).to_dict())
    assert len(set(found.values())) == 1


def test_fronts_go_to_the_engine_and_an_interrupt_within_one_is_not_swallowed(monkeypatch):
    """Both coarse fronts and the fine one are items of an engine; one that Ctrl-C cut off is left out, and said."""
    items = []

    class Watching(ThisProcess):
        elsewhere = True

        def map(self, function, given):
            for item in given:
                items.append(function.func.__name__)
                yield function(item)

    words = ('search.profiles=["ellipse"]', 'search.structures=["automatic", "integral"]', "search.front_points=7")
    setup = setup_of(load_study("csf-25-80", words), 1)
    with engine_in_force(Watching()):
        whole = search_designs(setup)
    assert items == ["_solved", "_solved", "_coarse", "_coarse", "_fine"]
    assert len(whole.fronts) == 1 and not whole.interrupted

    def cut(problem, method, starts=()):
        solution = solve(problem, method, starts)
        return replace(solution, outcome=replace(solution.outcome, interrupted=True))

    monkeypatch.setattr("hdopt.optimize.pareto.solve", cut)
    result = search_designs(setup)
    assert result.interrupted and result.fronts == ()
    assert len(result.solutions) == 2
