"""A linear stack: a gap that is a sum of dimensions times sensitivities, kept to either side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hdopt.arrays import Array
from hdopt.errors import HdoptError, NoResult
from hdopt.tolerance.distributions import Normal
from hdopt.tolerance.space import InputSpace, Tolerance


@dataclass(frozen=True)
class Dimension:
    """One dimension: sensitivity of the gap, tolerance to either side, standard deviations within the tolerance."""

    sensitivity: float
    tolerance: float
    sigmas: float = 3.0


@dataclass(frozen=True)
class LinearResponse:
    """Size of the gap's deviation, |sum s_i x_i|, for deviations x of shape (n, d)."""

    sensitivities: tuple[float, ...]

    def signed(self, inputs: Array) -> Array:
        """The deviation with its sign: a straight line, which the size of it is not."""
        deviation: Array = inputs @ np.array(self.sensitivities)
        return deviation

    def __call__(self, inputs: Array) -> Array:
        return np.abs(self.signed(inputs))

    def upper_bound(self, lower: Array, upper: Array) -> float:
        """The largest size over a box: exact."""
        ends = np.stack([np.array(self.sensitivities) * side for side in (lower, upper)])
        return float(max(ends.max(axis=0).sum(), -ends.min(axis=0).sum()))


def linear_problem(dimensions: Mapping[str, Dimension]) -> tuple[LinearResponse, InputSpace]:
    """Response and inputs of a stack whose dimensions are normal, truncated at their tolerances."""
    tolerances = {}
    for name, d in dimensions.items():
        try:
            deviation = Normal(std=d.tolerance / d.sigmas, lower=-d.tolerance, upper=d.tolerance)
        except HdoptError as error:
            raise NoResult(f"dimension {name}: {error}") from error
        tolerances[name] = Tolerance.of_deviation(deviation)
    return LinearResponse(tuple(d.sensitivity for d in dimensions.values())), InputSpace(tolerances)
