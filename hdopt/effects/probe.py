"""What a search asks of a residual, and the rankings that searches share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from hdopt.arrays import Array
from hdopt.effects.conditions import Conditions
from hdopt.effects.term import Term


class Probe(Protocol):
    """What a search may ask of the residual: it answers with the base (and the effects already found) refitted."""

    @property
    def samples(self) -> Conditions:
        """The rows' conditions."""

    @property
    def residual(self) -> Array:
        """What is left, arcmin, (n,)."""

    @property
    def motion(self) -> Array:
        """The drive's own error before its spring, arcmin, (n,): what excites a resonance."""

    @property
    def order_range(self) -> tuple[float, float]:
        """Orders (cycles per input turn) that the search looks at."""

    @property
    def has_base(self) -> bool:
        """Whether a base model with meshing zones is fitted beside."""

    def gain(self, term: Term) -> float:
        """Drop of the weighted sum of squares, in units of the noise variance, when `term` joins the fit."""

    def gains(self, terms: Sequence[Term]) -> list[float]:
        """The same drop of each of `terms` by itself."""

    def gains_of_parts(self, term: Term, parts: Sequence[Sequence[int]]) -> list[float]:
        """The same drop of those columns of `term` alone that each of `parts` lists."""

    def solve(self, term: Term) -> tuple[float, Array]:
        """That of one, and the coefficients (p,) that bring it."""

    def table(self, term: Term) -> tuple[Array, Array]:
        """Inner products of the term's columns with each other and with the residual, the refitted base taken out."""

    def spectrum(self, orders: Array, of_output: bool = False) -> Array:
        """Amplitude (arcmin) of the residual at each order, by least squares.

        Orders count cycles of the input, or, with `of_output`, of N times the output angle as its encoder read it.
        """


def worth(probe: Probe, gain: float, freedom: int, odds: float = 0.0) -> float:
    """A `gain` on the residual of `probe`, noise variances, less what so much `freedom` and `odds` against it pay."""
    return gain - math.log(max(len(probe.residual), 2)) * freedom + 2 * odds


def best_terms(probe: Probe, terms: Sequence[Term], keep: int = 1) -> list[Term]:
    """The `keep` of `terms` with the largest gain on the residual of `probe`, after paying for freedom and odds."""
    if len(terms) < 2:
        return list(terms)[:keep]
    gains = zip(terms, probe.gains(terms), strict=True)
    scores = [worth(probe, gain, term.freedom, term.odds) for term, gain in gains]
    ranked = sorted(range(len(terms)), key=scores.__getitem__, reverse=True)
    return [terms[i] for i in ranked[:keep]]


def strongest_orders(probe: Probe, count: int, lowest: float = 0.2, highest: float | None = None) -> list[float]:
    """The `count` strongest separate orders of the residual of `probe`, from `lowest` to `highest` cycles an input turn
    (as far as the rows hold them if None).
    """
    span = probe.samples.span_turns
    highest = highest or min(0.45 * probe.samples.rows_per_turn, probe.order_range[1])
    grid = np.arange(max(lowest, 1.0 / span), highest, 0.25 / span)
    if len(grid) < 8:
        return []
    amplitude = probe.spectrum(grid)
    found: list[float] = []
    for _ in range(count):
        at = int(np.argmax(amplitude))
        if amplitude[at] <= 0:
            break
        found.append(float(grid[at]))
        amplitude[np.abs(grid - grid[at]) < 1.5 / span] = 0.0
    return found
