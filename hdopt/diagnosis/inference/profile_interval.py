"""Profile-likelihood intervals of a finished fit: one parameter is held, the others are fitted again beside it.

The interval ends where the least objective under a held parameter has risen by the quantile of chi-squared with one
degree of freedom (Venzon and Moolgavkar, Appl. Stat. 37, 1988), as lmfit's `conf_interval` has it with the F
distribution. Where the objective is a parabola that is +-1.96 standard deviations, and nothing is fitted again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy import optimize

from hdopt.arrays import Array
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import Fit, evaluate
from hdopt.diagnosis.numerical import NORMAL_95
from hdopt.diagnosis.settings import ProfileSettings
from hdopt.effects.estimate import FitEstimate


@dataclass(frozen=True)
class HeldParameter:
    """One parameter of a finished fit: its `value`, its standard deviation `sigma`, and what the fit becomes when it is
    held elsewhere.

    `held_at` takes a value and gives the least objective of the others, and the value that it could be held at: beyond
    a bound, the bound. `best` is the objective of the fit, `unit` its expected rise at one standard deviation: the
    variance of the residual, for a sum of squares.
    """

    value: float
    sigma: float
    held_at: Callable[[float], tuple[float, float]]
    best: float
    unit: float

    def rise(self, value: float) -> float:
        """Rise of the objective with the parameter held at `value`, in its expected rise at one standard deviation."""
        return (self.held_at(value)[0] - self.best) / self.unit


def is_parabola(held: HeldParameter, settings: ProfileSettings) -> bool:
    """Whether +-1.96 standard deviations serve for a `held` parameter: the objective at one standard deviation to
    either side is what its curvature says within `settings.curvature`, and neither end lies beyond a bound."""
    for way in (-1.0, 1.0):
        end = held.value + way * NORMAL_95 * held.sigma
        if held.held_at(end)[1] != end:
            return False
        if abs(held.rise(held.value + way * held.sigma) - 1.0) > settings.curvature:
            return False
    return True


def profile_interval(held: HeldParameter, rise: float, settings: ProfileSettings) -> tuple[float, float]:
    """Ends of the interval of a `held` parameter: where the objective has risen by `rise` expected rises at one
    standard deviation (3.84 for 95 %: the quantile of chi-squared, or of F where the rows are few).

    A bound ends it where the objective never rises so far; infinite where it does not within `settings.tries`
    doublings of the first step.
    """
    return _end(held, -1.0, rise, settings), _end(held, 1.0, rise, settings)


def _end(held: HeldParameter, way: float, rise: float, settings: ProfileSettings) -> float:
    """The end to one side, `way` -1 or 1: bracketed by doubling, then the root of what is nearly a straight line."""

    def excess(value: float) -> float:
        return float(np.sqrt(max(held.rise(value), 0.0)) - np.sqrt(rise))

    step = float(np.sqrt(rise)) * held.sigma
    inner = held.value
    for _ in range(settings.tries):
        asked = held.value + way * step
        outer = held.held_at(asked)[1]
        if excess(outer) >= 0:
            tolerance = settings.tolerance * held.sigma
            return float(optimize.brentq(excess, min(inner, outer), max(inner, outer), xtol=tolerance))
        if outer != asked:
            return outer
        inner, step = outer, 2 * step
    return way * float(np.inf)


def settle(fit: Fit) -> Fit:
    """A `fit` refined until its objective stands to far less than a rise of one: a search stops earlier."""
    settings = fit.problem.settings.profile
    return refine(fit, settings.iterations, settings.settled)


def shape_parameter(fit: Fit, index: int, name: str, sigma: float, unit: float) -> HeldParameter:
    """The free shape parameter `name` of term `index` of a `fit` that stands; `sigma` and `unit` as in `HeldParameter`.

    A held fit starts from where the curvature of the whole fit puts the others, or from the nearest one held before,
    whichever is better.
    """
    problem, term = fit.problem, fit.terms[index]
    value = float(term.shape[name])
    before: dict[float, Fit] = {value: fit}

    def at_start(start: Fit, asked: float) -> Fit:
        shape = {**start.terms[index].shape, name: asked}
        made = problem.explanations[term.effect].term(problem.rows, shape, start.motion)
        free = {key: step for key, step in made.steps.items() if key != name}
        terms = list(start.terms)
        terms[index] = replace(made, trials=term.trials, odds=term.odds, steps=free)
        return evaluate(problem, start.errors, start.offsets, terms, start.coefficients)

    @cache
    def held_at(asked: float) -> tuple[float, float]:
        nearest = before[min(before, key=lambda other: abs(other - asked))]
        starts = [at_start(start, asked) for start in (fit.along(index, name, asked - value), nearest)]
        settled = settle(min(starts, key=lambda start: start.objective))
        before[asked] = settled
        return settled.objective, float(settled.terms[index].shape[name])

    return HeldParameter(value, sigma, held_at, fit.objective, unit)


def profiled_estimates(fit: Fit) -> list[FitEstimate]:
    """The estimates of each term of a `fit` that stands, with profile intervals of those free shape parameters whose
    +-1.96 standard deviations do not serve; none is narrower than they are within its bounds.

    The rise that ends an interval is counted in the robust variance: what widens a standard deviation widens it. All
    are wider by `settings.widened` than that has it, for what no noise model knows: shapes that are not exact.
    """
    settings = fit.problem.settings.profile
    estimates = [replace(one, covariance=settings.widened**2 * one.covariance) for one in fit.estimates()]
    if not any(term.steps for term in fit.terms):
        return estimates
    expected, settled = fit.expected_rises(), settle(fit)
    start = fit.problem.base_width + fit.problem.nuisance.shape[1]
    found = []
    for index, (term, estimate) in enumerate(zip(fit.terms, estimates, strict=True)):
        profiles: dict[int, tuple[float, float]] = {}
        for at, name in enumerate(term.steps, term.width):
            sigma = float(np.sqrt(max(estimate.covariance[at, at], 0.0)))
            unit = expected[start + at] * sigma**2
            if sigma > 0 and unit > 0:
                held = shape_parameter(settled, index, name, sigma, unit)
                if not is_parabola(held, settings):
                    profiles[at] = _widened(profile_interval(held, NORMAL_95**2, settings), held)
        found.append(replace(estimate, profiles=profiles))
        start += term.freedom
    return found


def _widened(profile: tuple[float, float], held: HeldParameter) -> tuple[float, float]:
    """The ends of a `profile`, or of +-1.96 standard deviations as far as the bounds of the `held` parameter let them,
    whichever lie farther out: a refit that stays in a worse minimum makes a profile too narrow, never too wide."""
    half = NORMAL_95 * held.sigma
    low, high = (held.held_at(held.value + way * half)[1] for way in (-1.0, 1.0))
    return min(profile[0], low), max(profile[1], high)


def least_squares_parameter(
    residual: Callable[[Array], Array], found: Array, index: int, covariance: Array
) -> HeldParameter:
    """Parameter `index` of an ordinary least-squares fit, for problems of a few numbers.

    `residual` of the parameters (p,) gives (n,); `found` (p,) is where its sum of squares is least, `covariance` (p, p)
    of it. The variance of the residual is that of n - p degrees of freedom.
    """
    white = residual(found)
    others = np.arange(len(found)) != index

    @cache
    def held_at(value: float) -> tuple[float, float]:
        def beside(free: Array) -> Array:
            parameters = np.array(found, float)
            parameters[index], parameters[others] = value, free
            return residual(parameters)

        return 2 * float(optimize.least_squares(beside, found[others], x_scale="jac").cost), value

    best = float(white @ white)
    unit = best / (len(white) - len(found))
    return HeldParameter(float(found[index]), float(np.sqrt(covariance[index, index])), held_at, best, unit)
