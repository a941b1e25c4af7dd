"""Whitened columns of several terms beside each other, and what all that look at them ask for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hdopt.arrays import Array
from hdopt.effects.term import Term


@dataclass(frozen=True)
class WhitenedTerms:
    """The whitened `columns` (n, q) of all `terms`, beside each other, and of each term the inner products of its own
    with each other (`grams`), (p, p) each.

    It holds its terms, so that it may be known by their identities as long as it is there.
    """

    terms: tuple[Term, ...]
    columns: Array
    grams: tuple[Array, ...]

    @classmethod
    def of(cls, terms: Sequence[Term], columns: Array) -> WhitenedTerms:
        """`terms` with their whitened `columns` (n, q)."""
        alone = cls(tuple(terms), columns, ())
        return cls(alone.terms, columns, tuple(part @ part.T for part in alone.parts(columns.T)))

    def parts(self, by_column: Array) -> list[Array]:
        """What there is `by_column`, (q, ...), for each term by itself."""
        ends = np.cumsum([term.width for term in self.terms])[:-1]
        return np.split(by_column, ends)
