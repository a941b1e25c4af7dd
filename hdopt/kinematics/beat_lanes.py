"""Essential extremes of the driving deviation over the full beat of measured teeth, all FS phases in lanes.

The same extremes as `hdopt.kinematics.essential`, some hundred times faster, for stacks and searches. Over a beat every
input angle meets the FS teeth in P phases, which lie whole table places apart: with the FS table written as a comb of P
columns, one angle's P deviations of a zone are four rows of it, weighed and added, which the processor does in lanes.
Most angles never come that far. From the least and largest value of the FS table, and the least sum of two places half
a turn apart, follow bounds of what a cell between two angles can reach; only cells that could hold an extreme are
looked at. There each phase that can win is followed by parabolas of both zones to the extreme between the two angles.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from hdopt.arrays import Array, Index, Mask
from hdopt.kinematics.branches import TIE_MM
from hdopt.kinematics.essential import _least_of_lines, _rims_between, _stretches

# Least and largest do not depend on the order in which lanes are taken; sums keep theirs.
compiled = njit(error_model="numpy", fastmath={"contract", "nsz", "nnan", "arcp"})

PER_RAD = 1 / (2 * math.pi)
"""Turns in a radian."""

SAFETY = 1.25
"""How many times the largest second difference of the parts a cell is allowed to bend."""
TINY = 1e-12
"""mm: what keeps the differences of a table of zeros apart."""
FLOORS = 256
"""Differences of both zones for which the floor of the driving deviation is tabulated."""
NARROWER = 0.125
"""Width of the second pair of parabolas as a share of the first."""


class Comb(NamedTuple):
    """The FS table as `rows` (n/P, 2 P): place i of the table stands in row i mod n/P, column i // (n/P), the columns
    twice. Its least and largest value, its steepest slope (1/rad) and its largest second difference over a grid angle;
    mm of arc. `floor` (K,) is the least over all places x of max(F(x) + D/2, F(x + pi) - D/2), for differences D of
    both zones from `-reach` to `reach` mm: below it the driving deviation cannot fall."""

    rows: Array
    floor: Array
    reach: float
    least: float
    largest: float
    slope: float
    bend: float


class Walk(NamedTuple):
    """What one drive's beat is walked with: branches on an even grid of m angles, each (2, 2, m) for zone and rim,
    depth in mm and offsets in rad; the CS table over one turn (mm of arc); tan of the pressure angle times the share of
    misalignment, Z_CS/Z_FS, the FS comb, and how far all but the FS term bends over a grid angle, mm."""

    depth: Array
    offset_cs: Array
    offset_fs: Array
    cs_table: Array
    tan_alpha: float
    advance: float
    comb: Comb
    bend: float


class Nodes(NamedTuple):
    """Grid angles and ends of stretches in order: the place in cells, both zones' deviation without the FS teeth (mm)
    and angle on the FS (rad), what the driving deviation cannot fall below there (mm), both rims; whether a cell
    follows (`joined`)."""

    place: Array
    value: Array
    angle: Array
    floor: Array
    rims: Index
    joined: Mask


@compiled
def new_nodes(grid: int) -> Nodes:
    """Work space for the nodes of a turn of so many `grid` angles: as many as every rim could change at each."""
    room = 10 * grid + 16
    return Nodes(
        np.empty(room),
        np.empty((room, 2)),
        np.empty((room, 2)),
        np.empty(room),
        np.zeros((room, 2), np.int64),
        np.zeros(room, np.bool_),
    )


@compiled
def second_difference(table: Array, stride: int) -> float:
    """Largest second difference of a periodic `table` over so many of its places (`stride`), in its unit."""
    n, found = len(table), 0.0
    for i in range(n - stride):
        found = max(found, abs(table[i - stride] - 2 * table[i] + table[i + stride]))
    for i in range(n - stride, n):
        found = max(found, abs(table[i - stride] - 2 * table[i] + table[i + stride - n]))
    return found


@compiled
def _fill_floor(table: Array, reach: float, floor: Array) -> None:
    """Fill `floor` (K,) of `Comb`: every place makes a V over D with its lowest point where both zones are equal."""
    n, last = len(table), len(floor) - 1
    step = 2 * reach / last
    floor[:] = math.inf
    half, odd = n // 2, n % 2
    for i in range(n):
        one = table[i]
        j = i + half if i + half < n else i + half - n
        two = table[j]
        if odd:
            two = (two + table[j + 1 if j + 1 < n else 0]) / 2
        k = int((two - one + reach) / step)
        for node in (k, k + 1):
            apart = node * step - reach
            floor[node] = min(floor[node], max(one + apart / 2, two - apart / 2))
    for k in range(1, last + 1):
        floor[k] = min(floor[k], floor[k - 1] + step / 2)
    for k in range(last - 1, -1, -1):
        floor[k] = min(floor[k], floor[k + 1] + step / 2)


@compiled
def fill_comb(table: Array, phases: int, stride: int, rows: Array, floor: Array) -> Comb:
    """`Comb` of a periodic `table` (n,), n a multiple of `phases`, into `rows` (n/phases, 2 phases) and `floor` (K,);
    `stride` is a grid angle in places of the table."""
    n = len(table)
    apart = n // phases
    least, largest, slope = math.inf, -math.inf, 0.0
    for column in range(phases):
        for row in range(apart):
            value = table[column * apart + row]
            rows[row, column], rows[row, column + phases] = value, value
    for i in range(n):
        least, largest = min(least, table[i]), max(largest, table[i])
        slope = max(slope, abs(table[i] - table[i - 1]))
    reach = 1.01 * (largest - least) + TINY
    _fill_floor(table, reach, floor)
    return Comb(rows, floor, reach, least, largest, slope * n * PER_RAD, second_difference(table, stride))


class Four(NamedTuple):
    """Four neighbours on an even periodic grid, and their weights in the cubic through them."""

    a: int
    b: int
    c: int
    d: int
    w_a: float
    w_b: float
    w_c: float
    w_d: float


@compiled
def _four(place: float, n: int) -> Four:
    """`Four` at a `place` in cells of a grid of `n`; the place may lie a few turns off."""
    while place < 0.0:
        place += n
    while place >= n:
        place -= n
    j = int(place)
    x = place - j
    a = j - 1 if j > 0 else n - 1
    c = j + 1 if j + 1 < n else 0
    d = c + 1 if c + 1 < n else 0
    # Products in pairs: -x (x - 1) (x - 2)/6 and so on.
    below, above = x * (x - 1), (x + 1) * (x - 2)
    return Four(a, j, c, d, -below * (x - 2) / 6, (x - 1) * above / 2, -x * above / 2, (x + 1) * below / 6)


@compiled
def _by_four(values: Array, at: Four) -> float:
    return float(at.w_a * values[at.a] + at.w_b * values[at.b] + at.w_c * values[at.c] + at.w_d * values[at.d])


@compiled
def _branch_by_four(values: Array, zone: int, k: int, at: Four) -> float:
    """The same of one branch of `values` (2, 2, m); taking a view of it would cost more than the sum."""
    low = at.w_a * values[zone, k, at.a] + at.w_b * values[zone, k, at.b]
    return float(low + at.w_c * values[zone, k, at.c] + at.w_d * values[zone, k, at.d])


@compiled
def _zone_at(walk: Walk, zone: int, k: int, place: float) -> tuple[float, float]:
    """Deviation of a zone without FS teeth (mm) and its angle on the FS (rad), with its rim `k`, at a place."""
    m, n_cs = walk.depth.shape[2], len(walk.cs_table)
    at, theta = _four(place, m), place * (2 * math.pi / m)
    s, away = 1.0 - 2.0 * zone, math.pi * zone
    on_cs = theta + s * _branch_by_four(walk.offset_cs, zone, k, at) + away
    on_table = _by_four(walk.cs_table, _four(on_cs * (PER_RAD * n_cs), n_cs))
    angle = walk.advance * theta + s * _branch_by_four(walk.offset_fs, zone, k, at) + away
    return walk.tan_alpha * _branch_by_four(walk.depth, zone, k, at) + on_table, angle


@compiled
def _fill_grid(walk: Walk, zone: int, grid: Array, grid_rims: Index) -> None:
    """Fill `grid` (2, m) with the same of a zone's deeper rims at the grid angles, and `grid_rims` (m,) with those."""
    depth, offset_cs, offset_fs, table = walk.depth, walk.offset_cs, walk.offset_fs, walk.cs_table
    m, n_cs, tan_alpha, advance = depth.shape[2], len(table), walk.tan_alpha, walk.advance
    s, away, step, places = 1.0 - 2.0 * zone, math.pi * zone, 2 * math.pi / m, PER_RAD * n_cs
    for j in range(m):
        k = 0 if depth[zone, 0, j] >= depth[zone, 1, j] - TIE_MM else 1
        theta = j * step
        at = _four((theta + s * offset_cs[zone, k, j] + away) * places, n_cs)
        grid_rims[j] = k
        grid[0, j] = tan_alpha * depth[zone, k, j] + _by_four(table, at)
        grid[1, j] = advance * theta + s * offset_fs[zone, k, j] + away


