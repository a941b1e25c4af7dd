"""From a file's table to channels in base units on one clock, with a sentence on everything that was understood."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from hdopt.arrays import Array
from hdopt.errors import HdoptError, unknown_name
from hdopt.recordings.clocks import on_one_clock, seconds_of
from hdopt.recordings.columns import Column, with_units
from hdopt.recordings.table import Channel, Table
from hdopt.recordings.units import ANGLE_UNITS, CHANNEL_UNITS, DEGREE, TURN, parse_unit

ARCSEC = DEGREE / 3600
OPTIONAL = ("time", "torque", "temperature")


@dataclass(frozen=True)
class Channels:
    """Channels of one recording: `values` by role in rad, s, Nm, deg C, each (n,); the mapping that made them,
    sentences on what was `understood`, and `warnings` where words and file disagree."""

    values: Mapping[str, Array]
    columns: Mapping[str, Column]
    understood: tuple[str, ...] = field(default=())
    warnings: tuple[str, ...] = field(default=())


def mapped_channels(table: Table, columns: Mapping[str, Column], defaults: bool, name: str) -> Channels:
    """The mapped channels of a table. Columns that are not mapped are never looked at.

    `defaults` says that nobody asked for these columns by name: optional ones that are not there are left out.
    """
    present = dict(columns)
    for channel, column in columns.items():
        if column.name in table.channels:
            continue
        if defaults and channel in OPTIONAL:
            del present[channel]
            continue
        known = list(map(str, table.channels))
        raise HdoptError(
            f"{name}: {unknown_name(f'column for {channel}', column.name, known)}; "
            "name the columns with --columns input=NAME:UNIT,output=NAME:UNIT"
        )
    stated, said, doubts = with_units(present, table, name)
    sources = {channel: table.channels[column.name] for channel, column in stated.items()}
    values: dict[str, Array] = {}
    for channel, column in stated.items():
        values[channel], sentence = _converted(channel, column, sources[channel], name)
        said += sentence
    said.insert(0, "; ".join(_told(channel, column) for channel, column in stated.items()))
    merged, how = on_one_clock(sources, values)
    return Channels(merged, stated, (*table.notes, *said, *how), tuple(doubts))


def _told(channel: str, column: Column) -> str:
    turned = ", turned around" if column.sign < 0 else ""
    return f"{channel} = {column.name!r} in {column.unit}{turned}"


def _converted(channel: str, column: Column, source: Channel, name: str) -> tuple[Array, list[str]]:
    from hdopt.recordings.formats.text import as_numbers

    if channel == "time":
        try:
            dates = seconds_of(np.asarray(source.values), "time")
        except HdoptError as error:
            raise HdoptError(f"{name}: {error}") from error
        if dates is not None:
            return column.sign * dates[0], [dates[1]]
    unit = parse_unit(channel, column.unit)
    raw = as_numbers(source.values)
    if channel == "time" and np.isfinite(raw).any():
        # Seconds since 1970 have too many digits for small steps: count from the first.
        raw = raw - raw[np.isfinite(raw)][0] if abs(raw[np.isfinite(raw)][0]) > 1e7 else raw
    values = column.sign * unit.factor * raw + unit.offset
    if column.calibration:
        return values - _deviation(raw * unit.factor, column), [f"{channel} is corrected by its calibration"]
    return values, []


def _deviation(reading: Array, column: Column) -> Array:
    """The encoder's deviation (rad) at its readings (rad), from the calibration over one turn."""
    angles = np.array([angle for angle, _ in column.calibration]) * DEGREE
    off = np.array([deviation for _, deviation in column.calibration]) * ARCSEC
    return column.sign * np.interp(np.mod(reading, TURN), angles, off, period=TURN)


def sensor_uncertainty_arcmin(columns: Mapping[str, Column], ratio: float) -> float:
    """Standard uncertainty of the encoders at the output, arcmin: what the bench states, input over N and output.

    `columns` by channel; `ratio` is the reduction N.
    """
    at_input = columns["input"].uncertainty_arcsec / ratio if "input" in columns else 0.0
    at_output = columns["output"].uncertainty_arcsec if "output" in columns else 0.0
    return float(np.hypot(at_input, at_output)) / 60


def is_angle(channel: str) -> bool:
    """Whether a channel is an angle."""
    return CHANNEL_UNITS[channel] is ANGLE_UNITS
