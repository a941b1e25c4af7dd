"""What stands on the FS, met turn by turn: laid out so that lanes along the turns read it in a row.

From input turn to input turn a zone meets the FS farther on by Z_CS/Z_FS - 1 of a turn of it: after all turns it has
been at as many even places. The table's places are as many rows as lie between two of these, each in the turns' order.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hdopt.arrays import Array, Index, Singles
from hdopt.kinematics.lanes.minima import GROUP
from hdopt.kinematics.lanes.single import single, singles
from hdopt.simulation.turn.effects import WIDER, derived, largest

FEWEST_ROWS, MOST_ROWS = 16, 128
LEFT_BY_ROW = 1e-3
"""What half the way to the next row may leave out, of the range of what stands on the FS."""
WINDOWS = 128
"""Stretches of the FS on which the most of effects and FS teeth together is looked for."""


class OnFs(NamedTuple):
    """What stands on the FS, mm of arc, in so many `rows`, or in none. `table`, flat: rows of `length` of either zone,
    or, where cells have parts, of the least of a cell that begins there and then of the greatest; `starts` (turns,),
    where in a row the turn is that stands at each of its places. `lowest` and `highest` of all; how far a cell goes
    beyond the chord of what it meets, `left`, and a part of it, `beyond`. `cos` and `sin` of the windows' edges and the
    greatest in each window, of zone 1, then of zone 2, `most`; how far the FS teeth's unit sine goes beyond its chord
    in a window, `sag`."""

    rows: int
    table: Singles
    length: int
    starts: Index
    lowest: float
    highest: float
    left: float
    beyond: float
    cos: Singles
    sin: Singles
    most: Singles
    sag: float


def on_fs_of(spectrum: Array | None, size: tuple[int, int, int], advance: float) -> OnFs:
    """The table of a `spectrum` (2, orders), of nothing where it is None, for so many turns, cells, and parts of each
    (`size`); `advance` is Z_CS/Z_FS."""
    turns, cells, each = size
    if spectrum is None:
        nothing, none = singles(np.zeros(0)), single(0.0)
        return OnFs(0, nothing, 0, np.zeros(0, np.int64), none, none, none, none, nothing, nothing, nothing, none)
    step = round((advance - 1) * turns) % turns
    after = pow(step, -1, turns)
    slope, bow = largest(spectrum, 1), largest(spectrum, 2)
    rows = math.ceil(math.pi * slope / (turns * LEFT_BY_ROW * max(np.ptp(derived(spectrum, 0, 8 * turns)), 1e-12)))
    rows = max(FEWEST_ROWS, min(rows, MOST_ROWS))
    places, width = rows * turns, WIDER * advance * 2 * math.pi / cells
    place = 2 * math.pi / places
    if each > 1:
        length = math.ceil(width / place) + 1
        values, between = derived(spectrum, 0, places), bow * place**2 / 8
        shifted = np.stack([np.roll(values, -k, axis=1) for k in range(length + 1)])
        tables, left = [shifted.min(axis=0) - between, shifted.max(axis=0) + between], 0.0
    else:
        # A row stands for the places from its own to the next one's: it is what the middle of them is.
        tables = [derived(spectrum * np.exp(0.5j * place * np.arange(spectrum.shape[1])), 0, places)]
        left = bow * width**2 / 8 + slope * place / 2
    order = np.arange(2 * turns + GROUP) * step % turns
    laid = [[row.reshape(turns, rows).T[:, order] for row in table] for table in tables]
    edges = np.arange(WINDOWS + 1) * (2 * math.pi / WINDOWS)
    inside = math.ceil(8 * spectrum.shape[1] / WINDOWS)
    fine = derived(spectrum, 0, WINDOWS * inside)
    most = fine.reshape(2, WINDOWS, inside).max(axis=2)
    between = bow * (edges[1] / inside) ** 2 / 8
    most = np.maximum(most, np.roll(fine[:, ::inside], -1, axis=1)) + between
    return OnFs(
        rows,
        singles(np.array(laid).ravel()),
        len(order),
        np.arange(turns) * after % turns,
        single(float(fine.min()) - between),
        single(float(most.max())),
        single(left),
        single(bow * (width / each) ** 2 / 8),
        singles(np.cos(edges)),
        singles(np.sin(edges)),
        singles(most.ravel()),
        single(edges[1] ** 2 / 8),
    )
