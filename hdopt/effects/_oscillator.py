"""An inertia on a spring whose foot moves: what its motion has beyond its foot's (`hdopt.effects.resonance`).

With y the motion of the foot, e = x - y obeys e'' + 2 zeta w e' + w^2 e = -y'' where the damper lies across the spring,
and what is added where it acts on the inertia from outside is the answer to -2 zeta w y'.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from numba import njit

from hdopt.arrays import Array
from hdopt.drive.geometry import ARCMIN
from hdopt.effects.conditions import TURN, Conditions

PER_PERIOD = 40
"""Steps of the even clock in a period of the oscillator, at least: straight lines between 12 would take 2 % off a
wave's height and put as much into damping and gain.
"""
MOST_STEPS = 400_000
ROWS_OF_THE_START = 5
"""Rows from which the speed is taken with which a piece begins."""
FASTEST = 2.5
"""Circular frequency times step beyond which the clock cannot follow."""


def relative_responses(
    conditions: Conditions, excitations: Array, frequency: float, damping: float, weights: Array
) -> Array:
    """x - y for each of the excitations y (arcmin, (n, k)) along the times of the `conditions`, at each pair of
    `weights` (2, m) of the two dampers; shape (n, k, m).

    Integrated on an even clock in each contiguous piece by Tustin's rule, prewarped at the resonance (`frequency`, Hz;
    `damping` zeta). Zero in pieces of fewer than 8 rows.
    """
    motions = np.ascontiguousarray(excitations.T)
    result = np.zeros((len(motions), weights.shape[1], len(conditions)))
    w = TURN * frequency
    bounds = np.r_[0, np.flatnonzero(np.diff(conditions.piece)) + 1, len(conditions)]
    for start, end in itertools.pairwise(bounds):
        time = conditions.known_time[start:end]
        if end - start < 8:
            continue
        span = float(time[-1] - time[0])
        count = min(max(end - start, int(span * PER_PERIOD * frequency) + 1), MOST_STEPS)
        step = span / (count - 1)
        if w * step > FASTEST:
            continue
        k = w / math.tan(w * step / 2)
        poles = np.array(
            [k * k + 2 * damping * w * k + w * w, 2 * w * w - 2 * k * k, k * k - 2 * damping * w * k + w * w]
        )
        forces = np.array([k * k * np.array([1.0, -2.0, 1.0]), 2 * damping * w * k * np.array([1.0, 0.0, -1.0])])
        zeros = -(weights.T @ forces) / poles[0]
        _swing(time, motions[:, start:end], zeros, poles / poles[0], step, count, result[:, :, start:end])
    return np.moveaxis(result, 2, 0)


def changes_of_speed(conditions: Conditions) -> tuple[Array, Array]:
    """The input's part theta/N of the foot's motion along the `conditions`, arcmin, (n,), as it enters the error (with
    a minus), without the steady motion that each contiguous piece begins with; and that motion's rate, arcmin/s, (n,).
    """
    angle = -conditions.theta / (conditions.ratio * ARCMIN)
    time = conditions.known_time
    left, rate = np.zeros(len(conditions)), np.zeros(len(conditions))
    bounds = np.r_[0, np.flatnonzero(np.diff(conditions.piece)) + 1, len(conditions)]
    for start, end in itertools.pairwise(bounds):
        first = slice(start, min(start + ROWS_OF_THE_START, end))
        span = np.ptp(time[first])
        slope = float(np.polyfit(time[first] - time[start], angle[first], 1)[0]) if span > 0 else 0.0
        rows = slice(start, end)
        rate[rows] = slope
        left[rows] = angle[rows] - angle[start] - slope * (time[rows] - time[start])
    return left, rate


def settled_drag(rate: Array, frequency: float, damping: float) -> Array:
    """What the damper on the output makes of a steady `rate` (arcmin/s, (n,)) of the foot at `frequency` (Hz) and
    `damping` ratio: -2 zeta/w of it, arcmin, (n,), the final value of -2 zeta w s/(s^2 + 2 zeta w s + w^2)/s^2.
    """
    return np.asarray(-2 * damping / (TURN * frequency) * rate)


@njit(cache=True, nogil=True)
def _swing(time: Array, excitations: Array, zeros: Array, poles: Array, step: float, count: int, result: Array) -> None:
    """The filter of `zeros` (m, 3) and `poles` (3,) along `count` even steps, straight lines between clock and rows;
    `excitations` (k, n), `result` (k, m, n).
    """
    columns, rows = excitations.shape
    kinds = len(zeros)
    row, part = np.empty(count, np.int64), np.empty(count)
    at = 0
    for i in range(count):
        now = time[0] + i * step
        while at < rows - 2 and time[at + 1] <= now:
            at += 1
        row[i], part[i] = at, min((now - time[at]) / max(time[at + 1] - time[at], 1e-300), 1.0)
    tick, rest = np.empty(rows, np.int64), np.empty(rows)
    for j in range(rows):
        tick[j] = min(int((time[j] - time[0]) / step), count - 2)
        rest[j] = (time[j] - time[0]) / step - tick[j]
    y, e = np.empty(count), np.empty(count)
    for c in range(columns):
        for i in range(count):
            low = excitations[c, row[i]]
            y[i] = low + part[i] * (excitations[c, row[i] + 1] - low) - excitations[c, 0]
        for m in range(kinds):
            newer, older = 0.0, 0.0
            for i in range(count):
                e[i] = zeros[m, 0] * y[i] + newer
                newer = zeros[m, 1] * y[i] - poles[1] * e[i] + older
                older = zeros[m, 2] * y[i] - poles[2] * e[i]
            for j in range(rows):
                result[c, m, j] = e[tick[j]] + rest[j] * (e[tick[j] + 1] - e[tick[j]])


def settled_responses(time: Array, excitation: Array, frequency: float, damping: float) -> Array:
    """x - y as in `relative_responses`, (n, 2), at `frequency` (Hz) and `damping` ratio, for an `excitation` (arcmin,
    (n,)) that repeats after these even times, `time` (s, (n,)).

    The same equations for a sine of the circular frequency s: E = s^2/(w^2 - s^2 + 2 i zeta w s) Y, and -2 i zeta w s
    in place of s^2.
    """
    n, w = len(time), TURN * frequency
    s = TURN * np.fft.rfftfreq(n, time[1] - time[0])
    response = np.fft.rfft(excitation) / (w**2 - s**2 + 2j * damping * w * s)
    return np.column_stack([np.fft.irfft(force * response, n) for force in (s**2, -2j * damping * w * s)])
