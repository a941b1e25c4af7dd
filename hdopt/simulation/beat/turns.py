"""A cell in every turn, lanes along the turns: what the driving deviation cannot fall below there, nor exceed.

Over a cell each branch is taken as a straight line between what it is at the edges, with the FS teeth at the phase that
each turn has and the effects of that turn; where the deepest rim of a zone changes, the cell is parted. The driving
deviation is the mean of both zones plus the size of half their gap: convex, so that it is largest at an end, and least
there or where the gap vanishes. What lines leave out is the slack.
"""

from __future__ import annotations

from typing import NamedTuple

from hdopt.arrays import Singles
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.minima import GROUP
from hdopt.kinematics.lanes.single import HALF, HUGE, ONE, TINY, ZERO, clipped, unsigned
from hdopt.simulation.beat.edges import COSINE, GAP, OFF, SINE, STEP
from hdopt.simulation.beat.effects import KINDS


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
def _end(edges: Singles, g: int, one: int, two: int, x: float) -> End:
    """Branches `one` and `two` at a share x of cell g."""
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
def _meet_fs(rows: Singles, start: int, end: End, kind: int, room: Singles, side: int) -> None:
    """Put into `room`, for a side of a piece, the row of a `kind` of the effects at an end of it: the mean (0) or half
    the difference (1) with those on the FS where its zones meet them. More streams than one at a time the compiler
    does not tell apart."""
    turns = len(room) // (2 * KINDS)
    size, to = unsigned(turns), unsigned((side * KINDS + kind) * turns)
    step, share, one = unsigned(KINDS * turns), end.share, HALF * end.one
    two = -HALF * end.two if kind else HALF * end.two
    first, slope = unsigned(start + kind * turns), unsigned(start + 3 * turns)
    for group in range(turns // GROUP):
        for lane in range(GROUP):
            j = unsigned(group * GROUP + lane)
            at, a, b = first + j, slope + j, slope + size + j
            value = rows[at] + share * (rows[at + step] - rows[at])
            value += one * (rows[a] + share * (rows[a + step] - rows[a]))
            room[to + j] = value + two * (rows[b] + share * (rows[b + step] - rows[b]))


@compiled
def _loosen_fs(rows: Singles, start: int, off: float, room: Singles) -> None:
    """Put into `room` how far the effects go beyond their chords where o' is at most `off`, rad."""
    turns, squared = len(room) // (2 * KINDS), off * off
    sag, bend, to = unsigned(start + 2 * turns), unsigned(start + 5 * turns), unsigned(2 * turns)
    for group in range(turns // GROUP):
        for lane in range(GROUP):
            j = unsigned(group * GROUP + lane)
            room[to + j] = rows[sag + j] + squared * rows[bend + j]


@compiled
def _at_ends(
    phases: Singles, rows: Singles, size: int, at: int, j: int, left: End, right: End
) -> tuple[float, float, float, float]:
    """The zones' mean at both ends of a piece in turn `j` of `size`, then half their difference, with the effects whose
    `rows` begin `at`."""
    cos, sin, to = phases[j], phases[size + j], at + unsigned(KINDS) * size
    mean, half = rows[at + j], rows[at + size + j]
    mean_on, half_on = rows[to + j] - mean, rows[to + size + j] - half
    return (
        left.mean + cos * left.mean_sine + sin * left.mean_cosine + mean + left.share * mean_on,
        right.mean + cos * right.mean_sine + sin * right.mean_cosine + mean + right.share * mean_on,
        left.half + cos * left.half_sine + sin * left.half_cosine + half + left.share * half_on,
        right.half + cos * right.half_sine + sin * right.half_cosine + half + right.share * half_on,
    )


@compiled
def _lower(phases: Singles, rows: Singles, start: int, left: End, right: End, out: Singles) -> None:
    """Lower `out` (turns,) to the least of a piece in every turn, with the effects whose `rows` begin at `start`."""
    size, at = unsigned(len(out)), unsigned(start)
    slack = at + unsigned(2) * size
    for group in range(len(out) // GROUP):
        for lane in range(GROUP):
            j = unsigned(group * GROUP + lane)
            m0, m1, d0, d1 = _at_ends(phases, rows, size, at, j, left, right)
            on = d1 - d0
            x = clipped(-d0 / (on if abs(on) > TINY else TINY), ZERO, ONE)
            least = min(m0 + abs(d0), m1 + abs(d1), m0 + x * (m1 - m0) + abs(d0 + x * on))
            out[j] = min(out[j], least - rows[slack + j])


@compiled
def _raise(phases: Singles, rows: Singles, start: int, left: End, right: End, out: Singles) -> None:
    """Lower `out` (turns,) to the negative of the greatest of the same."""
    size, at = unsigned(len(out)), unsigned(start)
    slack = at + unsigned(2) * size
    for group in range(len(out) // GROUP):
        for lane in range(GROUP):
            j = unsigned(group * GROUP + lane)
            m0, m1, d0, d1 = _at_ends(phases, rows, size, at, j, left, right)
            out[j] = min(out[j], -max(m0 + abs(d0), m1 + abs(d1)) - rows[slack + j])


@compiled
def _sharing(end: End, x: float) -> End:
    e = end
    return End(e.mean, e.mean_sine, e.mean_cosine, e.half, e.half_sine, e.half_cosine, e.one, e.two, x)


@compiled
def _bound_piece(
    edges: Singles,
    g: int,
    bounds: Singles,
    room: Singles,
    high: bool,
    branches: tuple[int, int],
    ends: tuple[float, float],
    out: Singles,
) -> None:
    """Lower `out` to what the two branches do in a part of cell g."""
    (one, two), (first, last), turns = branches, ends, len(out)
    left, right = _end(edges, g, one, two, first), _end(edges, g, one, two, last)
    start = (2 + KINDS * g) * turns
    if len(room):
        for each in range(4):
            _meet_fs(bounds, start, left if each < 2 else right, each % 2, room, each // 2)
        off = max(max(abs(left.one), abs(left.two)), max(abs(right.one), abs(right.two)))
        _loosen_fs(bounds, start, off, room)
        left, right = _sharing(left, ZERO), _sharing(right, ONE)
        if high:
            _raise(bounds, room, 0, left, right, out)
        else:
            _lower(bounds, room, 0, left, right, out)
    elif high:
        _raise(bounds, bounds, start, left, right, out)
    else:
        _lower(bounds, bounds, start, left, right, out)


@compiled
def _change(edges: Singles, g: int, row: int) -> tuple[int, int, float]:
    """Which rim of a zone is deepest at the start of cell g (0 the upper one) and at its end, and where it changes, as
    a share of the cell; 1 where it does not."""
    here = edges[unsigned((g // GROUP) * STEP + g % GROUP + row)]
    after = edges[unsigned(((g + 1) // GROUP) * STEP + (g + 1) % GROUP + row)]
    before, then = (0 if here >= ZERO else 1), (0 if after >= ZERO else 1)
    return before, then, (here / (here - after) if before != then else ONE)


@compiled
def bound_turns(edges: Singles, g: int, bounds: Singles, room: Singles, high: bool, out: Singles) -> bool:
    """Fill `out` (turns, padded) with the least driving deviation in cell `g` of every turn, mm of arc less what the
    effects' lines leave out, or (`high`) with that of its negative: with those `edges` of the drive and these `bounds`
    of the effects; `room` has room for two edges of them where some stand on the FS, or for none. Whether a
    rim changes: then what is found need not be met."""
    for j in range(len(out)):
        out[j] = HUGE
    one, one_then, x_one = _change(edges, g, GAP)
    two, two_then, x_two = _change(edges, g, GAP + GROUP)
    first, start = min(x_one, x_two), ZERO
    # One loop, since each piece would else be compiled for itself.
    for piece in range(3):
        end = first if piece == 0 else (max(x_one, x_two) if piece == 1 else ONE)
        if piece == 0 or end > start:
            branches = (one if start < x_one else one_then, 2 + (two if start < x_two else two_then))
            _bound_piece(edges, g, bounds, room, high, branches, (start, end), out)
        start = end
    return first < ONE
