"""Tables as text, as loggers and people write them.

Separator, decimal sign, encoding, comment lines, a preamble, a row of units beneath the header and a missing header are
told from the first lines; what was told is said in the notes. PHD2 guide logs are text too and go to their own reader.
"""

from __future__ import annotations

import codecs
import csv
import gzip
import io
import itertools
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, cast  # Any: arrays of numbers and of text, as the file's format has them

import numpy as np

from hdopt.errors import HdoptError, shown
from hdopt.recordings.formats.decimals import from_text
from hdopt.recordings.table import Channel, Table
from hdopt.words import counted

if TYPE_CHECKING:
    import pandas as pd

SAMPLE_BYTES = 65_536
BINARY = re.compile(rb"[\x00-\x06\x0e-\x19\x1c-\x1f]")
"""Control characters that no logger writes into a header."""
FIRST_BYTES = 512
"""In which they are looked for: a power cut may leave zeros at the end of a text file."""
COMMENTS = ("#", "%", "//", '"#', "!")
SEPARATORS = (";", "\t", "|", ",", " ")
SEPARATOR_NAMES = {";": "semicolon", "\t": "tab", "|": "bar", ",": "comma", " ": "blanks"}
NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?|[-+]?(nan|inf|infinity)", re.IGNORECASE)
MOST_LINES = 0.8
"""Share of the lines from which they decide how the file is written."""
MISSING = ("", "na", "n/a", "null", "none", "-", "--", "nan")


@dataclass(frozen=True)
class Layout:
    """How a text file is written: `separator`, `decimal` sign, `header` names, `units` beneath them (empty where there
    is no such row), and the number of the first line of numbers."""

    encoding: str
    separator: str
    decimal: str
    header: tuple[str, ...]
    units: tuple[str, ...]
    first_row: int
    comments: int


def read(path: Path, wanted: Sequence[str] | None) -> Table:
    """A text table; only the `wanted` columns where they are all there.

    `path` of the file; `wanted` names the columns that will be used, None for all.
    """
    raw = _open(path)
    encoding = _encoding(raw)
    if (binary := BINARY.search(raw[:FIRST_BYTES])) and not encoding.startswith("utf-16"):
        raise _no_text(path, raw.count(b"\n", 0, binary.start()) + 1, binary.start())
    lines = raw.decode(encoding, errors="replace").splitlines()
    if lines and lines[0].startswith("PHD2 version"):
        from hdopt.recordings.formats.phd2 import read as read_guide_log

        return read_guide_log(path, wanted)
    layout = find_layout(lines if len(raw) < SAMPLE_BYTES else lines[:-1], encoding, path.name)
    names = list(layout.header)
    use = list(wanted) if wanted and set(wanted) <= set(names) else None
    try:
        frame, left_out = _frame(path, layout, use)
    except UnicodeDecodeError as error:
        raise _no_text(path, *_undecodable(path, encoding)) from error
    units = dict(zip(names, layout.units, strict=False))
    channels: dict[str, Channel] = {}
    for name in [str(column) for column in frame]:
        channels[name] = _channel(frame.pop(name), layout, units.get(name, ""))
    others = tuple(name for name in names if name not in channels)
    return Table(channels, _notes(layout), others, left_out)


def _no_text(path: Path, line: int, byte: int) -> HdoptError:
    """The refusal of a file whose `byte` (from 0), in this `line` (from 1), is no character."""
    return HdoptError(
        f"{path.name} is not a text file: line {line}, byte {byte} is no character; give a recording as text (UTF-8), "
        "or with the ending of its own format"
    )


def _undecodable(path: Path, encoding: str) -> tuple[int, int]:
    """The line (from 1) and the byte (from 0) of a file at which its `encoding` ends; the last ones where a line feed
    is no character of its own (UTF-16)."""
    line = begin = 0
    with _unpacked(path) as stream:
        for line, raw in enumerate(stream, start=1):
            try:
                raw.decode(encoding.removesuffix("-sig"))
            except UnicodeDecodeError as error:
                return line, begin + error.start
            begin += len(raw)
    return line, begin


