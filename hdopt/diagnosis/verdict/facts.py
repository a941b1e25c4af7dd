"""What the rules of the verdict look at, drawn from the evidence once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdopt.diagnosis.checks.assessment import Evidence
from hdopt.diagnosis.checks.confounding import Confounding
from hdopt.diagnosis.checks.slow_course import told_by_a_course
from hdopt.diagnosis.inference.base_fit import far_errors
from hdopt.diagnosis.inference.catalogue import TOLD, VARYING_CONTACT
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.inference.neighbour_noise import is_a_walk
from hdopt.diagnosis.numerical import TINY
from hdopt.diagnosis.search.candidates import Candidate
from hdopt.diagnosis.settings import VerdictSettings
from hdopt.diagnosis.verdict.named_effect import NamedEffect, as_right_as_such_names, describe
from hdopt.diagnosis.verdict.residual_structure import (
    beaten_by_generic,
    clearly_unexplained,
    effect_powers,
    explained_power,
    gained_without_physics,
    left_over_passes,
    momentary,
    outside_share,
    power_together,
    resolution,
    term_powers,
    unsteady,
)
from hdopt.diagnosis.verdict.rivals import (
    Sets,
    ahead_without_physics,
    beside_told,
    confounded_pairs,
    hum_as_good,
    imitating_sets,
    placebo_as_good,
    rivals,
    scale_is_as_good,
    sets_with_a_part,
    shared_with_imitators,
)


@dataclass(frozen=True)
class Facts:
    """What a recording shows.

    `explained`: the best set has effects; `false_alarm_p`: the chance that noise alone does as well; `log_evidence`
    of the best set in the noise as it was measured; `own_gain`: the held-out power that the effects themselves
    predict, over what is left, and `unseen_gain` what turns that no stage saw show of it; `high`: orders above the
    rows stand out. `outside_share` and `high_outside_share`: share of what the best set, and the set of high orders,
    explain that descriptions without physics carry, of its power or, in the best set, of what it gains. `momentary`:
    something happened at one moment only; `unsteady`: something changes in time as no noise does; `generic_wins`: a
    basis without physics clearly predicts better, with a t of `generic_t`; `beaten_by_generic`: such a basis alone,
    without the effects, predicts better than they do. `turns_suffice`: turns can be held out; `too_little`: the
    record cannot say even that the base is adequate. `rivals`: other sets that are as good, placebo and perfect
    imitations among them; `scale_as_good`: so is a ratio or gain that is off, alone, and `hum_as_good`: hum of the
    mains in an effect's place. `described_better`: log evidence by which a description without physics explains more
    than the best set, if the shapes of that are exact; `course`: that by which one smooth course of time does instead
    of all that is slow in it. `contact`: the waves of a k_e that varies round the turn, together, as the best set has
    them. `far_base`: the drive that is fitted beside what is said lies far outside the tolerances of its kind;
    `together`: power of what the best set's effects do together, over the sum of what each does. `heldout_over_floor`:
    error on turns that were hidden from the fit (cross-validated where none could be spared) over what a generic basis
    leaves; `found_again`: what is said is preferred without those turns too; `noise_over_neighbours`: cross-validated
    error over the noise that neighbouring samples and the sensors' steps show; `walk`: what is left is as rough at
    every scale as a walk, which noise may be; `left_over_passes`: what is left over what differs from pass to pass of
    one angle; `left_over_floor`: cross-validated error over what a generic basis leaves, 1 where what is between is
    less than sensors and model resolve; `other_law`: log evidence by which another law than an effect's own explains
    better. `above_resolution`: some effect is larger than what sensors and model resolve.
    """

    settings: VerdictSettings
    turns_suffice: bool
    explained: bool
    false_alarm_p: float
    own_gain: float
    high: bool
    outside_share: float
    high_outside_share: float
    momentary: bool
    unsteady: bool
    generic_wins: bool
    generic_t: float
    too_little: bool
    rivals: Sets
    scale_as_good: bool = False
    hum_as_good: bool = False
    described_better: float = 0.0
    course: float = 0.0
    contact: float = 0.0
    far_base: bool = False
    together: float = 1.0
    log_evidence: float = 0.0
    unseen_gain: float = math.inf
    heldout_over_floor: float = 1.0
    found_again: bool = True
    noise_over_neighbours: float = 1.0
    walk: bool = False
    left_over_passes: float = 1.0
    above_resolution: bool = True
    beaten_by_generic: bool = False
    beside_told: float = 0.0
    left_over_floor: float = 1.0
    other_law: float = 0.0

    @property
    def significant(self) -> bool:
        """Whether noise alone would hardly do as well."""
        return self.false_alarm_p <= self.settings.significance

    @property
    def found(self) -> bool:
        """Whether the best set is there, by the chance that noise alone does as well."""
        return self.worth_a_word and self.significant

    @property
    def described(self) -> bool:
        """Whether the best set is there, as a description: noise of a narrow band, whose flipped turns are as narrow,
        is no chance by signs of turns, but no noise that a bench has either.
        """
        return self.worth_a_word and (self.significant or self.log_evidence > self.settings.momentary_evidence)

    @property
    def worth_a_word(self) -> bool:
        """Whether the best set carries enough, and could be judged at all."""
        worth = self.own_gain > self.settings.smallest_share
        possible = self.turns_suffice and self.explained and self.above_resolution
        return possible and worth and not self.scale_as_good

    @property
    def named(self) -> bool:
        """Whether the best set's effects may be named: turns that no stage saw must show them too."""
        return self.found and self.unseen_gain > self.settings.smallest_share

    @property
    def said(self) -> bool:
        """Whether there is any effect to name, high orders included."""
        return self.named or self.high

    @property
    def carry_most(self) -> bool:
        """Whether the effects to name predict more of the held-out power than they leave."""
        return self.said and min(self.own_gain, self.unseen_gain) > self.settings.most_is_carried


