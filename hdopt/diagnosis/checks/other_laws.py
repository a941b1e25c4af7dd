"""Whether what is named depends on the speed as its effect does, or by another law.

Drag that grows with the root of the speed looks much like a delay, whose offset grows with the speed itself, and one
that fades with it like play, which is alike at all speeds. What is left of the one by the other is small, far less than
an inexact shape may leave, so that no description without physics wins against the catalogue. But a delay fits a delay
to the last digit: of two laws with the same freedom the right one explains more, clearly, as soon as there are two
speeds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hdopt.diagnosis.inference.catalogue import properties_of
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.numerical import HALF


@dataclass(frozen=True)
class OtherLaw:
    """By how much log evidence another law explains better than that of term `index`; 0 where none does."""

    index: int = 0
    log_evidence: float = 0.0


def other_law(fit: Fit, inflation: float) -> OtherLaw:
    """The term of `fit` whose own law is beaten most by another, everything else fitted anew in one linear step, in
    noise rougher by `inflation`; each other law that is tried costs its odds.
    """
    found = OtherLaw()
    for index, term in enumerate(fit.terms):
        laws = properties_of(term.effect).other_laws(fit.problem.rows, term)
        if not laws:
            continue
        probe = FitProbe(fit, keep=fit.all_but(index))
        others = max(probe.gain(replace(term, columns=columns, steps={}, kept=False)) for columns in laws)
        better = HALF * (others - probe.gain(term)) / inflation - float(np.log(len(laws)))
        if better > found.log_evidence:
            found = OtherLaw(index, better)
    return found
