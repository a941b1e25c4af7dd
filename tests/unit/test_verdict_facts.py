"""What the rules look at, from numbers that are known: gains, ripples, rivals, remainders, confidence."""

import json
import lzma
from dataclasses import replace
from math import exp
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from test_verdict_rules import CLEAN, FIRED, NAMED, held

from hdopt.diagnosis.checks.assessment import Evidence
from hdopt.diagnosis.checks.confounding import Confounding
from hdopt.diagnosis.checks.other_laws import OtherLaw
from hdopt.diagnosis.checks.repeated_passes import NOTHING_REPEATED, RepeatedPasses
from hdopt.diagnosis.inference import fit as fitting
from hdopt.diagnosis.inference.catalogue import SCALE, SKEW, VARYING_CONTACT
from hdopt.diagnosis.inference.cross_validation import HeldOut
from hdopt.diagnosis.inference.hidden_turns import NestedHeldOut
from hdopt.diagnosis.search import candidates
from hdopt.diagnosis.search.penalty import Scale, penalty
from hdopt.diagnosis.settings import DEFAULT
from hdopt.diagnosis.verdict import facts as facts_module
from hdopt.diagnosis.verdict import rivals as rivals_module
from hdopt.diagnosis.verdict import rules
from hdopt.diagnosis.verdict.facts import (
    find,
    found_again,
    left_over_floor,
    own_gain,
    stands_out,
    too_little,
    unseen_gain,
    unseen_rms,
    varying_contact,
)
from hdopt.diagnosis.verdict.named_effect import NamedEffect, as_right_as_such_names, confidences
from hdopt.diagnosis.verdict.residual_structure import (
    beaten_by_generic,
    clearly_unexplained,
    gained_without_physics,
    left_over_passes,
    outside_share,
    power_together,
)
from hdopt.diagnosis.verdict.rivals import (
    ahead_without_physics,
    beside_told,
    hum_as_good,
    placebo_as_good,
    rivals,
    scale_is_as_good,
)
from hdopt.diagnosis.verdict.rules import rule_for
from hdopt.effects.term import Term

PROOF = Path(__file__).parents[2] / "docs" / "proof"
SWING = np.array([1.0, -1.0] * 50)
"""Of power one."""


def candidate(powers, log_bayes_factor=100.0, outside=False, residual=1.0):
    """A set of effects by the power of each."""
    terms = tuple(Term(name, {}, columns=SWING[:, None]) for name in powers)
    sizes = list(powers.values())
    fit = SimpleNamespace(
        terms=terms,
        contribution=lambda i: np.sqrt(sizes[i]) * SWING,
        contributions=np.sqrt(sum(sizes)) * SWING,
        residual=np.sqrt(residual) * SWING,
    )
    return SimpleNamespace(
        fit=fit, effects=tuple(powers), outside=outside, log_bayes_factor=log_bayes_factor, gain=2 * log_bayes_factor
    )


def evidence(*candidates, base=3.0, extended=1.0, **more):
    rows = SimpleNamespace(locked=False, blocks=20, span_turns=20.0, rows_per_turn=60.0, output_step=0.0)
    known = {
        "settings": DEFAULT,
        "rows": rows,
        "neighbours_arcmin": 0.0,
        "sensor_arcmin": 0.0,
        "sensors_noise": 0.0,
        "other_law": OtherLaw(),
        "passes": NOTHING_REPEATED,
        "nested": None,
        "unseen": more.get("nested"),
    }
    known |= {"high": None, "false_alarm_p": 0.002, "below_detection": {}}
    return SimpleNamespace(
        base_held_out=held(20, base),
        extended_held_out=held(20, extended),
        selection=SimpleNamespace(
            best=candidates[0] if candidates else None,
            candidates=candidates,
            base=SimpleNamespace(base_value=np.sqrt(more.pop("base_power", 0.0)) * SWING),
        ),
        **(known | more),
    )


def changes_of(facts):
    return {name: value for name, value in vars(facts).items() if value != getattr(CLEAN, name)}


ORDER = list(dict.fromkeys(name for name, _, _ in FIRED))


@pytest.mark.parametrize("first", range(len(ORDER)))
def test_an_earlier_rule_is_asked_before_every_later_one(first):
    """Facts that fire two rules are judged by the earlier: any two that are exchanged would be seen."""
    fires = {name: changes_of(facts) for name, facts, _ in reversed(FIRED)}
    for later in ORDER[first:]:
        both = replace(CLEAN, **(fires[later] | fires[ORDER[first]]))
        assert rule_for(both).name == ORDER[first]


