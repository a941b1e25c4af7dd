"""MATLAB files: version 7 and older by scipy, version 7.3 as the HDF5 that it is."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any  # Any: arrays of numbers and of text, as the file's format has them

import numpy as np

from hdopt.errors import HdoptError
from hdopt.recordings.table import Channel, Table, columns_of


def read(path: Path, wanted: Sequence[str] | None) -> Table:
    """Vectors of equal length in a MATLAB file, those of structs as 'struct.field' (or 'field' where there is one), the
    columns of a matrix as 'name[0]' and so on (`columns_of`).

    `path` of the file; `wanted` names the columns that will be used, None for all.
    """
    from scipy.io import loadmat

    try:
        content = loadmat(path, squeeze_me=True, simplify_cells=True)
    except NotImplementedError:
        from hdopt.recordings.formats.hdf5 import read as read_hdf5

        return read_hdf5(path, wanted)
    variables = {key: value for key, value in content.items() if not key.startswith("__")}
    structs = [value for value in variables.values() if isinstance(value, dict)]
    if len(variables) == 1 and structs:
        variables = structs[0]
    vectors = dict(_vectors(variables, ""))
    if not vectors:
        raise HdoptError(f"{path.name} holds no vectors; it needs one vector per channel, all of one length")
    length = max(len(value) for value in vectors.values())
    chosen = {key: Channel(value) for key, value in vectors.items() if len(value) == length or key in (wanted or ())}
    return Table(chosen)


def _vectors(variables: dict[str, Any], prefix: str) -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []
    for key, value in variables.items():
        if isinstance(value, dict):
            found += _vectors(value, f"{prefix}{key}.")
        elif np.asarray(value).dtype.kind in "fiub":
            found += columns_of(prefix + key, np.asarray(value))
    return found
