"""Recordings of a drive: what a table of angles becomes once its columns are named, converted and checked.

A recording holds the input angle and the kinematic error KE = input/N - output (Jia 2021, Eq. (8)), with time, torque
and temperature where they were recorded. Tables come as .csv, .parquet or .mat; other layouts are described by a column
mapping such as `input=motor_pos:rad,output=load_pos:-rad`. What is wrong with a file is found, and repaired or refused,
by `hdopt.recording_checks`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdopt.drive import ARCMIN
from hdopt.errors import HdoptError, unknown_name

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]

TURN = 2 * math.pi

ANGLE_UNITS = {
    "rad": 1.0,
    "mrad": 1e-3,
    "urad": 1e-6,
    "deg": math.radians(1.0),
    "arcmin": ARCMIN,
    "arcsec": ARCMIN / 60,
    "rev": TURN,
    "turn": TURN,
}
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0}
TORQUE_UNITS = {"Nm": 1.0, "Nmm": 1e-3, "kNm": 1e3}
TEMPERATURE_UNITS = {"C": (1.0, 0.0), "K": (1.0, -273.15), "F": (5 / 9, -160 / 9)}

DEFAULT_COLUMNS = {
    "time": ("time_s", "s"),
    "input": ("input_angle_deg", "deg"),
    "output": ("output_angle_deg", "deg"),
    "torque": ("torque_Nm", "Nm"),
    "temperature": ("temperature_C", "C"),
}
"""What a column is called, and in which unit it is, where no mapping says otherwise."""

CHANNEL_UNITS: dict[str, Mapping[str, object]] = {
    "time": TIME_UNITS,
    "input": ANGLE_UNITS,
    "output": ANGLE_UNITS,
    "error": ANGLE_UNITS,
    "torque": TORQUE_UNITS,
    "temperature": TEMPERATURE_UNITS,
}


@dataclass(frozen=True)
class Recording:
    """One checked recording; all arrays have shape (n,).

    `input_angle` rad, unwrapped; `error_arcmin` KE at the output; `time` s, `torque` Nm at the output, `temperature`
    deg C or None; `segment` counts up at each gap; `input_locked` says that only torque or time moved.
    """

    name: str
    ratio: float
    input_angle: Array
    error_arcmin: Array
    time: Array | None = None
    torque: Array | None = None
    temperature: Array | None = None
    segment: NDArray[np.int64] | None = None
    quantum_arcmin: float = 0.0
    warnings: tuple[str, ...] = field(default=())

    def __len__(self) -> int:
        return len(self.input_angle)

    @property
    def turns(self) -> float:
        """Input turns between the lowest and the highest input angle."""
        return float(np.ptp(self.input_angle)) / TURN

    @property
    def input_locked(self) -> bool:
        """Whether the input hardly moves (a torque sweep against a locked input)."""
        return self.turns < 0.02


@dataclass(frozen=True)
class Column:
    """Where a channel is found in a table: column `name`, in `unit`, turned around where `sign` is -1."""

    name: str
    unit: str
    sign: float = 1.0


def parse_columns(text: str | None) -> dict[str, Column]:
    """`input=NAME:UNIT,output=NAME:UNIT,...` as a mapping; a unit that starts with '-' turns the channel around."""
    if not text:
        return {channel: Column(name, unit) for channel, (name, unit) in DEFAULT_COLUMNS.items()}
    columns = {}
    for item in text.split(","):
        channel, equals, rest = (part.strip() for part in item.partition("="))
        if not equals or not rest:
            raise HdoptError(
                f"--columns holds {item.strip()!r}; write CHANNEL=NAME:UNIT, for example input=motor_angle:rad"
            )
        if channel not in CHANNEL_UNITS:
            raise HdoptError(unknown_name("channel in --columns", channel, CHANNEL_UNITS))
        # A column's own name may hold a colon: the unit is what follows the last one, where that is a unit.
        name, colon, unit = rest.rpartition(":")
        default = DEFAULT_COLUMNS.get(channel, ("", "deg"))[1]
        if not colon:
            name, unit = rest, default
        sign = -1.0 if unit.startswith("-") else 1.0
        unit = unit.lstrip("+-")
        if unit not in CHANNEL_UNITS[channel]:
            raise HdoptError(unknown_name(f"unit of {channel} in --columns", unit, CHANNEL_UNITS[channel]))
        columns[channel] = Column(name.strip(), unit, sign)
    if ("output" in columns) == ("error" in columns):
        raise HdoptError("--columns must name either output= or error= (where only the error was recorded), not both")
    return columns


def read_recording(path: str | Path, ratio: float, columns: str | None = None) -> Recording:
    """Read, check and repair one recording; what was repaired is in `.warnings`, what cannot be is a `HdoptError`."""
    from hdopt.recording_checks import checked_recording

    path = Path(path)
    return recording_from_table(read_table(path), ratio, columns, path.name, checked_recording)


def recording_from_table(
    table: pd.DataFrame, ratio: float, columns: str | None = None, name: str = "table", check=None
):
    """A `Recording` from a table in memory, mapped and checked as `read_recording` does for a file."""
    from hdopt.recording_checks import checked_recording

    if not (math.isfinite(ratio) and ratio > 0):
        raise HdoptError(f"the ratio is {ratio!r}; give a finite number above 0 (--ratio, or a drive that has one)")
    return (check or checked_recording)(mapped_channels(table, parse_columns(columns), columns is None), ratio, name)


def read_table(path: Path) -> pd.DataFrame:
    """The table in a .csv, .parquet or .mat file."""
    readers = {".csv": _read_csv, ".parquet": _read_parquet, ".mat": _read_mat}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise HdoptError(f"{path.name}: recordings are read from {', '.join(readers)}, not from {path.suffix!r}")
    if not path.is_file():
        raise HdoptError(f"no file {path}; give the path of a recording")
    try:
        table = reader(path)
    except HdoptError:
        raise
    except Exception as error:
        raise HdoptError(f"{path.name} cannot be read as {path.suffix}: {str(error).splitlines()[0]}") from error
    if len(table) == 0:
        raise HdoptError(f"{path.name} holds no rows; give a recording with samples in it")
    return table


def _read_csv(path: Path) -> pd.DataFrame:
    import pandas as pd

    table = pd.read_csv(path, comment="#", skipinitialspace=True, low_memory=False)
    return table.rename(columns=lambda column: str(column).strip())


def _read_parquet(path: Path) -> pd.DataFrame:
    import pandas as pd

    return pd.read_parquet(path)


def _read_mat(path: Path) -> pd.DataFrame:
    """Vectors of equal length in a MATLAB file (version 7 or older), or the fields of its one struct."""
    import pandas as pd
    from scipy.io import loadmat

    try:
        content = loadmat(path, squeeze_me=True, simplify_cells=True)
    except NotImplementedError as error:
        raise HdoptError(f"{path.name} is a MATLAB 7.3 (HDF5) file; save it with -v7, or export a .csv") from error
    variables = {key: value for key, value in content.items() if not key.startswith("__")}
    structs = [value for value in variables.values() if isinstance(value, dict)]
    if len(variables) == 1 and structs:
        variables = structs[0]
    vectors = {key: value for key, value in variables.items() if np.ndim(value) == 1}
    if not vectors:
        raise HdoptError(f"{path.name} holds no vectors; it needs one vector per channel, all of one length")
    length = max(len(value) for value in vectors.values())
    return pd.DataFrame({key: value for key, value in vectors.items() if len(value) == length})


def mapped_channels(table: pd.DataFrame, columns: Mapping[str, Column], defaults: bool) -> dict[str, Array]:
    """Channel -> values in rad, s, Nm, deg C. Columns that are not mapped are never looked at."""
    import pandas as pd

    channels = {}
    for channel, column in columns.items():
        if column.name not in table.columns:
            if defaults and channel in ("time", "torque", "temperature"):
                continue
            raise HdoptError(
                f"{unknown_name(f'column for {channel}', column.name, list(map(str, table.columns)))}; "
                "name the columns with --columns input=NAME:UNIT,output=NAME:UNIT"
            )
        values = pd.to_numeric(table[column.name], errors="coerce").to_numpy(float)
        scale = CHANNEL_UNITS[channel][column.unit]
        factor, offset = scale if isinstance(scale, tuple) else (scale, 0.0)
        channels[channel] = column.sign * factor * values + offset
    return channels
