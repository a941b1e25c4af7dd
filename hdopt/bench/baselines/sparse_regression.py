"""Sparse regression on a stated library: sequentially thresholded least squares (Brunton, Proctor, Kutz, PNAS 2016).

The library has the linear columns of every effect of the catalogue that has any; an effect is named where a column of
its own stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any  # Any: values of JSON

import numpy as np
import pandas as pd

from hdopt.bench.arrays import Array
from hdopt.bench.baselines.rows import Rows, answer, base_columns, fitted, held_out_rms, rows_of, waves

# Coefficients below this share of the base's residual are set to zero, as often as it takes.
THRESHOLD, ROUNDS = 0.3, 10
# A term must lower the held-out error by this share.
GAIN = 0.03


def library(rows: Rows) -> dict[str, Array]:
    """Effect -> its columns over `rows`, of unit rms."""
    output, way = rows.theta / rows.ratio, np.sign(rows.speed)
    part = rows.time / max(rows.time.max(), 1e-12)
    found = {
        "cs_tooth_harmonics": waves(rows.theta, range(6, 10)),
        "fs_tooth_harmonics": waves(rows.theta * (1 + 1 / rows.ratio), range(3, 10)),
        "circular_spline_lobing": waves(rows.theta, (10, 11, 12)),
        "encoder_output_eccentricity": waves(output, (1,)),
        "output_coupling": waves(output, (2,)),
        "thermal_drift": np.column_stack([1 - np.exp(-part / tau) for tau in (0.1, 0.3, 1.0)]),
    }
    if np.ptp(rows.temperature) > 0:
        found["thermal_drift"] = rows.temperature[:, None]
    if np.ptp(rows.torque) > 0:
        found["torsional_windup"] = np.column_stack([rows.torque, rows.torque**3])
    if np.ptp(way) > 1:
        found["lost_motion"] = way[:, None]
    if np.ptp(np.abs(rows.speed)) > 0.3 * np.abs(rows.speed).max():
        found["channel_delay"] = rows.speed[:, None]
    centred = {name: columns - columns.mean(0) for name, columns in found.items()}
    return {name: columns / np.maximum(columns.std(0), 1e-12) for name, columns in centred.items()}


def sparse_regression(tables: Sequence[pd.DataFrame], ratio: float) -> dict[str, Any]:
    """Answer to the case of `tables`, of a gear of `ratio`."""
    rows = rows_of(tables, ratio)
    base, terms = base_columns(rows), library(rows)
    names = [name for name, columns in terms.items() for _ in range(columns.shape[1])]
    columns = np.column_stack(list(terms.values()))
    limit = THRESHOLD * float(np.std(rows.error - base @ fitted(base, rows.error)))
    kept = np.ones(len(names), bool)
    for _ in range(ROUNDS):
        size = fitted(np.column_stack([base, columns[:, kept]]), rows.error)[base.shape[1] :]
        stays = np.abs(size) > limit
        kept[np.flatnonzero(kept)[~stays]] = False
        if stays.all() or not kept.any():
            break
    before = held_out_rms(rows, base)
    after = held_out_rms(rows, np.column_stack([base, columns[:, kept]]))
    if not kept.any() or after > (1 - GAIN) * before:
        return answer("adequate", base=before, said=before)
    found = sorted({name for name, keep in zip(names, kept, strict=True) if keep})
    return answer("named", [(name, 0.7) for name in found], before, after)
