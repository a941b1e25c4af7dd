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

from hdopt.arrays import Singles
from hdopt.kinematics.beat_bounds import CEILING, CLEAR, CREST, DIP, FLOOR, ROOM, fill_cells, fill_nodes
from hdopt.kinematics.beat_grid import (
    Walk,
    Work,
    deeper_rim,
    fill_changes,
    fill_gaps,
    node_at,
    rims_between,
    zone_along,
    zone_at,
)
from hdopt.kinematics.beat_tables import (
    BEFORE,
    WRAPPED,
    Comb,
    along_lane,
    compiled,
    first_least,
    inlined,
    lanes_of,
    one_lane,
    widened,
)
from hdopt.kinematics.lanes.single import HUGE, ZERO

NEAR = 0.125
"""How far from where a slope was taken it is followed, in halves of a cell."""
LOOKS = 8
"""How often at most a slope is followed."""
FINE = 1e-9
"""mm: gain for which it is not."""


class Cell(NamedTuple):
    """What lies between two places, `low` and `high`, on rim `one` of the first zone and `two` of the second; at both
    places each zone's deviation without the FS teeth, mm, and angle on the FS, rad; and how far either zone may lie off
    its chord, mm."""

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
    margin: float


class Found(NamedTuple):
    """Where something is lowest or highest, and how low or high it is there."""

    place: float
    value: float


class Parabola(NamedTuple):
    """A zone around a place: its value (mm of arc), slope and bend there, over halves of a cell."""

    value: float
    slope: float
    bend: float


@inlined
def _through(low: float, middle: float, high: float) -> Parabola:
    """The parabola through the ends of a cell and its middle, around that."""
    return Parabola(middle, (high - low) / 2, high - 2 * middle + low)


@inlined
def _reached(of: Parabola, x: float) -> float:
    """The value of a parabola at `x` from its place."""
    return of.value + x * (of.slope + x * of.bend / 2)


@inlined
def _lower_of(one: Parabola, two: Parabola, x: float, low: float, high: float, found: Found) -> Found:
    """The lower of what was `found` and the larger of two parabolas at `x`, kept between `low` and `high`."""
    x = min(high, max(low, x))
    value = max(_reached(one, x), _reached(two, x))
    return Found(x if value < found.value else found.place, min(value, found.value))


@inlined
def _lowest_of_two(one: Parabola, two: Parabola, low: float, high: float) -> Found:
    """Where from `low` to `high` the larger of two parabolas is lowest, an end, a vertex, or where they cross."""
    curve, line, level = (one.bend - two.bend) / 2, one.slope - two.slope, one.value - two.value
    inside = max(line * line - 4 * curve * level, 0.0)
    # The two roots without loss where the curvature is small.
    lead = -(line + math.copysign(math.sqrt(inside), line)) / 2
    found = _lower_of(one, two, low, low, high, Found(0.0, math.inf))
    found = _lower_of(one, two, high, low, high, found)
    found = _lower_of(one, two, -one.slope / one.bend if one.bend > 0.0 else 0.0, low, high, found)
    found = _lower_of(one, two, -two.slope / two.bend if two.bend > 0.0 else 0.0, low, high, found)
    found = _lower_of(one, two, lead / curve if curve != 0.0 else 0.0, low, high, found)
    return _lower_of(one, two, level / lead if lead != 0.0 else 0.0, low, high, found)


@inlined
def _highest(of: Parabola, low: float, high: float) -> Found:
    """Where from `low` to `high` a parabola is highest."""
    x = -of.slope / of.bend if of.bend < 0.0 else (high if of.slope > 0.0 else low)
    x = min(high, max(low, x))
    return Found(x, _reached(of, x))


@inlined
def _at(walk: Walk, zone: int, rim: int, place: float, phase: int) -> float:
    """Deviation of a zone at a place and phase, mm of arc."""
    value, angle = zone_at(walk, zone, rim, place)
    return value + one_lane(walk.comb, angle, phase)