@compiled
def _fill_nodes(walk: Walk, nodes: Nodes) -> int:
    """Fill `nodes` with every stretch between changes of a deepest rim; their number."""
    m = walk.depth.shape[2]
    gaps = walk.depth[:, 0] - walk.depth[:, 1]
    marks = _stretches(gaps)
    grid, grid_rims = np.empty((2, 2, m)), np.empty((2, m), np.int64)
    for zone in range(2):
        _fill_grid(walk, zone, grid[zone], grid_rims[zone])
    turn = 2 * math.pi * walk.advance
    rims = np.zeros(2, np.int64)
    count = 0
    for i in range(len(marks) - 1):
        low, high = marks[i], marks[i + 1]
        if not _rims_between(gaps, low, high, rims):
            continue
        first, last = math.floor(low) + 1, math.ceil(high)
        for j in range(first - 1, last + 1):
            place = low if j < first else high if j == last else float(j)
            nodes.place[count], nodes.joined[count] = place, j < last
            on_grid, again = j if j < m else j - m, turn if j >= m else 0.0
            for zone in range(2):
                k = rims[zone]
                if first <= j < last and grid_rims[zone, on_grid] == k:
                    value, angle = grid[zone, 0, on_grid], grid[zone, 1, on_grid] + again
                else:
                    value, angle = _zone_at(walk, zone, k, place)
                nodes.rims[count, zone], nodes.value[count, zone], nodes.angle[count, zone] = k, value, angle
            count += 1
    return count


