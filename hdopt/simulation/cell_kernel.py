"""The compiled extremes of drives with effects: cells of the input turn are bounded, and looked at where they count.

Without effects and FS teeth a zone repeats every input turn. So one turn of each drive is laid on a grid, each cell is
bounded over all turns at once, and only cells that may hold an extreme are taken turn by turn (lanes along the turns),
as chords; what a chord leaves open is bounded by the base's curvature and by the effects' own tables. The few that are
left are refined with parabolas of both zones, so that a kink where the driving zone changes is met as it is. Where the
deepest rim changes a cell is parted, since zones step there. The base is the closed form (Jia 2021, Eqs. (16) to (32)).
Numba's cache looks at this file's date alone: touch it where `walk_kernel.py` changes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hdopt.arrays import Array
from hdopt.kinematics.compiled_closed_form import allocating, compiled, entry, inlined, motion_at, rim_depth
from hdopt.simulation.gearing import Gearing
from hdopt.simulation.walk_kernel import EDGE, MOST_CUTS, WalkedDrive, drive_of, on_spline, on_splines, rims, rims_apart

ROUNDS = 2
"""Times that parabolas are laid through a cell: the second is eight times narrower."""
NARROWER = 0.125
ROOT_STEPS, ROOT_RAD = 40, 1e-12
"""Steps of the search for a change of rim at most, and how near (rad) is near enough."""
BENT = 1.3
"""Curvature granted to the base beyond its first order, as a share: the offsets' part in the teeth's deviation."""
U, W, U_SIN, U_COS, W_SIN, W_COS = range(6)
"""Rows of a grid: both zones without FS teeth, and the sine and cosine part of these, mm of arc."""
GAP_ONE, GAP_TWO = 6, 7
"""How much deeper rim 1 lies than rim 2 in either zone, mm."""
FS_ONE, FS_TWO = 8, 9
"""Angles of the FS that either zone meets, rad, zone 2 counted from its own end."""
ROWS = 10
FS_CHORDS, FS_SAGS = 2, 6
"""First rows of a cell's estimates, after those of the driving deviation and of its negative, for what both zones meet
of effects on the FS at the cell's ends, and for how far that goes beyond the chord, mm of arc."""
ESTIMATES = 8


class SplineTables(NamedTuple):
    """What each zone meets of effects on CS and FS over a turn of the spline, mm of arc, (2, places) each, on no places
    where there are none; the places by which the FS goes on from turn to turn; the least and the largest that a zone
    meets on the FS, (2,) each; how far a cell that begins at a place of `fs` goes beyond its chord, (2, places), and
    one anywhere on `cs`, mm of arc."""

    cs: Array
    fs: Array
    fs_advance: int
    fs_least: Array
    fs_largest: Array
    fs_sag: Array
    cs_sag: float


class CellTable(NamedTuple):
    """Effects of one direction over a full relative turn of t input turns of c cells, mm of arc, those beside the zones
    counted into both: at the cells' edges (2, c + 1, t), how far below and above its chord a cell goes (2, c, t) each,
    the least (3, c) and the largest (2, c) of a cell over all turns, the third row that of both zones' mean; all
    places of the table, (2, m); and the effects that stand on the splines."""

    edges: Array
    below: Array
    above: Array
    least: Array
    largest: Array
    fine: Array
    splines: SplineTables


class Circle(NamedTuple):
    """Cosine and sine of the cells' edges, (c + 1,) each, of these times Z_CS/Z_FS, and of whole turns times that,
    (t,)."""

    cos: Array
    sin: Array
    fs_cos: Array
    fs_sin: Array
    turn_cos: Array
    turn_sin: Array