def _frame(path: Path, layout: Layout, use: list[str] | None) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """The columns `use` of the file (all for None), and a sentence on the lines that have too many fields.

    Raises `HdoptError` where all lines have: what the header does not name would be dropped unseen.
    """
    import pandas as pd

    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", pd.errors.ParserWarning)
        frame = pd.read_csv(
            path,
            sep=r"\s+" if layout.separator == " " else layout.separator,
            decimal=layout.decimal,
            encoding=layout.encoding,
            compression="gzip" if path.suffix.lower() == ".gz" else None,
            header=None,
            names=list(layout.header),
            index_col=False,
            usecols=use,
            skiprows=layout.first_row,
            comment="#",
            skipinitialspace=True,
            low_memory=False,
            on_bad_lines="warn",
            na_values=["-", "--"],
        )
    said = [str(one.message) for one in told if issubclass(one.category, pd.errors.ParserWarning)]
    if any("Length of header" in text for text in said):
        raise HdoptError(
            f"{path.name}: its rows have more fields than the {len(layout.header)} that its header names; name them "
            "all, or see whether a decimal comma stands where the comma separates"
        )
    numbers = [int(number) for text in said for number in re.findall(r"Skipping line (\d+)", text)]
    return frame, (_left_out(path, layout, numbers),) if numbers else ()


def _left_out(path: Path, layout: Layout, numbers: Sequence[int]) -> str:
    """A sentence on the lines of these `numbers`, from 1, that have too many fields, with the first of them."""
    with _unpacked(path) as stream, io.TextIOWrapper(stream, layout.encoding, "replace") as lines:
        first = next(itertools.islice(lines, numbers[0] - 1, None), "").strip()
    many = f"{counted(len(numbers), 'line')} with more fields than the header names left out"
    hint = "; does a decimal comma stand in it?" if layout.separator == "," else ""
    return f"{many}, the first {shown(first)} in line {numbers[0]}{hint}"


def _notes(layout: Layout) -> tuple[str, ...]:
    separator = SEPARATOR_NAMES[layout.separator]
    text = f"text in {layout.encoding.removesuffix('-sig')}, separated by {separator}"
    if layout.decimal == ",":
        text += ", with decimal commas"
    if layout.units:
        text += ", units in a row of their own"
    if layout.comments:
        text += f", {counted(layout.comments, 'line')} of comment or preamble left out"
    known = set(layout.header)
    repeated = [name for name in layout.header if f"{name}.1" in known]
    if not repeated:
        return (text,)
    return (
        text,
        f"the header has {repeated[0]!r} more than once: the first is meant, the second is {repeated[0] + '.1'!r}",
    )


def _channel(column: Any, layout: Layout, unit: str) -> Channel:
    """A column as numbers where it can be; text stays text (times, words)."""
    if column.dtype.kind in "fiub":
        return Channel(column.to_numpy(), unit)
    return from_text(column, layout.decimal, unit)


def _open(path: Path) -> bytes:
    """The first bytes of a file, unpacked."""
    with _unpacked(path) as stream:
        return stream.read(SAMPLE_BYTES)


def _unpacked(path: Path) -> IO[bytes]:
    return cast(IO[bytes], gzip.open(path, "rb")) if path.suffix.lower() == ".gz" else path.open("rb")


def _encoding(raw: bytes) -> str:
    for mark, name in (
        (codecs.BOM_UTF8, "utf-8-sig"),
        (codecs.BOM_UTF16_LE, "utf-16"),
        (codecs.BOM_UTF16_BE, "utf-16"),
    ):
        if raw.startswith(mark):
            return name
    if len(raw) > 3 and raw[0] and raw[1:4:2] == b"\0\0":
        return "utf-16-le"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(raw)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"


def split(line: str, separator: str) -> list[str]:
    """The cells of one line.

    `line` is cut at `separator`.
    """
    if separator == " ":
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])]


