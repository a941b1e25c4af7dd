"""What a drive as built or its bench does, in place of effects that stood for it."""

from __future__ import annotations

from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.search.candidates import paid_for_freedom, with_only
from hdopt.diagnosis.search.search_state import SearchState


def in_place_of_others(state: SearchState, before: Fit, beside: Fit) -> SearchState:
    """The set of effects of `before` with one more `beside` it, the last of its terms: where that shows, some of the
    others may have stood for it, so that the set is looked at without each of these, one after the other, as long as
    that has more evidence. `state` is where the work stands.
    """
    if len(before.terms) < 2 or not _explains_more(state, beside, before):
        return state
    fit = beside
    while len(fit.terms) > 1:
        fewer = [with_only(fit, fit.all_but(i)) for i in range(len(fit.terms) - 1)]
        state, best = state.taking(fewer), max(fewer, key=state.log_bayes_factor)
        if state.log_bayes_factor(best) <= state.log_bayes_factor(fit):
            break
        fit = best
    return state


def _explains_more(state: SearchState, fit: Fit, before: Fit) -> bool:
    """Whether `fit` explains more than `before`, its freedom and search paid for."""
    more, less = (paid_for_freedom(state.weigh(one), state.scale) for one in (fit, before))
    return more > less
