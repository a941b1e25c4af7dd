"""One look about a fit: the best subsets of a pool of terms, each fitted jointly with the base."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from hdopt.diagnosis.inference.base_excitation import is_driven
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.search.candidates import RankedSubset, joint_fit, penalty_scale, rank_subsets, search_terms
from hdopt.diagnosis.search.penalty import Scale, SubtractedTerms, has_exact_shape
from hdopt.diagnosis.search.search_state import SearchState
from hdopt.effects.term import Term
from hdopt.parallel.shared_memory import each


def explore(
    state: SearchState, centre: Fit, pool: Sequence[Term], afresh: bool = False, scale: Scale | None = None
) -> SearchState:
    """The state with joint fits of the best subsets of `pool` and the best single effects about `centre`; the same
    object where none was new. `afresh` fits the narrow effects, much of which a bent base can take up, from new random
    drives too; `scale` is what penalties are measured by (None: as set).
    """
    sets = _worth_a_fit(state, centre, pool, afresh, scale or state.scale)

    def fitted(numbered: tuple[list[Term], np.random.Generator]) -> Fit:
        terms, own_rng = numbered
        narrow = afresh and sum(term.freedom for term in terms) <= state.settings.narrow
        return joint_fit(centre, terms, own_rng if narrow else None)

    return state.taking(each(fitted, zip(sets, state.rng.spawn(len(sets)), strict=True)))


def _worth_a_fit(state: SearchState, centre: Fit, pool: Sequence[Term], afresh: bool, scale: Scale) -> list[list[Term]]:
    """The sets of terms that are fitted jointly, each set of effects once."""
    settings = state.settings
    ranked = rank_subsets(state.probe(centre, keep=()), pool, scale)
    most = max((subset.gain for subset in ranked), default=0.0)

    def single(subset: RankedSubset) -> bool:
        alone = len(subset.indices) == 1
        exact = alone and afresh and has_exact_shape(pool[subset.indices[0]])
        return alone and (subset.gain >= settings.worth_a_fit * most or exact)

    singles = [subset for subset in ranked if single(subset)]
    # What swings is acceptable with the numbers of what swings alone, which only its fit shows.
    still = [subset for subset in ranked if not any(is_driven(pool[i]) for i in subset.indices)]
    chosen = ranked[: settings.leaders] + still[: settings.leaders]
    chosen += singles[: settings.leaders + settings.more_singles]
    sets: dict[frozenset[str], list[Term]] = {}
    for terms in [*behind_a_resonance(state, centre, pool), *([pool[i] for i in s.indices] for s in chosen)]:
        sets.setdefault(frozenset(term.effect for term in terms), terms)
    return list(sets.values())


def pool_among(state: SearchState, centre: Fit, stays: Callable[[Term], bool]) -> list[Term]:
    """The terms of `centre` that may stay (`stays`), and those that may of what is found beside all of these, and in
    place of each. `state` is where the work stands.
    """
    kept = [i for i, term in enumerate(centre.terms) if stays(term)]
    pool = [centre.terms[i] for i in kept]
    for beside in (kept, *([j for j in kept if j != i] for i in kept)):
        skip = [*state.plan.skip, *(centre.terms[i].effect for i in beside)]
        pool += [term for term in search_terms(state.probe(centre, keep=beside), skip) if stays(term)]
    return pool


def behind_a_resonance(state: SearchState, centre: Fit, pool: Sequence[Term]) -> list[list[Term]]:
    """The best sets of `pool` beside each driven term of `centre`, as the output shows them through it: alone they
    are other waves than these. `state` is where the work stands.
    """
    sets = []
    subtracted = state.plan.subtracted
    for i, driven in enumerate(centre.terms):
        if not is_driven(driven):
            continue
        others = [term for term in pool if term.effect != driven.effect]
        beside = SubtractedTerms((driven, *subtracted.terms), subtracted.gain)
        scale = penalty_scale(centre.problem, state.inflation, beside)
        ranked = rank_subsets(state.probe(centre, keep=[i]), others, scale, state.settings.most_effects - 1)
        sets += [[driven, *(others[j] for j in s.indices)] for s in ranked[: state.settings.leaders]]
    return sets