@inlined
def _deeper(drive: WalkedDrive, cos: float, sin: float, s: float) -> tuple[float, float, float, float]:
    """Deviation of zone s (+1, -1) without its FS teeth at the deeper rim, the offsets o and o' there, and the depths'
    difference; offsets are small here, so that series do."""
    rim = drive.rim
    e_a, e_l, t_a, t_l = motion_at(drive.motion, cos, sin)
    depth, o, o_fs = rim_depth(rim, e_a, e_l, t_a, t_l, s, 1.0)
    other, o_other, o_fs_other = rim_depth(rim, e_a, e_l, t_a, t_l, s, -1.0)
    gap = depth - other
    depth = other if gap < 0.0 else depth
    o = o_other if gap < 0.0 else o
    o_fs = o_fs_other if gap < 0.0 else o_fs
    here = drive.cs_cos * cos + drive.cs_sin * sin
    ahead = drive.cs_sin * cos - drive.cs_cos * sin
    square = o * o
    teeth = s * here * (1.0 - 0.5 * square) + ahead * o * (1.0 - square / 6.0)
    return drive.tan_alpha * depth + teeth, o, o_fs, gap


@compiled
def _fill_grid(drive: WalkedDrive, circle: Circle, cs: Array, grid: Array) -> None:
    """Fill `grid` (ROWS, c + 1) with both zones at the cells' edges; `cs` holds the effects on the CS."""
    step = 2 * math.pi / (len(circle.cos) - 1)
    a_sin, a_cos = drive.a_fs * math.sin(drive.fs_phase), drive.a_fs * math.cos(drive.fs_phase)
    for g in range(len(circle.cos)):
        cos, sin = circle.cos[g], circle.sin[g]
        u, cs_one, o_one, gap_one = _deeper(drive, cos, sin, 1.0)
        w, cs_two, o_two, gap_two = _deeper(drive, cos, sin, -1.0)
        if cs.shape[1] > 0:
            u += on_spline(cs, 0, g * step + cs_one)
            w += on_spline(cs, 1, g * step - cs_two)
        grid[FS_ONE, g], grid[FS_TWO, g] = drive.advance * g * step + o_one, drive.advance * g * step - o_two
        sine = a_cos * circle.fs_sin[g] + a_sin * circle.fs_cos[g]
        cosine = a_cos * circle.fs_cos[g] - a_sin * circle.fs_sin[g]
        c_one, s_one = 1.0 - 0.5 * o_one * o_one, o_one * (1.0 - o_one * o_one / 6.0)
        c_two, s_two = 1.0 - 0.5 * o_two * o_two, o_two * (1.0 - o_two * o_two / 6.0)
        grid[U, g], grid[W, g] = u, w
        grid[U_SIN, g], grid[U_COS, g] = sine * c_one + cosine * s_one, cosine * c_one - sine * s_one
        grid[W_SIN, g], grid[W_COS, g] = -sine * c_two + cosine * s_two, -cosine * c_two - sine * s_two
        grid[GAP_ONE, g], grid[GAP_TWO, g] = gap_one, gap_two


@compiled
def _fill_edge(drive: WalkedDrive, theta: float, cs: Array, edge: Array) -> None:
    """Fill one column `edge` (ROWS,) of a grid at `theta`, rad, as in `_fill_grid`."""
    cos, sin = math.cos(theta), math.sin(theta)
    edge[U], cs_one, o_one = rims(drive, cos, sin, 1.0)
    edge[W], cs_two, o_two = rims(drive, cos, sin, -1.0)
    if cs.shape[1] > 0:
        edge[U] += on_spline(cs, 0, theta + cs_one)
        edge[W] += on_spline(cs, 1, theta - cs_two)
    edge[FS_ONE], edge[FS_TWO] = drive.advance * theta + o_one, drive.advance * theta - o_two
    phase = drive.advance * theta + drive.fs_phase
    edge[U_SIN], edge[U_COS] = drive.a_fs * math.sin(phase + o_one), drive.a_fs * math.cos(phase + o_one)
    edge[W_SIN], edge[W_COS] = -drive.a_fs * math.sin(phase - o_two), -drive.a_fs * math.cos(phase - o_two)


