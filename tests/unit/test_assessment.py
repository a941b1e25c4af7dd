"""The numbers behind a verdict: noise of neighbours, limits of detection, what is left, placebo, chance."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_cross_validation import RATE, noisy, rows_of, without_base
from test_diagnosis_evidence import state

from hdopt.diagnosis.checks import assessment
from hdopt.diagnosis.checks.assessment import assess, best_placebo, detection_limits, look_at_remainder
from hdopt.diagnosis.checks.other_laws import OtherLaw
from hdopt.diagnosis.inference.catalogue import SCALE
from hdopt.diagnosis.inference.fit import extend
from hdopt.diagnosis.inference.neighbour_noise import noise_between_neighbours
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.search.candidates import Candidate, penalty_scale, search_terms
from hdopt.diagnosis.search.penalty import Scale, penalty
from hdopt.diagnosis.verdict.facts import find
from hdopt.effects.term import Term

THETA = np.arange(40 * RATE) * 2 * np.pi / RATE


@pytest.fixture(scope="module")
def hidden():
    """The evidence on an eccentric input encoder that no search has looked for."""
    return assess(state(0.3 * np.sin(THETA + 0.5)))


def test_noise_of_neighbours_is_that_of_the_samples():
    """A drive's own waves and a ramp vanish in second differences."""
    place = np.linspace(0, 40, 40_000)
    smooth = 2.0 * np.sin(2 * place) + 3.0 * place
    records = [SimpleNamespace(error_arcmin=smooth + np.random.default_rng(i).normal(0, 0.3, 40_000)) for i in range(3)]
    # The median of 40 000 is known to 0.8 %.
    assert noise_between_neighbours(records) == pytest.approx(0.3, rel=0.02)


def test_a_ripple_that_was_found_is_no_noise_between_neighbours(monkeypatch):
    """A mesh of two and a half samples a wave, thirty times the noise. Would catch effects beside it that are taken for
    less than the sensors resolve."""
    asked = []
    monkeypatch.setattr(assessment, "noise_between_neighbours", lambda recordings: asked.append(recordings) or 0.02)
    told = state(0.0 * THETA)
    ripple = 0.6 * np.sin(19 * THETA)
    (recording,) = told.recordings
    with_mesh = replace(recording, error_arcmin=recording.error_arcmin + ripple)
    assess(replace(told, recordings=(with_mesh,), ripple=ripple))
    ((cleaned,),) = asked
    np.testing.assert_allclose(cleaned.error_arcmin, recording.error_arcmin, atol=1e-12)


def wave(trials=1.0):
    columns = np.column_stack([np.sin(3.5 * THETA), np.cos(3.5 * THETA)])
    return Term("output_coupling", {}, columns=columns, trials=trials)


def test_what_is_as_large_as_its_limit_just_pays():
    scale = Scale(1000.0, inflation=1.8)
    limit = detection_limits(FitProbe(without_base(noisy(40))), [wave()], scale)["output_coupling"]
    probe = FitProbe(without_base(rows_of(limit * np.sqrt(2) * np.sin(3.5 * THETA))))
    assert probe.gain(wave()) / 2 / 1.8 == pytest.approx(penalty([wave()], 0.0, scale), rel=1e-3)


def test_the_limit_of_an_effect_is_that_of_its_best_variant():
    probe, scale = FitProbe(without_base(noisy(40))), Scale(1000.0)
    alone = detection_limits(probe, [wave()], scale)
    assert detection_limits(probe, [wave(1e6), wave(), wave(1e3)], scale) == alone


def test_a_basis_without_physics_wins_where_something_is_left():
    noise = np.random.default_rng(1).normal(0, 0.02, len(THETA))
    left, quiet = (without_base(rows_of(noise + wave)) for wave in (0.2 * np.sin(4.37 * THETA), 0.0))
    found = look_at_remainder(left, left.problem.rows.block % 5, 1.0)
    assert found.t > 5
    # The basis pays for its freedom: some twenty columns of 1 920 rows, and lines beside the true one.
    assert found.held_out.rms == pytest.approx(0.02, rel=0.15)
    assert max(found.domains, key=found.domains.get) == "asynchronous order"
    assert look_at_remainder(quiet, quiet.problem.rows.block % 5, 1.0).t < 4


