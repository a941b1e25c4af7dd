"""From a file's table to channels in base units on one clock, with a sentence on everything that was understood."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from difflib import SequenceMatcher

import numpy as np

from hdopt.arrays import Array
from hdopt.errors import HdoptError, shown
from hdopt.recordings.clocks import on_one_clock, seconds_of
from hdopt.recordings.columns import Column, with_units
from hdopt.recordings.table import Channel, Table
from hdopt.recordings.units import ANGLE_UNITS, CHANNEL_UNITS, DEGREE, TURN, parse_unit

ARCSEC = DEGREE / 3600
OPTIONAL = ("time", "torque", "temperature")
REACH = {
    "time": (-1e12, 1e12),
    "input": (-1e10, 1e10),
    "output": (-1e10, 1e10),
    "error": (-1e10, 1e10),
    "torque": (-1e7, 1e7),
    "temperature": (-273.15, 1e4),
}
"""What a channel can hold, in s, rad, Nm and deg C: 30,000 years, a billion turns, the torque of no machine, and from
absolute zero to twice what any solid stands."""
REACH_UNITS = {
    "time": "s",
    "torque": "Nm",
    "temperature": "deg C",
    **dict.fromkeys(("input", "output", "error"), "rad"),
}
NEAR = 0.6
"""Likeness (of 1) from which a name may have been meant."""
MOST_LISTED = 12
"""Names of a file that a message lists."""


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
        raise HdoptError(
            f"{name}: unknown column for {channel} {_beside(column.name, [*table.channels, *table.others])}; "
            "name the columns with --columns input=NAME:UNIT,output=NAME:UNIT"
        )
    stated, said, doubts = with_units(present, table, name)
    sources = {channel: table.channels[column.name] for channel, column in stated.items()}
    for channel, source in sources.items():
        if source.unsure:
            raise HdoptError(
                f"{name}: {stated[channel].name!r}: {source.unsure}; write the file with one decimal sign and without "
                "grouped thousands"
            )
        doubts += [f"{stated[channel].name!r}: {sentence}" for sentence in source.said]
    values: dict[str, Array] = {}
    for channel, column in stated.items():
        values[channel], sentence = _converted(channel, column, sources[channel], name)
        said += sentence
        values[channel], doubt = within_reach(channel, values[channel])
        doubts += [f"{column.name!r}: {sentence}" for sentence in doubt]
    said.insert(0, "; ".join(_told(channel, column) for channel, column in stated.items()))
    merged, how = on_one_clock(sources, values)
    return Channels(merged, stated, (*table.notes, *said, *how), (*table.doubts, *doubts))


def _beside(wanted: str, known: Sequence[str]) -> str:
    """The `wanted` name, the nearest of the `known` where one is near, and what the file has, the nearest first."""
    bare = wanted.strip("/").lower()

    def likeness(name: str) -> float:
        end, place = (text.rpartition("/")[2] for text in (bare, name.lower()))
        return max(SequenceMatcher(None, *pair).ratio() for pair in ((bare, name.lower()), (end, place)))

    names = sorted(dict.fromkeys(map(str, known)), key=lambda name: -likeness(name))
    near = f"did you mean {names[0]!r}? " if names and likeness(names[0]) >= NEAR else ""
    more = f" and {len(names) - MOST_LISTED} more" if len(names) > MOST_LISTED else ""
    return f"{shown(wanted)}; {near}the file has {', '.join(names[:MOST_LISTED])}{more}"


def _told(channel: str, column: Column) -> str:
    turned = ", turned around" if column.sign < 0 else ""
    meant = ", taken as input/N - output" if channel == "error" else ""
    return f"{channel} = {column.name!r} in {column.unit}{turned}{meant}"


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


def within_reach(channel: str, values: Array) -> tuple[Array, list[str]]:
    """`values` (n,) of a `channel` (s, rad, Nm or deg C) without those that nothing can be, which are NaN; and what is
    said of them."""
    low, high = REACH[channel]
    with np.errstate(invalid="ignore"):
        beyond = np.isfinite(values) & ((values < low) | (values > high))
    if not beyond.any():
        return values, []
    row = int(beyond.argmax())
    says = (
        f"{int(beyond.sum())} of {len(values)} cells hold what no {channel} can be, the first {values[row]:g} "
        f"{REACH_UNITS[channel]} in row {row + 1} of the numbers"
    )
    return np.where(beyond, np.nan, values), [says]


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
