"""The verdict: what the evidence allows to be said, in the words and numbers of the JSON contract."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hdopt.diagnosis.base import BaseEstimate, base_estimate, beat_warning
from hdopt.diagnosis.catalogue import EXPLANATIONS, is_outside
from hdopt.diagnosis.confounding import CONFOUNDED, Confounding, confounded_with
from hdopt.diagnosis.effect import Parameter, Term
from hdopt.diagnosis.effects import EFFECTS, HIGH_ORDER
from hdopt.diagnosis.fit import Fit
from hdopt.diagnosis.locate import Location, locate
from hdopt.diagnosis.nuisance import estimated, notes
from hdopt.diagnosis.pipeline import Evidence, ripple_orders
from hdopt.diagnosis.probe import FitProbe
from hdopt.diagnosis.select import Candidate
from hdopt.recording import TURN

Array = NDArray[np.float64]

SIGNIFICANCE = 0.01
"""Family-wise false-alarm probability below which an effect is named."""
REMAINDER_T = 4.0
"""t, over held-out turns, from which the generic basis clearly wins over the explanation."""
REMAINDER_SHARE = 0.2
"""Share of what can be explained at all that an explanation may leave to the generic basis."""
REMAINDER_FLOOR = 0.04
"""Structure below this share of the noise power is left alone: no bench is free of it."""
TIE = 5.0
"""Log evidence within which two explanations cannot be told apart."""
FEWEST_BLOCKS = 6
"""Turns (or parts of turns between reversals) below which nothing is claimed."""
MOMENTARY = {"_jump", "_bump"}
MOMENTARY_EVIDENCE = 30.0
"""Log evidence from which an event that no other turn repeats is believed."""
MOST_CONFIDENT = 0.95
"""No name is surer: what all shapes of the catalogue miss is in no evidence. In the blind runs about nine names of ten
that the evidence alone called certain were right.
"""
SMALLEST_SHARE = 0.02
"""An effect that takes less than this share of the held-out error's power is not worth a name."""


@dataclass(frozen=True)
class Found:
    """One named effect."""

    id: str
    confidence: float
    where: dict[str, object]
    parameters: dict[str, Parameter]
    says: str

    def to_dict(self) -> dict[str, object]:
        return {
            "id": self.id,
            "confidence": self.confidence,
            "where": self.where,
            "parameters": {name: p.to_dict() for name, p in self.parameters.items()},
            "says": self.says,
        }


@dataclass(frozen=True)
class Diagnosis:
    """A verdict with everything that carries it; `to_dict` is the JSON contract."""

    verdict: str
    effects: tuple[Found, ...]
    ambiguous_with: tuple[tuple[str, ...], ...]
    separating_test: str | None
    base: BaseEstimate
    fit: dict[str, float | None]
    below_detection: dict[str, float]
    warnings: tuple[str, ...]
    says: str
    where: dict[str, object] | None = None
    located: tuple[Location, ...] = ()
    confounded: tuple[Confounding, ...] = ()
    each_condition: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    nuisances: dict[str, Parameter] = field(default_factory=dict)
    evidence: Evidence | None = field(default=None, repr=False)

    def to_dict(self) -> dict[str, object]:
        result = {
            "schema": 1,
            "verdict": self.verdict,
            "says": self.says,
            "effects": [found.to_dict() for found in self.effects],
            "ambiguous_with": [list(ids) for ids in self.ambiguous_with],
            "separating_test": self.separating_test,
            "confounded": [pair.to_dict() for pair in self.confounded],
            "base": {
                "parameters": {name: p.to_dict() for name, p in self.base.parameters.items()},
                "rms_arcmin": self.base.rms_arcmin,
                "not_separable": list(self.base.open_combinations),
                "nuisances": {name: p.to_dict() for name, p in self.nuisances.items()},
            },
            "located": [location.to_dict() for location in self.located],
            "fit": self.fit,
            "heldout_conditions": [
                {"condition": name, "rms_base_arcmin": base, "rms_extended_arcmin": extended}
                for name, (base, extended) in self.each_condition.items()
            ],
            "below_detection": self.below_detection,
            "warnings": list(self.warnings),
        }
        if self.where is not None:
            result["where"] = self.where
        return result


