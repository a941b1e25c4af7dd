"""How a table's columns are written for reading: headings, units, and numbers that align on the decimal point."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any  # Any: cells of a table: numbers, text, nothing

if TYPE_CHECKING:
    import pandas as pd

UNITS = {
    "arcmin": "arcmin",
    "arcsec": "arcsec",
    "deg": "deg",
    "rad": "rad",
    "mm": "mm",
    "um": "µm",
    "per_mm": "1/mm",
    "mpa": "MPa",
    "nm": "N m",
    "rpm": "r/min",
    "mm3": "mm³",
    "percent": "%",
    "ppm": "ppm",
    "s": "s",
    "k": "K",
    "hz": "Hz",
    "h": "h",
}
"""The ending that marks a column's unit -> how the unit is written."""

NOT_A_NUMBER = "–"
SIGNIFICANT_DIGITS = 4


@dataclass(frozen=True)
class Column:
    """One column of a table as it is read: heading, unit, 'number' or 'word', and its cells."""

    name: str
    unit: str
    align: str
    cells: tuple[str, ...]

    @property
    def short(self) -> bool:
        """Whether its words are better kept on one line."""
        return max((len(cell) for cell in (self.name, *self.cells)), default=0) <= 22

    @property
    def long(self) -> bool:
        """Whether it holds sentences, which need some width to be read."""
        return max((len(cell) for cell in self.cells), default=0) > 60


NARROW_CHARACTERS = 46
"""What a screen of 390 px shows of a table's line."""
LEAST_OF_WORDS, WORDS_WRAP_AT, SENTENCES_WRAP_AT = 9, 12, 40
"""Characters below which a column of short words, of longer ones, and of sentences is not set narrower."""
MOST_STACKED = 240
"""Cells of a table that is still read one under the other; more are rather scrolled through sideways."""


def stacks(shown: Sequence[Column]) -> bool:
    """Whether a table of the columns `shown` is better read on a narrow screen with its cells one under the other."""
    width = sum(2 + _least_width(column) for column in shown)
    cells = sum(len(column.cells) for column in shown)
    return width > NARROW_CHARACTERS and cells <= MOST_STACKED


def _least_width(column: Column) -> int:
    if column.align == "word" and column.short:
        return max(LEAST_OF_WORDS, *map(len, (column.name, *column.cells)))
    unbroken = max(len(word) for text in (column.name, column.unit, *column.cells) for word in (text.split() or [""]))
    if column.align == "number":
        return unbroken
    return max(unbroken, SENTENCES_WRAP_AT if column.long else WORDS_WRAP_AT)


EACH = "each"
"""Instead of a format spec: four significant digits for each number by itself, where a column mixes quantities."""
ROW = "row"
"""Instead of a format spec: as `EACH`, but a row of such columns to one decimal place, as a value and its interval."""
NAMES = "names"
"""Instead of a format spec: the column holds study keys, which are written in words."""


def columns(frame: pd.DataFrame, formats: Mapping[str, str] | None = None) -> list[Column]:
    """The columns of `frame` as they are read, its index first where that has a meaning; `formats` maps a column's name
    to a format spec such as '.3f', `EACH`, `ROW` or `NAMES`; the others show four significant digits, aligned."""
    if index_has_meaning(frame):
        frame = frame.reset_index()
    formats = formats or {}
    beside = [name for name in frame.columns if formats.get(name) == ROW]
    rows = [_row_writer(row) for row in frame[beside].itertuples(index=False)] if beside else []
    return [
        _column_of_rows(str(name), frame.iloc[:, i].tolist(), rows)
        if name in beside
        else _column(str(name), frame.iloc[:, i].tolist(), formats.get(name))
        for i, name in enumerate(frame.columns)
    ]


def _row_writer(row: Sequence[Any]) -> Callable[[float], str]:
    """How the numbers of one `row` that belong together are written: to one decimal place."""
    largest = max((abs(value) for value in row if _is_number(value)), default=0.0)
    if not 1e-3 <= largest < 10**SIGNIFICANT_DIGITS - 0.5:
        return significant
    decimals = max(0, SIGNIFICANT_DIGITS - 1 - math.floor(math.log10(largest)))
    return lambda value: f"{value:.{decimals}f}"


