"""Essential extremes of the driving deviation over the full beat of measured teeth, all FS phases in lanes.

The same extremes as `hdopt.kinematics.essential`, some hundred times faster, for stacks and searches. Most input angles
are never looked at with the FS teeth: from the least and largest value of the FS table, and the least sum of two places
half a turn apart, follow bounds of what a cell between two angles can reach, and only cells that could hold an extreme
are. There a parabola of both zones through the ends and the middle says for each phase that can win what it can reach,
and where it may be the extreme, narrower ones follow it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from hdopt.arrays import Array
from hdopt.kinematics.beat_grid import (
    ANGLE,
    CEILING,
    FLOOR,
    RIM,
    VALUE,
    Walk,
    Work,
    fill_bounds,
    fill_changes,
    fill_grid,
    floor_of,
    rims_between,
    zone_at,
)
from hdopt.kinematics.beat_tables import BEFORE, WRAPPED, compiled, inlined, lanes_of, least_of, one_lane

NARROWER = 0.125
"""Width of the second pair of parabolas as a share of the first."""


class Cell(NamedTuple):
    """What lies between two places, `low` and `high`, on rim `one` of the first zone and `two` of the second; at both
    places each zone's deviation without the FS teeth, mm, and angle on the FS, rad."""

    low: float
    high: float
    one: int
    two: int
    one_low: float
    two_low: float
    one_high: float
    two_high: float
    on_one_low: float
    on_two_low: float
    on_one_high: float
    on_two_high: float


class Three(NamedTuple):
    """Values of one zone at the ends of a piece and in its middle."""

    low: float
    middle: float
    high: float


@inlined
def _lowest_of_two(one: Three, two: Three) -> tuple[float, float]:
    """Where in -1..1 the larger of two parabolas is lowest, an end, a vertex, or where they cross; and how low."""
    slope_one, bend_one = (one.high - one.low) / 2, one.high - 2 * one.middle + one.low
    slope_two, bend_two = (two.high - two.low) / 2, two.high - 2 * two.middle + two.low
    least, place = math.inf, 0.0
    curve, line, level = (bend_one - bend_two) / 2, slope_one - slope_two, one.middle - two.middle
    inside = max(line * line - 4 * curve * level, 0.0)
    # The two roots without loss where the curvature is small.
    lead = -(line + math.copysign(math.sqrt(inside), line)) / 2
    for case in range(6):
        if case == 0:
            x = -1.0
        elif case == 1:
            x = 1.0
        elif case == 2:
            x = -slope_one / bend_one if bend_one > 0.0 else 0.0
        elif case == 3:
            x = -slope_two / bend_two if bend_two > 0.0 else 0.0
        elif case == 4:
            x = lead / curve if curve != 0.0 else 0.0
        else:
            x = level / lead if lead != 0.0 else 0.0
        x = min(1.0, max(-1.0, x))
        first = one.middle + x * (slope_one + x * bend_one / 2)
        value = max(first, two.middle + x * (slope_two + x * bend_two / 2))
        if value < least:
            least, place = value, x
    return place, least


@inlined
def _highest(of: Three) -> tuple[float, float]:
    """Where in -1..1 a parabola is highest, and how high that is."""
    slope, bend = (of.high - of.low) / 2, of.high - 2 * of.middle + of.low
    x = min(1.0, max(-1.0, -slope / bend)) if bend < 0.0 else (1.0 if slope > 0.0 else -1.0)
    return x, of.middle + x * (slope + x * bend / 2)


@inlined
def _at(walk: Walk, zone: int, rim: int, place: float, phase: int) -> float:
    """Deviation of a zone at a place and phase, mm of arc."""
    value, angle = zone_at(walk, zone, rim, place)
    return value + one_lane(walk.comb, angle, phase)


@inlined
def _narrowed(cell: Cell, x: float) -> tuple[float, float]:
    """Centre and half the width of the narrower piece of a cell around `x` of -1..1."""
    half = (cell.high - cell.low) / 2
    centre = (cell.low + cell.high) / 2 + half * x
    half *= NARROWER
    return min(cell.high - half, max(cell.low + half, centre)), half


@inlined
def _replaced(of: Three, step: int, value: float) -> Three:
    """Three values with the one that a `step` of following looks at: 1 and 3 at the ends, all others in the middle."""
    return Three(
        value if step == 1 else of.low, of.middle if step == 1 or step == 3 else value, value if step == 3 else of.high
    )


@inlined
def _follow_least(walk: Walk, cell: Cell, phase: int, one: Three, two: Three, best: float) -> float:
    """The lesser of `best` and the least driving deviation in a cell at one phase, of which both zones' values `one`
    and `two` at its ends are known."""
    centre, half = (cell.low + cell.high) / 2, (cell.high - cell.low) / 2
    # The middle first, then three places around the least of the parabolas, at last the least of theirs.
    for step in range(5):
        if step == 1 or step == 4:
            x, reached = _lowest_of_two(one, two)
            if step == 4:
                centre += half * x
            elif reached - walk.beside >= best:
                break
            else:
                centre, half = _narrowed(cell, x)
        place = centre + half * (step - 2) if 1 <= step <= 3 else centre
        a, b = _at(walk, 0, cell.one, place, phase), _at(walk, 1, cell.two, place, phase)
        best = min(best, max(a, b))
        one, two = _replaced(one, step, a), _replaced(two, step, b)
    return best