def draw_verdict(evidence: Evidence, warnings: tuple[str, ...]) -> Diagnosis:
    """The verdict on the evidence."""
    best = evidence.selection.best
    high = evidence.high.best if evidence.high is not None and evidence.high.best.fit.terms else None
    few = too_few_turns(evidence)
    if high is not None and (few or not _stands_out(high, evidence)):
        high = None
    named = not few and bool(best.fit.terms) and evidence.false_alarm_p <= SIGNIFICANCE and _worth_naming(evidence)
    outside = (not few and momentary(evidence)) or (named and outside_share(best) > REMAINDER_SHARE) or (
        high is not None and outside_share(high) > REMAINDER_SHARE
    )
    unexplained = outside or (not few and clearly_unexplained(evidence))
    effects: list[Found] = []
    if outside:
        high = None
    elif named:
        effects += describe(best, evidence)
    if high is not None:
        said = {found.id for found in effects}
        effects += [found for found in describe(high, evidence, high=True) if found.id not in said]
    effects.sort(key=lambda found: -float(found.where["rms_arcmin"]))
    ambiguous: tuple[tuple[str, ...], ...] = ()
    confounded: tuple[Confounding, ...] = ()
    separating = None
    where = None
    if outside or (
        unexplained
        and (best.fit.terms or high is not None or evidence.false_alarm_p <= SIGNIFICANCE or _strong(evidence))
    ):
        verdict = "unknown"
        where = locate_remainder(evidence)
        effects = []
        says = (
            f"Something the catalogue does not hold is there: {where['rms_arcmin']:.2g} arcmin rms, "
            f"mostly in {where['domain']}."
        )
        separating = (
            "record again at another speed, torque and temperature, one at a time, and see which of them moves it"
        )
    elif effects:
        ambiguous = rivals(evidence, high) if named else ()
        pairs = confounded_pairs(evidence, named, high)
        tied = tied_pairs(pairs, [found.id for found in effects], ambiguous)
        confounded = tuple(pair for pair in pairs if pair in tied or pair.imitates >= CONFOUNDED)
        verdict = "ambiguous" if ambiguous else "named"
        says = " ".join(found.says for found in effects)
        if ambiguous:
            others = "; ".join(" and ".join(ids) for ids in ambiguous)
            says += f" This recording cannot tell it from: {others}."
            says += "".join(f" {p.other} could imitate {100 * p.imitates:.3g} % of {p.effect}." for p in tied)
            separating = separating_measurement([found.id for found in effects], ambiguous, tied)
    elif too_little(evidence):
        verdict, says = (
            "insufficient",
            "The recording is too short or too noisy to say even that the model is adequate.",
        )
        separating = "record at least ten input turns, better one whole output turn in both directions"
    else:
        verdict, says = (
            "adequate",
            "The kinematic-error model explains the recording; nothing else shows above the noise.",
        )
        if evidence.selection.base.problem.base is None:
            says = "Nothing shows above the noise."
    across = evidence.across_conditions
    model = best.fit if named else evidence.selection.base
    return Diagnosis(
        verdict=verdict,
        effects=tuple(effects),
        ambiguous_with=ambiguous,
        separating_test=separating,
        base=base_estimate(model),
        nuisances=estimated(model, evidence.nuisances),
        fit={
            "heldout_rms_base_arcmin": evidence.base_held_out.rms,
            "heldout_rms_extended_arcmin": evidence.extended_held_out.rms,
            "heldout_rms_generic_arcmin": evidence.generic_held_out.rms,
            "heldout_rms_placebo_arcmin": evidence.placebo_held_out.rms,
            "heldout_conditions_rms_base_arcmin": across.base if across is not None else None,
            "heldout_conditions_rms_extended_arcmin": across.extended if across is not None else None,
            "noise_floor_arcmin": evidence.noise_floor,
            "false_alarm_p": evidence.false_alarm_p,
        },
        below_detection={
            name: limit
            for name, limit in evidence.below_detection.items()
            if not is_outside(name) and name not in {found.id for found in effects}
        },
        warnings=warnings
        + tuple(notes(model, evidence.nuisances))
        + beat_notes(evidence)
        + tuple(f"{name} cannot be seen here: it needs {need}" for name, need in evidence.lacking.items()),
        says=says,
        where=where,
        located=tuple(locate(FitProbe(evidence.selection.base), np.random.default_rng(0))),
        confounded=confounded,
        each_condition=across.each if across is not None else {},
        evidence=evidence,
    )


