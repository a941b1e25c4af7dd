"""What the catalogue does not explain: when it counts, and where it lives."""

from __future__ import annotations

import math

import numpy as np

from hdopt.diagnosis.alternatives.in_time import Mains
from hdopt.diagnosis.checks.assessment import Evidence
from hdopt.diagnosis.checks.turn_by_turn import from_turn_to_turn
from hdopt.diagnosis.inference.catalogue import TOLD, is_outside, properties_of
from hdopt.diagnosis.inference.cross_validation import paired_chance
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.numerical import TINY
from hdopt.diagnosis.search.candidates import Candidate, with_only
from hdopt.diagnosis.verdict.named_effect import main_orders, share_of
from hdopt.diagnosis.verdict.where import Where
from hdopt.effects.tooth_mesh import ToothMesh
from hdopt.recordings.read import TURN

LISTED_DIGITS = 4
"""Digits of an order in the JSON."""
SHORTEST_WAVE_S = 0.025
"""Period (s) below which what changes in time is hum of the mains: a slow wave lasts turns of the input."""
MOMENTARY = frozenset({"_jump", "_bump"})
"""Descriptions of what happened at one moment."""


def term_powers(fit: Fit) -> list[float]:
    """Power of each term's contribution, arcmin^2. `fit` holds the terms."""
    return [float(np.var(fit.contribution(i))) for i in range(len(fit.terms))]


def effect_powers(candidate: Candidate) -> list[float]:
    """Power (arcmin^2) of each term of `candidate` but a scale or clock that is off."""
    powers = term_powers(candidate.fit)
    return [power for power, name in zip(powers, candidate.effects, strict=True) if name not in TOLD]


def power_together(candidate: Candidate) -> float:
    """Power of what the effects of `candidate` (but a scale or clock that is off) do together, over the sum of what
    each does: about 1 where they have nothing to do with each other, 0 where they cancel; 1 without effects.
    """
    fit = candidate.fit
    parts = [fit.contribution(i) for i, name in enumerate(candidate.effects) if name not in TOLD]
    apart = sum(float(np.var(part)) for part in parts)
    return float(np.var(sum(parts))) / apart if apart > 0 else 1.0


def explained_power(evidence: Evidence) -> float:
    """Power (arcmin^2) of held-out turns that the best set of the `evidence` predicts beyond the base, not below 0."""
    return max(evidence.base_held_out.variance - evidence.extended_held_out.variance, 0.0)


def momentary(evidence: Evidence) -> bool:
    """Whether something that happened at one moment only, and that no held-out turn can show again, is most of what
    is there, and more than sensors and model resolve. `evidence` is that of the diagnosis.
    """
    best, settings = evidence.selection.best, evidence.settings.verdict
    powers = term_powers(best.fit)
    once = sum(p for p, name in zip(powers, best.effects, strict=True) if name in MOMENTARY)
    return (
        bool(best.effects)
        and once > settings.momentary_share * sum(powers)
        and best.log_bayes_factor > settings.momentary_evidence
        and once > settings.smallest_share * float(np.var(best.fit.residual))
        and once > resolution(evidence) ** 2
    )


def in_what_way(where: Where) -> str:
    """How something that changes in time (`where`) shows, for the sentence."""
    if "period_s" in where and where["period_s"] < SHORTEST_WAVE_S:
        return f", a hum of {1 / where['period_s']:.4g} Hz as of the mains"
    if "period_s" in where:
        return f", a wave of {where['period_s']:.3g} s"
    if "sudden_steps" in where:
        return f", {where['sudden_steps']} sudden steps and what creeps back between them"
    if "spread_over_turns" in where:
        spread = where["spread_over_turns"]
        return f", and it comes and goes: its size differs by {spread:.2g} of its mean from one input turn to the next"
    if "input_angle_deg" in where:
        return f", new each turn and always at {where['input_angle_deg']:.3g} deg of the input"
    return ""


def place(domain: str, orders: list[float], rms: float, evidence: Evidence) -> Where:
    """What lives in a `domain` in both directions, mostly at `orders`; the share of its `rms` (arcmin) is of what the
    base of the `evidence` leaves.
    """
    return {
        "domain": domain,
        "orders_per_input_turn": orders,
        "direction": "both",
        "share_of_residual": float(min(rms**2 / max(evidence.base_held_out.variance, TINY), 1.0)),
        "rms_arcmin": rms,
    }


