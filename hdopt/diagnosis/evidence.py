"""The numbers that carry the verdict: held-out errors, the placebo, what is left, false alarms, limits of detection."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hdopt.diagnosis.candidates import search_terms
from hdopt.diagnosis.catalogue import STRAIN_WAVE_ONLY
from hdopt.diagnosis.conditions import AcrossConditions, across_conditions
from hdopt.diagnosis.effect import strongest_orders
from hdopt.diagnosis.effects import EFFECTS
from hdopt.diagnosis.fit import Fit, term_columns
from hdopt.diagnosis.generic import useful_columns
from hdopt.diagnosis.heldout import HeldOut, family_wise_p, held_out, paired_t, turn_folds
from hdopt.diagnosis.nuisance import Nuisances
from hdopt.diagnosis.price import price
from hdopt.diagnosis.probe import FitProbe
from hdopt.diagnosis.samples import Samples
from hdopt.diagnosis.select import Selection
from hdopt.diagnosis.suddenness import Steps, sudden_steps
from hdopt.diagnosis.wander import SlowWave, slow_wave

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
    steps: Steps
    wave: SlowWave | None


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
        steps=sudden_steps(best),
        wave=slow_wave(best),
    )


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
