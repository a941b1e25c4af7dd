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
