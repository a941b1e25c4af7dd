"""Estimated numbers of an effect: with intervals and units, from coefficients and their covariance."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from hdopt.arrays import Array


@dataclass(frozen=True)
class Parameter:
    """An estimated number with its 95 % interval and unit."""

    value: float
    low: float
    high: float
    unit: str

    def to_dict(self) -> dict[str, object]:
        """As JSON: value, low, high, unit."""
        return {"value": self.value, "low": self.low, "high": self.high, "unit": self.unit}


def counted(number: float) -> Parameter:
    """A whole number that was searched: it has no interval."""
    return Parameter(float(number), float(number), float(number), "1")


@dataclass(frozen=True)
class FitEstimate:
    """Fitted coefficients of one term, then its free shape parameters, with their covariance.

    `profiles` has 95 % intervals of numbers (by their place in `values`) for which +-1.96 standard deviations do not
    serve.
    """

    values: Array
    covariance: Array
    profiles: Mapping[int, tuple[float, float]] = field(default_factory=dict)

    def parameter(self, index: int, unit: str, scale: float = 1.0, offset: float = 0.0) -> Parameter:
        """Coefficient `index` times `scale` plus `offset`, with its 95 % interval, in `unit`."""
        if index in self.profiles:
            low, high = sorted(scale * end + offset for end in self.profiles[index])
            return Parameter(float(scale * self.values[index] + offset), low, high, unit)
        return self.derived(lambda v: scale * v[index] + offset, unit)

    def derived(self, function: Callable[[Array], float], unit: str) -> Parameter:
        """Any function of the values, with an interval by its gradient (delta method)."""
        value = float(function(self.values))
        gradient = np.zeros(len(self.values))
        for i in range(len(self.values)):
            step = 1e-4 * max(abs(self.values[i]), math.sqrt(max(self.covariance[i, i], 0.0)), 1e-12)
            up, down = self.values.copy(), self.values.copy()
            up[i] += step
            down[i] -= step
            gradient[i] = (function(up) - function(down)) / (2 * step)
        half = 1.96 * math.sqrt(max(float(gradient @ self.covariance @ gradient), 0.0))
        return Parameter(value, value - half, value + half, unit)

    def amplitude(self, sin: int, cos: int, unit: str = "arcmin", scale: float = 1.0) -> Parameter:
        """Amplitude of a pair of sine and cosine coefficients, times `scale`; its interval ends at zero."""
        found = self.derived(lambda v: scale * math.hypot(v[sin], v[cos]), unit)
        return replace(found, low=max(found.low, 0.0))

    def range_of(self, shapes: Array, unit: str) -> Parameter:
        """Largest less smallest value of the curve `shapes` (n, p) @ values."""
        curve = shapes @ self.values
        high, low = shapes[np.argmax(curve)], shapes[np.argmin(curve)]
        return self.derived(lambda v: float((high - low) @ v), unit)

    def phase_deg(self, sin: int, cos: int) -> Parameter:
        """Phase phi of a sin(x + phi) from its sine and cosine coefficients, deg, in (-180, 180]; at worst +-180."""
        value = math.degrees(math.atan2(self.values[cos], self.values[sin]))
        spread = self.derived(lambda v: (math.degrees(math.atan2(v[cos], v[sin])) - value + 180) % 360 - 180, "deg")
        half = min(spread.high - spread.value, 180.0)
        return Parameter(value, value - half, value + half, "deg")
