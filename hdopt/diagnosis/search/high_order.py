"""Orders above what the averaged rows hold: looked for on the rows as recorded, and taken out of them."""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.alternatives.in_angle import AnyOrder
from hdopt.diagnosis.alternatives.in_time import Mains
from hdopt.diagnosis.inference.base_excitation import is_driven
from hdopt.diagnosis.inference.catalogue import explanations
from hdopt.diagnosis.inference.clean_base import CS_TEETH, FS_TEETH
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import Fit, evaluate, with_terms
from hdopt.diagnosis.inference.nuisance import Nuisances
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.search.as_recorded import (
    left_as_recorded,
    left_of,
    noise_beside_lines,
    on_rows_as_recorded,
    power_left,
    waves_of,
)
from hdopt.diagnosis.search.guess import Guess
from hdopt.diagnosis.search.penalty import SubtractedTerms, leaves_nothing
from hdopt.diagnosis.search.search_state import SearchPlan
from hdopt.diagnosis.search.subset_search import Selection, select
from hdopt.diagnosis.search.zone_high_order import ZoneRipple, fit_in_zones, leaves_white_noise
from hdopt.diagnosis.settings import DEFAULT, HighOrderSettings
from hdopt.effects import EFFECTS, HIGH_ORDER
from hdopt.effects.probe import strongest_orders
from hdopt.effects.term import Term
from hdopt.recordings.read import Recording
from hdopt.recordings.rows import Rows, gather


def find_ripple(
    recordings: Sequence[Recording],
    found: Selection,
    nuisances: Nuisances,
    ruled_out: Sequence[str],
    rng: np.random.Generator,
    told: Guess | None = None,
) -> tuple[Selection | None, Array | None]:
    """The search of orders above the averaged rows of `recordings` beside what was `found` in them and the
    `nuisances`, without the effects `ruled_out`, and what its best candidate adds to the rows as recorded, (n,).
    `rng` draws what is random; `told` is the ripple found on other rows of them.
    """

    def ripple_beside(what: Selection, lowest: float | None) -> tuple[Selection | None, ZoneRipple | None]:
        high = high_order_selection(recordings, what, nuisances, ruled_out, rng, lowest)
        if high is None or not high.best.fit.terms:
            return high, None
        others = [one.fit for one in high.candidates[1:]]
        return high, fit_in_zones(
            gather(recordings), what.best.fit, nuisances, high.best.fit, copy.deepcopy(rng), told, others
        )

    for taken_out in (mesh_taken_out, waves_taken_out):
        if (without := taken_out(found)) is None:
            continue
        high, inside = ripple_beside(*without)
        if high is not None and inside is not None:
            left = left_as_recorded(recordings, found.best.fit, nuisances).rows.error
            if np.var(inside.fit.residual) < np.var(left):
                return high.with_best_fit(inside.fit), inside.adds
    high, inside = ripple_beside(found, None)
    if high is None or not high.best.fit.terms:
        return high, None
    if inside is None:
        return high, high.best.fit.contributions
    return high.with_best_fit(inside.fit), inside.adds


def mesh_taken_out(found: Selection) -> tuple[Selection, float] | None:
    """Of what was `found` in rows fine enough to hold it: the best set without an effect of high order that the zones
    may meet inside them, which was seen beside the drive's motion there, and the lowest order to look for it from;
    None without one, and where a better set leaves nothing.
    """
    for candidate in found.candidates:
        fit = candidate.fit
        for at, term in enumerate(fit.terms):
            effect = fit.problem.explanations[term.effect]
            if term.effect not in HIGH_ORDER or not effect.in_zones(term.shape):
                continue
            if candidate is not found.best and leaves_white_noise(found.best.fit):
                return None
            without = with_terms(fit, fit.all_but(at))
            return found.with_best_fit(without), lowest_order([term], fit.problem.rows.ratio)
    return None


def waves_taken_out(found: Selection) -> tuple[Selection, None] | None:
    """Of what was `found` in rows too coarse to hold a mesh: what swings behind the drive without the waves of the
    teeth beside it and what else acts in the zones, where all leave more than noise. A spring lets little of a mesh
    through but what is slow, heights that differ from tooth to tooth and bulges where the zones change: waves of the
    teeth stand for these in part, which lobes alone do not. None else.
    """
    fit = found.best.fit
    left = [at for at, term in enumerate(fit.terms) if not term.in_zones]
    swings = any(is_driven(term) for term in fit.terms)
    of_teeth = any(term.effect in (CS_TEETH, FS_TEETH) for term in fit.terms)
    if not (swings and of_teeth):
        return None
    if not fit.problem.rows.are_averages or leaves_white_noise(fit):
        return None
    iterations = fit.problem.settings.fit.settled_iterations
    return found.with_best_fit(refine(with_terms(fit, left), iterations)), None


def lowest_order(terms: Sequence[Term], ratio: float) -> float:
    """An order below all of those of `terms`, at a drive's `ratio`; without end where they have none."""
    effects = ((EFFECTS[one.effect], one.shape) for one in terms if one.effect in EFFECTS)
    return min((order - 1 for effect, shape in effects for order in effect.orders(shape, ratio)), default=math.inf)


