"""Axial lengths below a section: a line each, the shortest first, with numbers that no line runs through."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from hdopt.geometry.chains import Length
from hdopt.geometry.digits import auxiliary, plain, rounded
from hdopt.geometry.sheet import TEXT, Sheet, text_width

if TYPE_CHECKING:
    from hdopt.geometry.dimensions import Dimension

STACK = 8.0
"""Distance between dimension lines, mm."""


def draw_lengths(
    sheet: Sheet, lengths: Sequence[Length], at: tuple[float, float], scale: float, rows: Iterable[Dimension]
) -> None:
    """Draw the `lengths` on the `sheet` where z = 0 lies at x and below y of `at`, mm, enlarged by `scale`; `rows` are
    the part's lines of the table of limits.

    A longer one's extension lines run past all that are shorter: a number stands where none of them does.
    """
    left, edge = at
    nominal = {row.name: row.nominal for row in rows if row.nominal is not None}
    ends = [(left + scale * length.low, left + scale * length.high) for length in lengths]
    for row, (length, (start, end)) in enumerate(zip(lengths, ends, strict=True)):
        said = plain(nominal.get(length.row, rounded(length.size)))
        text, y = auxiliary(length.size) if length.auxiliary else said, edge + STACK * (row + 1)
        lines = [x for span in ends[row:] for x in span]
        half = text_width(text, TEXT) / 2 + 0.5
        far = (min(lines) - half - 6.0, max(lines) + half + 6.0)
        places = ((start + end) / 2, start - half, end + half, *far)
        middle = next(x for x in places if all(not x - half < line < x + half for line in lines))
        sheet.dimension((start, edge), (end, edge), y, text, False, (middle - start) / (end - start))
        if middle > end:
            sheet.line((end, y), (middle + half, y))
        elif middle < start:
            sheet.line((middle - half, y), (start, y))