def _column_of_rows(name: str, values: Sequence[Any], writers: Sequence[Callable[[float], str]]) -> Column:
    title, unit = heading(name)
    cells = tuple(_cell(value, write) for value, write in zip(values, writers, strict=True))
    return Column(title, unit, "number", cells)


def in_words(name: str) -> str:
    """The study key or callout `name` in words: 'wg_tilt_major_deg' reads 'WG tilt major'."""
    for unit in ("mm", "deg", "um", "arcmin"):  # not every unit: a callout may end in _h or _s
        name = name.removesuffix(f"_{unit}")
    words = name.split("_")
    words = [word.upper() if word in ("wg", "cs", "fs") else word for word in words]
    text = " ".join(words)
    return text[:1].upper() + text[1:]


def significant(value: float) -> str:
    """`value` in four significant digits, and a large number written out: '0.6437', '11871'."""
    return f"{value:.{SIGNIFICANT_DIGITS}g}" if abs(value) < 10**SIGNIFICANT_DIGITS - 0.5 else f"{value:.0f}"


def index_has_meaning(frame: pd.DataFrame) -> bool:
    """Whether the index of `frame` belongs to its content: it has a name, or entries other than 0, 1, 2..."""
    import pandas as pd

    return frame.index.name is not None or not isinstance(frame.index, pd.RangeIndex)


def heading(name: str) -> tuple[str, str]:
    """Heading and unit of a column: 'peak_to_peak_arcmin' reads 'peak to peak' with the unit 'arcmin'.

    A name that holds a space or a bracket is taken as it is, 'Peak-to-peak [arcmin]' giving its unit in brackets.
    """
    bracketed = re.fullmatch(r"(.+?)\s*\[([^\]]+)\]", name)
    if bracketed:
        return bracketed.group(1), bracketed.group(2)
    if " " in name:
        return name, ""
    for ending in sorted(UNITS, key=len, reverse=True):
        if name.endswith("_" + ending):
            return name.removesuffix("_" + ending).replace("_", " "), UNITS[ending]
    return name.replace("_", " "), ""


def _column(name: str, values: Sequence[Any], spec: str | None) -> Column:
    title, unit = heading(name)
    numeric = all(_is_number(v) or _is_missing(v) for v in values) and any(_is_number(v) for v in values)
    write = _formatter(spec) if spec else (_aligned(values) if numeric else str)
    cells = tuple(_cell(value, write) for value in values)
    return Column(title, unit, "number" if numeric else "word", cells)


def _cell(value: Any, write: Callable[[Any], str]) -> str:
    if _is_missing(value):
        return NOT_A_NUMBER
    if isinstance(value, bool):
        return "yes" if value else "no"
    if _is_number(value):
        return minus(_without_sign_of_zero(write(value)))
    return in_words(str(value)) if write is in_words else str(value)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _is_missing(value: Any) -> bool:
    return value is None or (isinstance(value, float) and math.isnan(value)) or str(value) in ("<NA>", "NaT")


def minus(text: str) -> str:
    """`text` with a leading hyphen as the minus sign, which is as wide as a digit."""
    return "−" + text[1:] if text.startswith("-") else text


def _without_sign_of_zero(text: str) -> str:
    """'-0.000', what rounding leaves of a small number, as '0.000'."""
    return text[1:] if text[:1] in "+-" and not text.strip("+-0.") else text


def _formatter(spec: str) -> Callable[[Any], str]:
    if spec == EACH:
        return significant
    if spec == NAMES:
        return in_words
    return lambda value: format(value, spec)


def _aligned(values: Sequence[Any]) -> Callable[[Any], str]:
    """One number of decimals for the column, so that its largest value shows four digits; whole numbers stay whole."""
    sizes = [abs(v) for v in values if _is_number(v)]
    if all(float(size).is_integer() for size in sizes):
        return lambda value: f"{value:,.0f}".replace(",", "\u202f") if abs(value) >= 10_000 else f"{value:.0f}"
    largest = max(sizes)
    if largest >= 1e7 or largest < 1e-3:
        return lambda value: f"{value:.{SIGNIFICANT_DIGITS - 1}e}"
    decimals = max(0, SIGNIFICANT_DIGITS - 1 - math.floor(math.log10(largest)))
    return lambda value: f"{value:.{decimals}f}"