@dataclass(frozen=True)
class Findings:
    """The evidence, the facts in it, and what was found in high orders, if that stands out."""

    evidence: Evidence
    facts: Facts
    high: Candidate | None
    pairs: tuple[Confounding, ...] = ()
    effects: tuple[NamedEffect, ...] = ()
    """Every effect that is said, the largest first."""
    more: Candidate | None = None
    """The set that adds most to what is told, if any does."""
    hum: tuple[Fit, int] | None = None
    """A fit with hum in the place of an effect that explains as well, if any does, and which of its terms that is."""


def effects_said(evidence: Evidence, facts: Facts, high: Candidate | None) -> tuple[NamedEffect, ...]:
    """Every effect that the `facts` in the `evidence` and what stands out in `high` orders let be said, the largest
    first."""
    found: list[NamedEffect] = []
    if facts.named:
        least = resolution(evidence)
        found += [one for one in describe(evidence.selection.best, evidence) if one.where["rms_arcmin"] >= least]
    if high is not None:
        said = {one.id for one in found}
        found += [one for one in describe(high, evidence, high=True) if one.id not in said]
    return tuple(sorted(found, key=lambda one: -one.where["rms_arcmin"]))


def find(evidence: Evidence) -> Findings:
    """The facts of the `evidence`."""
    best, settings = evidence.selection.best, evidence.settings.verdict
    suffice = turns_suffice(evidence)
    high = evidence.high.best if evidence.high is not None and evidence.high.best.fit.terms else None
    if high is not None and not (suffice and stands_out(high, evidence)):
        high = None
    more, adding = beside_told(evidence)
    hum = hum_as_good(evidence, high)
    facts = Facts(
        settings=settings,
        turns_suffice=suffice,
        explained=any(name not in TOLD for name in best.effects),
        false_alarm_p=evidence.false_alarm_p,
        own_gain=own_gain(evidence),
        high=high is not None,
        outside_share=max(outside_share(best), gained_without_physics(best)),
        high_outside_share=0.0 if high is None else outside_share(high),
        momentary=momentary(evidence),
        unsteady=unsteady(evidence) is not None,
        generic_wins=clearly_unexplained(evidence),
        generic_t=evidence.remainder.t,
        too_little=too_little(evidence),
        rivals=(),
        scale_as_good=scale_is_as_good(evidence),
        hum_as_good=hum is not None,
        described_better=ahead_without_physics(evidence),
        course=told_by_a_course(best.fit, evidence.inflation),
        contact=math.hypot(*varying_contact(best.fit)),
        far_base=far_errors(best.fit) != "",
        together=power_together(best),
        log_evidence=best.log_bayes_factor,
        unseen_gain=unseen_gain(evidence),
        heldout_over_floor=unseen_rms(evidence) / evidence.noise_floor,
        noise_over_neighbours=evidence.extended_held_out.rms / max(evidence.sensors_noise, TINY),
        walk=is_a_walk(evidence.rows, best.fit.residual, evidence.settings.walk),
        left_over_passes=left_over_passes(evidence),
        above_resolution=above_resolution(evidence),
        beaten_by_generic=beaten_by_generic(evidence),
        beside_told=adding,
        left_over_floor=left_over_floor(evidence),
        other_law=evidence.other_law.log_evidence,
    )
    effects = as_right_as_such_names(effects_said(evidence, facts, high), evidence)
    pairs = confounded_pairs(evidence, facts.named, high, [one.id for one in effects]) if facts.said else ()
    as_good: Sets = ()
    if facts.named:
        as_good = rivals(evidence, high)
    effects = shared_with_imitators(effects, pairs, as_good, settings)
    if facts.named:
        as_good = (*as_good, *placebo_as_good(evidence, pairs))
    if facts.said:
        as_good = (*as_good, *imitating_sets(pairs, [one.id for one in effects], settings), *sets_with_a_part(effects))
    as_good = tuple(dict.fromkeys(as_good))[: settings.most_rivals]
    again = found_again(evidence, effects)
    return Findings(evidence, replace(facts, rivals=as_good, found_again=again), high, pairs, effects, more, hum)


