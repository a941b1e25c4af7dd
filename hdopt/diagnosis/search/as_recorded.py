"""What a fit to averaged rows leaves of the rows as recorded, the noise there, and what its shapes may leave."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.inference import noise as noise_model
from hdopt.diagnosis.inference.catalogue import is_outside, properties_of
from hdopt.diagnosis.inference.fit import Fit, FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.inference.nuisance import Nuisances
from hdopt.diagnosis.inference.read_angle import where_it_stood
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.effects.probe import strongest_orders
from hdopt.effects.sines import sine_columns
from hdopt.effects.term import Term
from hdopt.recordings.read import Recording
from hdopt.recordings.rows import Rows, gather


def noise_beside_lines(bare: Fit, orders: tuple[float, float]) -> Noise:
    """The noise of rows as recorded, of which `bare` holds an offset alone. A strong ripple must not be taken for
    noise: its strongest lines between these `orders` are taken out before the noise is measured, and where there are
    many lines, as of a mesh whose teeth differ in height, it is measured between them.
    """
    raw, settings = bare.problem.rows, bare.problem.settings
    lowest, highest = orders
    lines = strongest_orders(FitProbe(bare), settings.high_order.noise_lines, lowest=lowest, highest=highest)
    left = bare.residual - waves_of(raw, bare.residual, lines) if lines else bare.residual
    noise = noise_model.estimate(raw, left, settings.noise)
    between = noise_model.beneath_lines(raw, left, settings.noise)
    return between if between.sigma < settings.high_order.between_lines * noise.sigma else noise


def power_left(as_recorded: Fit, which: Sequence[int], lowest: float) -> float:
    """The power (arcmin^2) of those terms of a model `as_recorded` (`which`) that a shape not quite right may leave at
    orders from the `lowest` on. What happens suddenly, a pulse or a loop, may be sharper than the shape that is fitted:
    all of its power counts. Of the others it is what they have there themselves.
    """
    rows, terms = as_recorded.problem.rows, as_recorded.terms
    nothing = np.zeros(len(rows))
    sudden = sum((as_recorded.contribution(i) for i in which if is_sudden(terms[i])), nothing)
    smooth = sum((as_recorded.contribution(i) for i in which if not is_sudden(terms[i])), nothing)
    power = 2 * np.abs(np.fft.rfft(smooth)) ** 2 / len(rows) ** 2
    return float(np.var(sudden) + power[math.ceil(lowest / rows.rows_per_turn * len(rows)) :].sum())


def is_sudden(term: Term) -> bool:
    """Whether what `term` stands for may be sharper than the shape that is fitted to it; what has no physics may."""
    return is_outside(term.effect) or properties_of(term.effect).sudden


def on_rows_as_recorded(recordings: Sequence[Recording], fit: Fit, nuisances: Nuisances) -> Fit:
    """The model of `fit`, made on averaged rows, on the rows of `recordings` as they are. `nuisances` are the columns
    that are always free.
    """
    raw, old = gather(recordings), fit.problem
    problem = replace(old, rows=raw, nuisance=nuisances.columns(raw), noise=Noise.white(raw, 1.0))
    base_value = np.zeros(len(raw)) if old.base is None else old.base.evaluate_at(problem.rotation, fit.errors)[0]
    terms = [problem.explanations[t.effect].term(raw, t.shape, base_value) for t in fit.terms]
    return evaluate(problem, fit.errors, fit.offsets, terms, fit.coefficients)


def left_of(as_recorded: Fit) -> FitProblem:
    """What a model `as_recorded` leaves of its rows, at the input angles at which by it the drive stood: a problem with
    an offset alone beside it.
    """
    left = replace(where_it_stood(as_recorded.problem.rows, as_recorded.ahead), error=as_recorded.residual)
    noise = Noise.white(left, float(np.std(left.error)))
    return FitProblem(left, None, np.ones((len(left), 1)), noise, settings=as_recorded.problem.settings)


def left_as_recorded(recordings: Sequence[Recording], fit: Fit, nuisances: Nuisances) -> FitProblem:
    """What `fit`, made on averaged rows, leaves of the rows of `recordings` as they are: `left_of` it there.
    `nuisances` are the columns that are always free.
    """
    return left_of(on_rows_as_recorded(recordings, fit, nuisances))


def waves_of(rows: Rows, values: Array, orders: Sequence[float]) -> Array:
    """The sines of `orders` (cycles an input turn of `rows`) in `values` (n,), together, (n,)."""
    columns = sine_columns(rows.theta, orders)
    return columns @ np.linalg.lstsq(columns, values, rcond=None)[0]
