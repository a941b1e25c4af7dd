"""HDF5 files, MATLAB 7.3 among them: datasets by their path."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any  # Any: arrays of numbers and of text, as the file's format has them

import numpy as np

from hdopt.errors import HdoptError
from hdopt.recordings.table import Channel, Table

UNIT_ATTRIBUTES = ("unit", "units", "Unit", "Units", "unit_string")


def read(path: Path, wanted: Sequence[str] | None) -> Table:
    """One-dimensional datasets by path ('group/name'), fields of compound ones as 'group/name.field'.

    A dataset's unit is taken from its attribute `unit` or `units`. A column vector, as MATLAB has it, counts as one
    dimension.

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
            if wanted and not {key, f"/{key}"} & set(wanted):
                continue
            values = np.asarray(item[field] if field else item[()])
            if max(values.shape, default=0) == values.size and values.size > 1 and values.dtype.kind in "fiubSO":
                found[f"/{key}" if wanted and f"/{key}" in wanted else key] = Channel(_decoded(values.ravel()), unit)

    with h5py.File(path, "r") as file:
        file.visititems(visit)
        if not found and wanted:
            names: list[str] = []
            file.visit(lambda name: names.append(name) if isinstance(file[name], h5py.Dataset) else None)
            raise HdoptError(
                f"{path.name} has no dataset {', '.join(wanted)}; its datasets are {', '.join(names[:12])}"
            )
    return Table(found)


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)


def _decoded(values: Any) -> Any:
    if values.dtype.kind in "SO":
        return np.array([_text(value) for value in values], dtype=object)
    return values