def test_what_is_not_borne_out_is_located_in_its_largest_part(monkeypatch):
    """By its gain on held-out turns, 0.16 = 0.4^2, and named by nothing but a likeness."""
    monkeypatch.setattr(rules, "main_orders", lambda fit, contribution: [])
    found = evidence(candidate({"hysteresis": 0.1, "local_tooth_defect": 0.3}), base=1.16, extended=1.0)
    said = rules.unconfirmed(SimpleNamespace(evidence=found))
    assert (said.verdict, said.effects, said.where["domain"]) == ("unknown", (), "angle")
    assert said.where["rms_arcmin"] == pytest.approx(0.4)
    assert "hysteresis and local_tooth_defect" in said.says


def test_effects_gain_what_they_carry_themselves():
    """2 of 1 left where they carry it; twice their own power where a better drive beside them did the rest."""
    assert own_gain(evidence(candidate({"hysteresis": 2.0}))) == pytest.approx(2.0)
    assert own_gain(evidence(candidate({"hysteresis": 0.1}))) == pytest.approx(0.2)
    assert own_gain(evidence(candidate({"hysteresis": 0.1, SCALE: 5.0}))) == pytest.approx(0.2)


def test_turns_that_no_stage_saw_must_show_what_is_named():
    """Fault caught: a set that was chosen on all turns and predicts the hidden ones worse than the base is named."""
    assert unseen_gain(evidence(nested=NestedHeldOut(1.2, 1.0, 5, (), 1.2))) == pytest.approx(0.44)
    assert unseen_gain(evidence(nested=NestedHeldOut(0.9, 1.0, 5, (), 0.9))) < 0
    assert unseen_gain(evidence()) == np.inf
    assert replace(NAMED, unseen_gain=2.0, own_gain=2.0).carry_most
    assert not replace(NAMED, unseen_gain=0.5, own_gain=2.0).carry_most


def test_what_the_turns_left_prefer_is_held_against_the_hidden_ones():
    """What was proposed where they prefer it, else what was found on them. Fault caught: a search on a part that missed
    what is there makes what is named `unknown`.
    """
    found, proposed = (
        NestedHeldOut(2.0, 1.7, 5, ("hysteresis",), 2.0),
        NestedHeldOut(2.0, 1.1, 5, ("lost_motion",), 2.0),
    )
    assert Evidence.unseen.fget(SimpleNamespace(nested=found, proposed=proposed)) is proposed
    assert Evidence.unseen.fget(SimpleNamespace(nested=found, proposed=None)) is found
    # Whether turns that no stage saw show it is asked of what no stage saw alone.
    assert unseen_gain(evidence(nested=found, unseen=proposed)) == pytest.approx((2.0 / 1.7) ** 2 - 1)


def test_what_is_left_is_that_of_turns_that_no_stage_saw():
    hidden = NestedHeldOut(2.0, 1.7, 5, ("hysteresis", "lost_motion"), 2.0)
    assert unseen_rms(evidence(extended=4.0, nested=hidden)) == 1.7
    assert unseen_rms(evidence(extended=4.0)) == pytest.approx(2.0)
    one, other = SimpleNamespace(id="hysteresis"), SimpleNamespace(id="resonance")
    assert found_again(evidence(nested=hidden), [one]) and found_again(evidence(), [other])
    assert not found_again(evidence(nested=hidden), [one, other])


@pytest.mark.parametrize(("power", "base", "said"), [(0.5, 2.0, True), (0.01, 2.0, False), (0.5, 100.0, False)])
def test_a_ripple_stands_out_of_rows_and_of_what_else_was_found(power, base, said):
    """Half of the rows' power; a hundredth of it; half, beside a hundred that may leave a hundredth of itself there."""
    assert stands_out(candidate({"tooth_mesh": power}), evidence(base=base)) is said


@pytest.mark.parametrize(
    ("limits", "base_power", "changes", "said"),
    [
        ((5.0, 3.0, 0.1), 1.0, {}, True),
        ((5.0, 3.0, 0.1), 16.0, {}, False),
        ((), 1.0, {}, False),
        ((), 1.0, {"span_turns": 1.5}, True),
        ((), 1.0, {"blocks": 5}, True),
        ((), 1.0, {"rows_per_turn": 4.0}, True),
        ((), 1.0, {"blocks": 5, "locked": True}, False),
    ],
)
def test_too_little_is_short_sparse_or_below_most_limits(limits, base_power, changes, said):
    found = evidence(base_power=base_power, below_detection=dict(enumerate(limits)))
    found.rows = SimpleNamespace(**(vars(found.rows) | changes))
    assert too_little(found) is said


