"""Other variants of a fit's effects: without what does not show, shorter, wider, plain, or one that is acceptable."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.search.acceptance import is_acceptable
from hdopt.diagnosis.search.candidates import joint_fit, penalty_scale, search_terms, weigh, without_each
from hdopt.diagnosis.search.penalty import kind_of
from hdopt.effects.term import Term


def trimmed(fit: Fit) -> Fit | None:
    """`fit` without the parts of its terms that do not show; None where all do."""
    terms = []
    for term, coefficients in zip(fit.terms, fit.coefficients, strict=True):
        effect = fit.problem.explanations[term.effect]
        shape = effect.trimmed(term, coefficients)
        terms.append(term if shape is None else effect.term(fit.problem.rows, shape, fit.motion))
    if all(new is old for new, old in zip(terms, fit.terms, strict=True)):
        return None
    return joint_fit(fit, terms)


def shortened(fit: Fit, rng: np.random.Generator) -> Iterator[Fit]:
    """`fit` with less and less of a term that bends to much, each from where the one before stands and from new drives
    of `rng`: what it bent to may have been another drive.
    """
    for i, term in enumerate(fit.terms):
        effect, shorter = fit.problem.explanations[term.effect], fit
        for shape in effect.shortened(term):
            less = effect.term(fit.problem.rows, shape, fit.motion)
            shorter = joint_fit(shorter, [less if j == i else t for j, t in enumerate(shorter.terms)], rng)
            yield shorter


def otherwise_acceptable(fit: Fit, skip: Sequence[str], order_range: tuple[float, float]) -> list[Fit]:
    """The effects of `fit` in other variants of one of them that are acceptable where `fit` is not: all effects but
    those of `skip`, at orders in `order_range`.
    """
    found = []
    for i, term in enumerate(fit.terms):
        others = [fit.terms[j] for j in fit.all_but(i)]
        probe = FitProbe(fit, keep=fit.all_but(i), order_range=order_range)
        for variant in search_terms(probe, skip, only=[term.effect]):
            if is_of_another_kind(variant, term):
                found.append(joint_fit(fit, [*others, variant]))
    return [fit for fit in found if is_acceptable(fit)]


def is_of_another_kind(variant: Term, term: Term) -> bool:
    """Whether a `variant` of the effect of `term` differs from it by more than numbers: in width, in what describes it,
    or in a category, as the shaft of an encoder or what moves the foot of a spring.
    """

    def kind(one: Term) -> tuple[object, ...]:
        return one.width, *(
            (name, value if isinstance(value, str) else "") for name, value in sorted(one.shape.items())
        )

    return kind(variant) != kind(term)


def widened_where_it_pays(fit: Fit, base: Fit, inflation: float, order_range: tuple[float, float]) -> Fit:
    """`fit`, or the same effects in wider variants where these pay for their coefficients against the `base` in noise
    rougher by `inflation`, at orders in `order_range`: what a name has to pay for bending to anything, it need not pay
    any more once it stands. What a wider variant took over from other effects is left out.
    """
    narrow, settings = fit, fit.problem.settings.search
    for i, term in enumerate(fit.terms):
        probe = FitProbe(fit, keep=fit.all_but(i), order_range=order_range)
        wider = [t for t in search_terms(probe, only=[term.effect]) if t.width > term.width]
        for other in wider:
            candidate = joint_fit(fit, [other if j == i else t for j, t in enumerate(fit.terms)])
            more = for_freedom_alone(candidate, base, inflation) - for_freedom_alone(fit, base, inflation)
            if more > settings.tie_of_variants and is_acceptable(candidate):
                fit = candidate
    return fit if fit is narrow else without_idle_terms(fit, base, inflation)


def without_idle_terms(fit: Fit, base: Fit, inflation: float) -> Fit:
    """`fit` without those of its terms that do not pay for their own coefficients against the `base` in noise rougher
    by `inflation`.
    """
    while len(fit.terms) > 1:
        fewer = max(without_each(fit), key=lambda one: for_freedom_alone(one, base, inflation))
        if for_freedom_alone(fewer, base, inflation) < for_freedom_alone(fit, base, inflation):
            break
        fit = fewer
    return fit


def for_freedom_alone(fit: Fit, base: Fit, inflation: float) -> float:
    """Log evidence of `fit` against the `base`, in noise rougher by `inflation`, that pays for its coefficients and
    trials alone.
    """
    scale = penalty_scale(fit.problem, inflation)
    freedom = sum(term.freedom for term in fit.terms)
    trials = sum(math.log(max(term.trials, 1.0)) for term in fit.terms)
    return weigh(fit, base, scale).gain / inflation / 2 - freedom * math.log(scale.rows) / 2 - trials


def with_a_plain_term(fit: Fit, skip: Sequence[str], order_range: tuple[float, float]) -> list[list[Term]]:
    """Sets in which a plain term takes the place of a wide one of `fit`, of all effects but those of `skip` and at
    orders in `order_range`: about a base that is bent to the wide one it looks worse than it is.
    """
    settings = fit.problem.settings.search
    sets = []
    for i, term in enumerate(fit.terms):
        if term.width <= settings.narrow or kind_of(term) != "turning":
            continue
        others = [fit.terms[j] for j in fit.all_but(i)]
        probe = FitProbe(fit, keep=fit.all_but(i), order_range=order_range)
        found = search_terms(probe, [*skip, *(t.effect for t in fit.terms)])
        plain = [t for t in found if t.width <= settings.narrow and kind_of(t) == "turning" and not t.doubtful]
        sets += [[*others, t] for t in sorted(plain, key=probe.gain, reverse=True)[: settings.most_plain]]
    return sets
