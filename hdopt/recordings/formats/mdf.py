"""ASAM MDF files (.mf4, .mdf), by asammdf: an extra of its own, because that library pins and weighs much."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hdopt.recordings.table import Channel, Table


def read(path: Path, wanted: Sequence[str] | None) -> Table:
    """Channels by name, each with its unit and its group's clock; only the `wanted` ones where it is given.

    `path` of the file; `wanted` names the columns that will be used, None for all.
    """
    from asammdf import MDF

    found: dict[str, Channel] = {}
    with MDF(path) as file:
        names = [name for name in file.channels_db if not wanted or name in wanted]
        for name in names:
            group, index = file.channels_db[name][0]
            if index == file.masters_db.get(group):
                continue
            signal = file.get(name, group=group, index=index)
            values = np.asarray(signal.samples)
            if values.ndim == 1 and values.dtype.kind in "fiub":
                found[name] = Channel(values, str(signal.unit or ""), np.asarray(signal.timestamps, float))
    return Table(found)
