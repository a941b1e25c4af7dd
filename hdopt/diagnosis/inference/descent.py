"""Levenberg and Marquardt's way down to a fit's minimum (Marquardt, J. SIAM 11, 1963), from wherever it stands."""

from __future__ import annotations

import numpy as np

from hdopt.diagnosis.inference.fit import Fit, moved
from hdopt.diagnosis.inference.linear_terms import LinearTermsFit
from hdopt.diagnosis.inference.normal_equations import solved


def refine(fit: Fit, iterations: int | None = None, tolerance: float | None = None, move_shapes: bool = True) -> Fit:
    """The way down from `fit` on: at most so many `iterations`, until the objective drops by less than `tolerance` of
    itself (None: as set); the shapes of terms stay where not `move_shapes`.
    """
    settings = fit.problem.settings.fit
    most = settings.iterations if iterations is None else iterations
    least = settings.tolerance if tolerance is None else tolerance
    linear = LinearTermsFit.of(fit, move_shapes)
    return _descended(fit, most, least, move_shapes) if linear is None else linear.refined(most, least)


def _descended(fit: Fit, iterations: int, tolerance: float, move_shapes: bool) -> Fit:
    """The last of the fits that `refine` comes through from `fit` on."""
    settings = fit.problem.settings.fit
    damping = settings.damping
    for _ in range(iterations):
        better, damping = _improved(fit, damping, move_shapes)
        if better is None:
            break
        drop = fit.objective - better.objective
        fit, damping = better, max(damping / settings.damping_down, settings.damping_least)
        if drop < tolerance * fit.objective:
            break
    return fit


def _improved(fit: Fit, damping: float, move_shapes: bool) -> tuple[Fit | None, float]:
    """A better fit one damped step away, None where none was found, and the damping that it took."""
    problem, settings = fit.problem, fit.problem.settings.fit
    wb = problem.base_width
    normal, gradient = fit.normal_equations(move_shapes)
    precision = problem.noise.sigma**2 * problem.prior_precision(len(normal))
    gradient[:wb] -= precision[:wb] * fit.errors
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
        trial = moved(fit, step, move_shapes)
        if trial.objective < fit.objective:
            return trial, damping
        damping = max(damping * settings.damping_up, settings.damping_least_up)
    return None, damping