def comes_and_goes(evidence: Evidence) -> Where | None:
    """Where an effect of the best set lives that is the same each time it is met, but differs from turn to turn by more
    than noise, by a fair part of itself and by more than sensors and model resolve; None where none does. `evidence` is
    that of the diagnosis.
    """
    fit, settings = evidence.selection.best.fit, evidence.settings.verdict
    for index, term in enumerate(fit.terms):
        effect = properties_of(term.effect)
        if not effect.same_each_time or fit.problem.rows.locked:
            continue
        differs = from_turn_to_turn(fit, index)
        if differs.t > settings.remainder_t_alone and differs.spread > settings.spread_over_turns:
            contribution = fit.contribution(index)
            rms = differs.spread * float(np.std(contribution))
            if rms > resolution(evidence):
                where = place(effect.domain, main_orders(fit, contribution), rms, evidence)
                return where | {"spread_over_turns": differs.spread}
    return None


def arises_at_an_angle(evidence: Evidence) -> Where | None:
    """Where that lives which is new each turn but arises at one angle of the input, clearly and with far more power
    than elsewhere, if it is worth a word; None where nothing does. What begins at an angle may last: told is the rms of
    all that is left beyond the sensors' noise. `evidence` is that of the diagnosis.
    """
    found, settings = evidence.arising, evidence.settings
    clear = found.chance < settings.verdict.remainder_chance and found.over_elsewhere > settings.cyclic.over_elsewhere
    if not clear or found.rms**2 <= worth_a_word(evidence):
        return None
    beyond = evidence.extended_held_out.variance - evidence.sensors_noise**2
    rms = math.sqrt(max(beyond, found.rms**2))
    # As the recording counts, whichever way round it was fitted.
    angle = -found.angle if evidence.orientation.turned else found.angle
    return place("angle", [], rms, evidence) | {"input_angle_deg": math.degrees(angle % TURN)}


def worth_a_word(evidence: Evidence) -> float:
    """Power (arcmin^2) from which what changes is a fair part of what is there and more than sensors and model resolve.
    `evidence` is that of the diagnosis.
    """
    settings = evidence.settings.verdict
    least = settings.remainder_share * explained_power(evidence)
    return max(least, settings.smallest_share * evidence.extended_held_out.variance, resolution(evidence) ** 2)


def unsteady(evidence: Evidence) -> Where | None:
    """Where something lives that changes in time as no noise does, that comes and goes, or that is new each turn at one
    angle, if it is worth a word, or None. `evidence` is that of the diagnosis.
    """
    gone = comes_and_goes(evidence) or arises_at_an_angle(evidence)
    if gone is not None:
        return gone
    wave, steps = evidence.wave, evidence.steps
    rms = max(wave.rms if wave is not None else 0.0, steps.rms)
    if not (steps.any or wave is not None) or rms**2 <= worth_a_word(evidence):
        return None
    where = place("time", [], rms, evidence)
    if wave is not None and wave.rms >= steps.rms:
        where["period_s"] = wave.period
    else:
        where["sudden_steps"] = len(steps.rows)
    return where


def left_over_passes(evidence: Evidence) -> float:
    """What is left over what can be noise by repeated passes of the same angles, where what comes again is clearly no
    chance, more than sensors and model resolve and a fair part of what is there; 1 elsewhere. `evidence` is that of the
    diagnosis.
    """
    passes, settings = evidence.passes, evidence.settings.verdict
    if passes.t <= settings.remainder_t:
        return 1.0
    if passes.repeated**2 <= max(settings.remainder_share * explained_power(evidence), resolution(evidence) ** 2):
        return 1.0
    return passes.left / max(passes.scatter, evidence.sensor_arcmin, TINY)


def resolution(evidence: Evidence) -> float:
    """Rms (arcmin) below which nothing in `evidence` is a finding: a share of the base's own, to which its model is
    accurate, and of the noise and the steps of the sensors; of what is left where a coarse encoder's steps were taken
    out.
    """
    settings = evidence.settings.verdict
    base = float(np.std(evidence.selection.base.base_value))
    sensors = settings.sensor_resolution * max(evidence.neighbours_arcmin, evidence.sensor_arcmin)
    if evidence.rows.output_step > 0:
        sensors = settings.stepped_resolution * evidence.extended_held_out.rms
    return max(settings.model_resolution * base, sensors)


def left_by_unequal_teeth(evidence: Evidence) -> float:
    """Power (arcmin^2) that the teeth of a mesh found in `evidence` may leave below its orders where they differ from
    each other; 0 without a mesh."""
    if evidence.high is None:
        return 0.0
    best = evidence.high.best
    powers = zip(term_powers(best.fit), best.effects, strict=True)
    return evidence.settings.verdict.unequal_teeth * sum(power for power, name in powers if name == ToothMesh.id)


