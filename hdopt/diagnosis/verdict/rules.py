"""The rules of the verdict, in their order: the first whose condition holds says what is said."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hdopt.diagnosis.checks.assessment import Evidence
from hdopt.diagnosis.checks.confounding import Confounding
from hdopt.diagnosis.inference.base_fit import far_errors
from hdopt.diagnosis.inference.catalogue import TOLD, properties_of
from hdopt.diagnosis.search.candidates import Candidate
from hdopt.diagnosis.verdict.facts import Facts, Findings, sparse, unseen_rms
from hdopt.diagnosis.verdict.named_effect import NamedEffect, main_orders
from hdopt.diagnosis.verdict.residual_structure import (
    effect_powers,
    explained_power,
    in_what_way,
    locate_remainder,
    locate_repeated,
    place,
    term_powers,
    where_outside,
)
from hdopt.diagnosis.verdict.rivals import Sets, separating_measurement, tied_pairs
from hdopt.diagnosis.verdict.where import Where
from hdopt.effects import EFFECTS

MORE_TURNS = "record more turns of the same motion: what is there stays, whichever of them are left out"
"""What tells whether something is there that a part of the turns does not show."""


@dataclass(frozen=True)
class Conclusion:
    """What a rule concludes: the verdict and its sentence, with what belongs to it in the JSON."""

    verdict: str
    says: str
    effects: tuple[NamedEffect, ...] = ()
    ambiguous_with: Sets = ()
    separating_test: str | None = None
    where: Where | None = None
    confounded: tuple[Confounding, ...] = ()


@dataclass(frozen=True)
class Rule:
    """One rule: its `name`, the `condition` on the facts, and the `consequence` that it draws from the findings."""

    name: str
    condition: Callable[[Facts], bool]
    consequence: Callable[[Findings], Conclusion]


def happened_once(facts: Facts) -> bool:
    """Something that happened at one moment, and that no held-out turn can show again, is most of what is there.
    `facts` are those of the recording.
    """
    return facts.turns_suffice and facts.momentary


def comes_again(facts: Facts) -> bool:
    """What is left is far above what differs from pass to pass over the same angles: noise does not come again.
    `facts` are those of the recording.
    """
    return facts.turns_suffice and facts.left_over_passes > facts.settings.left_over_passes


def no_physics_explains(facts: Facts) -> bool:
    """Descriptions without physics carry too much of what explains, in the averaged rows or in the high orders.
    `facts` are those of the recording.
    """
    share = facts.settings.remainder_share
    return (facts.described and facts.outside_share > share) or (facts.high and facts.high_outside_share > share)


def changes_in_time(facts: Facts) -> bool:
    """Something changes in time as no noise does. `facts` are those of the recording."""
    return facts.turns_suffice and facts.unsteady


def is_no_memory(facts: Facts) -> bool:
    """Something else speaks for structure than a basis without physics that predicts held-out turns, or that does so
    by far: of noise with a memory of turns it predicts some from the turns beside. `facts` are those of the recording.
    """
    other = facts.explained or facts.high or facts.significant
    return other or facts.generic_t > facts.settings.remainder_t_alone


def generic_basis_wins(facts: Facts) -> bool:
    """A basis without physics predicts unseen turns clearly better than what explains, and that is no memory of the
    noise. `facts` are those of the recording.
    """
    return facts.turns_suffice and facts.generic_wins and is_no_memory(facts)


def more_than_noise_is_left(facts: Facts) -> bool:
    """Beside what is said, held-out turns are predicted clearly worse than a basis without physics could: more is
    there. `facts` are those of the recording.
    """
    much = facts.heldout_over_floor > facts.settings.heldout_over_floor
    return facts.said and much and facts.generic_t > facts.settings.remainder_t


def beaten_without_physics(facts: Facts) -> bool:
    """A basis without physics, alone, predicts unseen turns better than what explains. `facts` are those of the
    recording.
    """
    return facts.turns_suffice and facts.beaten_by_generic


def misses_unseen(facts: Facts) -> bool:
    """What is said was found without the turns that were hidden, but does not predict them. `facts` are those of the
    recording.
    """
    return facts.said and facts.heldout_over_floor > facts.settings.unseen_over_floor


def not_found_again(facts: Facts) -> bool:
    """What is said was not all found without the turns that were hidden, and misses these by clearly more than noise.
    `facts` are those of the recording.
    """
    return facts.said and not facts.found_again and facts.heldout_over_floor > facts.settings.heldout_over_floor


def too_much_for_noise(facts: Facts) -> bool:
    """What is left is far above what neighbouring samples and the sensors' steps show, and no walk either: no sensor
    makes such noise. `facts` are those of the recording.
    """
    far = facts.noise_over_neighbours > facts.settings.noise_over_neighbours
    return facts.turns_suffice and far and not facts.walk


def not_confirmed(facts: Facts) -> bool:
    """More than chance explains, and by more than clean drives show, but turns that no stage saw do not bear out what:
    neither a name nor nothing. `facts` are those of the recording.
    """
    return facts.found and not facts.said and facts.own_gain > facts.settings.unconfirmed_share


def more_than_is_told(facts: Facts) -> bool:
    """Nothing is said, and a scale, a clock or a zero that is off explains, but not all: what adds to it is clearly no
    noise. `facts` are those of the recording.
    """
    return facts.turns_suffice and not facts.said and facts.beside_told > facts.settings.beside_told_evidence


def something_is_left(facts: Facts) -> bool:
    """Nothing is said, but a basis without physics predicts held-out turns better than the base and what is told do, by
    more than any clean recording shows, and that is no memory of the noise. `facts` are those of the recording.
    """
    s = facts.settings
    much = facts.left_over_floor > s.adequate_over_floor and facts.generic_t > s.placebo_t
    return facts.turns_suffice and not facts.said and much and is_no_memory(facts)


def another_law_explains(facts: Facts) -> bool:
    """Effects are named, and one of them follows another law than its own. `facts` are those of the recording."""
    return facts.named and facts.other_law > facts.settings.other_law


def hum_explains_as_well(facts: Facts) -> bool:
    """Effects are named, and hum of the mains in the place of one explains as well. `facts` are those of the
    recording.
    """
    return facts.said and facts.hum_as_good


def effects_cancel(facts: Facts) -> bool:
    """Effects are named that nearly cancel each other: two that have nothing to do with each other do not, but what
    stands for something else may. `facts` are those of the recording.
    """
    return facts.named and facts.together < facts.settings.together


def drive_is_far(facts: Facts) -> bool:
    """Effects are named beside a drive far outside the tolerances of its kind, which stands for something that is left
    out. `facts` are those of the recording.
    """
    return facts.named and facts.far_base


def contact_varies_too_much(facts: Facts) -> bool:
    """The drive's own error would have to grow and shrink round the turn by more than a contact makes it. `facts` are
    those of the recording.
    """
    return facts.turns_suffice and facts.significant and facts.contact > facts.settings.contact_as_built


def is_described_better(facts: Facts) -> bool:
    """Effects of exact shape are named, and a description without physics explains more. `facts` are those of the
    recording.
    """
    return facts.named and facts.described_better > facts.settings.tie


def one_course_tells_all(facts: Facts) -> bool:
    """Effects are named, and one smooth course of time tells all that is slow in them with less. `facts` are those of
    the recording.
    """
    return facts.named and facts.course > facts.settings.tie


def others_are_as_good(facts: Facts) -> bool:
    """Effects are named, and another set explains as well. `facts` are those of the recording."""
    return facts.said and bool(facts.rivals)


def unknown(findings: Findings) -> Conclusion:
    """Something is there that the catalogue does not hold, and this is where. `findings` hold the facts and the
    evidence behind them.
    """
    where = locate_remainder(findings.evidence)
    return Conclusion(
        "unknown",
        f"Something the catalogue does not hold is there: {where['rms_arcmin']:.2g} arcmin rms, "
        f"mostly in {where['domain']}{in_what_way(where)}.",
        separating_test="record again at another speed, torque and temperature, one at a time, and see which of them "
        "moves it",
        where=where,
    )


def no_noise(findings: Findings) -> Conclusion:
    """What is left is more than the sensors' noise, whatever it is; effects that carry most of what was there are said
    beside it. `findings` hold the facts and the evidence behind them.
    """
    evidence = findings.evidence
    effects = findings.effects if findings.facts.carry_most else ()
    rms = math.sqrt(max(evidence.extended_held_out.variance - evidence.sensors_noise**2, 0.0))
    where = locate_remainder(evidence) | {"rms_arcmin": rms, "share_of_residual": 1.0}
    says = "".join(f"{found.says} " for found in effects)
    says += (
        f"What is left, {evidence.extended_held_out.rms:.2g} arcmin rms, is {findings.facts.noise_over_neighbours:.2g} "
        "times what neighbouring samples and the sensors' steps show: no sensor makes such noise, and the catalogue "
        "does not explain it."
    )
    test = "record the same motion again: what repeats is the drive's, what does not is the bench's"
    return Conclusion("unknown", says, effects, separating_test=test, where=where)


def no_chance(findings: Findings) -> Conclusion:
    """What is left comes again at the same angles; effects that carry most of what was there are said beside it.
    `findings` hold the facts and the evidence behind them.
    """
    evidence, facts = findings.evidence, findings.facts
    effects = findings.effects if facts.carry_most and not no_physics_explains(facts) else ()
    where = locate_repeated(evidence)
    says = "".join(f"{found.says} " for found in effects)
    says += (
        f"What is left comes again at the same input angles, {where['rms_arcmin']:.2g} arcmin rms of it, where only "
        f"{evidence.passes.scatter:.2g} differ from pass to pass: that is no noise, and the catalogue does not "
        "explain it."
    )
    test = "pass the same angles at another load and speed: what stays where it is belongs to the teeth or an encoder"
    return Conclusion("unknown", says, effects, separating_test=test, where=where)


def named_and_more(findings: Findings) -> Conclusion:
    """What is named is there, and more that the catalogue does not hold. `findings` hold the facts and the evidence
    behind them.
    """
    where = locate_remainder(findings.evidence)
    says = " ".join(found.says for found in findings.effects)
    says += (
        f" More is there that this does not explain: {where['rms_arcmin']:.2g} arcmin rms, mostly in {where['domain']}."
    )
    test = "take what is named away, or record without it, and see what stays"
    return Conclusion("unknown", says, findings.effects, separating_test=test, where=where)


def named_and_beaten(findings: Findings) -> Conclusion:
    """What is beaten by a basis without physics, which is said beside it where there is a name. `findings` hold the
    facts and the evidence behind them.
    """
    return named_and_more(findings) if findings.facts.said else unknown(findings)


def not_by_its_law(findings: Findings) -> Conclusion:
    """What is there resembles an effect, but follows another law of speed, time or direction. `findings` hold the facts
    and the evidence behind them.
    """
    evidence = findings.evidence
    best, index, of = evidence.selection.best, evidence.other_law.index, evidence.other_law.of
    name, contribution = best.effects[index], best.fit.contribution(index)
    where = place(of, main_orders(best.fit, contribution), float(np.std(contribution)), evidence)
    return Conclusion(
        "unknown",
        f"Something is there, {where['rms_arcmin']:.2g} arcmin rms, that looks like {name}, but another law of "
        f"the {of} explains it better: what it is, is not known.",
        separating_test=EFFECTS[name].separating,
        where=where,
    )


def unstable(findings: Findings) -> Conclusion:
    """What explains all turns is not what a part of them shows. `findings` hold the facts and the evidence behind
    them.
    """
    evidence, effects = findings.evidence, findings.effects
    unseen, floor = unseen_rms(evidence), evidence.noise_floor
    named = evidence.unseen.effects if evidence.unseen is not None else ()
    again = " and ".join(name for name in named if name in EFFECTS) or "none of the catalogue's effects"
    says = " ".join(found.says for found in effects)
    says += (
        f" A diagnosis without a part of the turns finds {again}, and misses these by {unseen:.2g} arcmin rms, "
        f"{unseen / floor:.2g} times the noise: what is there is not known."
    )
    where = effects[0].where | {"rms_arcmin": math.sqrt(max(unseen**2 - floor**2, 0.0))}
    return Conclusion("unknown", says, effects, separating_test=MORE_TURNS, where=where)


def unconfirmed(findings: Findings) -> Conclusion:
    """Something is there, and what looked most like it did not bear out. `findings` hold the facts and the evidence
    behind them.
    """
    evidence = findings.evidence
    but = "; but turns that no stage saw do not bear that out"
    return no_more_than_like(evidence.selection.best, explained_power(evidence), but, MORE_TURNS, evidence)


def balanced(findings: Findings) -> Conclusion:
    """Something is there, and what explains it is a balance of effects. `findings` hold the facts and the evidence
    behind them.
    """
    best = findings.evidence.selection.best
    apart = sum(effect_powers(best))
    but = f"; but these nearly cancel each other, and would come to {math.sqrt(apart):.2g} arcmin rms if they did not"
    return no_more_than_like(best, findings.facts.together * apart, but, MORE_TURNS, findings.evidence)


def beside_a_far_drive(findings: Findings) -> Conclusion:
    """Something is there, and the drive beside what most resembles it is none of its kind. `findings` hold the facts
    and the evidence behind them.
    """
    best = findings.evidence.selection.best
    but = (
        f"; but the drive beside it would lie far outside the tolerances of its kind ({far_errors(best.fit)}), and may "
        "stand for something that is left out"
    )
    test = "check drive, ratio and units, or measure that error of the drive itself, and record again"
    return no_more_than_like(best, sum(effect_powers(best)), but, test, findings.evidence)


def no_contact(findings: Findings) -> Conclusion:
    """Something is there that follows the drive's own error, and no contact does so. `findings` hold the facts and the
    evidence behind them.
    """
    best = findings.evidence.selection.best
    but = (
        f"; but the drive's own error would grow and shrink by {100 * findings.facts.contact:.2g} % round the turn, "
        "more than teeth in contact make it"
    )
    test = "record again at another load: teeth in contact follow it, an encoder or a calculation does not"
    return no_more_than_like(best, explained_power(findings.evidence), but, test, findings.evidence)


def described(findings: Findings) -> Conclusion:
    """Something is there, and what it resembles has a shape that is known better than it fits. `findings` hold the
    facts and the evidence behind them.
    """
    best = findings.evidence.selection.best
    but = "; but a description without physics explains it clearly better, and the shape of what it resembles is exact"
    return no_more_than_like(best, sum(effect_powers(best)), but, MORE_TURNS, findings.evidence)


def of_one_course(findings: Findings) -> Conclusion:
    """Something slow is there, and what it resembles are several effects that bend to anything together. `findings`
    hold the facts and the evidence behind them.
    """
    best = findings.evidence.selection.best
    but = "; but one smooth course of time tells all that is slow in these, with fewer coefficients"
    test = (
        "pass the same output turns again, to and fro: what hangs on the output comes again there, what goes with time "
        "does not"
    )
    return no_more_than_like(best, sum(effect_powers(best)), but, test, findings.evidence)


def no_more_than_like(candidate: Candidate, power: float, but: str, test: str, evidence: Evidence) -> Conclusion:
    """Something of a `power` (arcmin^2) is in the `evidence` that most resembles the effects of `candidate`, and why
    that is no name (`but`, a part of the sentence); the `test` would tell what it is.
    """
    where = where_largest(candidate, power, evidence)
    return Conclusion(
        "unknown",
        f"Something is there, {where['rms_arcmin']:.2g} arcmin rms, that most resembles {likeness(candidate)}{but}: "
        "what it is, is not known.",
        separating_test=test,
        where=where,
    )


def where_largest(candidate: Candidate, power: float, evidence: Evidence) -> Where:
    """Where the largest term of `candidate` lives that is not told, which stands for a `power` (arcmin^2) of what is
    in the `evidence`.
    """
    powers = [p * (name not in TOLD) for p, name in zip(term_powers(candidate.fit), candidate.effects, strict=True)]
    largest = int(np.argmax(powers))
    orders = main_orders(candidate.fit, candidate.fit.contribution(largest))
    return place(properties_of(candidate.effects[largest]).domain, orders, math.sqrt(power), evidence)


def may_be_hum(findings: Findings) -> Conclusion:
    """What is named, and that hum would look the same at the speed recorded. `findings` hold the facts and the evidence
    behind them.
    """
    assert findings.hum is not None, "the rule holds only where hum explains as well"
    where = where_outside(*findings.hum)
    says = " ".join(effect.says for effect in findings.effects)
    says += f" Or it is none of the drive's: at the speed recorded hum of the mains, {1 / where['period_s']:.4g} Hz, "
    says += "explains as much."
    test = "record at another speed: hum keeps its frequency, what belongs to the drive its order"
    return Conclusion("unknown", says, findings.effects, separating_test=test, where=where)


def likeness(candidate: Candidate) -> str:
    """The catalogue's effects in `candidate`, as a part of a sentence."""
    return " and ".join(name for name in candidate.effects if name in EFFECTS) or "none of the catalogue's effects"