@compiled
def _root(drive: WalkedDrive, low: float, high: float, s: float) -> float:
    """Where between `low` and `high` (rad) the deeper rim of zone s changes, by false position (Illinois)."""
    at_low, at_high = rims_apart(drive, low, s), rims_apart(drive, high, s)
    x, side = low, 0
    for _ in range(ROOT_STEPS):
        before = x
        x = (low * at_high - high * at_low) / (at_high - at_low)
        value = rims_apart(drive, x, s)
        if value == 0.0 or abs(x - before) < ROOT_RAD:
            break
        if (value > 0.0) == (at_high > 0.0):
            high, at_high = x, value
            at_low = 0.5 * at_low if side == 1 else at_low
            side = 1
        else:
            low, at_low = x, value
            at_high = 0.5 * at_high if side == -1 else at_high
            side = -1
    return x


@allocating
def _changes(drive: WalkedDrive, grid: Array, cuts: Array) -> int:
    """Angles of an input turn (rad) at which the deeper rim of a zone changes, into `cuts`, rising; how many.

    Two changes within a cell leave no trace at its edges but a gap that nearly closes: its parabola is looked at.
    """
    cells, found = grid.shape[1] - 1, 0
    step = 2 * math.pi / cells
    for row in (GAP_ONE, GAP_TWO):
        s = 1.0 if row == GAP_ONE else -1.0
        for g in range(cells):
            here, after = grid[row, g], grid[row, g + 1]
            before = grid[row, g - 1 if g else cells - 1]
            if found + 2 > len(cuts):
                break
            if (here > 0.0) != (after > 0.0):
                cuts[found] = _root(drive, g * step, (g + 1) * step, s)
                found += 1
            elif (here > 0.0) == (before > 0.0) and abs(here) <= min(abs(before), abs(after)):
                bend = before - 2 * here + after
                vertex = (g - 0.5 * (after - before) / bend) * step if bend != 0.0 else g * step
                if (rims_apart(drive, vertex, s) > 0.0) != (here > 0.0):
                    cuts[found] = _root(drive, (g - 1) * step, vertex, s) % (2 * math.pi)
                    cuts[found + 1] = _root(drive, vertex, (g + 1) * step, s) % (2 * math.pi)
                    found += 2
    cuts[:found].sort()
    return found


@compiled
def _zones_at(drive: WalkedDrive, theta: float, table: CellTable) -> tuple[float, float]:
    """Both zones (mm of arc) at `theta` (rad), with effects interpolated in the `table`."""
    fine, splines, cos, sin = table.fine, table.splines, math.cos(theta), math.sin(theta)
    one, cs_one, o_one = rims(drive, cos, sin, 1.0)
    two, cs_two, o_two = rims(drive, cos, sin, -1.0)
    m = fine.shape[1]
    place = theta / drive.span
    place = (place - math.floor(place)) * m
    i = int(place) % m
    share = place - int(place)
    j = (i + 1) % m
    phase = drive.advance * theta + drive.fs_phase
    one += drive.a_fs * math.sin(phase + o_one) + fine[0, i] + share * (fine[0, j] - fine[0, i])
    two += -drive.a_fs * math.sin(phase - o_two) + fine[1, i] + share * (fine[1, j] - fine[1, i])
    one += on_splines(splines.cs, splines.fs, 0, theta, drive.advance * theta, (cs_one, o_one))
    two += on_splines(splines.cs, splines.fs, 1, theta, drive.advance * theta, (cs_two, o_two))
    return one, two


@inlined
def _driving(one: tuple[float, float, float], two: tuple[float, float, float], x: float) -> float:
    """The larger of two parabolas c0 + x (c1 + x c2)."""
    return max(one[0] + x * (one[1] + x * one[2]), two[0] + x * (two[1] + x * two[2]))


