"""From recordings to a diagnosis: base fit, noise, search, what is left, and the numbers that carry the verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hdopt.diagnosis import noise as noise_model
from hdopt.diagnosis.base import fit_base
from hdopt.diagnosis.catalogue import EXPLANATIONS, STRAIN_WAVE_ONLY
from hdopt.diagnosis.conditions import AcrossConditions, across_conditions
from hdopt.diagnosis.effect import Term, sine_columns, strongest_orders
from hdopt.diagnosis.effects import EFFECTS, HIGH_ORDER
from hdopt.diagnosis.fit import Fit, Problem, evaluate, refine, term_columns
from hdopt.diagnosis.generic import generic_columns, useful_columns
from hdopt.diagnosis.heldout import HeldOut, family_wise_p, held_out, paired_t, turn_folds
from hdopt.diagnosis.noise import Noise
from hdopt.diagnosis.nuisance import Nuisances, nuisances_for, with_time_warp
from hdopt.diagnosis.outside import AnyOrder
from hdopt.diagnosis.probe import FitProbe
from hdopt.diagnosis.samples import Samples, gather, neighbours_for
from hdopt.diagnosis.select import Beside, Selection, has_exact_shape, price, search_terms, select
from hdopt.diagnosis.zone_ripple import fit_in_zones
from hdopt.kinematics.cartesian import CartesianModel
from hdopt.recording import Recording

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Remainder:
    """What a fit leaves, as seen by the generic basis: its held-out error, the t of its win, its largest domain."""

    held_out: HeldOut
    t: float
    domains: dict[str, float]
    orders: tuple[float, ...]
    columns: Array


@dataclass(frozen=True)
class Evidence:
    """Everything the verdict is drawn from."""

    samples: Samples
    selection: Selection
    high: Selection | None
    nuisances: Nuisances
    base_held_out: HeldOut
    extended_held_out: HeldOut
    generic_held_out: HeldOut
    placebo_held_out: HeldOut
    across_conditions: AcrossConditions | None
    remainder: Remainder
    noise_floor: float
    false_alarm_p: float
    inflation: float
    lacking: dict[str, str]
    below_detection: dict[str, float]


def gather_evidence(
    recordings: Sequence[Recording], base: CartesianModel | None, seed: int, nuisance: Sequence[str] = ()
) -> Evidence:
    """Run the whole diagnosis; `nuisance` names what is free beside the model (`hdopt.diagnosis.nuisance`)."""
    rng = np.random.default_rng(seed)
    # Offsets of thousands of arcmin are zeros of encoders; without them the numbers keep their digits.
    middle = float(np.median(recordings[0].error_arcmin))
    recordings = [replace(r, error_arcmin=r.error_arcmin - middle) for r in recordings]
    samples = gather(recordings, neighbours_for(recordings))
    nuisances = nuisances_for(samples, base, nuisance)
    ruled_out = (*nuisances.hidden, *(STRAIN_WAVE_ONLY if base is None else ()))
    problem = Problem(samples, base, nuisances.columns(samples), Noise.white(samples, 1.0))
    scale = float(np.std(samples.error - _mean_by_offset(problem)))
    problem = replace(problem, noise=Noise.white(samples, max(0.3 * scale, 1e-9)), prior_scale=max(1.0, scale / 0.3))
    start = fit_base(problem, rng)
    if "time-warp" in nuisance:
        start, nuisances = fit_time_warp(start, nuisances)
        problem = start.problem
    noise, inflation = measure_noise(start)
    base_fit = refine(fit_base(problem.with_noise(noise), rng, starts=4, near=start), iterations=6)
    clean = clean_base(problem.with_noise(noise), rng)
    selection = select(base_fit, inflation, rng, skip=ruled_out, clean=clean)
    best = selection.best.fit
    # The noise again, now without what was found.
    noise_2, inflation_2 = measure_noise(best)
    if selection.best.fit.terms and not (0.7 < noise_2.sigma / noise.sigma < 1.4):
        problem_2 = problem.with_noise(noise_2)
        base_fit = refine(_rebase(base_fit, problem_2), iterations=8)
        selection = select(base_fit, inflation_2, rng, skip=ruled_out, known=_rebase(best, problem_2))
        noise, inflation = noise_2, inflation_2
    high = high_order_selection(recordings, selection.best.fit, nuisances, ruled_out, rng)
    if high is not None and high.best.fit.terms:
        inside = fit_in_zones(gather(recordings), selection.best.fit, nuisances, high.best.fit)
        if inside is not None:
            high = high.with_best_fit(inside.fit)
        ripple = inside.adds if inside is not None else high.best.fit.contributions
        cleaned = subtract(recordings, ripple)
        samples = gather(cleaned, neighbours_for(cleaned))
        problem = replace(problem, samples=samples, nuisance=nuisances.columns(samples), noise=noise)
        base_fit = refine(_rebase(base_fit, problem), iterations=8)
        noise, inflation = measure_noise(
            base_fit if not selection.best.fit.terms else _rebase(selection.best.fit, problem)
        )
        base_fit = refine(_rebase(base_fit, problem.with_noise(noise)), iterations=4)
        taken = beside(base_fit, float(np.var(ripple)), high.best.fit.terms)
        known = _rebase(selection.best.fit, base_fit.problem)
        selection = select(base_fit, inflation, rng, skip=ruled_out, known=known, beside=taken)
    return assess(samples, selection, high, nuisances, inflation, rng)


def fit_time_warp(start: Fit, nuisances: Nuisances, rounds: int = 3) -> tuple[Fit, Nuisances]:
    """The base fitted with a time warp beside it, linearised anew where each fit stands."""
    fit = start
    for _ in range(rounds):
        nuisances = with_time_warp(nuisances, fit)
        problem = replace(start.problem, nuisance=nuisances.columns(start.problem.samples))
        free = np.r_[fit.offsets, np.zeros(problem.nuisance.shape[1] - len(fit.offsets))]
        fit = refine(evaluate(problem, fit.errors, free, (), ()), iterations=20)
    return fit, nuisances


def _mean_by_offset(problem: Problem) -> Array:
    nuisance = problem.nuisance
    return nuisance @ np.linalg.lstsq(nuisance, problem.samples.error, rcond=None)[0]


def _rebase(fit: Fit, problem: Problem) -> Fit:
    """The same parameters on another problem's rows and noise."""
    terms = [
        replace(EXPLANATIONS[t.effect].term(problem.samples, t.shape, fit.base_value), trials=t.trials, odds=t.odds)
        for t in fit.terms
    ]
    return evaluate(problem, fit.errors, fit.offsets, terms, fit.coefficients)


