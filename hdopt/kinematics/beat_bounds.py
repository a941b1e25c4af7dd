"""What each cell of one turn can reach, in single precision: most cells cannot hold an extreme of the beat.

A cell is what lies between two neighbouring grid angles. Where no rim can change in it, each zone is on its deeper rim;
where one can, both rims bound it. The table of the CS teeth is read at the grid angles once; what it is beside them, a
parabola through three of them says. Loops are short and read few rows each, so that the compiler runs them in lanes.
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from hdopt.arrays import Array, Singles
from hdopt.kinematics.beat_tables import (
    BEFORE,
    PER_RAD,
    WRAPPED,
    Comb,
    allocating,
    by_four,
    compiled,
    four,
    inlined,
    least_of,
    whole_of,
)
from hdopt.kinematics.branches import TIE_MM
from hdopt.kinematics.closed_form import RigidMotion, RimConstants
from hdopt.kinematics.lanes.single import HALF, HUGE, ONE, TINY, ZERO, narrowed, single, unsigned

SAFETY = 1.25
"""How many times the largest second difference of the parts a cell is allowed to bend, and the third to bow."""
ROUNDINGS = 48 * 2.0**-24
"""How many roundings to single precision a bound has at most, times what one is of its size: see `rounding_of`."""
QUARTER = single(0.25)
PAST_PLACES = 1.25
"""How many times the largest of four places their cubic is at most between the middle ones."""

Places: TypeAlias = NDArray[np.int32]
"""Places in a table."""

DEPTH, ON_CS, ON_FS = 0, 1, 2
"""The first axis of `branches` of a walk: depth (mm), offsets on CS and FS (rad)."""

AT, SLOPE, CURVE, OFF, DIP, CREST, CIRCULAR = range(7)
"""Rows of `Circular`."""
LOW, HIGH, GAP, TURNED, TURNED_ANY, NODES = 0, 4, 8, 10, 11, 12
"""Rows of nodes: least and largest deviation without the FS teeth, of zone 0's rims and of zone 1's (mm); what the
upper rim of either zone lies deeper than the lower (mm); how far from half a turn the zones' angles on the FS lie
apart, on the deeper rims and on any (rad)."""
FLOOR, CEILING, CLEAR, LEAST, ROOM, CELLS = 0, 1, 2, 3, 5, 7
"""Rows of cells: what the driving deviation cannot fall below, what no zone rises above, how far (mm) they are from
letting a rim change, from where on one may at 0; the least of either zone, and room for two."""


class Circular(NamedTuple):
    """The CS `table` over one turn, wrapped around (n + 4,), mm of arc; its `rows` (CIRCULAR, 2, m + 4) at the m grid
    angles of either zone, wrapped around: value, slope and half the second difference over a step of the grid; how far
    the parabola of these may be off at u steps from there, over |u| (1 - |u|); and how far the table may lie below or
    above its chord in the cell after, where offsets are less than a step. Its largest second difference over a step and
    third over half a one, its largest size, and its steepest slope at the grid angles (1/rad)."""

    table: Array
    rows: Singles
    bend: float
    bow: float
    extent: float
    slope: float


class Bends(NamedTuple):
    """How far the depth of a drive's branches bends: its largest second difference over a step of the grid, mm; its
    largest size, mm; and the largest second difference of the offsets on the CS, rad."""

    depth: float
    deepest: float
    turn: float


class Slack(NamedTuple):
    """What bounds allow one drive for, mm: how far the depth's arc, and the CS term for the bending of offsets, may lie
    off the chord in a cell; below which gap at the ends a rim may change within it; rounding, with what FS places leave
    between them and what the bending of offsets moves on the FS; and how far the FS term may lie off its chord."""

    bulge: float
    touch: float
    rounding: float
    fs_bulge: float


@inlined
def on_turn(turns: float, places: int) -> float:
    """So many `turns` as a place from 0 to so many `places` a turn."""
    return float(turns - np.floor(turns)) * places


@compiled
def _fill_seconds(table: Array, step: float, seconds: Array) -> float:
    """Fill `seconds` with the second differences over a `step` (in places, at least one) of a wrapped `table` (n + 4,)
    at each of its places, and at the first again; the largest size of the table between places."""
    n, scale, largest = len(table) - WRAPPED, step * step, 0.0
    before, after = table[BEFORE:], table[BEFORE + 1 :]
    for i in range(n):
        size = abs(before[i])
        largest = size if size > largest else largest
        seconds[i] = (table[i] - 2 * before[i] + after[i]) * scale
    for i in range(len(seconds) - n):
        seconds[n + i] = seconds[i]
    return PAST_PLACES * largest


@compiled
def _fill_steps(seconds: Array, n: int, zone: int, tops: Array, bottoms: Array) -> None:
    """Fill `tops` and `bottoms` (m + 6,) with the largest and least of `seconds` of a table of `n` places in each step
    of a `zone`: number i begins at grid angle i - 2. The tops are 0 at least, the bottoms at most. Teeth that come into
    contact bend a table within a step, so that it is taken at all places."""
    step, most = n / (len(tops) - 6), len(seconds) - n
    for i in range(len(tops)):
        # A little early, as rounding may have it.
        place = whole_of((i - 2) * step + zone * n / 2 + n - 1e-6)
        begin = place - n if place >= n else place
        begin = begin - n if begin >= n else begin
        top = bottom = 0.0
        for k in range(most):
            second = seconds[unsigned(begin) + unsigned(k)]
            top, bottom = second if second > top else top, second if second < bottom else bottom
        tops[i], bottoms[i] = top, bottom


@allocating
def fill_circular(table: Array, bends: tuple[float, float], rows: Singles) -> Circular:
    """`Circular` of a wrapped `table` (n + 4,) with the second difference over a step and third over half a one,
    `bends`, into `rows`."""
    n, m = len(table) - WRAPPED, rows.shape[2] - WRAPPED
    tops, bottoms, seconds = np.empty(m + 6), np.empty(m + 6), np.empty(n + n // m + 3)
    extent, steepest = _fill_seconds(table, n / m, seconds), 0.0
    for zone in range(2):
        _fill_steps(seconds, n, zone, tops, bottoms)
        before = here = 0.0
        for i in range(-2, m + WRAPPED):
            after = by_four(table, four(on_turn((i + 1 - BEFORE) / m + zone / 2, n)))
            if i >= 0:
                second = after - 2 * here + before
                rows[AT, zone, i], rows[SLOPE, zone, i], rows[CURVE, zone, i] = here, (after - before) / 2, second / 2
                steepest = max(steepest, abs(after - before) / 2)
                # The parabola is right at three angles; between them it is off as its bending is. Offsets of up to a
                # step reach one angle further on either side of a cell.
                top, bottom = max(tops[i], tops[i + 1]), min(bottoms[i], bottoms[i + 1])
                rows[OFF, zone, i] = SAFETY / 2 * max(top - second, second - bottom)
                rows[DIP, zone, i] = SAFETY / 8 * max(top, tops[i + 2])
                rows[CREST, zone, i] = SAFETY / 8 * max(-bottom, -bottoms[i + 2])
            before, here = here, after
    return Circular(table, rows, bends[0], bends[1], extent, steepest * m * PER_RAD)


@inlined
def largest_of_branches(branches: Array, bends: Singles, sizes: Singles, turns: Singles) -> Bends:
    """`Bends` of wrapped `branches`, whose offsets on the FS bend otherwise by some hundredths; `bends`, `sizes` and
    `turns` (m + 4,) are room."""
    n = branches.shape[3] - 2
    for i in range(n):
        bend = size = turn = 0.0
        for branch in range(4):
            zone, k = unsigned(branch // 2), unsigned(branch % 2)
            here, offset = branches[DEPTH, zone, k, i + 1], branches[ON_CS, zone, k, i + 1]
            bends_by = abs(branches[DEPTH, zone, k, i] - 2 * here + branches[DEPTH, zone, k, i + 2])
            turns_by = abs(branches[ON_CS, zone, k, i] - 2 * offset + branches[ON_CS, zone, k, i + 2])
            bend, size = bends_by if bends_by > bend else bend, abs(here) if abs(here) > size else size
            turn = turns_by if turns_by > turn else turn
        bends[i], sizes[i], turns[i] = -narrowed(bend), -narrowed(size), -narrowed(turn)
    return Bends(-least_of(bends, n), -least_of(sizes, n), -least_of(turns, n))


@inlined
def _swing(cos: float, sin: float, level: float) -> tuple[float, float]:
    """How far a wave with these parts swings, and how large it is at most around its `level`."""
    swing = math.sqrt(cos * cos + sin * sin)
    return swing, swing + abs(level)


@inlined
def bends_of_motion(motion: RigidMotion[float], rim: RimConstants, m: int) -> Bends:
    """What `Bends` of the branches of a drive's `motion` are at most on `m` angles, whose wave generator has the
    constants `rim`: of a wave, slope and bend are what it swings, of a product what the product rule says."""
    e, e_most = _swing(motion.ea_cos, motion.ea_sin, motion.ea_0)
    t, t_most = _swing(motion.ta_cos, motion.ta_sin, motion.ta_0)
    f, f_most = _swing(motion.el_cos, motion.el_sin, motion.el_0)
    u, u_most = _swing(motion.tl_cos, motion.tl_sin, motion.tl_0)
    w, w_most = _swing(motion.twist_cos, motion.twist_sin, motion.twist_0)
    # q of the closed form: a shift, the twist's part of it, and what two tilts make.
    most = f_most + u_most + e_most * w_most + rim.tilt_gain * t_most * u_most
    slope = f + u + (e * w_most + e_most * w) + rim.tilt_gain * (t * u_most + t_most * u)
    bend = slope + 2 * (e * w + rim.tilt_gain * t * u)
    depth = e + t + 2 * rim.bow * (t * t + t_most * t) + rim.per_flatness * (slope * slope + most * bend)
    deepest = e_most + t_most + rim.bow * t_most * t_most + rim.half_per_flatness * most * most
    step = 2 * math.pi / m
    return Bends(step * step * depth, deepest, step * step * rim.per_flatness * bend)


@inlined
def rounding_of(deepest: float, tan_alpha: float, circular: Circular, comb: Comb) -> float:
    """By how much bounds in single precision may be wrong, mm of arc; `deepest` is the largest size of a depth, mm,
    which `tan_alpha` multiplies, `circular` and `comb` are the teeth.

    One rounding, of a number read or of a result, changes it by 2^-24 of its size at most. A bound is the sum of
    tan(alpha) times a depth, of value, slope and curve of the CS table (at most once, once and twice its extent, times
    factors of at most 1; what these may be off by has its own SAFETY), of a floor or a place of the FS table, and of
    its slope times at most half a turn.
    Every partial sum is at most the sum of these sizes, and every operation on the way changes it by 2^-24 of that: 14
    up to a zone's deviation, 10 for the bulge, 16 for the floor, 8 numbers read, 48 in all.
    """
    sizes = tan_alpha * deepest + 5 * circular.extent + max(-comb.least, comb.largest) + comb.reach
    return ROUNDINGS * (sizes + math.pi * comb.slope)


@inlined
def _fill_rim(
    branches: Array, tan_alpha: float, circular: Circular, zone: int, k: int, lows: Singles, highs: Singles
) -> None:
    """Fill `lows` and `highs` (m + 4,) with what a `zone` is on its rim `k` at least and at most, without FS teeth."""
    depth, on_cs = branches[DEPTH, zone, k], branches[ON_CS, zone, k]
    at, slope, curve = circular.rows[AT, zone], circular.rows[SLOPE, zone], circular.rows[CURVE, zone]
    side = 1.0 - 2.0 * zone
    tan, per_step = narrowed(tan_alpha), narrowed(side * (len(depth) - WRAPPED) * PER_RAD)
    # Further than a step away all that is known of the table is its extent.
    extent, off_by = narrowed(circular.extent), circular.rows[OFF, zone]
    for i in range(len(depth)):
        u = narrowed(on_cs[i]) * per_step
        arc, on_table = tan * narrowed(depth[i]), at[i] + u * (slope[i] + u * curve[i])
        free = ONE - abs(u)
        near = off_by[i] * abs(u) * free
        value, off = arc + (on_table if free >= ZERO else ZERO), near if free >= ZERO else extent
        lows[i], highs[i] = value - off, value + off


@inlined
def fill_nodes(branches: Array, tan_alpha: float, circular: Circular, nodes: Singles) -> None:
    """Fill the `nodes` (NODES, m + 4) of one drive from its `branches`, whose depth `tan_alpha` multiplies, and the CS
    teeth `circular`."""
    tie = narrowed(-TIE_MM)
    for zone in range(2):
        for k in range(2):
            row = 2 * zone + k
            _fill_rim(branches, tan_alpha, circular, zone, k, nodes[LOW + row], nodes[HIGH + row])
        upper, lower, gaps = branches[DEPTH, zone, 0], branches[DEPTH, zone, 1], nodes[GAP + zone]
        for i in range(len(upper)):
            gaps[i] = narrowed(upper[i] - lower[i])
    for i in range(branches.shape[3]):
        a, b = narrowed(branches[ON_FS, 0, 0, i]), narrowed(branches[ON_FS, 0, 1, i])
        c, d = narrowed(branches[ON_FS, 1, 0, i]), narrowed(branches[ON_FS, 1, 1, i])
        deep = (a if nodes[GAP, i] >= tie else b) + (c if nodes[GAP + 1, i] >= tie else d)
        up, down = (a if a > b else b) + (c if c > d else d), (a if a < b else b) + (c if c < d else d)
        nodes[TURNED, i] = abs(deep)
        nodes[TURNED_ANY, i] = up if up > -down else -down


@inlined
def _cells_of(nodes: Singles) -> int:
    """How many cells follow each other from the first of the `nodes` (NODES, m + 4): one turn of them is enough."""
    return int(nodes.shape[1] - WRAPPED + BEFORE)


@inlined
def _fill_clear(touch: float, nodes: Singles, cells: Singles) -> None:
    """Fill how far the `cells` are from letting a rim change: where both ends have gaps of one sign larger than
    `touch`, none does."""
    touching = narrowed(touch)
    for i in range(_cells_of(nodes)):
        a, b, c, d = nodes[GAP, i], nodes[GAP, i + 1], nodes[GAP + 1, i], nodes[GAP + 1, i + 1]
        low, high = a if a < b else b, a if a > b else b
        one = low if low > -high else -high
        low, high = c if c < d else d, c if c > d else d
        two = low if low > -high else -high
        cells[CLEAR, i] = (one if one < two else two) - touching


@inlined
def _deeper(clear: float, gap: float, one: float, two: float, worse: float) -> float:
    """The value of the deeper of two rims where the cell is `clear`, else the `worse` of both."""
    deep = one if gap > ZERO else two
    return deep if clear > ZERO else worse


@inlined
def _beyond(a: float, b: float, bulge: float) -> float:
    """How far what lies at most 4 `bulge` x (1 - x) off its chord between `a` and `b` can pass both."""
    off = bulge - abs(a - b) * QUARTER
    off = off if off > ZERO else ZERO
    return off * off / (bulge + TINY)


@inlined
def _fill_ceilings(circular: Circular, bulge: float, above: float, nodes: Singles, cells: Singles) -> None:
    """Fill what no zone rises above in the `cells`, with the FS term at most `above`."""
    more, largest = narrowed(bulge), narrowed(above)
    for zone in range(2):
        one, two, gap = nodes[HIGH + 2 * zone], nodes[HIGH + 2 * zone + 1], nodes[GAP + zone]
        crest, clear, out, room = circular.rows[CREST, zone], cells[CLEAR], cells[CEILING], cells[ROOM]
        for i in range(_cells_of(nodes)):
            a, b, c, d, ok = one[i], two[i], one[i + 1], two[i + 1], clear[i]
            low = _deeper(ok, gap[i], a, b, a if a > b else b)
            high = _deeper(ok, gap[i + 1], c, d, c if c > d else d)
            room[i] = (low if low > high else high) + _beyond(low, high, crest[i] + more) + largest
        for i in range(_cells_of(nodes)):
            before = out[i] if zone == 1 else -HUGE
            out[i] = room[i] if room[i] > before else before


@inlined
def _fill_least(circular: Circular, bulge: float, nodes: Singles, cells: Singles) -> None:
    """Fill the least of either zone in the `cells` without the FS teeth."""
    more = narrowed(bulge)
    for zone in range(2):
        one, two, gap = nodes[LOW + 2 * zone], nodes[LOW + 2 * zone + 1], nodes[GAP + zone]
        dip, clear, out = circular.rows[DIP, zone], cells[CLEAR], cells[LEAST + zone]
        for i in range(_cells_of(nodes)):
            a, b, c, d, ok = one[i], two[i], one[i + 1], two[i + 1], clear[i]
            low = _deeper(ok, gap[i], a, b, a if a < b else b)
            high = _deeper(ok, gap[i + 1], c, d, c if c < d else d)
            out[i] = (low if low < high else high) - _beyond(low, high, dip[i] + more)


@inlined
def _fill_floors(comb: Comb, rounding: float, nodes: Singles, cells: Singles, places: Places) -> None:
    """Fill what the driving deviation cannot fall below in the `cells`, whose least of either zone is known; `places`
    are room."""
    last, n = len(comb.floor) - 1, _cells_of(nodes)
    per_step, half_step = narrowed(last / comb.reach), narrowed(comb.reach / last / 2)
    # Turning both places by half of what they are off moves each by half of it.
    half_slope, least, spare = narrowed(comb.slope / 2), narrowed(comb.least), narrowed(rounding)
    top = narrowed(last - 1)
    one, two, low, high = cells[LEAST], cells[LEAST + 1], cells[ROOM], cells[ROOM + 1]
    for i in range(n):
        place = abs(one[i] - two[i]) * per_step
        places[i] = whole_of(place if place < top else top)
    for i in range(n):
        k = unsigned(places[i])
        low[i], high[i] = comb.floor[k], comb.floor[k + unsigned(1)]
    for i in range(n):
        a, b, turned = nodes[TURNED, i], nodes[TURNED, i + 1], nodes[TURNED_ANY, i]
        c, ok = nodes[TURNED_ANY, i + 1], cells[CLEAR, i] > ZERO
        a, b = a if ok else turned, b if ok else c
        turned = a if a > b else b
        # Between two tabulated differences it cannot fall faster than half the difference; beyond the last, it rises
        # so.
        x = (abs(one[i] - two[i]) * per_step - narrowed(places[i])) * half_step
        falls, rises = low[i] - x, high[i] - half_step + x
        apart = (one[i] + two[i]) * HALF + (falls if falls > rises else rises) - half_slope * turned
        together = (one[i] if one[i] > two[i] else two[i]) + least
        cells[FLOOR, i] = (apart if apart > together else together) - spare


@inlined
def fill_cells(circular: Circular, comb: Comb, slack: Slack, nodes: Singles, cells: Singles, places: Places) -> None:
    """Fill the `cells` (CELLS, m + 4), of which number i + 1 lies after grid angle i, from the `nodes` of a drive
    with the teeth `circular` and `comb`, as its `slack` says; `places` (m + 4,) are room."""
    _fill_clear(slack.touch, nodes, cells)
    _fill_ceilings(circular, slack.bulge, comb.largest + slack.rounding, nodes, cells)
    _fill_least(circular, slack.bulge, nodes, cells)
    _fill_floors(comb, slack.rounding, nodes, cells, places)
