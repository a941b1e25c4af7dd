"""Which effects explain the residual: a search over subsets, with the base refitted beside every one of them.

Every candidate's columns are whitened and freed of what the base can absorb; the drop of the sum of squares of every
subset up to three then follows from one table of inner products. Subsets are weighed by an approximate log evidence:
half the gain less half the freedom times log(rows) (Schwarz), less what the search over shapes cost and less prior
odds. The leaders are fitted jointly with the nonlinear base, and the search is repeated about the best fit until it
stands.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdopt.diagnosis.candidates import (
    MOST_EFFECTS,
    Candidate,
    joint_fit,
    rank_subsets,
    search_terms,
    weigh,
    without_each,
)
from hdopt.diagnosis.catalogue import is_outside
from hdopt.diagnosis.credible import is_credible
from hdopt.diagnosis.effect import Term
from hdopt.diagnosis.fit import Fit, evaluate, refine
from hdopt.diagnosis.parallel import each
from hdopt.diagnosis.price import NOTHING_BESIDE, Beside, flexibility, has_exact_shape
from hdopt.diagnosis.probe import FitProbe
from hdopt.diagnosis.transmission import is_driven
from hdopt.diagnosis.variants import NARROW, in_full, narrower, otherwise_credible, shortened, trimmed

LEADERS = 3
CLOSE_BEHIND = 10.0
"""Log evidence within which a rival of the best must be credible too."""
CLOSE = 0.8
"""Share of the leader's evidence from which those behind it are fitted from new drives too."""
BEHIND = 0.2
"""Share of a wildcard's evidence from which a single effect may be a half of what it explains."""
KEPT = 0.005
"""Part of the gain that parts which do not show may take with them: without them a set can be said, with them not."""
KNOWN = 5
"""Candidates from which a later search goes on."""
WORTH_A_FIT = 0.25
"""Share of the best subset's gain from which a single effect is fitted jointly too: the refitted base may favour it."""


@dataclass(frozen=True)
class Selection:
    """The base alone, the candidates in order of evidence (the base alone is among them), and single effects' gains."""

    base: Fit
    candidates: tuple[Candidate, ...]
    inflation: float

    @property
    def best(self) -> Candidate:
        return self.candidates[0]

    @property
    def leaders(self) -> list[Fit]:
        """Fits of the best candidates that have terms."""
        return [candidate.fit for candidate in self.candidates if candidate.fit.terms][:KNOWN]

    def with_best_fit(self, fit: Fit) -> Selection:
        """The same selection with its best candidate fitted otherwise."""
        return replace(self, candidates=(replace(self.best, fit=fit), *self.candidates[1:]))


