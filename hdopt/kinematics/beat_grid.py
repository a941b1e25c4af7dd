"""What both zones do but for the FS teeth, at the grid angles of one turn and between them, and where rims change.

Between the angles where a deepest rim changes, each zone follows one branch. A cell is what lies between two
neighbouring grid angles: a whole one where the rims stay the same. Where they change, the cell is cut there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hdopt.arrays import Array
from hdopt.kinematics.beat_tables import (
    BEFORE,
    PER_RAD,
    WRAPPED,
    Comb,
    Four,
    by_four,
    compiled,
    four,
    inlined,
    least_of,
    whole_of,
)
from hdopt.kinematics.branches import TIE_MM
from hdopt.kinematics.essential import ROOT_CELLS, ROOT_STEPS, SHORT
from hdopt.kinematics.lanes.single import unsigned

SAFETY = 1.25
"""How many times the largest second difference of the parts a cell is allowed to bend, and the third to bow."""
BETWEEN_PARABOLAS = 0.064 / 8
"""Of a third difference over a cell, how far off a parabola through its ends and middle is at most, 1/(9 sqrt(3))."""


DEPTH, ON_CS, ON_FS = 0, 1, 2
"""The first axis of `branches` of a `Walk`: depth (mm), offsets on CS and FS (rad)."""
VALUE, ANGLE, RIM, GAP, FLOOR, CEILING, ROWS = 0, 2, 4, 6, 8, 9, 10
"""Rows of a grid over one turn, two of most, one for each zone: its deviation without the FS teeth (mm), angle on the
FS (rad), deeper rim (0 or 1), and what the upper rim lies deeper than the lower (mm); what the driving deviation cannot
fall below in the cell after an angle, and what the zones but for the FS teeth do not rise above there, mm."""


class Walk(NamedTuple):
    """What one drive's beat is walked with: `branches` on an even grid of m angles, wrapped around, (3, 2, 2, m + 4)
    for depth (mm) and offsets (rad), zone and rim; the CS table over one turn, wrapped around (mm of arc); tan of the
    pressure angle times the share of misalignment, Z_CS/Z_FS, the FS comb, how far a cell of the grid bends, and how
    far off a parabola through its ends and middle is, mm."""

    branches: Array
    cs_table: Array
    tan_alpha: float
    advance: float
    comb: Comb
    margin: float
    beside: float


class Work(NamedTuple):
    """Room for one drive: the `grid` (ROWS, m + 4), wrapped around; the `changes` of rims in places, in order, and a
    turn later the first; the cells that these cut (`cuts`), their two places and both zones' rims; deviations of a
    cell at all phases (`lanes`, (3, 2, P): end, zone, phase; and room to fold them)."""

    grid: Array
    changes: Array
    cuts: Array
    lanes: Array


@compiled
def new_work(grid: int, phases: int) -> Work:
    """Room for the beat of drives on so many `grid` angles and FS `phases`."""
    return Work(
        np.empty((ROWS, grid + WRAPPED)), np.empty(4 * grid + 2), np.empty((5 * grid + 2, 4)), np.empty((3, 2, phases))
    )


def grid_angles(grid: int) -> Array:
    """Cosine and sine of so many (`grid`) angles of a turn, wrapped around as `Walk` has its branches, (2, m + 4)."""
    return np.stack([f(np.arange(-BEFORE, grid + WRAPPED - BEFORE) * (2 * math.pi / grid)) for f in (np.cos, np.sin)])


@compiled
def bends(branches: Array, grid: Array) -> tuple[float, float]:
    """Largest second and third difference of the depth of any of the wrapped `branches`, mm, over their grid; two rows
    of `grid` are room for them."""
    n = branches.shape[3] - 3
    second, third = grid[FLOOR], grid[CEILING]
    for branch in range(4):
        row = branches[DEPTH, branch // 2, branch % 2]
        for i in range(n):
            near, far = row[i] - 2 * row[i + 1] + row[i + 2], row[i + 1] - 2 * row[i + 2] + row[i + 3]
            one, two = -abs(near), -abs(far - near)
            second[i] = one if branch == 0 or one < second[i] else second[i]
            third[i] = two if branch == 0 or two < third[i] else third[i]
    return -least_of(second, n), -least_of(third, n)


@compiled
def margins(
    branches: Array, tan_alpha: float, on_cs: tuple[float, float], comb: Comb, work: Work
) -> tuple[float, float]:
    """`margin` and `beside` of `Walk`, mm, of wrapped `branches`, whose depth `tan_alpha` multiplies, where the CS
    table has the second and third difference `on_cs` over a grid angle, mm, and the FS table is `comb`; `work` is
    room."""
    second, third = bends(branches, work.grid)
    margin = (tan_alpha * second + on_cs[0] + comb.bend) / 8
    return SAFETY * margin, SAFETY * BETWEEN_PARABOLAS * (tan_alpha * third + on_cs[1] + comb.bow)


@inlined
def _branch_by_four(values: Array, of: int, zone: int, k: int, at: Four) -> float:
    """The cubic of one branch of `values` (3, 2, 2, m + 4); taking a view of it would cost more than the sum."""
    i = at.first
    low = at.w_a * values[of, zone, k, i] + at.w_b * values[of, zone, k, i + unsigned(1)]
    return float(low + at.w_c * values[of, zone, k, i + unsigned(2)] + at.w_d * values[of, zone, k, i + unsigned(3)])


@inlined
def _on_turn(angle: float, places: int) -> float:
    """An `angle`, rad, as a place from 0 to so many `places` a turn."""
    turns = angle * PER_RAD
    return float(turns - np.floor(turns)) * places


@inlined
def zone_at(walk: Walk, zone: int, k: int, place: float) -> tuple[float, float]:
    """Deviation of a `zone` of a `walk` without FS teeth (mm) and its angle on the FS (rad), with its rim `k`, at a
    `place` in cells from 0 to two turns."""
    branches = walk.branches
    m, n_cs = branches.shape[3] - WRAPPED, len(walk.cs_table) - WRAPPED
    at, theta = four(place if place < m else place - m), place * (2 * math.pi / m)
    s, away = 1.0 - 2.0 * zone, math.pi * zone
    on_cs = theta + s * _branch_by_four(branches, ON_CS, zone, k, at) + away
    angle = walk.advance * theta + s * _branch_by_four(branches, ON_FS, zone, k, at) + away
    on_table = by_four(walk.cs_table, four(_on_turn(on_cs, n_cs)))
    return walk.tan_alpha * _branch_by_four(branches, DEPTH, zone, k, at) + on_table, angle


@compiled
def fill_grid(walk: Walk, grid: Array) -> None:
    """Fill the first rows of the `grid` (ROWS, m + 4) of a `walk` with both zones' deeper rims."""
    branches, table, tan_alpha, advance = walk.branches, walk.cs_table, walk.tan_alpha, walk.advance
    m, n_cs = branches.shape[3] - WRAPPED, len(table) - WRAPPED
    step = 2 * math.pi / m
    for zone in range(2):
        s, away = 1.0 - 2.0 * zone, math.pi * zone
        for i in range(branches.shape[3]):
            upper, lower = branches[DEPTH, zone, 0, i], branches[DEPTH, zone, 1, i]
            first, theta = upper >= lower - TIE_MM, (i - BEFORE) * step
            on_cs = branches[ON_CS, zone, 0, i] if first else branches[ON_CS, zone, 1, i]
            on_fs = branches[ON_FS, zone, 0, i] if first else branches[ON_FS, zone, 1, i]
            grid[GAP + zone, i] = upper - lower
            grid[RIM + zone, i] = 0.0 if first else 1.0
            grid[ANGLE + zone, i] = advance * theta + s * on_fs + away
            # The place on the CS for now.
            grid[VALUE + zone, i] = _on_turn(theta + s * on_cs + away, n_cs)
    for zone in range(2):
        for i in range(branches.shape[3]):
            upper, lower = branches[DEPTH, zone, 0, i], branches[DEPTH, zone, 1, i]
            depth = upper if upper >= lower - TIE_MM else lower
            grid[VALUE + zone, i] = tan_alpha * depth + by_four(table, four(grid[VALUE + zone, i]))


