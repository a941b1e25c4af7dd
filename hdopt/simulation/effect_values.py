"""One effect of the catalogue with its numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from hdopt.arrays import Array
from hdopt.effects import EFFECTS
from hdopt.effects.base import Effect
from hdopt.effects.conditions import Conditions
from hdopt.effects.term import Shape, Term


@dataclass(frozen=True)
class EffectValues:
    """An effect of the catalogue at given numbers: its `shape` and the coefficients of its columns, as in a `Term`."""

    id: str
    shape: Shape
    coefficients: tuple[float, ...]

    @classmethod
    def fitted(cls, term: Term, coefficients: Array) -> EffectValues:
        """The effect of a fitted `term` at its `coefficients` (p,), without the columns that only describe how a
        recording began.
        """
        kept = coefficients[: EFFECTS[term.effect].lasting(term.shape)]
        return cls(term.effect, dict(term.shape), tuple(map(float, kept)))

    @property
    def effect(self) -> Effect:
        """Its physics."""
        return EFFECTS[self.id]

    @property
    def origin(self) -> str:
        """'bench' or 'drive'."""
        return self.effect.origin

    @property
    def needs(self) -> Mapping[str, str]:
        """The numbers of an `Operation` that this effect needs, with their study keys."""
        return self.effect.needs_of(self.shape)

    @property
    def follows_base(self) -> bool:
        """Whether the drive's own motion drives this effect: it has no value at one angle alone."""
        return self.effect.driven

    @property
    def moves_the_output(self) -> bool:
        """Whether the columns of this effect are a motion of the drive, which excites what swings behind it."""
        return self.effect.excites

    def term(self, conditions: Conditions, motion: Array | None = None) -> Term:
        """The effect's columns at these `conditions`, by its own physics; `motion` (n,), arcmin, of the drive before
        its spring, for what follows it.
        """
        return self.effect.predict(conditions, self.shape, motion)

    def highest_order(self, ratio: float) -> float:
        """The highest order (cycles an input turn) that a sampling of this effect must resolve, at `ratio` N."""
        return self.effect.highest_order(self.shape, ratio)

    def orders(self, ratio: float) -> list[float]:
        """Orders that this effect adds to the spectrum at `ratio` N, where it is made of sines."""
        return self.effect.orders(self.shape, ratio)

    def remark(self, both_ways: bool) -> str | None:
        """What the operating condition keeps from showing, in plain words; `both_ways`: the motion reverses."""
        return self.effect.remark(self.shape, both_ways)
