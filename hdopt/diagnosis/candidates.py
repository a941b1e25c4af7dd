"""Candidate sets of effects: searched, ranked from one table of inner products, fitted with the base, and weighed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdopt.diagnosis.base import fit_base
from hdopt.diagnosis.catalogue import EXPLANATIONS, is_outside
from hdopt.diagnosis.effect import Term
from hdopt.diagnosis.fit import Fit, evaluate, extend, refine
from hdopt.diagnosis.parallel import each
from hdopt.diagnosis.price import NOTHING_BESIDE, Beside, price
from hdopt.diagnosis.probe import FitProbe

MOST_EFFECTS = 3


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


def without_each(fit: Fit) -> list[Fit]:
    """`fit` without each of its terms in turn, the others refitted from where they stand."""
    fits = []
    for left_out in range(len(fit.terms)):
        keep = fit.all_but(left_out)
        terms, parts = [fit.terms[i] for i in keep], [fit.coefficients[i] for i in keep]
        fits.append(refine(evaluate(fit.problem, fit.errors, fit.offsets, terms, parts), iterations=10))
    return fits
