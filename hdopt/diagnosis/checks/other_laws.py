"""Whether what is named depends on speed and time as its effect does, or by another law.

Drag that grows with the root of the speed looks much like a delay, whose offset grows with the speed itself, and one
that fades with it like play, which is alike at all speeds; so does drag that wears in, while play stays, and an error
that is larger in one direction, whose mean is an offset; and a motor's ripple, which fades with the speed, has orders
like those of teeth or of an encoder's lines. What is left of the one by the other is small, far less than an inexact
shape may leave, so that no description without physics wins against the catalogue. But a delay fits a delay to the last
digit: of two laws with the same freedom the right one explains more, clearly, as soon as there are two speeds, or a few
reversals.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from hdopt.arrays import Array
from hdopt.diagnosis.inference.base_excitation import is_driven
from hdopt.diagnosis.inference.catalogue import properties_of
from hdopt.diagnosis.inference.fit import Fit, term_columns
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.numerical import HALF
from hdopt.effects._speed_laws import waves_by_speed
from hdopt.effects.base import Effect
from hdopt.effects.term import Term


@dataclass(frozen=True)
class OtherLaw:
    """By how much log evidence another law, `of` the speed, the time or the direction, explains better than that of
    term `index`; 0 where none does."""

    index: int = 0
    log_evidence: float = 0.0
    of: str = "speed"


def other_law(fit: Fit, inflation: float) -> OtherLaw:
    """The term of `fit` whose own law is beaten most by another, everything else fitted anew in one linear step, in
    noise rougher by `inflation`; each other law that is tried costs its odds, and coefficients beyond the term's own
    cost theirs by Schwarz's criterion. The own law stands where the other explains no more beyond it than what the
    term's own form may leave: the crossing of a play, or a speed that changes while a delay passes, is not modelled to
    the last thousandth.
    """
    found = OtherLaw()
    inexact = fit.problem.settings.verdict.other_law_inexact
    for index, term in enumerate(fit.terms):
        laws = laws_of(fit, term)
        tried = sum(len(columns) for columns in laws.values())
        if not tried:
            continue
        probe = FitProbe(fit, keep=fit.all_but(index))
        own = (1 + inexact) * probe.gain(term)
        for of, each in laws.items():
            for columns in each:
                gain = probe.gain(replace(term, columns=columns, met=None, zones=None, steps={}, kept=False))
                freedom = max(columns.shape[1] - term.width, 0) * math.log(fit.problem.weighed_rows)
                better = HALF * ((gain - own) / inflation - freedom) - math.log(tried)
                if better > found.log_evidence:
                    found = OtherLaw(index, better, of)
    return found


def laws_of(fit: Fit, term: Term) -> Mapping[str, Sequence[Array]]:
    """Columns of a `term` of `fit` by its other laws: its effect's own, and of waves of parts that turn that they fade
    or grow with the speed, unless something swings in `fit`, behind which they do.
    """
    effect, rows = properties_of(term.effect), fit.problem.rows
    laws = dict(effect.other_laws(rows, term, fit.motion))
    turns = isinstance(effect, Effect) and bool(effect.orders_of_columns(term, rows.ratio))
    if turns and not any(map(is_driven, fit.terms)):
        laws["speed"] = waves_by_speed(rows, term_columns(term, fit))
    return laws
