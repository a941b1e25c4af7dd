"""Units of the channels of a recording, and how a file or a person writes them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from hdopt.drive.geometry import ARCMIN
from hdopt.errors import HdoptError, shown, unknown_name

DEGREE = math.pi / 180
TURN = 2 * math.pi

ANGLE_UNITS: dict[str, float] = {
    "rad": 1.0,
    "mrad": 1e-3,
    "urad": 1e-6,
    "deg": DEGREE,
    "arcmin": ARCMIN,
    "arcsec": ARCMIN / 60,
    "rev": TURN,
    "turn": TURN,
    "gon": TURN / 400,
}
TIME_UNITS: dict[str, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}
DATES = ("iso", "iso8601", "date", "datetime", "timestamp", "hms")
"""What people write as the unit of times that are dates or times of day, which have none."""
TORQUE_UNITS: dict[str, float] = {"Nm": 1.0, "Nmm": 1e-3, "Ncm": 1e-2, "kNm": 1e3}
TEMPERATURE_UNITS: dict[str, tuple[float, float]] = {"C": (1.0, 0.0), "K": (1.0, -273.15), "F": (5 / 9, -160 / 9)}

CHANNEL_UNITS: dict[str, Mapping[str, float | tuple[float, float]]] = {
    "time": TIME_UNITS,
    "input": ANGLE_UNITS,
    "output": ANGLE_UNITS,
    "error": ANGLE_UNITS,
    "torque": TORQUE_UNITS,
    "temperature": TEMPERATURE_UNITS,
}
"""Channel -> its units: factor to rad, s or Nm, or factor and offset to deg C."""

WRITTEN_AS = {
    "°": "deg",
    "degree": "deg",
    "degrees": "deg",
    "grad": "deg",
    "radian": "rad",
    "radians": "rad",
    "'": "arcmin",
    "′": "arcmin",
    '"': "arcsec",
    "″": "arcsec",
    "µrad": "urad",
    "μrad": "urad",
    "turns": "turn",
    "revs": "rev",
    "rot": "turn",
    "sec": "s",
    "second": "s",
    "seconds": "s",
    "msec": "ms",
    "millis": "ms",
    "usec": "us",
    "µs": "us",
    "μs": "us",
    "n·m": "Nm",
    "n*m": "Nm",
    "n m": "Nm",
    "nm": "Nm",
    "mnm": "Nmm",
    "°c": "C",
    "degc": "C",
    "celsius": "C",
    "kelvin": "K",
    "arcminute": "arcmin",
    "arcseconds": "arcsec",
}
"""Other ways to write a unit, in lower case, as files and loggers have them."""


@dataclass(frozen=True)
class Unit:
    """A unit of a channel: values x `factor` + `offset` are rad, s, Nm or deg C; `text` is how it is written."""

    text: str
    factor: float
    offset: float = 0.0


def stated_unit(channel: str, text: str) -> str:
    """The unit of `channel` that a file's own words state ('(deg)', '[Nm]', 's'), '' where they state none.

    `channel` is its role, `text` the words.
    """
    word = text.strip().strip("[]()").strip()
    known = CHANNEL_UNITS[channel]
    for candidate in (word, word.lower(), WRITTEN_AS.get(word.lower(), "")):
        if candidate in known:
            return candidate
    return ""


def unit_in_name(channel: str, name: str) -> str:
    """The unit at the end of a column's name ('theta_deg', 'Torque [Nm]', 'angle (rad)'), '' where there is none.

    `channel` is its role, `name` the column.
    """
    match = re.search(r"[\[(]([^\])]+)[\])]\s*$", name)
    if match:
        return stated_unit(channel, match.group(1))
    return stated_unit(channel, re.split(r"[_\s./]", name.strip())[-1]) if re.search(r"[_\s./]", name.strip()) else ""


def parse_unit(channel: str, text: str) -> Unit:
    """A unit as `--columns` takes it: UNIT, or counts/COUNTS_PER_TURN, either with /gearX behind it.

    A gear of X between shaft and encoder means that the encoder turns X times a turn of the shaft. Raises `HdoptError`
    where the unit or a number in it is not known.

    `channel` is its role, `text` the unit without sign.
    """
    word, *parts = text.split("/")
    angle = CHANNEL_UNITS[channel] is ANGLE_UNITS
    factor, offset = 1.0, 0.0
    if word == "counts" and angle:
        if not parts or parts[0].startswith("gear"):
            raise HdoptError(
                f"--columns gives {channel} in counts without counts per turn; write {channel}=NAME:counts/16384"
            )
        factor = TURN / _positive(channel, "counts per turn", parts.pop(0))
    elif word in CHANNEL_UNITS[channel]:
        scale = CHANNEL_UNITS[channel][word]
        factor, offset = scale if isinstance(scale, tuple) else (scale, 0.0)
    else:
        if channel == "time" and re.sub(r"[^a-z0-9]", "", word.lower()) in DATES:
            raise HdoptError(
                f"--columns gives time the unit {shown(word)}; dates and times of day have none: write time=NAME, and "
                "they are recognised (ISO 8601, day.month.year with a time, hh:mm:ss)"
            )
        known = [*CHANNEL_UNITS[channel], *(["counts/COUNTS_PER_TURN"] if angle else [])]
        raise HdoptError(unknown_name(f"unit of {channel} in --columns", word, known))
    for part in parts:
        if not part.startswith("gear") or not angle:
            raise HdoptError(
                f"--columns gives {channel} in {text!r}; behind a unit only /gearX may stand, and for angles only"
            )
        factor /= _positive(channel, "gear", part.removeprefix("gear"))
    return Unit(text, factor, offset)


def _positive(channel: str, what: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0):
        raise HdoptError(f"--columns gives {channel} with {what} {text!r}; give a finite number above 0")
    return value
