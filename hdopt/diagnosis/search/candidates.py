"""Candidate sets of effects: searched, ranked from one table of inner products, fitted with the base, and weighed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdopt.diagnosis.inference.base_fit import fit_base, is_far
from hdopt.diagnosis.inference.catalogue import is_outside
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import Fit, FitProblem, evaluate, extend, with_terms
from hdopt.diagnosis.inference.normal_equations import gains_of_subsets, solved
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.numerical import SMALL_RIDGE, TINY
from hdopt.diagnosis.search.penalty import NOTHING_SUBTRACTED, Scale, SubtractedTerms, of_far_base, penalty
from hdopt.effects.term import Term
from hdopt.parallel.shared_memory import each


@dataclass(frozen=True)
class Candidate:
    """A set of terms: its joint `fit`, its `log_bayes_factor` against the base alone (by Schwarz's approximation, less
    what the set pays), and its `gain`, the drop of the sum of squares in noise variances.
    """

    fit: Fit
    log_bayes_factor: float
    gain: float

    @property
    def effects(self) -> tuple[str, ...]:
        """Ids of the terms, in the fit's order."""
        return tuple(term.effect for term in self.fit.terms)

    @property
    def outside(self) -> bool:
        """Whether a description without physics takes part."""
        return any(is_outside(name) for name in self.effects)


def in_order(candidates: Iterable[Candidate]) -> list[Candidate]:
    """`candidates` in order of evidence, the best first."""
    return sorted(candidates, key=lambda candidate: -candidate.log_bayes_factor)


def paid_for_freedom(candidate: Candidate, scale: Scale) -> float:
    """Log evidence of a `candidate` that pays for its freedom and its search by `scale`, and not for inexact shapes."""
    return candidate.gain / scale.inflation / 2 - penalty(candidate.fit.terms, 0.0, scale)


@dataclass(frozen=True)
class RankedSubset:
    """A subset of terms by their `indices`, its log Bayes factor and its gain in one linear step."""

    log_bayes_factor: float
    gain: float
    indices: tuple[int, ...]


def penalty_scale(
    problem: FitProblem, inflation: float = 1.0, subtracted: SubtractedTerms = NOTHING_SUBTRACTED
) -> Scale:
    """What penalties on the rows of `problem` are measured by: its weighed rows, noise rougher by `inflation`, and what
    was `subtracted` from the rows before.
    """
    return Scale(problem.weighed_rows, inflation, subtracted, problem.settings.penalty)


def search_terms(probe: FitProbe, skip: Sequence[str] = (), only: Sequence[str] | None = None) -> list[Term]:
    """Every effect's best terms for the residual of `probe`: of all but those to `skip` and those that are asked for
    aside, or of `only` these.
    """
    base = probe.fit.problem.base
    effects = [
        effect
        for effect in probe.fit.problem.explanations.values()
        if effect.id not in skip
        and (not effect.aside if only is None else effect.id in only)
        and not (effect.needs_base and base is None)
        and effect.lacks(probe.samples) is None
    ]
    return [term for found in each(lambda effect: effect.search(probe), effects) for term in found]


def rank_subsets(probe: FitProbe, terms: Sequence[Term], scale: Scale, most: int | None = None) -> list[RankedSubset]:
    """The best subsets of `terms`, at most one term an effect and `most` effects (None: as set), the best first.
    `probe` looks at what is to be explained. `scale` is what penalties are measured by.
    """
    if not terms:
        return []
    settings = probe.fit.problem.settings.search
    gains_of = _SubsetGains(probe, terms)
    scored = gains_of([(i,) for i in range(len(terms))])
    frontier = list(scored)
    for _ in range((settings.most_effects if most is None else most) - 1):
        frontier = sorted(frontier, key=lambda s: -scored[s])[: settings.frontier]
        grown = {
            tuple(sorted((*subset, i)))
            for subset in frontier
            for i in range(len(terms))
            if terms[i].effect not in {terms[j].effect for j in subset}
        }
        frontier = [subset for subset in grown if subset not in scored]
        scored |= gains_of(frontier)
    top_gain = max(scored.values())
    ranked = [
        (gain / scale.inflation / 2 - penalty([terms[i] for i in subset], top_gain, scale), gain, subset)
        for subset, gain in scored.items()
    ]
    # One entry for each set of effects: its best variant.
    ranked.sort(reverse=True)
    best: dict[frozenset[str], RankedSubset] = {}
    for log_bayes_factor, gain, subset in ranked:
        best.setdefault(frozenset(terms[i].effect for i in subset), RankedSubset(log_bayes_factor, gain, subset))
    return list(best.values())


