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
from numpy.typing import NDArray

from hdopt.diagnosis.catalogue import EXPLANATIONS
from hdopt.diagnosis.effect import Term
from hdopt.diagnosis.effects.tooth_mesh import ZONE_SIDEBANDS
from hdopt.diagnosis.fit import Fit, Problem, evaluate, refine, term_columns
from hdopt.diagnosis.nuisance import Nuisances
from hdopt.diagnosis.samples import Samples

Array = NDArray[np.float64]

MESH = "tooth_mesh"


@dataclass(frozen=True)
class ZoneRipple:
    """A mesh ripple inside the zones: `fit` with the mesh as its only term beside the base, and what it `adds` to the
    error on the rows as recorded (n,), arcmin, its effect on the driving zone included.
    """

    fit: Fit
    adds: Array


def fit_in_zones(samples: Samples, low: Fit, nuisances: Nuisances, ripple: Fit) -> ZoneRipple | None:
    """The mesh term of `ripple` inside the zones, or None where there is none or the sum of sines explains as much.

    `samples` are the rows as recorded with their recorded error, `low` the base and effects fitted on averaged rows.
    """
    base = low.problem.base
    if base is None or [term.effect for term in ripple.terms] != [MESH]:
        return None
    problem = Problem(samples, base, nuisances.columns(samples), ripple.problem.noise, low.problem.prior_scale)
    base_value = base.evaluate_at(problem.rotation, low.errors)[0]
    terms = [EXPLANATIONS[t.effect].term(samples, t.shape, base_value) for t in low.terms]
    bare = evaluate(problem, low.errors, low.offsets, terms, low.coefficients)
    sines = [*low.coefficients, *ripple.coefficients]
    best = refine(evaluate(problem, low.errors, low.offsets, [*terms, *ripple.terms], sines), 4, move_shapes=False)
    rows = float((problem.noise.root_weight > 0).sum())
    best_score, inside = _score(best, rows), None
    for sidebands in range(len(ZONE_SIDEBANDS)):
        term = EXPLANATIONS[MESH].term(samples, {"sidebands": float(sidebands), "zones": 1.0})
        start = evaluate(problem, low.errors, low.offsets, [*terms, term], [*low.coefficients, _seed(bare, term)])
        fit = refine(start, iterations=8, move_shapes=False)
        if _score(fit, rows) < best_score:
            best_score, inside = _score(fit, rows), fit
    return None if inside is None else _alone(inside, terms)


def _seed(bare: Fit, term: Term) -> Array:
    """First coefficients of `term`, with the zones as they drive without it."""
    columns = term_columns(term, bare.zone, bare.problem.base)
    return np.linalg.lstsq(columns, bare.residual, rcond=None)[0]


def _score(fit: Fit, rows: float) -> float:
    """Schwarz's criterion, in noise variances."""
    return fit.objective / fit.problem.noise.sigma**2 + sum(term.width for term in fit.terms) * math.log(rows)


def _alone(fit: Fit, others: Sequence[Term]) -> ZoneRipple:
    without = evaluate(fit.problem, fit.errors, fit.offsets, fit.terms[: len(others)], fit.coefficients[: len(others)])
    alone = replace(fit, terms=fit.terms[len(others) :], coefficients=fit.coefficients[len(others) :])
    return ZoneRipple(alone, fit.prediction - without.prediction)
