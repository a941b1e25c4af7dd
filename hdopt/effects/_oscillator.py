"""An inertia on a spring whose foot moves: what its motion has beyond its foot's (`hdopt.effects.resonance`).

With y the motion of the foot, e = x - y obeys e'' + 2 zeta w e' + w^2 e = -y'' where the damper lies across the spring,
and what is added where it acts on the inertia from outside is the answer to -2 zeta w y'.
"""

from __future__ import annotations

import math

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.drive.geometry import ARCMIN
from hdopt.effects.conditions import TURN, Conditions
from hdopt.late import late

FEWEST_ROWS = 8
"""Rows of a piece from which it is integrated."""
SAME_STEP = 1e-9
"""Relative difference below which two steps of the clock are the same: a millionth of a turn after a thousand rows."""


def relative_responses(
    conditions: Conditions, excitations: Array, frequency: float, damping: float, weights: Array
) -> Array:
    """x - y for each of the excitations y (arcmin, (n, k)) along the times of the `conditions`, at each pair of
    `weights` (2, m) of the two dampers; shape (n, k, m).

    Exact for excitations that are straight lines between the rows of each contiguous piece, and still before it, of an
    oscillator at `frequency` (Hz) of `damping` ratio zeta. Zero in pieces of fewer than 8 rows.
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


@late(calls=0)
def _swing(
    time: Array, pieces: Index, excitations: Array, weights: Array, w: float, damping: float, result: Array
) -> None:
    """What the `excitations` (n, k), each at its column of `weights` (2, k), make of an oscillator of circular
    frequency `w` (rad/s) in each of the `pieces` (q, 2) of the rows; into `result` (n, k).
    """
    for start, end in pieces:
        if end - start >= FEWEST_ROWS:
            _between_knots(time[start:end], excitations[start:end], weights, w, damping, result[start:end])


@late(calls=0)
def _between_knots(time: Array, excitations: Array, weights: Array, w: float, damping: float, result: Array) -> None:
    """The swing of one piece into `result` (n, k); arguments as for `_swing`, on the rows of the piece.

    Where y is a straight line, y'' is zero: the oscillator swings freely about the rest that the outer damper gives it
    at this rate, -2 zeta y'/w. Where the rate of y jumps, e' jumps by as much the other way.
    """
    rows, lanes = excitations.shape
    free = w * math.sqrt(1 - damping * damping)
    place, rate, slope = np.zeros(lanes), np.zeros(lanes), np.zeros(lanes)
    known, cos, sin = -1.0, 1.0, 0.0
    result[0] = 0.0
    for i in range(rows - 1):
        step = time[i + 1] - time[i]
        if abs(step - known) > SAME_STEP * known:
            decay = math.exp(-damping * w * step)
            known, cos, sin = step, decay * math.cos(free * step), decay * math.sin(free * step)
        lean, to_rate, to_place = damping * w / free * sin, w * w / free * sin, sin / free
        for c in range(lanes):
            steeper = (excitations[i + 1, c] - excitations[i, c]) / step if step > 0 else slope[c]
            rest = -2 * damping / w * weights[1, c] * steeper
            beyond, now = place[c] - rest, rate[c] - weights[0, c] * (steeper - slope[c])
            place[c] = rest + (cos + lean) * beyond + to_place * now
            rate[c] = (cos - lean) * now - to_rate * beyond
            slope[c] = steeper
            result[i + 1, c] = place[c]


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