def more(findings: Findings) -> Conclusion:
    """What a scale, a clock or a zero that is off does not explain, and what it most resembles. `findings` hold the
    facts and the evidence behind them.
    """
    best = findings.more
    assert best is not None, "the rule holds only where something adds"
    but = ", beside or in place of the instruments' error that the warnings tell"
    test = "put right what the warnings tell of the instruments, and record again"
    return no_more_than_like(best, sum(effect_powers(best)), but, test, findings.evidence)


def ambiguous(findings: Findings) -> Conclusion:
    """The best explanation, those that are as good, and the measurement that would part them. `findings` hold the
    facts and the evidence behind them.
    """
    effects, others = findings.effects, findings.facts.rivals
    pairs = findings.pairs
    ids = [found.id for found in effects]
    tied = tied_pairs(pairs, ids, others)
    listed = "; ".join(" and ".join(names) for names in others)
    says = " ".join(found.says for found in effects) + f" This recording cannot tell it from: {listed}."
    says += "".join(f" {p.other} could imitate {100 * p.imitates:.3g} % of {p.effect}." for p in tied)
    return Conclusion(
        "ambiguous",
        says,
        effects,
        others,
        separating_measurement(ids, others, tied),
        confounded=confusable(pairs, tied, findings),
    )


def named(findings: Findings) -> Conclusion:
    """The effects found, and what could imitate them. `findings` hold the facts and the evidence behind them."""
    pairs = findings.pairs
    says = " ".join(found.says for found in findings.effects)
    return Conclusion("named", says, findings.effects, confounded=confusable(pairs, (), findings))


