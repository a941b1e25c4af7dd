"""An inertia on a spring whose foot moves: what its motion has beyond its foot's (`hdopt.effects.resonance`).

With y the motion of the foot, e = x - y obeys e'' + 2 zeta w e' + w^2 e = -y'' where the damper lies across the spring,
and what is added where it acts on the inertia from outside is the answer to -2 zeta w y'.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hdopt.arrays import Array, Index
from hdopt.drive.geometry import ARCMIN
from hdopt.effects.conditions import TURN, Conditions

PER_PERIOD = 40
"""Steps of the even clock in a period of the oscillator, at least: straight lines between 12 would take 2 % off a
wave's height and put as much into damping and gain.
"""
MOST_STEPS = 400_000
FEWEST_ROWS = 8
"""Rows of a piece from which it is integrated."""
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
    kinds = weights.shape[1]
    lanes = np.repeat(excitations, kinds, axis=1)  # every excitation beside itself, once for each pair of weights
    each = np.tile(weights, excitations.shape[1])
    result = np.zeros(lanes.shape)
    _swing(conditions.known_time, conditions.pieces, lanes, each, TURN * frequency, damping, result)
    return result.reshape(len(conditions), excitations.shape[1], kinds)


def changes_of_speed(conditions: Conditions) -> tuple[Array, Array]:
    """The input's part theta/N of the foot's motion along the `conditions`, arcmin, (n,), as it enters the error (with
    a minus), without the steady motion that each contiguous piece begins with; and that motion's rate, arcmin/s, (n,).
    """
    speed, beyond = conditions.starting_motion
    to_error = -1 / (conditions.ratio * ARCMIN)
    return to_error * beyond, to_error * speed


def settled_drag(rate: Array, frequency: float, damping: float) -> Array:
    """What the damper on the output makes of a steady `rate` (arcmin/s, (n,)) of the foot at `frequency` (Hz) and
    `damping` ratio: -2 zeta/w of it, arcmin, (n,), the final value of -2 zeta w s/(s^2 + 2 zeta w s + w^2)/s^2.
    """
    return np.asarray(-2 * damping / (TURN * frequency) * rate)


@njit(cache=True, nogil=True)
def _swing(
    time: Array, pieces: Index, excitations: Array, weights: Array, w: float, damping: float, result: Array
) -> None:
    """What the `excitations` (n, k), each at its column of `weights` (2, k), make of an oscillator of circular
    frequency `w` (rad/s) in each of the `pieces` (q, 2) of the rows; into `result` (n, k).
    """
    for start, end in pieces:
        rows = end - start
        if rows < FEWEST_ROWS:
            continue
        span = time[end - 1] - time[start]
        count = min(max(rows, int(span * PER_PERIOD * (w / TURN)) + 1), MOST_STEPS)
        step = span / (count - 1)
        if w * step > FASTEST:
            continue
        k = w / math.tan(w * step / 2)
        first = k * k + 2 * damping * w * k + w * w
        poles = ((2 * w * w - 2 * k * k) / first, (k * k - 2 * damping * w * k + w * w) / first)
        across, outside = k * k / first, 2 * damping * w * k / first
        zeros = np.empty((3, excitations.shape[1]))
        zeros[0] = -across * weights[0] - outside * weights[1]
        zeros[1] = 2 * across * weights[0]
        zeros[2] = -across * weights[0] + outside * weights[1]
        _filtered(time[start:end], excitations[start:end], zeros, poles, step, count, result[start:end])


@njit(cache=True, nogil=True)
def _filtered(
    time: Array, excitations: Array, zeros: Array, poles: tuple[float, float], step: float, count: int, result: Array
) -> None:
    """Filters of `zeros` (3, k) and the same `poles`, one for each of the `excitations` (n, k), all at once along
    `count` even steps, straight lines between clock and rows; into `result` (n, k).
    """
    rows, lanes = excitations.shape
    newer, older, before, now = np.zeros(lanes), np.zeros(lanes), np.zeros(lanes), np.zeros(lanes)
    at, told = 0, 0
    for i in range(count):
        moment = time[0] + i * step
        while at < rows - 2 and time[at + 1] <= moment:
            at += 1
        part = min((moment - time[at]) / max(time[at + 1] - time[at], 1e-300), 1.0)
        for c in range(lanes):
            low = excitations[at, c]
            y = low + part * (excitations[at + 1, c] - low) - excitations[0, c]
            e = zeros[0, c] * y + newer[c]
            newer[c] = zeros[1, c] * y - poles[0] * e + older[c]
            older[c] = zeros[2, c] * y - poles[1] * e
            before[c], now[c] = now[c], e
        while i > 0 and told < rows and min(int((time[told] - time[0]) / step), count - 2) < i:
            rest = (time[told] - time[0]) / step - (i - 1)
            for c in range(lanes):
                result[told, c] = before[c] + rest * (now[c] - before[c])
            told += 1


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