@compiled
def _best_place(one: tuple[float, float, float], two: tuple[float, float, float], sign: float) -> float:
    """Where in [-1, 1] sign times the larger of two parabolas is least: at an end, a vertex or where they cross."""
    best, where = sign * _driving(one, two, -1.0), -1.0
    d0, d1, d2 = one[0] - two[0], one[1] - two[1], one[2] - two[2]
    inside = max(d1 * d1 - 4 * d0 * d2, 0.0)
    far = -0.5 * (d1 + (math.sqrt(inside) if d1 >= 0.0 else -math.sqrt(inside)))
    for k in range(5):
        if k == 0:
            x = 1.0
        elif k == 1:
            x = -0.5 * one[1] / one[2] if one[2] != 0.0 else 1.0
        elif k == 2:
            x = -0.5 * two[1] / two[2] if two[2] != 0.0 else 1.0
        elif k == 3:
            x = far / d2 if d2 != 0.0 else 1.0
        else:
            x = d0 / far if far != 0.0 else 1.0
        if -1.0 < x < 1.0 or k == 0:
            value = sign * _driving(one, two, x)
            if value < best:
                best, where = value, x
    return where


@compiled
def _refined(drive: WalkedDrive, low: float, high: float, sign: float, table: CellTable) -> float:
    """The least (sign +1) or the largest (-1) driving deviation between `low` and `high` (rad), mm of arc."""
    centre, half, best = 0.5 * (low + high), 0.5 * (high - low), math.inf
    for _ in range(ROUNDS):
        one_a, two_a = _zones_at(drive, centre - half, table)
        one_b, two_b = _zones_at(drive, centre, table)
        one_c, two_c = _zones_at(drive, centre + half, table)
        one = (one_b, 0.5 * (one_c - one_a), 0.5 * (one_a + one_c) - one_b)
        two = (two_b, 0.5 * (two_c - two_a), 0.5 * (two_a + two_c) - two_b)
        x = centre + half * _best_place(one, two, sign)
        one_x, two_x = _zones_at(drive, x, table)
        seen = min(sign * max(one_a, two_a), sign * max(one_b, two_b), sign * max(one_c, two_c))
        best = min(best, seen, sign * max(one_x, two_x))
        half *= NARROWER
        centre = min(max(x, low + half), high - half)
    return sign * best


class Piece(NamedTuple):
    """Part of a cell from `low` to `high`, rad of one input turn."""

    low: float
    high: float


@compiled
def _bounds(at: Array, to: Array, table: CellTable, g: int, a_fs: float) -> tuple[float, float]:
    """What the driving deviation, and its negative, do not go below in any turn and FS phase, between two columns `at`
    and `to` of a grid in cell `g`."""
    apart = abs(at[U_SIN] + at[W_SIN]) + abs(at[U_COS] + at[W_COS])
    apart = max(apart, abs(to[U_SIN] + to[W_SIN]) + abs(to[U_COS] + to[W_COS]))
    fs_one, fs_two = table.splines.fs_least
    mean = 0.5 * (min(at[U] + at[W], to[U] + to[W]) - apart + fs_one + fs_two) + table.least[2, g]
    one = min(at[U], to[U]) - a_fs + table.least[0, g] + fs_one
    two = min(at[W], to[W]) - a_fs + table.least[1, g] + fs_two
    high_one = max(at[U], to[U]) + a_fs + table.largest[0, g] + table.splines.fs_largest[0]
    high_two = max(at[W], to[W]) + a_fs + table.largest[1, g] + table.splines.fs_largest[1]
    return max(mean, one, two), -max(high_one, high_two)


@compiled
def _fill_fs(table: Array, advance: int, angle: float, out: Array) -> None:
    """Fill `out` (t,) with a `table` of the FS, (places,), in every turn, where it stands at `angle` (rad) in the first
    and goes on by `advance` places."""
    n = len(table)
    place = angle / (2 * math.pi)
    place = (place - math.floor(place)) * n
    i = int(place)
    share = place - i
    i = i % n
    for t in range(len(out)):
        after = i + 1 if i + 1 < n else 0
        out[t] = (1.0 - share) * table[i] + share * table[after]
        i += advance
        i = i - n if i >= n else i


