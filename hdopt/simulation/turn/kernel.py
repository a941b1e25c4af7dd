"""The compiled peak-to-peak of many drives with effects that repeat every input turn, in about a microsecond each.

As the base's kernel (`kinematics.kernel`), blocks of 128 drives, one a lane, in single precision; but effects leave no
closed candidates. So one turn is cut into cells, all are bounded, and those that may hold an extreme are looked at in
dense lists with the base's own parabolas, to which the effects add theirs. A ripple that both zones share is taken wave
by wave, but for drives that are too steep for its waves. A drive's value depends on nothing but its own errors. Numba's
cache looks at this file's date alone: touch it where another of this folder changes.
"""

from __future__ import annotations

import numpy as np

from hdopt.arrays import Array, Index, Singles
from hdopt.kinematics.compiled_closed_form import compiled, entry
from hdopt.kinematics.kernel import describe
from hdopt.kinematics.lanes.motion import LANES, Design
from hdopt.simulation.turn.crests import find_greatest_of_waves
from hdopt.simulation.turn.effects import Turn
from hdopt.simulation.turn.lows import find_least
from hdopt.simulation.turn.places import Found, room_for
from hdopt.simulation.turn.ripple import CASES, find_greatest_of_parts, find_least_of_parts
from hdopt.simulation.turn.rows import BOUNDS, GREATEST, LEAST
from hdopt.simulation.turn.scan import fill_parts, scan
from hdopt.simulation.turn.tops import find_greatest
from hdopt.simulation.turn.troughs import find_least_of_waves
from hdopt.simulation.turn.waiting import Waiting, room_to_wait

ROOMS = 2
"""Room for the parts of so many cells at least before they are looked at."""


def extremes_block(design: Design, matrix: Array, turn: Turn, out: Array) -> None:
    """Lower `out` (n, 2), mm of arc, to the least driving deviation of each row of `matrix` (n, 12), and to the
    negative of the greatest, with the effects of a `turn`.

    `design` is what the drives share. Rows hold errors in the order of ERROR_NAMES, mm and rad; valid where the closed
    form is.
    """
    waves = turn.waves
    rows = max(2 * len(turn.scan.below), len(waves.troughs.turns), len(waves.crests.turns))
    work = np.zeros(BOUNDS + LANES * rows, np.float32)
    lanes, waiting = np.zeros(LANES, np.int64), room_to_wait(ROOMS * CASES * turn.fine.parts * LANES)
    if not len(waves.troughs.turns):
        if turn.fine.parts:
            _fill_by_parts(design, matrix, turn, out, work, waiting)
        else:
            _fill(design, matrix, turn, out, work, lanes)
        return
    steep, before = np.zeros(len(matrix), np.int64), out.copy()
    _fill_by_waves(design, matrix, turn, out, work, lanes, room_for(waves), steep)
    if (rest := np.flatnonzero(steep)).size:
        again = before[rest]
        _fill_by_parts(design, np.ascontiguousarray(matrix[rest]), turn, again, work, waiting)
        out[rest] = again


@compiled
def _begin(design: Design, matrix: Array, turn: Turn, start: int, errors: Array, work: Singles) -> int:
    """Describe the block of drives that begins at a row, how many drives it has."""
    n, names = matrix.shape
    count: int = min(LANES, n - start)
    for name in range(names):
        for i in range(count):
            errors[name * LANES + i] = matrix[start + i, name]
    # The last block's spare lanes keep what they held: drives of the block before, or none.
    describe(errors, work)
    fill_parts(work, design, turn)
    return count


@compiled
def _end(work: Singles, out: Array, start: int, count: int) -> None:
    """Lower `out` to what a block found."""
    for i in range(count):
        out[start + i, 0] = min(out[start + i, 0], work[LEAST + i])
        out[start + i, 1] = min(out[start + i, 1], -work[GREATEST + i])


@entry
def _fill(design: Design, matrix: Array, turn: Turn, out: Array, work: Singles, lanes: Index) -> None:
    """The same with room, whose cells tell all."""
    errors = np.zeros(matrix.shape[1] * LANES)
    for start in range(0, len(matrix), LANES):
        count = _begin(design, matrix, turn, start, errors, work)
        scan(work, turn)
        find_least(work, lanes, design, turn)
        find_greatest(work, lanes, design, turn)
        _end(work, out, start, count)


@entry
def _fill_by_parts(design: Design, matrix: Array, turn: Turn, out: Array, work: Singles, waiting: Waiting) -> None:
    """The same where cells have parts."""
    errors = np.zeros(matrix.shape[1] * LANES)
    for start in range(0, len(matrix), LANES):
        count = _begin(design, matrix, turn, start, errors, work)
        scan(work, turn)
        find_least_of_parts(work, waiting, design, turn)
        find_greatest_of_parts(work, waiting, design, turn)
        _end(work, out, start, count)


@entry
def _fill_by_waves(
    design: Design, matrix: Array, turn: Turn, out: Array, work: Singles, lanes: Index, found: Found, steep: Index
) -> None:
    """The same with a ripple that both zones share; count in `steep` (n,) where a drive is too steep for its waves."""
    errors, many = np.zeros(matrix.shape[1] * LANES), np.zeros(LANES, np.int64)
    for start in range(0, len(matrix), LANES):
        count = _begin(design, matrix, turn, start, errors, work)
        many[:] = 0
        find_least_of_waves(work, lanes, found, design, turn, many)
        find_greatest_of_waves(work, lanes, found, design, turn, many)
        _end(work, out, start, count)
        for i in range(count):
            steep[start + i] = many[i]
