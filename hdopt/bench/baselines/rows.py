"""Rows that all baselines see: the error of every recording over its conditions, and the base of known orders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any  # Any: values of JSON

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from hdopt.bench.arrays import Array

MOST_ROWS = 6000
TURN = 2 * np.pi
# Orders m + n/N that the zones of a drive with twelve errors make (Jia 2021): m up to 5, n up to 2.
BASE_WHOLE, BASE_BEAT = 5, 2
# Every third block of turns is held out.
FOLDS = 3


@dataclass(frozen=True)
class Rows:
    """Values row by row: error (arcmin), angles (rad), speed (rad/s of the input), torque (Nm), temperature (K), time.

    `rank` says which recording a row is of; `ratio` is the gear's. Torque and temperature are zero where not recorded.
    """

    error: Array
    theta: Array
    speed: Array
    torque: Array
    temperature: Array
    time: Array
    rank: NDArray[np.int64]
    ratio: float

    @property
    def held_out(self) -> NDArray[np.bool_]:
        """Whole input turns, every third one."""
        found: NDArray[np.bool_] = np.floor(self.theta / TURN).astype(int) % FOLDS == 0
        return found

    @property
    def passes(self) -> float:
        """How often the range of the input angle was passed, on average over the recordings."""
        travelled = sum(np.abs(np.diff(self.theta[self.rank == rank])).sum() for rank in np.unique(self.rank))
        return float(travelled / np.ptp(self.theta) / len(np.unique(self.rank)))

    @property
    def means(self) -> Array:
        """A column of ones for each recording."""
        result: Array = (self.rank[:, None] == np.unique(self.rank)).astype(float)
        return result


def rows_of(tables: Sequence[pd.DataFrame], ratio: float) -> Rows:
    """Rows of `tables`, evenly thinned to `MOST_ROWS`, of a gear of `ratio`."""
    total = sum(len(table) for table in tables)
    parts: list[dict[str, Array]] = []
    for rank, table in enumerate(tables):
        table = table.dropna(subset=["time_s", "input_angle_deg", "output_angle_deg"])
        time = table["time_s"].to_numpy(float)
        angle = np.deg2rad(table["input_angle_deg"].to_numpy(float))
        error = 60 * np.rad2deg(angle / ratio - np.deg2rad(table["output_angle_deg"].to_numpy(float)))
        zero = np.zeros(len(table))
        values = {
            "error": error - error.mean(),
            "theta": angle,
            "speed": np.gradient(angle, time),
            "torque": table.get("torque_Nm", pd.Series(zero)).to_numpy(float),
            "temperature": table.get("temperature_C", pd.Series(zero)).to_numpy(float),
            "time": time - time[0],
            "rank": zero + rank,
        }
        parts.append({name: value[:: max(1, -(-total // MOST_ROWS))] for name, value in values.items()})
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return Rows(**{**joined, "rank": joined["rank"].astype(np.int64)}, ratio=ratio)


def waves(angle: Array, orders: Sequence[float]) -> Array:
    """Cosine and sine columns of `orders` over `angle` (rad)."""
    return np.column_stack([f(k * angle) for k in orders for f in (np.cos, np.sin)])


def base_orders(ratio: float) -> list[float]:
    """Orders that the drive itself makes, of a gear of `ratio`."""
    beats = range(-BASE_BEAT, BASE_BEAT + 1)
    return [m + n / ratio for m in range(BASE_WHOLE + 1) for n in beats if m + n / ratio > 0]


def base_columns(rows: Rows) -> Array:
    """The base of `rows`: a mean for each recording, and the drive's own orders."""
    return np.column_stack([rows.means, waves(rows.theta, base_orders(rows.ratio))])


def fitted(columns: Array, values: Array, ridge: float = 1e-6) -> Array:
    """Coefficients of `columns` for `values`, least squares with a small `ridge` (of the mean square of a column)."""
    square: Array = columns.T @ columns
    square += float(ridge * np.trace(square) / len(square)) * np.eye(len(square))
    return np.asarray(np.linalg.solve(square, columns.T @ values), np.float64)


def held_out_rms(rows: Rows, columns: Array) -> float:
    """Error (arcmin rms) on turns of `rows` that a fit of `columns` to the others never saw."""
    out = rows.held_out
    if out.all() or not out.any():
        return float(np.std(rows.error))
    left = rows.error[out] - columns[out] @ fitted(columns[~out], rows.error[~out])
    return float(np.sqrt(np.mean(left**2)))


def answer(
    verdict: str, effects: Sequence[tuple[str, float]] = (), base: float = 0.0, said: float = 0.0
) -> dict[str, Any]:
    """An answer by the contract: `verdict`, `effects` with confidences, held-out errors of the `base` and as `said`."""
    return {
        "schema": 1,
        "verdict": verdict,
        "effects": [{"id": name, "confidence": confidence, "parameters": {}} for name, confidence in effects],
        "ambiguous_with": [],
        "fit": {"heldout_rms_base_arcmin": base, "heldout_rms_extended_arcmin": said},
    }
