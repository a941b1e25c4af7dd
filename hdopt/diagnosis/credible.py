"""Whether a set of effects may be said: what its evidence, taken row by row, does not ask.

A slow term must stand against slow wander (`wander`); a term of several lines must show more of them than any line and
its double would give it (the effect's own `every_part_shows`); what swings behind a pulse or a wave must be more than
their inexact shapes may leave.
"""

from __future__ import annotations

import math

import numpy as np

from hdopt.diagnosis.catalogue import EXPLANATIONS
from hdopt.diagnosis.fit import Fit
from hdopt.diagnosis.price import DISCREPANCY
from hdopt.diagnosis.transmission import excites, is_driven
from hdopt.diagnosis.wander import lost_in_wander

PRICE = 20.0
"""Log evidence that a slow term needs beyond its freedom and its trials, against the wander beside it."""


def is_credible(fit: Fit) -> bool:
    """Whether every term of `fit` may be said."""
    shown = [getattr(EXPLANATIONS[term.effect], "every_part_shows", None) for term in fit.terms]
    if any(shown):
        estimates = fit.estimates()
        for shows, term, estimate in zip(shown, fit.terms, estimates, strict=True):
            if shows is not None and not shows(term, estimate):
                return False
    if any(lost_in_misfit(fit, i) for i, term in enumerate(fit.terms) if is_driven(term)):
        return False
    return not any(
        lost_in_wander(fit, i, PRICE + 2.0 * term.freedom + math.log(max(term.trials, 1.0)))
        for i, term in enumerate(fit.terms)
    )


def lost_in_misfit(fit: Fit, index: int) -> bool:
    """Whether the driven term `index` of `fit` adds no more than the shapes of its exciting terms may leave: a short
    swing after a pulse is what a pulse of another shape would need.
    """
    exciting = sum(float(np.var(fit.contribution(i))) for i, term in enumerate(fit.terms) if excites(term))
    return float(np.var(fit.contribution(index))) < DISCREPANCY * exciting
