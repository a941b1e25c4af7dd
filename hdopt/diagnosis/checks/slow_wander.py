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

from hdopt.arrays import Array, Index, Mask
from hdopt.diagnosis.inference.fit import Fit, shape_columns
from hdopt.diagnosis.numerical import LEAST_SQUARES_RANK, TINY
from hdopt.diagnosis.settings import WanderSettings
from hdopt.recordings.rows import Rows

KENDALL = 4
"""Of the bias (2 + 4 a)/n of a first-order coefficient a where a trend is fitted (Kendall, Biometrika 41, 1954)."""
HALF_STEPS = (-0.5, 0.0, 0.5)
"""Frequencies about a line, in resolution steps, that together describe a line between two of them."""


@dataclass(frozen=True)
class SlowWave:
    """A wave in time much slower than the input turns: its period (s) and rms (arcmin)."""

    period: float
    rms: float


class _Means:
    """Means of rows over a part of an input turn, within a record."""

    def __init__(self, rows: Rows, settings: WanderSettings):
        self.cell = _cells(rows, settings.means_a_turn)
        self.count = np.bincount(self.cell).astype(float)
        self.record = rows.record[np.searchsorted(self.cell, np.arange(len(self.count)))]

    def __len__(self) -> int:
        return len(self.count)

    def of(self, values: Array) -> Array:
        """Means of columns (n, k), or of one (n,), in the same form."""
        columns = values.reshape(len(values), -1).T
        means = np.column_stack([np.bincount(self.cell, column) / self.count for column in columns])
        return means if values.ndim > 1 else means[:, 0]


def lost_in_wander(fit: Fit, index: int, penalty: float) -> bool:
    """Whether term `index` of `fit` is slow and does not pay its `penalty` (log evidence) against the wander left."""
    quarters, settings = _quarters(fit), fit.problem.settings.wander
    if quarters is None or not _is_slow(fit.contribution(index), quarters, settings):
        return False
    means = quarters.of(fit.contribution(index))

    def columns(numbers: Sequence[int]) -> list[Array]:
        return [block for i in numbers for block in (fit.columns_of(fit.terms[i]), shape_columns(fit, i))]

    own = np.column_stack(columns([index]))
    beside = quarters.of(np.column_stack([fit.problem.nuisance, *columns(fit.all_but(index))]))
    left = quarters.of(fit.residual)
    ar, start = _autoregression(left, quarters.record, settings.ar_order)
    target = _filtered(left + means, ar, start)
    others = _filtered(beside, ar, start)
    with_own = _filtered(np.column_stack([beside, quarters.of(own)]), ar, start)
    without, complete = (_left_over(columns, target) for columns in (others, with_own))
    variance = complete / max(len(target) - with_own.shape[1], 1)
    return bool((without - complete) / variance / 2 < penalty)


def is_slow(fit: Fit, index: int) -> bool:
    """Whether means over a few turns still hold most of the power of term `index` of `fit`; never of a locked input, or
    of a record of few turns."""
    quarters = _quarters(fit)
    return quarters is not None and _is_slow(fit.contribution(index), quarters, fit.problem.settings.wander)


def _quarters(fit: Fit) -> _Means | None:
    """Means over parts of a turn of what belongs to `fit`; None of a locked input, and where they are few."""
    rows, settings = fit.problem.rows, fit.problem.settings.wander
    if rows.locked:
        return None
    quarters = _Means(rows, settings)
    return quarters if len(quarters) >= settings.fewest_means else None


def _is_slow(contribution: Array, means: _Means, settings: WanderSettings) -> bool:
    """Whether means over a few turns still hold most of the power of `contribution` (n,)."""
    longer = np.arange(len(means)) // (settings.means_a_turn * settings.slow_turns)
    weight = np.bincount(longer, means.count)
    over_turns = np.bincount(longer, means.of(contribution) * means.count) / weight
    spread = np.average((over_turns - np.average(over_turns, weights=weight)) ** 2, weights=weight)
    return bool(spread >= settings.slow_share * np.var(contribution))


def slow_wave(fit: Fit) -> SlowWave | None:
    """A single slow line in what `fit` leaves that stands far above the wander beside it, or None.

    A wave of many turns' length is colour to a noise model of a few rows; over the record it is one line. The wander
    is taken as a first-order autoregression, which cannot make a line of its own.
    """
    rows, settings = fit.problem.rows, fit.problem.settings.wander
    if rows.locked or rows.time is None:
        return None
    quarters = _Means(rows, settings)
    means, time = quarters.of(fit.residual), quarters.of(rows.time)
    found = None
    for number in np.unique(quarters.record):
        own = quarters.record == number
        wave = _line(time[own], means[own], settings)
        if wave is not None and (found is None or wave.rms > found.rms):
            found = wave
    return found


