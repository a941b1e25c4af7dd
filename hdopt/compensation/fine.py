"""Sines of one shaft alone that are finer than the splines' waves: an encoder's lines, a coupling, a grid of a scale.

An encoder between its lines repeats with every line of its shaft, hundreds to thousands a turn of the output, eight to
some dozens of the input. Too many to try each as `pursuit` tries its pairs: a spectrum over the shaft's turn shows
those that stand out, and these are tried.
"""

from __future__ import annotations

import math

import numpy as np

from hdopt.arrays import Array

ROWS_PER_WAVE = 2.5
CANDIDATES = 12
OVERSAMPLED = 8
"""Cells of a turn a wave of the highest order: a sample is off the middle of its cell by a sixteenth of one at most."""
SAME_ORDER = 1e-3
LEAST_TURNS = 0.5
"""Output turns below which neighbouring orders of the output are one to a record."""


def fine_pairs(angles: tuple[Array, Array], left: Array, least: tuple[int, int]) -> tuple[list[tuple[int, int]], int]:
    """The orders (k, 0) of the input and (0, j) of the output, above `least` of each, that stand out most in what is
    `left` (n,) arcmin, as far as the rows are fine enough for them; and among how many.

    `angles` are those of input and output, (n,) rad each.
    """
    inputs, outputs = angles
    turns = float(np.abs(np.diff(inputs)).sum()) / (2 * math.pi)
    finest = len(left) / max(turns, 1e-9) / ROWS_PER_WAVE
    ratio = float(np.ptp(inputs)) / max(float(np.ptp(outputs)), 1e-12)
    found = [(score, (k, 0)) for k, score in _standing_out(inputs, left, least[0], int(finest))]
    tried = max(0, int(finest) - least[0])
    if float(np.ptp(outputs)) >= LEAST_TURNS * 2 * math.pi:
        highest = int(finest * ratio)
        lines = _standing_out(outputs, left, least[1], highest)
        # Of a whole ratio every order of the input is one of the output too.
        found += [(score, (0, j)) for j, score in lines if abs(j - round(j / ratio) * ratio) > SAME_ORDER]
        tried += max(0, highest - least[1])
    best = sorted(found, key=lambda one: -one[0])[:CANDIDATES]
    return [pair for _, pair in best], tried


def _standing_out(angle: Array, left: Array, least: int, highest: int) -> list[tuple[int, float]]:
    """The orders of one shaft's `angle` (n,) rad above `least`, up to the `highest`, that stand out most in what is
    `left` (n,), with their power."""
    if highest <= least:
        return []
    cells = 2 ** math.ceil(math.log2(OVERSAMPLED * highest))
    place = np.floor(np.mod(angle / (2 * np.pi), 1.0) * cells).astype(np.int64) % cells
    power = np.abs(np.fft.rfft(np.bincount(place, left, cells))[: highest + 1]) ** 2
    power[: least + 1] = 0.0
    orders = np.argsort(-power, kind="stable")[:CANDIDATES]
    return [(int(order), float(power[order])) for order in orders if power[order] > 0]
