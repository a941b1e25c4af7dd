"""The protocol behind which every effect of the catalogue stands, and the terms it puts into a fit."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numba import njit
from numpy.typing import NDArray

from hdopt.diagnosis.samples import Samples

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Parameter:
    """An estimated number with its 95 % interval and unit."""

    value: float
    low: float
    high: float
    unit: str

    def to_dict(self) -> dict[str, object]:
        return {"value": self.value, "low": self.low, "high": self.high, "unit": self.unit}


@dataclass(frozen=True)
class Term:
    """An effect written as columns of a linear fit at a given shape (its parameters that are not linear).

    `columns` (n, p) in arcmin per coefficient; or `zones` (2, n, p) in mm, which act inside the larger-zone rule of the
    base. `steps` names the shape parameters that may move in the fit, with a step for their derivative; `trials` is how
    many different shapes the search looked at, which the evidence pays for.
    """

    effect: str
    shape: Mapping[str, float]
    columns: Array | None = None
    zones: Array | None = None
    steps: Mapping[str, float] = field(default_factory=dict)
    trials: float = 1.0
    odds: float = 0.0
    """Log prior odds of this variant against the effect's plainest one."""
    doubtful: bool = False
    """Whether it must beat all others clearly: it has no physics, or stands at the orders of another effect."""
    kept: bool = False
    """Whether the rows remember this term, so that what is computed of it may be remembered too."""

    @property
    def width(self) -> int:
        source = self.columns if self.columns is not None else self.zones
        return source.shape[-1]

    @property
    def freedom(self) -> int:
        return self.width + len(self.steps)


class Probe(Protocol):
    """What a search may ask of the residual: it answers with the base (and the effects already found) refitted."""

    samples: Samples
    residual: Array
    motion: Array
    """The drive's motion before its spring, arcmin, (n,): what excites a resonance."""
    order_range: tuple[float, float]
    """Orders (cycles per input turn) that the search looks at."""

    def gain(self, term: Term) -> float:
        """Drop of the weighted sum of squares, in units of the noise variance, when `term` joins the fit."""

    def table(self, term: Term) -> tuple[Array, Array]:
        """Inner products of the term's columns with each other and with the residual, the refitted base taken out."""

    def spectrum(self, orders: Array) -> Array:
        """Amplitude (arcmin) of the residual at each order, by least squares."""


class Effect(Protocol):
    """One physics left out of the base model.

    Where it applies, an effect also has: `exact_shape`, True where nothing of it is left for another to explain;
    `leaves_nothing`, True where it reaches no orders but its own; `every_part_shows(term, estimate)`, whether a fit has
    all that the term stands for (`credible`); `trimmed(term, coefficients)`, the shape of what shows, or None;
    `shortened(term)`, shapes that bend less; `excites`, True where its columns move the drive's output (as whatever
    acts in the zones does), and `response(samples, shape, coefficients, motions)` where it follows such a motion
    (`transmission`).
    """

    id: str
    domain: str
    """Where it lives: order, angle, direction, reversal, torque, speed, temperature or time."""
    separating: str
    """The measurement that would show it apart from others."""

    def lacks(self, samples: Samples) -> str | None:
        """What the recordings would need to show this effect, or None where they can."""

    def search(self, probe: Probe) -> Sequence[Term]:
        """The best terms for this residual, one for each variant worth considering."""

    def term(self, samples: Samples, shape: Mapping[str, float], base_value: Array | None = None) -> Term:
        """The term at a given shape, kept to what the recordings can show.

        Where such limits exist, `unbounded(samples, shape, base_value)` is the same physics without them, and an effect
        with a memory of speed has `steady_state` in its place: both serve `hdopt.extended`, which predicts.
        """

    def parameters(self, term: Term, estimate: Estimate) -> dict[str, Parameter]:
        """The effect's parameters with units and intervals."""

    def sentence(self, parameters: Mapping[str, Parameter], rms_arcmin: float) -> str:
        """One plain sentence for an engineer."""