def confusable(
    pairs: tuple[Confounding, ...], tied: tuple[Confounding, ...], findings: Findings
) -> tuple[Confounding, ...]:
    """Of the `pairs` those worth listing: the `tied` ones, and those in which most could be imitated. `findings`
    hold the facts and the evidence behind them.
    """
    least = findings.facts.settings.confounded
    return tuple(pair for pair in pairs if pair in tied or pair.imitates >= least)


def insufficient(findings: Findings) -> Conclusion:
    """The record says nothing. `findings` hold the facts and the evidence behind them."""
    if sparse(findings.evidence):
        rows, settings = findings.evidence.rows, findings.facts.settings
        return Conclusion(
            "insufficient",
            f"The recording has {rows.rows_per_turn:.2g} rows an input turn: below {settings.fewest_rows:g} every wave "
            "of the drive looks like another (an envelope, or a log of single readings?).",
            separating_test="sample the angles themselves, at least forty times an input turn",
        )
    return Conclusion(
        "insufficient",
        "The recording is too short or too noisy to say even that the model is adequate.",
        separating_test="record at least ten input turns, better one whole output turn in both directions",
    )


def adequate(findings: Findings) -> Conclusion:
    """The base explains the record, beside a scale that is off. `findings` hold the facts and the evidence behind
    them.
    """
    evidence = findings.evidence
    off = evidence.scale is not None and evidence.scale.found
    beside = " once a ratio or gain that is off is taken out (see the warnings)" if off else ""
    if evidence.selection.base.problem.base is None:
        return Conclusion("adequate", f"Nothing shows above the noise{beside}.")
    return Conclusion(
        "adequate",
        f"The kinematic-error model explains the recording{beside}; nothing else shows above the noise.",
    )


