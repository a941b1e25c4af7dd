"""The compiled peak-to-peak of many drives with effects that repeat every input turn, in about a microsecond each.

As the base's kernel (`kinematics.kernel`), blocks of 128 drives, one a lane, in single precision; but effects leave no
closed candidates. So one turn is cut into cells, all are bounded, and those that may hold an extreme are looked at in
dense lists with the base's own parabolas, to which the effects add theirs. A drive's value depends on nothing but its
own errors. Numba's cache looks at this file's date alone: touch it where another of this folder changes.
"""

from __future__ import annotations

import numpy as np

from hdopt.arrays import Array, Index, Singles
from hdopt.kinematics.compiled_closed_form import compiled, entry
from hdopt.kinematics.kernel import describe
from hdopt.kinematics.lanes.motion import LANES, Design
from hdopt.simulation.turn.effects import Turn
from hdopt.simulation.turn.lows import find_least
from hdopt.simulation.turn.ripple import find_greatest_of_parts, find_least_of_parts
from hdopt.simulation.turn.rows import BOUNDS, GREATEST, LEAST
from hdopt.simulation.turn.scan import fill_parts, scan
from hdopt.simulation.turn.tops import find_greatest


def extremes_block(design: Design, matrix: Array, turn: Turn, out: Array) -> None:
    """Lower `out` (n, 2), mm of arc, to the least driving deviation of each row of `matrix` (n, 12), and to the
    negative of the greatest, with the effects of a `turn`.

    `design` is what the drives share. Rows hold errors in the order of ERROR_NAMES, mm and rad; valid where the closed
    form is.
    """
    work = np.zeros(BOUNDS + 2 * LANES * len(turn.scan.below), np.float32)
    lanes, near = np.zeros(LANES, np.int64), np.zeros(LANES, np.int64)
    fill = _fill_by_parts if turn.fine.parts else _fill
    fill(design, matrix, turn, out, work, lanes, near)


@compiled
def _begin(design: Design, matrix: Array, turn: Turn, start: int, errors: Array, work: Singles) -> int:
    """Describe the block of drives that begins at a row, and bound its cells: how many drives it has."""
    n, names = matrix.shape
    count: int = min(LANES, n - start)
    for name in range(names):
        for i in range(count):
            errors[name * LANES + i] = matrix[start + i, name]
    # The last block's spare lanes keep what they held: drives of the block before, or none.
    describe(errors, work)
    fill_parts(work, design, turn)
    scan(work, turn)
    return count


@compiled
def _end(work: Singles, out: Array, start: int, count: int) -> None:
    """Lower `out` to what a block found."""
    for i in range(count):
        out[start + i, 0] = min(out[start + i, 0], work[LEAST + i])
        out[start + i, 1] = min(out[start + i, 1], -work[GREATEST + i])


@entry
def _fill(design: Design, matrix: Array, turn: Turn, out: Array, work: Singles, lanes: Index, near: Index) -> None:
    """The same with room, whose cells tell all."""
    errors = np.zeros(matrix.shape[1] * LANES)
    for start in range(0, len(matrix), LANES):
        count = _begin(design, matrix, turn, start, errors, work)
        find_least(work, lanes, design, turn)
        find_greatest(work, lanes, design, turn)
        _end(work, out, start, count)


@entry
def _fill_by_parts(
    design: Design, matrix: Array, turn: Turn, out: Array, work: Singles, lanes: Index, near: Index
) -> None:
    """The same where cells have parts."""
    errors = np.zeros(matrix.shape[1] * LANES)
    for start in range(0, len(matrix), LANES):
        count = _begin(design, matrix, turn, start, errors, work)
        find_least_of_parts(work, lanes, near, design, turn)
        find_greatest_of_parts(work, lanes, near, design, turn)
        _end(work, out, start, count)
