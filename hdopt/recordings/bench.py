"""A bench file (`bench.toml`): what holds for all recordings of one bench, said once.

Columns with units, signs, counts a turn, gears, sensor steps and calibration; the ratio; the sign of the torque.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any  # Any: what a study file holds, of TOML's several kinds

from hdopt.errors import HdoptError, unknown_name
from hdopt.files import line_of, line_of_depth
from hdopt.recordings.columns import Column
from hdopt.recordings.units import CHANNEL_UNITS, parse_unit
from hdopt.toml_lines import Keys, closest_line, first_too_deep, key_lines

BENCH_KEYS = ("name", "ratio", "columns")
LARGEST, LONGEST_SHOWN = 1e300, 60
"""Above which a number is a slip of the pen, and characters of a value that a message shows."""
MOST_DIGITS, MOST_LEVELS = 4300, 12
"""Digits of an integer that Python reads, and levels of tables and arrays, of which a bench needs five."""
COLUMN_KEYS = ("column", "unit", "counts_per_turn", "gear", "sign", "step_deg", "uncertainty_arcsec", "calibration")


@dataclass(frozen=True)
class Bench:
    """A bench: its columns by channel, and the `ratio` of its drive where all its recordings share one."""

    name: str = ""
    ratio: float | None = None
    columns: Mapping[str, Column] = field(default_factory=dict)


def load_bench(path: Path) -> Bench:
    """A bench file, checked; raises `HdoptError` with the file, the line and the key where it is not sound.

    `path` is the TOML file.
    """
    text = _text_of(path)
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        said = str(error).replace("end of document", f"line {len(text.splitlines())}, the end of the file")
        raise HdoptError(f"{path.name} cannot be read as TOML: {said[:200]}") from error
    except (ValueError, RecursionError) as error:  # of ValueError: an integer of thousands of digits
        endless = re.search(rf"\d{{{MOST_DIGITS}}}", text)
        line = line_of(text, endless.group()) if endless else line_of_depth(text)
        why = f"an integer of more than {MOST_DIGITS} digits" if endless else "nested too deeply"
        raise HdoptError(f"{path.name}, line {line}: cannot be read as TOML: {why}") from error
    at = _Places(path.name, key_lines(text))
    if deep := first_too_deep(content, MOST_LEVELS):
        raise HdoptError(f"{at(*deep)}: {'.'.join(deep[:3])} is nested more than {MOST_LEVELS} levels deep")
    for key in content:
        if key not in BENCH_KEYS:
            raise HdoptError(f"{at(key)}: {unknown_name('key', key, BENCH_KEYS)}")
    ratio = content.get("ratio")
    if ratio is not None and not _is_positive(ratio):
        raise HdoptError(f"{at('ratio')}: ratio is {_shown(ratio)}; give a finite number above 0")
    columns = content.get("columns", {})
    if not isinstance(columns, dict):
        raise HdoptError(f"{at('columns')}: columns must be tables [columns.input], [columns.output], ...")
    name = content.get("name", "")
    if not isinstance(name, str):
        raise HdoptError(f"{at('name')}: name is {_shown(name)}; give a text in quotes")
    return Bench(
        name,
        None if ratio is None else float(ratio),
        {channel: _column(at, channel, entry) for channel, entry in columns.items()},
    )


def _text_of(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError as error:
        raise HdoptError(f"no file {path}; give a bench file, or make one with hdopt inspect --write-bench") from error
    except (OSError, ValueError) as error:  # of ValueError: not UTF-8
        raise HdoptError(f"{path.name or path} cannot be read as TOML: {str(error)[:200]}") from error


@dataclass(frozen=True)
class _Places:
    """Where the keys of a `file` stand, by its `lines`."""

    file: str
    lines: Mapping[Keys, int]

    def __call__(self, *path: str) -> str:
        return f"{self.file}, line {closest_line(self.lines, path)}"


def _is_positive(value: object) -> bool:
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    return 0 < value <= LARGEST  # an integer of 400 digits is no float


def _shown(value: object) -> str:
    """A value of the file as a message shows it, whatever its length."""
    text = repr(value)
    return text if len(text) <= LONGEST_SHOWN else f"{text[:LONGEST_SHOWN]}..."


def _column(at: _Places, channel: str, entry: Any) -> Column:
    def where(*key: str) -> str:
        return f"{at('columns', channel, *key)}: [columns.{channel}]"

    if channel not in CHANNEL_UNITS:
        raise HdoptError(f"{at('columns', channel)}: {unknown_name('channel', channel, CHANNEL_UNITS)}")
    if not isinstance(entry, dict) or not isinstance(entry.get("column"), str):
        raise HdoptError(f"{where('column')} needs column = the column's name or path in the file")
    for key in entry:
        if key not in COLUMN_KEYS:
            raise HdoptError(f"{where(key)}: {unknown_name('key', key, COLUMN_KEYS)}")
    for key in ("counts_per_turn", "gear"):
        if key in entry and not _is_positive(entry[key]):
            raise HdoptError(f"{where(key)} {key} is {_shown(entry[key])}; give a finite number above 0")
    sign = entry.get("sign", 1)
    if isinstance(sign, bool) or sign not in (1, -1):
        raise HdoptError(f"{where('sign')} sign is {_shown(sign)}; give 1 or -1")
    unit = entry.get("unit", "")
    if not isinstance(unit, str):
        raise HdoptError(f'{where("unit")} unit is {_shown(unit)}; give a text in quotes, such as "deg"')
    if "counts_per_turn" in entry:
        if unit not in ("", "counts"):
            raise HdoptError(
                f"{where('unit')} has unit {unit!r} and counts_per_turn; a column is one of both: take one out"
            )
        unit = f"counts/{entry['counts_per_turn']}"
    if "gear" in entry and entry["gear"] != 1:
        unit += f"/gear{entry['gear']}"
    try:
        if unit:
            parse_unit(channel, unit)
    except HdoptError as error:
        raise HdoptError(f"{where('unit')}: {error}") from error
    return Column(
        entry["column"],
        unit,
        float(sign),
        _calibration(where("calibration"), entry.get("calibration", [])),
        _not_negative(where("step_deg"), "step_deg", entry),
        _not_negative(where("uncertainty_arcsec"), "uncertainty_arcsec", entry),
    )


def _not_negative(where: str, key: str, entry: Mapping[str, Any]) -> float:
    value = entry.get(key, 0.0)
    if value != 0 and not _is_positive(value):
        raise HdoptError(f"{where} {key} is {_shown(value)}; give a finite number, 0 or above")
    return float(value)


def _calibration(where: str, pairs: Any) -> tuple[tuple[float, float], ...]:
    try:
        found = tuple((float(angle), float(off)) for angle, off in pairs)
    except (TypeError, ValueError) as error:
        raise HdoptError(f"{where} calibration must be pairs [reading_deg, deviation_arcsec]") from error
    angles = [angle for angle, _ in found]
    if any(not math.isfinite(a + b) for a, b in found) or angles != sorted(set(angles)):
        raise HdoptError(f"{where} calibration needs finite numbers, its angles rising and each once")
    if found and not (angles[0] >= 0 and angles[-1] < 360):
        raise HdoptError(f"{where} calibration runs from {angles[0]:g} to {angles[-1]:g} deg; keep to 0 to below 360")
    return found


def bench_text(columns: Mapping[str, Column], ratio: float | None, name: str = "") -> str:
    """The text of a bench file that says what `columns` and `ratio` say.

    `name` is what the bench is called.
    """
    import tomlkit

    document = tomlkit.document()
    document.add(tomlkit.comment("A bench, for hdopt --bench: what holds for all of its recordings."))
    if name:
        document["name"] = name
    if ratio is not None:
        document["ratio"] = ratio
    tables = tomlkit.table(is_super_table=True)
    for channel, column in columns.items():
        entry = tomlkit.table()
        entry["column"] = column.name
        word, *parts = column.unit.split("/")
        if word == "counts":
            entry["counts_per_turn"] = float(parts.pop(0))
        elif word:
            entry["unit"] = word
        for part in parts:
            entry["gear"] = float(part.removeprefix("gear"))
        entry["sign"] = int(column.sign)
        if column.step_deg:
            entry["step_deg"] = column.step_deg
        if column.uncertainty_arcsec:
            entry["uncertainty_arcsec"] = column.uncertainty_arcsec
        if column.calibration:
            entry["calibration"] = [list(pair) for pair in column.calibration]
        tables[channel] = entry
    document["columns"] = tables
    return tomlkit.dumps(document)
