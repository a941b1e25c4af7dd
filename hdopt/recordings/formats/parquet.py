"""Parquet tables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hdopt.recordings.table import Channel, Table


def read(path: Path, wanted: Sequence[str] | None) -> Table:
    """The columns of a Parquet file; only the `wanted` ones where they are all there.

    `path` of the file; `wanted` names the columns that will be used, None for all.
    """
    import pandas as pd
    import pyarrow.parquet

    names = pyarrow.parquet.read_schema(path).names
    columns = list(wanted) if wanted and set(wanted) <= set(names) else None
    frame = pd.read_parquet(path, columns=columns)
    return Table({str(name): Channel(frame[name].to_numpy()) for name in frame})
