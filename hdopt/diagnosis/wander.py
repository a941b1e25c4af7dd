"""Slow effects against slow wander.

A drift, an eccentric output encoder or a long loop changes over many turns, and so does a joint that creeps in steps
too small to see: a random walk, which any slow curve fits far better than chance within a turn would allow. The noise
model looks a few rows back and cannot tell. So each slow term is weighed once more on means over a quarter of a turn,
whose noise is measured, as an autoregression of its own, on what the fit leaves there: where that is still a walk, the
curve has shown nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hdopt.diagnosis.fit import Fit, shape_columns
from hdopt.diagnosis.samples import Samples

Array = NDArray[np.float64]

PER_TURN = 4
"""Means an input turn."""
SLOW_TURNS, SLOW = 2, 0.5
"""A term counts as slow whose means over so many turns of travel still hold this share of its power."""
FEWEST_PERIODS, LINE = 3, 60.0
"""Periods of a slow wave in a record, and its power over the median beside it, from which it is one: of a few hundred
frequencies the strongest of a walk stands about 10 times above.
"""
FEWEST_MEANS = 40
"""Means below which nothing can be said of their noise."""


@dataclass(frozen=True)
class SlowWave:
    """A wave in time much slower than the input turns: its period (s) and rms (arcmin)."""

    period: float
    rms: float


class _QuarterTurns:
    """Means of rows over quarters of an input turn, within a record."""

    def __init__(self, samples: Samples):
        self.cell = _cells(samples)
        self.count = np.bincount(self.cell).astype(float)
        self.record = samples.record[np.searchsorted(self.cell, np.arange(len(self.count)))]

    def __len__(self) -> int:
        return len(self.count)

    def of(self, values: Array) -> Array:
        """Means of columns (n, k), or of one (n,), in the same form."""
        columns = values.reshape(len(values), -1).T
        means = np.column_stack([np.bincount(self.cell, column) / self.count for column in columns])
        return means if values.ndim > 1 else means[:, 0]


def lost_in_wander(fit: Fit, index: int, price: float) -> bool:
    """Whether term `index` of `fit` is slow and does not pay its `price` (log evidence) against the wander left."""
    samples = fit.problem.samples
    if samples.locked:
        return False
    quarters = _QuarterTurns(samples)
    if len(quarters) < FEWEST_MEANS:
        return False
    contribution = fit.contribution(index)
    means = quarters.of(contribution)
    longer = np.arange(len(quarters)) // (PER_TURN * SLOW_TURNS)
    weight = np.bincount(longer, quarters.count)
    over_turns = np.bincount(longer, means * quarters.count) / weight
    spread = np.average((over_turns - np.average(over_turns, weights=weight)) ** 2, weights=weight)
    if spread < SLOW * np.var(contribution):
        return False

    def columns(numbers: Sequence[int]) -> list[Array]:
        return [block for i in numbers for block in (fit.columns_of(fit.terms[i]), shape_columns(fit, i))]

    own = np.column_stack(columns([index]))
    beside = quarters.of(np.column_stack([fit.problem.nuisance, *columns(fit.all_but(index))]))
    left = quarters.of(fit.residual)
    ar, start = _autoregression(left, quarters.record)
    target = _filtered(left + means, ar, start)
    others = _filtered(beside, ar, start)
    with_own = _filtered(np.column_stack([beside, quarters.of(own)]), ar, start)
    without, complete = (_left_over(columns, target) for columns in (others, with_own))
    variance = complete / max(len(target) - with_own.shape[1], 1)
    return (without - complete) / variance / 2 < price


def slow_wave(fit: Fit) -> SlowWave | None:
    """A single slow line in what `fit` leaves that stands far above the wander beside it, or None.

    A wave of many turns' length is colour to a noise model of a few rows; over the record it is one line. The wander
    is taken as a first-order autoregression, which cannot make a line of its own.
    """
    samples = fit.problem.samples
    if samples.locked or samples.time is None:
        return None
    quarters = _QuarterTurns(samples)
    means, time = (quarters.of(values) for values in (fit.residual, samples.time))
    found = None
    for number in np.unique(quarters.record):
        own = quarters.record == number
        wave = _line(time[own], means[own])
        if wave is not None and (found is None or wave.rms > found.rms):
            found = wave
    return found


def _line(time: Array, values: Array) -> SlowWave | None:
    """The strongest line of one record's means, where it stands `LINE` times above the median of its wander."""
    n = len(values)
    if n < FEWEST_MEANS:
        return None
    step = (time[-1] - time[0]) / (n - 1)
    even = np.interp(time[0] + step * np.arange(n), time, values)
    even = even - even.mean()
    pole = min(max(float(even[1:] @ even[:-1]) / max(float(even @ even), 1e-300), 0.0), 0.99)
    power = np.abs(np.fft.rfft((even[1:] - pole * even[:-1]) * np.hanning(n - 1))) ** 2
    low, high = FEWEST_PERIODS, n // PER_TURN
    if high - low < 12:
        return None
    top = low + int(np.argmax(power[low:high]))
    beside = np.r_[power[max(low, top - 30) : max(low, top - 2)], power[top + 3 : min(high, top + 30)]]
    if len(beside) < 8 or power[top] < LINE * np.median(beside):
        return None
    columns = np.column_stack([np.ones(n), *_neighbours(np.arange(n) / n, top)])
    fitted = columns @ np.linalg.lstsq(columns, even, rcond=None)[0]
    return SlowWave(period=n * step / top, rms=float(np.std(fitted)))