@compiled
def _row(rows: Array, place: int, phases: int) -> Array:
    """A place of the FS table at all phases."""
    column = place // len(rows)
    return rows[place - column * len(rows), column : column + phases]


@compiled
def _lanes(rows: Array, value: float, angle: float, out: Array) -> None:
    """Fill `out` (P,) with a zone's deviation at every FS phase, mm of arc; `rows` of the comb."""
    phases = rows.shape[1] // 2
    n = len(rows) * phases
    at = _four(angle * (PER_RAD * n), n)
    row_a, row_b = _row(rows, at.a, phases), _row(rows, at.b, phases)
    row_c, row_d = _row(rows, at.c, phases), _row(rows, at.d, phases)
    for p in range(phases):
        out[p] = value + (at.w_a * row_a[p] + at.w_b * row_b[p] + at.w_c * row_c[p] + at.w_d * row_d[p])


@compiled
def _one_lane(comb: Comb, angle: float, phase: int) -> float:
    """The FS term at one phase, mm of arc."""
    apart, phases = comb.rows.shape[0], comb.rows.shape[1] // 2
    n = apart * phases
    at = _four(angle * (PER_RAD * n) + phase * apart, n)
    a, b, c, d = at.a // apart, at.b // apart, at.c // apart, at.d // apart
    low = at.w_a * comb.rows[at.a - a * apart, a] + at.w_b * comb.rows[at.b - b * apart, b]
    return float(low + at.w_c * comb.rows[at.c - c * apart, c] + at.w_d * comb.rows[at.d - d * apart, d])


@compiled
def _parabola(low: float, middle: float, high: float) -> tuple[float, float]:
    """Slope and curvature at the middle of three values at -1, 0, 1."""
    return (high - low) / 2, high - 2 * middle + low


@compiled
def _lowest_of_two(
    one: float, slope_one: float, bend_one: float, two: float, slope_two: float, bend_two: float
) -> float:
    """Where in -1..1 the larger of two parabolas is lowest: an end, a vertex, or where they cross."""
    best, place = math.inf, 0.0
    curve, line, level = (bend_one - bend_two) / 2, slope_one - slope_two, one - two
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
        value = max(one + x * (slope_one + x * bend_one / 2), two + x * (slope_two + x * bend_two / 2))
        if value < best:
            best, place = value, x
    return place


@compiled
def _best_place(work: Array, zone: int) -> float:
    """Where in -1..1 the parabolas through `work` (2, 3) are extreme: the larger of both lowest (`zone` < 0), or one
    zone's highest."""
    slope_one, bend_one = _parabola(work[0, 0], work[0, 1], work[0, 2])
    slope_two, bend_two = _parabola(work[1, 0], work[1, 1], work[1, 2])
    if zone < 0:
        return _lowest_of_two(work[0, 1], slope_one, bend_one, work[1, 1], slope_two, bend_two)
    slope, bend = (slope_one, bend_one) if zone == 0 else (slope_two, bend_two)
    return min(1.0, max(-1.0, -slope / bend)) if bend < 0.0 else 0.0


