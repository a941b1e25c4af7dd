"""Estimated numbers of an effect: with intervals and units, from coefficients and their covariance."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from hdopt.arrays import Array

HALF_WIDTH_95 = 1.96
"""Standard deviations to either side in a 95 % interval of one number."""
ELLIPSE_POINTS = 720
"""Points round an ellipse: its extremes are right to 1e-5 of its radius."""


@dataclass(frozen=True)
class Parameter:
    """An estimated number with its 95 % interval and unit."""

    value: float
    low: float
    high: float
    unit: str

    @property
    def undefined(self) -> bool:
        """Whether it is an angle of which nothing is known, as the direction of an error that may be nil: its interval
        takes in the whole turn."""
        return self.unit == "deg" and self.high - self.low >= 360

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
        half = HALF_WIDTH_95 * math.sqrt(max(float(gradient @ self.covariance @ gradient), 0.0))
        return Parameter(value, value - half, value + half, unit)

    def sizes(self, sines: int) -> Array:
        """Sizes of the first so many `sines`, of which each has a sine's and a cosine's coefficient, (sines,)."""
        return np.asarray(np.hypot(self.values[0 : 2 * sines : 2], self.values[1 : 2 * sines : 2]))

    def amplitude(self, sin: int, cos: int, unit: str = "arcmin", scale: float = 1.0) -> Parameter:
        """Amplitude of a pair of sine and cosine coefficients (their places `sin` and `cos`), times `scale`, in `unit`.

        The interval is that of its profile likelihood, from zero on: of all points of the pair's 95 % ellipse (of one
        parameter) the smallest and the largest amplitude.
        """
        found = self.derived(lambda v: scale * math.hypot(v[sin], v[cos]), unit)
        pair = self._standardised(sin, cos)
        if pair is None:
            return replace(found, low=max(found.low, 0.0))
        root, standard = pair
        turn = 2 * math.pi * np.arange(ELLIPSE_POINTS) / ELLIPSE_POINTS
        ellipse = root @ (standard[:, None] + HALF_WIDTH_95 * np.array([np.cos(turn), np.sin(turn)]))
        sizes = abs(scale) * np.hypot(*ellipse)
        inside = float(standard @ standard) <= HALF_WIDTH_95**2
        return replace(found, low=0.0 if inside else float(sizes.min()), high=float(sizes.max()))

    def _standardised(self, sin: int, cos: int) -> tuple[Array, Array] | None:
        """A root (2, 2) of the covariance of two coefficients and the two in standard deviations, (2,); None where one
        of them is known exactly."""
        at = [sin, cos]
        try:
            root = np.asarray(np.linalg.cholesky(self.covariance[np.ix_(at, at)]), np.float64)
            return root, np.asarray(np.linalg.solve(root, self.values[at]), np.float64)
        except np.linalg.LinAlgError:
            return None

    def range_of(self, shapes: Array, unit: str) -> Parameter:
        """Largest less smallest value of the curve `shapes` (n, p) @ values."""
        curve = shapes @ self.values
        high, low = shapes[np.argmax(curve)], shapes[np.argmin(curve)]
        return self.derived(lambda v: float((high - low) @ v), unit)

    def phase_deg(self, sin: int, cos: int) -> Parameter:
        """Phase phi of a sin(x + phi), deg, in (-180, 180], from its sine and cosine coefficients at `sin` and `cos`.

        The interval is that of its profile likelihood: between the rays that touch the pair's 95 % ellipse (of one
        parameter); the full turn where that holds zero.
        """
        value = math.degrees(math.atan2(self.values[cos], self.values[sin]))
        pair = self._standardised(sin, cos)
        if pair is None:
            spread = self.derived(lambda v: _turn(math.degrees(math.atan2(v[cos], v[sin])) - value), "deg")
            half = min(spread.high - spread.value, 180.0)
            return Parameter(value, value - half, value + half, "deg")
        root, standard = pair
        size = float(np.hypot(*standard))
        if size <= HALF_WIDTH_95:
            return Parameter(value, value - 180.0, value + 180.0, "deg")
        away = math.asin(HALF_WIDTH_95 / size)
        ends = []
        for angle in (-away, away):
            turned = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
            first, second = root @ turned @ standard
            ends.append(_turn(math.degrees(math.atan2(second, first)) - value))
        return Parameter(value, value + min(ends), value + max(ends), "deg")


def _turn(angle: float) -> float:
    """An angle in degrees as one in [-180, 180)."""
    return (angle + 180) % 360 - 180