def test_rivals_are_other_sets_within_a_tie():
    """Kass and Raftery's 5: as large or smaller, of physics, and another set of effects than the one that is said."""
    best = candidate({"lost_motion": 1.0, "thermal_drift": 1.0}, 100.0)
    others = [
        candidate({"hysteresis": 1.0, "thermal_drift": 1.0}, 96.0),
        candidate({"channel_delay": 1.0}, 95.0),
        candidate({"output_coupling": 1.0}, 94.9),
        candidate({"hysteresis": 1.0, "output_coupling": 1.0, "thermal_drift": 1.0}, 99.0),
        candidate({"_sine_in_angle": 1.0}, 99.0, outside=True),
        candidate({"thermal_drift": 1.0, "lost_motion": 1.0}, 99.0),
        candidate({}, 98.0),
    ]
    assert rivals(evidence(best, *others), None) == (("hysteresis", "thermal_drift"), ("channel_delay",))


def test_where_there_is_a_tie_all_that_fit_no_worse_are_listed():
    """Play, a delay and friction within a row: friction fits a little better and pays for its length. Fault caught: a
    tie without the truth in it.
    """
    best, tied = candidate({"channel_delay": 1.0}, 100.0), candidate({"lost_motion": 1.0}, 96.0)
    better, worse = candidate({"hysteresis": 1.0}, 91.0), candidate({"thermal_drift": 1.0}, 91.0)
    better.gain, worse.gain, far = 201.0, 199.0, candidate({"resonance": 1.0}, 89.0)
    far.gain = 201.0
    assert rivals(evidence(best, tied, better, worse, far), None) == (("lost_motion",), ("hysteresis",))
    assert rivals(evidence(best, better), None) == ()


@pytest.mark.parametrize(("behind", "said"), [(4.0, True), (6.0, False)])
def test_a_scale_that_explains_as_well(behind, said):
    alone, beside = candidate({SCALE: 1.0}, 100 - behind), candidate({SCALE: 1.0, "hysteresis": 1.0}, 99.0)
    assert scale_is_as_good(evidence(candidate({"thermal_drift": 1.0}), beside, alone)) is said


@pytest.mark.parametrize(
    ("others", "there"),
    [
        ([candidate({"_mains": 1.0}, 96.0)], True),
        ([candidate({"_mains": 1.0}, 94.0)], False),
        ([candidate({"_mains": 1.0, "hysteresis": 1.0}, 99.0)], False),
        ([candidate({"_sine_in_time": 1.0}, 99.0)], False),
        ([], False),
    ],
)
def test_hum_that_explains_as_well(others, there):
    """With no more terms, within a tie, on the averaged rows or on those recorded. Faults caught: any sine for hum, a
    larger set with hum, either search left out."""
    encoder = candidate({"encoder_interpolation": 1.0})
    low, high = evidence(encoder, *others), SimpleNamespace(candidates=(encoder, *others))
    assert (hum_as_good(low, None) is not None) is there
    without = evidence(encoder, high=high)
    assert (hum_as_good(without, encoder) is not None) is there
    assert hum_as_good(without, None) is None
    for found in (hum_as_good(low, None), hum_as_good(without, encoder)):
        assert found is None or found == (others[0].fit, 0)


def test_hum_that_is_found_is_no_rival_of_itself():
    best, other = candidate({"_mains": 1.0, "hysteresis": 1.0}), candidate({"lost_motion": 1.0, "_mains": 1.0}, 99.0)
    assert hum_as_good(evidence(best, other), None) is None


def opposed(powers):
    """A set of effects by the power of each, every second against the others."""
    best = candidate(powers)
    sizes = [(-1) ** i * np.sqrt(power) for i, power in enumerate(powers.values())]
    best.fit.contribution = lambda i: sizes[i] * SWING
    best.fit.problem = SimpleNamespace(base=None)
    return best


@pytest.mark.parametrize(
    ("powers", "together"),
    [
        ({"hysteresis": 0.25}, 1.0),
        ({"output_coupling": 1.0, "cs_tooth_harmonics": 0.81}, 0.01 / 1.81),
        ({"output_coupling": 1.0, SCALE: 1.0, "cs_tooth_harmonics": 1.0}, 2.0),
        ({SCALE: 1.0}, 1.0),
    ],
)
def test_what_effects_do_together(powers, together):
    """Of the whole, a scale aside: two of 1.0 and 0.9 arcmin against each other leave 0.1. Faults caught: amplitudes
    added for powers, what is told counted."""
    assert power_together(opposed(powers)) == pytest.approx(together)


def test_effects_that_cancel_are_no_names(monkeypatch):
    """Its sentence says what they leave together, 0.1 arcmin, and how large they would be."""
    monkeypatch.setattr(rules, "main_orders", lambda fit, contribution: [])
    found = evidence(opposed({"output_coupling": 1.0, "cs_tooth_harmonics": 0.81}))
    facts = replace(NAMED, together=0.01 / 1.81)
    said = rule_for(facts).consequence(SimpleNamespace(evidence=found, facts=facts))
    assert (said.verdict, said.effects, said.where["domain"]) == ("unknown", (), "order")
    assert said.where["rms_arcmin"] == pytest.approx(0.1)
    assert "resembles output_coupling and cs_tooth_harmonics" in said.says and "1.3 arcmin rms" in said.says


