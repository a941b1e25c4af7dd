"""What NLopt does by itself, and that the guard stands between it and the search. One test a trap."""

from __future__ import annotations

import math

import nlopt
import numpy as np
import pytest

from hdopt.errors import HdoptError
from hdopt.optimize.minimax import explore, minimise
from hdopt.optimize.nlopt_adapter import INTERRUPTED, REASONS, Effort, Evaluation, Guard, find_algorithm, rank, run

WITH_SLOPES = ("LD_SLSQP", "LD_MMA", "LD_CCSAQ")
LOCAL = (*WITH_SLOPES, "LN_COBYLA")
GLOBAL = ("GN_DIRECT_L", "GN_CRS2_LM", "GN_ISRES", "GN_ESCH")
CENTRE = np.array([0.3, 0.6])


class Bowl:
    """(u - centre)^2 with an optional constraint u_0 >= `at_least`; the least is 0 without it."""

    n, pieces = 2, 1

    def __init__(self, at_least: float | None = None) -> None:
        self.at_least = at_least
        self.constraints = 0 if at_least is None else 1
        self.calls = 0

    def evaluate(self, u, slopes=True):
        self.calls += 1
        off = u - CENTRE
        if self.at_least is None:
            bound, slope = np.empty(0), np.empty((0, 2))
        else:
            bound, slope = np.array([self.at_least - u[0]]), np.array([[-1.0, 0.0]])
        return Evaluation(np.array([1 + off @ off]), 2 * off[None, :], bound, slope)


class Spoilt(Bowl):
    """The bowl with something wrong after a few calls, or in a region."""

    def __init__(self, spoil, after: int = 0) -> None:
        super().__init__()
        self.spoil, self.after = spoil, after

    def evaluate(self, u, slopes=True):
        found = super().evaluate(u, slopes)
        return self.spoil(u, found) if self.calls > self.after else found


def test_every_code_of_nlopt_has_its_words():
    """By NLopt's own names of them. Faults caught: a code that is missing, or whose sign is lost, by which a search
    that ended so breaks at its last word; words of another code."""
    said = {
        "SUCCESS": "converged",
        "STOPVAL_REACHED": "wanted value",
        "FTOL_REACHED": "value no longer changes",
        "XTOL_REACHED": "design no longer changes",
        "MAXEVAL_REACHED": "evaluations allowed",
        "MAXTIME_REACHED": "time allowed",
        "FAILURE": "failed",
        "INVALID_ARGS": "refused its arguments",
        "OUT_OF_MEMORY": "out of memory",
        "ROUNDOFF_LIMITED": "rounding",
        "FORCED_STOP": "stopped",
    }
    assert set(REASONS) == {getattr(nlopt, name) for name in said}
    for name, words in said.items():
        assert words in REASONS[getattr(nlopt, name)]


@pytest.mark.parametrize("algorithm", LOCAL)
def test_every_local_method_finds_an_optimum_below_zero(algorithm):
    """A bowl whose least value is -250 at a start of 5: the level of the epigraph goes below zero, and farther than
    its own size. Fault caught: its bound is a share of where it starts."""

    class Deep(Bowl):
        def evaluate(self, u, slopes=True):
            found = super().evaluate(u, slopes)
            return Evaluation(
                600 * (found.pieces - 1) - 250, 600 * found.piece_slopes, found.constraints, found.constraint_slopes
            )

    outcome = minimise(Deep(), np.array([0.9, 0.35]), algorithm, Effort(evaluations=2000))
    assert outcome.evaluation.objective == pytest.approx(-250, abs=0.5)


@pytest.mark.parametrize("algorithm", LOCAL)
def test_every_local_method_finds_the_constrained_optimum(algorithm):
    outcome = minimise(Bowl(at_least=0.5), np.array([0.9, 0.1]), algorithm, Effort(evaluations=500))
    assert outcome.feasible
    # COBYLA, without slopes, stops at a step of 1e-7, which leaves the square root of it in the value.
    assert np.allclose(outcome.u, [0.5, 0.6], atol=2e-3 if algorithm == "LN_COBYLA" else 1e-4)
    assert outcome.stopped_because in REASONS.values()


@pytest.mark.parametrize("algorithm", (*LOCAL, *GLOBAL))
def test_an_exception_in_the_problem_is_raised_and_not_swallowed(algorithm):
    def fail(u, found):
        raise ZeroDivisionError("the third evaluation fails")

    problem = Spoilt(fail, after=2)
    with pytest.raises(ZeroDivisionError, match="the third evaluation fails"):
        if algorithm.startswith("G"):
            explore(problem, algorithm, Effort(evaluations=200))
        else:
            minimise(problem, np.array([0.9, 0.1]), algorithm)
    assert problem.calls == 3


@pytest.mark.parametrize("algorithm", (*LOCAL, *GLOBAL))
def test_an_interrupt_returns_the_best_so_far(algorithm):
    def interrupt(u, found):
        raise KeyboardInterrupt

    problem = Spoilt(interrupt, after=2)
    solve = explore if algorithm.startswith("G") else minimise
    arguments = () if algorithm.startswith("G") else (np.array([0.9, 0.1]),)
    outcome = solve(problem, *arguments, algorithm, Effort(evaluations=200))
    assert outcome.interrupted
    assert outcome.stopped_because == INTERRUPTED
    assert outcome.evaluation is not None
    assert problem.calls == 3