def varying_contact(fit: Fit) -> list[float]:
    """The waves round the turn, from the first on, of a k_e that varies in `fit`, as shares of k_e; [] where none
    does."""
    for term, c in zip(fit.terms, fit.coefficients, strict=True):
        if term.effect == VARYING_CONTACT:
            return [math.hypot(*wave) for wave in c.reshape(-1, 2)]
    return []


def unseen_rms(evidence: Evidence) -> float:
    """Error of what was found in `evidence` on turns that were hidden from its fit, arcmin rms; cross-validated where
    none could be spared.
    """
    return evidence.extended_held_out.rms if evidence.unseen is None else evidence.unseen.extended


def found_again(evidence: Evidence, effects: Sequence[NamedEffect]) -> bool:
    """Whether a part of the turns alone, if `evidence` has a diagnosis of one, prefers a set with every one of the
    `effects` said."""
    return evidence.unseen is None or {one.id for one in effects} <= set(evidence.unseen.effects)


def above_resolution(evidence: Evidence) -> bool:
    """Whether some effect of the best set, and what the set predicts of unseen turns, is larger than what sensors and
    model resolve. `evidence` is that of the diagnosis.
    """
    least = resolution(evidence) ** 2
    predicted = evidence.base_held_out.variance - evidence.extended_held_out.variance
    return predicted >= least and any(power >= least for power in effect_powers(evidence.selection.best))


def left_over_floor(evidence: Evidence) -> float:
    """What the best set of the `evidence` leaves, cross-validated, over what a generic basis beside it leaves; 1 where
    what is between the two is less than sensors and model resolve.
    """
    left, floor = evidence.extended_held_out.rms, evidence.noise_floor
    between = math.sqrt(max(left**2 - floor**2, 0.0))
    return left / floor if between > resolution(evidence) else 1.0


def own_gain(evidence: Evidence) -> float:
    """How much better the effects predict, over what is left, and do so themselves: not by a better drive that was
    found beside them. `evidence` is that of the diagnosis.
    """
    base, extended = evidence.base_held_out.variance, evidence.extended_held_out.variance
    own = sum(effect_powers(evidence.selection.best))
    return min(base - extended, evidence.settings.verdict.own_power * own) / extended


def unseen_gain(evidence: Evidence) -> float:
    """How much better turns that no stage saw are predicted, over what is left there; infinite where none could be
    spared. `evidence` is that of the diagnosis.
    """
    nested = evidence.nested
    return math.inf if nested is None else (nested.base / nested.extended) ** 2 - 1


def stands_out(high: Candidate, evidence: Evidence) -> bool:
    """Whether a ripple (`high`) carries a share of the raw rows' power, and is more than what another shape of what the
    `evidence` holds may leave there.
    """
    settings = evidence.settings.verdict
    power = sum(term_powers(high.fit))
    explained = explained_power(evidence)
    enough = power > settings.smallest_share * float(np.var(high.fit.residual))
    return enough and power > settings.high_share * explained


def turns_suffice(evidence: Evidence) -> bool:
    """Whether turns can be held out, and rows show what happens within one: otherwise neither a name nor something
    unknown is claimed. `evidence` is that of the diagnosis.
    """
    rows, settings = evidence.rows, evidence.settings.verdict
    return rows.locked or (rows.blocks >= settings.fewest_blocks and not sparse(evidence))


def sparse(evidence: Evidence) -> bool:
    """Whether so few rows a turn were recorded, as of an envelope, that every wave is another's alias. `evidence` is
    that of the diagnosis.
    """
    rows = evidence.rows
    one_turn = rows.locked or rows.span_turns < evidence.settings.verdict.fewest_turns
    return not one_turn and rows.rows_per_turn < evidence.settings.verdict.fewest_rows


def too_little(evidence: Evidence) -> bool:
    """Too short for whole turns to be held out, too few rows a turn, or noise above the base's own size in every
    average. `evidence` is that of the diagnosis.
    """
    rows = evidence.rows
    if rows.locked:
        return False
    base_power = float(np.std(evidence.selection.base.base_value))
    if not turns_suffice(evidence) or rows.span_turns < evidence.settings.verdict.fewest_turns:
        return True
    limits = list(evidence.below_detection.values())
    return bool(limits) and base_power > 0 and float(np.median(limits)) > base_power
