"""To how many digits a dimension stands on a drawing: none that its tolerance makes meaningless.

Theoretically exact dimensions are no matter of this: they keep a tenth of a micrometre.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Protocol

SHARE = 0.05
"""The last digit's unit over the tolerance's width, at most: no size is rounded by more of it."""

FINEST = 4
"""Decimals of mm that no dimension exceeds: a tenth of a micrometre."""

GENERAL = ((3.0, 0.1), (6.0, 0.1), (30.0, 0.2), (120.0, 0.3), (400.0, 0.5), (1000.0, 0.8))
"""Upper end of a range of sizes and permissible deviation of class m, mm; ISO 2768-1:1989, Table 1."""


class Sized(Protocol):
    """A nominal size and its deviations, mm; None where it has none."""

    @property
    def nominal(self) -> float | None: ...

    @property
    def lower(self) -> float | None: ...

    @property
    def upper(self) -> float | None: ...


def general_limits(nominal: float) -> tuple[float, float]:
    """Deviations, mm, that ISO 2768-1, class m, permits a length of `nominal` mm without a tolerance of its own; beyond
    the table, those of its last row."""
    permitted = next((value for limit, value in GENERAL if nominal <= limit), GENERAL[-1][1])
    return -permitted, permitted


def rounded(nominal: float, limits: tuple[float, float] | None = None) -> float:
    """A `nominal` size, mm, to the digits that its `limits` (lower and upper deviation, mm) leave meaningful; without
    limits, those of the general tolerance.

    A least size is rounded up and a largest one down: what goes into each other still does.
    """
    lower, upper = limits or general_limits(nominal)
    decimals = min(max(math.ceil(-math.log10(SHARE * (upper - lower)) - 1e-9), 0), FINEST)
    steps = round(nominal * 10**decimals, 6)
    whole = math.ceil(steps) if lower == 0 else math.floor(steps) if upper == 0 else round(steps)
    size: float = round(whole / 10**decimals, decimals)
    return size


def drawn(value: float, rows: Iterable[Sized]) -> str:
    """How a length or diameter (`value`, mm) stands in a view: as the row of `rows` that has it, else by its general
    tolerance."""
    for row in rows:
        if row.nominal is not None and row.lower is not None and row.upper is not None:
            if row.nominal == rounded(value, (row.lower, row.upper)):
                return plain(row.nominal)
    return plain(rounded(value))


def auxiliary(value: float, symbol: str = "") -> str:
    """How a size (`value`, mm; with a `symbol` before it, as R for a radius) stands on a drawing that follows from
    others: in parentheses, which say that it has no tolerance (ISO 129-1)."""
    return f"({symbol}{plain(rounded(value))})"


def plain(value: float) -> str:
    """A size (`value`, mm) to a tenth of a micrometre at most, without noughts at its end."""
    return f"{value:.{FINEST}f}".rstrip("0").rstrip(".")