@inlined
def _along(walk: Walk, zone: int, rim: int, place: float, phase: int, half: float, bend: float) -> Parabola:
    """A zone around a place and at a phase, with its slope over `half` a cell; it bends as given."""
    value, angle, slope, turns = zone_along(walk, zone, rim, place)
    on_fs, rises = along_lane(walk.comb, angle, phase)
    return Parabola(value + on_fs, half * (slope + rises * turns), bend)


@inlined
def _follow_least(
    walk: Walk, cell: Cell, phase: int, one: tuple[float, float], two: tuple[float, float], best: float
) -> float:
    """The lesser of `best` and the least driving deviation in a cell at one phase, of which both zones' values at its
    ends are known, `one` and `two`: parabolas through the middle say where to look, from there on slopes."""
    centre, half = (cell.low + cell.high) / 2, (cell.high - cell.low) / 2
    a, b = _at(walk, 0, cell.one, centre, phase), _at(walk, 1, cell.two, centre, phase)
    best = min(best, max(a, b))
    first, second = _through(one[0], a, one[1]), _through(two[0], b, two[1])
    x, reached = _lowest_of_two(first, second, -1.0, 1.0)
    if reached - walk.beside >= best:
        return best
    for _ in range(LOOKS):
        place = centre + half * x
        first = _along(walk, 0, cell.one, place, phase, half, first.bend)
        second = _along(walk, 1, cell.two, place, phase, half, second.bend)
        here = max(first.value, second.value)
        best = min(best, here)
        step, reached = _lowest_of_two(first, second, max(-NEAR, -1.0 - x), min(NEAR, 1.0 - x))
        if here - reached < FINE:
            break
        x += step
    return best


@inlined
def _follow_largest(walk: Walk, cell: Cell, phase: int, zone: int, ends: tuple[float, float], best: float) -> float:
    """The larger of `best` and the largest deviation of a zone in a cell at one phase, of which its values at the
    `ends` are known."""
    centre, half = (cell.low + cell.high) / 2, (cell.high - cell.low) / 2
    rim = cell.one if zone == 0 else cell.two
    middle = _at(walk, zone, rim, centre, phase)
    best = max(best, middle)
    of = _through(ends[0], middle, ends[1])
    x, reached = _highest(of, -1.0, 1.0)
    if reached + walk.beside <= best:
        return best
    for _ in range(LOOKS):
        of = _along(walk, zone, rim, centre + half * x, phase, half, of.bend)
        best = max(best, of.value)
        step, reached = _highest(of, max(-NEAR, -1.0 - x), min(NEAR, 1.0 - x))
        if reached - of.value < FINE:
            break
        x += step
    return best


@inlined
def _least_of_lines(one_a: float, two_a: float, one_b: float, two_b: float) -> float:
    """Least of the larger of two lines between their ends."""
    least = min(max(one_a, two_a), max(one_b, two_b))
    apart_a, apart_b = one_a - two_a, one_b - two_b
    if apart_a * apart_b < 0.0:
        least = min(least, (one_a * apart_b - one_b * apart_a) / (apart_b - apart_a))
    return least


@inlined
def _differ(comb: Comb) -> bool:
    """Whether phases differ at all: where the FS has no deviation, one says it for all."""
    return comb.largest > comb.least


@inlined
def _follow_lane(walk: Walk, lanes: Singles, cell: Cell, p: int, best: float) -> float:
    """The lesser of `best` and the least driving deviation in a cell at phase `p`, of which `lanes` hold the ends."""
    one_a, two_a = widened(lanes[0, 0, p]), widened(lanes[0, 1, p])
    one_b, two_b = widened(lanes[1, 0, p]), widened(lanes[1, 1, p])
    if _least_of_lines(one_a, two_a, one_b, two_b) - cell.margin < best:
        best = _follow_least(walk, cell, p, (one_a, one_b), (two_a, two_b), best)
    return best


