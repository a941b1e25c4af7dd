"""Intervals over the forms that an effect may have.

A real part crosses over by no law exactly, and a discrete form has no curvature: each other form of a term is fitted
in its place, and where it explains as well, by the same quantile as ends a profile, its own interval counts besides.
So the interval is that of the profile likelihood over both, the number and the form (Venzon and Moolgavkar, Appl.
Stat. 37, 1988).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hdopt.diagnosis.inference.fit import Fit, in_shape
from hdopt.diagnosis.inference.profile_interval import profiled_estimates, settle
from hdopt.diagnosis.numerical import NORMAL_95
from hdopt.effects.estimate import FitEstimate


def estimates_over_forms(fit: Fit) -> list[FitEstimate]:
    """`profiled_estimates` of a `fit` that stands, those of shape parameters widened by what other forms say that
    explain the rows as well."""
    return [_over_forms(fit, index, estimate) for index, estimate in enumerate(profiled_estimates(fit))]


def _over_forms(fit: Fit, index: int, estimate: FitEstimate) -> FitEstimate:
    """The `estimate` of term `index` of `fit`, over its other forms; the same object where it has none."""
    term = fit.terms[index]
    shapes = fit.problem.explanations[term.effect].other_forms(term.shape)
    moving = range(term.width, term.freedom)
    if not shapes or not moving:
        return estimate
    start = fit.problem.base_width + fit.problem.nuisance.shape[1] + sum(one.freedom for one in fit.terms[:index])
    rises = fit.expected_rises()[start : start + term.freedom]
    # The rise at one standard deviation, counted in the robust variance as that of a profile is.
    unit = max(float(rises[at] * estimate.covariance[at, at]) for at in moving)
    best = settle(fit).objective
    profiles = dict(estimate.profiles)
    for shape in shapes:
        other = settle(in_shape(fit, index, shape))
        left = NORMAL_95**2 - (other.objective - best) / unit
        if left <= 0:
            continue
        of_form = other.estimates()[index]
        for at in moving:
            here = replace(estimate, profiles=profiles).parameter(at, "")
            half = float(np.sqrt(left * of_form.covariance[at, at])) * fit.problem.settings.profile.widened
            value = float(of_form.values[at])
            profiles[at] = min(here.low, value - half), max(here.high, value + half)
    return replace(estimate, profiles=profiles)
