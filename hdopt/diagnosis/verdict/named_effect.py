"""The effects that were found, in the words and numbers of the JSON contract."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.checks.assessment import Evidence
from hdopt.diagnosis.inference.catalogue import is_effect
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.inference.other_forms import estimates_over_forms
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.inference.row_means import as_sampled
from hdopt.diagnosis.inference.settled_shapes import estimates_by_profile
from hdopt.diagnosis.numerical import TINY
from hdopt.diagnosis.orientation import as_counted
from hdopt.diagnosis.search.candidates import Candidate
from hdopt.diagnosis.settings import VerdictSettings
from hdopt.diagnosis.verdict.where import Where
from hdopt.effects import EFFECTS
from hdopt.effects.estimate import Parameter
from hdopt.effects.term import Term
from hdopt.recordings.read import TURN

EXACT_DIGITS, LISTED_DIGITS = 6, 5
"""Digits of an order in the JSON: of one that is known, and of one that was measured."""


@dataclass(frozen=True)
class NamedEffect:
    """One named effect: its `id`, the probability that it is there, where it lives, its parameters, one sentence.

    `log_evidence_apart`: how far (natural log of a Bayes factor) the best explanation without it lies behind; None
    for one found in orders above the averaged rows, which has evidence of its own.
    """

    id: str
    confidence: float
    where: Where
    parameters: dict[str, Parameter]
    says: str
    categories: dict[str, str] = field(default_factory=dict)
    log_evidence_apart: float | None = None

    def to_dict(self) -> dict[str, object]:
        """As in the JSON."""
        return {
            "id": self.id,
            "confidence": self.confidence,
            "log_evidence_apart": self.log_evidence_apart,
            "where": self.where,
            "parameters": {name: p.to_dict() for name, p in self.parameters.items()},
            "categories": self.categories,
            "says": self.says,
        }


def confidences(evidence: Evidence) -> dict[str, float]:
    """Probability of each effect of the best set by what was weighed: weights of all candidate sets, flattened for
    model discrepancy. `evidence` is that of the diagnosis.
    """
    candidates, settings = evidence.selection.candidates, evidence.settings.verdict
    top = candidates[0].log_bayes_factor
    behind = [(c.log_bayes_factor - top) / settings.flatten for c in candidates]
    weights = np.array([math.exp(max(one, settings.smallest_weight)) for one in behind])
    weights /= weights.sum()
    result = {}
    for effect in candidates[0].effects:
        share = float(sum(w for w, c in zip(weights, candidates, strict=True) if effect in c.effects))
        result[effect] = share * (1 - evidence.false_alarm_p)
    return result


def chance_right(names: int, over_floor: float, settings: VerdictSettings) -> float:
    """Chance that what a set of so many `names` says is right where all evidence is for it: what all shapes of the
    catalogue miss is in no evidence, and shows in what is left on held-out turns over the noise floor (`over_floor`, a
    ratio). Log odds as they were in registered runs, by the `settings`.
    """
    over = math.log(min(max(over_floor, 1.0), settings.right_most_over))
    odds = settings.right_alone - settings.right_less_a_name * (names - 1) - settings.right_less_over_floor * over
    return 1 / (1 + math.exp(-odds))


def as_right_as_such_names(effects: Sequence[NamedEffect], evidence: Evidence) -> tuple[NamedEffect, ...]:
    """The `effects` said, each no surer than such names were right. `evidence` is that of the diagnosis."""
    over = evidence.extended_held_out.rms / evidence.noise_floor
    right = chance_right(len(effects), over, evidence.settings.verdict)
    return tuple(replace(one, confidence=one.confidence * right) for one in effects)


def evidence_apart(evidence: Evidence) -> dict[str, float]:
    """How far, as log Bayes factor, the best explanation without each effect of the best set lies behind it.
    `evidence` is that of the diagnosis.
    """
    best, *others = evidence.selection.candidates
    return {
        effect: best.log_bayes_factor - max(c.log_bayes_factor for c in others if effect not in c.effects)
        for effect in best.effects
    }


def describe(candidate: Candidate, evidence: Evidence, high: bool = False) -> list[NamedEffect]:
    """The effects of a `candidate`, as they stand in the `evidence`; `high` for one found on the rows as recorded."""
    fit, rows = candidate.fit, candidate.fit.problem.rows
    # A root of a jagged profile is the edge of a jag: with the input locked, places are compared instead.
    estimates = estimates_by_profile(fit, evidence.inflation) if rows.locked else estimates_over_forms(fit)
    confidence = {} if high else confidences(evidence)
    apart = {} if high else evidence_apart(evidence)
    base_power = evidence.base_held_out.variance
    found = []
    for index, (term, estimate) in enumerate(zip(fit.terms, estimates, strict=True)):
        if not is_effect(term.effect):
            continue
        effect = EFFECTS[term.effect]
        contribution = fit.contribution(index)
        rms = float(np.std(contribution))
        least = evidence.settings.verdict.least_left_by_means
        sampled = as_sampled(estimate, rows, effect.orders_of_columns(term, rows.ratio), least)
        parameters = effect.as_seen(effect.parameters(term, sampled), term, rows, contribution)
        if evidence.orientation.turned:
            parameters = as_counted(parameters, term)
        found.append(
            NamedEffect(
                term.effect,
                confidence.get(term.effect, 1.0),
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
                effect.sentence(term.shape, parameters, rms),
                effect.categories(term.shape),
                apart.get(term.effect),
            )
        )
    return found


def share_of(fit: Fit, index: int) -> float:
    """Share of the power left by the base and the other effects that effect `index` of `fit` takes."""
    probe = FitProbe(fit, keep=fit.all_but(index))
    power = float(probe.white_residual @ probe.white_residual)
    return probe.gain(fit.terms[index]) * probe.noise.sigma**2 / max(power, TINY)


def exact_orders(term: Term, fit: Fit) -> list[float]:
    """The orders an effect stands for, where it names them itself. `term` is one of those of `fit`."""
    named = EFFECTS[term.effect].named_orders(term.shape, fit.problem.rows.ratio)
    return [round(float(order), EXACT_DIGITS) for order in named]


def main_orders(fit: Fit, contribution: Array) -> list[float]:
    """Orders (cycles per input turn) that hold most of a `contribution` (n,) to `fit`."""
    rows, settings = fit.problem.rows, fit.problem.settings.verdict
    if rows.locked or rows.span_turns < settings.order_turns:
        return []
    theta = rows.theta - rows.theta.min()
    per_turn = settings.order_cells * int(max(rows.rows_per_turn, settings.order_rows))
    span = float(theta.max()) / TURN
    length = 1 << int(np.ceil(np.log2(2 * span * per_turn + settings.order_rows)))
    cell = np.minimum((theta / TURN * per_turn).astype(int), length - 1)
    count = np.bincount(cell, minlength=length)
    total = np.bincount(cell, contribution - contribution.mean(), minlength=length)
    amplitude = np.abs(np.fft.rfft(np.where(count > 0, total, 0.0)))
    orders = np.arange(len(amplitude)) * per_turn / length
    amplitude[orders > settings.order_share * rows.rows_per_turn] = 0
    found: list[float] = []
    top = amplitude.max()
    for _ in range(settings.listed_orders):
        at = int(np.argmax(amplitude))
        if amplitude[at] < settings.listed_share * top or top == 0:
            break
        found.append(round(_meant(float(orders[at]), span, rows.ratio, settings), LISTED_DIGITS))
        amplitude[np.abs(orders - orders[at]) < settings.order_apart / span] = 0
    return sorted(found)


def _meant(order: float, span: float, ratio: float, settings: VerdictSettings) -> float:
    """The multiple of 1/N, or the whole order, within the resolution of a record of `span` turns about `order`."""
    near = settings.order_near / span
    multiple = round(order * ratio) / ratio
    if abs(multiple - order) < near and span > settings.order_span * ratio:
        return multiple
    return float(round(order)) if abs(round(order) - order) < near else order