@inlined
def _follow_largest(walk: Walk, cell: Cell, phase: int, zone: int, of: Three, best: float) -> float:
    """The larger of `best` and the largest deviation of a zone in a cell at one phase, of which its values `of` at the
    ends are known."""
    centre, half = (cell.low + cell.high) / 2, (cell.high - cell.low) / 2
    rim = cell.one if zone == 0 else cell.two
    for step in range(5):
        if step == 1 or step == 4:
            x, reached = _highest(of)
            if step == 4:
                centre += half * x
            elif reached + walk.beside <= best:
                break
            else:
                centre, half = _narrowed(cell, x)
        place = centre + half * (step - 2) if 1 <= step <= 3 else centre
        value = _at(walk, zone, rim, place, phase)
        best = max(best, value)
        of = _replaced(of, step, value)
    return best


@inlined
def _least_of_lines(one_a: float, two_a: float, one_b: float, two_b: float) -> float:
    """Least of the larger of two lines between their ends."""
    least = min(max(one_a, two_a), max(one_b, two_b))
    apart_a, apart_b = one_a - two_a, one_b - two_b
    if apart_a * apart_b < 0.0:
        least = min(least, (one_a * apart_b - one_b * apart_a) / (apart_b - apart_a))
    return least


@compiled
def _least_in(walk: Walk, lanes: Array, cell: Cell, best: float) -> float:
    """The lesser of `best` and the least driving deviation in a cell; `lanes` (3, 2, P) are room."""
    one_a, two_a, one_b, two_b = lanes[0, 0], lanes[0, 1], lanes[1, 0], lanes[1, 1]
    lanes_of(walk.comb, cell.one_low, cell.on_one_low, one_a)
    lanes_of(walk.comb, cell.two_low, cell.on_two_low, two_a)
    lanes_of(walk.comb, cell.one_high, cell.on_one_high, one_b)
    lanes_of(walk.comb, cell.two_high, cell.on_two_high, two_b)
    phases = len(one_a)
    values, floors = lanes[2, 0], lanes[2, 1]
    for p in range(phases):
        a, b = one_a[p] if one_a[p] > two_a[p] else two_a[p], one_b[p] if one_b[p] > two_b[p] else two_b[p]
        one, two = one_a[p] if one_a[p] < one_b[p] else one_b[p], two_a[p] if two_a[p] < two_b[p] else two_b[p]
        values[p], floors[p] = a if a < b else b, one if one > two else two
    best = min(best, least_of(values, phases))
    for p in range(phases):
        values[p] = floors[p]
    lowest = least_of(values, phases)
    # The most promising phase first: what it finds rules others out.
    for promising in (True, False):
        if lowest - walk.margin >= best:
            return best
        for p in range(phases):
            if (floors[p] == lowest) == promising and floors[p] - walk.margin < best:
                if _least_of_lines(one_a[p], two_a[p], one_b[p], two_b[p]) - walk.margin < best:
                    one, two = Three(one_a[p], 0.0, one_b[p]), Three(two_a[p], 0.0, two_b[p])
                    best = _follow_least(walk, cell, p, one, two, best)
    return best


@compiled
def _largest_in(walk: Walk, lanes: Array, cell: Cell, best: float) -> float:
    """The larger of `best` and the largest deviation of either zone in a cell; `lanes` (3, 2, P) are room."""
    low, high, values, phases = lanes[0, 0], lanes[0, 1], lanes[1, 0], lanes.shape[2]
    for zone in range(2):
        a, b = (cell.one_low, cell.one_high) if zone == 0 else (cell.two_low, cell.two_high)
        if max(a, b) + walk.margin + walk.comb.largest <= best:
            continue
        lanes_of(walk.comb, a, cell.on_one_low if zone == 0 else cell.on_two_low, low)
        lanes_of(walk.comb, b, cell.on_one_high if zone == 0 else cell.on_two_high, high)
        for p in range(phases):
            values[p] = -(low[p] if low[p] > high[p] else high[p])
        largest = -least_of(values, phases)
        best = max(best, largest)
        for promising in (True, False):
            if largest + walk.margin <= best:
                break
            for p in range(phases):
                value = low[p] if low[p] > high[p] else high[p]
                if (value == largest) == promising and value + walk.margin > best:
                    best = _follow_largest(walk, cell, p, zone, Three(low[p], 0.0, high[p]), best)
    return best


