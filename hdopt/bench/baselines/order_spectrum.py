"""Order spectrum by rule: the strongest line above the noise that the drive does not make, looked up in a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any  # Any: values of JSON

import numpy as np
import pandas as pd

from hdopt.bench.baselines.rows import answer, base_columns, base_orders, fitted, held_out_rms, rows_of, waves

HIGHEST = 25.0
# Of the rows a turn; above half of them an order comes back as another.
BELOW_SAMPLING = 0.4
# A line counts from this share of the error on: the change of zones makes smaller ones at every whole order and beat.
OVER_ERROR = 0.1
# Height of a line over the median of the spectrum from which on it counts: a chance of about 1 in 1000 in 3000 lines.
OVER_MEDIAN = 6.0
LINES_LISTED = 6
# The held-out error must fall by this share: orders that the drive makes stand beside every one listed as its own.
GAIN = 0.05


def order_spectrum(tables: Sequence[pd.DataFrame], ratio: float) -> dict[str, Any]:
    """Answer to the case of `tables`, of a gear of `ratio`."""
    rows = rows_of(tables, ratio)
    base = base_columns(rows)
    left = rows.error - base @ fitted(base, rows.error)
    turns = np.ptp(rows.theta) / (2 * np.pi)
    highest = min(HIGHEST, BELOW_SAMPLING * len(rows.error) / len(np.unique(rows.rank)) / turns / rows.passes)
    step = max(0.25 / turns, highest / 4000)
    orders = np.arange(step, highest, step)
    height = np.abs(np.exp(-1j * np.outer(orders, rows.theta)) @ left)
    least = OVER_ERROR * np.std(rows.error) * len(rows.error) / 2
    strong = height > max(OVER_MEDIAN * float(np.median(height)), least)
    width = 1.5 / turns
    before = held_out_rms(rows, base)
    found: list[float] = []
    for at in np.argsort(height)[::-1]:
        apart = all(abs(orders[at] - other) > 2 * width for other in found)
        if not strong[at] or len(found) == LINES_LISTED:
            break
        if apart and min(abs(orders[at] - known) for known in base_orders(ratio)) > width:
            found.append(float(orders[at]))
    if not found:
        return answer("adequate", base=before, said=before)
    after = held_out_rms(rows, np.column_stack([base, waves(rows.theta, found)]))
    if after > (1 - GAIN) * before:
        return answer("adequate", base=before, said=before)
    name = cause(found[0], ratio, width)
    return answer("named" if name else "unknown", [(name, 0.7)] if name else [], before, after)


def cause(order: float, ratio: float, width: float) -> str:
    """Cause of a line at `order`, of a gear of `ratio`, known to `width`; "" where the table has none."""
    whole = round(order)
    if order < width:
        return "thermal_drift"
    if whole >= 6 and abs(order - whole) < width:
        return "circular_spline_lobing"
    if whole >= 6 and abs(order - whole * (1 + 1 / ratio)) < width:
        return "fs_tooth_harmonics"
    if 0.37 < order < 0.62 or 1.05 < order < 1.23 or (order > 6 and abs(order - whole) > width):
        return "bearing_pass"
    return ""
