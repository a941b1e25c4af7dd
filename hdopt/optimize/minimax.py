"""Minimax problems with NLopt in the epigraph form: minimise t over (u, t) subject to piece_i(u) <= t.

Every piece is smooth where their maximum is not: methods with gradients need that, and COBYLA, which models what it is
given by planes, stops short at a kink of the maximum (by 0.07 on CB3, `tests/validation`), but not of the epigraph.
"""

from __future__ import annotations

import numpy as np

from hdopt.arrays import Array
from hdopt.optimize.nlopt_adapter import (
    INTERRUPTED,
    NO_PROBLEM,
    Effort,
    Guard,
    MinimaxProblem,
    Optimizer,
    Outcome,
    find_algorithm,
    run,
)

LOCAL = "LD_SLSQP"
"""Fewest evaluations of all tried on the trade study, and none missed: `tests/benchmarks/test_search_methods.py`."""
GLOBAL = "GN_DIRECT_L"
"""Deterministic, and of all tried the nearest or second nearest to the optimum for one effort (same comparison)."""
PENALTY = 10.0
"""What a violation of 1 costs in a global search, in units of the objective's own size: exact for multipliers below."""
SMALL = 1e-12
FIRST_STEP = 0.1
"""First step of methods without gradients, as a share of each variable's range and of the objective."""


def minimise(problem: MinimaxProblem, start: Array, algorithm: str = LOCAL, effort: Effort | None = None) -> Outcome:
    """Local minimum of the largest piece of `problem` under its constraints, from `start` in the unit cube (n,).

    `algorithm` is NLopt's name of a method, `effort` limits what it may do. Raises what the problem raises.
    """
    effort = effort or Effort()
    guard = Guard(problem, slopes=algorithm.startswith("LD_"))
    start = np.clip(np.asarray(start, float), 0.0, 1.0)
    first = guard(start)
    if problem.n == 0:
        u, best = guard.best if guard.best else (start, None)
        return Outcome(u, best, guard.evaluations, guard.impossible, algorithm, NO_PROBLEM)
    if guard.failure is not None:
        return run_nothing(guard, guard.failure, start, algorithm)
    scale = max(abs(first.objective), SMALL)
    return _epigraph(guard, start, scale, algorithm, effort)


def run_nothing(guard: Guard, failure: BaseException, start: Array, algorithm: str) -> Outcome:
    """The `start` itself failed before NLopt began: raise the `failure` that `guard` caught, or after an interrupt hand
    back what there is, as of `algorithm`."""
    if not isinstance(failure, KeyboardInterrupt):
        raise failure
    u, best = guard.best if guard.best else (start, None)
    return Outcome(u, best, guard.evaluations, guard.impossible, algorithm, INTERRUPTED, True)


def _epigraph(guard: Guard, start: Array, scale: float, algorithm: str, effort: Effort) -> Outcome:
    import nlopt

    problem = guard.problem
    n = problem.n
    nlopt.srand(effort.seed)
    optimizer = _optimizer(algorithm, n + 1, effort)
    level = guard(start).objective / scale
    optimizer.set_lower_bounds([*np.zeros(n), level - 100.0])
    optimizer.set_upper_bounds([*np.ones(n), level + 100.0])

    def objective(x: Array, grad: Array) -> float:
        if grad.size:
            grad[:] = 0.0
            grad[n] = 1.0
        return float(x[n])

    def constraints(result: Array, x: Array, grad: Array) -> None:
        found = guard(x)
        result[: problem.pieces] = found.pieces / scale - x[n]
        result[problem.pieces :] = found.constraints
        if grad.size:
            grad[: problem.pieces, :n] = found.piece_slopes / scale
            grad[: problem.pieces, n] = -1.0
            grad[problem.pieces :, :n] = found.constraint_slopes
            grad[problem.pieces :, n] = 0.0

    optimizer.set_min_objective(objective)
    optimizer.add_inequality_mconstraint(constraints, np.full(problem.pieces + problem.constraints, 1e-9))
    optimizer.set_initial_step(FIRST_STEP)
    return run(optimizer, guard, np.append(start, level), algorithm)


def explore(problem: MinimaxProblem, algorithm: str = GLOBAL, effort: Effort | None = None) -> Outcome:
    """Global search of `problem` over the whole cube with an exact penalty: a start for `minimise`, not a result.

    `algorithm` is NLopt's name of a global method, `effort` limits what it may do.
    """
    import nlopt

    effort = effort or Effort()
    guard = Guard(problem, slopes=False)
    centre = np.full(problem.n, 0.5)
    first = guard(centre)
    if problem.n == 0:
        return minimise(problem, centre, effort=effort)
    if guard.failure is not None:
        return run_nothing(guard, guard.failure, centre, algorithm)
    scale = max(abs(first.objective), SMALL)
    nlopt.srand(effort.seed)
    optimizer = _optimizer(algorithm, problem.n, effort)

    def objective(x: Array, grad: Array) -> float:
        found = guard(x)
        return found.objective / scale + PENALTY * found.violation

    optimizer.set_min_objective(objective)
    return run(optimizer, guard, centre, algorithm)


def _optimizer(algorithm: str, n: int, effort: Effort) -> Optimizer:
    import nlopt

    optimizer = nlopt.opt(find_algorithm(algorithm), n)
    optimizer.set_lower_bounds(np.zeros(n))
    optimizer.set_upper_bounds(np.ones(n))
    optimizer.set_xtol_rel(effort.tolerance)
    optimizer.set_xtol_abs(np.full(n, effort.tolerance))
    optimizer.set_ftol_rel(effort.tolerance)
    optimizer.set_maxeval(effort.evaluations)
    return optimizer