def clean_base(problem: Problem, rng: np.random.Generator) -> Fit | None:
    """The base fitted beside smooth columns that soak up most additive physics, then looked at without them."""
    if problem.base is None:
        return None
    columns, domains = generic_columns(problem.samples)
    wanted = [
        i for i, d in enumerate(domains) if d not in ("integer order", "output-synchronous order", "asynchronous order")
    ]
    nuisance = np.column_stack([problem.nuisance, columns[:, wanted], sine_columns(problem.samples.theta, [1])])
    fit = fit_base(replace(problem, nuisance=nuisance), rng, starts=12)
    bare = evaluate(problem, fit.errors, fit.offsets[: problem.nuisance.shape[1]], (), ())
    offset = np.linalg.lstsq(problem.nuisance, bare.residual, rcond=None)[0]
    return evaluate(problem, fit.errors, bare.offsets + offset, (), ())


def measure_noise(fit: Fit) -> tuple[Noise, float]:
    """AR noise of what neither fit nor generic basis explains, and how much rougher it still is turn by turn."""
    samples = fit.problem.samples
    probe = FitProbe(replace(fit, problem=fit.problem.with_noise(Noise.white(samples, fit.problem.noise.sigma))))
    columns, _ = generic_columns(samples, probe)
    white = probe.project(probe.noise.whiten(columns))
    scale = np.sqrt(np.maximum((white**2).sum(0), 1e-300))
    solution = np.linalg.lstsq(white / scale, probe.white_residual, rcond=1e-8)[0]
    residual = probe.white_residual - white / scale @ solution
    residual = residual / np.maximum(probe.noise.root_weight, 1e-6)
    noise = noise_model.estimate(samples, residual)
    # Scores of smooth columns, turn by turn, against what white noise would give.
    whitened = noise.whiten(residual)
    columns_white = noise.whiten(columns)
    block = samples.block
    scores = np.zeros((block[-1] + 1, columns.shape[1]))
    np.add.at(scores, block, columns_white * whitened[:, None])
    expected = noise.sigma**2 * (columns_white**2).sum(0)
    inflation = np.median((scores**2).sum(0) / np.maximum(expected, 1e-300))
    return noise, float(np.clip(inflation, 1.0, 10.0))


