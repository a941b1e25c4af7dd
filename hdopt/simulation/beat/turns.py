"""A cell in every turn, lanes along the turns: what the driving deviation cannot fall below there, nor exceed.

Over a cell each branch is taken as a straight line between what it is at the edges, with the FS teeth at the phase that
each turn has and the effects of that turn, those on the FS where either zone meets them; where the deepest rim of a
zone changes, the cell is parted. The driving deviation is the mean of both zones plus the size of half their gap:
convex, so that it is largest at an end, and least there or where the gap vanishes. What lines leave out is the slack.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hdopt.arrays import Singles
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.minima import GROUP
from hdopt.kinematics.lanes.motion import Design
from hdopt.kinematics.lanes.single import HALF, HUGE, ONE, TINY, ZERO, clipped, narrowed, unsigned
from hdopt.simulation.beat.edges import COSINE, GAP, OFF, SINE, STEP
from hdopt.simulation.beat.effects import KINDS, Beat
from hdopt.simulation.beat.on_fs import OnFs
from hdopt.simulation.turn.rows import PER_TURN

ON_FS_ROWS = 4
"""Rows of the room for what both zones meet on the FS at the ends of a piece."""


class Side(NamedTuple):
    """A drive as its cells are bounded: what it is at their `edges`, its `design`, the effects of a `beat`, at first
    order the constants of t and d, mm of arc; for the least driving deviation, or (`high`) for the greatest, negative.
    """

    edges: Singles
    design: Design
    beat: Beat
    t_0: float
    d_0: float
    high: bool


class End(NamedTuple):
    """Mean of both zones and half their difference at an end of a piece: without what differs from turn to turn, and
    the FS teeth's sine and cosine parts, mm of arc; o' of both zones as the FS counts it, rad; its share of the cell.
    """

    mean: float
    mean_sine: float
    mean_cosine: float
    half: float
    half_sine: float
    half_cosine: float
    one: float
    two: float
    share: float


@compiled
def _line(edges: Singles, here: int, after: int, x: float) -> float:
    """What lies at a share x of the way from one place of the edges to another."""
    found: float = edges[here] + x * (edges[after] - edges[here])
    return found


@compiled
def end_of(edges: Singles, g: int, one: int, two: int, x: float) -> End:
    """Branches `one` and `two` at a share `x` of cell `g`, from the `edges` of a drive."""
    here = unsigned((g // GROUP) * STEP + g % GROUP)
    after = unsigned(((g + 1) // GROUP) * STEP + (g + 1) % GROUP)
    a, b = unsigned(one * GROUP), unsigned(two * GROUP)
    sine, cosine, off = unsigned(SINE), unsigned(COSINE), unsigned(OFF)
    u, w = _line(edges, here + a, after + a, x), _line(edges, here + b, after + b, x)
    us, ws = _line(edges, here + a + sine, after + a + sine, x), _line(edges, here + b + sine, after + b + sine, x)
    uc, wc = (
        _line(edges, here + a + cosine, after + a + cosine, x),
        _line(edges, here + b + cosine, after + b + cosine, x),
    )
    o_one, o_two = _line(edges, here + a + off, after + a + off, x), _line(edges, here + b + off, after + b + off, x)
    mean, half = HALF * (u + w), HALF * (u - w)
    return End(mean, HALF * (us + ws), HALF * (uc + wc), half, HALF * (us - ws), HALF * (uc - wc), o_one, o_two, x)


@compiled
def met_place(end: End, g: int, design: Design, cells: int, off: float) -> float:
    """Where on the FS, in turns from 0 to 1, a zone whose o' is `off` (rad) stands in the first turn at an `end` of a
    piece of cell `g` of so many `cells`, under a `design`."""
    turned = design.advance * ((narrowed(g) + end.share) / narrowed(cells)) + off * PER_TURN
    found: float = turned - np.floor(turned)
    return found


@compiled
def _row_of(on_fs: OnFs, zone: int, side: int, place: float) -> int:
    """Where in the table a zone that stands at a `place` of the FS in the first turn begins to read; the `side` of the
    greatest is another table where cells have parts."""
    turns = len(on_fs.starts)
    at = place * narrowed(turns)
    tooth = min(int(at), turns - 1)
    row = min(int((at - narrowed(tooth)) * narrowed(on_fs.rows)), on_fs.rows - 1)
    start: int = ((2 * side + zone) * on_fs.rows + row) * on_fs.length + on_fs.starts[unsigned(tooth)]
    return start


@compiled
def _meet_fs(table: Singles, starts: tuple[int, int], room: Singles, kind: int) -> None:
    """Put what both zones meet on the FS in every turn into the row `kind` of `room` and the next one: the mean of what
    the `table` holds from either of `starts` on, and half the difference."""
    turns = len(room) // ON_FS_ROWS
    one, two, mean, half = (
        unsigned(starts[0]),
        unsigned(starts[1]),
        unsigned(kind * turns),
        unsigned((kind + 1) * turns),
    )
    for lane in range(turns):
        j = unsigned(lane)
        room[mean + j] = HALF * (table[one + j] + table[two + j])
    for lane in range(turns):
        j = unsigned(lane)
        room[half + j] = HALF * (table[one + j] - table[two + j])


@compiled
def _at_ends(rows: Singles, size: int, at: int, j: int, left: End, right: End) -> tuple[float, float, float, float]:
    """The zones' mean at both ends of a piece in turn `j` of `size`, then half their difference, with the effects whose
    `rows` begin `at`; the first two rows are the FS phases."""
    cos, sin, to = rows[j], rows[size + j], at + unsigned(KINDS) * size
    mean, half = rows[at + j], rows[at + size + j]
    mean_on, half_on = rows[to + j] - mean, rows[to + size + j] - half
    return (
        left.mean + cos * left.mean_sine + sin * left.mean_cosine + mean + left.share * mean_on,
        right.mean + cos * right.mean_sine + sin * right.mean_cosine + mean + right.share * mean_on,
        left.half + cos * left.half_sine + sin * left.half_cosine + half + left.share * half_on,
        right.half + cos * right.half_sine + sin * right.half_cosine + half + right.share * half_on,
    )


@compiled
def _least(m0: float, m1: float, d0: float, d1: float) -> float:
    """The least of the mean and the size of half the difference, both straight lines between two ends."""
    on = d1 - d0
    x = clipped(-d0 / (on if abs(on) > TINY else TINY), ZERO, ONE)
    return min(m0 + abs(d0), m1 + abs(d1), m0 + x * (m1 - m0) + abs(d0 + x * on))


@compiled
def _lower(rows: Singles, start: int, left: End, right: End, out: Singles) -> None:
    """Lower `out` (turns,) to the least of a piece in every turn, with the effects whose `rows` begin at `start`."""
    size, at = unsigned(len(out)), unsigned(start)
    slack = at + unsigned(2) * size
    for lane in range(len(out)):
        j = unsigned(lane)
        m0, m1, d0, d1 = _at_ends(rows, size, at, j, left, right)
        out[j] = min(out[j], _least(m0, m1, d0, d1) - rows[slack + j])


@compiled
def _raise(rows: Singles, start: int, left: End, right: End, out: Singles) -> None:
    """Lower `out` (turns,) to the negative of the greatest of the same."""
    size, at = unsigned(len(out)), unsigned(start)
    slack = at + unsigned(3) * size
    for lane in range(len(out)):
        j = unsigned(lane)
        m0, m1, d0, d1 = _at_ends(rows, size, at, j, left, right)
        out[j] = min(out[j], -max(m0 + abs(d0), m1 + abs(d1)) - rows[slack + j])


@compiled
def _at_ends_on_fs(
    rows: Singles, on_fs: Singles, begins: tuple[int, int, int], j: int, left: End, right: End
) -> tuple[float, float, float, float]:
    """The same as `_at_ends` with what is met on the FS: `begins` are the number of turns, where the effects' rows
    begin, and where what is met at the piece's end does."""
    size, at, then = begins
    m0, m1, d0, d1 = _at_ends(rows, size, at, j, left, right)
    return m0 + on_fs[j], m1 + on_fs[then + j], d0 + on_fs[size + j], d1 + on_fs[then + size + j]


