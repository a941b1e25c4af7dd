"""The random inputs of a stack: what varies, how, and how the unit cube maps onto it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from hdopt.arrays import Array
from hdopt.errors import HdoptError, unknown_name
from hdopt.tolerance.copula import CorrelationGroup, GaussianCopula
from hdopt.tolerance.distributions import Distribution, Scaled


@dataclass(frozen=True)
class Tolerance:
    """One random input: its distribution, the tolerance that bounds it, and where a changed tolerance shrinks it to.

    `value` is the tolerance in the input's own unit; None where a tolerance makes no sense (a phase over a full turn).
    Changing it to t scales the distribution about `centre` by t/value.
    """

    distribution: Distribution
    value: float | None = None
    centre: float = 0.0

    @classmethod
    def of_magnitude(cls, distribution: Distribution) -> Tolerance:
        """Of a magnitude: the tolerance is its upper bound, and the distribution shrinks toward zero with it."""
        upper = distribution.support[1]
        return cls(distribution, upper if np.isfinite(upper) and upper > 0 else None, 0.0)

    @classmethod
    def of_deviation(cls, distribution: Distribution) -> Tolerance:
        """Of a deviation to either side: half the range, and the distribution shrinks toward the middle with it."""
        lower, upper = distribution.support
        if not (np.isfinite(lower) and np.isfinite(upper)):
            return cls(distribution, None, 0.0)
        return cls(distribution, (upper - lower) / 2, (lower + upper) / 2)

    def scaled_to(self, value: float) -> Distribution:
        """The distribution under another tolerance."""
        if self.value is None:
            raise HdoptError("an input without bounds has no tolerance to change; give it an upper bound")
        return Scaled(base=self.distribution, factor=value / self.value, centre=self.centre)


@dataclass(frozen=True)
class InputSpace:
    """All random inputs, in the order of the columns of a sample. `groups` names sets of inputs that belong together,
    `folded` those whose response has its kink at zero (a tilt to either side), `turning` directions and phases. An
    input of `fields`, all of which turn, picks a whole random field: its numbers have neither order nor bounds."""

    tolerances: Mapping[str, Tolerance]
    correlations: tuple[CorrelationGroup, ...] = ()
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    folded: frozenset[str] = frozenset()
    turning: frozenset[str] = frozenset()
    fields: frozenset[str] = frozenset()
    copula: GaussianCopula = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if not self.tolerances:
            raise HdoptError("nothing varies: no tolerances are given; add [tolerances] to the study")
        object.__setattr__(self, "copula", GaussianCopula(self.names, self.correlations))

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.tolerances)

    @property
    def dimension(self) -> int:
        return len(self.tolerances)

    @property
    def marginals(self) -> tuple[Distribution, ...]:
        return tuple(tolerance.distribution for tolerance in self.tolerances.values())

    @property
    def values(self) -> dict[str, float]:
        """The tolerances that can be changed, by input."""
        return {
            name: t.value for name, t in self.tolerances.items() if t.value is not None and name not in self.turning
        }

    def index(self, name: str) -> int:
        if name not in self.tolerances:
            raise HdoptError(unknown_name("input", name, self.names))
        return self.names.index(name)

    @property
    def box(self) -> tuple[Array, Array]:
        """Lower and upper bounds of all inputs, infinite where there is none."""
        lower, upper = zip(*(marginal.support for marginal in self.marginals), strict=True)
        return np.array(lower), np.array(upper)

    def sample(self, u: Array) -> Array:
        """Points of the unit cube, shape (n, d) in (0, 1), to values of the inputs, same shape, columns contiguous."""
        return self.from_uniform(self.copula.correlate(u))

    def from_uniform(self, u: Array) -> Array:
        """The same from uniforms that are already dependent."""
        values = np.empty((self.dimension, len(u)))
        for row, (column, marginal) in enumerate(zip(u.T, self.marginals, strict=True)):
            values[row] = marginal.quantile(column)
        return values.T

    def from_scores(self, scores: Array) -> Array:
        """Values of the inputs from (already dependent) normal scores, shape (n, d)."""
        from scipy import special

        return self.from_uniform(np.clip(special.ndtr(scores), 1e-300, 1 - 2**-53))

    def with_tolerances(self, values: Mapping[str, float]) -> InputSpace:
        """The same inputs under other tolerances; each distribution scales with its own."""
        changed = dict(self.tolerances)
        for name, value in values.items():
            self.index(name)
            tolerance = self.tolerances[name]
            changed[name] = Tolerance(tolerance.scaled_to(value), value, tolerance.centre)
        return InputSpace(changed, self.correlations, self.groups, self.folded, self.turning, self.fields)
