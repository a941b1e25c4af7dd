"""Tooth mesh as the zones meet it: a ripple that also decides which zone drives.

Where the ripple is as large as the difference between the two zones, the larger of the two switches with every tooth,
and its mean rises: a slow bulge at each change of the driving zone that no sine beside the base explains. So a mesh
ripple that was found is fitted once more on the rows as recorded, inside the larger-zone rule and with base and
effects free beside it, and kept so if that explains the rows better. Teeth differ in height round the rim, so that the
ripple has waves beside its own order: these come in step by step, each step from where the one before it ended, since
a drive that was bent to the bulges does not find its way back at once. At last every tooth has a height of its own.
"""

from __future__ import annotations

import copy
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.inference.base_fit import thinned
from hdopt.diagnosis.inference.catalogue import is_outside
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import Fit, FitProblem, evaluate, term_columns, with_terms
from hdopt.diagnosis.inference.noise import predictable_share
from hdopt.diagnosis.inference.nuisance import Nuisances
from hdopt.diagnosis.search.guess import Guess
from hdopt.diagnosis.search.tooth_heights import fit_heights, of_other_drives
from hdopt.effects.base import Explanation
from hdopt.effects.term import Shape, Term
from hdopt.parallel.shared_memory import each
from hdopt.recordings.rows import Rows

Weighed: TypeAlias = tuple[Term, Array]
"""A term with its coefficients."""


@dataclass(frozen=True)
class ZoneRipple:
    """A mesh ripple inside the zones: `fit` with the effects of high orders beside the base, the mesh the last of them,
    and what they add (`adds`) to the error on the rows as recorded (n,), arcmin, with what it does to the driving zone.
    """

    fit: Fit
    adds: Array


def fit_in_zones(
    rows: Rows,
    low: Fit,
    nuisances: Nuisances,
    ripple: Fit,
    rng: np.random.Generator,
    told: Guess | None = None,
    other_sets: Sequence[Fit] = (),
) -> ZoneRipple | None:
    """The one term of `ripple` that the zones may meet inside them, or None where it acts beside them or the sum of
    sines explains as much. Effects found with it stay beside where they still show; a sine without physics, which
    stands for what it does to the driving zone, goes. Where `ripple` has no such term and leaves more than noise, the
    first of the `other_sets` that has one is tried: of teeth that differ in height a few lines may explain more than
    the mesh and its nearest waves.

    `rows` are the rows as recorded with their recorded error, `low` the base and effects fitted on averaged rows.
    `nuisances` are the columns that are always free; `rng` draws other drives beside single teeth; `told` is what was
    found of it on other rows of the recordings, inside the zones or beside them: where that leaves nothing that the row
    before would tell, nothing else is tried.
    """
    base = low.problem.base
    candidates = ((one, _met_in_zones(one)) for one in (ripple, *other_sets))
    tried, at_mesh = next(((one, at) for one, at in candidates if at is not None), (ripple, None))
    if base is None or at_mesh is None or (tried is not ripple and leaves_white_noise(ripple)):
        return None
    physical = _physical(tried)
    effect, shape = tried.problem.explanations[physical[at_mesh][0].effect], physical[at_mesh][0].shape
    beside = [one for at, one in enumerate(physical) if at != at_mesh]
    problem = replace(low.problem, rows=rows, nuisance=nuisances.columns(rows), noise=ripple.problem.noise)
    base_value = base.evaluate_at(problem.rotation, low.errors)[0]
    known = _weighed([problem.explanations[t.effect].term(rows, t.shape, base_value) for t in low.terms], low)
    sines = _at(problem, low, [*known, *_weighed(ripple.terms, ripple)])
    sines = refine(sines, problem.settings.fit.settled_iterations, move_shapes=False)
    # Waves of the teeth may stand for what the ripple does to the driving zone: it is fitted without them, too.
    others = [one for one in known if one[0].met is None]
    starts = (known, others) if len(others) < len(known) else (known,)
    shapes = effect.in_zones(shape)
    fits: list[Fit] = []
    if told is not None and (known_ripple := _ripple_told(rows, effect, told)) is not None:
        if known_ripple[0].in_zones:
            there, iterations = replace(low, errors=told.errors), problem.settings.fit.known_iterations
            begun = [_at(problem, there, [*start, *beside, known_ripple]) for start in starts]
            fits = each(lambda one: refine(one, iterations, move_shapes=False), begun)
        elif leaves_white_noise(sines):
            return None
    if not any(leaves_white_noise(fit) for fit in fits):
        fits += each(
            lambda start: _step_by_step(problem, low, [*start, *beside], effect, shapes, copy.deepcopy(rng)), starts
        )
    inside = min((sines, *fits), key=_score)
    if inside is sines:
        return None
    first = len(inside.terms) - len(beside) - 1
    return _alone(_without_idle(inside, first), first)


def _physical(ripple: Fit) -> list[Weighed]:
    """The terms of `ripple` that are effects."""
    return [one for one in _weighed(ripple.terms, ripple) if not is_outside(one[0].effect)]


def _met_in_zones(ripple: Fit) -> int | None:
    """Which of the effects of `ripple` the zones may meet inside them, where there is one and no more."""
    terms = [term for term, _ in _physical(ripple)]
    met = [at for at, term in enumerate(terms) if ripple.problem.explanations[term.effect].in_zones(term.shape)]
    return met[0] if len(met) == 1 else None


def _ripple_told(rows: Rows, effect: Explanation, told: Guess) -> Weighed | None:
    """The term of `effect` on these `rows` that was `told`, inside the zones or beside them, with its coefficients;
    None where it was not."""
    for (name, shape), own in zip(told.terms, told.coefficients, strict=True):
        if name == effect.id:
            return effect.term(rows, shape), own
    return None