def high_order_selection(
    recordings: Sequence[Recording],
    found: Selection,
    nuisances: Nuisances,
    ruled_out: Sequence[str],
    rng: np.random.Generator,
    lowest: float | None = None,
) -> Selection | None:
    """Effects of orders above what the averaged rows hold, or from the `lowest` on, on the rows of `recordings` as they
    are without what was `found` there: of all effects but those `ruled_out`. `nuisances` are the columns that are
    always free. `rng` draws what is random. None where no rows were averaged and no order is said.
    """
    low = found.best.fit
    averaged = low.problem.rows
    if averaged.locked or not (averaged.are_averages or lowest is not None):
        return None
    as_recorded = on_rows_as_recorded(recordings, low, nuisances)
    problem = left_of(as_recorded)
    raw, settings = problem.rows, problem.settings
    above, highest = ripple_orders(averaged, raw, settings.high_order)
    lowest = above if lowest is None else lowest
    orders = (lowest, highest)
    start = evaluate(problem, np.zeros(0), np.zeros(1), (), ())
    bare = refine(start, settings.fit.offset_iterations)
    noise = noise_beside_lines(bare, orders)
    bare = evaluate(problem.with_noise(noise), np.zeros(0), bare.offsets, (), ())
    low_effects = (*ruled_out, *(e for e in explanations() if e not in HIGH_ORDER and e not in (AnyOrder.id, Mains.id)))
    rough = [i for i, term in enumerate(low.terms) if not leaves_nothing(term)]
    power = power_left(as_recorded, rough, lowest)
    # A term may be large only against a bent base: what both explain together is what counts.
    power = min(power, max(float(np.var(found.base.residual) - np.var(low.residual)), 0.0))
    taken = subtracted_terms(bare, power, [low.terms[i] for i in rough])
    return select(bare, 1.0, rng, SearchPlan(skip=low_effects, order_range=orders, subtracted=taken))


def ripple_orders(averaged: Rows, raw: Rows, settings: HighOrderSettings = DEFAULT.high_order) -> tuple[float, float]:
    """Lowest and highest order that the rows as recorded (`raw`) hold and their averages do not. `averaged` are
    their means. `settings` are the thresholds.
    """
    return averaged.highest_order, settings.order_share * raw.rows_per_turn


def subtracted_terms(base: Fit, power: float, terms: Sequence[Term]) -> SubtractedTerms:
    """`terms` of so much `power` (arcmin^2) that were taken out of the rows of `base`."""
    return SubtractedTerms(tuple(terms), power * base.problem.weighed_rows / base.problem.noise.sigma**2)


def strong_ripple(recordings: Sequence[Recording], base: Fit, nuisances: Nuisances) -> Array | None:
    """The strongest lines of orders beyond the averaged rows in what `base` and `nuisances` leave of `recordings`, as
    they add to the error of the rows as recorded, (n,); None where they are weak or those of a pulse, or where no rows
    were averaged.
    """
    averaged, settings = base.problem.rows, base.problem.settings.high_order
    if averaged.locked or not averaged.are_averages:
        return None
    problem = left_as_recorded(recordings, base, nuisances)
    probe = FitProbe(evaluate(problem, np.zeros(0), np.zeros(1), (), ()))
    lowest, highest = ripple_orders(averaged, problem.rows, settings)
    lines = strongest_orders(probe, settings.lines, lowest=lowest, highest=highest)
    if not lines:
        return None
    ripple = waves_of(problem.rows, probe.residual, lines)
    if np.var(ripple) <= settings.strong * np.var(probe.residual - ripple):
        return None
    return None if is_part_of_a_pulse(lines, probe.spectrum(np.array(lines)), settings) else ripple


def is_part_of_a_pulse(orders: Sequence[float], amplitudes: Array, settings: HighOrderSettings) -> bool:
    """Whether lines at `orders` (k,) of `amplitudes` (k,) are those of a pulse once a turn, whose other lines the
    averaged rows hold: many about as large as each other, wide apart, as the `settings` say. A ripple of teeth or of an
    encoder is a line with a few multiples, or with neighbours by which it is modulated.
    """
    power = amplitudes**2 / np.sum(amplitudes**2)
    middle = float(power @ np.array(orders))
    spread = math.sqrt(float(power @ (np.array(orders) - middle) ** 2))
    return bool(1 / np.sum(power**2) > settings.pulse_lines and spread > settings.pulse_spread * middle)


def subtract(recordings: Sequence[Recording], total: Array) -> list[Recording]:
    """Recordings without what `total` (arcmin, on their rows as recorded) adds to their errors. `recordings` are
    those diagnosed.
    """
    bounds = np.cumsum([0, *(len(r) for r in recordings)])
    return [
        replace(r, error_arcmin=r.error_arcmin - total[a:b])
        for r, a, b in zip(recordings, bounds[:-1], bounds[1:], strict=True)
    ]
