"""One combination's search as NLopt sees it: free variables in the unit cube, one objective, limits scaled to 1."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from hdopt.arrays import Array
from hdopt.optimize.design_space import Combination, DesignSpace, Variable
from hdopt.optimize.nlopt_adapter import Evaluation
from hdopt.optimize.objectives import STEP, DesignConditions, Point, find_quantity

SMALL_SCALE = 1e-3
"""What a limit of zero is scaled with, in the quantity's unit."""
Amount = TypeVar("Amount", float, Array)

ROUNDING = 1e-12
"""A bound nearer to zero than this, in the quantity's unit, is zero but for rounding."""


@dataclass(frozen=True)
class Limit:
    """A quantity that may not exceed `bound`, or where `at_least`, may not fall below it."""

    quantity: str
    bound: float
    at_least: bool = False

    @property
    def scale(self) -> float:
        return abs(self.bound) if abs(self.bound) > ROUNDING else SMALL_SCALE

    def excess(self, value: Amount) -> Amount:
        """How far a `value`, or each of an array, breaks the limit, as a share of the bound; below 0 it is kept."""
        return (self.bound - value if self.at_least else value - self.bound) / self.scale

    def __str__(self) -> str:
        quantity = find_quantity(self.quantity)
        sign = "at least" if self.at_least else "at most"
        return f"{quantity.title} {sign} {self.bound:.4g} {quantity.unit}".strip()


@dataclass(frozen=True)
class DesignProblem:
    """Minimise `objective` over a combination's variables, some of which may be `fixed`."""

    space: DesignSpace
    trade: DesignConditions
    combination: Combination
    objective: str
    limits: tuple[Limit, ...]
    fixed: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """The free ones."""
        return tuple(v for v in self.space.variables_of(self.combination) if v.name not in self.fixed)

    @property
    def n(self) -> int:
        return len(self.variables)

    @cached_property
    def _counts(self) -> tuple[int, int]:
        middle = self.point(self.values(np.full(self.n, 0.5)))

        def count(key: str) -> int:
            return len(find_quantity(key).pieces(middle)[0])

        return count(self.objective), sum(count(limit.quantity) for limit in self.limits)

    @property
    def pieces(self) -> int:
        return self._counts[0]

    @property
    def constraints(self) -> int:
        return self._counts[1]

    @cached_property
    def _ranges(self) -> tuple[Array, Array]:
        lower, spread = np.array([(v.lower, v.upper - v.lower) for v in self.variables]).reshape(-1, 2).T
        return lower, spread

    def values(self, u: Array) -> dict[str, float]:
        """Values of all variables at a point of the unit cube."""
        lower, spread = self._ranges
        free = lower + spread * np.asarray(u)
        return {**self.fixed, **{v.name: float(x) for v, x in zip(self.variables, free, strict=True)}}

    def place(self, values: Mapping[str, float]) -> Array:
        """The inverse, clipped to the cube."""
        lower, spread = self._ranges
        given = np.array([values[v.name] for v in self.variables]).reshape(-1)
        return np.clip((given - lower) / spread, 0.0, 1.0)

    def point(self, values: Mapping[str, float], slopes: bool = True) -> Point:
        steps = tuple((v.name, STEP * (v.upper - v.lower)) for v in self.variables) if slopes else ()
        return Point(self.space, self.trade, self.combination, dict(values), steps)

    def evaluate(self, u: Array, slopes: bool = True) -> Evaluation:
        point, spread = self.point(self.values(u), slopes), self._ranges[1]
        found = {key: find_quantity(key).pieces(point) for key in {self.objective, *(x.quantity for x in self.limits)}}
        if not slopes:
            found = {key: (values, np.zeros((len(values), self.n))) for key, (values, _) in found.items()}
        values, rates = found[self.objective]
        bounded: list[Array] = [np.empty(0)]
        bounded_rates: list[Array] = [np.empty((0, self.n))]
        for limit in self.limits:
            pieces, piece_rates = found[limit.quantity]
            bounded.append(limit.excess(pieces))
            bounded_rates.append((-1 if limit.at_least else 1) * piece_rates * spread / limit.scale)
        return Evaluation(values, rates * spread, np.concatenate(bounded), np.concatenate(bounded_rates))

    def with_fixed(self, **values: float) -> DesignProblem:
        return replace(self, fixed={**self.fixed, **values})

    def with_limits(self, *limits: Limit) -> DesignProblem:
        """With these limits too, each in place of one on the same side of the same quantity."""
        new = {(limit.quantity, limit.at_least) for limit in limits}
        kept = tuple(limit for limit in self.limits if (limit.quantity, limit.at_least) not in new)
        return replace(self, limits=(*kept, *limits))
