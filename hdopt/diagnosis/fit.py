"""Joint fit: the base model's errors, offsets, and the terms of any effects, all at once.

Levenberg-Marquardt on whitened rows. The base enters through its Cartesian errors with a wide prior (it keeps
combinations that the recording cannot tell apart from running off); effects that act inside the meshing zones take
part in the choice of the driving zone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hdopt.diagnosis.catalogue import EXPLANATIONS
from hdopt.diagnosis.effect import Estimate, Term
from hdopt.diagnosis.noise import Noise
from hdopt.diagnosis.samples import Samples
from hdopt.diagnosis.transmission import driven_by, excites, motion_of, transmitted
from hdopt.kinematics.cartesian import PARAMETERS, CartesianModel

Array = NDArray[np.float64]

PRIOR_MM = np.array([0.03, 0.03, 0.05, 0.05, 0.02, 0.02, 0.03, 0.03, 0.006, 0.006, 0.006, 0.006])
"""Prior standard deviation of the base's Cartesian errors, mm: about three times the shipped tolerances."""
BOX_MM = np.array([0.045, 0.045, 0.047, 0.047, 0.0225, 0.0225, 0.024, 0.024, 0.009, 0.009, 0.009, 0.009])
"""Bounds of the Cartesian errors, mm: three times the shipped tolerances, as far as the closed form holds. Beyond
them its second-order terms would imitate physics that is not there.
"""


LAGS_TURNS = 10
"""Input turns over which neighbouring turns' residuals are taken to hang together in the parameters' intervals."""


@dataclass(frozen=True)
class Problem:
    """What is fitted: rows, base model (None for a gear without one), columns that are always free (offsets), noise."""

    samples: Samples
    base: CartesianModel | None
    nuisance: Array
    noise: Noise
    prior_scale: float = 1.0

    @cached_property
    def whitened(self) -> dict:
        """Whitened columns and their inner products of the terms that the rows remember, by identity."""
        return {}

    @cached_property
    def rotation(self) -> Array:
        """The rows' angles as the base takes them."""
        return self.base.rotation(self.samples.theta)

    @property
    def base_width(self) -> int:
        return PARAMETERS if self.base is not None else 0

    @property
    def box(self) -> Array:
        """Bounds of the base's Cartesian errors, mm."""
        return BOX_MM * self.prior_scale

    def with_noise(self, noise: Noise) -> Problem:
        return replace(self, noise=noise)

    def rows(self, mask: NDArray) -> Problem:
        """The same problem on some rows, with white noise."""
        samples = self.samples.rows(mask)
        return replace(
            self, samples=samples, nuisance=self.nuisance[mask], noise=Noise.white(samples, self.noise.sigma)
        )