@compiled
def _fill_estimates(
    at: Array, to: Array, first: float, last: float, table: CellTable, g: int, circle: Circle, out: Array
) -> None:
    """Fill the first rows of `out` (ESTIMATES, t) with the chords' least driving deviation in every turn, and with that
    of its negative, between two columns `at` and `to` of a grid at the shares `first` and `last` of cell `g`; the
    others are 0, or filled with what stands on the FS."""
    if table.splines.fs.shape[1] > 0:
        fs, advance, sag = table.splines.fs, table.splines.fs_advance, table.splines.fs_sag
        for zone in range(2):
            _fill_fs(fs[zone], advance, at[FS_ONE + zone], out[FS_CHORDS + zone])
            _fill_fs(fs[zone], advance, to[FS_ONE + zone], out[FS_CHORDS + 2 + zone])
            _fill_fs(sag[zone], advance, at[FS_ONE + zone], out[FS_SAGS + zone])
    left, right = 1.0 - first, 1.0 - last
    one, one_next, two, two_next = table.edges[0, g], table.edges[0, g + 1], table.edges[1, g], table.edges[1, g + 1]
    low_one, low_two, high_one, high_two = table.below[0, g], table.below[1, g], table.above[0, g], table.above[1, g]
    for t in range(len(circle.turn_cos)):
        c, s = circle.turn_cos[t], circle.turn_sin[t]
        u0 = at[U] + c * at[U_SIN] + s * at[U_COS] + left * one[t] + first * one_next[t] + out[FS_CHORDS, t]
        w0 = at[W] + c * at[W_SIN] + s * at[W_COS] + left * two[t] + first * two_next[t] + out[FS_CHORDS + 1, t]
        u1 = to[U] + c * to[U_SIN] + s * to[U_COS] + right * one[t] + last * one_next[t] + out[FS_CHORDS + 2, t]
        w1 = to[W] + c * to[W_SIN] + s * to[W_COS] + right * two[t] + last * two_next[t] + out[FS_CHORDS + 3, t]
        sag_one, sag_two = out[FS_SAGS, t], out[FS_SAGS + 1, t]
        out[1, t] = -max(max(u0, u1) + high_one[t] + sag_one, max(w0, w1) + high_two[t] + sag_two)
        down_one, down_two = low_one[t] - sag_one, low_two[t] - sag_two
        u0, u1, w0, w1 = u0 + down_one, u1 + down_one, w0 + down_two, w1 + down_two
        d0, d1 = u0 - w0, u1 - w1
        crosses = d0 * d1 < 0.0
        share = d0 / (d0 - d1 if crosses else 1.0)
        least = min(max(u0, w0), max(u1, w1))
        out[0, t] = min(least, u0 + share * (u1 - u0)) if crosses else least


@compiled
def _least_of_piece(
    drive: WalkedDrive, piece: Piece, estimates: Array, slack: float, sign: float, table: CellTable, least: float
) -> float:
    """The lower of `least` and sign times the driving deviation of a `piece`, in the turns whose `estimates` (t,) may
    go below by `slack`; the most promising turn first."""
    best = int(np.argmin(estimates))
    for k in range(-1, len(estimates)):
        t = best if k < 0 else k
        if estimates[t] - slack < least and (k < 0 or k != best):
            start = 2 * math.pi * t
            least = min(least, sign * _refined(drive, start + piece.low, start + piece.high, sign, table))
    return least


@compiled
def _curvature(drive: WalkedDrive) -> float:
    """A bound of the curvature of a zone without effects, mm of arc/rad^2."""
    m = drive.motion
    across = math.hypot(m.el_cos, m.el_sin) + abs(m.el_0) + math.hypot(m.tl_cos, m.tl_sin) + abs(m.tl_0)
    along = math.hypot(m.ea_cos, m.ea_sin) + math.hypot(m.ta_cos, m.ta_sin)
    lift = math.hypot(m.ta_cos, m.ta_sin) + abs(m.ta_0)
    second = 4 * (across * across * drive.rim.half_per_flatness + lift * lift * drive.rim.bow)
    teeth = math.hypot(drive.cs_cos, drive.cs_sin) + drive.a_fs * drive.advance * drive.advance
    return BENT * (drive.tan_alpha * along + teeth) + drive.tan_alpha * second


