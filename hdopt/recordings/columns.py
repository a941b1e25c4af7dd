"""Which column of a file is which channel, and in which unit: as told, as the file states it, or as the data decide.

Nothing is guessed silently: each choice is a sentence in what was understood, and what stays open is asked for in one
message with the option to give.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from hdopt.errors import HdoptError, unknown_name
from hdopt.recordings.table import Table
from hdopt.recordings.units import ANGLE_UNITS, CHANNEL_UNITS, parse_unit, stated_unit, unit_in_name

DEFAULT_COLUMNS = {
    "time": ("time_s", "s"),
    "input": ("input_angle_deg", "deg"),
    "output": ("output_angle_deg", "deg"),
    "torque": ("torque_Nm", "Nm"),
    "temperature": ("temperature_C", "C"),
}
"""What a column is called, and in which unit it is, where no mapping says otherwise."""

NAME_PATTERNS = {
    "time": r"time|zeit|t|timestamp|datetime|date|uhrzeit|stamp|clock",
    "input": r"in|input|motor|mot|drive|wg|antrieb|eingang|wave_generator|odrive",
    "output": r"out|output|load|link|abtrieb|ausgang|flange|last",
    "error": r"error|ke|err|fehler|transmission_error|te|deviation|abweichung",
    "torque": r"torque|moment|drehmoment|mt",
    "temperature": r"temp|temperature|temperatur",
}
"""Words of a column's name that point to a channel."""


@dataclass(frozen=True)
class Column:
    """Where a channel is found in a table: column `name`, in `unit`, turned around where `sign` is -1.

    `unit` empty: nobody has stated it yet. `calibration` is (reading deg, deviation arcsec) pairs over one turn of the
    encoder, to be subtracted; `step_deg` and `uncertainty_arcsec` are the sensor's own, at its shaft, 0 where unknown.
    """

    name: str
    unit: str = ""
    sign: float = 1.0
    calibration: tuple[tuple[float, float], ...] = ()
    step_deg: float = 0.0
    uncertainty_arcsec: float = 0.0


def parse_columns(text: str | None) -> dict[str, Column]:
    """`input=NAME:UNIT,output=NAME:UNIT,...` as a mapping; a unit that starts with '-' turns the channel around.

    NAME is a column or a path in the file, in double quotes where it holds a comma; UNIT may be left out where the
    column's name or the file states it. None gives the default layout.

    `text` is the option as written.
    """
    if not text:
        return {channel: Column(name, unit) for channel, (name, unit) in DEFAULT_COLUMNS.items()}
    columns: dict[str, Column] = {}
    for item in re.findall(r'(?:[^,"]|"[^"]*")+', text):
        channel, equals, rest = (part.strip() for part in item.partition("="))
        if not equals or not rest:
            raise HdoptError(
                f"--columns holds {item.strip()!r}; write CHANNEL=NAME:UNIT, for example input=motor_angle:rad"
            )
        if channel not in CHANNEL_UNITS:
            raise HdoptError(unknown_name("channel in --columns", channel, CHANNEL_UNITS))
        if channel in columns:
            raise HdoptError(f"--columns names {channel} twice; name each channel once")
        columns[channel] = _column(channel, rest)
    if ("output" in columns) == ("error" in columns):
        raise HdoptError("--columns must name either output= or error= (where only the error was recorded), not both")
    return columns


def _column(channel: str, text: str) -> Column:
    """NAME or NAME:UNIT; a column's own name may hold a colon: the unit is what follows the last one."""
    if text.startswith('"') and text.endswith('"'):
        return Column(text[1:-1])
    name, colon, unit = text.rpartition(":")
    if not colon:
        return Column(text)
    sign = -1.0 if unit.strip().startswith("-") else 1.0
    unit = unit.strip().lstrip("+-")
    parse_unit(channel, unit)
    return Column(name.strip().strip('"'), unit, sign)


def choose_columns(table: Table, name: str) -> tuple[dict[str, Column], list[str]]:
    """The columns of a table that nobody described: the default layout where it is there, else by the names' words.

    Returns the mapping and a sentence on each choice. Raises `HdoptError` where a name is not plain: the message lists
    the columns and gives the option to use.
    """
    known = list(table.channels)
    layout = {channel: Column(*place) for channel, place in DEFAULT_COLUMNS.items() if place[0] in table.channels}
    if "input" in layout and "output" in layout:
        return layout, []
    found: dict[str, Column] = {}
    unclear: list[str] = []
    for channel, pattern in NAME_PATTERNS.items():
        fits = [column for column in known if _speaks_of(column, pattern)]
        fits = [column for column in fits if channel not in ("input", "output", "error") or _is_angle(table, column)]
        if len(fits) == 1:
            found[channel] = Column(fits[0])
        elif len(fits) > 1 and channel != "temperature":
            unclear.append(f"{channel}: {' or '.join(fits[:4])}")
    if "output" in found and "error" in found:
        del found["error"]
    complete = "input" in found and ("output" in found or "error" in found)
    if not complete or any(entry.split(":")[0] in ("input", "output") for entry in unclear):
        missing = [c for c in ("input", "output") if c not in found]
        wanted = f"not plain: {'; '.join(unclear)}" if unclear else f"no column is plainly {' or '.join(missing)}"
        raise HdoptError(
            f"{name}: {wanted}; the columns are {', '.join(known[:12])}{' ...' if len(known) > 12 else ''}\n"
            "say which is which with --columns input=NAME:UNIT,output=NAME:UNIT,time=NAME:UNIT (or error= for output=)"
        )
    return found, [_by_name(channel, column) for channel, column in found.items()]


