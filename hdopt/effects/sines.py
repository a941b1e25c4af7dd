"""Columns of sines and cosines of many orders at once."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.late import late


def sine_columns(phase: Array, harmonics: Sequence[float] | Array) -> Array:
    """sin and cos of each of `harmonics` (k) times `phase` (n,), rad: shape (n, 2 k), each sine before its cosine."""
    phase, multiples = np.ascontiguousarray(phase, float), np.asarray(harmonics, float)
    whole = multiples.astype(np.int64)
    if len(whole) > 1 and np.all(whole == multiples) and 0 < whole.min() and whole.max() <= 4 * len(whole):
        return _whole_sines(phase, whole)
    return _sines(phase, multiples)


@late(calls=0)
def _sines(phase: Array, harmonics: Array) -> Array:
    columns = np.empty((len(phase), 2 * len(harmonics)))
    for i in range(len(phase)):
        for k in range(len(harmonics)):
            columns[i, 2 * k] = math.sin(harmonics[k] * phase[i])
            columns[i, 2 * k + 1] = math.cos(harmonics[k] * phase[i])
    return columns


@late(calls=0)
def _whole_sines(phase: Array, harmonics: Index) -> Array:
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


def sine_sum(phase: Array, harmonics: Sequence[float] | Array, coefficients: Array) -> tuple[Array, Array]:
    """The columns of `sine_columns` at `phase` (n,) and `harmonics` (k,) times `coefficients` (2 k,), and the slope of
    their sum over the phase, (n,) each."""
    phase, multiples = np.ascontiguousarray(phase, float), np.asarray(harmonics, float)
    whole = multiples.astype(np.int64)
    if np.all(whole == multiples) and 0 < whole.min() and whole.max() <= max(4 * len(whole), FEW_STEPS):
        by_order = np.zeros((2, whole.max() + 1))
        by_order[0, whole], by_order[1, whole] = coefficients[0::2], coefficients[1::2]
        return _whole_sum(phase, by_order)
    return _sum(phase, multiples, np.ascontiguousarray(coefficients, float))


FEW_STEPS = 16
"""Multiples up to which the addition theorems are quicker than a sine of each."""


@late(calls=0)
def _sum(phase: Array, harmonics: Array, coefficients: Array) -> tuple[Array, Array]:
    value, slope = np.zeros(len(phase)), np.zeros(len(phase))
    for i in range(len(phase)):
        for k in range(len(harmonics)):
            sine, cosine = math.sin(harmonics[k] * phase[i]), math.cos(harmonics[k] * phase[i])
            a, b = coefficients[2 * k], coefficients[2 * k + 1]
            value[i] += a * sine + b * cosine
            slope[i] += harmonics[k] * (a * cosine - b * sine)
    return value, slope


LANES = 32
"""Angles worked on at a time, each in a lane of the processor's vectors: none waits for the others' sums."""


@late(calls=0)
def _whole_sum(phase: Array, by_order: Array) -> tuple[Array, Array]:
    """The same where `by_order` (2, h + 1) holds the coefficients of sine and cosine of every whole multiple."""
    rows = len(phase)
    value, slope = np.empty(rows), np.empty(rows)
    sine, cosine, s, c = np.zeros(LANES), np.zeros(LANES), np.empty(LANES), np.empty(LANES)
    total, rise = np.empty(LANES), np.empty(LANES)
    for start in range(0, rows, LANES):
        here = min(LANES, rows - start)
        for i in range(here):
            sine[i], cosine[i] = math.sin(phase[start + i]), math.cos(phase[start + i])
        s[:], c[:], total[:], rise[:] = 0.0, 1.0, 0.0, 0.0
        for h in range(1, by_order.shape[1]):
            a, b = by_order[0, h], by_order[1, h]
            for i in range(LANES):
                now, beside = c[i] * sine[i] + s[i] * cosine[i], c[i] * cosine[i] - s[i] * sine[i]
                s[i], c[i] = now, beside
                total[i] += a * now + b * beside
                rise[i] += h * (a * beside - b * now)
        for i in range(here):  # One by one: of slices, what they may raise takes seconds to compile.
            value[start + i], slope[start + i] = total[i], rise[i]
    return value, slope
