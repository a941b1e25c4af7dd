"""What a search on other rows of the same recordings found, without its rows."""

from __future__ import annotations

from dataclasses import dataclass

from hdopt.arrays import Array
from hdopt.diagnosis.inference.fit import Fit
from hdopt.effects.term import Shape


@dataclass(frozen=True)
class Guess:
    """What a search on other rows of the same recordings found, without its rows: `errors` of the base (12,) mm,
    `terms` as (effect id, shape) with their `coefficients`, and whether the recordings were `turned` round there.
    """

    errors: Array
    terms: tuple[tuple[str, Shape], ...]
    coefficients: tuple[Array, ...]
    turned: bool


def guess_of(fit: Fit, turned: bool) -> Guess:
    """`fit` as a guess, found on recordings that were `turned` round or not."""
    return Guess(fit.errors, tuple((term.effect, term.shape) for term in fit.terms), fit.coefficients, turned)
