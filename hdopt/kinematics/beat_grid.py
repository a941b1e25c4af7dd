"""Both zones but for the FS teeth, at the grid angles of one turn and between them, and where rims change.

Between the angles where a deepest rim changes, each zone follows one branch. A cell is what lies between two
neighbouring grid angles: a whole one where the rims stay the same. Where they change, the cell is cut there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hdopt.arrays import Array, Singles
from hdopt.kinematics.beat_bounds import (
    CEILING,
    CELLS,
    CLEAR,
    DEPTH,
    FLOOR,
    NODES,
    ON_CS,
    ON_FS,
    SAFETY,
    Bends,
    Circular,
    Places,
    Slack,
    largest_of_branches,
    on_turn,
    rounding_of,
)
from hdopt.kinematics.beat_tables import (
    BEFORE,
    PER_RAD,
    WRAPPED,
    Bits,
    Comb,
    Four,
    allocating,
    by_four,
    compiled,
    four,
    inlined,
    least_of,
    rising,
)
from hdopt.kinematics.branches import TIE_MM
from hdopt.kinematics.essential import ROOT_CELLS, ROOT_STEPS, SHORT
from hdopt.kinematics.lanes.single import unsigned

BETWEEN_PARABOLAS = 0.064
"""Of a third difference over half a cell, how far off a parabola through its ends and middle is at most,
1/(9 sqrt(3))."""


GAP, MARK, SIZE, ROWS = 0, 2, 3, 4
"""Rows of a grid over one turn: what the upper rim of either zone lies deeper than the lower (mm), where that may
change, and its size."""


class Walk(NamedTuple):
    """What one drive's beat is walked with: `branches` on an even grid of m angles, wrapped around, (3, 2, 2, m + 4)
    for depth (mm) and offsets (rad), zone and rim; the CS table; tan of the pressure angle times the share of
    misalignment, Z_CS/Z_FS, the FS comb, how far a cell of the grid bends with the FS teeth, how far off a parabola
    through its ends and middle is, mm, and what bounds are given."""

    branches: Array
    circular: Circular
    tan_alpha: float
    advance: float
    comb: Comb
    margin: float
    beside: float
    slack: Slack


class Work(NamedTuple):
    """Room for one drive: `nodes` and `cells` of bounds, `places` for them; the `grid` (ROWS, m + 4) of gaps between
    rims, wrapped around; the `changes` of rims in places, in order, and a turn later the first; deviations of a cell
    at all phases (`lanes`, (3, 2, P): end, zone, phase; and what they are least); the `bits` of cells and of lanes."""

    nodes: Singles
    cells: Singles
    cell_bits: Bits
    lane_bits: Bits
    places: Places
    grid: Array
    changes: Array
    lanes: Singles


@allocating
def new_work(grid: int, phases: int) -> Work:
    """Room for the beat of drives on so many `grid` angles and FS `phases`."""
    wrapped = grid + WRAPPED
    cells, lanes = np.empty((CELLS, wrapped), np.float32), np.empty((3, 2, phases), np.float32)
    return Work(
        np.empty((NODES, wrapped), np.float32),
        cells,
        cells.view(np.int32),
        lanes.view(np.int32),
        np.empty(wrapped, np.int32),
        np.empty((ROWS, wrapped)),
        np.empty(4 * grid + 2),
        lanes,
    )


def grid_angles(grid: int) -> Array:
    """Cosine and sine of so many (`grid`) angles of a turn, wrapped around as `Walk` has its branches, (2, m + 4)."""
    return np.stack([f(np.arange(-BEFORE, grid + WRAPPED - BEFORE) * (2 * math.pi / grid)) for f in (np.cos, np.sin)])


@allocating
def walk_of(branches: Array, circular: Circular, tan_alpha: float, advance: float, comb: Comb, work: Work) -> Walk:
    """`Walk` of wrapped `branches`, whose depth `tan_alpha` multiplies, with the teeth `circular` and `comb` and
    Z_CS/Z_FS, `advance`; `work` is room."""
    cells = work.cells
    bends = largest_of_branches(branches, cells[FLOOR], cells[CEILING], cells[CLEAR])
    return walk_bent(branches, bends, circular, tan_alpha, advance, comb)


@allocating
def walk_bent(branches: Array, bends: Bends, circular: Circular, tan_alpha: float, advance: float, comb: Comb) -> Walk:
    """The same of wrapped `branches` that bend as `bends` say, with `tan_alpha`, the teeth `circular` and `comb`, and
    `advance`."""
    bend, turn = bends.depth, bends.turn
    rounding = rounding_of(bends.deepest, tan_alpha, circular, comb)
    margin = SAFETY / 8 * (tan_alpha * bend + circular.bend + comb.bend) + rounding
    # A third difference is that of two second ones, over half a step an eighth.
    beside = 2 * rounding + SAFETY * BETWEEN_PARABOLAS * (tan_alpha * bend / 4 + circular.bow + comb.bow)
    # Where offsets bend, the teeth are met off an even step. Gaps of rims bend twice as much as a depth; the hundredth
    # is for rounding.
    slack = Slack(
        SAFETY / 8 * (tan_alpha * bend + circular.slope * turn),
        1.01 * bend / 4 + TIE_MM,
        rounding + comb.ripple + SAFETY / 8 * comb.slope * turn,
        SAFETY / 8 * comb.bend,
    )
    return Walk(branches, circular, tan_alpha, advance, comb, margin, beside, slack)


@inlined
def _branch_by_four(values: Array, of: int, zone: int, k: int, at: Four) -> float:
    """The cubic of one branch of `values` (3, 2, 2, m + 4); taking a view of it would cost more than the sum."""
    i = at.first
    low = at.w_a * values[of, zone, k, i] + at.w_b * values[of, zone, k, i + unsigned(1)]
    return float(low + at.w_c * values[of, zone, k, i + unsigned(2)] + at.w_d * values[of, zone, k, i + unsigned(3)])


@inlined
def zone_at(walk: Walk, zone: int, k: int, place: float) -> tuple[float, float]:
    """Deviation of a `zone` of a `walk` without FS teeth (mm) and its angle on the FS (rad), with its rim `k`, at a
    `place` in cells from 0 to two turns."""
    branches = walk.branches
    m, n_cs = branches.shape[3] - WRAPPED, len(walk.circular.table) - WRAPPED
    at, theta = four(place if place < m else place - m), place * (2 * math.pi / m)
    s, away = 1.0 - 2.0 * zone, math.pi * zone
    on_cs = theta + s * _branch_by_four(branches, ON_CS, zone, k, at) + away
    angle = walk.advance * theta + s * _branch_by_four(branches, ON_FS, zone, k, at) + away
    on_table = by_four(walk.circular.table, four(on_turn(on_cs * PER_RAD, n_cs)))
    return walk.tan_alpha * _branch_by_four(branches, DEPTH, zone, k, at) + on_table, angle


@inlined
def zone_along(walk: Walk, zone: int, k: int, place: float) -> tuple[float, float, float, float]:
    """Deviation of a `zone` of a `walk` with its rim `k` at a `place` (mm) and its angle on the FS (rad) as `zone_at`
    gives them, and then the slopes of both over the place, per cell."""
    branches = walk.branches
    m, n_cs = branches.shape[3] - WRAPPED, len(walk.circular.table) - WRAPPED
    inside, step = place if place < m else place - m, 2 * math.pi / m
    at, up, theta = four(inside), rising(inside), place * step
    s, away = 1.0 - 2.0 * zone, math.pi * zone
    on_cs = theta + s * _branch_by_four(branches, ON_CS, zone, k, at) + away
    angle = walk.advance * theta + s * _branch_by_four(branches, ON_FS, zone, k, at) + away
    on_table = on_turn(on_cs * PER_RAD, n_cs)
    on_cs_teeth = by_four(walk.circular.table, four(on_table))
    rises = by_four(walk.circular.table, rising(on_table)) * (n_cs * PER_RAD)
    value = walk.tan_alpha * _branch_by_four(branches, DEPTH, zone, k, at) + on_cs_teeth
    slope = rises * (step + s * _branch_by_four(branches, ON_CS, zone, k, up))
    slope += walk.tan_alpha * _branch_by_four(branches, DEPTH, zone, k, up)
    return value, angle, slope, walk.advance * step + s * _branch_by_four(branches, ON_FS, zone, k, up)


@inlined
def node_at(walk: Walk, zone: int, k: int, i: int) -> tuple[float, float]:
    """The same of a `zone` of a `walk` with its rim `k` at a grid angle, number `i` of the wrapped branches."""
    branches = walk.branches
    m, n_cs = branches.shape[3] - WRAPPED, len(walk.circular.table) - WRAPPED
    theta, s, away = (i - BEFORE) * (2 * math.pi / m), 1.0 - 2.0 * zone, math.pi * zone
    on_table = four(on_turn((theta + s * branches[ON_CS, zone, k, i] + away) * PER_RAD, n_cs))
    value = walk.tan_alpha * branches[DEPTH, zone, k, i] + by_four(walk.circular.table, on_table)
    return value, walk.advance * theta + s * branches[ON_FS, zone, k, i] + away


@inlined
def deeper_rim(branches: Array, zone: int, i: int) -> int:
    """The deeper rim of a `zone`, 0 or 1, at grid angle number `i` of the wrapped `branches`."""
    return 0 if branches[DEPTH, zone, 0, i] >= branches[DEPTH, zone, 1, i] - TIE_MM else 1


@inlined
def _gap_at(grid: Array, zone: int, place: float) -> float:
    """The cubic of a zone's gaps of rims in the `grid` at a `place` from -1 to two turns."""
    m = grid.shape[1] - WRAPPED
    at, row = four(place + m if place < 0.0 else place - m if place >= m else place), GAP + zone
    i = at.first
    low = at.w_a * grid[row, i] + at.w_b * grid[row, i + unsigned(1)]
    return float(low + at.w_c * grid[row, i + unsigned(2)] + at.w_d * grid[row, i + unsigned(3)])


