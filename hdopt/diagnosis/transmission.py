"""What passes the drive's torsional spring: the motion of teeth and bearings excites whatever swings behind it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hdopt.diagnosis.catalogue import EXPLANATIONS
from hdopt.diagnosis.effect import Term
from hdopt.diagnosis.samples import Samples

Array = NDArray[np.float64]


def excites(term: Term) -> bool:
    """Whether a term moves the drive's output itself: it acts in the meshing zones, or its effect `excites`."""
    return term.zones is not None or getattr(EXPLANATIONS[term.effect], "excites", False)


def is_driven(term: Term) -> bool:
    """Whether a term's columns follow the motion of the drive."""
    return hasattr(EXPLANATIONS[term.effect], "response")


def motion_of(base_value: Array, terms: Sequence[Term], coefficients: Sequence[Array]) -> Array:
    """The drive's motion before its spring, arcmin, (n,): `base_value`, which holds what acts in the zones, and what
    the other exciting terms add.
    """
    beside = [t.columns @ c for t, c in zip(terms, coefficients, strict=True) if t.zones is None and excites(t)]
    return sum(beside, base_value)


def driven_by(motion: Array, samples: Samples, terms: Sequence[Term]) -> tuple[Term, ...]:
    """`terms` with the columns of the driven ones as `motion` excites them."""
    return tuple(
        replace(term, columns=EXPLANATIONS[term.effect].term(samples, term.shape, motion).columns)
        if is_driven(term)
        else term
        for term in terms
    )


def transmitted(columns: Array, samples: Samples, terms: Sequence[Term], coefficients: Sequence[Array]) -> Array:
    """Columns of the drive's motion (n, k) as the output shows them: with what the driven ones of `terms` add."""
    seen = columns
    for term, c in zip(terms, coefficients, strict=True):
        if is_driven(term) and columns.shape[1]:
            seen = seen + EXPLANATIONS[term.effect].response(samples, term.shape, c, columns)
    return seen
