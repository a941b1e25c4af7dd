"""Steps of a residual at moments of the recording: a few clear ones, each found and taken out before the next.

The mean of some rows is compared with the mean of as many before them, over several lengths. What such a difference
usually is, wander and all, is measured on all rows of the same residual, so that a slow walk makes no steps, and a step
must describe its surroundings better than a slope does (binary segmentation; Fryzlewicz, Ann. Statist. 42, 2014).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.numerical import MAD_TO_SIGMA
from hdopt.diagnosis.settings import DEFAULT, ChangePointSettings


def find_steps(
    residual: Array, settings: ChangePointSettings = DEFAULT.change_points, most: int | None = None
) -> tuple[list[int], Array]:
    """Rows at which a step of `residual` (n,) starts, the clearest first and at most so many (None: as set), and the
    residual without these steps. `settings` are the thresholds.
    """
    most = settings.most if most is None else most
    left = residual - np.median(residual)
    rows: list[int] = []
    while len(rows) < most:
        found = _clearest(left, settings)
        if found is None or found[0] in rows:
            break
        row, height = found
        rows.append(row)
        left[row:] -= height
    return rows, left


def step_columns(length: int, rows: Sequence[float] | Array) -> Array:
    """0 before and 1 from each of `rows` on, (length, k)."""
    return (np.arange(length)[:, None] >= np.asarray(rows)[None, :]).astype(float)


def _clearest(values: Array, settings: ChangePointSettings) -> tuple[int, float] | None:
    """Row and height of the step that is clearest in units of what its difference usually is, or None."""
    n = len(values)
    total = np.r_[0.0, np.cumsum(values)]
    best, found = settings.clear, None
    for length in settings.lengths:
        if n < settings.record_lengths * length:
            break
        middle = np.arange(length, n - length + 1)
        difference = (total[middle + length] - 2 * total[middle] + total[middle - length]) / length
        size = np.abs(difference)
        usual = MAD_TO_SIGMA * np.median(size)
        while usual > 0 and size.max() > best * usual:
            top = int(np.argmax(size))
            start = middle[top] - length
            at, height = _step(values[start : start + 2 * length], settings.margin)
            if height is not None:
                best, found = size[top] / usual, (int(start + at), height)
                break
            size[max(top - length, 0) : top + length] = 0.0
    return found


def _step(values: Array, edge: int) -> tuple[int, float | None]:
    """The best place of one step among `values` (n,), n/`edge` from its ends, and its height; None where a straight
    line leaves less.
    """
    n = len(values)
    total = np.cumsum(values)
    count = np.arange(1, n)
    before, after = total[:-1] / count, (total[-1] - total[:-1]) / (n - count)
    gain = count * before**2 + (n - count) * after**2
    margin = n // edge
    at = margin + int(np.argmax(gain[margin - 1 : n - margin]))
    left_by_step = float(values @ values - gain[at - 1])
    x = np.linspace(-1, 1, n)
    centred = values - values.mean()
    left_by_line = float(centred @ centred - (x @ centred) ** 2 / (x @ x))
    return at, float(after[at - 1] - before[at - 1]) if left_by_step < left_by_line else None