RULES = (
    Rule("happened once", happened_once, unknown),
    Rule("comes again", comes_again, no_chance),
    Rule("no physics explains", no_physics_explains, unknown),
    Rule("changes in time", changes_in_time, unknown),
    Rule("generic basis wins", generic_basis_wins, unknown),
    Rule("too much for noise", too_much_for_noise, no_noise),
    Rule("not confirmed", not_confirmed, unconfirmed),
    Rule("more than noise is left", more_than_noise_is_left, named_and_more),
    Rule("beaten without physics", beaten_without_physics, named_and_beaten),
    Rule("another law explains", another_law_explains, not_by_its_law),
    Rule("not found again", not_found_again, unstable),
    Rule("misses unseen turns", misses_unseen, unstable),
    Rule("hum explains as well", hum_explains_as_well, may_be_hum),
    Rule("effects cancel", effects_cancel, balanced),
    Rule("drive is far", drive_is_far, beside_a_far_drive),
    Rule("contact varies too much", contact_varies_too_much, no_contact),
    Rule("described better", is_described_better, described),
    Rule("one course tells all", one_course_tells_all, of_one_course),
    Rule("others are as good", others_are_as_good, ambiguous),
    Rule("named", lambda facts: facts.said, named),
    Rule("more than is told", more_than_is_told, more),
    Rule("something is left", something_is_left, unknown),
    Rule("too little", lambda facts: facts.too_little, insufficient),
    Rule("adequate", lambda facts: True, adequate),
)
"""The rules in the order in which they are asked; the last always holds."""


def rule_for(facts: Facts) -> Rule:
    """The first of the rules whose condition holds for `facts`."""
    return next(rule for rule in RULES if rule.condition(facts))