def test_what_stands_beside_a_far_drive_is_no_name(monkeypatch):
    """The axis 0.044 mm off where 0.03 is the prior's standard deviation: a warning alone left a plain name."""
    monkeypatch.setattr(rules, "main_orders", lambda fit, contribution: [])
    best = opposed({"bearing_pass": 0.16})
    best.fit.problem = SimpleNamespace(base=object(), prior=np.full(12, 0.03), settings=DEFAULT)
    best.fit.errors = np.r_[-0.044, np.zeros(11)]
    facts = replace(NAMED, far_base=True)
    said = rule_for(facts).consequence(SimpleNamespace(evidence=evidence(best), facts=facts))
    assert (said.verdict, said.effects) == ("unknown", ())
    assert said.where["rms_arcmin"] == pytest.approx(0.4)
    assert "resembles bearing_pass" in said.says and "axis eccentricity x -0.044 mm" in said.says


@pytest.mark.parametrize("run", sorted(path.name[:7] for path in PROOF.glob("run-*.keys.jsonl.xz")))
def test_effects_that_were_hidden_together_do_not_cancel(run):
    """The threshold below which names are refused, held against every pair and triple that was ever drawn: nine, a
    delay against play or friction each."""
    keys = [json.loads(line) for line in lzma.open(PROOF / f"{run}.keys.jsonl.xz", "rt")]
    of_several = [key for key in keys if len(key["effects"]) > 1]
    shares = [
        key["hidden_rms_arcmin"] ** 2 / sum(part**2 for part in key["part_rms_arcmin"].values()) for key in of_several
    ]
    cancel = [share for share in shares if share < 2 * DEFAULT.verdict.together]
    with_one = ("run-016", "run-019", "run-020", "run-022", "run-023", "run-024", "run-026", "run-027", "run-028")
    assert len(cancel) == (run in with_one)


def told_and_more(gain=160.0, power=1.0, told=SCALE, of="hysteresis", worth=100.0):
    """A told explanation of gain 100, and a set that explains more beside it; each pays log(1000)/2 and 1 a term."""
    alone = candidate({told: 1.0}, worth)
    both = candidate({told: 1.0, of: power})
    alone.gain, both.gain = 100.0, gain
    problem = SimpleNamespace(weighed_rows=1000, settings=DEFAULT)
    found = evidence(alone, both, inflation=1.0)
    found.selection.base.problem = problem
    return found


@pytest.mark.parametrize(
    "changes",
    [
        {"gain": 100.0},  # nothing more explained
        {"power": 0.04},  # small beside the noise, whose power is one
        {"told": VARYING_CONTACT},  # its shape is not exact, something is always left
        {"of": SKEW},  # two that are told
        {"told": "thermal_drift"},  # a name, not told
        {"worth": -2.0},  # told in words only: less likely than the drive alone
    ],
)
def test_what_adds_to_what_is_told_is_seen(changes):
    """Fault caught: relaxation after a reversal, explained by a clock that runs slow and friction beside it, was
    adequate. Half of 60 noise variances less what one more effect pays."""
    found, apart = beside_told(told_and_more())
    one_more = penalty(found.fit.terms, 0.0, Scale(1000)) - penalty(found.fit.terms[:1], 0.0, Scale(1000))
    assert found.effects == (SCALE, "hysteresis")
    assert apart == pytest.approx(30.0 - one_more)
    assert beside_told(told_and_more(**changes)) == (None, 0.0)


def test_what_adds_to_what_is_told_is_located_and_likened(monkeypatch):
    """Its own power, 0.5 of the base's 3; the place is that of friction, not of the scale, which is larger."""
    monkeypatch.setattr(rules, "main_orders", lambda fit, contribution: [])
    found = told_and_more(power=0.5)
    said = rules.more(SimpleNamespace(evidence=found, more=beside_told(found)[0]))
    assert (said.verdict, said.effects, said.where["domain"]) == ("unknown", (), "reversal")
    assert said.where["rms_arcmin"] == pytest.approx(0.5**0.5)
    assert said.where["share_of_residual"] == pytest.approx(0.5 / 3)
    assert "most resembles hysteresis" in said.says