@dataclass(frozen=True)
class Fit:
    """A fitted model: base errors (mm), offsets, terms with coefficients; prediction and residual in arcmin;
    `objective` the whitened sum of squares plus the prior's, `design` the columns of the linearised model."""

    problem: Problem
    errors: Array
    offsets: Array
    terms: tuple[Term, ...]
    coefficients: tuple[Array, ...]
    base_value: Array
    zone: NDArray[np.int64]
    prediction: Array
    objective: float
    base_jacobian: Array

    @property
    def residual(self) -> Array:
        return self.problem.samples.error - self.prediction

    @cached_property
    def motion(self) -> Array:
        """The drive's motion before its spring, arcmin, (n,): what excites a resonance."""
        return motion_of(self.base_value, self.terms, self.coefficients)

    def all_but(self, index: int) -> list[int]:
        """The numbers of the terms without `index`: what to keep beside it."""
        return [i for i in range(len(self.terms)) if i != index]

    def contribution(self, index: int) -> Array:
        """What term `index` adds to the prediction, arcmin: with its zones' driving switched as fitted."""
        return term_columns(self.terms[index], self.zone, self.problem.base) @ self.coefficients[index]

    @property
    def contributions(self) -> Array:
        """What all terms add, arcmin."""
        return sum((self.contribution(i) for i in range(len(self.terms))), np.zeros(len(self.problem.samples)))

    def seen(self, columns: Array, keep: Sequence[int] | None = None) -> Array:
        """Columns of the drive's motion (n, k) as its output shows them beside the terms of `keep`, all by default."""
        kept = range(len(self.terms)) if keep is None else keep
        terms, coefficients = [self.terms[i] for i in kept], [self.coefficients[i] for i in kept]
        return transmitted(columns, self.problem.samples, terms, coefficients)

    def columns_of(self, term: Term, keep: Sequence[int] | None = None) -> Array:
        """A term's columns as the output shows them beside the terms of `keep`, all by default, (n, p)."""
        columns = term_columns(term, self.zone, self.problem.base)
        return self.seen(columns, keep) if excites(term) else columns

    def design(self, keep: Sequence[int] | None = None, move_shapes: bool = True) -> Array:
        """Columns: base errors, offsets, then for each term of `keep` (all by default) its coefficients and, with
        `move_shapes`, its free shape parameters; (n, q).
        """
        blocks = [self.seen(self.base_jacobian, keep), self.problem.nuisance]
        for i in range(len(self.terms)) if keep is None else keep:
            term = self.terms[i]
            blocks.append(self.columns_of(term, keep))
            if move_shapes and term.steps:
                columns = shape_columns(self, i)
                blocks.append(self.seen(columns, keep) if excites(term) else columns)
        return np.column_stack(blocks)

    def prior_precision(self, width: int) -> Array:
        precision = np.zeros(width)
        if self.problem.base is not None:
            precision[:PARAMETERS] = 1 / (PRIOR_MM * self.problem.prior_scale) ** 2
        return precision

    def covariance(self) -> Array:
        """Covariance of all parameters, robust against what the noise model misses: the larger, parameter by parameter,
        of the model-based one and the sandwich over whole turns."""
        design = self.problem.noise.whiten(self.design())
        residual = self.problem.noise.whiten(self.residual)
        sigma2 = max(float(residual @ residual) / max(len(residual) - design.shape[1], 1), 1e-18)
        normal = design.T @ design / sigma2 + np.diag(self.prior_precision(design.shape[1]))
        inverse = np.linalg.pinv(normal, hermitian=True)
        block = self.problem.samples.block
        scores = np.zeros((block[-1] + 1, design.shape[1]))
        np.add.at(scores, block, design * residual[:, None] / sigma2)
        # Wander outlasts a turn: neighbouring turns' scores count too, with falling weight (Newey, West 1987).
        meat = scores.T @ scores
        lags = min(LAGS_TURNS, len(scores) // 5)
        for lag in range(1, lags + 1):
            across = scores[lag:].T @ scores[:-lag]
            meat += (1 - lag / (lags + 1)) * (across + across.T)
        sandwich = inverse @ meat @ inverse
        blocks = block[-1] + 1
        sandwich *= blocks / max(blocks - 1, 1)
        ratio = np.sqrt(np.maximum(np.diag(sandwich) / np.maximum(np.diag(inverse), 1e-300), 1.0))
        return inverse * np.outer(ratio, ratio)

    def estimates(self) -> list[Estimate]:
        """Values and covariance of each term's coefficients and free shape parameters."""
        covariance = self.covariance()
        start = self.problem.base_width + self.problem.nuisance.shape[1]
        found = []
        for term, coefficients in zip(self.terms, self.coefficients, strict=True):
            end = start + term.freedom
            values = np.r_[coefficients, [term.shape[name] for name in term.steps]]
            found.append(Estimate(values, covariance[start:end, start:end]))
            start = end
        return found


def term_columns(term: Term, zone: NDArray[np.int64], base: CartesianModel | None) -> Array:
    """The term's columns in arcmin per coefficient, with the zones as they drive now."""
    if term.zones is None:
        return term.columns
    return base.arcmin_per_mm * np.where((zone == 0)[:, None], term.zones[0], term.zones[1])


def shape_columns(fit: Fit, index: int) -> Array:
    """Derivative of term `index`'s contribution by its free shape parameters, (n, k), by central differences."""
    term, problem = fit.terms[index], fit.problem
    columns = []
    for name, step in term.steps.items():
        sides = []
        for sign in (1, -1):
            shifted = {**term.shape, name: term.shape[name] + sign * step}
            moved = EXPLANATIONS[term.effect].term(problem.samples, shifted, fit.motion)
            sides.append(term_columns(moved, fit.zone, problem.base) @ fit.coefficients[index])
        columns.append((sides[0] - sides[1]) / (2 * step))
    return np.column_stack(columns) if columns else np.empty((len(problem.samples), 0))


def evaluate(
    problem: Problem, errors: Array, offsets: Array, terms: Sequence[Term], coefficients: Sequence[Array]
) -> Fit:
    """The model at given parameters."""
    samples = problem.samples
    extra = None
    for term, c in zip(terms, coefficients, strict=True):
        if term.zones is not None:
            extra = term.zones @ c if extra is None else extra + term.zones @ c
    if problem.base is not None:
        base_value, zone, jacobian = problem.base.evaluate_at(problem.rotation, errors, extra)
    else:
        base_value, zone, jacobian = (
            np.zeros(len(samples)),
            np.zeros(len(samples), np.int64),
            np.empty((len(samples), 0)),
        )
    terms = driven_by(motion_of(base_value, terms, coefficients), samples, terms)
    prediction = base_value + problem.nuisance @ offsets
    for term, c in zip(terms, coefficients, strict=True):
        if term.zones is None:
            prediction = prediction + term.columns @ c
    white = problem.noise.whiten(samples.error - prediction)
    objective = float(white @ white)
    if problem.base is not None:
        objective += problem.noise.sigma**2 * float(np.sum((errors / (PRIOR_MM * problem.prior_scale)) ** 2))
    return Fit(
        problem, errors, offsets, tuple(terms), tuple(coefficients), base_value, zone, prediction, objective, jacobian
    )


def refine(fit: Fit, iterations: int = 12, tolerance: float = 1e-5, move_shapes: bool = True) -> Fit:
    """Levenberg-Marquardt from `fit` on."""
    problem, damping = fit.problem, 1e-4
    wb, wn = problem.base_width, problem.nuisance.shape[1]
    for _ in range(iterations):
        design = fit.design(move_shapes=move_shapes)
        white = problem.noise.whiten(design)
        residual = problem.noise.whiten(fit.residual)
        precision = problem.noise.sigma**2 * fit.prior_precision(design.shape[1])
        normal = white.T @ white
        gradient = white.T @ residual
        gradient[:wb] -= precision[:wb] * fit.errors
        normal[np.diag_indices_from(normal)] += precision
        scale = np.sqrt(np.maximum(np.diag(normal), 1e-12))
        improved = False
        for _ in range(6):
            damped = normal / np.outer(scale, scale)
            damped[np.diag_indices_from(damped)] += damping
            try:
                step = np.linalg.solve(damped, gradient / scale) / scale
            except np.linalg.LinAlgError:
                damping *= 10
                continue
            position = wb + wn
            terms, coefficients = [], []
            for term, c in zip(fit.terms, fit.coefficients, strict=True):
                delta = step[position : position + term.width]
                position += term.width
                shape = dict(term.shape)
                if move_shapes and term.steps:
                    for name in term.steps:
                        limit = 0.3 * abs(shape[name]) + 20 * term.steps[name]
                        shape[name] += float(np.clip(step[position], -limit, limit))
                        position += 1
                    moved = EXPLANATIONS[term.effect].term(problem.samples, shape, fit.motion)
                    term = replace(moved, trials=term.trials, odds=term.odds)
                terms.append(term)
                coefficients.append(c + delta)
            errors = np.clip(fit.errors + step[:wb], -problem.box[:wb], problem.box[:wb])
            trial = evaluate(problem, errors, fit.offsets + step[wb : wb + wn], terms, coefficients)
            if trial.objective < fit.objective:
                improved = True
                break
            damping = max(damping * 8, 1e-6)
        if not improved:
            break
        drop = fit.objective - trial.objective
        fit, damping = trial, max(damping / 6, 1e-9)
        if drop < tolerance * fit.objective:
            break
    return fit


def extend(fit: Fit, terms: Sequence[Term]) -> Fit:
    """`fit` with further terms, at coefficients of zero."""
    return evaluate(
        fit.problem,
        fit.errors,
        fit.offsets,
        [*fit.terms, *terms],
        [*fit.coefficients, *(np.zeros(term.width) for term in terms)],
    )
