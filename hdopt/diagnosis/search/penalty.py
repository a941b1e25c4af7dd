"""What a set of effects pays in log evidence before it may be named.

Freedom (Schwarz's criterion), the shapes that were searched, prior odds, and the inexactness of shapes: what a slightly
wrong shape leaves must not be named as further physics.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

from hdopt.diagnosis.inference.catalogue import is_outside, properties_of
from hdopt.diagnosis.settings import DEFAULT, PenaltySettings
from hdopt.effects.met import Waves
from hdopt.effects.term import Term

KINDS = {
    "order": "turning",
    "angle": "turning",
    "asynchronous order": "turning",
    "time": "slow",
    "temperature": "slow",
    "torque": "load",
}
"""Kind of an effect by its domain; reversal and direction are one: no curve of the torque makes a loop."""

RIPPLE = "ripple"
"""The kind of a ripple of the teeth in rows that hold its waves."""


@dataclass(frozen=True)
class SubtractedTerms:
    """Terms that were taken out of the rows already (a ripple of higher order), and what they gained there, in noise
    variances: what their shapes leave must not be named either.
    """

    terms: tuple[Term, ...] = ()
    gain: float = 0.0


NOTHING_SUBTRACTED = SubtractedTerms()


@dataclass(frozen=True)
class Scale:
    """What a penalty is measured by: so many `rows` with a weight, noise rougher by `inflation` turn by turn, what was
    `subtracted` from the rows, and the `settings`.
    """

    rows: float
    inflation: float = 1.0
    subtracted: SubtractedTerms = NOTHING_SUBTRACTED
    settings: PenaltySettings = DEFAULT.penalty


def penalty(terms: Sequence[Term], gain: float, scale: Scale) -> float:
    """Log evidence that a set of `terms` pays, where the best explanation gains `gain` noise variances. `scale` is
    what penalties are measured by.
    """
    s, subtracted = scale.settings, scale.subtracted
    cost = sum(term.freedom for term in terms) * math.log(scale.rows) / 2
    cost += sum(searched(term) for term in terms)
    # The first cycle of an encoder whose second was found among higher orders is no further effect.
    cost -= sum(s.effect_cost + searched(t) for t in terms if is_cycle_of(t, subtracted.terms))
    names = {term.effect for term in terms}
    cost += s.one_in_the_other * sum(properties_of(name).special_case_of in names for name in names)
    cost += doubtful_among(terms, subtracted.terms) * s.clear_win * gain / scale.inflation / 2
    rough = [term for term in subtracted.terms if not leaves_nothing(term)]
    more = discrepancy(terms, s, rough) - discrepancy((), s, rough)
    inexact = more * (gain + (subtracted.gain if rough else 0.0))
    if terms and subtracted.terms and not rough:
        # What was taken out to the last digit leaves as little as another kind of effect.
        inexact += s.other_kind * subtracted.gain
    return cost + len(terms) * s.effect_cost + inexact / scale.inflation / 2


def doubtful_among(terms: Sequence[Term], subtracted: Sequence[Term] = ()) -> int:
    """How many of `terms`, beside each other and what was `subtracted` from the rows, must beat all others clearly."""
    names = {term.effect for term in (*terms, *subtracted)}
    return sum(term.doubtful or not names.isdisjoint(term.doubtful_beside) for term in terms)


def of_far_base(gain: float, scale: Scale) -> float:
    """Log evidence that a set pays whose drive lies far outside the tolerances of its kind, where the best explanation
    gains `gain` noise variances: such a drive stands for physics that the set leaves out, and pays as an effect of
    another kind does. `scale` is what penalties are measured by.
    """
    return scale.settings.effect_cost + scale.settings.other_kind * gain / scale.inflation / 2


def searched(term: Term) -> float:
    """What the search over a term's shapes cost, in log evidence, and the odds against its variant."""
    return math.log(max(term.trials, 1.0)) - term.odds


def is_cycle_of(term: Term, found: Sequence[Term]) -> bool:
    """Whether `term` belongs to one of `found`, as a cycle to the lines of an encoder."""
    effect = properties_of(term.effect)
    return any(other.effect == term.effect and effect.is_part_of(term.shape, other.shape) for other in found)


