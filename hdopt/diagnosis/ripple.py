"""Orders above what the averaged rows hold: looked for on the rows as recorded, and taken out of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hdopt.diagnosis import noise as noise_model
from hdopt.diagnosis.catalogue import EXPLANATIONS
from hdopt.diagnosis.effect import Term, sine_columns, strongest_orders
from hdopt.diagnosis.effects import HIGH_ORDER
from hdopt.diagnosis.fit import Fit, Problem, evaluate, refine
from hdopt.diagnosis.noise import Noise
from hdopt.diagnosis.nuisance import Nuisances
from hdopt.diagnosis.outside import AnyOrder
from hdopt.diagnosis.price import Beside, leaves_nothing
from hdopt.diagnosis.probe import FitProbe
from hdopt.diagnosis.samples import Samples, gather
from hdopt.diagnosis.select import Selection, select
from hdopt.diagnosis.zone_ripple import fit_in_zones
from hdopt.recording import Recording

Array = NDArray[np.float64]

RIPPLE_LINES, STRONG_RIPPLE = 12, 0.25
"""Lines beyond the averaged rows that are looked at, and their power, over that of all else there, from which they are
set aside before the search in the averaged rows.
"""


def find_ripple(
    recordings: Sequence[Recording],
    found: Selection,
    nuisances: Nuisances,
    ruled_out: Sequence[str],
    rng: np.random.Generator,
) -> tuple[Selection | None, Array | None]:
    """The search of orders above the averaged rows beside what was `found` in them, and what its best candidate adds to
    the rows as recorded, (n,).
    """
    high = high_order_selection(recordings, found, nuisances, ruled_out, rng)
    if high is None or not high.best.fit.terms:
        return high, None
    inside = fit_in_zones(gather(recordings), found.best.fit, nuisances, high.best.fit)
    if inside is None:
        return high, high.best.fit.contributions
    return high.with_best_fit(inside.fit), inside.adds


def high_order_selection(
    recordings: Sequence[Recording],
    found: Selection,
    nuisances: Nuisances,
    ruled_out: Sequence[str],
    rng: np.random.Generator,
) -> Selection | None:
    """Effects of orders above what the averaged rows hold, on the rows as recorded without what was `found` there."""
    low = found.best.fit
    averaged = low.problem.samples
    if averaged.locked or not averaged.are_averages:
        return None
    problem = left_as_recorded(recordings, low, nuisances)
    raw = problem.samples
    lowest, highest = orders = ripple_orders(averaged, raw)
    bare = refine(evaluate(problem, np.zeros(0), np.zeros(1), (), ()), iterations=2)
    noise = noise_model.estimate(raw, bare.residual)
    # A strong ripple must not be taken for noise: its strongest lines are taken out before the noise is measured.
    lines = strongest_orders(FitProbe(bare), 6, lowest=lowest, highest=highest)
    if lines:
        noise = noise_model.estimate(raw, bare.residual - waves_of(raw, bare.residual, lines))
    bare = evaluate(problem.with_noise(noise), np.zeros(0), bare.offsets, (), ())
    low_effects = [*ruled_out, *(e for e in EXPLANATIONS if e not in HIGH_ORDER and e != AnyOrder.id)]
    # What a pulse or a loop leaves where its shape is not quite right reaches into these orders too.
    rough = [i for i, term in enumerate(low.terms) if not leaves_nothing(term)]
    left = float(np.var(sum((low.contribution(i) for i in rough), np.zeros(len(averaged)))))
    # A term may be large only against a bent base: what both explain together is what counts.
    left = min(left, max(float(np.var(found.base.residual) - np.var(low.residual)), 0.0))
    taken = beside(bare, left, [low.terms[i] for i in rough])
    return select(bare, 1.0, rng, skip=low_effects, rounds=2, order_range=orders, beside=taken)


def left_as_recorded(recordings: Sequence[Recording], fit: Fit, nuisances: Nuisances) -> Problem:
    """What `fit`, made on averaged rows, leaves of the rows as recorded: a problem with an offset alone beside it."""
    raw, old = gather(recordings), fit.problem
    problem = Problem(raw, old.base, nuisances.columns(raw), Noise.white(raw, 1.0), old.prior_scale)
    base_value = np.zeros(len(raw)) if old.base is None else old.base.evaluate_at(problem.rotation, fit.errors)[0]
    terms = [EXPLANATIONS[t.effect].term(raw, t.shape, base_value) for t in fit.terms]
    left = replace(raw, error=evaluate(problem, fit.errors, fit.offsets, terms, fit.coefficients).residual)
    return Problem(left, None, np.ones((len(left), 1)), Noise.white(left, float(np.std(left.error))))


def waves_of(samples: Samples, values: Array, orders: Sequence[float]) -> Array:
    """The sines of `orders` in `values` (n,), together."""
    columns = sine_columns(samples.theta, orders)
    return columns @ np.linalg.lstsq(columns, values, rcond=None)[0]


def ripple_orders(averaged: Samples, raw: Samples) -> tuple[float, float]:
    """Orders that the rows as recorded hold and their averages do not."""
    return averaged.highest_order, 0.49 * raw.rows_per_turn


def beside(base: Fit, power: float, terms: Sequence[Term]) -> Beside:
    """`terms` of so much power (arcmin^2) that were taken out of the rows of `base`."""
    rows = float((base.problem.noise.root_weight > 0).sum())
    return Beside(tuple(terms), power * rows / base.problem.noise.sigma**2)


def strong_ripple(recordings: Sequence[Recording], base: Fit, nuisances: Nuisances) -> Array | None:
    """The strongest lines of orders beyond the averaged rows, as they add to the error of the rows as recorded, (n,);
    None where they are weak, or where no rows were averaged.
    """
    averaged = base.problem.samples
    if averaged.locked or not averaged.are_averages:
        return None
    problem = left_as_recorded(recordings, base, nuisances)
    probe = FitProbe(evaluate(problem, np.zeros(0), np.zeros(1), (), ()))
    lowest, highest = ripple_orders(averaged, problem.samples)
    lines = strongest_orders(probe, RIPPLE_LINES, lowest=lowest, highest=highest)
    if not lines:
        return None
    ripple = waves_of(problem.samples, probe.residual, lines)
    return ripple if np.var(ripple) > STRONG_RIPPLE * np.var(probe.residual - ripple) else None


def subtract(recordings: Sequence[Recording], total: Array) -> list[Recording]:
    """Recordings without what `total` (arcmin, on their rows as recorded) adds to their errors."""
    bounds = np.cumsum([0, *(len(r) for r in recordings)])
    return [
        replace(r, error_arcmin=r.error_arcmin - total[a:b])
        for r, a, b in zip(recordings, bounds[:-1], bounds[1:], strict=True)
    ]