def named_and_described(gain=220.0, best=("encoder_output_eccentricity", SCALE), other="_bump"):
    """A best set that gains 200 noise variances, and another of one term that gains `gain`; each pays for freedom."""
    first, second = candidate(dict.fromkeys(best, 1.0)), candidate({other: 1.0}, outside=other.startswith("_"))
    first.gain, second.gain = 200.0, gain
    found = evidence(first, second, inflation=1.0)
    found.selection.base.problem = SimpleNamespace(weighed_rows=1000, settings=DEFAULT)
    return found


def test_a_description_that_explains_more_than_exact_shapes_is_seen():
    """Half of 20 noise variances more, and one term less to pay for. Fault caught: a power of the travel, named an
    eccentric encoder beside a ratio that is off, though a slow sine explains it better."""
    found = named_and_described()
    first, second = (one.fit.terms for one in found.selection.candidates)
    less = penalty(first, 0.0, Scale(1000)) - penalty(second, 0.0, Scale(1000))
    assert ahead_without_physics(found) == pytest.approx(10.0 + less)
    assert ahead_without_physics(named_and_described(gain=100.0)) < 0
    assert ahead_without_physics(named_and_described(other="hysteresis")) == 0.0
    # Of an inexact shape something is always left.
    assert ahead_without_physics(named_and_described(best=("thermal_drift",))) == 0.0
    assert ahead_without_physics(named_and_described(best=("encoder_output_eccentricity", VARYING_CONTACT))) != 0.0
    # What an effect takes part in is no description.
    mixed = named_and_described()
    mixed.selection.candidates[1].effects = ("_bump", "hysteresis")
    assert ahead_without_physics(mixed) == 0.0


def test_the_waves_of_a_varying_contact_are_told():
    """0.3 and 0.4 are 0.5. Faults caught: sine and cosine of different waves together, another term's numbers."""
    terms = tuple(Term(name, {}) for name in (VARYING_CONTACT, "hysteresis"))
    fit = SimpleNamespace(terms=terms, coefficients=(np.array([0.1, 0.2, -0.3, 0.4]), np.array([7.0, 7.0])))
    assert varying_contact(fit) == pytest.approx([0.05**0.5, 0.5])
    assert varying_contact(SimpleNamespace(terms=terms[1:], coefficients=fit.coefficients[1:])) == []


def test_what_is_described_better_or_follows_no_contact_is_likened(monkeypatch):
    """Its place is that of the effect, not of what is told; the size is that of the effects, or of all that is gained
    on held-out turns, 0.16 = 0.4^2."""
    monkeypatch.setattr(rules, "main_orders", lambda fit, contribution: [])
    found = evidence(candidate({"hysteresis": 0.25, SCALE: 3.0}), base=1.16, extended=1.0)
    said = rules.described(SimpleNamespace(evidence=found))
    assert (said.verdict, said.effects, said.where["domain"]) == ("unknown", (), "reversal")
    assert said.where["rms_arcmin"] == pytest.approx(0.5)
    assert "most resembles hysteresis; but a description without physics" in said.says
    said = rules.of_one_course(SimpleNamespace(evidence=found))
    assert (said.verdict, said.effects, said.where["rms_arcmin"]) == ("unknown", (), pytest.approx(0.5))
    assert "most resembles hysteresis; but one smooth course of time" in said.says
    assert "to and fro" in said.separating_test
    said = rules.no_contact(SimpleNamespace(evidence=found, facts=replace(NAMED, contact=0.31)))
    assert (said.verdict, said.effects, said.where["domain"]) == ("unknown", (), "reversal")
    assert said.where["rms_arcmin"] == pytest.approx(0.4)
    assert "by 31 % round the turn" in said.says


def test_a_placebo_must_reach_the_gain():
    """Half of it, in errors whose turns differ too little to say so: no explanation."""
    half = HeldOut(np.full(20, 2.0), np.full(20, 1.0), np.ones(20))
    found = evidence(candidate({"lost_motion": 2.0}), placebo="hysteresis", placebo_held_out=half)
    assert placebo_as_good(found, []) == ()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, True),
        ({"t": 3.9}, False),
        ({"extended": 1.3}, False),
        ({"extended": 1.03, "base": 1.04}, False),
        ({"base_power": 600.0}, False),
        ({"high": 10.0}, False),
    ],
)
def test_what_is_left_counts_where_it_is_sure_and_a_fair_part(changes, said):
    """Left is 1 of 2 that can be explained, over noise of 1: with t below 4; 0.3 of 2; 0.03 beside noise of 1; less
    than the model's own error; a small part of what the high orders explain."""
    given = {"extended": 2.0, "base": 3.0, "base_power": 0.0, "t": 5.0} | changes
    high = SimpleNamespace(best=candidate({"tooth_mesh": given.pop("high")})) if "high" in given else None
    remainder = SimpleNamespace(held_out=held(20, 1.0), t=given.pop("t"))
    found = evidence(**given, remainder=remainder, generic_held_out=held(20, 1.0), high=high)
    assert clearly_unexplained(found) is said


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, True),
        ({"swing": 0.12}, False),  # t is 0.09 / 0.1231 * 20**0.5 = 3.27: a chance of 0.2 %
        ({"swing": 0.1}, True),  # t is 3.92: a chance of 0.05 %
        ({"extended": 1.03}, False),  # less than a noise's own share
        ({"base": 1.0}, False),  # the base alone does as well: nothing is claimed for what is beside it
        ({"base_power": 1e5}, False),  # below the model's resolution
    ],
)
def test_a_basis_without_physics_that_predicts_better_alone_wins(changes, said):
    """Held-out errors of 1.09 with the effects and 1 with the basis alone, turn by turn apart by 0.09 +- 0.02."""
    given = {"extended": 1.09, "base": 3.0, "swing": 0.02, "base_power": 0.0} | changes
    white = np.full(20, given["extended"]) + given["swing"] * SWING[:20]
    found = evidence(base=given["base"], base_power=given["base_power"], generic_held_out=held(20, 1.0))
    found.extended_held_out = HeldOut(np.full(20, given["extended"]), white, np.ones(20))
    assert beaten_by_generic(found) is said