@allocating
def _least_at_changes(
    drive: WalkedDrive, cuts: Array, cells: int, slack: float, table: CellTable, circle: Circle, least: Array
) -> None:
    """Lower `least` (2,) to what the cells hold in which the deeper rim changes at one of `cuts`, part by part."""
    step = 2 * math.pi / cells
    at, to, estimates = np.empty(ROWS), np.empty(ROWS), np.zeros((ESTIMATES, len(circle.turn_cos)))
    for k in range(len(cuts)):
        g = min(int(cuts[k] / step), cells - 1)
        new = k == 0 or min(int(cuts[k - 1] / step), cells - 1) != g
        for part in range(0 if new else 1, 2):
            low = g * step if part == 0 else cuts[k] + EDGE
            next_cut = cuts[k + 1] if k + 1 < len(cuts) else math.inf
            high = cuts[k] - EDGE if part == 0 else min(next_cut - EDGE, (g + 1) * step)
            if high - low < 2 * EDGE:
                continue
            _fill_edge(drive, low, table.splines.cs, at)
            _fill_edge(drive, high, table.splines.cs, to)
            bounds = _bounds(at, to, table, g, drive.a_fs)
            for side in range(2):
                if (bounds[1] if side else bounds[0]) - slack < least[side]:
                    _fill_estimates(at, to, low / step - g, high / step - g, table, g, circle, estimates)
                    sign, piece = (-1.0 if side else 1.0), Piece(low, high)
                    least[side] = _least_of_piece(drive, piece, estimates[side], slack, sign, table, least[side])


@allocating
def _least_of_turns(
    drive: WalkedDrive, grid: Array, cuts: Array, table: CellTable, circle: Circle, least: Array
) -> None:
    """Lower `least` (2,), mm of arc, to the driving deviation of one drive in one direction and to its negative, over
    all turns: cell by cell, the lowest bound first, until no bound is below what was found."""
    cells = grid.shape[1] - 1
    step = 2 * math.pi / cells
    slack = 0.125 * step * step * _curvature(drive) + table.splines.cs_sag
    bounds, estimates = np.empty((2, cells)), np.zeros((ESTIMATES, len(circle.turn_cos)))
    for g in range(cells):
        bounds[0, g], bounds[1, g] = _bounds(grid[:, g], grid[:, g + 1], table, g, drive.a_fs)
    for k in range(len(cuts)):
        bounds[:, min(int(cuts[k] / step), cells - 1)] = math.inf
    for side in range(2):
        sign = -1.0 if side else 1.0
        for _ in range(cells):
            g = int(np.argmin(bounds[side]))
            if bounds[side, g] - slack >= least[side]:
                break
            _fill_estimates(grid[:, g], grid[:, g + 1], 0.0, 1.0, table, g, circle, estimates)
            piece = Piece(g * step, (g + 1) * step)
            least[side] = _least_of_piece(drive, piece, estimates[side], slack, sign, table, least[side])
            bounds[side, g] = math.inf
    _least_at_changes(drive, cuts, cells, slack, table, circle, least)


@allocating
def _circle(cells: int, turns: int, advance: float) -> Circle:
    angle, whole = np.arange(cells + 1) * (2 * math.pi / cells), np.arange(turns) * (2 * math.pi * advance)
    along = advance * angle
    return Circle(np.cos(angle), np.sin(angle), np.cos(along), np.sin(along), np.cos(whole), np.sin(whole))


