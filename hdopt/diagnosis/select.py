"""Which effects explain the residual: a search over subsets, with the base refitted beside every one of them.

Every candidate's columns are whitened and freed of what the base can absorb; the drop of the sum of squares of every
subset up to three then follows from one table of inner products. Subsets are weighed by an approximate log evidence:
half the gain less half the freedom times log(rows) (Schwarz), less what the search over shapes cost and less prior
odds. The leaders are fitted jointly with the nonlinear base, and the search is repeated about the best fit until it
stands.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hdopt.diagnosis.base import fit_base
from hdopt.diagnosis.catalogue import EXPLANATIONS, is_outside
from hdopt.diagnosis.effect import Term
from hdopt.diagnosis.fit import Fit, evaluate, extend, refine
from hdopt.diagnosis.parallel import each
from hdopt.diagnosis.probe import FitProbe

Array = NDArray[np.float64]

MOST_EFFECTS = 3
EFFECT_COST = 4.0
"""Log prior odds against an effect being there: about 1 in 50."""
DISCREPANCY = 0.08
"""Share of the explained power that an effect must add beyond others of its kind: no model's shapes are exact, and
what a slightly wrong shape leaves must not be named as further physics.
"""
OTHER_KIND = 0.01
"""The same beside effects of another kind only: what a wrong loop leaves is no order, and the reverse."""
KINDS = {
    "order": "turning",
    "angle": "turning",
    "asynchronous order": "turning",
    "time": "slow",
    "temperature": "slow",
    "torque": "load",
}
"""Kind of an effect by its domain; reversal, direction and speed are one: no curve of the torque makes a loop."""
FEW_COEFFICIENTS, MANY_COEFFICIENTS = 8, 24
CLEAR_WIN = 0.12
"""Share of the explained power by which a description without physics must beat the catalogue."""
LEADERS = 3
WORTH_A_FIT = 0.25
"""Share of the best subset's gain from which a single effect is fitted jointly too: the refitted base may favour it."""


@dataclass(frozen=True)
class Candidate:
    """A set of terms with its joint fit and log evidence against the base alone."""

    fit: Fit
    evidence: float
    gain: float

    @property
    def effects(self) -> tuple[str, ...]:
        return tuple(term.effect for term in self.fit.terms)

    @property
    def outside(self) -> bool:
        """Whether a description without physics takes part."""
        return any(is_outside(name) for name in self.effects)


@dataclass(frozen=True)
class Selection:
    """The base alone, the candidates in order of evidence (the base alone is among them), and single effects' gains."""

    base: Fit
    candidates: tuple[Candidate, ...]
    inflation: float

    @property
    def best(self) -> Candidate:
        return self.candidates[0]

    def with_best_fit(self, fit: Fit) -> Selection:
        """The same selection with its best candidate fitted otherwise."""
        return replace(self, candidates=(replace(self.best, fit=fit), *self.candidates[1:]))


def search_terms(probe: FitProbe, skip: Sequence[str] = (), only: Sequence[str] | None = None) -> list[Term]:
    """Every effect's best terms for the probe's residual."""
    base = probe.fit.problem.base
    effects = [
        effect
        for effect in EXPLANATIONS.values()
        if effect.id not in skip
        and (only is None or effect.id in only)
        and not (effect.needs_base and base is None)
        and effect.lacks(probe.samples) is None
    ]
    return [term for found in each(lambda effect: effect.search(probe), effects) for term in found]


@dataclass(frozen=True)
class Beside:
    """Terms already taken out of the rows (a ripple of higher order), and what they gained there: what their shapes
    leave must not be named either.
    """

    terms: tuple[Term, ...] = ()
    gain: float = 0.0


NOTHING_BESIDE = Beside()


def price(
    terms: Sequence[Term], rows: float, gain: float, inflation: float, beside: Beside = NOTHING_BESIDE
) -> float:
    """What a set of terms has to pay in log evidence."""
    cost = 0.5 * sum(term.freedom for term in terms) * math.log(rows)
    cost += sum(math.log(max(term.trials, 1.0)) - term.odds for term in terms)
    outside = sum(is_outside(term.effect) for term in terms)
    cost += outside * 0.5 * CLEAR_WIN * gain / inflation
    inexact = discrepancy([*terms, *beside.terms]) - discrepancy(beside.terms) if terms else 0.0
    return cost + len(terms) * EFFECT_COST + 0.5 * inexact * (gain + beside.gain) / inflation


