"""Numbers and lists in sentences: how many of what, one and another, and a nought that rounding has moved."""

from __future__ import annotations

import re
from collections.abc import Sequence

ROUNDING = 1e-9
"""Below it a quantity in mm, deg, arcmin, N, MPa or h, or a share, is what rounding has left of nought."""
_MINUS_NOUGHT = re.compile(r"(?<![\w.])-(0(?:\.0*)?)(?![\d.]|e[-+]?\d)")


def counted(number: int | str, one: str, many: str | None = None) -> str:
    """'1 row', '3 rows': `number`, a whole one or the text of any, and what there is of it.

    `one` is the word for a single one, `many` for more (None: `one` with an s): counted(n, "row was", "rows were").
    """
    return f"{number} {one if str(number) == '1' else many or f'{one}s'}"


def listed(words: Sequence[str]) -> str:
    """'a', 'a and b', 'a, b and c'; nothing of no words."""
    if not words:
        return ""
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last


def settled(value: float) -> float:
    """`value`, a quantity in one of hdopt's units; 0 where it is no more than what rounding has left of that."""
    return 0.0 if abs(value) < ROUNDING else value


def without_minus_nought(line: str) -> str:
    """`line` with its numbers that are rounded to nought without their minus: '-0.0000' becomes ' 0.0000'."""
    return _MINUS_NOUGHT.sub(r" \1", line)
