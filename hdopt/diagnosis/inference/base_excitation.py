"""What passes the drive's torsional spring: the motion of teeth and bearings excites whatever swings behind it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from hdopt.arrays import Array
from hdopt.diagnosis.inference.catalogue import properties_of
from hdopt.effects.term import Term
from hdopt.recordings.rows import Rows


def excites(term: Term) -> bool:
    """Whether a term moves the drive's output itself: it acts in the meshing zones, or its effect `excites`."""
    return term.in_zones or properties_of(term.effect).excites


def is_driven(term: Term) -> bool:
    """Whether a term's columns follow the motion of the drive."""
    return properties_of(term.effect).driven


def has_memory(term: Term) -> bool:
    """Whether a term's columns follow the motion that the drive had before."""
    return is_driven(term) and not properties_of(term.effect).at_once


def motion_of(base_value: Array, terms: Sequence[Term], coefficients: Sequence[Array]) -> Array:
    """The drive's motion before its spring, arcmin, (n,): `base_value`, which holds what acts in the zones, and what
    the other exciting terms add. `coefficients` holds those of each term.
    """
    motion = base_value
    for term, c in zip(terms, coefficients, strict=True):
        if term.columns is not None and excites(term):
            motion = motion + term.columns @ c
    return motion


def driven_by(motion: Array, rows: Rows, terms: Sequence[Term]) -> tuple[Term, ...]:
    """`terms`, the driven ones at their shapes as `motion` excites them. `rows` are those of the recordings."""
    return tuple(_driven(term, rows, motion) if is_driven(term) else term for term in terms)


def _driven(term: Term, rows: Rows, motion: Array) -> Term:
    made = properties_of(term.effect).term(rows, term.shape, motion)
    free = {name: made.steps[name] for name in term.steps}  # a parameter that is held stays so
    return replace(term, shape=made.shape, columns=made.columns, steps=free)


def answered(motion: Array, rows: Rows, weighed: Sequence[tuple[Term, Array]]) -> Array:
    """What the driven ones of `weighed`, terms with their coefficients, add for the drive's `motion` (n,), arcmin, on
    `rows`: (n,)."""
    answer: Array = (transmitted(motion[:, None], rows, weighed) - motion[:, None])[:, 0]
    return answer


def transmitted(columns: Array, rows: Rows, weighed: Sequence[tuple[Term, Array]]) -> Array:
    """Columns of the drive's motion (n, k) as the output shows them: with what the driven ones of `weighed`, terms with
    their coefficients, add. `columns` are in arcmin per coefficient. `rows` are those of the recordings.
    """
    seen = columns
    for term, c in weighed:
        if is_driven(term) and columns.shape[1]:
            seen = seen + properties_of(term.effect).response(rows, term.shape, c, columns)
    return seen