def find_layout(lines: Sequence[str], encoding: str, name: str) -> Layout:
    """How the lines of a text file are written; raises `HdoptError` where no table is found in them.

    `lines` decoded from `encoding`; `name` of the file, for messages.
    """
    numbered = [(i, line) for i, line in enumerate(lines) if line.strip() and not line.lstrip().startswith(COMMENTS)]
    if not numbered:
        raise HdoptError(f"{name} holds no rows; give a recording with samples in it")
    body = [line for _, line in numbered]
    separator = _separator(body)
    cells = _without_end_separators([split(line, separator) for line in body])
    widths = [len(row) for row in cells]
    tail = widths[len(widths) // 2 :]
    width = max(set(tail), key=tail.count)
    table = [k for k in range(len(cells)) if widths[k] == width or (separator != " " and widths[k] == width + 1)]
    start = next((k for k in table if _is_data(cells[k])), None)
    if start is None:
        if not table:
            raise HdoptError(f"{name} holds no table; give a file with one row a sample")
        start = table[-1] + 1 if len(table) < 3 else table[1]
    head = [k for k in table if k < start]
    units: tuple[str, ...] = ()
    if len(head) >= 2 and _is_units(cells[head[-1]]):
        units = tuple(cell.strip("[]()") for cell in cells[head[-1]])
        head = head[:-1]
    header = cells[head[-1]] if head else [str(k + 1) for k in range(width)]
    rows = [row for row in cells[start : start + 200] if len(row) == width]
    return Layout(
        encoding=encoding,
        separator=separator,
        decimal=_decimal(rows, separator),
        header=_unique([cell.strip().strip('"') for cell in header]),
        units=units,
        first_row=numbered[start][0] if start < len(numbered) else len(lines),
        comments=(numbered[start][0] if start < len(numbered) else len(lines)) - bool(head) - bool(units),
    )


def _without_end_separators(cells: list[list[str]]) -> list[list[str]]:
    """The rows without the empty cell that a separator at the end of most lines makes."""
    ended = [len(row) > 1 and not row[-1] for row in cells[len(cells) // 2 :]]
    if sum(ended) < MOST_LINES * len(ended):
        return cells
    return [row[:-1] if len(row) > 1 and not row[-1] else row for row in cells]


def _separator(body: Sequence[str]) -> str:
    """The first separator that cuts most lines into the same number of cells, two at least."""
    sample = list(body[-200:]) if len(body) > 3 else list(body)
    for separator in SEPARATORS:
        widths = [len(split(line, separator)) for line in sample]
        usual = max(set(widths), key=widths.count)
        if usual >= 2 and widths.count(usual) >= MOST_LINES * len(widths):
            return separator
    return ","


def _is_number(cell: str) -> bool:
    return bool(NUMBER.fullmatch(cell.strip().strip('"')))


def _is_data(row: Sequence[str]) -> bool:
    """Whether a row holds samples: numbers, missing values and times, and at least one number."""
    numbers = sum(_is_number(cell) for cell in row)
    blank = sum(cell.strip().lower() in MISSING for cell in row)
    times = sum(bool(re.match(r"\d{1,4}[-:./]\d", cell.strip())) and not _is_number(cell) for cell in row)
    return numbers > 0 and numbers + blank + times >= 0.5 * len(row)


def _is_units(row: Sequence[str]) -> bool:
    from hdopt.recordings.units import CHANNEL_UNITS, stated_unit

    return sum(any(stated_unit(channel, cell) for channel in CHANNEL_UNITS) for cell in row) >= 0.5 * len(row)


def _decimal(rows: Sequence[Sequence[str]], separator: str) -> str:
    if separator == ",":
        quoted = any(re.fullmatch(r"[-+]?\d+,\d+", cell) for row in rows for cell in row)
        return "," if quoted else "."
    with_comma = sum(bool(re.fullmatch(r"[-+]?\d*,\d+([eE][-+]?\d+)?", cell)) for row in rows for cell in row)
    with_point = sum(bool(re.fullmatch(r"[-+]?\d*\.\d+([eE][-+]?\d+)?", cell)) for row in rows for cell in row)
    return "," if with_comma > with_point else "."


def _unique(names: Sequence[str]) -> tuple[str, ...]:
    """Column names, a second one of a name numbered, an empty one named by its place."""
    seen: dict[str, int] = {}
    found = []
    for place, given in enumerate(names, start=1):
        name = given or str(place)
        seen[name] = seen.get(name, 0) + 1
        found.append(name if seen[name] == 1 else f"{name}.{seen[name] - 1}")
    return tuple(found)


def as_numbers(values: Any) -> Any:
    """Values as float64 (n,), NaN where a cell is no number.

    `values` (n,) of any type.
    """
    import pandas as pd

    if getattr(values, "dtype", np.dtype(object)).kind in "fiub":
        return np.asarray(values, float)
    return pd.to_numeric(pd.Series(values), errors="coerce").to_numpy(float)