def _worth_naming(evidence: Evidence) -> bool:
    base, extended = evidence.base_held_out.variance, evidence.extended_held_out.variance
    return base - extended > SMALLEST_SHARE * extended


def term_powers(fit: Fit) -> list[float]:
    """Power of each term's contribution, arcmin^2."""
    return [float(np.var(fit.contribution(i))) for i in range(len(fit.terms))]


def momentary(evidence: Evidence) -> bool:
    """Whether something happened at one moment only, which no held-out turn can show again."""
    best = evidence.selection.best
    power = sum(term_powers(best.fit))
    return (
        bool(best.effects)
        and set(best.effects) <= MOMENTARY
        and best.evidence > MOMENTARY_EVIDENCE
        and power > SMALLEST_SHARE * float(np.var(best.fit.residual))
    )


def outside_share(candidate: Candidate) -> float:
    """Share of what a set explains that its descriptions without physics carry."""
    fit = candidate.fit
    power = term_powers(fit)
    outside = sum(p for p, term in zip(power, fit.terms, strict=True) if is_outside(term.effect))
    return outside / max(sum(power), 1e-300)


def _stands_out(high: Candidate, evidence: Evidence) -> bool:
    """A ripple counts if it carries a share of the raw rows' power, and is more than what another shape may leave
    there.
    """
    power = sum(term_powers(high.fit))
    explained = max(evidence.base_held_out.variance - evidence.extended_held_out.variance, 0.0)
    return power > SMALLEST_SHARE * float(np.var(high.fit.residual)) and power > 0.01 * explained


def _strong(evidence: Evidence) -> bool:
    return evidence.remainder.t > 1.5 * REMAINDER_T


def clearly_unexplained(evidence: Evidence) -> bool:
    """Whether the generic basis clearly beats the explanation on held-out turns."""
    left = evidence.extended_held_out.variance - evidence.remainder.held_out.variance
    explainable = evidence.base_held_out.variance - min(
        evidence.remainder.held_out.variance, evidence.generic_held_out.variance
    )
    if evidence.high is not None:
        explainable += float(np.var(evidence.high.best.fit.contributions))
    base_power = float(np.var(evidence.selection.base.base_value))
    floor = max(REMAINDER_FLOOR * evidence.remainder.held_out.variance, 0.0025 * base_power)
    return evidence.remainder.t > REMAINDER_T and left > REMAINDER_SHARE * explainable and left > floor


def beat_notes(evidence: Evidence) -> tuple[str, ...]:
    """What the record's length leaves open between circular spline and flexspline, of a harmonic drive."""
    samples = evidence.samples
    if samples.locked or evidence.selection.base.problem.base is None:
        return ()
    warning = beat_warning(samples)
    return () if warning is None else (warning,)


def too_few_turns(evidence: Evidence) -> bool:
    """Whether turns can hardly be held out: then neither a name nor something unknown is claimed."""
    samples = evidence.samples
    return not samples.locked and samples.blocks < FEWEST_BLOCKS


def too_little(evidence: Evidence) -> bool:
    """Too short for whole turns to be held out, or noise above the base's own size in every average."""
    samples = evidence.samples
    if samples.locked:
        return False
    base_power = float(np.std(evidence.selection.base.base_value))
    if too_few_turns(evidence) or samples.span_turns < 2:
        return True
    limits = list(evidence.below_detection.values())
    return bool(limits) and base_power > 0 and float(np.median(limits)) > base_power


