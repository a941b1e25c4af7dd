"""Numbers as text with either decimal sign: read where only one reading is possible, called unsure where two are.

`1,5` beside `1.5` can only be a decimal comma, `1,500` beside `1.5` may be one thousand five hundred; a cell with both
signs (`1.234,5`) tells which of them groups thousands.
"""

from __future__ import annotations

import re
from typing import Any  # Any: a pandas column, text and numbers mixed

import numpy as np
from numpy.typing import NDArray

from hdopt.arrays import Mask
from hdopt.errors import shown
from hdopt.recordings.table import Channel

SIGNS = {",": "comma", ".": "point"}


def _kinds() -> re.Pattern[str]:
    """A number as a group named by its decimal sign and by how it shows that: `grouped`, where the other sign groups
    thousands; `count`, where it does so twice, and nothing else is there; `whole`, where the sign itself may group
    thousands; `plain` elsewhere."""
    each = []
    for sign, other in (",.", ".,"):
        s, o, name = re.escape(sign), re.escape(other), SIGNS[sign]
        each += [
            rf"(?P<grouped_{name}>\d{{1,3}}(?:{o}\d{{3}})+{s}\d*)",
            rf"(?P<count_{name}>\d{{1,3}}(?:{o}\d{{3}}){{2,}})",
            rf"(?P<whole_{name}>[1-9]\d{{0,2}}{s}\d{{3}})",
            rf"(?P<plain_{name}>\d+{s}\d*|{s}\d+)",
        ]
    return re.compile(rf"\s*[-+]?(?:{'|'.join(each)})(?:[eE][-+]?\d+)?\s*")


KINDS = _kinds()
NUMBERS = 0.3
"""Share of cells that are numbers above which a column holds numbers, not words or times."""
LOOKED_AT = 1000
"""Cells, evenly spread, that decide it."""


def from_text(column: Any, decimal: str, unit: str) -> Channel:
    """A channel of a `column` of text (n,) in `unit`, NaN where a cell is no number; words and times stay text.

    `decimal` is the sign that most numbers of the file have. What it does not explain is a sentence of the channel; a
    column that can be read in two ways is `unsure`.
    """
    import pandas as pd

    cells = column.astype(object)
    some = cells.iloc[:: max(1, len(cells) // LOOKED_AT)]
    if ((_kind_of(some) != "") | pd.to_numeric(some, errors="coerce").notna()).mean() <= NUMBERS:
        return Channel(cells.to_numpy(object), unit)
    kinds = _kind_of(cells)
    sign, unsure = _sign(cells, kinds, decimal)
    group = "." if sign == "," else ","
    grouped = _groups(kinds, SIGNS[sign])
    ungrouped = (group, "") if grouped.any() else (",", ".")
    plain = [cell.replace(*ungrouped).replace(",", ".") if isinstance(cell, str) else cell for cell in cells]
    numbers = pd.to_numeric(pd.Series(plain, dtype=object), errors="coerce")
    said = []
    odd = np.char.endswith(kinds, SIGNS[group])
    if grouped.any():
        said.append(f"a {SIGNS[group]} groups thousands, {_first(cells, grouped)}")
    elif odd.any():
        count = f"{int(odd.sum())} of {len(cells)} numbers have a decimal {SIGNS[group]}"
        said.append(f"{count}, {_first(cells, odd)}; the others a {SIGNS[sign]}: both are read as decimals")
    elif sign != decimal:
        said.append(f"its numbers have a decimal {SIGNS[sign]}, unlike those of the file's other columns")
    words = numbers.isna().to_numpy() & cells.notna().to_numpy()
    if words.any():
        said.append(f"{int(words.sum())} of {len(cells)} cells hold no number, {_first(cells, words)}")
    return Channel(numbers.to_numpy(float), unit, None, tuple(said), unsure)


def _kind_of(cells: Any) -> NDArray[np.str_]:
    """The name of the group of `KINDS` that each of the `cells` (n,) is, "" for a number without sign and for none."""
    found = (KINDS.fullmatch(cell) if isinstance(cell, str) else None for cell in cells)
    return np.array([match.lastgroup if match else "" for match in found], dtype=np.str_)


def _sign(cells: Any, kinds: NDArray[np.str_], decimal: str) -> tuple[str, str]:
    """The decimal sign of the `cells` of `kinds`, where most of the file's have `decimal`; and why it cannot be told,
    "" where it can."""
    held = {sign: np.char.endswith(kinds, name) & ~_groups(kinds, name) for sign, name in SIGNS.items()}
    grouped = [sign for sign, name in SIGNS.items() if _groups(kinds, name).any()]
    sign = grouped[0] if grouped else max(SIGNS, key=lambda one: (int(held[one].sum()), one == decimal))
    other = "." if sign == "," else ","
    whole = np.char.startswith(kinds, "whole")
    if grouped:
        # Among decimals a group of three alone is no whole number for sure.
        fractions = held[sign].any() or (kinds == f"grouped_{SIGNS[sign]}").any()
        wrong = (held[other] & (~whole | fractions)) | _groups(kinds, SIGNS[other])
        return sign, f"a {SIGNS[other]} groups thousands, but not {_first(cells, wrong)}" if wrong.any() else ""
    if not held[sign].any():
        return decimal, ""
    doubtful = held[other] & whole
    usual = sign
    if not held[other].any() and sign != decimal and whole[held[sign]].all():
        doubtful, usual = whole, decimal
    elif held[other].any() and whole[held[sign]].all():
        doubtful, usual = doubtful | held[sign], other
    if not doubtful.any():
        return sign, ""
    found = _first(cells, doubtful)
    return sign, f"beside numbers with a decimal {SIGNS[usual]} it may be a decimal or a whole number: {found}"


def _groups(kinds: NDArray[np.str_], name: str) -> Mask:
    """Which of the `kinds` (n,) group thousands where the decimal sign is the one of this `name`."""
    return np.asarray((kinds == f"grouped_{name}") | (kinds == f"count_{name}"), np.bool_)


def _first(cells: Any, mask: Mask) -> str:
    """Where the first of the `cells` in `mask` stands, and what it is."""
    row = int(mask.argmax())
    return f"the first {shown(str(cells.iloc[row]))} in row {row + 1} of the numbers"
