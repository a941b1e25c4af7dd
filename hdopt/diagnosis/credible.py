"""Whether a set of effects may be said: what its evidence, taken row by row, does not ask.

A slow term must stand against slow wander (`wander`); a term of several lines must show more of them than any line and
its double would give it (the effect's own `every_part_shows`).
"""

from __future__ import annotations

import math

from hdopt.diagnosis.catalogue import EXPLANATIONS
from hdopt.diagnosis.fit import Fit
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
    return not any(
        lost_in_wander(fit, i, PRICE + 2.0 * term.freedom + math.log(max(term.trials, 1.0)))
        for i, term in enumerate(fit.terms)
    )