def discrepancy(terms: Sequence[Term]) -> float:
    """Share of the explained power that a set of terms pays for the inexactness of its shapes; a description without
    physics could be the misfit of anything.
    """
    kinds = {kind_of(term) for term in terms if not is_outside(term.effect)}
    alike = max(len(terms) - max(len(kinds), 1), 0)
    # Sines of known orders leave nothing for each other: their shape is exact.
    each_alike = OTHER_KIND if all(has_exact_shape(term) for term in terms) else DISCREPANCY
    flexible = sum(flexibility(term) for term in terms)
    return max(len(kinds) - 1, 0) * OTHER_KIND + alike * each_alike + flexible * DISCREPANCY


def has_exact_shape(term: Term) -> bool:
    """Whether a term's columns are known to the last digit, so that its fit leaves nothing."""
    return getattr(EXPLANATIONS[term.effect], "exact_shape", False)


def flexibility(term: Term) -> float:
    """0 for a term of few coefficients, 1 for one that bends to the misfit of anything as a second effect would."""
    return min(max((term.width - FEW_COEFFICIENTS) / (MANY_COEFFICIENTS - FEW_COEFFICIENTS), 0.0), 1.0)


def kind_of(term: Term) -> str:
    """What a term's misfit looks like; the resonance, whose shape is the base's orders, turns."""
    return "turning" if term.effect == "resonance" else KINDS.get(EXPLANATIONS[term.effect].domain, "way")


def rank_subsets(
    probe: FitProbe,
    terms: Sequence[Term],
    inflation: float,
    most: int = MOST_EFFECTS,
    beside: Beside = NOTHING_BESIDE,
) -> list[tuple[float, float, tuple[int, ...]]]:
    """(evidence, gain, indices) of the best subsets of `terms`, at most one term an effect."""
    if not terms:
        return []
    blocks, start = [], 0
    stacked = []
    for term in terms:
        columns = probe.columns(term)
        stacked.append(columns)
        blocks.append(np.arange(start, start + columns.shape[1]))
        start += columns.shape[1]
    matrix = np.column_stack(stacked)
    gram, moment = matrix.T @ matrix, matrix.T @ probe.white_residual
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-30))
    gram, moment = gram / np.outer(scale, scale), moment / scale
    rows = float((probe.noise.root_weight > 0).sum())
    sigma2 = probe.noise.sigma**2

    def gain_of(subset: tuple[int, ...]) -> float:
        index = np.concatenate([blocks[i] for i in subset])
        part = gram[np.ix_(index, index)] + 1e-8 * np.eye(len(index))
        return float(moment[index] @ np.linalg.solve(part, moment[index])) / sigma2

    scored: dict[tuple[int, ...], float] = {(i,): gain_of((i,)) for i in range(len(terms))}
    frontier = list(scored)
    for _ in range(most - 1):
        frontier = sorted(frontier, key=lambda s: -scored[s])[:14]
        grown = {
            tuple(sorted((*subset, i)))
            for subset in frontier
            for i in range(len(terms))
            if terms[i].effect not in {terms[j].effect for j in subset}
        }
        frontier = [subset for subset in grown if subset not in scored]
        scored |= {subset: gain_of(subset) for subset in frontier}
    top_gain = max(scored.values())
    ranked = [
        (gain / inflation / 2 - price([terms[i] for i in subset], rows, top_gain, inflation, beside), gain, subset)
        for subset, gain in scored.items()
    ]
    # One entry for each set of effects: its best variant.
    ranked.sort(reverse=True)
    seen, best = set(), []
    for entry in ranked:
        names = frozenset(terms[i].effect for i in entry[2])
        if names not in seen:
            seen.add(names)
            best.append(entry)
    return best


def joint_fit(start: Fit, terms: Sequence[Term], rng: np.random.Generator | None = None) -> Fit:
    """`terms` fitted together with the base, from `start` on; with `rng` also from new random drives."""
    probe = FitProbe(replace(start, terms=(), coefficients=()), keep=())
    bare = extend(replace_terms(start, ()), terms)
    columns = np.column_stack([probe.columns(term) for term in terms])
    gram = columns.T @ columns
    target = probe.project(start.problem.noise.whiten(start.residual + start.contributions))
    solution = np.linalg.solve(gram + 1e-8 * np.trace(gram) / len(gram) * np.eye(len(gram)), columns.T @ target)
    parts, position = [], 0
    for term in terms:
        parts.append(solution[position : position + term.width])
        position += term.width
    seeded = evaluate(start.problem, start.errors, start.offsets, terms, parts)
    best = refine(min(seeded, bare, key=lambda f: f.objective), iterations=15)
    if rng is not None and start.problem.base is not None:
        other = fit_base(start.problem, rng, starts=10, terms=tuple(best.terms), near=None)
        if other.objective < best.objective * 1.02:
            other = refine(other, iterations=10)
            best = min(best, other, key=lambda f: f.objective)
    return best