@compiled
def _root(grid: Array, zone: int, low: float, high: float) -> float:
    """Where a zone's gaps of rims in the `grid` change sign between two places, by the Illinois method: a secant that
    halves the value of an end which stays."""
    at_low, at_high = _gap_at(grid, zone, low), _gap_at(grid, zone, high)
    side = 0
    place = low
    for _ in range(ROOT_STEPS):
        before = place
        if at_high == at_low:
            break
        place = (low * at_high - high * at_low) / (at_high - at_low)
        value = _gap_at(grid, zone, place)
        if (value >= 0.0) == (at_low >= 0.0):
            low, at_low = place, value
            at_high = at_high / 2 if side == -1 else at_high
            side = -1
        else:
            high, at_high = place, value
            at_low = at_low / 2 if side == 1 else at_low
            side = 1
        if abs(place - before) < ROOT_CELLS or value == 0.0:
            break
    return place


@compiled
def fill_gaps(branches: Array, grid: Array) -> None:
    """Fill the gaps between the rims of either zone of the `grid` from wrapped `branches`."""
    for zone in range(2):
        for i in range(branches.shape[3]):
            grid[GAP + zone, i] = branches[DEPTH, zone, 0, i] - branches[DEPTH, zone, 1, i]


@compiled
def _mark_changes(grid: Array, zone: int) -> float:
    """Mark in the `grid` with -1 where the gaps of a zone's rims change sign before the next angle, or
    come near to it without; the largest of these gaps, mm."""
    n = grid.shape[1] - 2
    for i in range(1, n + 1):
        before, here, after = grid[GAP + zone, i - 1], grid[GAP + zone, i], grid[GAP + zone, i + 1]
        nearest = abs(here) <= abs(before) and abs(here) <= abs(after)
        grid[MARK, i] = -1.0 if nearest or (here >= 0.0) != (after >= 0.0) else 0.0
        grid[SIZE, i - 1] = -abs(here)
    return -least_of(grid[SIZE], n)