@pytest.mark.parametrize(("ripple", "said"), [({"tooth_mesh": 8.0}, True), ({"tooth_mesh": 10.0}, False)])
def test_teeth_of_a_mesh_may_differ_from_each_other(ripple, said):
    """An excess of 0.09 is more than a hundredth of a mesh of 8, and less than that of 10; lines of an encoder leave
    nothing. Would catch a right mesh that is called incomplete for the unlike height of its teeth."""
    for high, expected in ((ripple, said), ({"encoder_interpolation": 10.0}, True)):
        found = evidence(base=3.0, generic_held_out=held(20, 1.0), high=SimpleNamespace(best=candidate(high)))
        found.extended_held_out = HeldOut(np.full(20, 1.09), np.full(20, 1.09) + 0.02 * SWING[:20], np.ones(20))
        assert beaten_by_generic(found) is expected


def test_what_beats_the_effects_is_told_beside_them(monkeypatch):
    """With a name it is said and more; without one, that something is there."""
    where = {"domain": "speed", "rms_arcmin": 0.1, "orders_per_input_turn": [], "direction": "both"}
    monkeypatch.setattr(rules, "locate_remainder", lambda evidence: where)
    named = SimpleNamespace(id="lost_motion", says="Play.")
    with_a_name = rules.named_and_beaten(SimpleNamespace(evidence=None, facts=NAMED, effects=(named,)))
    without = rules.named_and_beaten(SimpleNamespace(evidence=None, facts=CLEAN, effects=()))
    assert (with_a_name.verdict, with_a_name.effects) == ("unknown", (named,))
    assert (without.verdict, without.effects) == ("unknown", ())


def test_the_share_without_physics_is_of_all_that_is_explained():
    assert outside_share(candidate({"hysteresis": 3.0, "_sine_in_angle": 1.0})) == pytest.approx(0.25)


def test_what_is_gained_by_descriptions_alone_is_known_by_leaving_them_out(monkeypatch):
    """The rest is fitted again, from where it stands: an objective of 16 in place of 12, in noise of variance 2, of 5
    noise variances gained. Faults caught: the effect left out in its place, the rest not fitted again."""
    asked = []

    def evaluate(problem, errors, offsets, terms, coefficients):
        asked.append(([term.effect for term in terms], coefficients, errors, offsets))
        return SimpleNamespace(objective=40.0)

    monkeypatch.setattr(fitting, "evaluate", evaluate)
    monkeypatch.setattr(candidates, "refine", lambda fit, iterations: SimpleNamespace(objective=16.0))
    found = candidate({"hysteresis": 3.0, "_jump": 1.0})
    found.gain = 5.0
    problem = SimpleNamespace(settings=DEFAULT, noise=SimpleNamespace(sigma=2**0.5))
    vars(found.fit).update(
        problem=problem, errors="drive", offsets="zeros", coefficients=[[3.0], [1.0]], objective=12.0
    )
    assert gained_without_physics(found) == pytest.approx(2.0 / 5.0)
    assert asked == [(["hysteresis"], [[3.0]], "drive", "zeros")]
    assert gained_without_physics(candidate({"hysteresis": 3.0, SCALE: 1.0})) == 0.0


