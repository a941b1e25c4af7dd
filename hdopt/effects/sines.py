"""Columns of sines and cosines of many orders at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.effects._sine_cosine import sine_cosine
from hdopt.late import late


def sine_columns(phase: Array, harmonics: Sequence[float] | Array) -> Array:
    """sin and cos of each of `harmonics` (k) times `phase` (n,), rad: shape (n, 2 k), each sine before its cosine.
    Every column lies in one piece, as filters and products read it.
    """
    phase, multiples = np.ascontiguousarray(phase, float), np.asarray(harmonics, float)
    run = _run_of(multiples, STEPS * len(multiples))
    if run is None or len(multiples) == 1:
        return _sines(phase, multiples).T
    place = np.full(run[-1] - run[0], -1)
    place[multiples.astype(np.int64) - run[0] - 1] = np.arange(len(multiples))
    once, before = _sines(phase, np.ones(1)), _sines(phase, np.array([float(run[0])]))
    return _multiples(once, before, place, len(multiples)).T


STEPS = 4
"""Whole multiples gone through for each that is wanted up to which the addition theorems are quicker than its sine."""
FEW_STEPS = 16
"""Multiples up to which they are quicker than a sine of each, and than another one to begin with."""
FEWEST_IN_A_RUN = 3
"""Multiples, none of them low, for which it pays to begin with another sine."""
LANES = 32
"""Angles worked on at a time, each in a lane of the processor's vectors: none waits for the others' sums."""
PIECE = 512
"""Angles worked on at a time where columns are written: each of them lies in pages of its own, and all of these at once
in no cache of addresses."""


def _run_of(multiples: Array, most: int) -> range | None:
    """Whole numbers up to the highest of `multiples` (k,), from 0 or from one below the lowest, where all are whole and
    at most so many steps (`most`) lead over them; else None.
    """
    whole = multiples.astype(np.int64)
    if not len(whole) or np.any(whole != multiples) or whole.min() <= 0:
        return None
    before = 0 if whole.min() <= FEW_STEPS or len(whole) < FEWEST_IN_A_RUN else int(whole.min()) - 1
    steps = int(whole.max()) - before
    return range(before, before + steps + 1) if steps <= most else None


@late(calls=0)
def _sines(phase: Array, harmonics: Array) -> Array:
    """The columns of `sine_columns` as rows, (2 k, n)."""
    columns = np.empty((2 * len(harmonics), len(phase)))
    for k in range(len(harmonics)):
        for i in range(len(phase)):
            columns[2 * k, i], columns[2 * k + 1, i] = sine_cosine(harmonics[k] * phase[i])
    return columns


@late(calls=0)
def _multiples(once: Array, before: Array, place: Index, count: int) -> Array:
    """The same for `count` whole multiples, by the sine's and cosine's addition theorems, from those of the angles
    (`once`) and of the multiple `before`, (2, n) each: `place` (h,) says which of them each of the next h is, -1 for
    none.
    """
    rows = once.shape[1]
    columns = np.empty((2 * count, rows))
    s, c = np.empty(PIECE), np.empty(PIECE)
    for start in range(0, rows, PIECE):
        here = min(PIECE, rows - start)
        sine, cosine = once[0, start : start + here], once[1, start : start + here]
        for i in range(here):
            s[i], c[i] = before[0, start + i], before[1, start + i]
        for at in place:
            if at >= 0:
                own, beside = columns[2 * at, start : start + here], columns[2 * at + 1, start : start + here]
                for i in range(here):
                    s[i], c[i] = _one_further(s[i], c[i], sine[i], cosine[i])
                    own[i], beside[i] = s[i], c[i]
            else:
                for i in range(here):
                    s[i], c[i] = _one_further(s[i], c[i], sine[i], cosine[i])
    return columns


@late(calls=0)
def _one_further(s: float, c: float, sine: float, cosine: float) -> tuple[float, float]:
    """Sine and cosine of the next multiple, where `s` and `c` are those of one, `sine` and `cosine` of the angle."""
    return s * cosine + c * sine, c * cosine - s * sine


@late(calls=0)
def _begin(phase: Array, start: int, here: int, before: int, s: Array, c: Array) -> None:
    """Sine and cosine of `before` times the `phase` (n,) of so many rows (`here`) from `start` on, into `s` and `c`."""
    s[:], c[:] = 0.0, 1.0
    if before:
        for i in range(here):
            s[i], c[i] = sine_cosine(before * phase[start + i])


def sine_sum(phase: Array, harmonics: Sequence[float] | Array, coefficients: Array) -> tuple[Array, Array]:
    """The columns of `sine_columns` at `phase` (n,) and `harmonics` (k,) times `coefficients` (2 k,), and the slope of
    their sum over the phase, (n,) each."""
    phase, multiples = np.ascontiguousarray(phase, float), np.asarray(harmonics, float)
    run = _run_of(multiples, max(STEPS * len(multiples), FEW_STEPS))
    if run is None:
        return _sum(phase, multiples, np.ascontiguousarray(coefficients, float))
    by_order = np.zeros((2, len(run) - 1))
    at = multiples.astype(np.int64) - run[0] - 1
    by_order[0, at], by_order[1, at] = coefficients[0::2], coefficients[1::2]
    return _whole_sum(phase, by_order, run[0])


@late(calls=0)
def _sum(phase: Array, harmonics: Array, coefficients: Array) -> tuple[Array, Array]:
    value, slope = np.zeros(len(phase)), np.zeros(len(phase))
    for k in range(len(harmonics)):
        order, a, b = harmonics[k], coefficients[2 * k], coefficients[2 * k + 1]
        for i in range(len(phase)):
            sine, cosine = sine_cosine(order * phase[i])
            value[i] += a * sine + b * cosine
            slope[i] += order * (a * cosine - b * sine)
    return value, slope


@late(calls=0)
def _whole_sum(phase: Array, by_order: Array, before: int) -> tuple[Array, Array]:
    """The same where `by_order` (2, h) holds the coefficients of sine and cosine of the h multiples after `before`."""
    rows = len(phase)
    value, slope = np.empty(rows), np.empty(rows)
    sine, cosine, s, c = np.zeros(LANES), np.zeros(LANES), np.zeros(LANES), np.zeros(LANES)
    total, rise = np.empty(LANES), np.empty(LANES)
    for start in range(0, rows, LANES):
        here = min(LANES, rows - start)
        for i in range(here):
            sine[i], cosine[i] = sine_cosine(phase[start + i])
        _begin(phase, start, here, before, s, c)
        total[:], rise[:] = 0.0, 0.0
        for h in range(by_order.shape[1]):
            a, b, order = by_order[0, h], by_order[1, h], before + 1 + h
            for i in range(LANES):
                now, beside = c[i] * sine[i] + s[i] * cosine[i], c[i] * cosine[i] - s[i] * sine[i]
                s[i], c[i] = now, beside
                total[i] += a * now + b * beside
                rise[i] += order * (a * beside - b * now)
        for i in range(here):  # One by one: of slices, what they may raise takes seconds to compile.
            value[start + i], slope[start + i] = total[i], rise[i]
    return value, slope