@entry
def cell_table(zones: Array, beside: Array, cells: int, turns: int, scale: float, splines: SplineTables) -> CellTable:
    """The effects of d directions as the kernel takes them, each array with one more axis in front.

    `zones` (d, 2, m) mm of arc and `beside` (d, m) arcmin lie on an even grid of `turns` input turns of `cells` cells;
    `scale` is arcmin per mm of arc, times k_e. `splines` holds the effects that stand on the splines.
    """
    directions, _, m = zones.shape
    stride = m // (cells * turns)
    fine = np.empty((directions, 2, m))
    edges = np.empty((directions, 2, cells + 1, turns))
    below, above = np.empty((directions, 2, cells, turns)), np.empty((directions, 2, cells, turns))
    least, largest = np.full((directions, 3, cells), math.inf), np.full((directions, 2, cells), -math.inf)
    for d in range(directions):
        for z in range(2):
            for i in range(m):
                fine[d, z, i] = zones[d, z, i] + beside[d, i] / scale
            for t in range(turns):
                for g in range(cells + 1):
                    edges[d, z, g, t] = fine[d, z, (t * cells + g) * stride % m]
                for g in range(cells):
                    left, right = edges[d, z, g, t], edges[d, z, g + 1, t]
                    start, low, high = (t * cells + g) * stride, 0.0, 0.0
                    for k in range(1, stride):
                        off = fine[d, z, start + k] - left - (right - left) * k / stride
                        low, high = min(low, off), max(high, off)
                    below[d, z, g, t], above[d, z, g, t] = low, high
                    least[d, z, g] = min(least[d, z, g], min(left, right) + low)
                    largest[d, z, g] = max(largest[d, z, g], max(left, right) + high)
        for g in range(cells):
            for t in range(turns):
                left = edges[d, 0, g, t] + edges[d, 1, g, t]
                right = edges[d, 0, g + 1, t] + edges[d, 1, g + 1, t]
                low = below[d, 0, g, t] + below[d, 1, g, t]
                least[d, 2, g] = min(least[d, 2, g], 0.5 * (min(left, right) + low))
    return CellTable(edges, below, above, least, largest, fine, splines)


@entry
def sags(table: Array, length: int, ahead: int) -> Array:
    """How far a periodic `table` (2, places) goes beyond a chord over `length` places that begins at a place, one
    before it or up to `ahead` after it; (2, places), in its unit."""
    zones, places = table.shape
    alone, found = np.zeros((zones, places)), np.zeros((zones, places))
    for z in range(zones):
        for i in range(places):
            left = table[z, i]
            rise = (table[z, (i + length) % places] - left) / length
            for k in range(1, length):
                j = i + k
                while j >= places:
                    j -= places
                alone[z, i] = max(alone[z, i], abs(table[z, j] - left - rise * k))
        for i in range(places):
            for k in range(-1, ahead + 1):
                found[z, i] = max(found[z, i], alone[z, (i + k) % places])
    return found


@entry
def extended_block(gearing: Gearing, matrix: Array, tables: CellTable, out: Array) -> None:
    """Fill `out` (n,) with the peak-to-peak (arcmin) of each row of `matrix` (n, 12), errors as in ERROR_NAMES.

    The drives are of `gearing`; `tables` holds the effects with one more axis in front, that of the directions of
    motion.
    """
    directions, _, edges, turns = tables.edges.shape
    circle = _circle(edges - 1, turns, gearing.advance)
    grid, every_cut, least = np.empty((ROWS, edges)), np.empty(MOST_CUTS), np.empty(2)
    for row in range(matrix.shape[0]):
        drive = drive_of(gearing, matrix[row])
        _fill_grid(drive, circle, tables.splines.cs, grid)
        cuts = every_cut[: _changes(drive, grid, every_cut)]
        least[:] = math.inf
        for d in range(directions):
            table = CellTable(
                tables.edges[d],
                tables.below[d],
                tables.above[d],
                tables.least[d],
                tables.largest[d],
                tables.fine[d],
                tables.splines,
            )
            _least_of_turns(drive, grid, cuts, table, circle, least)
        out[row] = -gearing.scale * (least[0] + least[1])