@compiled
def _least_in(walk: Walk, work: Work, cell: Cell, best: float) -> float:
    """The lesser of `best` and the least driving deviation in a cell; the lanes of `work` are room."""
    lanes, bits = work.lanes, work.lane_bits[2, 0]
    one_a, two_a, one_b, two_b, floors = lanes[0, 0], lanes[0, 1], lanes[1, 0], lanes[1, 1], lanes[2, 0]
    lanes_of(walk.comb, cell.one_low, cell.on_one_low, one_a)
    lanes_of(walk.comb, cell.two_low, cell.on_two_low, two_a)
    lanes_of(walk.comb, cell.one_high, cell.on_one_high, one_b)
    lanes_of(walk.comb, cell.two_high, cell.on_two_high, two_b)
    for p in range(len(one_a)):
        one, two = one_a[p] if one_a[p] < one_b[p] else one_b[p], two_a[p] if two_a[p] < two_b[p] else two_b[p]
        floors[p] = one if one > two else two
    # The most promising phase first: what it finds rules others out.
    while True:
        p = first_least(bits)
        if floors[p] - cell.margin >= best:
            return best
        best = _follow_lane(walk, lanes, cell, p, best)
        if not _differ(walk.comb):
            return best
        floors[p] = HUGE


@compiled
def _largest_in(walk: Walk, work: Work, cell: Cell, best: float) -> float:
    """The larger of `best` and the largest deviation of either zone in a cell; the lanes of `work` are room."""
    lanes, bits = work.lanes, work.lane_bits[2, 0]
    low, high, floors = lanes[0, 0], lanes[0, 1], lanes[2, 0]
    second = max(cell.two_low, cell.two_high) > max(cell.one_low, cell.one_high)
    for turn in range(2):
        zone = 1 - turn if second else turn
        a, b = (cell.one_low, cell.one_high) if zone == 0 else (cell.two_low, cell.two_high)
        if max(a, b) + cell.margin + walk.comb.largest <= best:
            continue
        lanes_of(walk.comb, a, cell.on_one_low if zone == 0 else cell.on_two_low, low)
        lanes_of(walk.comb, b, cell.on_one_high if zone == 0 else cell.on_two_high, high)
        for p in range(len(low)):
            floors[p] = -(low[p] if low[p] > high[p] else high[p])
        while True:
            p = first_least(bits)
            if cell.margin - floors[p] <= best:
                break
            best = _follow_largest(walk, cell, p, zone, (widened(low[p]), widened(high[p])), best)
            if not _differ(walk.comb):
                break
            floors[p] = HUGE
    return best


@inlined
def _whole(walk: Walk, i: int) -> Cell:
    """The whole cell after angle number `i` of the wrapped branches, in which no rim changes."""
    one, two = deeper_rim(walk.branches, 0, i), deeper_rim(walk.branches, 1, i)
    one_low, on_one_low = node_at(walk, 0, one, i)
    two_low, on_two_low = node_at(walk, 1, two, i)
    one_high, on_one_high = node_at(walk, 0, one, i + 1)
    two_high, on_two_high = node_at(walk, 1, two, i + 1)
    values, angles = (one_low, two_low, one_high, two_high), (on_one_low, on_two_low, on_one_high, on_two_high)
    rows, slack = walk.circular.rows, walk.slack
    dip, crest = max(rows[DIP, 0, i], rows[DIP, 1, i]), max(rows[CREST, 0, i], rows[CREST, 1, i])
    margin = slack.bulge + slack.fs_bulge + slack.rounding + max(dip, crest)
    return Cell(i - float(BEFORE), i + 1.0 - BEFORE, one, two, *values, *angles, margin)


@inlined
def _cut(walk: Walk, low: float, high: float, one: int, two: int) -> Cell:
    """A cell from `low` to `high` on the rims `one` and `two`, which a change of a rim may cut."""
    one_low, on_one_low = zone_at(walk, 0, one, low)
    two_low, on_two_low = zone_at(walk, 1, two, low)
    one_high, on_one_high = zone_at(walk, 0, one, high)
    two_high, on_two_high = zone_at(walk, 1, two, high)
    values, angles = (one_low, two_low, one_high, two_high), (on_one_low, on_two_low, on_one_high, on_two_high)
    return Cell(low, high, one, two, *values, *angles, walk.margin)