def replace_terms(fit: Fit, terms: Sequence[Term]) -> Fit:
    return evaluate(fit.problem, fit.errors, fit.offsets, terms, [np.zeros(t.width) for t in terms])


def weigh(
    fit: Fit, base: Fit, inflation: float, top_gain: float | None = None, beside: Beside = NOTHING_BESIDE
) -> Candidate:
    """Evidence of a joint fit against the base alone."""
    sigma2 = fit.problem.noise.sigma**2
    gain = (base.objective - fit.objective) / sigma2
    rows = float((fit.problem.noise.root_weight > 0).sum())
    top = gain if top_gain is None else top_gain
    return Candidate(fit, gain / inflation / 2 - price(fit.terms, rows, max(top, 0.0), inflation, beside), gain)


def select(
    base: Fit,
    inflation: float,
    rng: np.random.Generator,
    skip: Sequence[str] = (),
    rounds: int = 2,
    order_range: tuple[float, float] | None = None,
    clean: Fit | None = None,
    known: Fit | None = None,
    beside: Beside = NOTHING_BESIDE,
) -> Selection:
    """The candidates that explain best, by alternating search about the best fit and joint fits of the leaders.

    `clean` is a base fitted beside smooth nuisance columns: a drive less bent towards what is missing, from which the
    search also starts. `known` is what an earlier search found: the search goes on from there; `beside` is what was
    taken out of the rows before.
    """
    if order_range is None:
        order_range = (0.0, base.problem.samples.highest_order)
    fits: dict[frozenset[str], Fit] = {}

    def explore(centre: Fit, pool: Sequence[Term], leaders: int) -> bool:
        """Joint fits of the best subsets and the best single effects about `centre`; whether any was new."""
        probe = FitProbe(centre, keep=(), order_range=order_range)
        ranked = rank_subsets(probe, pool, inflation, beside=beside)
        most = max((gain for _, gain, _ in ranked), default=0.0)
        single = [entry for entry in ranked if len(entry[2]) == 1 and entry[1] >= WORTH_A_FIT * most]
        chosen = ranked[:leaders] + single[: leaders + 4]
        sets = {}
        for _, _, subset in chosen:
            sets.setdefault(frozenset(pool[i].effect for i in subset), subset)
        new = False
        for fit in each(lambda subset: joint_fit(centre, [pool[i] for i in subset]), sets.values()):
            names = frozenset(term.effect for term in fit.terms)
            if names not in fits or fit.objective < fits[names].objective * (1 - 1e-6):
                fits[names] = fit
                new = True
        return new

    def leader() -> Candidate | None:
        top = max((weigh(f, base, inflation).gain for f in fits.values()), default=0.0)
        weighed = (weigh(f, base, inflation, top, beside) for f in fits.values())
        return max(weighed, key=lambda c: c.evidence, default=None)

    if known is not None and known.terms:
        known = refine(known, iterations=8)
        fits[frozenset(term.effect for term in known.terms)] = known
    else:
        explore(base, search_terms(FitProbe(base, order_range=order_range), skip), LEADERS)
    if clean is not None:
        explore(clean, search_terms(FitProbe(clean, order_range=order_range), skip), LEADERS)
    centre: Fit | None = None
    for _ in range(rounds):
        best = leader()
        if best is None or best.evidence <= 0 or best.fit is centre:
            break
        # A better drive may fit once the effect is there: look again from new starts, and search about what was found.
        names = frozenset(best.effects)
        centre = fits[names] = joint_fit(best.fit, best.fit.terms, rng)
        pool = list(centre.terms) + search_terms(FitProbe(centre, order_range=order_range), [*skip, *names])
        if len(names) > 1:
            for i in range(len(names)):
                keep = [j for j in range(len(names)) if j != i]
                others = [centre.terms[j].effect for j in keep]
                pool += search_terms(FitProbe(centre, keep=keep, order_range=order_range), [*skip, *others])
        else:
            pool += search_terms(FitProbe(centre, keep=(), order_range=order_range), [*skip, *names])
        if not explore(centre, pool, LEADERS):
            break
    top = max((weigh(f, base, inflation).gain for f in fits.values()), default=0.0)
    candidates = [weigh(f, base, inflation, top, beside) for f in fits.values()]
    candidates.append(Candidate(base, 0.0, 0.0))
    candidates.sort(key=lambda c: -c.evidence)
    return Selection(base, tuple(candidates), inflation)
