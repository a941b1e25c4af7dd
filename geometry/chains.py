"""The lengths along a part's axis that its drawing states, and which of them stand in parentheses.

Where toleranced lengths close a chain, each has two tolerances: its own, and what those of the others leave it. So one
link of every chain is auxiliary (ISO 129-1): it stands in parentheses and has no tolerance.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from hdopt.geometry.digits import general_limits
from hdopt.geometry.dimensions import BLOCK_HEIGHT, FLANGE_TO_GROOVE, SLOT_DEPTH, WIDTH
from hdopt.geometry.part import Part, Prism
from hdopt.geometry.slide_features import Tongue

SAME = 6
"""Decimals of mm to which two planes are one."""


@dataclass(frozen=True)
class Length:
    """A length along the axis, from z = `low` to `high`, mm; `row` is its name in the table of limits, '' where it has
    none and the general tolerance holds; an `auxiliary` one has no tolerance at all."""

    low: float
    high: float
    row: str = ""
    auxiliary: bool = False

    @property
    def size(self) -> float:
        return self.high - self.low


def axial_lengths(part: Part) -> list[Length]:
    """The lengths along the axis that make a `part`, the shortest first: its pieces, grooves, slot, and the whole; one
    link of every chain is auxiliary."""
    rows: dict[tuple[float, float], str] = {(part.bottom, part.top): ""}
    first, prisms = part.body[0], [piece for piece in part.body if isinstance(piece, Prism)]
    for piece in part.body:
        rows[piece.bottom, piece.top] = BLOCK_HEIGHT if isinstance(piece, Tongue) else ""
        if isinstance(piece, Prism) and piece.groove is not None:
            # Where the ring stands, from the flange: what it holds stands between them.
            rows[first.top, piece.groove.bottom] = FLANGE_TO_GROOVE
    if prisms:
        rows[prisms[0].bottom, prisms[-1].top] = WIDTH
    if part.slot:
        rows[part.bottom, part.bottom + part.slot.depth] = SLOT_DEPTH
    lengths = without_chains(Length(low, high, row) for (low, high), row in rows.items())
    return sorted(lengths, key=lambda length: (length.size, length.low))


def without_chains(lengths: Iterable[Length]) -> list[Length]:
    """The `lengths` in the order of their importance, each auxiliary that closes a chain with those before it.

    First come those with limits of their own, which have a function; then the longest, which is the room that the part
    takes; then the others by their general tolerances, the narrowest first, from the lowest up.
    """
    given = list(lengths)
    whole = max((length.size for length in given), default=0.0)
    given.sort(key=lambda one: (not one.row, one.size < whole, general_limits(one.size)[1], one.low))
    tied: dict[float, float] = {}

    def end(z: float) -> float:
        """The plane that stands for all to which a plane is tied by toleranced lengths."""
        while z in tied:
            z = tied[z]
        return z

    found = []
    for length in given:
        low, high = (end(round(z, SAME)) for z in (length.low, length.high))
        if low != high:
            tied[high] = low
        found.append(replace(length, auxiliary=low == high))
    return found
