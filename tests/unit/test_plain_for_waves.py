"""Plain effects in place of a few waves: what is tried, and what a recording of lobes and code wheels is told."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from hdopt.diagnosis.search import plain_for_waves as rooms
from hdopt.diagnosis.search.penalty import Scale
from hdopt.diagnosis.search.plain_for_waves import is_plain_term
from hdopt.diagnosis.search.search_state import SearchPlan
from hdopt.diagnosis.settings import DEFAULT
from tests.unit.test_several_for_one import Piece, Weighed

NARROW = DEFAULT.search.narrow


@dataclass(frozen=True)
class Told(Weighed):
    """A fit whose evidence for its freedom alone (`paid`) was written down beside that by all it pays."""

    paid: float = 0.0


@dataclass(frozen=True)
class Standing:
    """As much of a search's state as is asked for."""

    fits: dict
    rng: object = None
    plan: object = SearchPlan()
    settings: object = DEFAULT.search
    scale: object = Scale(1000.0)

    @property
    def leader(self):
        return max(self.fits.values(), key=lambda fit: fit.log_bayes_factor, default=None)

    def weigh(self, fit):
        return fit

    def taking(self, found):
        return replace(self, fits={**self.fits, **{frozenset(one.effects): one for one in found}})


def standing(*fits, **more):
    return Standing({frozenset(one.effects): one for one in fits}, np.random.default_rng(0), **more)


LOBES, WHEEL, DRIFT = Piece("circular_spline_lobing"), Piece("encoder_input_eccentricity"), Piece("thermal_drift", 9)
WAVES, SINE = Piece("cs_tooth_harmonics", NARROW + 2), Piece("_sine_in_angle")
LED = Told((WAVES, DRIFT), paid=50.0, log_bayes_factor=100.0)


def test_plain_is_what_turns_with_few_coefficients_and_what_does_not_turn():
    """Faults caught: a limit one off; a drift refused for its width; a description without physics taken."""
    assert is_plain_term(Piece("cs_tooth_harmonics", NARROW), NARROW)
    assert not is_plain_term(WAVES, NARROW)
    assert is_plain_term(DRIFT, NARROW)
    assert not is_plain_term(SINE, NARROW)


@pytest.fixture
def looked(monkeypatch):
    """Centres about which was looked, and the sets that each look finds, of a list."""
    centres, finds = [], []

    def about(state, centre):
        centres.append((centre.effects, sorted(map(sorted, state.fits))))
        return state.taking(finds.pop(0) if finds else [])

    monkeypatch.setattr(rooms, "about", about)
    monkeypatch.setattr(rooms, "joint_fit", lambda start, terms, rng: start)
    monkeypatch.setattr(rooms, "paid_for_freedom", lambda candidate, scale: candidate.paid)
    return centres, finds


def test_plain_sets_are_searched_among_themselves_and_by_their_freedom_alone(looked):
    """About the leader's drive, then about the clean base, then about the best for its freedom, until no other comes:
    not about what leads by all it pays. The waves still lead. Faults caught: no clean base; about the leader of all;
    one look alone; what was found not taken."""
    centres, finds = looked
    drift, lobes = (
        Told((DRIFT,), paid=10.0, log_bayes_factor=90.0),
        Told((DRIFT, LOBES), paid=60.0, log_bayes_factor=20.0),
    )
    three = Told((DRIFT, LOBES, WHEEL), paid=80.0, log_bayes_factor=10.0)
    clean = Told(())
    finds += [[], [lobes], [three], []]
    state = rooms.plain_for_waves(standing(LED, drift, plan=replace(SearchPlan(), clean=clean)))
    assert [effects for effects, _ in centres] == [LED.effects, (), lobes.effects, three.effects]
    assert centres[0][1] == [["thermal_drift"]]
    assert {frozenset(lobes.effects), frozenset(three.effects)} < set(state.fits)
    assert state.leader is LED


@pytest.mark.parametrize("leader", [(LOBES, DRIFT), (SINE,), (WAVES, SINE)])
def test_nothing_is_searched_where_all_is_plain_or_no_physics(looked, leader):
    state = standing(Told(leader, log_bayes_factor=5.0))
    assert rooms.plain_for_waves(state) is state
    assert rooms.plain_for_waves(standing()).fits == {}
    assert looked[0] == []


def test_the_draws_are_its_own(looked, monkeypatch):
    """Fault caught: a search in which nothing comes of it changes what comes after."""
    monkeypatch.setattr(rooms, "joint_fit", lambda start, terms, rng: rng.normal() and start)
    looked[1].append([Told((DRIFT, LOBES), paid=60.0)])
    state = standing(LED)
    assert rooms.plain_for_waves(state).rng.normal() == np.random.default_rng(0).normal()


def test_a_look_ranks_by_freedom_alone(monkeypatch):
    """Fault caught: three effects of one kind are ranked below two for being alike, and never fitted."""
    asked = SimpleNamespace()

    def pool_among(state, centre, stays):
        asked.stays = [one.effect for one in (LOBES, WAVES, DRIFT, SINE) if stays(one)]
        return ["a pool"]

    def explore(state, centre, pool, scale):
        asked.pool, asked.scale = pool, scale
        return state

    monkeypatch.setattr(rooms, "pool_among", pool_among)
    monkeypatch.setattr(rooms, "explore", explore)
    state = standing(LED)
    assert rooms.about(state, LED) is state
    assert asked.stays == [LOBES.effect, DRIFT.effect]
    assert asked.pool == ["a pool"]
    assert (asked.scale.settings.discrepancy, asked.scale.settings.other_kind) == (0.0, 0.0)
    assert asked.scale.settings.effect_cost == DEFAULT.penalty.effect_cost
    assert asked.scale.rows == 1000.0
