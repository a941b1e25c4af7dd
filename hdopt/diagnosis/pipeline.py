"""From recordings to a diagnosis: base fit, noise, search, what is left, and the numbers that carry the verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hdopt.diagnosis import noise as noise_model
from hdopt.diagnosis.base import fit_base
from hdopt.diagnosis.catalogue import EXPLANATIONS, STRAIN_WAVE_ONLY
from hdopt.diagnosis.effect import sine_columns
from hdopt.diagnosis.evidence import Evidence, assess
from hdopt.diagnosis.fit import Fit, Problem, evaluate, refine
from hdopt.diagnosis.generic import generic_columns
from hdopt.diagnosis.noise import Noise
from hdopt.diagnosis.nuisance import Nuisances, nuisances_for, with_time_warp
from hdopt.diagnosis.probe import FitProbe
from hdopt.diagnosis.ripple import beside, find_ripple, strong_ripple, subtract
from hdopt.diagnosis.samples import gather, neighbours_for
from hdopt.diagnosis.select import Selection, select
from hdopt.diagnosis.steps import find_steps, step_columns
from hdopt.kinematics.cartesian import CartesianModel
from hdopt.recording import Recording

Array = NDArray[np.float64]

BESIDE_RIPPLE = 0.01
"""Power over the ripple's from which effects that came or went beside it may have had a part in its name."""
NOISE_ROUNDS = 3
"""How often the noise is measured anew at most."""


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
    ripple = strong_ripple(recordings, start, nuisances)
    if ripple is not None:
        # What the means of a few rows cannot hold comes back as orders that are not there: it waits for its own search.
        samples = gather(subtract(recordings, ripple), neighbours_for(recordings))
        start = fit_base(replace(problem, samples=samples), rng, near=start)
        problem = start.problem
    if "time-warp" in nuisance:
        start, nuisances = fit_time_warp(start, nuisances)
        problem = start.problem
    noise, inflation = measure_noise(start)
    base_fit = refine(fit_base(problem.with_noise(noise), rng, starts=4, near=start), iterations=6)
    clean = clean_base(problem.with_noise(noise), rng)
    selection = select(base_fit, inflation, rng, skip=ruled_out, clean=clean)
    base_fit = selection.base
    for _ in range(NOISE_ROUNDS):
        # The noise again, now without what was found: where it was most of what is there, more shows beside it.
        noise_2, inflation_2 = measure_noise(selection.best.fit)
        if not selection.best.fit.terms or 0.7 < noise_2.sigma / noise.sigma < 1.4:
            break
        problem_2 = problem.with_noise(noise_2)
        base_fit = refine(_rebase(base_fit, problem_2), iterations=8)
        selection = select(base_fit, inflation_2, rng, skip=ruled_out, known=rebased(selection, problem_2))
        base_fit, noise, inflation = selection.base, noise_2, inflation_2
    high, ripple = find_ripple(recordings, selection, nuisances, ruled_out, rng)
    if ripple is not None:
        cleaned = subtract(recordings, ripple)
        samples = gather(cleaned, neighbours_for(cleaned))
        problem = replace(problem, samples=samples, nuisance=nuisances.columns(samples), noise=noise)
        base_fit = refine(_rebase(base_fit, problem), iterations=8)
        before = selection.best
        noise, inflation = measure_noise(base_fit if not before.effects else _rebase(before.fit, problem))
        base_fit = refine(_rebase(base_fit, problem.with_noise(noise)), iterations=4)
        taken = beside(base_fit, float(np.var(ripple)), high.best.fit.terms)
        known = rebased(selection, base_fit.problem)
        selection = select(base_fit, inflation, rng, skip=ruled_out, known=known, beside=taken)
        changed = set(selection.best.effects) != set(before.effects)
        sizes = [float(np.var(fit.contributions)) for fit in (selection.best.fit, before.fit)]
        if changed and max(sizes) > BESIDE_RIPPLE * float(np.var(ripple)):
            # What was beside the ripple when it was named is not there any more.
            high, _ = find_ripple(recordings, selection, nuisances, ruled_out, rng)
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
        replace(EXPLANATIONS[t.effect].term(problem.samples, t.shape, fit.motion), trials=t.trials, odds=t.odds)
        for t in fit.terms
    ]
    return evaluate(problem, fit.errors, fit.offsets, terms, fit.coefficients)


def rebased(selection: Selection, problem: Problem) -> list[Fit]:
    """The leaders of a search on another problem's rows and noise; none where nothing led."""
    return [_rebase(fit, problem) for fit in selection.leaders] if selection.best.fit.terms else []


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
    # Steps would be taken for wander, whose colour then hides them.
    rows = [] if samples.locked else find_steps(probe.residual)[0]
    white = probe.project(probe.noise.whiten(np.column_stack([columns, step_columns(len(samples), rows)])))
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