def high_order_selection(
    recordings: Sequence[Recording],
    low: Fit,
    nuisances: Nuisances,
    ruled_out: Sequence[str],
    rng: np.random.Generator,
) -> Selection | None:
    """Effects of orders above what the averaged rows hold, looked for on the rows as recorded."""
    averaged = low.problem.samples
    if averaged.locked or not averaged.are_averages:
        return None
    raw = gather(recordings)
    lowest = averaged.highest_order
    problem = Problem(raw, low.problem.base, nuisances.columns(raw), Noise.white(raw, 1.0), low.problem.prior_scale)
    base_value = (
        low.problem.base.evaluate_at(problem.rotation, low.errors)[0]
        if low.problem.base is not None
        else np.zeros(len(raw))
    )
    terms = [EXPLANATIONS[t.effect].term(raw, t.shape, base_value) for t in low.terms]
    residual = evaluate(problem, low.errors, low.offsets, terms, low.coefficients).residual
    raw = replace(raw, error=residual)
    problem = Problem(raw, None, np.ones((len(raw), 1)), Noise.white(raw, float(np.std(residual))))
    bare = refine(evaluate(problem, np.zeros(0), np.zeros(1), (), ()), iterations=2)
    noise = noise_model.estimate(raw, bare.residual)
    # A strong ripple must not be taken for noise: its strongest lines are taken out before the noise is measured.
    lines = strongest_orders(FitProbe(bare), 6, lowest=lowest, highest=0.49 * raw.rows_per_turn)
    if lines:
        columns = sine_columns(raw.theta, lines)
        clean = bare.residual - columns @ np.linalg.lstsq(columns, bare.residual, rcond=None)[0]
        noise = noise_model.estimate(raw, clean)
    bare = evaluate(problem.with_noise(noise), np.zeros(0), bare.offsets, (), ())
    low_effects = [*ruled_out, *(e for e in EXPLANATIONS if e not in HIGH_ORDER and e != AnyOrder.id)]
    # What a pulse or a loop leaves where its shape is not quite right reaches into these orders too.
    rough = [i for i, term in enumerate(low.terms) if not has_exact_shape(term)]
    left = float(np.var(sum((low.contribution(i) for i in rough), np.zeros(len(averaged)))))
    taken = beside(bare, left, [low.terms[i] for i in rough])
    return select(
        bare, 1.0, rng, skip=low_effects, rounds=2, order_range=ripple_orders(averaged, raw), beside=taken
    )


def ripple_orders(averaged: Samples, raw: Samples) -> tuple[float, float]:
    """Orders that the rows as recorded hold and their averages do not."""
    return averaged.highest_order, 0.49 * raw.rows_per_turn


def beside(base: Fit, power: float, terms: Sequence[Term]) -> Beside:
    """`terms` of so much power (arcmin^2) that were taken out of the rows of `base`."""
    rows = float((base.problem.noise.root_weight > 0).sum())
    return Beside(tuple(terms), power * rows / base.problem.noise.sigma**2)


def subtract(recordings: Sequence[Recording], total: Array) -> list[Recording]:
    """Recordings without what `total` (arcmin, on their rows as recorded) adds to their errors."""
    bounds = np.cumsum([0, *(len(r) for r in recordings)])
    return [
        replace(r, error_arcmin=r.error_arcmin - total[a:b])
        for r, a, b in zip(recordings, bounds[:-1], bounds[1:], strict=True)
    ]


