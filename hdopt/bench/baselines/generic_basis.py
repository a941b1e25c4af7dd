"""A generic basis: Fourier terms at every whole order and beat, and low powers of the conditions. It names nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any  # Any: values of JSON

import numpy as np
import pandas as pd

from hdopt.bench.arrays import Array
from hdopt.bench.baselines.rows import Rows, answer, base_columns, held_out_rms, rows_of, waves

HIGHEST, POWERS = 12, 3
RIDGE = 1e-4
# The held-out error must fall by this share before the model is said to lack something.
GAIN = 0.05


def columns_of(rows: Rows) -> Array:
    """The generic columns over `rows`, beside the base."""
    parts = [waves(rows.theta, range(6, HIGHEST + 1)), waves(rows.theta * (1 + 1 / rows.ratio), range(1, HIGHEST + 1))]
    for condition in (rows.speed, rows.torque, rows.temperature, rows.time, np.sign(rows.speed)):
        span = np.ptp(condition)
        if span > 0:
            place = (condition - condition.min()) / span - 0.5
            parts.append(np.column_stack([place**power for power in range(1, POWERS + 1)]))
    return np.column_stack(parts)


def generic_basis(tables: Sequence[pd.DataFrame], ratio: float) -> dict[str, Any]:
    """Answer to the case of `tables`, of a gear of `ratio`: adequate, or unknown."""
    rows = rows_of(tables, ratio)
    base = base_columns(rows)
    before, after = held_out_rms(rows, base), held_out_rms(rows, np.column_stack([base, columns_of(rows)]))
    return answer("unknown" if after < (1 - GAIN) * before else "adequate", base=before, said=min(before, after))
