"""Other variants of a fit's effects: without what does not show, shorter, wider, plain, or one that may be said."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from hdopt.diagnosis.candidates import joint_fit, search_terms, weigh
from hdopt.diagnosis.catalogue import EXPLANATIONS
from hdopt.diagnosis.credible import is_credible
from hdopt.diagnosis.effect import Term
from hdopt.diagnosis.fit import Fit
from hdopt.diagnosis.price import kind_of
from hdopt.diagnosis.probe import FitProbe

TIE_OF_VARIANTS = 10.0
"""Log evidence by which a wider variant of an effect must be better."""
NARROW = 4
"""Coefficients and shapes up to which a term is plain: sets of such terms are also fitted from new random drives."""
MOST_PLAIN = 3
"""Plain terms that are tried in place of a wide one."""


def trimmed(fit: Fit) -> Fit | None:
    """`fit` without the parts of its terms that do not show; None where all do."""
    terms = []
    for term, coefficients in zip(fit.terms, fit.coefficients, strict=True):
        effect = EXPLANATIONS[term.effect]
        shape = effect.trimmed(term, coefficients) if hasattr(effect, "trimmed") else None
        terms.append(term if shape is None else effect.term(fit.problem.samples, shape, fit.motion))
    if all(new is old for new, old in zip(terms, fit.terms, strict=True)):
        return None
    return joint_fit(fit, terms)


def shortened(fit: Fit, rng: np.random.Generator) -> Iterator[Fit]:
    """`fit` with less and less of a term that bends to much, each from where the one before stands and from new drives:
    what it bent to may have been another drive.
    """
    for i, term in enumerate(fit.terms):
        effect, shorter = EXPLANATIONS[term.effect], fit
        for shape in effect.shortened(term) if hasattr(effect, "shortened") else ():
            less = effect.term(fit.problem.samples, shape, fit.motion)
            shorter = joint_fit(shorter, [less if j == i else t for j, t in enumerate(shorter.terms)], rng)
            yield shorter


def otherwise_credible(fit: Fit, skip: Sequence[str], order_range: tuple[float, float]) -> list[Fit]:
    """The effects of `fit` in other variants of one of them, where these may be said and `fit` may not."""
    found = []
    for i, term in enumerate(fit.terms):
        others = [fit.terms[j] for j in fit.all_but(i)]
        probe = FitProbe(fit, keep=fit.all_but(i), order_range=order_range)
        for variant in search_terms(probe, skip, only=[term.effect]):
            if variant.width != term.width or variant.shape.keys() != term.shape.keys():
                found.append(joint_fit(fit, [*others, variant]))
    return [fit for fit in found if is_credible(fit)]


def in_full(fit: Fit, base: Fit, inflation: float, order_range: tuple[float, float]) -> Fit:
    """`fit`, or the same effects in wider variants where these pay for their coefficients: what a name has to pay for
    bending to anything, it need not pay any more once it stands.
    """
    rows = float((fit.problem.noise.root_weight > 0).sum())

    def paid(candidate: Fit) -> float:
        freedom = sum(term.freedom for term in candidate.terms)
        trials = sum(math.log(max(term.trials, 1.0)) for term in candidate.terms)
        return weigh(candidate, base, inflation).gain / inflation / 2 - 0.5 * freedom * math.log(rows) - trials

    for i, term in enumerate(fit.terms):
        probe = FitProbe(fit, keep=fit.all_but(i), order_range=order_range)
        wider = [t for t in search_terms(probe, only=[term.effect]) if t.width > term.width]
        for other in wider:
            candidate = joint_fit(fit, [other if j == i else t for j, t in enumerate(fit.terms)])
            if paid(candidate) > paid(fit) + TIE_OF_VARIANTS and is_credible(candidate):
                fit = candidate
    return fit


def narrower(fit: Fit, skip: Sequence[str], order_range: tuple[float, float]) -> list[list[Term]]:
    """Sets in which a plain term takes the place of a wide one of `fit`: about a base that is bent to the wide one it
    looks worse than it is.
    """
    sets = []
    for i, term in enumerate(fit.terms):
        if term.width <= NARROW or kind_of(term) != "turning":
            continue
        others = [fit.terms[j] for j in fit.all_but(i)]
        probe = FitProbe(fit, keep=fit.all_but(i), order_range=order_range)
        found = search_terms(probe, [*skip, *(t.effect for t in fit.terms)])
        plain = [t for t in found if t.width <= NARROW and kind_of(t) == "turning" and not t.doubtful]
        sets += [[*others, t] for t in sorted(plain, key=probe.gain, reverse=True)[:MOST_PLAIN]]
    return sets
