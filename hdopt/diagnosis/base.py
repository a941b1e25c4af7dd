"""Base fit: the kinematic-error model's twelve errors, estimated from recordings.

What Jia 2021 did by hand for its Table 5. The waveform is the larger of two zones, so it is not smooth and has
several minima: the fit starts from many random drives on thinned rows, keeps those that come out best, and refines
them on all rows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hdopt.deviations import ERROR_NAMES, DriveErrors
from hdopt.diagnosis.effect import Parameter, Term, sine_columns
from hdopt.diagnosis.fit import PRIOR_MM, Fit, Problem, evaluate, refine
from hdopt.diagnosis.samples import Samples
from hdopt.kinematics.cartesian import CARTESIAN_NAMES, PARAMETERS, to_drive_errors

Array = NDArray[np.float64]

STARTS = 16
ROWS_FOR_STARTS = 2500


def fit_base(
    problem: Problem,
    rng: np.random.Generator,
    starts: int = STARTS,
    terms: tuple[Term, ...] = (),
    near: Fit | None = None,
) -> Fit:
    """The best fit of the base (with `terms` beside it) from `starts` random drives, and from `near` where given."""
    zeros = [np.zeros(term.width) for term in terms]
    offsets = np.zeros(problem.nuisance.shape[1])
    if problem.base is None:
        return refine(evaluate(problem, np.zeros(0), offsets, terms, zeros))
    stride = max(1, len(problem.samples) // ROWS_FOR_STARTS)
    mask = np.zeros(len(problem.samples), bool)
    mask[::stride] = True
    thin = problem.rows(mask)
    thin_terms = [_thin(term, mask) for term in terms]
    candidates = []
    for index in range(starts):
        errors = rng.normal(size=PARAMETERS) * PRIOR_MM * problem.prior_scale * rng.uniform(0.15, 0.7)
        start = evaluate(thin, errors, offsets, thin_terms, zeros)
        start = _solve_offsets(start)
        candidates.append(refine(start, iterations=14, tolerance=1e-3, move_shapes=False))
        candidates.sort(key=lambda fit: fit.objective)
        # Enough starts have met in the same best minimum.
        if index >= 7 and sum(c.objective < 1.005 * candidates[0].objective for c in candidates) >= 4:
            break
    finals = []
    for candidate in candidates[:2]:
        full = evaluate(problem, candidate.errors, candidate.offsets, terms, candidate.coefficients)
        finals.append(refine(full, iterations=10, move_shapes=False))
    if near is not None:
        again = evaluate(problem, near.errors, near.offsets, terms, near.coefficients if near.terms else zeros)
        finals.append(refine(again, iterations=10, move_shapes=False))
    return min(finals, key=lambda fit: fit.objective)


def _thin(term: Term, mask: NDArray) -> Term:
    return replace(
        term,
        columns=None if term.columns is None else term.columns[mask],
        zones=None if term.zones is None else term.zones[:, mask],
    )


def _solve_offsets(fit: Fit) -> Fit:
    nuisance = fit.problem.nuisance
    offsets = fit.offsets + np.linalg.lstsq(nuisance, fit.residual, rcond=None)[0]
    return evaluate(fit.problem, fit.errors, offsets, fit.terms, fit.coefficients)


@dataclass(frozen=True)
class BaseEstimate:
    """The base's errors as a drive's: parameters with intervals, and combinations that the recording leaves open."""

    errors: DriveErrors
    parameters: dict[str, Parameter]
    open_combinations: tuple[str, ...]
    rms_arcmin: float


def base_estimate(fit: Fit) -> BaseEstimate:
    """What the fit says of the drive's errors, with 95 % intervals and what it leaves open."""
    base = fit.problem.base
    rms = float(np.std(fit.base_value)) if base is not None else 0.0
    if base is None:
        return BaseEstimate(DriveErrors(), {}, (), rms)
    half_width = base.half_width
    covariance = fit.covariance()[:PARAMETERS, :PARAMETERS]
    errors = to_drive_errors(fit.errors, half_width)
    values = errors.to_matrix()[0]
    jacobian = np.empty((PARAMETERS, PARAMETERS))
    for i in range(PARAMETERS):
        step = 1e-6
        up, down = fit.errors.copy(), fit.errors.copy()
        up[i] += step
        down[i] -= step
        change = to_drive_errors(up, half_width).to_matrix()[0] - to_drive_errors(down, half_width).to_matrix()[0]
        change = np.where(np.abs(change) > np.pi, change - np.sign(change) * 2 * np.pi, change)
        jacobian[:, i] = change / (2 * step)
    spread = 1.96 * np.sqrt(np.maximum(np.diag(jacobian @ covariance @ jacobian.T), 0))
    parameters = {}
    for name, value, half in zip(ERROR_NAMES, values, spread, strict=True):
        length = name in ("axis_eccentricity", "wg_eccentricity", "cs_tooth_amplitude", "fs_tooth_amplitude")
        factor, unit, suffix = (1.0, "mm", "mm") if length else (math.degrees(1), "deg", "deg")
        low = value - half
        if length:
            low = max(low, 0.0)
        parameters[f"{name}_{suffix}"] = Parameter(factor * value, factor * low, factor * (value + half), unit)
    return BaseEstimate(errors, parameters, open_combinations(covariance, fit.problem.prior_scale), rms)


def open_combinations(covariance: Array, prior_scale: float) -> tuple[str, ...]:
    """Combinations of errors that the data leave uncertain by more than a tenth of the prior, largest members named."""
    prior = PRIOR_MM * prior_scale
    values, vectors = np.linalg.eigh(covariance / np.outer(prior, prior))
    found = []
    for value, vector in zip(values, vectors.T, strict=True):
        if value > 0.01:
            members = np.argsort(-np.abs(vector))
            members = [i for i in members if abs(vector[i]) > 0.3 * abs(vector[members[0]])][:4]
            found.append(" with ".join(CARTESIAN_NAMES[i] for i in members))
    return tuple(found)


def beat_warning(samples: Samples) -> str | None:
    """What a record shorter than an output turn cannot carry: whole orders k and those of the flexspline, k (1 + 1/N).

    Both together beat once an output turn. The standard error of either grows, against a whole output turn at the same
    sampling, by the root of N/turns and of what order 2 keeps of its power once 2 (1 + 1/N) is taken out. None where
    that is less than 3.
    """
    order, other = 2.0, 2.0 * (1 + 1 / samples.ratio)
    beside = np.column_stack([sine_columns(samples.theta, [other]), np.ones(len(samples))])
    own = sine_columns(samples.theta, [order])
    left = own - beside @ np.linalg.lstsq(beside, own, rcond=None)[0]
    kept = max(float(np.min(np.linalg.eigvalsh(left.T @ left))) / len(samples) / 0.5, 1e-12)
    part = samples.span_turns / samples.ratio
    growth = math.sqrt(1 / kept / min(part, 1.0))
    if growth < 3:
        return None
    return (
        f"{samples.span_turns:.2g} input turns are {part:.2g} of an output turn: orders k and k (1 + 1/N) are told "
        f"apart {growth:.2g} times worse than by a whole one; what stands there may be the circular spline's or the "
        "flexspline's"
    )