@compiled
def _lower_on_fs(
    rows: Singles, start: int, on_fs: Singles, after: int, left: End, right: End, beyond: float, out: Singles
) -> None:
    """The same as `_lower` with what is met on the FS at the piece's start, and at its end in the row `after`; it goes
    as far as `beyond` below its chord."""
    size, at, then = unsigned(len(out)), unsigned(start), unsigned(after * len(out))
    slack = at + unsigned(2) * size
    for lane in range(len(out)):
        j = unsigned(lane)
        m0, m1, d0, d1 = _at_ends_on_fs(rows, on_fs, (size, at, then), j, left, right)
        out[j] = min(out[j], _least(m0, m1, d0, d1) - rows[slack + j] - beyond)


@compiled
def _raise_on_fs(
    rows: Singles, start: int, on_fs: Singles, after: int, left: End, right: End, beyond: float, out: Singles
) -> None:
    """The same as `_raise` with what is met on the FS."""
    size, at, then = unsigned(len(out)), unsigned(start), unsigned(after * len(out))
    slack = at + unsigned(3) * size
    for lane in range(len(out)):
        j = unsigned(lane)
        m0, m1, d0, d1 = _at_ends_on_fs(rows, on_fs, (size, at, then), j, left, right)
        out[j] = min(out[j], -max(m0 + abs(d0), m1 + abs(d1)) - rows[slack + j] - beyond)