def leaves_white_noise(fit: Fit) -> bool:
    """Whether neighbouring rows tell next to nothing of what `fit` leaves."""
    settings = fit.problem.settings
    return predictable_share(fit.problem.rows, fit.residual, settings.noise) < settings.high_order.told_by_neighbours


def _step_by_step(
    problem: FitProblem,
    low: Fit,
    beside: Sequence[Weighed],
    effect: Explanation,
    shapes: Sequence[Shape],
    rng: np.random.Generator,
) -> Fit:
    """The best fit of `effect` inside the zones at one of its `shapes`, with all `beside` it, from the drive of `low`,
    on a part of the rows of `problem`, then on all. Each shape begins with the waves of the one before; `rng` draws
    other drives."""
    settings = problem.settings
    mask = np.zeros(len(problem.rows), bool)
    mask[:: max(1, len(mask) // settings.high_order.zone_rows)] = True
    thin = problem.only(mask)
    fit = _at(thin, low, [(thinned(term, mask), own) for term, own in beside])
    waves = None
    found = []
    for shape in shapes:
        term = effect.term(thin.rows, shape)
        waves = _seed(fit, term) if waves is None else widened(waves, term.width)
        start = evaluate(
            thin, fit.errors, fit.offsets, [*fit.terms[: len(beside)], term], [*fit.coefficients[: len(beside)], waves]
        )
        fit = refine(start, settings.base.full_iterations, move_shapes=False)
        waves = fit.coefficients[-1]
        found.append(fit)
    found += _tooth_by_tooth(thin, low, found, effect, rng)
    best = min(found, key=_score)
    others = (replace(term, shape=own.shape) for (term, _), own in zip(beside, best.terms, strict=False))
    terms = [*others, effect.term(problem.rows, best.terms[-1].shape)]
    whole = evaluate(problem, best.errors, best.offsets, terms, best.coefficients)
    return refine(whole, settings.fit.known_iterations, move_shapes=False)


def _tooth_by_tooth(
    thin: FitProblem, low: Fit, found: Sequence[Fit], effect: Explanation, rng: np.random.Generator
) -> list[Fit]:
    """Fits with a height of every tooth from the wave at the mesh's order of the first `found`: from the drive of the
    best of them, and from that of `low`. Where all leave more than noise, others in place of the best of each form,
    from drives that `rng` draws.
    """
    few, best = found[0], min(found, key=_score)
    shapes = effect.tooth_by_tooth(few.terms[-1], best.coefficients[-1], thin.rows.ratio)

    def fitted(begun: tuple[Shape, Fit]) -> Fit:
        shape, drive = begun
        start = evaluate(thin, drive.errors, drive.offsets, few.terms[:-1], best.coefficients[:-1])
        return fit_heights(start, effect.term(thin.rows, shape))

    drives = (best, low)
    fits = each(fitted, itertools.product(shapes, drives))
    if any(leaves_white_noise(fit) for fit in fits):
        return fits
    of_shapes = [fits[at : at + len(drives)] for at in range(0, len(fits), len(drives))]
    return fits + [of_other_drives(min(same, key=_score), rng) for same in of_shapes]


def _weighed(terms: Sequence[Term], fit: Fit) -> list[Weighed]:
    """`terms` with the coefficients that those of `fit` have."""
    return list(zip(terms, fit.coefficients, strict=True))


def _at(problem: FitProblem, low: Fit, weighed: Sequence[Weighed]) -> Fit:
    """The drive and offsets of `low` on the rows of `problem`, with the terms `weighed` beside them."""
    return evaluate(problem, low.errors, low.offsets, [one for one, _ in weighed], [own for _, own in weighed])


def _seed(bare: Fit, term: Term) -> Array:
    """First coefficients of `term`, with the zones as they drive without it."""
    columns = term_columns(term, bare)
    return np.asarray(np.linalg.lstsq(columns, bare.residual, rcond=None)[0], float)


def widened(waves: Array, width: int) -> Array:
    """Coefficients of both zones' `waves`, to a `width`: those that come in are none yet."""
    half = len(waves) // 2
    wide = np.zeros(width)
    wide[:half], wide[width // 2 : width // 2 + half] = waves[:half], waves[half:]
    return wide


def _without_idle(fit: Fit, first: int) -> Fit:
    """`fit` without those of its terms from the `first` on, but for the mesh, its last, that do not pay for themselves:
    a line may have held what the mesh's sines left of it, and nothing of the mesh as the zones meet it."""
    for at in reversed(range(first, len(fit.terms) - 1)):
        known = fit.problem.settings.fit.known_iterations
        fewer = refine(with_terms(fit, fit.all_but(at)), known, move_shapes=False)
        fit = min(fewer, fit, key=_score)
    return fit


def _score(fit: Fit) -> float:
    """Schwarz's criterion, in noise variances; heights of single teeth count one by one."""
    free = sum(term.width + max(len(term.shape.get("heights", ())) - 1, 0) for term in fit.terms)
    return fit.objective / fit.problem.noise.sigma**2 + free * math.log(fit.problem.weighed_rows)


def _alone(fit: Fit, others: int) -> ZoneRipple:
    without = with_terms(fit, range(others))
    # What stands beside is no part of it, so that no shape of it can be moved and fitted again.
    held = tuple(replace(term, steps={}) for term in fit.terms[others:])
    alone = replace(fit, terms=held, coefficients=fit.coefficients[others:])
    return ZoneRipple(alone, fit.prediction - without.prediction)
