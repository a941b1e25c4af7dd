"""How a bench may count and sample what it reads: turned round, scaled, coarse, with rows missing.

A reading changes a recording's columns or its measuring chain, never the drive; nothing of it is physics that a
diagnosis may name.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd

from hdopt.bench.instrument import Instrument

INPUT, OUTPUT = "input_angle_deg", "output_angle_deg"

# Noise of a record of 100 turns at 1000 samples, arcmin: what a good pair of encoders leaves.
CLEAN_ARCMIN = 0.005
MISSING_SHARE = 0.2

Change = Callable[[pd.DataFrame, np.random.Generator], pd.DataFrame]


def times(**factors: float) -> Change:
    """Columns of a table times `factors`, by `input` and `output`, in degrees as they were."""
    names = {"input": INPUT, "output": OUTPUT}

    def change(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
        return table.assign(**{names[key]: table[names[key]] * factor for key, factor in factors.items()})

    return change


def rows_missing(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """`table` without a fifth of its rows, at random by `rng`; the first and the last stay."""
    keep = rng.random(len(table)) >= MISSING_SHARE
    keep[[0, -1]] = True
    return table[keep].reset_index(drop=True)


TABLES: dict[str, Change] = {
    "both angles mirrored": times(input=-1.0, output=-1.0),
    "output mirrored": times(output=-1.0),
    "input mirrored": times(input=-1.0),
    "gain 1.0001": times(output=1.0001),
    "gain 1.0005": times(output=1.0005),
    "ratio off by 0.1 %": times(input=1.001),
    "ratio off by 0.3 %": times(input=0.997),
    "ratio off by 1 %": times(input=1.01),
    "rows missing": rows_missing,
}
"""Reading -> what it does to a recording's table."""

BITS = {"12-bit output": 12, "14-bit output": 14}
READINGS = ("", *TABLES, *BITS, "long and clean")
ORIENTATIONS = ("both angles mirrored", "output mirrored", "input mirrored")
SCALES = tuple(name for name in TABLES if name.startswith(("gain", "ratio")))


def through(reading: str, instrument: Instrument) -> Instrument:
    """The measuring chain `instrument` as `reading` has it."""
    if reading in BITS:
        return replace(instrument, output_step_deg=360 / 2.0 ** BITS[reading])
    if reading == "long and clean":
        fine = replace(instrument, input_step_deg=360 / 2.0**17, output_step_deg=360 / 2.0**22)
        return replace(fine, noise_arcmin=CLEAN_ARCMIN, noise_length=0.0, jitter=0.0, skew=0.0)
    return instrument


def as_read(reading: str, table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """A recording's `table` as `reading` leaves it; what is random comes from `rng`."""
    return TABLES[reading](table, rng) if reading in TABLES else table
