"""The held-out figure is of turns that no stage of the diagnosis saw."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from hdopt.diagnosis import diagnose
from hdopt.diagnosis.checks.assessment import with_the_ripple
from hdopt.diagnosis.inference import hidden_turns
from hdopt.diagnosis.inference.cross_validation import held_out, turn_folds
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.hidden_turns import hidden_samples, uncut_blocks, without_samples
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.nested import Part, as_seen, diagnosis_of_a_part, ripple_of
from hdopt.diagnosis.orientation import AS_COUNTED, turn_round
from hdopt.diagnosis.predict import predict
from hdopt.diagnosis.search import penalty
from hdopt.diagnosis.search.candidates import Candidate, joint_fit
from hdopt.diagnosis.search.high_order import left_as_recorded, subtract
from hdopt.diagnosis.search.subset_search import Selection
from hdopt.diagnosis.settings import DEFAULT
from hdopt.diagnosis.stages import begin, fit_base_in_noise
from hdopt.drive.geometry import ARCMIN
from hdopt.kinematics.cartesian import CartesianModel
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.recording import Recording
from hdopt.recordings.rows import gather, neighbours_for, recorded_turns
from hdopt.study import load_study

TURN = 2 * np.pi
RATIO, TURNS, RATE, NOISE = 50.0, 40, 48, 0.02
RAMP = np.arange(TURNS // 2 * RATE) * TURN / RATE
THETA = np.r_[RAMP, RAMP[::-1]]
"""Twenty turns there and back."""


def record(error, gain=1.0):
    table = {
        "time_s": 0.01 * np.arange(len(THETA)),
        "input_angle_deg": np.degrees(THETA),
        "output_angle_deg": gain * np.degrees(THETA / RATIO - error * ARCMIN),
    }
    return recording_from_table(pd.DataFrame(table), RATIO, name="record")


def noise(seed=0):
    return np.random.default_rng(seed).normal(0, NOISE, len(THETA))


def base_alone(recordings):
    """A diagnosis without a search: fast, and it sees all that it is given."""
    return fit_base_in_noise(begin(recordings, None, 1, DEFAULT))


def hidden_of(recording, seed=1):
    return hidden_samples([recording], np.random.default_rng(seed), DEFAULT.held_out)


def test_whole_turns_are_hidden_and_none_in_which_a_pass_begins_or_ends():
    """Fault caught: a turn of a reversal hidden, so that nothing knows where it was."""
    recording = record(noise())
    rows, (hidden,) = gather([recording]), hidden_of(recording)
    turns = np.unique(rows.block[hidden])
    assert len(turns) == round(DEFAULT.held_out.nested_share * rows.blocks)
    assert hidden.sum() == np.isin(rows.block, turns).sum()
    ends = {rows.block[0], rows.block[-1], *rows.block[np.flatnonzero(np.diff(rows.direction))]}
    ends |= set(rows.block[np.flatnonzero(np.diff(rows.direction)) + 1])
    assert not ends & set(turns)
    assert set(uncut_blocks(rows)) == set(rows.block) - ends


def test_turns_are_drawn_by_the_seed():
    recording = record(noise())
    one, again, other = (hidden_of(recording, seed)[0] for seed in (1, 1, 2))
    assert np.array_equal(one, again) and not np.array_equal(one, other)


def test_a_record_that_can_spare_no_turns_has_no_figure():
    recording = record(noise())
    few = [np.arange(len(recording)) >= 6 * RATE]
    assert hidden_samples(without_samples([recording], few), np.random.default_rng(1), DEFAULT.held_out) is None


@pytest.mark.parametrize(("share", "hidden"), [(0.1, None), (0.2, 3), (0.55, 8), (0.7, None)])
def test_turns_are_hidden_where_enough_are_on_either_side(share, hidden):
    """Of 15 in one pass: three at least to judge by, and six at least to learn from."""
    keep = [np.arange(len(THETA)) >= 15 * RATE]
    settings = replace(DEFAULT.held_out, nested_share=share)
    pass_of_15 = without_samples([record(noise())], keep)
    found = hidden_samples(pass_of_15, np.random.default_rng(1), settings)
    turns = None if found is None else len(np.unique(gather(pass_of_15).block[found[0]]))
    assert turns == hidden


@pytest.mark.parametrize(("rows", "left"), [(1000, 21), (1920, 32), (100, 6)])
def test_of_a_long_recording_no_more_turns_are_left_than_are_needed(rows, left):
    """Forty turns of 48 rows, 36 of which can be hidden: 1000 rows are 20.8 turns, 1920 all of them, of which a fifth
    is hidden, and 100 fewer than the six that are needed at least. Fault caught: four fifths of ten thousand turns.
    """
    settings = replace(DEFAULT.held_out, nested_rows=rows)
    recording = record(noise())
    (hidden,) = hidden_samples([recording], np.random.default_rng(1), settings)
    assert gather([recording]).blocks - len(np.unique(gather([recording]).block[hidden])) == left


def test_rows_of_a_long_recording_are_means_of_samples(monkeypatch):
    """1920 samples make 480 rows of four: of a limit of 480 nothing more is hidden, of 240 half of the turns."""
    monkeypatch.setattr(hidden_turns, "neighbours_for", lambda recordings: 4)
    for limit, hidden in ((480, round(DEFAULT.held_out.nested_share * 40)), (240, 20)):
        settings = replace(DEFAULT.held_out, nested_rows=limit)
        assert hidden_turns.turns_to_hide([record(noise())], 40, settings) == hidden


def test_what_is_left_has_a_gap_where_turns_were_and_the_rest_as_it_was():
    """Fault caught: rows on both sides of a gap taken for neighbours."""
    recording = record(noise())
    hidden = hidden_of(recording)
    (left,) = without_samples([recording], hidden)
    assert np.array_equal(left.error_arcmin, recording.error_arcmin[~hidden[0]])
    before, after = gather([recording]), gather([left])
    at = np.flatnonzero(np.diff(np.flatnonzero(~hidden[0])) > 1)
    assert len(at) > 3 and np.all(np.diff(after.piece)[at] > 0)
    np.testing.assert_allclose(after.travel, before.travel[~hidden[0]], atol=1e-9)
    np.testing.assert_array_equal(after.direction, before.direction[~hidden[0]])


def test_what_the_hidden_turns_hold_is_never_learnt():
    """Their errors exchanged for others: everything that is predicted stays to the last digit, so the figure is that of
    the others. Fault caught: held-out rows left in any stage or in the last fit.
    """
    recording = record(0.3 * np.sin(2 * THETA) + noise())
    (hidden,) = hidden_of(recording)
    spoilt = replace(recording, error_arcmin=recording.error_arcmin + np.where(hidden, 5.0, 0.0))
    states = []

    def seen(recordings):
        states.append(base_alone(recordings))
        return states[-1]

    plain, other = (diagnosis_of_a_part([one], seen, 1, DEFAULT).held_out for one in (recording, spoilt))
    np.testing.assert_array_equal(states[0].base.prediction, states[1].base.prediction)
    # All of the hidden rows are 5 arcmin off now, and no other is: their mean square is the old one plus 25 and twice 5
    # times the old mean error, 0.02/sqrt(384).
    assert other.extended**2 - plain.extended**2 == pytest.approx(25, rel=0.02)
    assert plain.turns == other.turns == round(DEFAULT.held_out.nested_share * gather([recording]).blocks)


def test_the_figure_is_of_means_of_as_many_samples_as_that_of_all_turns():
    """Of all samples two make a row, of those that are left one would: noise of 0.02 in samples is 0.02/sqrt(2) in
    both. Fault caught: a figure 1.4 times too large beside a cross-validated one, and a right name called incomplete.
    """
    theta = np.arange(TURNS * 400) * TURN / 400
    table = {"input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(theta / RATIO)}
    recording = recording_from_table(pd.DataFrame(table), RATIO, name="record")
    recording = replace(recording, error_arcmin=np.random.default_rng(3).normal(0, NOISE, len(theta)))
    assert [neighbours_for(of) for of in ([recording], without_samples([recording], hidden_of(recording)))] == [2, 1]
    nested = diagnosis_of_a_part([recording], base_alone, 1, DEFAULT).held_out
    assert nested.base == pytest.approx(NOISE / np.sqrt(2), rel=0.05)  # 10 turns of 200 rows: 1.6 %


def test_what_is_passed_over_at_a_gap_is_no_turn():
    """300 turns of 400 samples, of which two in three are hidden: what is left are 100 turns, and of their 40,000
    samples 4 make a row. Fault caught: the way over the gaps counted with them, 133 samples a turn, of which 2 make
    one, and a diagnosis of a part that works on twice the rows.
    """
    theta = np.arange(300 * 400) * TURN / 400
    whole = Recording("record", RATIO, theta, np.zeros(len(theta)))
    (left,) = without_samples([whole], [np.arange(len(theta)) // 400 % 3 > 0])
    assert recorded_turns(whole) == pytest.approx(300, abs=0.01)
    assert recorded_turns(left) == pytest.approx(100 * 399 / 400, abs=0.01)
    assert [neighbours_for([one]) for one in (whole, left)] == [6, 4]


def test_a_choice_that_overfits_shows_in_the_nested_figure_alone():
    """Pure noise, described by the sixty of six hundred orders that fit it best. Chosen with all turns in sight they
    predict every fold better than nothing does; chosen on the other turns they predict the hidden ones worse.
    """
    orders = np.linspace(2.5, 20.5, 600)

    def overfitting(recordings):
        state = base_alone(recordings)
        problem, probe = state.problem, FitProbe(state.base)
        sine = problem.explanations["_sine_in_angle"]
        terms = [replace(sine.term(problem.rows, {"order": order}), steps={}) for order in orders]
        best = sorted(terms, key=probe.gain, reverse=True)[:60]
        fit = joint_fit(state.base, best)
        return replace(state, selection=replace(state.selection, candidates=(Candidate(fit, 1.0, 1.0),)))

    recording = record(noise(7))
    nested = diagnosis_of_a_part([recording], overfitting, 1, DEFAULT).held_out
    state = overfitting([recording])
    folds = turn_folds(state.base, np.random.default_rng(1))
    chosen_on_all, truth = (held_out(fit, None, folds).rms for fit in (state.selection.best.fit, state.base))
    assert chosen_on_all < 0.99 * truth
    assert nested.extended > 1.01 * nested.base
    assert nested.base == pytest.approx(NOISE, rel=0.1)  # 8 turns of 48 rows: 3.6 %
    assert nested.effects == ("_sine_in_angle",)


@pytest.mark.parametrize("turned", [False, True])
def test_hidden_turns_are_looked_at_as_the_others_were(turned):
    """Zero, slope and way of counting of the state that saw the others: kept samples come out as it has them."""
    recording = record(30.0 + noise(), gain=1.005)
    hidden = hidden_of(recording)
    state = base_alone(without_samples([recording], hidden))
    assert state.nuisances.taken is not None
    if turned:
        nuisances = replace(state.nuisances, taken=state.nuisances.taken.turned)
        counted = replace(AS_COUNTED, input=-1)
        state = replace(state, recordings=turn_round(state.recordings), nuisances=nuisances, orientation=counted)
    (seen,) = as_seen([recording], hidden, state)
    np.testing.assert_allclose(seen.error_arcmin[~hidden[0]], state.recordings[0].error_arcmin, atol=1e-9)
    np.testing.assert_allclose(seen.input_angle[~hidden[0]], state.recordings[0].input_angle, atol=1e-12)
    assert np.std(seen.error_arcmin) < 2 * NOISE


def test_a_ripple_is_taken_out_of_hidden_turns_as_of_the_others():
    """What was found on the rows as recorded, added up anew on all of them: here on the same ones."""
    recording = record(0.3 * np.sin(17.3 * THETA) + noise())
    state = base_alone([recording])
    left = left_as_recorded([recording], state.base, state.nuisances)
    bare = evaluate(left, np.zeros(0), np.zeros(1), (), ())
    high = joint_fit(bare, [left.explanations["_sine_in_angle"].term(left.rows, {"order": 17.3})])
    found = Selection(bare, (Candidate(high, 1.0, 1.0),), 1.0)
    ripple = ripple_of([recording], replace(state, high=found, ripple=high.contributions))
    np.testing.assert_allclose(ripple, high.contributions, atol=1e-9)
    assert np.std(ripple) == pytest.approx(0.3 / np.sqrt(2), rel=0.02)
    assert not ripple_of([recording], state).any()


def with_a_ripple_taken_out(recordings):
    """A diagnosis that finds a sine of order 17.3 in rows as recorded, and goes on without it."""
    state = base_alone(recordings)
    left = left_as_recorded(recordings, state.base, state.nuisances)
    bare = evaluate(left, np.zeros(0), np.zeros(1), (), ())
    high = joint_fit(bare, [left.explanations["_sine_in_angle"].term(left.rows, {"order": 17.3})])
    rows = gather(subtract(recordings, high.contributions))
    base = refine(replace(state.base, problem=replace(state.problem, rows=rows)))
    low = replace(state.selection, base=base, candidates=(Candidate(base, 0.0, 0.0),))
    found = Selection(bare, (Candidate(high, 1.0, 1.0),), 1.0)
    return replace(state, base=base, selection=low, high=found, ripple=high.contributions)


def test_the_drive_alone_has_the_ripple_on_turns_that_were_hidden_and_on_all():
    """Where all else is free of it, and the base leaves the noise. Fault caught: a fit that does not show what a ripple
    at the teeth explains, since the drive alone is spared it too."""
    recording = record(0.3 * np.sin(17.3 * THETA) + noise())
    nested = diagnosis_of_a_part([recording], with_a_ripple_taken_out, 1, DEFAULT).held_out
    assert nested.base == nested.extended == pytest.approx(NOISE, rel=0.1)
    assert nested.drive_alone == pytest.approx(0.3 / np.sqrt(2), rel=0.05)
    state = with_a_ripple_taken_out([recording])
    assert np.std(state.selection.base.residual) == pytest.approx(NOISE, rel=0.1)
    assert np.std(with_the_ripple(state).residual) == pytest.approx(0.3 / np.sqrt(2), rel=0.05)


def test_a_prediction_takes_the_slope_out_that_was_taken():
    """An output gain of 1.005 is 25 arcmin a turn of input: recorded and predicted are both free of it."""
    recording = record(30.0 + noise(), gain=1.005)
    state = base_alone([recording])
    evidence = SimpleNamespace(nuisances=state.nuisances, selection=state.selection, orientation=state.orientation)
    recorded, expected = predict(SimpleNamespace(evidence=evidence, effects=()), recording)
    assert np.std(recorded) < 2 * NOISE
    assert np.std(recorded - expected) == pytest.approx(NOISE, rel=0.1)


@pytest.mark.slow
def test_the_figure_of_a_whole_diagnosis_is_the_noise():
    """An eccentric input encoder hidden: chosen anew on 32 turns, and the other 8 left with the noise."""
    diagnosis = diagnose(record(0.3 * np.sin(THETA + 0.4) + noise()), ratio=RATIO)
    nested = diagnosis.evidence.nested
    assert nested.effects == ("encoder_input_eccentricity",)
    assert diagnosis.fit["heldout_nested_rms_arcmin"] == nested.extended == pytest.approx(NOISE, rel=0.1)
    assert diagnosis.fit["heldout_nested_rms_base_arcmin"] == nested.drive_alone == nested.base
    assert nested.base == pytest.approx(0.3 / np.sqrt(2), rel=0.1)


def proposed(sizes, found, hidden_arcmin=0.0, effects=("a part",), ripple=()):
    """The figure of a proposal, where a part of the turns found waves of these `sizes` (order -> arcmin) alone of what
    is there, twice and five times a turn, by the name of `effects`, and all turns `found` others; the hidden turns are
    off by so much more.
    """
    error = 0.3 * np.sin(2 * THETA) + 0.2 * np.sin(5 * THETA) + noise()
    recording = record(error)
    (hidden,) = hidden_of(recording)
    recording = replace(recording, error_arcmin=recording.error_arcmin + np.where(hidden, hidden_arcmin, 0.0))
    rows = gather([recording])
    study = load_study(drive="csf-25-80")
    problem = FitProblem(rows, CartesianModel.of(study.drive), np.ones((len(rows), 1)), Noise.white(rows, NOISE))
    bare = evaluate(problem, np.zeros(12), np.zeros(1), (), ())

    def beside(orders):
        sine = problem.explanations["_sine_in_angle"]
        terms = [replace(sine.term(problem.rows, {"order": float(k)}), steps={}) for k in orders]
        seen = replace(bare, problem=problem.with_noise(problem.noise.without(hidden)))
        return joint_fit(seen, terms) if terms else refine(seen, 3)

    base, best, proposal = beside(()), beside(sizes), beside(found)
    if ripple:
        best = evaluate(best.problem, np.full(12, 0.01), np.zeros(1), (), ())
    part = Part(base, best, base, hidden, hidden, effects, 2 * len(sizes), ())
    on_all = replace(proposal, problem=problem)
    selection = Selection(replace(base, problem=problem), (Candidate(on_all, 1.0, 1.0),), 1.0)
    high = SimpleNamespace(best=SimpleNamespace(fit=SimpleNamespace(terms=ripple))) if ripple else None
    return part, part.of_proposal(SimpleNamespace(selection=selection, high=high, inflation=1.0))


def test_what_the_turns_that_were_left_prefer_is_a_proposal():
    """A part of the turns that missed a wave takes it over, and leaves noise of the hidden ones: 8 turns of 48 rows,
    3.6 %. Faults caught: the figure of the base alone; the names of the part.
    """
    part, figure = proposed((2,), (2, 5))
    assert part.held_out.extended > 0.1
    assert figure.extended == pytest.approx(NOISE, rel=0.15)
    assert figure.base > 0.2
    assert figure.effects == ("_sine_in_angle",)


def test_what_they_do_not_prefer_is_none():
    """The same waves, or one more that explains nothing and costs two coefficients, or less than the part found."""
    assert proposed((2, 5), (2, 5))[1] is None
    assert proposed((2, 5), (2, 5, 7.3))[1] is None
    assert proposed((2, 5), (2,))[1] is None


def test_many_waves_of_what_the_part_did_not_find_are_no_proposal(monkeypatch):
    """In which waves these are the hidden turns had a say. Of what it found they are one, and a few waves are. Faults
    caught: a tooth imitated by many waves that is named for what the hidden turns chose; a right name refused.
    """
    monkeypatch.setattr(penalty, "flexibility", lambda term, settings: 1.0)
    assert proposed((2,), (2, 5))[1] is None
    assert proposed((2,), (2, 5), effects=("_sine_in_angle",))[1] is not None
    monkeypatch.setattr(penalty, "flexibility", lambda term, settings: 0.9)
    assert proposed((2,), (2, 5))[1] is not None


def test_a_drive_beside_a_ripple_alone_is_proposed_where_the_part_found_that_ripple():
    """A part of the turns that found the right ripple beside a poor drive takes over the better one. Fault caught: a
    mesh of unequal teeth, found by both, that is `unknown` for the drive of the part (case 226 of run-014). A ripple
    that only all turns show is the hidden turns' say, and nothing is proposed where nothing was found.
    """
    mesh = (SimpleNamespace(effect="tooth_mesh", freedom=3),)
    part, figure = proposed((), (), effects=("tooth_mesh",), ripple=mesh)
    assert figure.extended < 0.9 * part.held_out.extended
    assert figure.effects == ("tooth_mesh",)
    assert proposed((), (), effects=("encoder_interpolation",), ripple=mesh)[1] is None
    assert proposed((), ())[1] is None


def test_a_proposal_is_not_fitted_to_the_hidden_turns():
    """These 5 arcmin higher: all that is fitted stays, and the figure is off by them, to the noise's mean (0.001)."""
    assert proposed((2,), (2, 5), hidden_arcmin=5.0)[1].extended == pytest.approx(5.0, abs=0.01)