def test_confidence_is_the_weight_of_the_sets_that_hold_an_effect():
    """Two sets 2 apart, flattened by 2: 1 to exp(-1), less the chance of a false alarm."""
    pair = (candidate({"hysteresis": 1.0, "thermal_drift": 1.0}, 10.0), candidate({"thermal_drift": 1.0}, 8.0))
    found = confidences(evidence(*pair, false_alarm_p=0.2))
    assert DEFAULT.verdict.flatten == 2.0
    assert found["hysteresis"] == pytest.approx(0.8 / (1 + exp(-1)))
    assert found["thermal_drift"] == pytest.approx(0.8)
    assert confidences(evidence(*pair, false_alarm_p=0.0))["thermal_drift"] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("names", "left", "floor", "odds"),
    [
        (1, 1.0, 1.0, 3.59),
        (1, 0.9, 1.0, 3.59),
        (3, 1.0, 1.0, 3.59 - 2 * 0.31),
        (1, 1.05, 1.0, 3.59 - 24.0 * np.log(1.05)),
        (2, 2.1, 2.0, 3.59 - 0.31 - 24.0 * np.log(1.05)),
        (1, 1.4, 1.0, 3.59 - 24.0 * np.log(1.1)),
    ],
)
def test_no_name_is_surer_than_such_names_were_right(names, left, floor, odds):
    """Faults caught: names that are not counted, or the one itself too; held-out power for error, or error not over the
    floor; surer below the floor; slopes beyond where they were learned."""
    found = evidence(candidate({"hysteresis": 1.0}), extended=left**2, noise_floor=floor)
    said = [NamedEffect("hysteresis", 0.8, {}, {}, "")] * names
    sure = as_right_as_such_names(said, found)
    assert [one.confidence for one in sure] == pytest.approx([0.8 / (1 + exp(-odds))] * names)


@pytest.mark.parametrize(
    ("passes", "more", "over"),
    [
        (RepeatedPasses(0.3, 0.4, 20, 9.0), {}, 0.5 / 0.3),
        (RepeatedPasses(0.3, 0.4, 20, 3.9), {}, 1.0),  # by chance
        (RepeatedPasses(0.3, 0.4, 20, 9.0), {"sensor_arcmin": 0.45}, 0.5 / 0.45),  # steps come again as well
        (RepeatedPasses(0.3, 0.4, 20, 9.0), {"base": 2.0}, 1.0),  # 0.16 of a gain of 1: another shape of it
        (RepeatedPasses(0.3, 0.4, 20, 9.0), {"base_power": 201.0**2}, 1.0),  # below the model's own accuracy
    ],
)
def test_what_is_left_is_held_against_what_differs_from_pass_to_pass(passes, more, over):
    said = evidence(candidate({"hysteresis": 1.0}), passes=passes, **({"base": 1.0} | more))
    assert left_over_passes(said) == pytest.approx(over)


@pytest.mark.parametrize(
    ("floor", "base_power", "noise", "ratio"),
    [
        (0.5, 1.0, 0.0, 2.0),
        (1.0, 1.0, 0.0, 1.0),
        (0.5, 1e6, 0.0, 1.0),  # between the two 0.87, of which the model resolves 2
        (0.5, 1.0, 10.0, 1.0),  # a tenth of the noise between neighbours is 1
    ],
)
def test_what_is_left_over_the_floor_counts_where_it_is_resolved(floor, base_power, noise, ratio):
    """1 arcmin is left, and a generic basis leaves less. Fault caught: `adequate` for whatever has no name."""
    found = SimpleNamespace(
        settings=DEFAULT,
        rows=SimpleNamespace(output_step=0.0),
        extended_held_out=SimpleNamespace(rms=1.0),
        noise_floor=floor,
        neighbours_arcmin=noise,
        sensor_arcmin=0.0,
        selection=SimpleNamespace(base=SimpleNamespace(base_value=np.sqrt(base_power) * SWING)),
    )
    assert left_over_floor(found) == pytest.approx(ratio)


def test_facts_are_drawn_from_what_measures_them(monkeypatch):
    """Faults caught: a measure that never reaches the rules, the smaller of the two shares of descriptions, one wave of
    a contact for all of them."""
    no = dict.fromkeys(("turns_suffice", "momentary", "clearly_unexplained", "too_little", "scale_is_as_good"), False)
    no |= dict.fromkeys(("is_a_walk", "above_resolution", "beaten_by_generic", "found_again"), False)
    no |= dict.fromkeys(("own_gain", "power_together", "unseen_gain", "unseen_rms", "left_over_passes"), 0.0)
    no |= {"unsteady": None, "far_errors": "", "left_over_floor": 0.0, "beside_told": (None, 0.0), "hum_as_good": None}
    no |= {"as_right_as_such_names": (), "effects_said": (), "shared_with_imitators": ()}
    measured = {"varying_contact": [0.2, 0.4, 0.4], "ahead_without_physics": 7.0, "told_by_a_course": 8.0}
    for name, value in {**no, **measured}.items():
        monkeypatch.setattr(facts_module, name, lambda *about, value=value, **more: value)
    more = {"noise_floor": 1.0, "remainder": SimpleNamespace(t=0.0), "inflation": 1.0}
    found = evidence(candidate({"hysteresis": 1.0}), **more)
    for by_power, by_gain in ((0.1, 0.3), (0.3, 0.1)):
        monkeypatch.setattr(facts_module, "outside_share", lambda best, share=by_power: share)
        monkeypatch.setattr(facts_module, "gained_without_physics", lambda best, share=by_gain: share)
        drawn = find(found).facts
        assert (drawn.outside_share, drawn.contact) == (0.3, pytest.approx(0.6))
        assert (drawn.described_better, drawn.course) == (7.0, 8.0)


