"""Axial lengths below a section: a line each, the shortest first, with numbers that no line runs through."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from hdopt.geometry.digits import Sized, drawn
from hdopt.geometry.part import Part, Prism
from hdopt.geometry.sheet import TEXT, Sheet, text_width

STACK = 8.0
"""Distance between dimension lines, mm."""

Span = tuple[float, float]
"""From one z to another, mm."""


def axial_spans(part: Part) -> list[Span]:
    """The lengths along the axis that make a `part`, the shortest first: its pieces, grooves, slot, and the whole."""
    spans = [(piece.bottom, piece.top) for piece in part.body] if len(part.body) > 1 else []
    for piece in part.body:
        if isinstance(piece, Prism) and piece.groove is not None:
            # Where the ring stands, from the flange: what it holds stands between them.
            spans.append((part.body[0].top, piece.groove.bottom))
    if part.slot:
        spans.append((part.bottom, part.bottom + part.slot.depth))
    spans.append((part.bottom, part.top))
    return sorted(dict.fromkeys(spans), key=lambda span: (span[1] - span[0], span[0]))


def draw_lengths(
    sheet: Sheet, spans: Sequence[Span], at: tuple[float, float], scale: float, rows: Iterable[Sized]
) -> None:
    """Draw `spans` on the `sheet` where z = 0 lies at x and below y of `at`, mm, enlarged by `scale`; `rows` are the
    part's dimensions with limits.

    A longer one's extension lines run past all that are shorter: a number stands where none of them does.
    """
    left, edge = at
    ends = [(left + scale * low, left + scale * high) for low, high in spans]
    for row, ((low, high), (start, end)) in enumerate(zip(spans, ends, strict=True)):
        text, y = drawn(high - low, rows), edge + STACK * (row + 1)
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
