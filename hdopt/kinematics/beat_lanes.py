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
from hdopt.kinematics.beat_bounds import CEILING, CLEAR, CREST, DIP, FLOOR, fill_cells, fill_nodes, least_single
from hdopt.kinematics.beat_grid import (
    Walk,
    Work,
    deeper_rim,
    fill_changes,
    fill_gaps,
    node_at,
    rims_between,
    zone_at,
)
from hdopt.kinematics.beat_tables import BEFORE, WRAPPED, Comb, compiled, inlined, lanes_of, one_lane, widened
from hdopt.kinematics.lanes.single import HUGE, ZERO, narrowed, single

EPSILON = single(2.0**-23)
FAR = single(1e6)
"""mm: further than any deviation."""
NARROWER = 0.125
"""Width of the second pair of parabolas as a share of the first."""


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
def _first_of(values: Singles, value: float) -> int:
    """The place of the first of `values` that is `value`."""
    place = len(values)
    for p in range(len(values)):
        at = p if values[p] == value else len(values)
        place = at if at < place else place
    return place


@inlined
def _below(values: Singles, limit: float) -> int:
    """How many of `values` may be below a `limit`, which is rounded upward."""
    count, at = 0, narrowed(limit) + narrowed(abs(limit)) * EPSILON
    for p in range(len(values)):
        count += 1 if values[p] < at else 0
    return count


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
        best = _follow_least(walk, cell, p, Three(one_a, 0.0, one_b), Three(two_a, 0.0, two_b), best)
    return best


@compiled
def _least_in(walk: Walk, lanes: Singles, cell: Cell, best: float) -> float:
    """The lesser of `best` and the least driving deviation in a cell; `lanes` (3, 2, P) are room."""
    one_a, two_a, one_b, two_b = lanes[0, 0], lanes[0, 1], lanes[1, 0], lanes[1, 1]
    lanes_of(walk.comb, cell.one_low, cell.on_one_low, one_a)
    lanes_of(walk.comb, cell.two_low, cell.on_two_low, two_a)
    lanes_of(walk.comb, cell.one_high, cell.on_one_high, one_b)
    lanes_of(walk.comb, cell.two_high, cell.on_two_high, two_b)
    phases = len(one_a)
    values, floors = lanes[2, 0], lanes[2, 1]
    for p in range(phases):
        one, two = one_a[p] if one_a[p] < one_b[p] else one_b[p], two_a[p] if two_a[p] < two_b[p] else two_b[p]
        floor = one if one > two else two
        values[p], floors[p] = floor, floor
    lowest = least_single(values, phases)
    if lowest - cell.margin >= best:
        return best
    # The most promising phase first: what it finds rules others out.
    promising = _first_of(floors, lowest)
    best = _follow_lane(walk, lanes, cell, promising, best)
    floors[promising] = HUGE
    if _differ(walk.comb) and _below(floors, best + cell.margin) > 0:
        for p in range(phases):
            if floors[p] - cell.margin < best:
                best = _follow_lane(walk, lanes, cell, p, best)
    return best


@inlined
def _ends(low: Singles, high: Singles, p: int) -> Three:
    """The values of phase `p` at the ends of a cell."""
    return Three(widened(low[p]), 0.0, widened(high[p]))


@compiled
def _largest_in(walk: Walk, lanes: Singles, cell: Cell, best: float) -> float:
    """The larger of `best` and the largest deviation of either zone in a cell; `lanes` (3, 2, P) are room."""
    low, high, values, floors = lanes[0, 0], lanes[0, 1], lanes[1, 0], lanes[1, 1]
    phases = len(low)
    second = max(cell.two_low, cell.two_high) > max(cell.one_low, cell.one_high)
    for turn in range(2):
        zone = 1 - turn if second else turn
        a, b = (cell.one_low, cell.one_high) if zone == 0 else (cell.two_low, cell.two_high)
        if max(a, b) + cell.margin + walk.comb.largest <= best:
            continue
        lanes_of(walk.comb, a, cell.on_one_low if zone == 0 else cell.on_two_low, low)
        lanes_of(walk.comb, b, cell.on_one_high if zone == 0 else cell.on_two_high, high)
        for p in range(phases):
            floor = -(low[p] if low[p] > high[p] else high[p])
            values[p], floors[p] = floor, floor
        lowest = least_single(values, phases)
        if cell.margin - lowest <= best:
            continue
        promising = _first_of(floors, lowest)
        best = _follow_largest(walk, cell, promising, zone, _ends(low, high, promising), best)
        floors[promising] = HUGE
        if _differ(walk.comb) and _below(floors, cell.margin - best) > 0:
            for p in range(phases):
                if cell.margin - floors[p] > best:
                    best = _follow_largest(walk, cell, p, zone, _ends(low, high, p), best)
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
def _where_rims_change(
    walk: Walk, work: Work, least: float, largest: float, lowest: int, highest: int
) -> tuple[float, float]:
    """The lesser of `least` and the greater of `largest` and what lies in the cells in which rims may change, or in
    cells `lowest` and `highest` of them where these are not 0."""
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
            if cells[CLEAR, i] > ZERO or not (below or above) or (lowest > 0 and i != lowest and i != highest):
                continue
            cell = _cut(walk, max(low, float(j)), min(high, j + 1.0), one, two)
            if below:
                least = _least_in(walk, work.lanes, cell, least)
            if above:
                largest = _largest_in(walk, work.lanes, cell, largest)
    return least, largest


@compiled
def _promising(cells: Singles) -> tuple[int, int]:
    """The numbers of the `cells` with the least floor and the largest ceiling of those in which no rim changes, or else
    of all."""
    end = cells.shape[1] - WRAPPED + BEFORE
    lowest = highest = BEFORE
    floor, ceiling = HUGE, -HUGE
    for i in range(BEFORE, end):
        barred = ZERO if cells[CLEAR, i] > ZERO else FAR
        here = cells[FLOOR, i] + barred
        if here < floor:
            lowest, floor = i, here
        here = cells[CEILING, i] - barred
        if here > ceiling:
            highest, ceiling = i, here
    return lowest, highest


@compiled
def extremes_in_lanes(walk: Walk, work: Work) -> tuple[float, float]:
    """Essential infimum and supremum of max(tau_1, tau_2) of a `walk` over one full relative turn, mm of arc.

    Jia 2021, Eqs. (31), (32). `work` of `new_work` is room for it.
    """
    cells, lanes = work.cells, work.lanes
    fill_nodes(walk.branches, walk.tan_alpha, walk.circular, work.nodes)
    fill_cells(walk.circular, walk.comb, walk.slack, work.nodes, cells, work.places)
    lowest, highest = _promising(cells)
    least, largest = math.inf, -math.inf
    if cells[CLEAR, lowest] > ZERO:
        least = _least_in(walk, lanes, _whole(walk, lowest), least)
        largest = _largest_in(walk, lanes, _whole(walk, highest), largest)
    else:
        least, largest = _where_rims_change(walk, work, least, largest, lowest, highest)
    may_change = False
    for i in range(BEFORE, cells.shape[1] - WRAPPED + BEFORE):
        below, above = cells[FLOOR, i] < least, cells[CEILING, i] > largest
        if below or above:
            if cells[CLEAR, i] > ZERO:
                if below and i != lowest:
                    least = _least_in(walk, lanes, _whole(walk, i), least)
                if above and i != highest:
                    largest = _largest_in(walk, lanes, _whole(walk, i), largest)
            else:
                may_change = True
    if may_change:
        least, largest = _where_rims_change(walk, work, least, largest, 0, 0)
    return least, largest
