"""Recordings of a drive: from a file, or a table in memory, to a checked `Recording`.

A recording holds the input angle and the kinematic error KE = input/N - output (Jia 2021, Eq. (8)), with time, torque
and temperature where they were recorded. The formats are those of `hdopt.recordings.formats`; other layouts are
described by a column mapping such as `input=motor_pos:rad,output=load_pos:-rad` or by a bench file. What is wrong with
a file is found, and repaired or refused, by `hdopt.recordings.checks`.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from hdopt.errors import HdoptError
from hdopt.recordings.bench import Bench
from hdopt.recordings.channels import Channels, mapped_channels, sensor_uncertainty_arcmin
from hdopt.recordings.checks import checked_recording
from hdopt.recordings.columns import Column, choose_columns, default_columns, not_read, parse_columns
from hdopt.recordings.formats import read_table
from hdopt.recordings.recording import TURN, Recording
from hdopt.recordings.table import Channel, Table

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "TURN",
    "Recording",
    "parse_columns",
    "read_channels",
    "read_recording",
    "read_table",
    "recording_from_table",
]


LARGEST_RATIO = 1e5
"""Far beyond any gear: gearheads of several stages end at some ten thousand."""


def read_recording(path: str | Path, ratio: float, columns: str | None = None, bench: Bench | None = None) -> Recording:
    """Read, check and repair one recording; what was repaired is in `.warnings`, what cannot be is a `HdoptError`.

    `columns` says where each channel is (`input=NAME:UNIT,...`), or `bench` does; `columns` goes before. `ratio` is the
    reduction N = input turns a turn of the output.

    `path` of the file, of any format that `hdopt.recordings.formats` lists.
    """
    path = Path(path)
    _check_ratio(ratio)
    return _checked(read_channels(path, columns, bench), ratio, path.name)


def read_channels(path: Path, columns: str | None = None, bench: Bench | None = None) -> Channels:
    """The channels of a file in base units, mapped as told or as the file decides, before any check.

    `path` of the file; `columns` and `bench` as in `read_recording`.
    """
    told = _told(columns, bench)
    table = read_table(path, None if told is None else [column.name for column in told.values()])
    return _channels(table, told, path.name)


def recording_from_table(
    table: pd.DataFrame, ratio: float, columns: str | None = None, name: str = "table"
) -> Recording:
    """A `Recording` from a table in memory, mapped and checked as `read_recording` does for a file.

    `table` has one column a channel; `ratio` N and `columns` as in `read_recording`; `name` stands in messages.
    """
    _check_ratio(ratio)
    raw = Table({str(column): Channel(table[column].to_numpy()) for column in table})
    return _checked(_channels(raw, _told(columns, None), name), ratio, name)


def _told(columns: str | None, bench: Bench | None) -> dict[str, Column] | None:
    """The mapping that somebody gave; None where nobody did."""
    if columns:
        return parse_columns(columns)
    return dict(bench.columns) if bench is not None and bench.columns else None


def _channels(table: Table, told: dict[str, Column] | None, name: str) -> Channels:
    if told is not None:
        channels = mapped_channels(table, told, False, name)
        left = [f"{name}: {sentence}" for sentence in not_read(table, told)]
        return replace(channels, understood=(*channels.understood, *left))
    plain = {"input_angle_deg", "output_angle_deg"} <= set(table.channels)
    chosen, said = default_columns(table) if plain else choose_columns(table, name)
    channels = mapped_channels(table, chosen, True, name)
    return replace(channels, understood=(*said, *channels.understood))


def _checked(channels: Channels, ratio: float, name: str) -> Recording:
    recording = checked_recording(channels.values, ratio, name)
    return replace(
        recording,
        warnings=(*(f"{name}: {doubt}" for doubt in channels.warnings), *recording.warnings),
        understood=(*channels.understood, *recording.understood),
        sensor_arcmin=sensor_uncertainty_arcmin(channels.columns, ratio),
    )


def _check_ratio(ratio: float) -> None:
    if not (math.isfinite(ratio) and 0 < ratio <= LARGEST_RATIO):
        raise HdoptError(
            f"the ratio is {ratio!r}; give a finite number above 0 (--ratio, or a drive that has one), at most "
            f"{LARGEST_RATIO:g}"
        )
