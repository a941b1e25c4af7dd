"""Other explanations: sets whose evidence is as good, effects that could imitate, and what would part them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from hdopt.diagnosis.alternatives.in_time import Mains
from hdopt.diagnosis.checks.assessment import Evidence
from hdopt.diagnosis.checks.confounding import Confounding, confounded_with
from hdopt.diagnosis.inference.catalogue import EXACT_TOLD, TOLD, is_effect
from hdopt.diagnosis.inference.cross_validation import paired_t
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.search.candidates import Candidate, paid_for_freedom, penalty_scale
from hdopt.diagnosis.search.high_order import lowest_order, ripple_orders
from hdopt.diagnosis.search.penalty import leaves_nothing
from hdopt.diagnosis.settings import VerdictSettings
from hdopt.diagnosis.verdict.named_effect import NamedEffect
from hdopt.diagnosis.verdict.residual_structure import effect_powers
from hdopt.effects import EFFECTS, HIGH_ORDER

Sets = tuple[tuple[str, ...], ...]


def rivals(evidence: Evidence, high: Candidate | None) -> Sets:
    """Other sets of effects, no larger, whose evidence is within a tie of the best, and, where there is a tie, those
    that fit no worse and are a little behind for their freedom alone; each with what was found in `high` orders beside
    it. `evidence` is that of the diagnosis.
    """
    settings = evidence.settings.verdict
    best, *others = evidence.selection.candidates
    tail = [] if high is None else list(high.effects)
    said = {name for name in (*best.effects, *tail) if is_effect(name)}
    tied, fit_as_well = [], []
    for other in others:
        if not other.fit.terms or (other.outside and not best.outside) or len(other.fit.terms) > len(best.fit.terms):
            continue
        behind = best.log_bayes_factor - other.log_bayes_factor
        names = tuple(name for name in (*other.effects, *tail) if is_effect(name))
        if behind <= settings.tie:
            tied.append(names)
        elif behind <= settings.listed_beside_a_tie and other.gain >= best.gain:
            fit_as_well.append(names)
    found = [*tied, *fit_as_well] if tied else []
    different = (names for names in dict.fromkeys(found) if names and set(names) != said)
    return tuple(different)[: settings.most_rivals]


def hum_as_good(evidence: Evidence, high: Candidate | None) -> tuple[Fit, int] | None:
    """A fit of no more terms that explains as well with hum of the mains among them, and which of its terms that is;
    None where there is none, or the best has hum itself. `evidence` is that of the diagnosis, `high` what was found in
    orders above its rows.
    """
    tie = evidence.settings.verdict.tie
    sets = [evidence.selection.candidates]
    if high is not None and evidence.high is not None:
        sets.append(evidence.high.candidates)
    for best, *others in sets:
        for other in others:
            behind = best.log_bayes_factor - other.log_bayes_factor
            hum = Mains.id in other.effects and Mains.id not in best.effects
            if hum and behind <= tie and len(other.effects) <= len(best.effects):
                return other.fit, other.effects.index(Mains.id)
    return None


def scale_is_as_good(evidence: Evidence) -> bool:
    """Whether a ratio, gain or clock that is off, without any effect, explains as well as the best set of the
    `evidence`.
    """
    best = evidence.selection.best
    alone = (one for one in evidence.selection.candidates if one.effects and TOLD.issuperset(one.effects))
    tie = evidence.settings.verdict.tie
    return any(best.log_bayes_factor - one.log_bayes_factor <= tie for one in alone)


def beside_told(evidence: Evidence) -> tuple[Candidate | None, float]:
    """The set that adds most to the best of those that are told and never named, and by how much log evidence, each
    paying for its freedom and its search alone: a scale, a clock or a zero that is off has an exact shape, beside which
    nothing is left. None and 0 where the `evidence` holds no such pair of sets, or nothing told that is there itself,
    or none that adds, or what adds is small beside the noise.
    """
    candidates = evidence.selection.candidates
    scale = penalty_scale(evidence.selection.base.problem, evidence.inflation)
    least = evidence.settings.verdict.unconfirmed_share * evidence.extended_held_out.variance

    def evidence_of(one: Candidate) -> float:
        return paid_for_freedom(one, scale)

    told = next((one for one in candidates if one.effects and EXACT_TOLD.issuperset(one.effects)), None)
    if told is None or told.log_bayes_factor <= 0:
        return None, 0.0
    more = (one for one in candidates if set(one.effects) > set(told.effects) and sum(effect_powers(one)) > least)
    best = max(more, key=evidence_of, default=told)
    apart = evidence_of(best) - evidence_of(told)
    return (best, apart) if apart > 0 else (None, 0.0)


def ahead_without_physics(evidence: Evidence) -> float:
    """By how much log evidence a description without physics explains more than the best set of the `evidence`, each
    paying for its freedom and its search alone; 0 where none does, and where a term of the set may leave something by
    its slightly wrong shape: of what is known to the last digit nothing is left that a description could take up.
    """
    best, *others = evidence.selection.candidates
    if not all(leaves_nothing(term) for term in best.fit.terms):
        return 0.0
    scale = penalty_scale(evidence.selection.base.problem, evidence.inflation)
    plain = (one for one in others if one.outside and not any(map(is_effect, one.effects)))
    return max((paid_for_freedom(one, scale) - paid_for_freedom(best, scale) for one in plain), default=0.0)


def placebo_as_good(evidence: Evidence, pairs: Sequence[Confounding]) -> Sets:
    """The placebo, as another explanation, where it predicts unseen turns as well as what was found in `evidence`, and
    none of the confounded `pairs` says that rows and prior odds part them: what tells play from friction lies in the
    few rows after a reversal, and drowns in whole turns.
    """
    settings = evidence.settings.verdict
    base, own = evidence.base_held_out.variance, evidence.extended_held_out.variance
    found = {name for name in evidence.selection.best.effects if is_effect(name)}
    if evidence.placebo is None or not found or evidence.placebo in found:
        return ()
    alike = (pair for pair in pairs if pair.effect in found and pair.other == evidence.placebo)
    apart = [pair.evidence_apart - pair.odds for pair in alike]
    if apart and min(apart) >= settings.placebo_apart:
        return ()
    reached = base - evidence.placebo_held_out.variance >= settings.placebo_share * (base - own)
    t = paired_t(evidence.placebo_held_out.white, evidence.extended_held_out.white, evidence.settings.held_out)
    return ((evidence.placebo,),) if reached and t < settings.placebo_t else ()


def imitating_sets(pairs: Sequence[Confounding], ids: Sequence[str], settings: VerdictSettings) -> Sets:
    """The sets that explain as well because one of their effects can imitate wholly the one that it stands for: of
    `pairs` those in which the recording tells nothing apart, with `ids` said, by the `settings`.
    """
    return tuple(with_imitator(pair, ids) for pair in pairs if is_tie(pair, settings) and pair.other not in ids)


def sets_with_a_part(effects: Sequence[NamedEffect]) -> Sets:
    """The sets that explain as well because a part of one of the `effects` said may be another, that is not among them,
    by its numbers."""
    ids = tuple(one.id for one in effects)
    others = (other for one in effects for other in EFFECTS[one.id].may_be_part_of(one.parameters))
    return tuple((*ids, other) for other in others if other not in ids)


def is_tie(pair: Confounding, settings: VerdictSettings) -> bool:
    """Whether the recording tells nothing apart in a confounded `pair`, by the `settings`."""
    return pair.imitates >= settings.imitated and pair.evidence_apart < settings.tie


def with_imitator(pair: Confounding, ids: Sequence[str]) -> tuple[str, ...]:
    """The set `ids` with the other of the confounded `pair` in place of the one that it could imitate."""
    return tuple(dict.fromkeys(pair.other if name == pair.effect else name for name in ids))


def shared_with_imitators(
    effects: Sequence[NamedEffect], pairs: Sequence[Confounding], weighed: Sets, settings: VerdictSettings
) -> tuple[NamedEffect, ...]:
    """The `effects` said, each with its confidence shared with what could imitate it wholly: of confounded `pairs` that
    the recording does not tell apart each side has the weight of its prior odds and of its evidence, flattened by the
    `settings` like all evidence. Sets that were `weighed` as candidates have their share already.
    """
    ids = [one.id for one in effects]
    known = {frozenset(one) for one in weighed}
    shares = dict.fromkeys(ids, 1.0)
    for pair in pairs:
        if is_tie(pair, settings) and pair.other not in ids and frozenset(with_imitator(pair, ids)) not in known:
            shares[pair.effect] += math.exp(pair.odds - max(pair.evidence_apart, 0.0) / settings.flatten)
    return tuple(replace(one, confidence=one.confidence / shares[one.id]) for one in effects)


def confounded_pairs(
    evidence: Evidence, named: bool, high: Candidate | None, said: Sequence[str]
) -> tuple[Confounding, ...]:
    """Each effect that is `said` (ids) against every other of the catalogue, the most confounded pair first: of the
    best set where it is `named`, and of what was found in `high` orders. `evidence` is that of the diagnosis.
    """
    pairs: list[Confounding] = []
    if named:
        others = [name for name in EFFECTS if name not in evidence.lacking]
        fit = evidence.selection.best.fit
        for index, term in enumerate(fit.terms):
            if term.effect in said:
                pairs += confounded_with(fit, index, evidence.inflation, others)
    if high is not None:
        above, highest = ripple_orders(evidence.rows, high.fit.problem.rows, evidence.settings.high_order)
        # A mesh inside the zones may stand within the orders of the averaged rows.
        orders = (min(above, lowest_order(high.fit.terms, evidence.rows.ratio)), highest)
        for index, term in enumerate(high.fit.terms):
            if term.effect in said:
                pairs += confounded_with(high.fit, index, others=HIGH_ORDER, order_range=orders)
    return tuple(sorted(pairs, key=lambda pair: -pair.imitates))


def tied_pairs(pairs: Sequence[Confounding], ids: Sequence[str], ambiguous: Sets) -> tuple[Confounding, ...]:
    """Of the `pairs` those in which an explanation that ties (`ambiguous`) differs from the one given (`ids`)."""
    return tuple(
        pair
        for pair in pairs
        if any(pair.effect not in other and pair.other in other and pair.other not in ids for other in ambiguous)
    )


def separating_measurement(ids: Sequence[str], ambiguous: Sets, tied: Sequence[Confounding]) -> str:
    """The measurement that would tell the explanation given (`ids`) from those that are as good (`ambiguous`): that of
    the most confounded pair in which they differ (`tied`).
    """
    if tied:
        return tied[0].separating
    for other in ambiguous:
        for name in [*ids, *other]:
            if (name in ids) != (name in other):
                return EFFECTS[name].separating
    return EFFECTS[ids[0]].separating
