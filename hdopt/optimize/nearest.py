"""The design nearest to limits that none keeps: the most broken one as little as can be, then the next, then the error.

A search ranks such designs by the limit that they break most. Where no design can mend that one, as a bending stress
that no free variable changes, all are alike, and the objective alone would choose: it pays to break what could be kept.
"""

from __future__ import annotations

from dataclasses import replace

from hdopt.optimize.objectives import find_quantity
from hdopt.optimize.problem import DesignProblem, Limit
from hdopt.optimize.solve import Method, Solution, solve


def nearest(problem: DesignProblem, solution: Solution, method: Method) -> Solution:
    """The design of the combination of `problem` that is nearest to its limits, from a `solution` that breaks some.

    The limit that is broken most gives way to what the solution reaches of it, and `method` searches again under the
    others, until none of those left is broken. Raises `KeyboardInterrupt` where the search is interrupted.
    """
    found, relaxed, spent = solution, problem, solution.evaluations
    for _ in problem.limits:
        if found.feasible or found.outcome.evaluation is None:
            break
        worst = max(relaxed.limits, key=lambda limit: limit.excess(_reached(relaxed, limit, found.values)))
        bound = _reached(relaxed, worst, found.values)
        relaxed = relaxed.with_limits(replace(worst, bound=bound))
        found = solve(relaxed, method, [found.values, problem.space.baseline_values])
        spent += found.evaluations
        if found.outcome.interrupted:
            raise KeyboardInterrupt
    judged = replace(found.problem, limits=problem.limits)
    outcome = replace(found.outcome, evaluation=judged.evaluate(judged.place(found.values)))
    return Solution(judged, found.values, outcome, spent)


def _reached(problem: DesignProblem, limit: Limit, values: dict[str, float]) -> float:
    """What a design of `problem` with these `values` has of the quantity of a `limit`: its worst piece."""
    pieces, _ = find_quantity(limit.quantity).pieces(problem.point(values, slopes=False))
    return float(pieces.min() if limit.at_least else pieces.max())
