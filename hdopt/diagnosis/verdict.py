"""The verdict: what the evidence allows to be said, in the words and numbers of the JSON contract."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from hdopt.diagnosis.base import BaseEstimate, base_estimate, beat_warning
from hdopt.diagnosis.candidates import Candidate
from hdopt.diagnosis.catalogue import is_outside
from hdopt.diagnosis.confounding import CONFOUNDED, Confounding, confounded_with
from hdopt.diagnosis.effect import Parameter
from hdopt.diagnosis.effects import EFFECTS, HIGH_ORDER
from hdopt.diagnosis.evidence import Evidence
from hdopt.diagnosis.found import Found, describe
from hdopt.diagnosis.locate import Location, locate
from hdopt.diagnosis.nuisance import estimated, notes
from hdopt.diagnosis.probe import FitProbe
from hdopt.diagnosis.ripple import ripple_orders
from hdopt.diagnosis.unexplained import (
    REMAINDER_SHARE,
    SMALLEST_SHARE,
    clearly_unexplained,
    in_what_way,
    locate_remainder,
    momentary,
    outside_share,
    strongly_unexplained,
    term_powers,
    unsteady,
)

SIGNIFICANCE = 0.01
"""Family-wise false-alarm probability below which an effect is named."""
TIE = 5.0
"""Log evidence within which two explanations cannot be told apart."""
FEWEST_BLOCKS = 6
"""Turns (or parts of turns between reversals) below which nothing is claimed."""


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
    outside = outside or (not few and unsteady(evidence) is not None)
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
        and (
            best.fit.terms
            or high is not None
            or evidence.false_alarm_p <= SIGNIFICANCE
            or strongly_unexplained(evidence)
        )
    ):
        verdict = "unknown"
        where = locate_remainder(evidence)
        effects = []
        says = (
            f"Something the catalogue does not hold is there: {where['rms_arcmin']:.2g} arcmin rms, "
            f"mostly in {where['domain']}{in_what_way(where)}."
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
    """Whether the effects predict better, and do so themselves: not by a better drive that was found beside them."""
    base, extended = evidence.base_held_out.variance, evidence.extended_held_out.variance
    own = sum(term_powers(evidence.selection.best.fit))
    return min(base - extended, 2 * own) > SMALLEST_SHARE * extended


def _stands_out(high: Candidate, evidence: Evidence) -> bool:
    """A ripple counts if it carries a share of the raw rows' power, and is more than what another shape may leave
    there.
    """
    power = sum(term_powers(high.fit))
    explained = max(evidence.base_held_out.variance - evidence.extended_held_out.variance, 0.0)
    return power > SMALLEST_SHARE * float(np.var(high.fit.residual)) and power > 0.01 * explained


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