@compiled
def _bound_piece(
    drive: Side, g: int, room: Singles, branches: tuple[int, int], ends: tuple[float, float], out: Singles
) -> None:
    """Lower `out` to what the two branches do in a part of cell g."""
    edges, beat, high, bounds = drive.edges, drive.beat, drive.high, drive.beat.bounds
    (one, two), (first, last) = branches, ends
    left, right = end_of(edges, g, one, two, first), end_of(edges, g, one, two, last)
    start = (2 + KINDS * g) * len(out)
    if len(room):
        cells, windows = len(beat.turn.scan.below), beat.parts.each > 1
        # The least and the greatest of a cell that begins where this one does bound all of it.
        side, table, beyond = (1 if windows and high else 0), beat.on_fs.table, beat.on_fs.left
        for each in range(1 if windows else 2):
            at = end_of(edges, g, one, two, ZERO if windows else (last if each else first))
            here = _row_of(beat.on_fs, 0, side, met_place(at, g, drive.design, cells, at.one))
            there = _row_of(beat.on_fs, 1, side, met_place(at, g, drive.design, cells, at.two))
            _meet_fs(table, (here, there), room, 2 * each)
        if high:
            _raise_on_fs(bounds, start, room, 0 if windows else 2, left, right, beyond, out)
        else:
            _lower_on_fs(bounds, start, room, 0 if windows else 2, left, right, beyond, out)
    elif high:
        _raise(bounds, start, left, right, out)
    else:
        _lower(bounds, start, left, right, out)


@compiled
def _change(edges: Singles, g: int, row: int) -> tuple[int, int, float]:
    """Which rim of a zone is deepest at the start of cell g (0 the upper one) and at its end, and where it changes, as
    a share of the cell; 1 where it does not."""
    here = edges[unsigned((g // GROUP) * STEP + g % GROUP + row)]
    after = edges[unsigned(((g + 1) // GROUP) * STEP + (g + 1) % GROUP + row)]
    before, then = (0 if here >= ZERO else 1), (0 if after >= ZERO else 1)
    return before, then, (here / (here - after) if before != then else ONE)


class Changes(NamedTuple):
    """Of both zones of a cell: which rim is deepest at its start, which at its end, and where that changes, as a share
    of the cell."""

    one: int
    one_then: int
    x_one: float
    two: int
    two_then: int
    x_two: float


@compiled
def changes_of(edges: Singles, g: int) -> Changes:
    """Where in cell `g` of the `edges` of a drive the rims change."""
    one, one_then, x_one = _change(edges, g, GAP)
    two, two_then, x_two = _change(edges, g, GAP + GROUP)
    return Changes(one, one_then, x_one, two, two_then, x_two)


@compiled
def piece_of(changes: Changes, piece: int) -> tuple[float, float, int, int]:
    """A `piece` of the three that a cell with these `changes` has at most: where it begins and ends, as shares of the
    cell, and the branches of both zones there. Where there are fewer it ends where it begins."""
    c = changes
    first, last = min(c.x_one, c.x_two), max(c.x_one, c.x_two)
    start = ZERO if piece == 0 else (first if piece == 1 else last)
    end = first if piece == 0 else (last if piece == 1 else ONE)
    return start, end, (c.one if start < c.x_one else c.one_then), 2 + (c.two if start < c.x_two else c.two_then)


@compiled
def bound_turns(drive: Side, g: int, room: Singles, out: Singles) -> bool:
    """Fill `out` (turns, padded) with the least that a side of a `drive` has in cell `g` of every turn, mm of arc less
    what the effects' lines leave out; `room` has room for ON_FS_ROWS where some stand on the FS, or for none. Whether a
    rim changes: then what is found need not be met."""
    for j in range(len(out)):
        out[j] = HUGE
    changes = changes_of(drive.edges, g)
    # One loop, since each piece would else be compiled for itself.
    for piece in range(3):
        start, end, one, two = piece_of(changes, piece)
        if piece == 0 or end > start:
            _bound_piece(drive, g, room, (one, two), (start, end), out)
    return min(changes.x_one, changes.x_two) < ONE