def rivals(evidence: Evidence, high: Candidate | None) -> tuple[tuple[str, ...], ...]:
    """Other sets of effects, no larger, whose evidence is within a tie of the best."""
    best, *others = evidence.selection.candidates
    tail = [] if high is None else list(high.effects)
    said = {name for name in (*best.effects, *tail) if not is_outside(name)}
    found = []
    for other in others:
        if not other.fit.terms or (other.outside and not best.outside) or len(other.fit.terms) > len(best.fit.terms):
            continue
        if best.evidence - other.evidence <= TIE:
            found.append(tuple(name for name in (*other.effects, *tail) if not is_outside(name)))
    return tuple(names for names in dict.fromkeys(found) if names and set(names) != said)[:3]


def confounded_pairs(evidence: Evidence, named: bool, high: Candidate | None) -> tuple[Confounding, ...]:
    """Each effect that is said against every other of the catalogue, the most confounded pair first."""
    pairs: list[Confounding] = []
    if named:
        others = [name for name in EFFECTS if name not in evidence.lacking]
        fit = evidence.selection.best.fit
        for index, term in enumerate(fit.terms):
            if not is_outside(term.effect):
                pairs += confounded_with(fit, index, evidence.inflation, others)
    if high is not None:
        orders = ripple_orders(evidence.samples, high.fit.problem.samples)
        for index, term in enumerate(high.fit.terms):
            if not is_outside(term.effect):
                pairs += confounded_with(high.fit, index, others=HIGH_ORDER, order_range=orders)
    return tuple(sorted(pairs, key=lambda pair: -pair.imitates))


def tied_pairs(
    pairs: tuple[Confounding, ...], ids: list[str], ambiguous: tuple[tuple[str, ...], ...]
) -> tuple[Confounding, ...]:
    """Of the `pairs` those in which an explanation that ties differs from the one given."""
    return tuple(
        pair
        for pair in pairs
        if any(pair.effect not in other and pair.other in other and pair.other not in ids for other in ambiguous)
    )


def confidences(evidence: Evidence) -> dict[str, float]:
    """Probability of each effect of the best set: weights of all candidate sets, flattened for model discrepancy."""
    candidates = evidence.selection.candidates
    top = candidates[0].evidence
    weights = np.array([math.exp(max((c.evidence - top) / 2.0, -60)) for c in candidates])
    weights /= weights.sum()
    result = {}
    for effect in candidates[0].effects:
        share = float(sum(w for w, c in zip(weights, candidates, strict=True) if effect in c.effects))
        result[effect] = float(np.clip(share * (1 - evidence.false_alarm_p), 0.0, MOST_CONFIDENT))
    return result


def describe(candidate: Candidate, evidence: Evidence, high: bool = False) -> list[Found]:
    fit = candidate.fit
    estimates = fit.estimates()
    confidence = {} if high else confidences(evidence)
    base_power = evidence.base_held_out.variance
    found = []
    for index, (term, estimate) in enumerate(zip(fit.terms, estimates, strict=True)):
        if is_outside(term.effect):
            continue
        effect = EFFECTS[term.effect]
        contribution = fit.contribution(index)
        rms = float(np.std(contribution))
        parameters = effect.parameters(term, estimate)
        found.append(
            Found(
                term.effect,
                confidence.get(term.effect, MOST_CONFIDENT),
                {
                    "domain": effect.domain,
                    "orders_per_input_turn": exact_orders(term, fit) or main_orders(fit, contribution),
                    "direction": "reversal" if effect.domain == "reversal" else "both",
                    "share_of_residual": float(min(_share(fit, index), 1.0))
                    if not high
                    else min(rms**2 / base_power, 1.0),
                    "rms_arcmin": rms,
                },
                parameters,
                effect.sentence(parameters, rms),
            )
        )
    return found


