"""The effects that were found, in the words and numbers of the JSON contract."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hdopt.diagnosis.candidates import Candidate
from hdopt.diagnosis.catalogue import is_outside
from hdopt.diagnosis.effect import Parameter, Term
from hdopt.diagnosis.effects import EFFECTS
from hdopt.diagnosis.evidence import Evidence
from hdopt.diagnosis.fit import Fit
from hdopt.diagnosis.probe import FitProbe
from hdopt.recording import TURN

Array = NDArray[np.float64]

MOST_CONFIDENT = 0.97
"""No name is surer: what all shapes of the catalogue miss is in no evidence. In three blind runs 97 of 100 names
that the evidence alone called certain were right.
"""


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
                    "share_of_residual": float(min(share_of(fit, index), 1.0))
                    if not high
                    else min(rms**2 / base_power, 1.0),
                    "rms_arcmin": rms,
                },
                parameters,
                effect.sentence(parameters, rms),
            )
        )
    return found


def share_of(fit: Fit, index: int) -> float:
    """Share of the power left by the base and the other effects that this effect takes."""
    probe = FitProbe(fit, keep=fit.all_but(index))
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