@inlined
def _whole(grid: Array, j: int) -> Cell:
    """The whole cell after angle `j` of the `grid`."""
    i, k = j + BEFORE, j + BEFORE + 1
    return Cell(
        float(j),
        j + 1.0,
        int(grid[RIM, i]),
        int(grid[RIM + 1, i]),
        grid[VALUE, i],
        grid[VALUE + 1, i],
        grid[VALUE, k],
        grid[VALUE + 1, k],
        grid[ANGLE, i],
        grid[ANGLE + 1, i],
        grid[ANGLE, k],
        grid[ANGLE + 1, k],
    )


@compiled
def _cut(walk: Walk, cuts: Array, i: int) -> Cell:
    """A cell that a change of a rim cuts, number `i` of the `cuts`."""
    low, high, one, two = cuts[i, 0], cuts[i, 1], int(cuts[i, 2]), int(cuts[i, 3])
    one_low, on_one_low = zone_at(walk, 0, one, low)
    two_low, on_two_low = zone_at(walk, 1, two, low)
    one_high, on_one_high = zone_at(walk, 0, one, high)
    two_high, on_two_high = zone_at(walk, 1, two, high)
    return Cell(
        low,
        high,
        one,
        two,
        one_low,
        two_low,
        one_high,
        two_high,
        on_one_low,
        on_two_low,
        on_one_high,
        on_two_high,
    )


@inlined
def _floor_in(walk: Walk, cell: Cell) -> float:
    """What the driving deviation cannot fall below in a cell."""
    turned = max(abs(cell.on_two_low - cell.on_one_low - math.pi), abs(cell.on_two_high - cell.on_one_high - math.pi))
    one, two = min(cell.one_low, cell.one_high), min(cell.two_low, cell.two_high)
    return floor_of(walk.comb, one, two, turned) - walk.margin


@inlined
def _ceiling_in(walk: Walk, cell: Cell) -> float:
    """What neither zone rises above in a cell."""
    ends = max(max(cell.one_low, cell.one_high), max(cell.two_low, cell.two_high))
    return ends + walk.margin + walk.comb.largest


@compiled
def _cut_cells(work: Work, count: int) -> int:
    """Fill `cuts` of `work` with the cells that its `count` changes of rims cut, and take these out of the whole ones;
    their number."""
    grid, changes, cuts = work.grid, work.changes, work.cuts
    m, found = grid.shape[1] - WRAPPED, 0
    for i in range(count):
        low, high = changes[i], changes[i + 1]
        real, one, two = rims_between(grid, low, high)
        for j in range(math.floor(low), math.ceil(high)):
            on = (j if j < m else j - m) + BEFORE
            whole = low <= j and j + 1 <= high and grid[RIM, on] == one and grid[RIM + 1, on] == two
            if not (whole and grid[RIM, on + 1] == one and grid[RIM + 1, on + 1] == two):
                grid[FLOOR, on], grid[CEILING, on] = math.inf, -math.inf
                if real:
                    cuts[found, 0], cuts[found, 1] = max(low, float(j)), min(high, j + 1.0)
                    cuts[found, 2], cuts[found, 3] = one, two
                    found += 1
    return found


@compiled
def _promising(grid: Array) -> tuple[int, int]:
    """The whole cells with the least floor and the largest ceiling."""
    m, lowest, highest = grid.shape[1] - WRAPPED, 0, 0
    floor, ceiling = math.inf, -math.inf
    for j in range(m):
        if grid[FLOOR, j + BEFORE] < floor:
            lowest, floor = j, grid[FLOOR, j + BEFORE]
        if grid[CEILING, j + BEFORE] > ceiling:
            highest, ceiling = j, grid[CEILING, j + BEFORE]
    return lowest, highest


@compiled
def extremes_in_lanes(walk: Walk, work: Work) -> tuple[float, float]:
    """Essential infimum and supremum of max(tau_1, tau_2) of a `walk` over one full relative turn, mm of arc.

    Jia 2021, Eqs. (31), (32). `work` of `new_work` is room for it.
    """
    grid, lanes = work.grid, work.lanes
    fill_grid(walk, grid)
    changes = fill_changes(grid, work.changes)
    fill_bounds(walk, grid)
    cut = _cut_cells(work, changes)
    lowest, highest = _promising(grid)
    cell = _whole(grid, lowest)
    least, largest = _least_in(walk, lanes, cell, math.inf), -math.inf
    largest = _largest_in(walk, lanes, _whole(grid, highest), largest)
    for i in range(cut):
        cell = _cut(walk, work.cuts, i)
        if _floor_in(walk, cell) < least:
            least = _least_in(walk, lanes, cell, least)
        if _ceiling_in(walk, cell) > largest:
            largest = _largest_in(walk, lanes, cell, largest)
    for j in range(grid.shape[1] - WRAPPED):
        if grid[FLOOR, j + BEFORE] < least and j != lowest:
            least = _least_in(walk, lanes, _whole(grid, j), least)
        if grid[CEILING, j + BEFORE] > largest and j != highest:
            largest = _largest_in(walk, lanes, _whole(grid, j), largest)
    return least, largest
