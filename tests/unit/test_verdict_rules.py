"""Each rule of the verdict: facts that fire it, and the same facts with one thing changed that do not."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from hdopt.diagnosis import diagnose
from hdopt.diagnosis.checks.confounding import Confounding
from hdopt.diagnosis.inference.catalogue import NEW_ZERO, SKEW, VARYING_CONTACT
from hdopt.diagnosis.inference.cross_validation import HeldOut
from hdopt.diagnosis.settings import DEFAULT
from hdopt.diagnosis.verdict.draw import (
    base_notes,
    contact_notes,
    prior_notes,
    scale_notes,
    skew_notes,
    taken_up_notes,
    zero_notes,
)
from hdopt.diagnosis.verdict.facts import Facts, resolution
from hdopt.diagnosis.verdict.named_effect import NamedEffect
from hdopt.diagnosis.verdict.rivals import imitating_sets, placebo_as_good, sets_with_a_part, shared_with_imitators
from hdopt.diagnosis.verdict.rules import RULES, rule_for
from hdopt.effects.estimate import Parameter
from hdopt.recordings.read import recording_from_table

CLEAN = Facts(
    settings=DEFAULT.verdict,
    turns_suffice=True,
    explained=False,
    false_alarm_p=0.6,
    own_gain=0.0,
    high=False,
    outside_share=0.0,
    high_outside_share=0.0,
    momentary=False,
    unsteady=False,
    generic_wins=False,
    generic_t=0.3,
    too_little=False,
    rivals=(),
)
NAMED = replace(CLEAN, explained=True, false_alarm_p=0.002, own_gain=1.0)

LEFT = replace(CLEAN, left_over_floor=1.2, generic_t=2.1, false_alarm_p=0.002)

FIRED = [
    ("happened once", replace(NAMED, momentary=True), {"momentary": False}),
    ("happened once", replace(NAMED, momentary=True), {"turns_suffice": False}),
    ("comes again", replace(CLEAN, left_over_passes=3.0), {"left_over_passes": 1.5}),
    ("comes again", replace(CLEAN, left_over_passes=3.0), {"turns_suffice": False}),
    ("no physics explains", replace(NAMED, outside_share=0.5), {"outside_share": 0.1}),
    ("no physics explains", replace(NAMED, outside_share=0.5), {"false_alarm_p": 0.2}),
    ("no physics explains", replace(NAMED, outside_share=0.5, unseen_gain=0.0), {"outside_share": 0.1}),
    ("no physics explains", replace(NAMED, outside_share=0.5, false_alarm_p=0.5, log_evidence=40), {"log_evidence": 9}),
    ("no physics explains", replace(NAMED, outside_share=0.5, false_alarm_p=0.5, log_evidence=40), {"own_gain": 0.0}),
    ("no physics explains", replace(CLEAN, high=True, high_outside_share=0.5), {"high_outside_share": 0.1}),
    ("changes in time", replace(CLEAN, unsteady=True), {"unsteady": False}),
    ("generic basis wins", replace(NAMED, generic_wins=True, generic_t=4.5), {"generic_wins": False}),
    ("generic basis wins", replace(CLEAN, generic_wins=True, generic_t=6.5), {"generic_t": 5.0}),
    ("too much for noise", replace(CLEAN, noise_over_neighbours=9.7), {"noise_over_neighbours": 2.9}),
    ("too much for noise", replace(CLEAN, noise_over_neighbours=9.7), {"turns_suffice": False}),
    ("too much for noise", replace(CLEAN, noise_over_neighbours=9.7), {"walk": True}),
    ("not confirmed", replace(NAMED, unseen_gain=0.01), {"unseen_gain": 0.5}),
    ("not confirmed", replace(NAMED, unseen_gain=0.01), {"own_gain": 0.03}),
    ("not confirmed", replace(NAMED, unseen_gain=0.01), {"false_alarm_p": 0.02}),
    ("not confirmed", replace(NAMED, unseen_gain=0.01), {"high": True}),
    ("more than noise is left", replace(NAMED, heldout_over_floor=2.0, generic_t=8.0), {"heldout_over_floor": 1.2}),
    ("more than noise is left", replace(NAMED, heldout_over_floor=2.0, generic_t=8.0), {"generic_t": 1.0}),
    ("beaten without physics", replace(CLEAN, beaten_by_generic=True), {"beaten_by_generic": False}),
    ("beaten without physics", replace(NAMED, beaten_by_generic=True), {"turns_suffice": False}),
    ("another law explains", replace(NAMED, other_law=12.0), {"other_law": 8.0}),
    ("another law explains", replace(NAMED, other_law=12.0), {"false_alarm_p": 0.3}),
    ("not found again", replace(NAMED, found_again=False, heldout_over_floor=1.5), {"found_again": True}),
    ("not found again", replace(NAMED, found_again=False, heldout_over_floor=1.5), {"heldout_over_floor": 1.3}),
    ("not found again", replace(NAMED, found_again=False, heldout_over_floor=1.5), {"own_gain": 0.0}),
    ("misses unseen turns", replace(NAMED, heldout_over_floor=2.4), {"heldout_over_floor": 1.9}),
    ("misses unseen turns", replace(NAMED, heldout_over_floor=2.4), {"unseen_gain": 0.0}),
    ("hum explains as well", replace(NAMED, hum_as_good=True), {"hum_as_good": False}),
    ("hum explains as well", replace(NAMED, hum_as_good=True), {"own_gain": 0.0}),
    ("effects cancel", replace(NAMED, together=0.07), {"together": 0.27}),
    ("effects cancel", replace(NAMED, together=0.07), {"own_gain": 0.0}),
    ("drive is far", replace(NAMED, far_base=True), {"far_base": False}),
    ("drive is far", replace(NAMED, far_base=True), {"unseen_gain": 0.0}),
    ("contact varies too much", replace(NAMED, contact=0.3), {"contact": 0.15}),
    ("contact varies too much", replace(NAMED, contact=0.3), {"false_alarm_p": 0.2}),
    ("contact varies too much", replace(CLEAN, false_alarm_p=0.002, contact=0.3), {"turns_suffice": False}),
    ("described better", replace(NAMED, described_better=6.0), {"described_better": 4.0}),
    ("described better", replace(NAMED, described_better=6.0), {"own_gain": 0.0}),
    ("one course tells all", replace(NAMED, course=6.0), {"course": 4.0}),
    ("one course tells all", replace(NAMED, course=6.0), {"own_gain": 0.0}),
    ("others are as good", replace(NAMED, rivals=(("lost_motion",),)), {"rivals": ()}),
    ("named", NAMED, {"own_gain": 0.01}),
    ("named", NAMED, {"unseen_gain": 0.01}),
    ("named", NAMED, {"false_alarm_p": 0.02}),
    ("named", NAMED, {"turns_suffice": False}),
    ("named", replace(CLEAN, high=True), {"high": False}),
    ("named", NAMED, {"scale_as_good": True}),
    ("named", NAMED, {"above_resolution": False}),
    ("more than is told", replace(CLEAN, beside_told=70.0), {"beside_told": 12.0}),
    ("more than is told", replace(CLEAN, beside_told=70.0), {"turns_suffice": False}),
    ("more than is told", replace(CLEAN, beside_told=70.0), {"high": True}),
    ("something is left", LEFT, {"left_over_floor": 1.1}),
    ("something is left", LEFT, {"generic_t": 1.9}),
    ("something is left", LEFT, {"turns_suffice": False}),
    ("something is left", LEFT, {"high": True}),
    ("something is left", LEFT, {"false_alarm_p": 0.17}),
    ("something is left", replace(LEFT, false_alarm_p=0.17, generic_t=6.5), {"generic_t": 5.5}),
    ("too little", replace(CLEAN, too_little=True), {"too_little": False}),
    ("adequate", CLEAN, {"too_little": True}),
]


@pytest.mark.parametrize(("name", "facts", "changed"), FIRED)
def test_rule_fires_on_its_facts_alone(name, facts, changed):
    assert rule_for(facts).name == name
    assert rule_for(replace(facts, **changed)).name != name


def test_every_rule_is_tried():
    assert [rule.name for rule in RULES] == list(dict.fromkeys(name for name, _, _ in FIRED))


def test_what_happened_once_is_asked_before_what_can_be_named():
    """An event beside an effect: the event comes first, nothing is named."""
    both = replace(NAMED, momentary=True, rivals=(("lost_motion",),))
    assert rule_for(both).name == "happened once"


def pair(**changes):
    return replace(Confounding("lost_motion", "hysteresis", 0.0, 1.0, 0.0, "turn further"), **changes)


@pytest.mark.parametrize(
    ("changes", "sets"),
    [
        ({}, (("hysteresis", "thermal_drift"),)),
        ({"imitates": 0.9}, ()),
        ({"evidence_apart": 500.0}, ()),
        ({"other": "thermal_drift"}, ()),
    ],
)
def test_what_can_be_imitated_wholly_is_a_tie(changes, sets):
    """Would catch a name at full confidence beside `confounded` 100 % and log evidence apart 0."""
    assert imitating_sets([pair(**changes)], ["lost_motion", "thermal_drift"], DEFAULT.verdict) == sets


def effect(name, confidence=0.97):
    return NamedEffect(name, confidence, {}, {}, "")


@pytest.mark.parametrize(
    ("changes", "weighed", "confidence"),
    [
        ({}, (), 0.97 / 2),  # nothing apart
        ({"odds": -2.0}, (), 0.97 / (1 + np.exp(-2.0))),  # seven to one against it beforehand
        ({"evidence_apart": 3.0}, (), 0.97 / (1 + np.exp(-1.5))),
        ({"evidence_apart": 6.0}, (), 0.97),
        ({"imitates": 0.9}, (), 0.97),
        ({}, (("thermal_drift", "hysteresis"),), 0.97),  # a candidate, which has its share already
        ({"other": "thermal_drift"}, (), 0.97),
    ],
)
def test_a_tie_is_no_certainty(changes, weighed, confidence):
    """Fault caught: 0.97 for one of two names whose columns are the same."""
    said = [effect("lost_motion"), effect("thermal_drift")]
    shared = shared_with_imitators(said, [pair(**changes)], weighed, DEFAULT.verdict)
    assert [one.confidence for one in shared] == pytest.approx([confidence, 0.97])


def sized(value, half):
    return Parameter(value, value - half, value + half, "1")


@pytest.mark.parametrize(
    ("name", "parameters", "others"),
    [
        ("encoder_output_eccentricity", {"amplitude_arcmin": sized(0.2, 0.01)}, ()),
        (
            "encoder_output_eccentricity",
            {"amplitude_arcmin": sized(0.2, 0.01), "amplitude_output_2_arcmin": sized(0.215, 0.01)},
            (),
        ),
        (
            "encoder_output_eccentricity",
            {"amplitude_arcmin": sized(0.2, 0.01), "amplitude_output_2_arcmin": sized(0.225, 0.01)},
            (("encoder_output_eccentricity", "output_coupling"),),
        ),
        ("resonance", {"output_share_of_damping": sized(0.5, 0.24)}, (("resonance", "channel_delay"),)),
        ("resonance", {"output_share_of_damping": sized(0.5, 0.26)}, ()),
        ("resonance", {"output_share_of_damping": sized(0.1, 0.06)}, ()),
        ("resonance", {"output_share_of_damping": sized(0.9, 0.06)}, ()),
        ("resonance", {"output_share_of_damping": sized(0.1, 0.04)}, (("resonance", "channel_delay"),)),
        ("lost_motion", {}, ()),
    ],
)
def test_a_part_of_one_effect_may_be_another(name, parameters, others):
    """A wheel more oval than it is off-centre may be an eccentric one beside a bent coupling, and a damping that acts
    in part on the output a delay: both were named as one effect at 0.97."""
    said = [replace(effect(name), parameters=parameters)]
    assert sets_with_a_part(said) == others
    beside = [*said, effect("channel_delay"), effect("output_coupling")]
    assert sets_with_a_part(beside) == ()


def held(turns, variance):
    return HeldOut(np.full(turns, variance), np.full(turns, variance), np.ones(turns))


@pytest.mark.parametrize(
    ("placebo", "apart", "odds", "said"),
    [
        (1.0, 0.0, 0.0, (("hysteresis",),)),
        (1.0, 19.0, 0.0, (("hysteresis",),)),
        (1.0, 21.0, 0.0, ()),
        (1.0, 15.0, -4.0, (("hysteresis",),)),
        (1.0, 15.0, -10.0, ()),
        (1.5, 0.0, 0.0, ()),
    ],
)
def test_a_placebo_that_predicts_as_well_is_another_explanation(placebo, apart, odds, said):
    """Where single rows part the two by more than 20 in log evidence, whole turns that do not are no tie; nor do they
    where the placebo is that much less likely to begin with."""
    pair = SimpleNamespace(effect="lost_motion", other="hysteresis", evidence_apart=apart, odds=odds)
    settings = DEFAULT
    evidence = SimpleNamespace(
        settings=settings,
        base_held_out=held(20, 3.0),
        extended_held_out=held(20, 1.0),
        placebo_held_out=held(20, placebo),
        placebo="hysteresis",
        selection=SimpleNamespace(best=SimpleNamespace(effects=("lost_motion",))),
    )
    spread = np.linspace(0.9, 1.1, 20)
    evidence.placebo_held_out = HeldOut(placebo * spread, placebo * spread, np.ones(20))
    assert placebo_as_good(evidence, [pair]) == said


def test_resolution_is_that_of_the_model_or_of_the_sensors():
    base = SimpleNamespace(base_value=np.array([-1.0, 1.0]))
    known = {"settings": DEFAULT, "selection": SimpleNamespace(base=base), "rows": SimpleNamespace(output_step=0.0)}
    quiet = SimpleNamespace(neighbours_arcmin=1e-4, sensor_arcmin=0.0, **known)
    coarse = SimpleNamespace(neighbours_arcmin=0.01, sensor_arcmin=0.5, **known)
    assert resolution(quiet) == pytest.approx(DEFAULT.verdict.model_resolution)
    assert resolution(coarse) == pytest.approx(0.5 * DEFAULT.verdict.sensor_resolution)
    # Where an encoder's steps were taken out, what they left counts, not their height.
    coarse.rows = SimpleNamespace(output_step=0.5)
    coarse.extended_held_out = SimpleNamespace(rms=0.1)
    assert resolution(coarse) == pytest.approx(0.1 * DEFAULT.verdict.stepped_resolution)


@pytest.mark.parametrize(("delay", "warned"), [(2.5, True), (0.01, False)])
def test_a_parameter_outside_its_prior_is_no_plain_name(delay, warned):
    """Time in ms read as s gives a delay of seconds."""
    parameters = {"delay_s": Parameter(delay, 0.99 * delay, 1.01 * delay, "s")}
    where = {"domain": "speed", "orders_per_input_turn": [], "direction": "both", "share_of_residual": 1.0}
    found = NamedEffect("channel_delay", 0.97, where | {"rms_arcmin": 1.0}, parameters, "Says.")
    notes = prior_notes([found])
    assert bool(notes) is warned
    if warned:
        assert "delay_s 2.5 s lies outside of what drives and benches have" in notes[0]


@pytest.mark.parametrize(
    ("tilt_mm", "said"),
    [(0.009, None), (0.0101, "lies outside the tolerances of its kind"), (0.017, "lies far outside the tolerances")],
)
def test_a_drive_outside_its_tolerances_is_warned_of(tilt_mm, said):
    """A wave generator tilted by 1.1, 1.26 and 2.1 times the 0.1 deg of its kind, surely."""
    base = SimpleNamespace(half_width=4.5)
    problem = SimpleNamespace(base=base, prior=np.full(12, 0.03), settings=DEFAULT, box=np.array(DEFAULT.base.box_mm))
    errors = np.full(12, 1e-5)
    errors[6] = tilt_mm
    fit = SimpleNamespace(
        problem=problem, errors=errors, covariance=lambda: 1e-12 * np.eye(13), base_value=np.array([-0.3, 0.3])
    )
    notes = base_notes(fit)
    assert bool(notes) is (said is not None)
    if said:
        assert said in notes[0] and "wg_tilt_major_deg" in notes[0] and "tolerance 0.1" in notes[0]
    errors[0] = 0.06
    assert "axis eccentricity x 0.06 mm" in base_notes(fit)[0]


@pytest.mark.parametrize(
    ("limit", "best", "told"), [(0.31, (), True), (0.29, (), False), (0.31, ("resonance",), False)]
)
def test_what_the_drive_takes_up_whole_is_told(limit, best, told):
    """The error recorded is 0.3 arcmin rms. Faults caught: `adequate` without a word of an eccentric input encoder that
    no size of could show; a word of what is named, or of what is no effect."""
    rows = SimpleNamespace(error=np.array([-0.3, 0.3, -0.3, 0.3]) + 5.0)
    selection = SimpleNamespace(best=SimpleNamespace(effects=best))
    limits = {"resonance": limit, "_varying_contact": 9.0, "lost_motion": 0.01}
    notes = taken_up_notes(SimpleNamespace(rows=rows, selection=selection, below_detection=limits))
    assert [note.split()[0] for note in notes] == ["resonance"] * told


@pytest.mark.parametrize(("own_gain", "named"), [(430.0, True), (0.5, False)])
def test_effects_that_carry_most_are_said_beside_what_is_no_noise(monkeypatch, own_gain, named):
    """Would catch windup and friction that explain 1808 of 1810 arcmin lost, as 87 are left; and a name for an effect
    that carries less than it leaves."""
    from hdopt.diagnosis.verdict import rules

    monkeypatch.setattr(rules, "locate_remainder", lambda evidence: {"rms_arcmin": 80.0, "domain": "torque"})
    evidence = SimpleNamespace(sensors_noise=1.0, extended_held_out=SimpleNamespace(variance=87.0**2, rms=87.0))
    facts = replace(NAMED, own_gain=own_gain, noise_over_neighbours=82.0)
    windup = SimpleNamespace(id="torsional_windup", says="The gear winds up.")
    findings = SimpleNamespace(evidence=evidence, facts=facts, effects=(windup,), pairs=())
    conclusion = rule_for(facts).consequence(findings)
    assert conclusion.verdict == "unknown"
    assert conclusion.effects == ((windup,) if named else ())
    assert ("winds up" in conclusion.says) == named
    assert "82 times" in conclusion.says


@pytest.mark.parametrize(("rows", "verdict"), [(2, "insufficient"), (4.5, "insufficient"), (12, "adequate")])
def test_an_envelope_is_not_diagnosed(rows, verdict):
    """Two readings a turn of a drive whose error has orders 1 and 2: all of it folds onto what it is not, and a wave in
    it gets no name. Fault caught: `turns_suffice` without the rows a turn.
    """
    turns = 60
    theta = np.arange(int(turns * rows)) * 2 * np.pi / rows
    hidden = 0.0 if verdict == "adequate" else 0.5
    error = hidden * np.sin(2 * theta / 50 + 0.3) + np.random.default_rng(1).normal(0, 0.02, len(theta))
    table = {
        "time_s": 0.1 * theta,
        "input_angle_deg": np.degrees(theta),
        "output_angle_deg": np.degrees(theta / 50) - error / 60,
    }
    diagnosis = diagnose(recording_from_table(pd.DataFrame(table), 50.0), ratio=50.0)
    assert (diagnosis.verdict, diagnosis.effects) == (verdict, ())
    if verdict == "insufficient":
        assert "rows an input turn" in diagnosis.says
        assert "forty times an input turn" in diagnosis.separating_test


def test_a_scale_that_is_off_is_told_of_the_shaft_that_it_is_on():
    """Of the input where its angle counts too far, else of ratio or output; nothing where none was found."""

    def told(input_gain, found=True):
        scale = SimpleNamespace(found=found, input_gain=input_gain, ratio=120.12, gain=1.001)
        return scale_notes(SimpleNamespace(scale=scale, rows=SimpleNamespace(ratio=120.0)))

    (of_input,), (of_output,) = told(1.002), told(1.0)
    assert "the input angle counts 1.002 times too far" in of_input
    assert "as if the ratio were 120.12 in place of 120, or the output encoder's gain 1.001" in of_output
    assert told(1.002, found=False) == () == scale_notes(SimpleNamespace(scale=None))


def test_what_is_told_aside_is_told_with_its_numbers():
    """A clock in millionths, zeros by recording from the second, shares of k_e in per cent by waves a turn."""

    def evidence(told):
        terms = [SimpleNamespace(effect=effect) for effect in told]
        fit = SimpleNamespace(terms=terms, coefficients=[np.array(values) for values in told.values()])
        return SimpleNamespace(selection=SimpleNamespace(best=SimpleNamespace(fit=fit)))

    (slow,), (fast,) = skew_notes(evidence({SKEW: [2.5e-5]})), skew_notes(evidence({SKEW: [-4e-6]}))
    assert "runs 25 millionths slow" in slow and "runs -4 millionths fast" in fast
    (zeros,) = zero_notes(evidence({NEW_ZERO: [0.25, -1.5]}))
    assert zeros.endswith("0.25 arcmin in recording 2, -1.5 arcmin in recording 3")
    (contact,) = contact_notes(evidence({VARYING_CONTACT: [0.03, 0.04, 0.0, -0.12]}))
    assert contact.endswith("5 % at 1 a turn, 12 % at 2 a turn")
    assert skew_notes(evidence({"hysteresis": [1.0]})) == ()