def _by_name(channel: str, column: Column) -> str:
    return f"{channel} is taken from {column.name!r} by its name"


def default_columns(table: Table) -> tuple[dict[str, Column], list[str]]:
    """The default layout of a `table` that has its angles, and sentences on what was found beside them: time, torque
    and temperature under other names, where one column's name and unit say them. Without them the recording can be
    read, so that nothing is asked for."""
    layout = parse_columns(None)
    found: dict[str, Column] = {}
    for channel in ("time", "torque", "temperature"):
        if layout[channel].name in table.channels:
            continue
        fits = [column for column in table.channels if _speaks_of(column, NAME_PATTERNS[channel])]
        if len(fits) == 1 and (_unit_stated(channel, fits[0], table) or _runs(channel, table, fits[0])):
            found[channel] = Column(fits[0])
    return layout | found, [_by_name(channel, column) for channel, column in found.items()]


def not_read(table: Table, told: Mapping[str, Column]) -> list[str]:
    """A sentence on each column of a `table` that by its name is the time, torque or temperature, where who `told` the
    columns named none for it: without a clock much cannot be seen."""
    said = []
    for channel in ("time", "torque", "temperature"):
        names = dict.fromkeys((*table.channels, *table.others))
        fits = [name for name in names if _speaks_of(name, NAME_PATTERNS[channel])]
        if channel not in told and len(fits) == 1 and fits[0] not in {column.name for column in told.values()}:
            of = f"by its name it is the {channel}: add {channel}={fits[0]} to --columns"
            said.append(f"{fits[0]!r} is not read, although {of}")
    return said


def _unit_stated(channel: str, column: str, table: Table) -> str:
    """The unit that the file or the column's own name states; empty where neither does."""
    source = table.channels.get(column)
    return (stated_unit(channel, source.unit) if source is not None and source.unit else "") or unit_in_name(
        channel, column
    )


def _runs(channel: str, table: Table, column: str) -> bool:
    """Whether the column is a clock that goes on: the day of a recording is none."""
    values = table.channels[column].values
    return _is_clock(channel, table, column) and len(values) > 0 and bool(values[0] != values[-1])


def _is_clock(channel: str, table: Table, column: str) -> bool:
    """Whether the column holds times of day, whose resolution the file knows."""
    source = table.channels.get(column)
    return channel == "time" and source is not None and source.values.dtype.kind in "mMOUS"


def _speaks_of(column: str, pattern: str) -> bool:
    words = re.split(r"[^a-zA-Z]+", re.sub(r"([a-z])([A-Z])", r"\1 \2", column))
    return any(re.fullmatch(pattern, word.lower()) for word in words if word)


def _is_angle(table: Table, column: str) -> bool:
    """Whether a column may be an angle: not where its name or file states a unit of something else."""
    stated = table.channels[column].unit or _last_word(column)
    other = any(stated_unit(c, stated) for c in ("time", "torque", "temperature"))
    return not other and not re.search(r"vel|speed|rpm|curr|volt|accel|drehzahl|strom", column.lower())


def _last_word(column: str) -> str:
    match = re.search(r"[\[(]([^\])]+)[\])]\s*$", column)
    return match.group(1) if match else re.split(r"[_\s]", column)[-1]


def with_units(
    columns: Mapping[str, Column], table: Table, name: str
) -> tuple[dict[str, Column], list[str], list[str]]:
    """The mapping with every unit stated, sentences on where each came from, and warnings where words disagree.

    A unit that nobody stated is asked for, all at once.

    `columns` by channel; `table` is what they point into; `name` of the file, for messages.
    """
    from dataclasses import replace

    complete: dict[str, Column] = {}
    said: list[str] = []
    doubts: list[str] = []
    open_units: list[str] = []
    for channel, column in columns.items():
        source = table.channels.get(column.name)
        by_file = stated_unit(channel, source.unit) if source is not None and source.unit else ""
        by_name = unit_in_name(channel, column.name)
        stated = by_file or by_name
        is_clock = _is_clock(channel, table, column.name)
        unit = column.unit or stated or ("s" if is_clock else "")
        if not unit:
            open_units.append(f"{channel}={column.name}:UNIT")
        elif column.unit and stated and column.unit.split("/")[0] != stated and not is_clock:
            doubts.append(f"{channel} is read as {column.unit}, although {column.name!r} says {stated}")
        elif not column.unit and not is_clock:
            said.append(f"{channel} is in {unit}, as the {'file' if by_file else 'column name'} says")
        complete[channel] = replace(column, unit=unit)
    if open_units:
        given = ",".join(open_units)
        given = given if re.fullmatch(r"[\w.,:=/-]+", given) else f'"{given}"'  # a shell would cut it at a blank
        choices = "; ".join(_choices(open_units))
        raise HdoptError(
            f"{name}: no unit is stated for {', '.join(entry.split('=')[0] for entry in open_units)}; give it with "
            f"--columns {given} ({choices})"
        )
    return complete, said, doubts


def _choices(entries: list[str]) -> Iterator[str]:
    """The units that may be given for each kind of channel of `entries`, CHANNEL=NAME:UNIT."""
    channels = [entry.split("=")[0] for entry in entries]
    if any(CHANNEL_UNITS[channel] is ANGLE_UNITS for channel in channels):
        yield "angles: deg, rad, arcmin, arcsec, turn, counts/COUNTS_PER_TURN"
    for channel in ("time", "torque", "temperature"):
        if channel in channels:
            yield f"{channel}: {', '.join(CHANNEL_UNITS[channel])}"