def outside_share(candidate: Candidate) -> float:
    """Share of what a set explains that its descriptions without physics carry. `candidate` is that set."""
    fit = candidate.fit
    power = term_powers(fit)
    outside = sum(p for p, term in zip(power, fit.terms, strict=True) if is_outside(term.effect))
    return outside / max(sum(power), TINY)


def gained_without_physics(candidate: Candidate) -> float:
    """Share of what the set `candidate` gains that is lost without its descriptions, the rest fitted again: effects
    that are large beside each other and nearly cancel carry all the power, and a small step all that makes them fit.
    """
    fit = candidate.fit
    keep = [i for i, term in enumerate(fit.terms) if not is_outside(term.effect)]
    if len(keep) == len(fit.terms):
        return 0.0
    lost = (with_only(fit, keep).objective - fit.objective) / fit.problem.noise.sigma**2
    return lost / max(candidate.gain, TINY)


def clearly_unexplained(evidence: Evidence) -> bool:
    """Whether the generic basis clearly beats the explanation on held-out turns, by more than sensors resolve.
    `evidence` is that of the diagnosis.
    """
    left = evidence.extended_held_out.variance - evidence.remainder.held_out.variance
    explainable = evidence.base_held_out.variance - min(
        evidence.remainder.held_out.variance, evidence.generic_held_out.variance
    )
    if evidence.high is not None:
        explainable += float(np.var(evidence.high.best.fit.contributions))
    base_power = float(np.var(evidence.selection.base.base_value))
    settings = evidence.settings.verdict
    floor = max(
        settings.remainder_floor * evidence.remainder.held_out.variance,
        settings.base_floor * base_power,
        resolution(evidence) ** 2,
        left_by_unequal_teeth(evidence),
    )
    return (
        evidence.remainder.t > settings.remainder_t and left > settings.remainder_share * explainable and left > floor
    )


def beaten_by_generic(evidence: Evidence) -> bool:
    """Whether the generic basis beside the base alone predicts held-out turns clearly better than the base does, with
    the effects and without, and by more than sensors resolve: it knows no physics, so what explains is none either.
    `evidence` is that of the diagnosis.
    """
    settings = evidence.settings
    generic = evidence.generic_held_out
    best = min(evidence.base_held_out, evidence.extended_held_out, key=lambda out: out.variance)
    excess = best.variance - generic.variance
    floor = max(
        settings.verdict.remainder_floor * generic.variance, resolution(evidence) ** 2, left_by_unequal_teeth(evidence)
    )
    chance = paired_chance(best.white, generic.white, settings.held_out)
    return excess > floor and chance < settings.verdict.remainder_chance


def locate_remainder(evidence: Evidence) -> Where:
    """Where the structure lives that nothing in the catalogue explains. `evidence` is that of the diagnosis."""
    if (where := unsteady(evidence)) is not None:
        return where
    remainder = evidence.remainder
    left = max(evidence.extended_held_out.variance - remainder.held_out.variance, 0.0)
    domain = max(remainder.domains, key=lambda name: remainder.domains[name], default="order")
    for candidate in (evidence.selection.best, *((evidence.high.best,) if evidence.high is not None else ())):
        for index, term in enumerate(candidate.fit.terms):
            if is_outside(term.effect):
                return where_outside(candidate.fit, index)
    explainable = max(evidence.base_held_out.variance, TINY)
    return {
        "domain": domain,
        "orders_per_input_turn": [round(order, LISTED_DIGITS) for order in remainder.orders],
        "direction": "both",
        "share_of_residual": float(min(left / explainable, 1.0)),
        "rms_arcmin": math.sqrt(left),
    }


def where_outside(fit: Fit, index: int) -> Where:
    """Where the description without physics lives that is term `index` of `fit`; of hum with its period."""
    term, contribution = fit.terms[index], fit.contribution(index)
    where: Where = {
        "domain": properties_of(term.effect).domain,
        "orders_per_input_turn": main_orders(fit, contribution),
        "direction": "both",
        "share_of_residual": float(min(share_of(fit, index), 1.0)),
        "rms_arcmin": float(np.std(contribution)),
    }
    return where | {"period_s": 1 / term.shape["frequency_hz"]} if term.effect == Mains.id else where


def locate_repeated(evidence: Evidence) -> Where:
    """Where that lives which comes again from pass to pass and nothing in the catalogue explains. `evidence` is that of
    the diagnosis.
    """
    fit, repeated = evidence.selection.best.fit, evidence.passes.repeated
    return place("angle", main_orders(fit, fit.residual), repeated, evidence)