class Nature(NamedTuple):
    """What a term's misfit is like: whether it is a description without physics (`outside`), its `kind`, how far it
    bends (`flexibility`), whether teeth meet it as `waves`, and whether it `leaves_nothing`."""

    outside: bool
    kind: str
    flexibility: float
    waves: bool
    leaves_nothing: bool


def nature_of(term: Term, settings: PenaltySettings = DEFAULT.penalty) -> Nature:
    """The nature of `term`; `settings` are the thresholds."""
    outside, bending = is_outside(term.effect), flexibility(term, settings)
    kind = RIPPLE if properties_of(term.effect).high_order and not leaves_nothing(term) else kind_of(term)
    return Nature(outside, kind, bending, isinstance(term.met, Waves), leaves_nothing(term))


def discrepancy(
    terms: Sequence[Term], settings: PenaltySettings = DEFAULT.penalty, subtracted: Sequence[Term] = ()
) -> float:
    """Share of the explained power that a set of `terms` pays for the inexactness of its shapes, beside those that were
    `subtracted` from the rows; a description without physics could be the misfit of anything. Many waves of both
    splines' teeth pay for bending, each to the misfit of the other, and not for being alike too. A ripple of the teeth
    in rows that hold it leaves its misfit at its own orders; one that was taken out has left in the averaged rows what
    it does to the driving zone, which turns as everything does. `settings` are the thresholds.
    """
    taken = (nature_of(term, settings)._replace(kind=kind_of(term)) for term in subtracted)
    return _share((*(nature_of(term, settings) for term in terms), *taken), settings)


@cache
def _share(terms: tuple[Nature, ...], settings: PenaltySettings) -> float:
    """`discrepancy` of terms of such natures: of the thousands of subsets that a search weighs, many are alike."""
    of_kinds: dict[str, list[Nature]] = defaultdict(list)
    for term in terms:
        if not term.outside:
            of_kinds[term.kind].append(term)
    share = sum(_among_alike(alike, settings) for alike in of_kinds.values())
    share += max(len(of_kinds) - 1, 0) * settings.other_kind
    outside = sum(term.outside for term in terms)
    share += max(outside - (not of_kinds), 0) * _each_alike(terms, settings)
    return share + sum(term.flexibility for term in terms) * settings.discrepancy


def _among_alike(alike: Sequence[Nature], settings: PenaltySettings) -> float:
    """Share of the explained power that terms of one kind pay for being `alike`."""
    of_teeth = sum(term.flexibility for term in alike if term.waves)
    return max(len(alike) - 1 - max(of_teeth - 1, 0), 0) * _each_alike(alike, settings)


def _each_alike(terms: Sequence[Nature], settings: PenaltySettings) -> float:
    """What each of `terms` after the first pays. Sines of known orders leave nothing for each other, whatever other
    kind stands beside them."""
    return settings.other_kind if all(term.leaves_nothing for term in terms) else settings.discrepancy


def has_exact_shape(term: Term) -> bool:
    """Whether the columns of `term` are known to the last digit, so that its fit leaves nothing."""
    return properties_of(term.effect).exact_shape


def leaves_nothing(term: Term) -> bool:
    """Whether nothing of `term` reaches other orders: one of exact shape, or sines at lines that were counted."""
    return has_exact_shape(term) or properties_of(term.effect).leaves_nothing


def flexibility(term: Term, settings: PenaltySettings = DEFAULT.penalty) -> float:
    """0 for a `term` of few coefficients, 1 for one that bends to the misfit of anything as a second effect would.
    `settings` are the thresholds.
    """
    few, many = settings.few_coefficients, settings.many_coefficients
    return min(max((term.width - few) / (many - few), 0.0), 1.0)


def bends_to_anything(term: Term, settings: PenaltySettings = DEFAULT.penalty) -> bool:
    """Whether `term` has so many coefficients that it bends to anything. `settings` are the thresholds."""
    return flexibility(term, settings) >= 1


def bends(term: Term, settings: PenaltySettings = DEFAULT.penalty) -> bool:
    """Whether `term` may take up whatever is not its own: a description without physics, or one of so many coefficients
    that it bends to anything. `settings` are the thresholds.
    """
    return is_outside(term.effect) or bends_to_anything(term, settings)


def kind_of(term: Term) -> str:
    """What the misfit of `term` looks like; that of a resonance, whose frequency lies in its response to each speed,
    like no other's.
    """
    effect = properties_of(term.effect)
    return KINDS.get(effect.domain, "swing" if effect.driven else "way")
