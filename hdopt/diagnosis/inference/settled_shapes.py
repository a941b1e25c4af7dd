"""Shapes whose sum of squares is jagged: settled one by one, with intervals by their profile.

With the input locked, friction is a play operator on a torque that was recorded in steps: the sum of squares by its
friction torque, or by a knee, jumps up and down by some noise variances from one step of the torque to the next. A
derivative taken there says nothing of the valley that the jumps stand in. Levenberg-Marquardt then leaves a shape on
the node of the search's own grid, which looks like a value that was measured, and the interval of its quadratic form is
too narrow. So each shape is moved alone, by short and long steps, all that is linear solved anew, to where the sum is
least; and its interval ends where the profile has risen for good (Venzon, Moolgavkar, Appl. Statist. 37, 1988).
"""

from __future__ import annotations

import numpy as np

from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import Fit, in_shape
from hdopt.diagnosis.numerical import NORMAL_95
from hdopt.effects.estimate import FitEstimate


def settled(fit: Fit) -> Fit:
    """`fit` with every shape where no move of it alone helps by a noise variance; the same object where that was so."""
    settings = fit.problem.settings.fit
    for _ in range(settings.shape_rounds):
        before = fit
        for index, term in enumerate(fit.terms):
            for name in term.steps:
                fit = _moved_alone(fit, index, name)
        if fit is before:
            break
        fit = refine(fit, settings.known_iterations)
    return fit


def _moved_alone(fit: Fit, index: int, name: str) -> Fit:
    """`fit` with the shape `name` of term `index` at the best place within reach; the same object where it stands."""
    value, step = fit.terms[index].shape[name], fit.terms[index].steps[name]
    strides = fit.problem.settings.fit.shape_strides
    tried = [_at(fit, index, name, value + sign * stride * step) for stride in strides for sign in (1, -1)]
    best = min(tried, key=lambda one: one.objective)
    return best if best.objective < fit.objective - fit.problem.noise.sigma**2 else fit


def _at(fit: Fit, index: int, name: str, value: float) -> Fit:
    """`fit` with the shape `name` of term `index` at `value`, and all that is linear solved anew."""
    shifted = in_shape(fit, index, {**fit.terms[index].shape, name: value})
    return refine(shifted, fit.problem.settings.fit.settled_iterations, move_shapes=False)


def profile_sigma(fit: Fit, index: int, name: str, inflation: float = 1.0) -> float:
    """Standard deviation of the shape `name` of term `index` of `fit` as its profile has it: the farther of the two
    distances beyond which no place tried comes within a 95 % region, over 1.96. The noise is rougher by `inflation`.
    """
    value, step = fit.terms[index].shape[name], fit.terms[index].steps[name]
    rise = NORMAL_95**2 * inflation * fit.problem.noise.sigma**2
    inside = [
        reach * step
        for reach in fit.problem.settings.fit.profile_reach
        for sign in (1, -1)
        if _at(fit, index, name, value + sign * reach * step).objective < fit.objective + rise
    ]
    return max(inside, default=0.0) / NORMAL_95


def estimates_by_profile(fit: Fit, inflation: float = 1.0) -> list[FitEstimate]:
    """Values and covariance of each term of `fit`, its shapes as uncertain as their profiles say where these are wider
    than their quadratic form. The noise is rougher by `inflation`.
    """
    found = []
    for index, (term, estimate) in enumerate(zip(fit.terms, fit.estimates(), strict=True)):
        grown = np.ones(len(estimate.values))
        for at, name in enumerate(term.steps, start=term.width):
            own = float(np.sqrt(estimate.covariance[at, at]))
            grown[at] = max(profile_sigma(fit, index, name, inflation) / own, 1.0) if own > 0 else 1.0
        found.append(FitEstimate(estimate.values, estimate.covariance * np.outer(grown, grown)))
    return found