def select(
    base: Fit,
    inflation: float,
    rng: np.random.Generator,
    skip: Sequence[str] = (),
    rounds: int = 2,
    order_range: tuple[float, float] | None = None,
    clean: Fit | None = None,
    known: Sequence[Fit] = (),
    beside: Beside = NOTHING_BESIDE,
) -> Selection:
    """The candidates that explain best, by alternating search about the best fit and joint fits of the leaders.

    `clean` is a base fitted beside smooth nuisance columns: a drive less bent towards what is missing, from which the
    search also starts. `known` are the leaders of an earlier search, which goes on from there; `beside` is what was
    taken out of the rows before.
    """
    if order_range is None:
        order_range = (0.0, base.problem.samples.highest_order)
    fits: dict[frozenset[str], Fit] = {}

    def explore(centre: Fit, pool: Sequence[Term], leaders: int, afresh: bool = False) -> bool:
        """Joint fits of the best subsets and the best single effects about `centre`; whether any was new. `afresh` fits
        the narrow effects, much of which a bent base can take up, from new random drives too.
        """
        probe = FitProbe(centre, keep=(), order_range=order_range)
        ranked = rank_subsets(probe, pool, inflation, beside=beside)
        shaken = behind_a_resonance(centre, pool)
        most = max((gain for _, gain, _ in ranked), default=0.0)
        single = [
            (evidence, gain, subset)
            for evidence, gain, subset in ranked
            if len(subset) == 1 and (gain >= WORTH_A_FIT * most or (afresh and has_exact_shape(pool[subset[0]])))
        ]
        chosen = ranked[:leaders] + single[: leaders + 4]
        sets = {}
        for terms in [*shaken, *([pool[i] for i in subset] for _, _, subset in chosen)]:
            sets.setdefault(frozenset(term.effect for term in terms), terms)
        new = False

        def fitted(numbered: tuple[list[Term], np.random.Generator]) -> Fit:
            terms, own_rng = numbered
            narrow = afresh and sum(term.freedom for term in terms) <= NARROW
            return joint_fit(centre, terms, own_rng if narrow else None)

        for fit in each(fitted, zip(sets.values(), rng.spawn(len(sets)), strict=True)):
            new |= take(fit)
        return new

    def behind_a_resonance(centre: Fit, pool: Sequence[Term]) -> list[list[Term]]:
        """The best sets of `pool` beside each driven term of `centre`, as the output shows them through it: alone they
        are other waves than these.
        """
        sets = []
        for i, driven in enumerate(centre.terms):
            if not is_driven(driven):
                continue
            others = [term for term in pool if term.effect != driven.effect]
            probe = FitProbe(centre, keep=[i], order_range=order_range)
            ranked = rank_subsets(
                probe, others, inflation, MOST_EFFECTS - 1, Beside((driven, *beside.terms), beside.gain)
            )
            sets += [[driven, *(others[j] for j in subset)] for _, _, subset in ranked[:LEADERS]]
        return sets

    def take(fit: Fit) -> bool:
        """Takes `fit` for its set of effects where it is the first or better; whether it did."""
        names = frozenset(term.effect for term in fit.terms)
        if names in fits and not is_better(fit, fits[names]):
            return False
        fits[names] = fit
        return True

    def is_better(fit: Fit, known: Fit, by: float = 1e-3) -> bool:
        """Of two fits of the same effects, whose variants may differ in width, whether the first has more evidence."""
        top = max(weigh(fit, base, inflation).gain, weigh(known, base, inflation).gain)
        first, second = (weigh(f, base, inflation, top, beside).evidence for f in (fit, known))
        return first > second + by

    def weigh_fit(fit: Fit) -> float:
        return weigh(fit, base, inflation, beside=beside).evidence

    def leader() -> Candidate | None:
        top = max((weigh(f, base, inflation).gain for f in fits.values()), default=0.0)
        weighed = (weigh(f, base, inflation, top, beside) for f in fits.values())
        return max(weighed, key=lambda c: c.evidence, default=None)

    for fit in each(lambda fit: refine(fit, iterations=8), known):
        fits[frozenset(term.effect for term in fit.terms)] = fit
    if not fits:
        explore(base, search_terms(FitProbe(base, order_range=order_range), skip), LEADERS, afresh=True)
    if clean is not None:
        explore(clean, search_terms(FitProbe(clean, order_range=order_range), skip), LEADERS)
    for fit in behind_a_wildcard(leader(), fits.values(), weigh_fit):
        pool = [*fit.terms, *search_terms(FitProbe(fit, order_range=order_range), [*skip, fit.terms[0].effect])]
        explore(fit, pool, LEADERS)
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
    best = leader()
    if best is not None and best.evidence > 0 and base.problem.base is not None:
        # The leader has been fitted from new drives; those close behind it, and simpler sets, may want another drive.
        # What only adds to the leader's effects shares its drive.
        others = (fit for names, fit in fits.items() if not names >= set(best.effects))
        behind = sorted(others, key=weigh_fit, reverse=True)[:LEADERS]
        behind = [fit.terms for fit in behind if weigh_fit(fit) > CLOSE * best.evidence]
        sets = [*behind, *narrower(best.fit, skip, order_range)]
        pairs = zip(sets, rng.spawn(len(sets)), strict=True)
        for fit in each(lambda pair: joint_fit(best.fit, *pair), pairs):
            take(fit)
    for names, fit in list(fits.items()):
        few = trimmed(fit)
        if few is not None and is_better(few, fit, by=-KEPT * weigh(fit, base, inflation).gain / inflation):
            fits[names] = few
    for fit in sorted(fits.values(), key=weigh_fit, reverse=True)[:LEADERS]:
        for shorter in shortened(fit, rng):
            if not take(shorter):
                break
    while (best := leader()) is not None and best.evidence > 0 and len(best.fit.terms) > 1:
        # A term that came in beside a better drive may have no part in it: without each, from where the best stands.
        for fit in without_each(best.fit):
            take(fit)
        if leader().fit is best.fit:
            break
    best = leader()
    if best is not None and best.evidence > 0:
        # Beside an effect the base may have come to a better drive: then that is the one to beat.
        alone = refine(evaluate(best.fit.problem, best.fit.errors, best.fit.offsets, (), ()), iterations=10)
        base = min(base, alone, key=lambda fit: fit.objective)
    top = max((weigh(f, base, inflation).gain for f in fits.values()), default=0.0)
    candidates = [weigh(f, base, inflation, top, beside) for f in fits.values()]
    candidates.append(Candidate(base, 0.0, 0.0))
    candidates.sort(key=lambda c: -c.evidence)
    for candidate in candidates[:LEADERS]:
        if not candidate.fit.terms or is_credible(candidate.fit):
            break
        others = otherwise_credible(candidate.fit, skip, order_range)
        candidates += [weigh(f, base, inflation, top, beside) for f in others]
    candidates.sort(key=lambda c: -c.evidence)
    candidates = first_credible(candidates)
    best = candidates[0]
    fuller = in_full(best.fit, base, inflation, order_range) if best.fit.terms else best.fit
    return Selection(base, (replace(best, fit=fuller), *candidates[1:]), inflation)


def behind_a_wildcard(leader: Candidate | None, fits: Iterable[Fit], evidence: Callable[[Fit], float]) -> list[Fit]:
    """Single effects beside which a second is looked for, where the leader bends to anything: what it explains may be
    two effects, of which each alone leaves the other.
    """
    if leader is None or leader.evidence <= 0:
        return []
    if not any(is_outside(t.effect) or t.doubtful or flexibility(t) > 0 for t in leader.fit.terms):
        return []
    single = [
        fit
        for fit in fits
        if len(fit.terms) == 1
        and fit is not leader.fit
        and not is_outside(fit.terms[0].effect)
        and evidence(fit) > BEHIND * leader.evidence
    ]
    return sorted(single, key=evidence, reverse=True)[:LEADERS]


def first_credible(candidates: list[Candidate]) -> list[Candidate]:
    """`candidates` in order of evidence, without those that may not be said, as far as they lead or come close."""
    credible: list[Candidate] = []
    for candidate in candidates:
        close = not credible or credible[0].evidence - candidate.evidence < CLOSE_BEHIND
        if not close or not candidate.fit.terms or is_credible(candidate.fit):
            credible.append(candidate)
    return credible