def _neighbours(along: Array, cycles: int) -> list[Array]:
    return [f(2 * math.pi * (cycles + off) * along) for off in (-0.5, 0.0, 0.5) for f in (np.sin, np.cos)]


def _cells(samples: Samples) -> NDArray[np.int64]:
    """Number of the quarter turn of each row, counted along the motion; reversals and gaps begin a new one."""
    quarter = np.floor(samples.theta / (2 * math.pi / PER_TURN)).astype(np.int64)
    change = (np.diff(quarter) != 0) | (np.diff(samples.piece) != 0) | (np.diff(samples.direction) != 0)
    return np.r_[0, np.cumsum(change)]


def _autoregression(values: Array, record: NDArray[np.int64], orders: int = 2) -> tuple[Array, NDArray[np.bool_]]:
    """Coefficients by least squares, of the order that Schwarz's criterion prefers, and the means that have a past."""
    n = len(values)
    usable = np.zeros(n, bool)
    usable[orders:] = record[orders:] == record[:-orders]
    rows = np.flatnonzero(usable)
    past = np.column_stack([values[rows - lag] for lag in range(1, orders + 1)])
    best, best_score = np.zeros(0), len(rows) * math.log(max(float(values[rows] @ values[rows]), 1e-300))
    for order in range(1, orders + 1):
        ar = np.linalg.lstsq(past[:, :order], values[rows], rcond=None)[0]
        error = values[rows] - past[:, :order] @ ar
        score = len(rows) * math.log(max(float(error @ error), 1e-300)) + order * math.log(len(rows))
        if score < best_score:
            best, best_score = ar, score
    if len(best):
        # What a trend leaves of a walk looks less like one (Kendall, Biometrika 41, 1954; with a trend twice as much).
        total = float(best.sum())
        best = best + np.eye(len(best))[0] * max(min((2 + 4 * total) / len(rows), 1 - total), 0.0)
    return best, usable


def _filtered(values: Array, ar: Array, usable: NDArray[np.bool_]) -> Array:
    rows = np.flatnonzero(usable)
    result = values[rows]
    for lag, a in enumerate(ar, start=1):
        result = result - a * values[rows - lag]
    return result


def _left_over(columns: Array, target: Array) -> float:
    scale = np.sqrt((columns**2).sum(0))
    columns = columns / np.where(scale > 0, scale, 1.0)
    rest = target - columns @ np.linalg.lstsq(columns, target, rcond=1e-8)[0]
    return float(rest @ rest)
