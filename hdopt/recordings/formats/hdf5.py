"""HDF5 files, MATLAB 7.3 among them: datasets by their path."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any  # Any: arrays of numbers and of text, as the file's format has them

import numpy as np

from hdopt.recordings.table import Channel, Table, columns_of

UNIT_ATTRIBUTES = ("unit", "units", "Unit", "Units", "unit_string")


def read(path: Path, wanted: Sequence[str] | None) -> Table:
    """One-dimensional datasets by path ('group/name'), fields of compound ones as 'group/name.field'.

    A dataset's unit is taken from its attribute `unit` or `units`. Those of two dimensions are columns, 'name[0]' and
    so on (`columns_of`).

    `path` of the file; `wanted` names the columns that will be used, None for all.
    """
    import h5py

    found: dict[str, Channel] = {}

    def visit(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or name.startswith("#refs#"):
            return
        unit = next((_text(item.attrs[key]) for key in UNIT_ATTRIBUTES if key in item.attrs), "")
        for field in item.dtype.names or ("",):
            key = f"{name}.{field}" if field else name
            asked = [want for want in wanted or () if want.strip("/").partition("[")[0] == key.partition("[")[0]]
            if wanted and not asked:
                continue
            values = np.asarray(item[field] if field else item[()])
            if values.dtype.kind not in "fiubSO" or values.size < 2:
                continue
            for path_name, column in columns_of(key, values):
                channel = Channel(_decoded(column), unit)
                found[path_name] = channel
                if f"/{path_name}" in asked:
                    found[f"/{path_name}"] = channel

    with h5py.File(path, "r") as file:
        file.visititems(visit)
    return Table(found)


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)


def _decoded(values: Any) -> Any:
    if values.dtype.kind in "SO":
        return np.array([_text(value) for value in values], dtype=object)
    return values
