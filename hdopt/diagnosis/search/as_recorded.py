"""What a fit to averaged rows leaves of the rows as recorded, the noise there, and what its shapes may leave."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.inference import noise as noise_model
from hdopt.diagnosis.inference.base_excitation import is_driven
from hdopt.diagnosis.inference.catalogue import is_outside, properties_of
from hdopt.diagnosis.inference.fit import Fit, FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.inference.nuisance import Nuisances
from hdopt.diagnosis.inference.read_angle import where_it_stood
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.inference.row_means import before_means
from hdopt.effects.base import Effect
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
    """The power (arcmin^2) of those terms of a model `as_recorded` (`which`) of which a share may be left at orders
    from the `lowest` on where their shape is not quite right: what they have there themselves. What happens suddenly,
    a pulse or a loop, may be sharper than the shape that is fitted, as sharp as steps; what has no physics may be
    anything.
    """
    rows, terms = as_recorded.problem.rows, as_recorded.terms
    outside = [i for i in which if is_outside(terms[i].effect)]
    sudden = [i for i in which if properties_of(terms[i].effect).sudden]
    others = [i for i in which if i not in (*outside, *sudden)]

    def total(some: Sequence[int]) -> Array:
        return np.asarray(sum((as_recorded.contribution(i) for i in some), np.zeros(len(rows))))

    cut = lowest / rows.rows_per_turn
    return float(np.var(total(outside))) + power_beyond(total(others), cut) + power_of_steps(total(sudden), cut)


def power_beyond(values: Array, cut: float) -> float:
    """The power of `values` (n,) at more than `cut` cycles a row."""
    power = 2 * np.abs(np.fft.rfft(values)) ** 2 / len(values) ** 2
    return float(power[math.ceil(cut * len(values)) :].sum())


def power_of_steps(values: Array, cut: float) -> float:
    """The power that `values` (n,) would have at more than `cut` cycles a row, did they change in one step wherever
    they change within 1/`cut` rows: of a step of 1 arcmin the integral of 1/(2 pi f)^2 over these f, on both sides, is
    1/(2 pi^2 cut)."""
    cells = np.arange(0, len(values), math.ceil(1 / cut))
    first = np.r_[values[cells[1:]], values[-1]]
    highest = np.maximum(np.maximum.reduceat(values, cells), first)
    lowest = np.minimum(np.minimum.reduceat(values, cells), first)
    return float(np.sum((highest - lowest) ** 2)) / (2 * math.pi**2 * cut * len(values))


def on_rows_as_recorded(recordings: Sequence[Recording], fit: Fit, nuisances: Nuisances) -> Fit:
    """The model of `fit`, made on averaged rows, on the rows of `recordings` as they are, where its waves are as large
    as they were before means dimmed them. `nuisances` are the columns that are always free.
    """
    raw, old = gather(recordings), fit.problem
    problem = replace(old, rows=raw, nuisance=nuisances.columns(raw), noise=Noise.white(raw, 1.0))
    base_value = np.zeros(len(raw)) if old.base is None else old.base.evaluate_at(problem.rotation, fit.errors)[0]
    terms = [problem.explanations[t.effect].term(raw, t.shape, base_value) for t in fit.terms]
    sizes = [
        before_means(own, old.rows, _orders_of_columns(term, problem))
        for term, own in zip(fit.terms, fit.coefficients, strict=True)
    ]
    return evaluate(problem, fit.errors, fit.offsets, terms, sizes)


def _orders_of_columns(term: Term, problem: FitProblem) -> list[float]:
    """Orders (cycles an input turn) of the sines that the columns of `term` begin with in `problem`; none where it has
    none."""
    effect = problem.explanations[term.effect]
    return effect.orders_of_columns(term, problem.rows.ratio) if isinstance(effect, Effect) else []


def left_of(as_recorded: Fit) -> FitProblem:
    """What a model `as_recorded` leaves of its rows, at the input angles at which by it the drive stood: a problem with
    an offset alone beside it. What is found in it moves the foot of whatever swings behind the drive, as its own error
    does.
    """
    left = replace(where_it_stood(as_recorded.problem.rows, as_recorded.ahead), error=as_recorded.residual)
    noise = Noise.white(left, float(np.std(left.error)))
    weighed = zip(as_recorded.terms, as_recorded.coefficients, strict=True)
    behind = tuple((term, own) for term, own in weighed if is_driven(term))
    settings = as_recorded.problem.settings
    return FitProblem(left, None, np.ones((len(left), 1)), noise, settings=settings, behind=behind)


def left_as_recorded(recordings: Sequence[Recording], fit: Fit, nuisances: Nuisances) -> FitProblem:
    """What `fit`, made on averaged rows, leaves of the rows of `recordings` as they are: `left_of` it there.
    `nuisances` are the columns that are always free.
    """
    return left_of(on_rows_as_recorded(recordings, fit, nuisances))


def waves_of(rows: Rows, values: Array, orders: Sequence[float]) -> Array:
    """The sines of `orders` (cycles an input turn of `rows`) in `values` (n,), together, (n,)."""
    columns = sine_columns(rows.theta, orders)
    return columns @ np.linalg.lstsq(columns, values, rcond=None)[0]
