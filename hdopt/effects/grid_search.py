"""The search that any effect has by default: a grid over its prior ranges, then ever closer around the best node."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hdopt.arrays import Array
from hdopt.effects.probe import Probe, best_terms
from hdopt.effects.term import Shape, Term

NODES = 9
"""Values of each continuous number on the first grid."""
WIDE = 10.0
"""Ends of a prior that lie farther apart than by this factor are searched in equal ratios."""
ROUNDS = 4
"""How often the grid is halved around its best node."""
DERIVATIVE_STEP = 0.02
"""Step of a derivative, in distances of the grid."""


@dataclass(frozen=True)
class Axis:
    """A continuous number `name` of a shape, with its prior range from `low` to `high`."""

    name: str
    low: float
    high: float

    @property
    def by_ratio(self) -> bool:
        """Whether it is searched in equal ratios."""
        return self.low > 0 and self.high > WIDE * self.low

    @property
    def grid(self) -> Array:
        """The first values that are tried, (NODES,)."""
        return (np.geomspace if self.by_ratio else np.linspace)(self.low, self.high, NODES)

    def inside(self, value: float) -> float:
        """`value`, kept to the prior range."""
        return min(max(float(value), self.low), self.high)

    def step(self, value: float) -> float:
        """A step for the derivative at `value`."""
        if self.by_ratio:
            return float(DERIVATIVE_STEP * value * np.log(self.high / self.low) / (NODES - 1))
        return DERIVATIVE_STEP * (self.high - self.low) / (NODES - 1)

    def beside(self, value: float, share: float) -> tuple[float, float]:
        """The values `share` of a distance of the grid below and above `value`."""
        if self.by_ratio:
            factor = (self.high / self.low) ** (share / (NODES - 1))
            return self.inside(value / factor), self.inside(value * factor)
        off = share * (self.high - self.low) / (NODES - 1)
        return self.inside(value - off), self.inside(value + off)


def search_on_grid(
    probe: Probe, axes: Sequence[Axis], discrete: Mapping[str, Sequence[object]], make: Callable[[Shape], Term]
) -> list[Term]:
    """The best term for the residual of `probe` over the grid of `axes` and every combination of the `discrete` values,
    refined around its node; `make` turns a shape into a term.
    """
    names = [*discrete, *(axis.name for axis in axes)]
    values = [*discrete.values(), *(list(map(float, axis.grid)) for axis in axes)]
    shapes = [dict(zip(names, combination, strict=True)) for combination in itertools.product(*values)]
    (best,) = best_terms(probe, [make(shape) for shape in shapes])
    share = 1.0
    for _ in range(ROUNDS if axes else 0):
        share /= 2
        for axis in axes:
            near = [make({**best.shape, axis.name: v}) for v in axis.beside(best.shape[axis.name], share)]
            (best,) = best_terms(probe, [best, *near])
    return [best]
