"""The compiled pass of a stack: points, quantiles, drives and their peak-to-peak, 128 drives at a time in cache.

Sobol' points of an aligned block are those of the first block, all changed by the same bits (Gray code order). Numba's
cache looks at this file's date alone: touch it where a part of the kernel in `hdopt/kinematics/lanes` changes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hdopt.arrays import Array, Bits, Index, Singles
from hdopt.kinematics.compiled_closed_form import allocating, compiled, entry
from hdopt.kinematics.kernel import WORK, block_of_lanes
from hdopt.kinematics.lanes.motion import LANES, VALUE, Design
from hdopt.tolerance.quantile_table import CELL_BITS, OCTAVES, SIDE

LINE, TRIANGLE, TABLE = range(3)
"""Kinds of inputs: a line over u, a triangle's two roots, a table of cubics."""
CONSTANTS = 8
"""Constants of an input, as `_on_line` and `_on_triangle` take them."""
MANTISSA = 52 - CELL_BITS
FIRST_CELL = (1023 - OCTAVES - 1) << CELL_BITS
"""Number of the first cell in the exponent and first mantissa bits of a number in double precision."""
IN_CELL, ONE_BITS = (1 << MANTISSA) - 1, 1023 << 52
BELOW_HALF = float(np.nextafter(0.5, 0.0))
IN_BLOCK = LANES.bit_length() - 1
"""Bits that number the drives of a block."""
SOBOL_STEP = 2.0**-30
"""Step of the grid of Sobol' points, whose middles are taken."""


class Columns(NamedTuple):
    """What each of d inputs does: its kind (d,), the row of the error that it is (d,), constants (d, CONSTANTS), the
    number of its table (d,), all tables one below the other (k 2 SIDE 4,), and the errors of which none is an input,
    (12,); mm and rad."""

    kinds: Index
    errors: Index
    constants: Array
    numbers: Index
    tables: Singles
    held: Array


@compiled
def _on_line(u: Array, c: Array, out: Array, at: int) -> None:
    """Fill LANES of `out` from `at` on with c[0] + c[1] u."""
    start, width = c[0], c[1]
    for i in range(LANES):
        out[at + i] = start + width * u[i]


@compiled
def _on_triangle(u: Array, c: Array, out: Array, at: int) -> None:
    """Fill LANES of `out` from `at` on with a triangle's quantiles.

    Upper tails are c[0] - c[1] u; above c[2] the value is c[3] + sqrt((1 - tail) c[4]), else c[5] - sqrt(tail c[6]).
    """
    above, mass, peak, low, rise, high, fall = c[0], c[1], c[2], c[3], c[4], c[5], c[6]
    for i in range(LANES):
        tail = above - mass * u[i]
        rising = low + c[7] * np.sqrt(max(1.0 - tail, 0.0) * rise)
        falling = high - c[7] * np.sqrt(max(tail, 0.0) * fall)
        out[at + i] = rising if tail > peak else falling


@compiled
def _in_table(u: Array, tables: Singles, start: int, work: Array, out: Array, at: int) -> int:
    """Fill LANES of `out` from `at` on with cubics of the table that starts at `start` in `tables`; how many of `u` lie
    nearer to an end than it goes. `work` (LANES,) is room."""
    bits = work.view(np.int64)
    beyond = 0
    for i in range(LANES):
        work[i] = min(min(u[i], 1.0 - u[i]), BELOW_HALF)
    for i in range(LANES):
        cell = (bits[i] >> MANTISSA) - FIRST_CELL
        beyond += cell < 0
        bits[i] = (bits[i] & IN_CELL) | ONE_BITS
        out[at + i] = max(cell, 0)
    for i in range(LANES):
        upper = SIDE if u[i] > 0.5 else 0
        k = start + 4 * (np.int64(out[at + i]) + upper)
        t = np.float32((work[i] - 1.0) * (1 << CELL_BITS))
        out[at + i] = tables[k] + t * (tables[k + 1] + t * (tables[k + 2] + t * tables[k + 3]))
    return beyond