@compiled
def fill_bounds(walk: Walk, grid: Array) -> None:
    """Fill floor and ceiling of the `grid` of a `walk` for every cell, as if no rim changed in it.

    The floor rises with the deviation of either zone: that of the lesser of both ends' bounds a cell's.
    """
    for i in range(grid.shape[1] - 1):
        a, b, c, d = grid[VALUE, i], grid[VALUE, i + 1], grid[VALUE + 1, i], grid[VALUE + 1, i + 1]
        turned = abs(grid[ANGLE + 1, i] - grid[ANGLE, i] - math.pi)
        turned_b = abs(grid[ANGLE + 1, i + 1] - grid[ANGLE, i + 1] - math.pi)
        turned = turned if turned > turned_b else turned_b
        grid[FLOOR, i] = floor_of(walk.comb, a if a < b else b, c if c < d else d, turned) - walk.margin
        a, c = a if a > b else b, c if c > d else d
        grid[CEILING, i] = (a if a > c else c) + walk.margin + walk.comb.largest


@inlined
def floor_of(comb: Comb, one: float, two: float, turned: float) -> float:
    """What the driving deviation cannot fall below where the zones' other terms are `one` and `two`, mm of arc,
    beside the teeth of `comb`; `turned` is how far from half a turn the two angles on the FS lie apart, rad."""
    last = len(comb.floor) - 1
    per_step, half_step = last / comb.reach, comb.reach / last / 2
    place = abs(one - two) * per_step
    k = whole_of(place if place < last - 1 else last - 1)
    x = (place - k) * half_step
    # Between two tabulated differences it cannot fall faster than half the difference; beyond the last, it rises so.
    low, high = comb.floor[unsigned(k)] - x, comb.floor[unsigned(k) + unsigned(1)] - half_step + x
    low = (one + two) / 2 + (low if low > high else high) - comb.slope * turned
    high = (one if one > two else two) + comb.least
    return low if low > high else high


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
def _mark_changes(grid: Array, zone: int) -> float:
    """Mark in the ceilings of the `grid` with -1 where the gaps of a zone's rims change sign before the next angle, or
    come near to it without; the largest of these gaps, mm."""
    n = grid.shape[1] - 2
    for i in range(1, n + 1):
        before, here, after = grid[GAP + zone, i - 1], grid[GAP + zone, i], grid[GAP + zone, i + 1]
        nearest = abs(here) <= abs(before) and abs(here) <= abs(after)
        grid[CEILING, i] = -1.0 if nearest or (here >= 0.0) != (after >= 0.0) else 0.0
        grid[FLOOR, i - 1] = -abs(here)
    return -least_of(grid[FLOOR], n)


@compiled
def _rim_changes(grid: Array, zone: int, found: Array, count: int) -> int:
    """Append to `found` the places where the gaps of a zone's rims in the `grid` change sign over one turn, which are
    marked; pairs within a cell too. How many are in it."""
    row = GAP + zone
    for j in range(grid.shape[1] - WRAPPED):
        if grid[CEILING, j + BEFORE] == 0.0:
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
    """Fill `found` with the places of one turn, in order, where a zone's deepest rim changes in the `grid`, whose
    bounds are not known yet; where none does, with 0; how many they are. The first follows again a turn later."""
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
def rims_between(grid: Array, low: float, high: float) -> tuple[bool, float, float]:
    """Whether two neighbouring changes of rims in the `grid`, at `low` and `high`, leave a stretch between, and the
    deepest rims of both zones on it, 0 or 1; it is none where they only tie."""
    middle, long = (low + high) / 2, high - low > SHORT
    one, two = _gap_at(grid, 0, middle), _gap_at(grid, 1, middle)
    real = high > low and (long or abs(one) > TIE_MM) and (long or abs(two) > TIE_MM)
    return real, 0.0 if one >= -TIE_MM else 1.0, 0.0 if two >= -TIE_MM else 1.0