def test_floor_and_placebo_of_what_was_not_searched(hidden):
    """The floor is what the better of explanation and generic basis leaves; the placebo is the encoder's sine."""
    assert hidden.extended_held_out.rms == pytest.approx(0.3 / np.sqrt(2), rel=0.05)
    assert hidden.noise_floor == pytest.approx(0.02, rel=0.1)
    assert hidden.placebo == "encoder_input_eccentricity"
    assert hidden.placebo_held_out.rms == pytest.approx(0.02, rel=0.1)
    assert hidden.false_alarm_p <= 0.01


def test_the_chance_is_that_of_a_whole_search_made_anew(monkeypatch):
    """Under flipped signs shapes are looked for again, in all of the catalogue, each with its own penalty."""
    asked = []

    def chance(probe, score, rng, observed, most):
        other = probe.flipped(np.where(probe.rows.block % 2, 1.0, -1.0))
        asked.append((other, score(other), observed))
        return 0.5

    monkeypatch.setattr(assessment, "false_alarm_chance", chance)
    last = state(np.random.default_rng(2).normal(0, 0.02, len(THETA)))
    assert assess(last).false_alarm_p == 0.5
    ((other, again, observed),) = asked
    scale = penalty_scale(last.selection.base.problem, last.inflation)

    def best(probe):
        found = search_terms(probe, skip=last.ruled_out)
        return max(probe.gain(t) / 2 / last.inflation - penalty([t], 0.0, scale) for t in found)

    assert again == best(other)
    assert observed == max(last.selection.best.log_bayes_factor, best(FitProbe(last.selection.base)))


def test_noise_is_held_against_the_larger_of_neighbours_and_sensors(hidden):
    """Of the sensors' steps by what rounding to them makes. Fault caught: the whole step, under which eleven times the
    noise was adequate."""
    rms = hidden.extended_held_out.rms
    for neighbours, sensors in ((0.01, 0.5 * 12**0.5), (0.5, 0.01), (0.5, 1.7)):
        facts = find(replace(hidden, neighbours_arcmin=neighbours, sensor_arcmin=sensors)).facts
        assert facts.noise_over_neighbours == pytest.approx(rms / 0.5)


def test_the_evidence_for_another_law_is_a_fact(hidden):
    assert find(replace(hidden, other_law=OtherLaw(0, 12.5))).facts.other_law == 12.5


def test_a_scale_alone_explains_nothing(hidden):
    """It is told as what it is: no effect."""
    base = hidden.selection.base
    off = extend(base, [base.problem.explanations[SCALE].term(base.problem.rows, {})])
    selection = replace(hidden.selection, candidates=(Candidate(off, 50.0, 100.0), *hidden.selection.candidates))
    assert not find(replace(hidden, selection=selection)).facts.explained


@pytest.mark.parametrize(
    ("found", "placebo"),
    [((), "lost_motion"), (("lost_motion",), "hysteresis"), (("lost_motion", "hysteresis"), None)],
)
def test_a_placebo_is_the_best_of_what_was_not_found(found, placebo):
    """Would catch a placebo that is what was found, or a description that is no effect."""
    gains = {"hysteresis": 5.0, "lost_motion": 10.0, "scale": 20.0}
    pool = [SimpleNamespace(effect=name) for name in gains]
    probe = SimpleNamespace(gain=lambda term: gains[term.effect])
    chosen = best_placebo(probe, pool, SimpleNamespace(terms=[SimpleNamespace(effect=name) for name in found]))
    assert (None if chosen is None else chosen.effect) == placebo
