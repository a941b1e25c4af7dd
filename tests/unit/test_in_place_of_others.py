"""A k_e that varies, or another thing that is told, in place of effects that stood for it."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from hdopt.diagnosis.search import in_place_of_others as module
from hdopt.diagnosis.search import subset_search
from hdopt.diagnosis.search.in_place_of_others import in_place_of_others
from tests.unit.test_search_decisions import PROBLEM, Effect, Told, of, state_of, weighed

__all__ = ["weighed"]
TOLD = "_varying_contact"
EVIDENCE = {
    (TOLD, "a", "b", "c"): 5.0,
    (TOLD, "a", "b"): 7.0,
    (TOLD, "a", "c"): 6.0,
    (TOLD, "b", "c"): 1.0,
    (TOLD, "a"): 30.0,
    (TOLD, "b"): 2.0,
    (TOLD,): 3.0,
}
"""Log Bayes factor of each set; that of a, b and c without what is told is 20."""


def set_of(names):
    return of(EVIDENCE[tuple(sorted(names))], *sorted(names, key=lambda name: (name == TOLD, name)))


@pytest.fixture(autouse=True)
def dropped(monkeypatch):
    """Fits of fewer terms have the evidence that was written down; what is explained beyond freedom is a fit's gain."""

    def with_only(fit, keep):
        return set_of({fit.terms[i].effect for i in keep})

    monkeypatch.setattr(module, "with_only", with_only)
    monkeypatch.setattr(module, "paid_for_freedom", lambda candidate, scale: candidate.fit.gain)


def sets_of(state):
    return {tuple(sorted(names)) for names in state.fits}


def test_effects_are_left_out_one_by_one_as_long_as_that_is_better():
    """a, b and c beside what is told, then without c, then without b: there it stays, since a alone carries it. Faults
    caught: one effect left out and no more; what is told left out itself; the worse of two taken."""
    before = of(20.0, "a", "b", "c", gain=1.0)
    beside = Told(5.0, (Effect("a"), Effect("b"), Effect("c"), Effect(TOLD)), gain=2.0)
    state = in_place_of_others(state_of(before), before, beside)
    assert sets_of(state) >= {(TOLD, "a"), (TOLD, "a", "b"), (TOLD, "a", "c"), (TOLD, "b", "c"), (TOLD,)}
    assert [term.effect for term in state.leader.fit.terms] == ["a", TOLD]


def test_where_each_is_missed_no_more_are_left_out():
    """Fault caught: three effects left out one after the other though each carries its part."""
    before = of(20.0, "a", "b", "c", gain=1.0)
    beside = Told(50.0, (Effect("a"), Effect("b"), Effect("c"), Effect(TOLD)), gain=2.0)
    state = in_place_of_others(state_of(before), before, beside)
    assert sets_of(state) == {("a", "b", "c"), (TOLD, "a", "b"), (TOLD, "a", "c"), (TOLD, "b", "c")}


def test_what_does_not_show_beside_them_is_not_tried_in_their_place():
    """Faults caught: three more fits for each thing that is told, in every search; a lone effect left out, as a look
    about the base alone does."""
    before = of(20.0, "a", "b", "c", gain=2.0)
    state = state_of(before)
    assert in_place_of_others(state, before, of(5.0, "a", "b", "c", TOLD, gain=2.0)) is state
    lone = of(20.0, "a", gain=1.0)
    assert in_place_of_others(state, lone, of(30.0, "a", TOLD, gain=2.0)) is state


def test_a_search_tries_what_is_told_in_place_of_its_leaders_effects(monkeypatch):
    """Fault caught: it is looked for in place of the whole leader and beside it alone."""
    problem = SimpleNamespace(**vars(PROBLEM) | {"explanations": {TOLD: SimpleNamespace(id=TOLD, aside=True)}})
    base = Told(0.0, problem=problem)
    monkeypatch.setattr(subset_search, "search_terms", lambda probe, only: [Effect(TOLD)])
    monkeypatch.setattr(
        subset_search, "joint_fit", lambda start, terms: Told(1.0, tuple(terms), gain=9.0, problem=problem)
    )
    monkeypatch.setattr(subset_search, "search_about_leader", lambda state: state)
    leader = of(20.0, "a", "b", "c", gain=1.0)
    state = subset_search.beside_what_is_told(state_of(leader, base=base))
    assert [term.effect for term in state.leader.fit.terms] == ["a", TOLD]