@compiled
def _extreme_in_cell(
    walk: Walk, rims: tuple[int, int], cell: tuple[float, float], phase: int, zone: int, work: Array
) -> float:
    """Least driving deviation between two places at one phase (`zone` < 0), or the largest of one zone, mm of arc.

    `rims` of both zones, the places `cell`; `work` (2, 3) holds both zones' deviations at them in its columns 0 and 2.
    """
    low, high = cell
    centre, half = (low + high) / 2, (high - low) / 2
    best = math.inf if zone < 0 else -math.inf
    # The middle first, then three places around the extreme of the parabolas, at last the extreme of theirs.
    for step in range(5):
        if step == 1 or step == 4:
            centre += half * _best_place(work, zone)
        if step == 1:
            half *= NARROWER
            centre = min(high - half, max(low + half, centre))
        column = step - 1 if 1 <= step <= 3 else 1
        place = centre + half * (column - 1)
        for side in range(2):
            if zone < 0 or side == zone:
                value, angle = _zone_at(walk, side, rims[side], place)
                work[side, column] = value + _one_lane(walk.comb, angle, phase)
        if zone < 0:
            best = min(best, max(work[0, column], work[1, column]))
        else:
            best = max(best, work[zone, column])
    return best


@compiled
def _floor_of(comb: Comb, one: float, two: float, turned: float) -> float:
    """What the driving deviation cannot fall below where the zones' other terms are `one` and `two`; `turned` is how
    far from half a turn the two angles on the FS lie apart, rad."""
    apart = one - two
    if abs(apart) >= comb.reach:
        return max(one, two) + comb.least
    last = len(comb.floor) - 1
    step = 2 * comb.reach / last
    place = (apart + comb.reach) / step
    k = min(int(place), last - 1)
    x = place - k
    # Between two tabulated differences it cannot fall faster than half the difference.
    between = max(comb.floor[k] - x * step / 2, comb.floor[k + 1] - (1 - x) * step / 2)
    return float(max((one + two) / 2 + between - comb.slope * turned, max(one, two) + comb.least))


@compiled
def _floor_between(nodes: Nodes, i: int) -> float:
    """The same anywhere in the cell after node `i`, whose ends' floors are known: on the way from one end to the other
    it falls no faster than half the difference of the zones changes, and their mean does."""
    apart = abs((nodes.value[i, 0] - nodes.value[i, 1]) - (nodes.value[i + 1, 0] - nodes.value[i + 1, 1]))
    rise = abs((nodes.value[i, 0] + nodes.value[i, 1]) - (nodes.value[i + 1, 0] + nodes.value[i + 1, 1]))
    return float((nodes.floor[i] + nodes.floor[i + 1]) / 2 - (apart + rise) / 4)


@compiled
def _turned(nodes: Nodes, i: int) -> float:
    return float(abs(nodes.angle[i, 1] - nodes.angle[i, 0] - math.pi))


@compiled
def _seed(comb: Comb, nodes: Nodes, count: int, lanes: Array, best: Array) -> None:
    """Fill the floors of the nodes, and walk all phases at the two that promise the least and the largest deviation."""
    lowest, highest, floor, ceiling = 0, 0, math.inf, -math.inf
    for i in range(count):
        one, two = nodes.value[i, 0], nodes.value[i, 1]
        nodes.floor[i] = _floor_of(comb, one, two, _turned(nodes, i))
        if nodes.floor[i] < floor:
            lowest, floor = i, nodes.floor[i]
        if max(one, two) > ceiling:
            highest, ceiling = i, max(one, two)
    for i in (lowest, highest):
        for zone in range(2):
            _lanes(comb.rows, nodes.value[i, zone], nodes.angle[i, zone], lanes[0, zone])
        for p in range(lanes.shape[2]):
            value = max(lanes[0, 0, p], lanes[0, 1, p])
            best[0], best[1] = min(best[0], value), max(best[1], value)


@compiled
def _least_of(values: Array) -> float:
    """Least of `values` (n,), which are folded in halves and lost."""
    n = len(values)
    while n > 1:
        half = (n + 1) // 2
        for p in range(n - half):
            a, b = values[p], values[p + half]
            values[p] = a if a < b else b
        n = half
    return float(values[0])