@compiled
def _fill_errors(u: Array, column: int, columns: Columns, work: Array, errors: Array) -> int:
    """Fill one row of `errors` (12 LANES,) from the points `u` (LANES,) of one of the `columns`; how many of them no
    table holds. `work` (LANES,) is room."""
    at = columns.errors[column] * LANES
    kind = columns.kinds[column]
    if kind == LINE:
        _on_line(u, columns.constants[column], errors, at)
    elif kind == TRIANGLE:
        _on_triangle(u, columns.constants[column], errors, at)
    else:
        return _in_table(u, columns.tables, columns.numbers[column] * 8 * SIDE, work, errors, at)
    return 0


@allocating
def _held_errors(columns: Columns) -> Array:
    """Errors (12 LANES,) that all lanes hold, before any input fills its row."""
    errors = np.empty(len(columns.held) * LANES)
    for i in range(len(errors)):
        errors[i] = columns.held[i // LANES]
    return errors


@allocating
def _first_block(shift: Bits, numbers: Bits) -> Bits:
    """The bits of the first LANES Sobol' points under the digital `shift` (d,) and direction `numbers` (d, 30):
    (d, LANES)."""
    first = np.empty((len(shift), LANES), np.uint32)
    for j in range(len(shift)):
        first[j, 0] = shift[j]
        for i in range(1, LANES):
            bit = 0
            while not (i >> bit) & 1:
                bit += 1
            first[j, i] = first[j, i - 1] ^ numbers[j, bit]
    return first


@compiled
def _block_bits(numbers: Bits, block: int, out: Bits) -> None:
    """Fill `out` (d,) with what changes the first block's points into those of another `block` under the direction
    `numbers` (d, 30)."""
    start = block << IN_BLOCK
    code = start ^ (start >> 1)
    for j in range(len(out)):
        out[j] = 0
        for bit in range(IN_BLOCK - 1, numbers.shape[1]):
            if (code >> bit) & 1:
                out[j] ^= numbers[j, bit]


@entry
def sobol_block(shift: Bits, numbers: Bits, start: int, columns: Columns, design: Design, out: Array) -> int:
    """Fill `out` (n,) with the peak-to-peak, mm of arc, of the drives of Sobol' points `start` to `start` + n; how many
    numbers no table holds.

    `shift` (d,) and direction `numbers` (d, 30) are those of one scrambling, `start` is a multiple of LANES; the
    `columns` make errors of points, `design` is what the drives share.
    """
    n = len(out)
    first, turned = _first_block(shift, numbers), np.empty(len(shift), np.uint32)
    errors, u, room = _held_errors(columns), np.empty(LANES), np.empty(LANES)
    work, lanes, beyond = np.zeros(WORK, np.float32), np.zeros(LANES, np.int64), 0
    for at in range(0, n, LANES):
        _block_bits(numbers, (start + at) >> IN_BLOCK, turned)
        for j in range(len(shift)):
            row, change = first[j], turned[j]
            for i in range(LANES):
                u[i] = (np.float64(np.int32(row[i] ^ change)) + 0.5) * SOBOL_STEP
            beyond += _fill_errors(u, j, columns, room, errors)
        block_of_lanes(errors, work, lanes, design)
        for i in range(min(LANES, n - at)):
            out[at + i] = work[VALUE + i]
    return beyond


@entry
def points_block(points: Array, columns: Columns, design: Design, out: Array) -> int:
    """The same for ready `points` (n, d) of the unit cube: fills `out` (n,) under `columns` and `design`."""
    n, dimension = points.shape
    errors, u, room = _held_errors(columns), np.full(LANES, 0.5), np.empty(LANES)
    work, lanes, beyond = np.zeros(WORK, np.float32), np.zeros(LANES, np.int64), 0
    for at in range(0, n, LANES):
        count = min(LANES, n - at)
        for j in range(dimension):
            for i in range(count):
                u[i] = points[at + i, j]
            beyond += _fill_errors(u, j, columns, room, errors)
        block_of_lanes(errors, work, lanes, design)
        for i in range(count):
            out[at + i] = work[VALUE + i]
    return beyond