def _line(time: Array, values: Array, settings: WanderSettings) -> SlowWave | None:
    """The strongest line of one record's means, where it stands far above the median of its wander.

    The means are even in angle, nearly so in time; a Lomb-Scargle periodogram would take them as they are, but not
    whiten them by their wander first.
    """
    n = len(values)
    if n < settings.fewest_means:
        return None
    step = (time[-1] - time[0]) / (n - 1)
    even = np.interp(time[0] + step * np.arange(n), time, values)
    even = even - even.mean()
    pole = min(max(float(even[1:] @ even[:-1]) / max(float(even @ even), TINY), 0.0), settings.largest_pole)
    power = np.abs(np.fft.rfft((even[1:] - pole * even[:-1]) * np.hanning(n - 1))) ** 2
    low, high = settings.fewest_periods, n // settings.means_a_turn
    if high - low < settings.fewest_cells:
        return None
    top = low + int(np.argmax(power[low:high]))
    reach, guard = settings.beside, settings.guard
    beside = np.r_[
        power[max(low, top - reach) : max(low, top - guard)], power[top + guard + 1 : min(high, top + reach)]
    ]
    if len(beside) < settings.fewest_beside or power[top] < settings.line * np.median(beside):
        return None
    columns = np.column_stack([np.ones(n), *_neighbours(np.arange(n) / n, top)])
    fitted = columns @ np.linalg.lstsq(columns, even, rcond=None)[0]
    return SlowWave(period=n * step / top, rms=float(np.std(fitted)))


def _neighbours(along: Array, cycles: int) -> list[Array]:
    return [f(2 * math.pi * (cycles + off) * along) for off in HALF_STEPS for f in (np.sin, np.cos)]


def _cells(rows: Rows, per_turn: int) -> Index:
    """Number of the part of a turn of each row, counted along the motion; reversals and gaps begin a new one."""
    part = np.floor(rows.theta / (2 * math.pi / per_turn)).astype(np.int64)
    change = (np.diff(part) != 0) | (np.diff(rows.piece) != 0) | (np.diff(rows.direction) != 0)
    return np.asarray(np.r_[0, np.cumsum(change)], np.int64)


def _autoregression(values: Array, record: Index, orders: int) -> tuple[Array, Mask]:
    """Coefficients by least squares, of the order up to `orders` that Schwarz's criterion prefers, and the means that
    have a past within their `record`.

    `statsmodels.tsa.ar_model.ar_select_order` does the same for one unbroken series; between records there is no past.
    """
    n = len(values)
    usable = np.zeros(n, bool)
    usable[orders:] = record[orders:] == record[:-orders]
    rows = np.flatnonzero(usable)
    past = np.column_stack([values[rows - lag] for lag in range(1, orders + 1)])
    best: Array = np.zeros(0)
    best_score = len(rows) * math.log(max(float(values[rows] @ values[rows]), TINY))
    for order in range(1, orders + 1):
        ar = np.asarray(np.linalg.lstsq(past[:, :order], values[rows], rcond=None)[0], float)
        error = values[rows] - past[:, :order] @ ar
        score = len(rows) * math.log(max(float(error @ error), TINY)) + order * math.log(len(rows))
        if score < best_score:
            best, best_score = ar, score
    if len(best):
        # What a trend leaves of a walk looks less like one (Kendall, Biometrika 41, 1954; with a trend twice as much).
        total = float(best.sum())
        best = best + np.eye(len(best))[0] * max(min((2 + KENDALL * total) / len(rows), 1 - total), 0.0)
    return best, usable


def _filtered(values: Array, ar: Array, usable: Mask) -> Array:
    rows = np.flatnonzero(usable)
    result = values[rows]
    for lag, a in enumerate(ar, start=1):
        result = result - a * values[rows - lag]
    return result


def _left_over(columns: Array, target: Array) -> float:
    scale = np.sqrt((columns**2).sum(0))
    columns = columns / np.where(scale > 0, scale, 1.0)
    rest = target - columns @ np.linalg.lstsq(columns, target, rcond=LEAST_SQUARES_RANK)[0]
    return float(rest @ rest)