def test_rounding_makes_plain_nlopt_lose_its_point_and_the_guard_keep_it():
    def objective(x, grad):
        if grad.size:
            grad[:] = 2 * (x - CENTRE)
        return float((x - CENTRE) @ (x - CENTRE))

    plain = nlopt.opt(nlopt.LD_SLSQP, 2)
    plain.set_min_objective(objective)
    plain.add_equality_constraint(lambda x, grad: _circle(x, grad), 0.0)
    with pytest.raises(nlopt.RoundoffLimited):
        plain.optimize([0.9, 0.1])
    outcome = minimise(Bowl(), np.array([0.9, 0.1]), "LD_SLSQP", Effort(evaluations=500, tolerance=0.0))
    assert np.allclose(outcome.u, CENTRE, atol=1e-7)
    assert outcome.stopped_because in (REASONS[-4], REASONS[4], REASONS[3], REASONS[5])


def _circle(x, grad):
    if grad.size:
        grad[:] = 2 * x
    return float(x @ x) - 0.1


def test_the_array_a_callback_gets_is_reused_so_the_guard_copies():
    seen = []

    def objective(x, grad):
        seen.append(x)
        return float((x - CENTRE) @ (x - CENTRE))

    plain = nlopt.opt(nlopt.LN_COBYLA, 2)
    plain.set_min_objective(objective)
    plain.set_maxeval(20)
    plain.optimize([0.9, 0.1])
    assert len({view.__array_interface__["data"][0] for view in seen}) < len(seen)  # NLopt's own memory, reused
    guard = Guard(Bowl())
    view = np.array([0.9, 0.1])
    guard(view)
    view[:] = 0.0
    assert np.array_equal(guard.best[0], [0.9, 0.1])


@pytest.mark.parametrize("bad", (math.nan, math.inf, -math.inf))
@pytest.mark.parametrize("algorithm", (*LOCAL, *GLOBAL))
def test_what_is_not_finite_never_reaches_nlopt(algorithm, bad):
    def spoil(u, found):
        return (
            Evaluation(np.array([bad]), found.piece_slopes, found.constraints, found.constraint_slopes)
            if u[0] < 0.25 or u[1] < 0.3
            else found
        )

    problem = Spoilt(spoil)
    told = []
    original = Guard.__call__

    class Watching(Guard):
        def __call__(self, view):
            found = original(self, view)
            told.append(found)
            return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hdopt.optimize.minimax.Guard", Watching)
        if algorithm.startswith("G"):
            outcome = explore(problem, algorithm, Effort(evaluations=300))
        else:
            outcome = minimise(problem, np.array([0.9, 0.9]), algorithm, Effort(evaluations=300))
    assert all(found.finite for found in told)
    assert np.isfinite(outcome.evaluation.objective)
    assert outcome.evaluation.objective < 1.05  # the bowl's floor is 1, its edge 1.65


def test_slopes_that_are_not_finite_count_as_impossible():
    def spoil(u, found):
        return Evaluation(found.pieces, np.full((1, 2), math.nan), found.constraints, found.constraint_slopes)

    outcome = minimise(Spoilt(spoil), np.array([0.5, 0.5]))
    assert outcome.evaluation is None
    assert not outcome.feasible
    assert outcome.impossible == outcome.evaluations > 0


def test_an_impossible_design_is_avoided_and_counted():
    def refuse(u, found):
        if u[0] > 0.6:
            raise HdoptError("no such drive")
        return found

    outcome = minimise(Spoilt(refuse), np.array([0.55, 0.1]))
    assert np.allclose(outcome.u, CENTRE, atol=1e-4)
    outcome = explore(Spoilt(refuse), effort=Effort(evaluations=60))
    assert outcome.impossible > 0
    assert outcome.u[0] <= 0.6


def test_the_best_point_is_kept_even_where_the_last_is_worse():
    guard = Guard(Bowl(at_least=0.5))
    guard(np.array([0.6, 0.6]))
    guard(np.array([0.3, 0.6]))  # lower, but breaks the constraint
    guard(np.array([0.9, 0.9]))
    assert np.array_equal(guard.best[0], [0.6, 0.6])
    assert rank(guard.best[1]) < rank(Bowl(at_least=0.5).evaluate(np.array([0.3, 0.6])))


def test_nothing_to_choose_is_an_answer():
    class Fixed(Bowl):
        n = 0

        def evaluate(self, u, slopes=True):
            return Evaluation(np.array([2.0]), np.empty((1, 0)), np.empty(0), np.empty((0, 0)))

    assert minimise(Fixed(), np.empty(0)).evaluation.objective == 2.0
    assert "nothing to choose" in minimise(Fixed(), np.empty(0)).stopped_because


@pytest.mark.parametrize("algorithm", ("GN_CRS2_LM", "GN_ISRES", "GN_ESCH"))
def test_the_same_seed_gives_the_same_points(algorithm):
    first, again, other = (explore(Bowl(), algorithm, Effort(evaluations=40, seed=seed)).u for seed in (0, 0, 7))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_a_misspelt_algorithm_names_the_nearest():
    with pytest.raises(HdoptError, match="unknown NLopt algorithm 'LD_SLSPQ'; did you mean 'LD_SLSQP'"):
        find_algorithm("LD_SLSPQ")


def test_nlopts_own_failures_are_outcomes_and_other_errors_are_not():
    """They are classes of NLopt's own in some releases, RuntimeError and ValueError in others."""
    optimizer = nlopt.opt(nlopt.LD_SLSQP, 2)
    optimizer.set_min_objective(lambda x, grad: float(x @ x))
    guard = Guard(Bowl())
    guard(CENTRE)
    outcome = run(optimizer, guard, np.zeros(3), "LD_SLSQP")  # three numbers for two variables
    assert outcome.stopped_because == REASONS[-2]
    assert np.array_equal(outcome.u, CENTRE)
    optimizer.set_min_objective(lambda x, grad: {}["a mistake in the callback"])
    with pytest.raises(KeyError, match="a mistake in the callback"):
        run(optimizer, guard, np.zeros(2), "LD_SLSQP")
