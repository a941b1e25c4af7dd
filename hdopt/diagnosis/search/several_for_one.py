"""Several effects that bend to little, in place of one that bends to anything.

Many waves of the teeth take up whatever repeats with the angle, a damaged tooth or an encoder's lines as well: beside
them nothing is left to be found, and in their place no single effect explains as much. Of several that do together,
each is seen at its true shape only beside the others. So such sets are searched among themselves, apart from the sets
that bend.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import replace

from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.search.acceptance import is_acceptable
from hdopt.diagnosis.search.candidates import Candidate, from_new_drives, in_order, joint_fit, paid_for_freedom
from hdopt.diagnosis.search.explore import explore, pool_among
from hdopt.diagnosis.search.penalty import bends, discrepancy, doubtful_among, leaves_nothing
from hdopt.diagnosis.search.search_state import SearchState
from hdopt.effects import HIGH_ORDER


def several_for_one(state: SearchState) -> SearchState:
    """The best sets without a term that bends, where the leader, one of physics, has such a term: searched about the
    leader's drive without those terms, then about the best of these sets as long as another comes. `state` is where the
    work stands; the draws are its own, so that a search in which nothing comes of it goes on as without it.
    """
    leader = state.leader
    if leader is None or leader.outside or not has_bending(leader.fit):
        return state
    plain = {names: fit for names, fit in state.fits.items() if not has_bending(fit)}
    own = about(replace(state, rng=copy.deepcopy(state.rng), fits=plain), leader.fit)
    centre: Fit | None = None
    for _ in range(state.settings.rounds):
        best = own.leader
        if best is None or best.fit is centre:
            break
        own = with_teeth_in_the_zones(own.taking([joint_fit(best.fit, best.fit.terms, own.rng)]))
        best = own.leader
        if best is None:
            break
        centre = best.fit
        own = about(own, centre)
    return state.taking(list(own.fits.values()))


def has_bending(fit: Fit) -> bool:
    """Whether a term of `fit` may take up whatever is not its own."""
    return any(bends(term, fit.problem.settings.penalty) for term in fit.terms)


def about(state: SearchState, centre: Fit) -> SearchState:
    """`state` with the best sets of terms that do not bend, those of `centre` among them: of what is seen in place of
    its terms that bend, beside the others, and in place of each of the others.
    """
    penalties = centre.problem.settings.penalty
    return explore(state, centre, pool_among(state, centre, lambda term: not bends(term, penalties)))


def several_first(state: SearchState, candidates: list[Candidate]) -> list[Candidate]:
    """`candidates` in order of evidence, where the first, one of physics, has a term that bends to anything: the best
    set that does not, and leaves little more than noise, pays neither for several that are alike nor for lines that
    could be the teeth's against it. What a slightly wrong shape of one of them leaves is not taken up by the others,
    but by what bends. `state` is where the work stands.
    """
    first, scale = candidates[0], state.scale
    if first.outside or not has_bending(first.fit):
        return candidates
    stiff = (candidate for candidate in candidates if candidate.fit.terms and not has_bending(candidate.fit))
    best = next((candidate for candidate in stiff if is_acceptable(candidate.fit)), None)
    if best is None or state.above_noise(best.fit) > state.settings.begun * scale.rows:
        return candidates
    share = discrepancy(best.fit.terms, scale.settings)
    share += scale.settings.clear_win * doubtful_among(best.fit.terms)
    freed = best.log_bayes_factor + share * state.top_gain / state.inflation / 2
    if first.log_bayes_factor > freed:
        return candidates
    return with_evidence(candidates, best, freed)


def fewest_first(state: SearchState, candidates: list[Candidate]) -> list[Candidate]:
    """`candidates` in order of evidence, but first a set that explains more than the first with no more coefficients,
    clearly so: it does not pay for being alike, or of two kinds, since nothing of it can stand for what an inexact
    shape of the first leaves. The same effects in fewer coefficients, and sines of known orders, pay as of another
    kind: what fewer waves leave is taken up by more of them or by a pulse, not by such sines. Each of its effects must
    pay for its freedom. `state` is where the work stands.
    """
    first, scale = candidates[0], state.scale

    def freedom(candidate: Candidate) -> float:
        return sum(term.freedom for term in candidate.fit.terms)

    def paid(candidate: Candidate) -> float:
        return paid_for_freedom(candidate, scale)

    def has_all(candidate: Candidate) -> bool:
        return set(first.effects) <= set(candidate.effects)

    def ahead(candidate: Candidate) -> float:
        share = scale.settings.other_kind if has_all(candidate) else 0.0
        return paid(candidate) - paid(first) - share * state.top_gain / state.inflation / 2

    def is_other(candidate: Candidate) -> bool:
        beside = (term for term in candidate.fit.terms if term.effect not in first.effects)
        return not has_all(candidate) or all(leaves_nothing(term) for term in beside)

    def pays(candidate: Candidate) -> bool:
        parts = (c for c in candidates if set(c.effects) < set(candidate.effects))
        return all(paid(candidate) > paid(part) for part in parts)

    found = [
        candidate
        for candidate in candidates[1:]
        if not candidate.outside
        and freedom(candidate) <= freedom(first)
        and ahead(candidate) > state.settings.clearly
        and is_other(candidate)
        and pays(candidate)
        and is_acceptable(candidate.fit)
    ]
    if first.outside or not found:
        return candidates
    best = max(found, key=ahead)
    return with_evidence(candidates, best, first.log_bayes_factor + ahead(best))


def with_evidence(candidates: Sequence[Candidate], one: Candidate, log_bayes_factor: float) -> list[Candidate]:
    """`candidates` in order of evidence, where `one` of them has another `log_bayes_factor`."""
    others = (candidate for candidate in candidates if candidate is not one)
    return in_order([replace(one, log_bayes_factor=log_bayes_factor), *others])


def with_teeth_in_the_zones(state: SearchState) -> SearchState:
    """`state` with its leader's terms that stand beside the drive's motion tried inside the meshing zones, from new
    drives: a tooth much too high takes the load from the other zone, which no look beside a drive without it shows.
    What stands at high orders has a search of its own there.
    """
    leader = state.leader
    if leader is None or state.base.problem.base is None:
        return state
    fit, rows, penalties = leader.fit, state.base.problem.rows, state.base.problem.settings.penalty
    sets = []
    for i, term in enumerate(fit.terms):
        if term.effect in HIGH_ORDER:
            continue
        effect = fit.problem.explanations[term.effect]
        moved = (effect.term(rows, shape, fit.motion) for shape in effect.in_zones(term.shape))
        sets += [[*fit.terms[:i], one, *fit.terms[i + 1 :]] for one in moved if not bends(one, penalties)]
    return state.taking(from_new_drives(fit, sets, copy.deepcopy(state.rng)))
