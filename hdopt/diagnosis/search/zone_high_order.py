"""Tooth mesh as the zones meet it: a ripple that also decides which zone drives.

Where the ripple is as large as the difference between the two zones, the larger of the two switches with every tooth,
and its mean rises: a slow bulge at each change of the driving zone that no sine beside the base explains. So a mesh
ripple that was found is fitted once more on the rows as recorded, inside the larger-zone rule and with base and
effects free beside it, and kept so if that explains the rows better.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.inference.fit import Fit, evaluate, refine, term_columns
from hdopt.diagnosis.inference.nuisance import Nuisances
from hdopt.effects.term import Term
from hdopt.recordings.rows import Rows


@dataclass(frozen=True)
class ZoneRipple:
    """A mesh ripple inside the zones: `fit` with the mesh as its only term beside the base, and what it `adds` to the
    error on the rows as recorded (n,), arcmin, its effect on the driving zone included.
    """

    fit: Fit
    adds: Array


def fit_in_zones(rows: Rows, low: Fit, nuisances: Nuisances, ripple: Fit) -> ZoneRipple | None:
    """The term of `ripple` inside the zones, or None where it acts beside them or the sum of sines explains as much.

    `rows` are the rows as recorded with their recorded error, `low` the base and effects fitted on averaged rows.
    `nuisances` are the columns that are always free.
    """
    base = low.problem.base
    if base is None or len(ripple.terms) != 1:
        return None
    (found,) = ripple.terms
    effect = ripple.problem.explanations[found.effect]
    variants = effect.in_zones(found.shape)
    if not variants:
        return None
    problem = replace(low.problem, rows=rows, nuisance=nuisances.columns(rows), noise=ripple.problem.noise)
    settings = problem.settings.fit
    base_value = base.evaluate_at(problem.rotation, low.errors)[0]
    terms = [problem.explanations[t.effect].term(rows, t.shape, base_value) for t in low.terms]
    bare = evaluate(problem, low.errors, low.offsets, terms, low.coefficients)
    sines = [*low.coefficients, *ripple.coefficients]
    best = refine(
        evaluate(problem, low.errors, low.offsets, [*terms, *ripple.terms], sines),
        settings.settled_iterations,
        move_shapes=False,
    )
    weighed = problem.weighed_rows
    best_score, inside = _score(best, weighed), None
    for shape in variants:
        term = effect.term(rows, shape)
        start = evaluate(problem, low.errors, low.offsets, [*terms, term], [*low.coefficients, _seed(bare, term)])
        fit = refine(start, settings.known_iterations, move_shapes=False)
        if _score(fit, weighed) < best_score:
            best_score, inside = _score(fit, weighed), fit
    return None if inside is None else _alone(inside, terms)


def _seed(bare: Fit, term: Term) -> Array:
    """First coefficients of `term`, with the zones as they drive without it."""
    columns = term_columns(term, bare)
    return np.asarray(np.linalg.lstsq(columns, bare.residual, rcond=None)[0], float)


def _score(fit: Fit, rows: float) -> float:
    """Schwarz's criterion, in noise variances."""
    return fit.objective / fit.problem.noise.sigma**2 + sum(term.width for term in fit.terms) * math.log(rows)


def _alone(fit: Fit, others: Sequence[Term]) -> ZoneRipple:
    without = evaluate(fit.problem, fit.errors, fit.offsets, fit.terms[: len(others)], fit.coefficients[: len(others)])
    alone = replace(fit, terms=fit.terms[len(others) :], coefficients=fit.coefficients[len(others) :])
    return ZoneRipple(alone, fit.prediction - without.prediction)
