"""What a set of terms has to pay in log evidence before it may be said.

Freedom (Schwarz), the shapes that were searched, prior odds, and the inexactness of shapes: what a slightly wrong shape
leaves must not be named as further physics.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from hdopt.diagnosis.catalogue import EXPLANATIONS, is_outside
from hdopt.diagnosis.effect import Term

EFFECT_COST = 4.0
"""Log prior odds against an effect being there: about 1 in 50."""
DISCREPANCY = 0.08
"""Share of the explained power that an effect must add beyond others of its kind: no model's shapes are exact, and
what a slightly wrong shape leaves must not be named as further physics.
"""
OTHER_KIND = 0.01
"""The same beside effects of another kind only: what a wrong loop leaves is no order, and the reverse."""
ONE_IN_THE_OTHER, TWICE = {"cs_tooth_harmonics", "circular_spline_lobing"}, 15.0
"""Effects of which one is a special case of the other, and the log odds against both at once."""
KINDS = {
    "order": "turning",
    "angle": "turning",
    "asynchronous order": "turning",
    "time": "slow",
    "temperature": "slow",
    "torque": "load",
}
"""Kind of an effect by its domain; reversal and direction are one: no curve of the torque makes a loop."""
FEW_COEFFICIENTS, MANY_COEFFICIENTS = 8, 24
ENCODER = "encoder_interpolation"
CLEAR_WIN = 0.12
"""Share of the explained power by which a description without physics, or one at another effect's orders, must beat the
catalogue.
"""


@dataclass(frozen=True)
class Beside:
    """Terms already taken out of the rows (a ripple of higher order), and what they gained there: what their shapes
    leave must not be named either.
    """

    terms: tuple[Term, ...] = ()
    gain: float = 0.0


NOTHING_BESIDE = Beside()


def price(terms: Sequence[Term], rows: float, gain: float, inflation: float, beside: Beside = NOTHING_BESIDE) -> float:
    """What a set of terms has to pay in log evidence."""
    cost = 0.5 * sum(term.freedom for term in terms) * math.log(rows)
    cost += sum(math.log(max(term.trials, 1.0)) - term.odds for term in terms)
    # The first cycle of an encoder whose second was found among higher orders is no further effect.
    cost -= sum(EFFECT_COST + math.log(max(t.trials, 1.0)) - t.odds for t in terms if is_cycle_of(t, beside.terms))
    if {term.effect for term in terms} >= ONE_IN_THE_OTHER:
        cost += TWICE
    cost += sum(term.doubtful for term in terms) * 0.5 * CLEAR_WIN * gain / inflation
    rough = [term for term in beside.terms if not leaves_nothing(term)]
    inexact = (discrepancy([*terms, *rough]) - discrepancy(rough)) * (gain + (beside.gain if rough else 0.0))
    if terms and beside.terms and not rough:
        # What was taken out to the last digit leaves as little as another kind of effect.
        inexact += OTHER_KIND * beside.gain
    return cost + len(terms) * EFFECT_COST + 0.5 * inexact / inflation


def is_cycle_of(term: Term, found: Sequence[Term]) -> bool:
    """Whether `term` has the lines of an encoder of which `found` holds a multiple."""
    return term.effect == ENCODER and any(
        other.effect == ENCODER
        and other.shape["output"] == term.shape["output"]
        and other.shape["lines"] % term.shape["lines"] == 0
        for other in found
    )


def discrepancy(terms: Sequence[Term]) -> float:
    """Share of the explained power that a set of terms pays for the inexactness of its shapes; a description without
    physics could be the misfit of anything.
    """
    kinds = {kind_of(term) for term in terms if not is_outside(term.effect)}
    alike = max(len(terms) - max(len(kinds), 1), 0)
    # Sines of known orders leave nothing for each other: their shape is exact.
    each_alike = OTHER_KIND if all(has_exact_shape(term) for term in terms) else DISCREPANCY
    flexible = sum(flexibility(term) for term in terms)
    return max(len(kinds) - 1, 0) * OTHER_KIND + alike * each_alike + flexible * DISCREPANCY


def has_exact_shape(term: Term) -> bool:
    """Whether a term's columns are known to the last digit, so that its fit leaves nothing."""
    return getattr(EXPLANATIONS[term.effect], "exact_shape", False)


def leaves_nothing(term: Term) -> bool:
    """Whether nothing of a term reaches other orders: one of exact shape, or sines at lines that were counted."""
    return has_exact_shape(term) or getattr(EXPLANATIONS[term.effect], "leaves_nothing", False)


def flexibility(term: Term) -> float:
    """0 for a term of few coefficients, 1 for one that bends to the misfit of anything as a second effect would."""
    return min(max((term.width - FEW_COEFFICIENTS) / (MANY_COEFFICIENTS - FEW_COEFFICIENTS), 0.0), 1.0)


def kind_of(term: Term) -> str:
    """What a term's misfit looks like; that of a resonance, whose frequency lies in its response to each speed, like no
    other's.
    """
    return "swing" if term.effect == "resonance" else KINDS.get(EXPLANATIONS[term.effect].domain, "way")
