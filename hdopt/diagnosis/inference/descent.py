"""Levenberg and Marquardt's way down to a fit's minimum (Marquardt, J. SIAM 11, 1963), from wherever it stands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, Self, TypeVar

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.inference.fit import Fit, FitProblem, moved
from hdopt.diagnosis.inference.linear_terms import LinearTermsFit
from hdopt.diagnosis.inference.normal_equations import solved


class Point(Protocol):
    """Where a descent stands: parameters of a `problem`, of which the first are the base's `errors`, mm, and the
    `objective` there."""

    @property
    def problem(self) -> FitProblem: ...

    @property
    def errors(self) -> Array: ...

    @property
    def objective(self) -> float: ...

    def normal_equations(self) -> tuple[Array, Array]:
        """Inner products of the whitened columns of all parameters with each other, (q, q), and with the whitened
        residual, (q,)."""

    def moved(self, step: Array) -> Self:
        """The point a `step` (q,) away, the base's errors kept in their box."""


P = TypeVar("P", bound=Point)


@dataclass(frozen=True)
class FitPoint:
    """Any `fit` as a point; `move_shapes`: whether the shapes of its terms move too."""

    fit: Fit
    move_shapes: bool

    @property
    def problem(self) -> FitProblem:
        return self.fit.problem

    @property
    def errors(self) -> Array:
        return self.fit.errors

    @property
    def objective(self) -> float:
        return self.fit.objective

    def normal_equations(self) -> tuple[Array, Array]:
        """`Fit.normal_equations`."""
        return self.fit.normal_equations(self.move_shapes)

    def moved(self, step: Array) -> FitPoint:
        """The fit moved by `step` (q,)."""
        return FitPoint(moved(self.fit, step, self.move_shapes), self.move_shapes)


def refine(fit: Fit, iterations: int | None = None, tolerance: float | None = None, move_shapes: bool = True) -> Fit:
    """The way down from `fit` on: at most so many `iterations`, until the objective drops by less than `tolerance` of
    itself (None: as set); the shapes of terms stay where not `move_shapes`.
    """
    settings = fit.problem.settings.fit
    most = settings.iterations if iterations is None else iterations
    least = settings.tolerance if tolerance is None else tolerance
    start = LinearTermsFit.of(fit, move_shapes)
    if start is None:
        return _descended(FitPoint(fit, move_shapes), most, least).fit
    return _descended(start, most, least).fit


def _descended(point: P, iterations: int, tolerance: float) -> P:
    """The last of the points that `refine` comes through from `point` on."""
    settings = point.problem.settings.fit
    damping = settings.damping
    for _ in range(iterations):
        better, damping = _improved(point, damping)
        if better is None:
            break
        drop = point.objective - better.objective
        point, damping = better, max(damping / settings.damping_down, settings.damping_least)
        if drop < tolerance * point.objective:
            break
    return point


def _improved(point: P, damping: float) -> tuple[P | None, float]:
    """A better point one damped step away, None where none was found, and the damping that it took."""
    problem, settings = point.problem, point.problem.settings.fit
    wb = problem.base_width
    normal, gradient = point.normal_equations()
    precision = problem.noise.sigma**2 * problem.prior_precision(len(normal))
    gradient[:wb] -= precision[:wb] * point.errors
    diagonal = slice(None, None, len(normal) + 1)
    normal.flat[diagonal] += precision
    scale = np.sqrt(np.maximum(normal.flat[diagonal], settings.scale_floor))
    scaled = normal / (scale[:, None] * scale)
    for _ in range(settings.damping_tries):
        damped = scaled.copy()
        damped.flat[diagonal] += damping
        try:
            step = solved(damped, gradient / scale) / scale
        except np.linalg.LinAlgError:
            damping *= settings.damping_singular
            continue
        trial = point.moved(step)
        if trial.objective < point.objective:
            return trial, damping
        damping = max(damping * settings.damping_up, settings.damping_least_up)
    return None, damping
