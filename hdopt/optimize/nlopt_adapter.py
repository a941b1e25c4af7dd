"""NLopt behind a guard: nothing an algorithm does can lose the best point, hide an error, or meet a NaN.

What NLopt does by itself, each with a test: an exception in a callback is swallowed by some algorithms and ends others
without a result; SLSQP and COBYLA raise `RoundoffLimited` when they are in fact done, and the point is lost; the array
a callback gets is a view that NLopt overwrites; NaN makes some algorithms crash, hang or report success.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias  # Any: nlopt's optimizer, which has no types

import numpy as np

from hdopt.arrays import Array
from hdopt.errors import HdoptError, unknown_name

FEASIBLE = 1e-6
"""Largest constraint value (constraints are scaled to 1) that counts as met."""

REASONS = {
    1: "converged",
    2: "the wanted value is reached",
    3: "converged: the value no longer changes",
    4: "converged: the design no longer changes",
    5: "the number of evaluations allowed is used up",
    6: "the time allowed is used up",
    -1: "the algorithm failed",
    -2: "the algorithm refused its arguments",
    -3: "out of memory",
    -4: "converged: rounding allows no further progress",
    -5: "stopped",
}
"""NLopt's result codes in words."""
INTERRUPTED = "interrupted; this is the best so far"
NO_PROBLEM = "nothing to choose: every variable is fixed"


@dataclass(frozen=True)
class Evaluation:
    """A problem at one point: objective pieces (k,) whose largest counts, constraints (c,) <= 0, with slopes."""

    pieces: Array
    piece_slopes: Array
    constraints: Array
    constraint_slopes: Array

    @property
    def objective(self) -> float:
        return float(self.pieces.max())

    @property
    def violation(self) -> float:
        return float(max(self.constraints.max(initial=0.0), 0.0))

    @property
    def finite(self) -> bool:
        return all(
            np.isfinite(part).all()
            for part in (self.pieces, self.piece_slopes, self.constraints, self.constraint_slopes)
        )


class MinimaxProblem(Protocol):
    """Minimise the largest piece subject to constraints, over the unit cube of dimension `n`."""

    @property
    def n(self) -> int: ...

    @property
    def pieces(self) -> int: ...

    @property
    def constraints(self) -> int: ...

    def evaluate(self, u: Array, slopes: bool = True) -> Evaluation:
        """Raises `HdoptError` where `u` is no possible design: such a point is avoided, not an end.

        Without `slopes` those of the evaluation are zeros.
        """


@dataclass(frozen=True)
class Outcome:
    """The best point met: feasible if any was, else the one closest to it."""

    u: Array
    evaluation: Evaluation | None
    evaluations: int
    impossible: int
    algorithm: str
    stopped_because: str
    interrupted: bool = False

    @property
    def feasible(self) -> bool:
        return self.evaluation is not None and self.evaluation.violation <= FEASIBLE

    def better_than(self, other: Outcome | None) -> bool:
        if other is None or other.evaluation is None:
            return True
        return self.evaluation is not None and rank(self.evaluation) < rank(other.evaluation)


def rank(evaluation: Evaluation) -> tuple[float, float]:
    """Order of merit of an `evaluation`: feasible points by objective, others by violation."""
    if evaluation.violation <= FEASIBLE:
        return 0.0, evaluation.objective
    return evaluation.violation, evaluation.objective


class Guard:
    """Evaluates a problem for NLopt: copies, counts, remembers the best, and answers with finite numbers only."""

    def __init__(self, problem: MinimaxProblem, slopes: bool = True) -> None:
        self.problem = problem
        self.slopes = slopes
        self.evaluations = self.impossible = 0
        self.best: tuple[Array, Evaluation] | None = None
        self.failure: BaseException | None = None
        self._last: tuple[bytes, Evaluation] | None = None
        self._worst = 0.0
        self.stop: Callable[[], None] = lambda: None

    def __call__(self, view: Array) -> Evaluation:
        u = np.array(view[: self.problem.n], float)
        key = u.tobytes()
        if self._last is not None and self._last[0] == key:
            return self._last[1]
        found = self._evaluate(u) if self.failure is None else None
        if found is None:
            found = self._stand_in()
        else:
            self._worst = max(self._worst, abs(found.objective), found.violation)
            if self.best is None or rank(found) < rank(self.best[1]):
                self.best = u, found
        self._last = key, found
        return found

    def _evaluate(self, u: Array) -> Evaluation | None:
        self.evaluations += 1
        try:
            if not np.isfinite(u).all():
                raise HdoptError("the algorithm asked for a point that is not finite")
            found = self.problem.evaluate(u, self.slopes)
        except HdoptError:
            self.impossible += 1
            return None
        except BaseException as error:
            # Kept and raised after NLopt has returned; some algorithms would swallow it.
            self.failure = error
            self.stop()
            return None
        if not found.finite:
            self.impossible += 1
            return None
        return found

    def _stand_in(self) -> Evaluation:
        """What NLopt is told of an impossible design: finite, and worse than all it has seen."""
        n, k, c = self.problem.n, self.problem.pieces, self.problem.constraints
        worse = 2 * self._worst + 1.0
        return Evaluation(np.full(k, worse), np.zeros((k, n)), np.full(c, worse), np.zeros((c, n)))


@dataclass(frozen=True)
class Effort:
    """When to stop, and the seed of what is random."""

    evaluations: int = 200
    tolerance: float = 1e-6
    seed: int = 1


def find_algorithm(name: str) -> int:
    """NLopt's number of the algorithm `name`, such as 'LD_SLSQP'; an unknown one is an `HdoptError`."""
    import nlopt

    known = [item for item in dir(nlopt) if item[:3] in ("LD_", "LN_", "GN_", "GD_")]
    if name not in known:
        raise HdoptError(unknown_name("NLopt algorithm", name, known))
    number: int = getattr(nlopt, name)
    return number


Optimizer: TypeAlias = Any
"""An `nlopt.opt`; NLopt has no types."""


def run(optimizer: Optimizer, guard: Guard, start: Array, name: str) -> Outcome:
    """Run a prepared NLopt `optimizer` on `guard` from `start` in the unit cube (n,); its best point whatever happens.

    `name` is that of the algorithm, for the result. Errors of the problem are raised.
    """
    import nlopt

    guard.stop = optimizer.force_stop
    try:
        optimizer.optimize(start)
        code = optimizer.last_optimize_result()
    except nlopt.RoundoffLimited:
        code = -4
    except nlopt.ForcedStop:
        code = -5
    except KeyboardInterrupt as error:
        guard.failure, code = error, -5
    except Exception as error:
        if not _is_nlopts(error):
            raise
        code = -2 if "argument" in type(error).__name__ or isinstance(error, ValueError) else -1
    interrupted = isinstance(guard.failure, KeyboardInterrupt)
    if guard.failure is not None and not interrupted:
        raise guard.failure
    u, best = guard.best if guard.best is not None else (np.array(start[: guard.problem.n]), None)
    reason = INTERRUPTED if interrupted else REASONS.get(code, f"NLopt's result code {code}")
    return Outcome(u, best, guard.evaluations, guard.impossible, name, reason, interrupted)


def _is_nlopts(error: Exception) -> bool:
    """Whether NLopt itself gave up: its failures are classes of its own in some releases, plain ones in others."""
    return type(error).__module__.partition(".")[0] == "nlopt" or str(error).startswith("nlopt")