@dataclass(frozen=True)
class Estimate:
    """Fitted coefficients of one term, then its free shape parameters, with their covariance."""

    values: Array
    covariance: Array

    def parameter(self, index: int, unit: str, scale: float = 1.0, offset: float = 0.0) -> Parameter:
        """Coefficient `index` times `scale` plus `offset`, with its 95 % interval."""
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


def sine_columns(phase: Array, harmonics: Sequence[float]) -> Array:
    """sin and cos of each multiple of `phase`, shape (n, 2 len(harmonics)): sin first."""
    phase, harmonics = np.ascontiguousarray(phase, float), np.asarray(harmonics, float)
    whole = harmonics.astype(np.int64)
    if len(whole) > 1 and np.all(whole == harmonics) and 0 < whole.min() and whole.max() <= 4 * len(whole):
        return _whole_sines(phase, whole)
    return _sines(phase, harmonics)


@njit(cache=True, nogil=True)
def _sines(phase, harmonics):
    columns = np.empty((len(phase), 2 * len(harmonics)))
    for i in range(len(phase)):
        for k in range(len(harmonics)):
            columns[i, 2 * k] = math.sin(harmonics[k] * phase[i])
            columns[i, 2 * k + 1] = math.cos(harmonics[k] * phase[i])
    return columns


@njit(cache=True, nogil=True)
def _whole_sines(phase, harmonics):
    """The same for whole multiples, each from the one before by the sine's and cosine's addition theorems."""
    columns = np.empty((len(phase), 2 * len(harmonics)))
    place = np.full(harmonics.max() + 1, -1)
    for k in range(len(harmonics)):
        place[harmonics[k]] = k
    for i in range(len(phase)):
        sine, cosine = math.sin(phase[i]), math.cos(phase[i])
        s, c = 0.0, 1.0
        for h in range(1, len(place)):
            s, c = s * cosine + c * sine, c * cosine - s * sine
            if place[h] >= 0:
                columns[i, 2 * place[h]] = s
                columns[i, 2 * place[h] + 1] = c
    return columns


def terms_at(effect: Effect, samples: Samples, shapes: Sequence[Mapping[str, float]]) -> list[Term]:
    """`effect` at shapes that every search of the same rows looks at: made once, and remembered with the rows."""
    made = []
    for shape in shapes:
        key = (effect.id, *sorted(shape.items()))
        if key not in samples.remembered:
            samples.remembered[key] = replace(effect.term(samples, shape), kept=True)
        made.append(samples.remembered[key])
    return made


def widest_that_pays(probe: Probe, terms: Sequence[Term]) -> list[Term]:
    """The best of `terms` after paying for their freedom, and the one before it; `terms` grow, and the growing stops
    where it twice did not pay.
    """
    cost = math.log(max(len(probe.residual), 2))
    ranked: list[tuple[float, int]] = []
    for i, term in enumerate(terms):
        ranked.append((probe.gain(term) - cost * term.freedom, i))
        if i - max(ranked)[1] >= 2:
            break
    return [terms[i] for _, i in sorted(ranked, reverse=True)[:2]]


def best_terms(probe: Probe, terms: Sequence[Term], keep: int = 1) -> list[Term]:
    """The `keep` terms with the largest gain after paying for their freedom and their odds."""
    cost = math.log(max(len(probe.residual), 2))
    ranked = sorted(terms, key=lambda term: probe.gain(term) - cost * term.freedom + 2 * term.odds, reverse=True)
    return ranked[:keep]


def strongest_orders(probe: Probe, count: int, lowest: float = 0.2, highest: float | None = None) -> list[float]:
    """The residual's strongest separate orders, cycles per input turn."""
    span = probe.samples.span_turns
    highest = highest or min(0.45 * probe.samples.rows_per_turn, probe.order_range[1])
    grid = np.arange(max(lowest, 1.0 / span), highest, 0.25 / span)
    if len(grid) < 8:
        return []
    amplitude = probe.spectrum(grid)
    found = []
    for _ in range(count):
        at = int(np.argmax(amplitude))
        if amplitude[at] <= 0:
            break
        found.append(float(grid[at]))
        amplitude[np.abs(grid - grid[at]) < 1.5 / span] = 0.0
    return found