def test_what_a_part_may_be_is_another_explanation(monkeypatch):
    """Beside those that are candidates, placebos and imitators. Would catch one of the four that is not listed, and
    what is not said likened to others."""
    no = dict.fromkeys(("turns_suffice", "momentary", "clearly_unexplained", "too_little", "scale_is_as_good"), False)
    no |= dict.fromkeys(("is_a_walk", "above_resolution", "beaten_by_generic", "found_again"), False)
    no |= dict.fromkeys(("own_gain", "power_together", "unseen_gain", "unseen_rms", "left_over_passes"), 0.0)
    no |= {"unsteady": None, "far_errors": "", "left_over_floor": 0.0, "beside_told": (None, 0.0), "hum_as_good": None}
    no |= {"as_right_as_such_names": (), "effects_said": (), "shared_with_imitators": (), "confounded_pairs": ()}
    no |= {"varying_contact": [], "ahead_without_physics": 0.0, "outside_share": 0.0, "gained_without_physics": 0.0}
    no |= {"told_by_a_course": 0.0}
    lists = ("rivals", "placebo_as_good", "imitating_sets", "sets_with_a_part")
    more = {"noise_floor": 1.0, "remainder": SimpleNamespace(t=0.0), "inflation": 1.0}
    found = evidence(candidate({"hysteresis": 1.0}), **more)
    for name, value in {**no, **{one: ((one,),) for one in lists}}.items():
        monkeypatch.setattr(facts_module, name, lambda *about, value=value, **more: value)
    monkeypatch.setattr(facts_module.Facts, "named", property(lambda facts: True))
    monkeypatch.setattr(facts_module.Facts, "said", property(lambda facts: True))
    effects = (NamedEffect("hysteresis", 0.9, {}, {}, ""),)
    monkeypatch.setattr(facts_module, "as_right_as_such_names", lambda *about: effects)
    monkeypatch.setattr(facts_module, "shared_with_imitators", lambda *about: effects)
    asked = []
    monkeypatch.setattr(facts_module, "confounded_pairs", lambda *about: asked.append(about[-1]) or ())
    found.settings = replace(found.settings, verdict=replace(found.settings.verdict, most_rivals=9))
    assert set(find(found).facts.rivals) == {(one,) for one in lists}
    assert asked == [["hysteresis"]]


@pytest.mark.parametrize("said", [("tooth_mesh",), ("hysteresis", "tooth_mesh"), ("hysteresis",), ()])
def test_what_is_not_said_is_likened_to_nothing(monkeypatch, said):
    """A lobe smaller than the model's resolution beside a mesh that is said stopped a diagnosis with KeyError. Every
    effect of both searches that is not said is left out of the pairs; fault caught: those of all terms."""
    found = evidence(candidate({"hysteresis": 1.0, "circular_spline_lobing": 1e-9, SCALE: 1.0}), lacking={})
    found.inflation, found.rows.ratio, found.rows.highest_order = 1.0, 80.0, 20.0
    high = candidate({"tooth_mesh": 1.0, "_any_order": 1.0})
    high.fit.terms = tuple(replace(term, shape={"sidebands": (0,)}) for term in high.fit.terms)
    high.fit.problem = SimpleNamespace(rows=SimpleNamespace(rows_per_turn=400.0))

    def alike(fit, index, inflation=1.0, others=(), order_range=None):
        name = fit.terms[index].effect
        return [Confounding(name, "resonance", 1.0, 1.0, 0.0, "record at two speeds")]

    monkeypatch.setattr(rivals_module, "confounded_with", alike)
    pairs = rivals_module.confounded_pairs(found, True, high, said)
    assert sorted(pair.effect for pair in pairs) == sorted(said)
    effects = [NamedEffect(name, 0.9, {"rms_arcmin": 1.0}, {}, "") for name in said]
    shared = rivals_module.shared_with_imitators(effects, pairs, (), DEFAULT.verdict)
    assert [one.confidence for one in shared] == [pytest.approx(0.45)] * len(said)
