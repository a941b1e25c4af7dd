"""A fit of which nothing but the base bends: all its terms are linear, and it goes down inside a compiled pass.

The numbers are those of `Fit` but for rounding. A start of a base fit takes some thirty looks, and a diagnosis a
thousand starts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.diagnosis.inference.base_excitation import is_driven
from hdopt.diagnosis.inference.compiled_descent import Base, Effort, Problem, descended
from hdopt.diagnosis.inference.fit import Fit, FitProblem, evaluate
from hdopt.diagnosis.inference.read_angle import reads_input
from hdopt.drive.geometry import ARCMIN
from hdopt.effects.met import Waves
from hdopt.effects.term import Term
from hdopt.kinematics.cartesian import MOST_WAVES, PARAMETERS, CartesianModel


def _is_linear(term: Term, move_shapes: bool, base: CartesianModel) -> bool:
    """Whether `term` is linear: no shape of its own moves, the drive's motion does not make its columns, and of all
    that stands on a spline it is waves. One that moves the angles at which the drive stood is taken for linear too,
    but for a `base` with measured teeth, whose slopes the parameters do not tell.
    """
    if (move_shapes and term.steps) or is_driven(term):
        return False
    if reads_input(term) and (term.columns is None or len(base.cs_table) or len(base.fs_table)):
        return False
    return term.met is None or (isinstance(term.met, Waves) and max(term.met.harmonics) <= MOST_WAVES)


@dataclass(frozen=True)
class LinearTermsFit:
    """A fit of linear terms (`begun`): its `base` and `problem` as the compiled descent takes them, its parameters
    there (`start`, (q,)), and which of them are the `offsets` and the coefficients of each of its terms (`places`)."""

    begun: Fit
    base: Base
    problem: Problem
    start: Array
    offsets: slice
    places: tuple[Index, ...]

    @classmethod
    def of(cls, fit: Fit, move_shapes: bool) -> LinearTermsFit | None:
        """`fit` so, None where it has no base or terms that are not linear; `move_shapes`: whether shapes move too."""
        base = fit.problem.base
        if base is None or not all(_is_linear(term, move_shapes, base) for term in fit.terms):
            return None
        waves, places = _waves_of(fit.terms)
        seen, fixed = [np.empty((2, len(fit.zone), 0))], [fit.problem.nuisance]
        end = PARAMETERS + 2 * len(waves)
        for i, term in enumerate(fit.terms):
            if term.columns is None and term.zones is not None:
                places[i], end = np.arange(end, end + term.width), end + term.width
                seen.append(term.zones)
        read = [i for i, term in enumerate(fit.terms) if reads_input(term)]
        for i in read:
            places[i], end = np.arange(end, end + fit.terms[i].width), end + fit.terms[i].width
        offsets = slice(end, end + len(fit.offsets))
        end = offsets.stop
        for i, term in enumerate(fit.terms):
            if term.columns is not None and i not in read:
                places[i], end = np.arange(end, end + term.width), end + term.width
                fixed.append(term.columns)
        start = np.empty(end)
        start[:PARAMETERS], start[offsets] = fit.errors, fit.offsets
        for place, coefficients in zip(places, fit.coefficients, strict=True):
            start[place] = coefficients
        readings = [columns for i in read if (columns := fit.terms[i].columns) is not None]
        problem = _problem_of(fit.problem, waves, np.concatenate(seen, axis=2), readings, fixed)
        return cls(fit, Base(base.gear, base.cs_table, base.fs_table), problem, start, offsets, tuple(places))

    def refined(self, iterations: int, tolerance: float) -> Fit:
        """The end of the way down: at most so many `iterations`, until the objective drops by less than `tolerance` of
        itself."""
        end, _ = descended(self.base, self.problem, self.start, self.effort(iterations, tolerance))
        coefficients = [end[place] for place in self.places]
        return evaluate(self.begun.problem, end[:PARAMETERS], end[self.offsets], self.begun.terms, coefficients)

    def effort(self, iterations: int, tolerance: float) -> Effort:
        """The rules of the way down, as set, for so many `iterations` and this `tolerance`."""
        rules = self.begun.problem.settings.fit
        return Effort(
            iterations,
            tolerance,
            rules.damping,
            rules.damping_tries,
            rules.damping_singular,
            rules.damping_up,
            rules.damping_down,
            rules.damping_least_up,
            rules.damping_least,
            rules.scale_floor,
        )


def _waves_of(terms: Sequence[Term]) -> tuple[Index, list[Index]]:
    """Spline and harmonic of each wave of the `terms`, (w, 2), those of a spline together and rising; and which of the
    parameters are the coefficients of each term's waves, none of a term that has none."""
    own = [[(m.spline, h) for h in m.harmonics] if isinstance(m := term.met, Waves) else [] for term in terms]
    waves = np.array([wave for one in own for wave in one], np.int64).reshape(-1, 2)
    order = np.lexsort((waves[:, 1], waves[:, 0]))
    sine = PARAMETERS + 2 * np.argsort(order)
    both, ends = np.stack([sine, sine + 1], axis=1), np.cumsum([0, *map(len, own)])
    return waves[order], [both[a:b].ravel() for a, b in pairwise(ends)]


def _problem_of(
    problem: FitProblem, waves: Index, zones: Array, readings: Sequence[Array], fixed: Sequence[Array]
) -> Problem:
    """`problem` as the compiled descent takes it: with `waves` round the splines, what stands in the
    `zones` (2, n, z), the columns of `readings` of the input and those that nothing moves (`fixed`)."""
    noise, base = problem.noise, problem.base
    return Problem(
        problem.rotation,
        noise.whiten(problem.rows.error),
        noise.ar,
        noise.root_weight,
        waves,
        np.ascontiguousarray(zones.transpose(0, 2, 1)),
        np.ascontiguousarray(np.column_stack([np.empty((len(problem.rows), 0)), *readings]).T),
        ARCMIN * problem.rows.ratio,
        1.0 if base is None else base.advance,
        noise.whitened(fixed).T,
        noise.sigma**2 * problem.prior_precision(PARAMETERS),
        problem.box,
    )