@compiled
def _rim_changes(grid: Array, zone: int, found: Array, count: int) -> int:
    """Append to `found` the places where the gaps of a zone's rims in the `grid` change sign over one turn, which are
    marked; pairs within a cell too. How many are in it."""
    row = GAP + zone
    for j in range(grid.shape[1] - WRAPPED):
        if grid[MARK, j + BEFORE] == 0.0:
            continue
        before, here, after = grid[row, j], grid[row, j + BEFORE], grid[row, j + BEFORE + 1]
        if (here >= 0.0) != (after >= 0.0):
            found[count] = _root(grid, zone, float(j), j + 1.0)
            count += 1
        elif (before >= 0.0) == (here >= 0.0):
            bend = before - 2 * here + after
            vertex = j + (0.5 * (before - after) / bend if bend != 0.0 else 0.0)
            if (_gap_at(grid, zone, vertex) >= 0.0) != (here >= 0.0):
                found[count] = _root(grid, zone, j - 1.0, vertex)
                found[count + 1] = _root(grid, zone, vertex, j + 1.0)
                count += 2
    return count


@compiled
def fill_changes(grid: Array, found: Array) -> int:
    """Fill `found` with the places of one turn, in order, where a zone's deepest rim changes in the `grid`; where none
    does, with 0; how many they are. The first follows again a turn later."""
    m, count = grid.shape[1] - WRAPPED, 0
    for zone in range(2):
        if _mark_changes(grid, zone) > TIE_MM:
            count = _rim_changes(grid, zone, found, count)
    if count == 0:
        found[0], count = 0.0, 1
    for i in range(count):
        place = found[i] + m if found[i] < 0.0 else found[i] - m if found[i] >= m else found[i]
        k = i
        while k > 0 and found[k - 1] > place:
            found[k] = found[k - 1]
            k -= 1
        found[k] = place
    found[count] = found[0] + m
    return count


@compiled
def rims_between(grid: Array, low: float, high: float) -> tuple[bool, int, int]:
    """Whether two neighbouring changes of rims in the `grid`, at `low` and `high`, leave a stretch between, and the
    deepest rims of both zones on it, 0 or 1; it is none where they only tie."""
    middle, long = (low + high) / 2, high - low > SHORT
    one, two = _gap_at(grid, 0, middle), _gap_at(grid, 1, middle)
    real = high > low and (long or abs(one) > TIE_MM) and (long or abs(two) > TIE_MM)
    return real, 0 if one >= -TIE_MM else 1, 0 if two >= -TIE_MM else 1