def _share(fit: Fit, index: int) -> float:
    """Share of the power left by the base and the other effects that this effect takes."""
    keep = [i for i in range(len(fit.terms)) if i != index]
    probe = FitProbe(fit, keep=keep)
    power = float(probe.white_residual @ probe.white_residual)
    return probe.gain(fit.terms[index]) * probe.noise.sigma**2 / max(power, 1e-300)


def exact_orders(term: Term, fit: Fit) -> list[float]:
    """The orders an effect stands for, where it names them itself."""
    named = getattr(EFFECTS[term.effect], "orders", None)
    return [] if named is None else [round(float(order), 6) for order in named(term, fit.problem.samples.ratio)]


def main_orders(fit: Fit, contribution: Array, most: int = 4) -> list[float]:
    """Orders (cycles per input turn) that hold most of a contribution."""
    samples = fit.problem.samples
    if samples.locked or samples.span_turns < 0.5:
        return []
    theta = samples.theta - samples.theta.min()
    per_turn = 4 * int(max(samples.rows_per_turn, 16))
    span = theta.max() / TURN
    length = 1 << int(np.ceil(np.log2(2 * span * per_turn + 16)))
    cell = np.minimum((theta / TURN * per_turn).astype(int), length - 1)
    count = np.bincount(cell, minlength=length)
    total = np.bincount(cell, contribution - contribution.mean(), minlength=length)
    amplitude = np.abs(np.fft.rfft(np.where(count > 0, total, 0.0)))
    orders = np.arange(len(amplitude)) * per_turn / length
    amplitude[orders > 0.5 * samples.rows_per_turn] = 0
    found: list[float] = []
    top = amplitude.max()
    for _ in range(most):
        at = int(np.argmax(amplitude))
        if amplitude[at] < 0.3 * top or top == 0:
            break
        order = float(orders[at])
        # Where a multiple of 1/N lies within the record's resolution, that is meant.
        nearest = round(order * samples.ratio) / samples.ratio
        if abs(nearest - order) < 0.25 / span and span > 0.5 * samples.ratio:
            order = nearest
        elif abs(round(order) - order) < 0.25 / span:
            order = float(round(order))
        found.append(round(order, 5))
        amplitude[np.abs(orders - orders[at]) < 1.2 / span] = 0
    return sorted(found)


def locate_remainder(evidence: Evidence) -> dict[str, object]:
    """Where the structure lives that nothing in the catalogue explains."""
    remainder = evidence.remainder
    left = max(evidence.extended_held_out.variance - remainder.held_out.variance, 0.0)
    domain = max(remainder.domains, key=remainder.domains.get, default="order")
    for candidate in [evidence.selection.best] + ([evidence.high.best] if evidence.high is not None else []):
        for index, term in enumerate(candidate.fit.terms):
            if is_outside(term.effect):
                contribution = candidate.fit.contribution(index)
                return {
                    "domain": EXPLANATIONS[term.effect].domain,
                    "orders_per_input_turn": main_orders(candidate.fit, contribution),
                    "direction": "both",
                    "share_of_residual": float(min(_share(candidate.fit, index), 1.0)),
                    "rms_arcmin": float(np.std(contribution)),
                }
    explainable = max(evidence.base_held_out.variance, 1e-300)
    return {
        "domain": domain,
        "orders_per_input_turn": [round(order, 4) for order in remainder.orders],
        "direction": "both",
        "share_of_residual": float(min(left / explainable, 1.0)),
        "rms_arcmin": math.sqrt(left),
    }


def separating_measurement(
    ids: list[str], ambiguous: tuple[tuple[str, ...], ...], tied: tuple[Confounding, ...]
) -> str:
    """The measurement that would tell the explanations apart: that of the most confounded pair in which they differ."""
    if tied:
        return tied[0].separating
    for other in ambiguous:
        for name in [*ids, *other]:
            if (name in ids) != (name in other):
                return EFFECTS[name].separating
    return EFFECTS[ids[0]].separating
