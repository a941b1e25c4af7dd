"""Plain effects in place of a few waves.

Half a dozen waves of the teeth take up two effects that turn with the drive, lobes and an eccentric code wheel, and
leave little of either. As one effect they do not pay for being alike, as two do, and about a drive that was fitted
beside them each of the two alone explains little. So sets of plain effects are searched among themselves, and weighed
there by their freedom alone; which set is the better one all candidates say together (`fewest_first`).
"""

from __future__ import annotations

import copy
from dataclasses import replace

from hdopt.diagnosis.inference.catalogue import is_outside
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.search.candidates import joint_fit, paid_for_freedom
from hdopt.diagnosis.search.explore import explore, pool_among
from hdopt.diagnosis.search.penalty import kind_of
from hdopt.diagnosis.search.search_state import SearchState
from hdopt.effects.term import Term


def plain_for_waves(state: SearchState) -> SearchState:
    """`state` with the best sets of plain terms, where the leader, one of physics, has one that is not plain: about the
    leader's drive, then about the best of these sets as long as another comes. The draws are its own, so that a search
    in which nothing comes of it goes on as without it.
    """
    leader, narrow = state.leader, state.settings.narrow
    if leader is None or leader.outside or all_plain(leader.fit, narrow):
        return state
    plain = {names: fit for names, fit in state.fits.items() if all_plain(fit, narrow)}
    own = about(replace(state, rng=copy.deepcopy(state.rng), fits=plain), leader.fit)
    if state.plan.clean is not None:
        own = about(own, state.plan.clean)
    centre: Fit | None = None
    for _ in range(state.settings.rounds):
        best = max(own.fits.values(), key=lambda fit: paid_for_freedom(own.weigh(fit), own.scale), default=None)
        if best is None or best is centre:
            break
        centre = joint_fit(best, best.terms, own.rng)
        own = about(own.taking([centre]), centre)
    return state.taking(list(own.fits.values()))


def about(state: SearchState, centre: Fit) -> SearchState:
    """`state` with the best sets of plain terms about `centre`, its own among them, by what they pay for their freedom:
    of what is seen in place of its other terms, beside its plain ones, and in place of each of these.
    """
    narrow = state.settings.narrow
    exact = replace(state.scale.settings, discrepancy=0.0, other_kind=0.0)
    pool = pool_among(state, centre, lambda term: is_plain_term(term, narrow))
    return explore(state, centre, pool, scale=replace(state.scale, settings=exact))


def all_plain(fit: Fit, narrow: int) -> bool:
    """Whether all terms of `fit` are plain; `narrow` as for `is_plain_term`."""
    return all(is_plain_term(term, narrow) for term in fit.terms)


def is_plain_term(term: Term, narrow: int) -> bool:
    """Whether `term` is physics, and where it turns with the drive has no more than `narrow` coefficients."""
    return not is_outside(term.effect) and (kind_of(term) != "turning" or term.width <= narrow)
