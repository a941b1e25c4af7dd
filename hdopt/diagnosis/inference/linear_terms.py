"""A fit of which nothing but the base bends: all its terms are linear, and are prepared once for many steps.

Columns that no parameter moves are whitened once; waves round the splines are worked out in the base's compiled pass.
The numbers are those of `Fit` but for rounding. A start of a base fit takes some thirty looks, and a diagnosis a
thousand starts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.diagnosis.inference.base_excitation import is_driven
from hdopt.diagnosis.inference.fit import Fit, FitProblem, evaluate
from hdopt.diagnosis.inference.read_angle import reads_input
from hdopt.effects.met import Spline, Waves
from hdopt.effects.sines import multiples
from hdopt.effects.term import Term
from hdopt.kinematics.cartesian import MOST_WAVES, ONCE_ROUND, PARAMETERS, CartesianModel


class Kind(IntEnum):
    """What the columns of a linear term follow, in the order of the parameters."""

    ROWS = 0
    SPLINE = 1
    ZONE = 2


def _kind(term: Term, move_shapes: bool) -> Kind | None:
    """What the columns of `term` follow; None where it is not linear: a shape of its own moves, the drive's motion
    makes its columns, or it moves the angles at which the drive stood, and for all that stands on a spline but waves.
    """
    if (move_shapes and term.steps) or is_driven(term) or reads_input(term):
        return None
    if term.met is not None:
        return Kind.SPLINE if isinstance(term.met, Waves) and max(term.met.harmonics) <= MOST_WAVES else None
    return Kind.ROWS if term.columns is not None else Kind.ZONE


@dataclass(frozen=True)
class _Prepared:
    """What the points of a descent share: the fit that it `begun` at, its `base`, the parameters (q,) of each of its
    terms (`places`), the whitened record `target` (n,), and the whitened columns of all parameters as the rows of
    `design` (q, n): those in `steady` stay, the others are those of the point that was asked last."""

    begun: Fit
    base: CartesianModel
    places: tuple[slice, ...]
    target: Array
    design: Array
    steady: slice

    @classmethod
    def of(cls, fit: Fit, base: CartesianModel, kinds: Sequence[Kind]) -> _Prepared:
        """What a descent from `fit` on needs, with its `base`, whose terms are of these `kinds`."""
        problem = fit.problem
        end = PARAMETERS + problem.nuisance.shape[1]
        places, fixed = [slice(0)] * len(kinds), [problem.nuisance]
        for i in sorted(range(len(kinds)), key=kinds.__getitem__):
            term = fit.terms[i]
            places[i] = slice(end, end + term.width)
            end += term.width
            if kinds[i] is Kind.ROWS and term.columns is not None:
                fixed.append(term.columns)
        white = problem.noise.whitened(fixed).T
        design, steady = np.empty((end, white.shape[1])), slice(PARAMETERS, PARAMETERS + len(white))
        design[steady] = white
        target = problem.noise.whiten(problem.rows.error)
        return cls(fit, base, tuple(places), target, design, steady)

    @cached_property
    def waves(self) -> list[tuple[slice, Spline, Index]]:
        """Of each term round a spline its parameters, the spline, and its waves less one."""
        met = zip(self.places, (term.met for term in self.begun.terms), strict=True)
        return [(at, one.spline, np.array(one.harmonics) - 1) for at, one in met if isinstance(one, Waves)]

    @cached_property
    def most_waves(self) -> tuple[int, ...]:
        """The most waves that stand on either spline."""
        return tuple(max((int(w.max()) + 1 for _, at, w in self.waves if at is spline), default=0) for spline in Spline)

    @cached_property
    def zones(self) -> list[tuple[slice, Array]]:
        """Of each term in the zones its parameters and what either zone sees of them, mm, (2, n, p)."""
        seen = zip(self.places, (term.zones for term in self.begun.terms), strict=True)
        return [(at, zones) for at, zones in seen if zones is not None]

    def at(self, parameters: Array) -> LinearTermsFit:
        """The fit at these `parameters` (q,)."""
        problem, noise, errors = self.begun.problem, self.begun.problem.noise, parameters[:PARAMETERS]
        on_cs, on_fs = (np.zeros((2, most)) for most in self.most_waves)
        for place, spline, wave in self.waves:
            (on_cs, on_fs)[spline][:, wave] += parameters[place].reshape(-1, 2).T
        extra = None
        for place, zones in self.zones:
            added = zones @ parameters[place]
            extra = added if extra is None else extra + added
        value, zone, slopes = self.base.evaluate_at(problem.rotation, errors, extra, waves=(on_cs, on_fs))
        residual = self.target - parameters[self.steady] @ self.design[self.steady] - noise.whiten(value)
        objective = float(residual @ residual) + noise.sigma**2 * float(np.sum((errors / problem.prior) ** 2))
        return LinearTermsFit(self, parameters, slopes.T, zone, residual, objective)


@dataclass(frozen=True)
class LinearTermsFit:
    """Such a fit at its `parameters` (q,): first the base's errors, mm, and offsets. `slopes` (12, n) arcmin/mm and the
    driving `zone` (n,) of the base there, the whitened `residual` (n,) and the `objective` as in `Fit`."""

    prepared: _Prepared
    parameters: Array
    slopes: Array
    zone: Index
    residual: Array
    objective: float

    @classmethod
    def of(cls, fit: Fit, move_shapes: bool) -> LinearTermsFit | None:
        """`fit` so, None where it has no base or terms that are not linear; `move_shapes`: whether shapes move too."""
        kinds = [kind for term in fit.terms if (kind := _kind(term, move_shapes)) is not None]
        if fit.problem.base is None or len(kinds) < len(fit.terms):
            return None
        prepared = _Prepared.of(fit, fit.problem.base, kinds)
        parameters = np.zeros(len(prepared.design))
        parameters[:PARAMETERS] = fit.errors
        parameters[PARAMETERS : PARAMETERS + len(fit.offsets)] = fit.offsets
        for place, coefficients in zip(prepared.places, fit.coefficients, strict=True):
            parameters[place] = coefficients
        return prepared.at(parameters)

    @property
    def problem(self) -> FitProblem:
        return self.prepared.begun.problem

    @property
    def errors(self) -> Array:
        return self.parameters[:PARAMETERS]

    @property
    def fit(self) -> Fit:
        """The same as any other fit."""
        begun, parameters = self.prepared.begun, self.parameters
        offsets = parameters[PARAMETERS : PARAMETERS + len(begun.offsets)]
        coefficients = [parameters[place] for place in self.prepared.places]
        return evaluate(self.problem, self.errors, offsets, begun.terms, coefficients)

    def normal_equations(self) -> tuple[Array, Array]:
        """Inner products of the whitened columns of all parameters with each other, (q, q), and with the whitened
        residual, (q,)."""
        prepared, design, noise = self.prepared, self.prepared.design, self.problem.noise
        scale = prepared.base.arcmin_per_mm
        noise.whiten_rows(self.slopes, design[:PARAMETERS])
        for place, spline, wave in prepared.waves:
            sine, cosine = self.slopes[ONCE_ROUND[spline] : ONCE_ROUND[spline] + 2] / scale
            noise.whiten_rows(scale * multiples(sine, cosine, wave + 1).T, design[place])
        for place, (first, second) in prepared.zones:
            columns = scale * np.where((self.zone == 0)[:, None], first, second)
            noise.whiten_rows(columns.T, design[place])
        return design @ design.T, design @ self.residual

    def moved(self, step: Array) -> LinearTermsFit:
        """The fit a `step` (q,) away, the base's errors kept in their box."""
        parameters = self.parameters + step
        box = self.problem.box
        parameters[:PARAMETERS] = np.clip(parameters[:PARAMETERS], -box, box)
        return self.prepared.at(parameters)