class _SubsetGains:
    """Gains, in noise variances, of any subsets of terms from one table of inner products."""

    def __init__(self, probe: FitProbe, terms: Sequence[Term]):
        self.ends = np.cumsum([0, *(term.width for term in terms)])
        matrix = probe.columns(*terms)
        gram, moment = matrix.T @ matrix, matrix.T @ probe.white_residual
        scale = np.sqrt(np.maximum(np.diag(gram), TINY))
        self.gram, self.moment = gram / np.outer(scale, scale), moment / scale
        self.variance = probe.noise.sigma**2

    def __call__(self, subsets: Sequence[tuple[int, ...]]) -> dict[tuple[int, ...], float]:
        if not subsets:
            return {}
        most = max(len(subset) for subset in subsets)
        table = np.array([subset + (-1,) * (most - len(subset)) for subset in subsets])
        gains = gains_of_subsets(self.gram, self.moment, self.ends, table) / self.variance
        return dict(zip(subsets, gains.tolist(), strict=True))


def joint_fit(start: Fit, terms: Sequence[Term], rng: np.random.Generator | None = None) -> Fit:
    """`terms` fitted together with the base, from `start` on; with `rng` also from new random drives."""
    probe = FitProbe(replace(start, terms=(), coefficients=()), keep=())
    bare = extend(replace_terms(start, ()), terms)
    columns = probe.columns(*terms)
    gram = columns.T @ columns
    target = probe.project(start.problem.noise.whiten(start.residual + start.contributions))
    # A tooth in a zone that never drives moves nothing, and takes no coefficient.
    ridge = (SMALL_RIDGE * np.trace(gram) / len(gram) + TINY) * np.eye(len(gram))
    solution = solved(gram + ridge, columns.T @ target)
    parts, position = [], 0
    for term in terms:
        parts.append(solution[position : position + term.width])
        position += term.width
    seeded = evaluate(start.problem, start.errors, start.offsets, terms, parts)
    settings = start.problem.settings
    best = refine(min(seeded, bare, key=lambda f: f.objective), settings.fit.joint_iterations)
    if rng is not None and start.problem.base is not None:
        other = fit_base(start.problem, rng, settings.base.starts_joint, terms=tuple(best.terms), near=None)
        if other.objective < best.objective * settings.base.joint_within:
            other = refine(other, settings.fit.again_iterations)
            best = min(best, other, key=lambda f: f.objective)
    return best


def from_new_drives(start: Fit, sets: Sequence[Sequence[Term]], rng: np.random.Generator) -> list[Fit]:
    """Each of the `sets` of terms fitted together with the base, from `start` on and from new random drives, each set
    with a stream of its own that `rng` spawns.
    """
    return each(lambda numbered: joint_fit(start, *numbered), zip(sets, rng.spawn(len(sets)), strict=True))


def replace_terms(fit: Fit, terms: Sequence[Term]) -> Fit:
    """`fit` with `terms` in place of its own, at coefficients of zero."""
    return evaluate(fit.problem, fit.errors, fit.offsets, terms, [np.zeros(t.width) for t in terms])


def weigh(fit: Fit, base: Fit, scale: Scale, top_gain: float | None = None, far_pays: bool = True) -> Candidate:
    """Log Bayes factor of a joint `fit` against the `base` alone, where the best explanation gains `top_gain` noise
    variances (None: this one). `scale` is what penalties are measured by; `far_pays`: whether a drive far outside its
    tolerances does.
    """
    gain = (base.objective - fit.objective) / fit.problem.noise.sigma**2
    top = max(gain if top_gain is None else top_gain, 0.0)
    cost = penalty(fit.terms, top, scale)
    if far_pays and fit.terms and is_far(fit).any():
        cost += of_far_base(top, scale)
    return Candidate(fit, gain / scale.inflation / 2 - cost, gain)


def without_each(fit: Fit) -> list[Fit]:
    """`fit` without each of its terms in turn, the others refitted from where they stand."""
    return [with_only(fit, fit.all_but(left_out)) for left_out in range(len(fit.terms))]


def with_only(fit: Fit, keep: Sequence[int]) -> Fit:
    """`fit` with the terms numbered in `keep` alone, refitted from where they stand."""
    return refine(with_terms(fit, keep), fit.problem.settings.fit.again_iterations)
