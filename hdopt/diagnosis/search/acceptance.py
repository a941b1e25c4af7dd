"""Whether a set of effects may be named: what its log evidence, taken row by row, does not ask.

A slow term must stand against slow wander (`checks.slow_wander`); a term of several lines must show more of them than
any line and its double would give it (the effect's own `every_part_shows`); what swings behind a pulse or a wave must
be more than their inexact shapes may leave; and no effect is a reading or two alone.
"""

from __future__ import annotations

import numpy as np

from hdopt.diagnosis.checks.slow_wander import lost_in_wander
from hdopt.diagnosis.inference.base_excitation import excites, is_driven
from hdopt.diagnosis.inference.catalogue import properties_of
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.search.penalty import searched
from hdopt.effects.term import Term


def is_acceptable(fit: Fit) -> bool:
    """Whether every term of `fit` may be named."""
    if any(properties_of(term.effect).has_parts for term in fit.terms):
        for term, estimate in zip(fit.terms, fit.estimates(), strict=True):
            if not properties_of(term.effect).every_part_shows(term, estimate):
                return False
    if any(lost_in_misfit(fit, i) for i, term in enumerate(fit.terms) if is_driven(term)):
        return False
    if any(borne_by_few_rows(fit, i) for i in range(len(fit.terms))):
        return False
    return not any(lost_in_wander(fit, i, slow_penalty(fit, term)) for i, term in enumerate(fit.terms))


def borne_by_few_rows(fit: Fit, index: int) -> bool:
    """Whether no more than a row or two bear term `index` of `fit`: a pulse narrower than the rows are apart, met once,
    or there and back at the same angle, is readings that are off, by a whole step of a coarse encoder or by outliers.

    Rows that bear it count by the inverse of the sum of squares of their shares in its power (the participation
    ratio): one where one has all, n where n have alike.
    """
    power = fit.contribution(index) ** 2
    return bool(power.sum() ** 2 <= fit.problem.settings.search.fewest_rows * np.sum(power**2))


def slow_penalty(fit: Fit, term: Term) -> float:
    """Log evidence that a slow `term` of `fit` needs against the wander beside it."""
    settings = fit.problem.settings.search
    return settings.slow_cost + settings.slow_freedom * term.freedom + searched(term) + term.odds


def lost_in_misfit(fit: Fit, index: int) -> bool:
    """Whether the driven term `index` of `fit` adds no more than the shapes of its exciting terms may leave: a short
    swing after a pulse is what a pulse of another shape would need.
    """
    exciting = sum(float(np.var(fit.contribution(i))) for i, term in enumerate(fit.terms) if excites(term))
    return float(np.var(fit.contribution(index))) < fit.problem.settings.penalty.discrepancy * exciting
