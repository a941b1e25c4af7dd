"""What the catalogue does not explain: when it counts, and where it lives."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from hdopt.diagnosis.candidates import Candidate
from hdopt.diagnosis.catalogue import EXPLANATIONS, is_outside
from hdopt.diagnosis.evidence import Evidence
from hdopt.diagnosis.fit import Fit
from hdopt.diagnosis.found import main_orders, share_of

REMAINDER_T = 4.0
"""t, over held-out turns, from which the generic basis clearly wins over the explanation."""
REMAINDER_SHARE = 0.2
"""Share of what can be explained at all that an explanation may leave to the generic basis."""
REMAINDER_FLOOR = 0.04
"""Structure below this share of the noise power is left alone: no bench is free of it."""
MOMENTARY = {"_jump", "_bump"}
MOMENTARY_EVIDENCE = 30.0
"""Log evidence from which an event that no other turn repeats is believed."""
SMALLEST_SHARE = 0.02
"""An effect that takes less than this share of the held-out error's power is not worth a name."""


def term_powers(fit: Fit) -> list[float]:
    """Power of each term's contribution, arcmin^2."""
    return [float(np.var(fit.contribution(i))) for i in range(len(fit.terms))]


def momentary(evidence: Evidence) -> bool:
    """Whether something that happened at one moment only, and that no held-out turn can show again, is most of what is
    there.
    """
    best = evidence.selection.best
    powers = term_powers(best.fit)
    once = sum(p for p, name in zip(powers, best.effects, strict=True) if name in MOMENTARY)
    return (
        bool(best.effects)
        and once > 0.5 * sum(powers)
        and best.evidence > MOMENTARY_EVIDENCE
        and once > SMALLEST_SHARE * float(np.var(best.fit.residual))
    )


def in_what_way(where: Mapping[str, object]) -> str:
    """How something that lives in time shows, for the sentence."""
    if "period_s" in where:
        return f", a wave of {where['period_s']:.3g} s"
    if "sudden_steps" in where:
        return f", {where['sudden_steps']} sudden steps and what creeps back between them"
    return ""


def unsteady(evidence: Evidence) -> dict[str, object] | None:
    """Where something lives that changes in time as no noise does, if it is a fair part of what is there, or None."""
    least = REMAINDER_SHARE * max(evidence.base_held_out.variance - evidence.extended_held_out.variance, 0.0)
    floor = SMALLEST_SHARE * evidence.extended_held_out.variance
    wave, steps = evidence.wave, evidence.steps
    rms = max(wave.rms if wave is not None else 0.0, steps.rms)
    if not (steps.any or wave is not None) or rms**2 <= max(least, floor):
        return None
    return {
        "domain": "time",
        "orders_per_input_turn": [],
        "direction": "both",
        "share_of_residual": float(min(rms**2 / max(evidence.base_held_out.variance, 1e-300), 1.0)),
        "rms_arcmin": rms,
    } | ({"period_s": wave.period} if wave is not None and wave.rms >= steps.rms else {"sudden_steps": len(steps.rows)})


def outside_share(candidate: Candidate) -> float:
    """Share of what a set explains that its descriptions without physics carry."""
    fit = candidate.fit
    power = term_powers(fit)
    outside = sum(p for p, term in zip(power, fit.terms, strict=True) if is_outside(term.effect))
    return outside / max(sum(power), 1e-300)


def strongly_unexplained(evidence: Evidence) -> bool:
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


def locate_remainder(evidence: Evidence) -> dict[str, object]:
    """Where the structure lives that nothing in the catalogue explains."""
    if (where := unsteady(evidence)) is not None:
        return where
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
                    "share_of_residual": float(min(share_of(candidate.fit, index), 1.0)),
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