@compiled
def _ends(lanes: Array, folds: Array, best: Array) -> tuple[float, float]:
    """Count the values at both ends of a cell; the least that it can reach between, and the largest at its ends."""
    one_a, two_a, one_b, two_b = lanes[0, 0], lanes[0, 1], lanes[1, 0], lanes[1, 1]
    for p in range(len(one_a)):
        a = one_a[p] if one_a[p] > two_a[p] else two_a[p]
        b = one_b[p] if one_b[p] > two_b[p] else two_b[p]
        one = one_a[p] if one_a[p] < one_b[p] else one_b[p]
        two = two_a[p] if two_a[p] < two_b[p] else two_b[p]
        folds[0, p] = one if one > two else two
        folds[1, p] = a if a < b else b
        folds[2, p] = -(a if a > b else b)
    floor, least, ceiling = _least_of(folds[0]), _least_of(folds[1]), -_least_of(folds[2])
    best[0], best[1] = min(best[0], least), max(best[1], ceiling)
    return floor, ceiling


@compiled
def _follow_least(walk: Walk, nodes: Nodes, i: int, lanes: Array, margin: float, best: Array) -> None:
    """Follow every phase that can hold the least of all in the cell after node `i`."""
    rims, cell = (nodes.rims[i, 0], nodes.rims[i, 1]), (nodes.place[i], nodes.place[i + 1])
    work = np.zeros((2, 3))
    for p in range(lanes.shape[2]):
        one_a, two_a, one_b, two_b = lanes[0, 0, p], lanes[0, 1, p], lanes[1, 0, p], lanes[1, 1, p]
        if max(min(one_a, one_b), min(two_a, two_b)) - margin >= best[0]:
            continue
        if _least_of_lines(one_a, two_a, one_b, two_b) - margin < best[0]:
            work[0, 0], work[0, 2], work[1, 0], work[1, 2] = one_a, one_b, two_a, two_b
            best[0] = min(best[0], _extreme_in_cell(walk, rims, cell, p, -1, work))


@compiled
def _follow_largest(walk: Walk, nodes: Nodes, i: int, lanes: Array, margin: float, best: Array) -> None:
    """Follow every phase that can hold the largest of all in the cell after node `i`."""
    rims, cell = (nodes.rims[i, 0], nodes.rims[i, 1]), (nodes.place[i], nodes.place[i + 1])
    work = np.zeros((2, 3))
    for zone in range(2):
        for p in range(lanes.shape[2]):
            if max(lanes[0, zone, p], lanes[1, zone, p]) + margin > best[1]:
                work[zone, 0], work[zone, 2] = lanes[0, zone, p], lanes[1, zone, p]
                best[1] = max(best[1], _extreme_in_cell(walk, rims, cell, p, zone, work))


@compiled
def extremes_in_lanes(walk: Walk, nodes: Nodes, lanes: Array) -> tuple[float, float]:
    """Essential infimum and supremum of max(tau_1, tau_2) of a `walk` over one full relative turn, mm of arc.

    Jia 2021, Eqs. (31), (32). `nodes` of `new_nodes` and `lanes` (2, 2, P) are work space.
    """
    comb = walk.comb
    margin = SAFETY * (walk.bend + comb.bend) / 8
    count = _fill_nodes(walk, nodes)
    best = np.array([math.inf, -math.inf])
    _seed(comb, nodes, count, lanes, best)
    folds, known = np.empty((3, lanes.shape[2])), -1
    for i in range(count):
        if not nodes.joined[i]:
            continue
        ceiling = max(max(nodes.value[i, 0], nodes.value[i + 1, 0]), max(nodes.value[i, 1], nodes.value[i + 1, 1]))
        if _floor_between(nodes, i) - margin > best[0] and ceiling + comb.largest + margin < best[1]:
            continue
        if known == i:
            for zone in range(2):
                for phase in range(lanes.shape[2]):
                    lanes[0, zone, phase] = lanes[1, zone, phase]
        for end in range(1 if known == i else 0, 2):
            for zone in range(2):
                _lanes(comb.rows, nodes.value[i + end, zone], nodes.angle[i + end, zone], lanes[end, zone])
        known = i + 1
        least, largest = _ends(lanes, folds, best)
        if least - margin < best[0]:
            _follow_least(walk, nodes, i, lanes, margin, best)
        if largest + margin > best[1]:
            _follow_largest(walk, nodes, i, lanes, margin, best)
    return best[0], best[1]