@compiled
def _where_rims_change(walk: Walk, work: Work, least: float, largest: float) -> tuple[float, float]:
    """The lesser of `least` and the greater of `largest` and what lies in the cells in which rims may change."""
    cells, m = work.cells, work.cells.shape[1] - WRAPPED
    fill_gaps(walk.branches, work.grid)
    for stretch in range(fill_changes(work.grid, work.changes)):
        low, high = work.changes[stretch], work.changes[stretch + 1]
        real, one, two = rims_between(work.grid, low, high)
        if not real:
            continue
        for j in range(math.floor(low), math.ceil(high)):
            i = (j if j < m else j - m) + BEFORE
            below, above = cells[FLOOR, i] < least, cells[CEILING, i] > largest
            if cells[CLEAR, i] > ZERO or not (below or above):
                continue
            cell = _cut(walk, max(low, float(j)), min(high, j + 1.0), one, two)
            if below:
                least = _least_in(walk, work, cell, least)
            if above:
                largest = _largest_in(walk, work, cell, largest)
    return least, largest


@compiled
def _fill_order(cells: Singles) -> None:
    """Fill the room of the `cells` with what they reach at least, and less what they reach at most, where no rim can
    change: by these they are looked at."""
    low, high, clear, floor, ceiling = cells[ROOM], cells[ROOM + 1], cells[CLEAR], cells[FLOOR], cells[CEILING]
    for i in range(cells.shape[1] - WRAPPED + BEFORE):
        ok, at_least, at_most = clear[i] > ZERO, floor[i], -ceiling[i]
        low[i], high[i] = at_least if ok else HUGE, at_most if ok else HUGE


@compiled
def _may_matter(cells: Singles, least: float, largest: float) -> bool:
    """Whether any of the `cells` in which rims may change reaches below `least` or above `largest`."""
    clear, floor, ceiling, count = cells[CLEAR], cells[FLOOR], cells[CEILING], 0
    for i in range(BEFORE, cells.shape[1] - WRAPPED + BEFORE):
        beyond = (widened(floor[i]) < least) | (widened(ceiling[i]) > largest)
        count += 1 if (clear[i] <= ZERO) & beyond else 0
    return count > 0


@compiled
def extremes_in_lanes(walk: Walk, work: Work) -> tuple[float, float]:
    """Essential infimum and supremum of max(tau_1, tau_2) of a `walk` over one full relative turn, mm of arc.

    Jia 2021, Eqs. (31), (32). `work` of `new_work` is room for it.
    """
    cells, bits = work.cells, work.cell_bits
    end = cells.shape[1] - WRAPPED + BEFORE
    fill_nodes(walk.branches, walk.tan_alpha, walk.circular, work.nodes)
    fill_cells(walk.circular, walk.comb, walk.slack, work.nodes, cells, work.places)
    _fill_order(cells)
    least, largest = math.inf, -math.inf
    # The most promising cell first: what it holds rules others out.
    while True:
        i = first_least(bits[ROOM, BEFORE:end]) + BEFORE
        if cells[ROOM, i] >= min(least, HUGE):
            break
        least = _least_in(walk, work, _whole(walk, i), least)
        cells[ROOM, i] = HUGE
    while True:
        i = first_least(bits[ROOM + 1, BEFORE:end]) + BEFORE
        if cells[ROOM + 1, i] >= min(-largest, HUGE):
            break
        largest = _largest_in(walk, work, _whole(walk, i), largest)
        cells[ROOM + 1, i] = HUGE
    if _may_matter(cells, least, largest):
        least, largest = _where_rims_change(walk, work, least, largest)
    return least, largest