def look_at_remainder(fit: Fit, folds: NDArray[np.int64], inflation: float) -> Remainder:
    """Held-out gain of the generic basis beside `fit`."""
    samples = fit.problem.samples
    probe = FitProbe(fit)
    columns, domains = useful_columns(probe, inflation)
    orders = tuple(strongest_orders(probe, 3)) if not samples.locked else ()
    own = held_out(fit, None, folds)
    generic = held_out(fit, columns, folds)
    gains = {}
    for domain in dict.fromkeys(domains):
        chosen = [i for i, d in enumerate(domains) if d == domain]
        alone = held_out(fit, columns[:, chosen], folds)
        gains[domain] = own.variance - alone.variance
    t = paired_t(own.white, generic.white)
    return Remainder(generic, t, gains, orders, columns)


def assess(
    samples: Samples, selection: Selection, high: Selection | None, nuisances: Nuisances, inflation: float, rng
) -> Evidence:
    base, best = selection.base, selection.best.fit
    folds = turn_folds(base, rng)
    base_out = held_out(base, None, folds)
    best_out = base_out if best is base else held_out(best, None, folds)
    remainder = look_at_remainder(best, folds, inflation)
    if best is base:
        generic_out = remainder.held_out
    else:
        columns, _ = useful_columns(FitProbe(base), inflation)
        generic_out = held_out(base, columns, folds)
    found = {t.effect for t in best.terms}
    # Placebo: the best single other effect of the catalogue, freed as much as the winner.
    probe = FitProbe(base)
    strange = STRAIN_WAVE_ONLY if base.problem.base is None else ()
    pool = search_terms(probe, skip=(*nuisances.hidden, *strange))
    others = [t for t in pool if t.effect not in found and t.effect in EFFECTS]
    placebo = max(others, key=probe.gain, default=None)
    placebo_out = base_out
    if placebo is not None:
        placebo_out = held_out(base, term_columns(placebo, base.zone, base.problem.base), folds)
    rows = float((base.problem.noise.root_weight > 0).sum())
    prices = [price([t], rows, 0.0, inflation) for t in pool]
    gains = [probe.gain(t) / 2 / inflation - p for t, p in zip(pool, prices, strict=True)]
    observed = max([*gains, selection.best.evidence if best is not base else -np.inf], default=-np.inf)
    p = family_wise_p(probe, pool, prices, rng, observed, inflation) if pool else 1.0
    lacking = {
        e.id: reason
        for e in EFFECTS.values()
        if (
            reason := (
                "a harmonic-drive model (--drive)" if e.needs_base and base.problem.base is None else e.lacks(samples)
            )
        )
    }
    lacking |= {name: "a harmonic drive (--drive)" for name in strange}
    lacking |= {name: "a fit without a free drift (--nuisance)" for name in nuisances.hidden}
    if high is not None and "tooth_mesh" in lacking:
        lacking.pop("tooth_mesh")
    floor = float(np.sqrt(min(remainder.held_out.variance, best_out.variance)))
    return Evidence(
        samples=samples,
        selection=selection,
        high=high,
        nuisances=nuisances,
        base_held_out=base_out,
        extended_held_out=best_out,
        generic_held_out=generic_out,
        placebo_held_out=placebo_out,
        across_conditions=across_conditions(base, best),
        remainder=remainder,
        noise_floor=floor,
        false_alarm_p=p,
        inflation=inflation,
        lacking=lacking,
        below_detection=detection_limits(FitProbe(best), pool, rows, inflation),
    )


def detection_limits(probe: FitProbe, terms, rows: float, inflation: float) -> dict[str, float]:
    """Smallest rms (arcmin) of each effect that would have been found: where its gain just pays its price."""
    limits: dict[str, float] = {}
    for term in terms:
        raw = term_columns(term, probe.fit.zone, probe.fit.problem.base)
        left = (probe.columns(term) ** 2).sum(0)
        power = np.maximum((raw**2).mean(0), 1e-300)
        visible = float(np.mean(left / power))
        needed = 2 * inflation * price([term], rows, 0.0, inflation) * probe.noise.sigma**2
        limit = math.sqrt(needed / max(visible, 1e-12))
        limits[term.effect] = min(limit, limits.get(term.effect, math.inf))
    return limits
