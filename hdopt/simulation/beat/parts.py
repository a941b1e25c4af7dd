"""A cell in one turn, lanes along its parts: for effects whose waves or pulses are shorter than a cell.

Over the cell a branch is a parabola between what it is at the edges, curved as its terms of first order are; effects
are taken at each part's edges, those on the FS where either zone meets them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hdopt.arrays import Singles
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.minima import GROUP
from hdopt.kinematics.lanes.single import HALF, HUGE, ONE, TINY, TURN, TWO, ZERO, clipped, narrowed, unsigned
from hdopt.simulation.beat.effects import KINDS, Beat
from hdopt.simulation.beat.turns import End, Side, changes_of, end_of, met_place, piece_of
from hdopt.simulation.turn.rows import PER_TURN

PER_SAG = TWO + TWO
"""How much more than w^2/8 is w^2/2."""


class PartRoom(NamedTuple):
    """Room for the edges of a cell's parts in whole groups, one more than parts have: the zones' mean and half their
    difference, where on the table of the FS either stands, and what parts hold at least."""

    mean: Singles
    half: Singles
    one: Singles
    two: Singles
    least: Singles


@compiled
def _fill_places(beat: Beat, room: PartRoom, one: tuple[float, float], two: tuple[float, float]) -> None:
    """Put the places of the table of the FS that either zone meets at the parts' edges into `room`: in turns, it passes
    from the first number on the second of them in the cell."""
    places, others, n, per = room.one, room.two, narrowed(len(beat.fs)), ONE / narrowed(beat.parts.each)
    from_one, by_one, from_two, by_two = one[0], one[1] * per, two[0], two[1] * per
    for lane in range(len(places)):
        j, x = unsigned(lane), narrowed(lane)
        a, b = from_one + x * by_one, from_two + x * by_two
        places[j], others[j] = (a - np.floor(a)) * n, (b - np.floor(b)) * n


@compiled
def _of_table(table: Singles, column: int, place: float, per: float) -> float:
    """What a zone meets of a `table` of the FS, `per` rad a place, at a `place`."""
    j = int(place + HALF)
    x = (place - narrowed(j)) * per
    j = unsigned(j - len(table) if j >= len(table) else j)
    found: float = table[j, column] + x * (table[j, column + 1] + HALF * x * table[j, column + 2])
    return found


@compiled
def _meet_fs(beat: Beat, room: PartRoom) -> None:
    """Add to the mean and half the difference in `room` what stands on the FS at the places in it."""
    mean, half, places, others = room.mean, room.half, room.one, room.two
    table, per = beat.fs, TURN / narrowed(len(beat.fs))
    for k in range(beat.parts.each + 1):
        j = unsigned(k)
        one, two = _of_table(table, 0, places[j], per), _of_table(table, 3, others[j], per)
        mean[j] += HALF * (one + two)
        half[j] += HALF * (one - two)


@compiled
def _fill_row(fixed: Singles, at: int, out: Singles, each: int, ends: tuple[float, float], bow: float) -> None:
    """Fill `out` at the edges of `each` part with a zone's mean or half their difference: what it is at both ends of
    the cell, how far it bows between, and the effects that do not stand on the FS, which begin `at` in `fixed`."""
    start, per, first, by = unsigned(at), ONE / narrowed(each), ends[0], ends[1] - ends[0]
    for lane in range(len(out)):
        j, x = unsigned(lane), narrowed(lane) * per
        out[j] = first + x * by + x * (ONE - x) * bow + fixed[start + j]


@compiled
def _bound(beat: Beat, room: PartRoom, first: float, last: float, high: bool) -> None:
    """Lower the least in `room` in the parts from `first` to `last` to what they hold, or (`high`) to the negative of
    the greatest."""
    mean, half, least, beyond = room.mean, room.half, room.least, beat.parts.beyond
    for lane in range(len(least) - GROUP):
        j, after, number = unsigned(lane), unsigned(lane + 1), narrowed(lane)
        m0, m1, d0, d1 = mean[j], mean[after], half[j], half[after]
        on = d1 - d0
        x = clipped(-d0 / (on if abs(on) > TINY else TINY), ZERO, ONE)
        one, two = m0 + abs(d0), m1 + abs(d1)
        value = -max(one, two) if high else min(min(one, two), m0 + x * (m1 - m0) + abs(d0 + x * on))
        inside = number + ONE > first and number < last
        least[j] = min(least[j], (value - beyond) if inside else HUGE)


@compiled
def _in_turn(end: End, cos: float, sin: float) -> End:
    """An end with the FS teeth of the turn that has this cosine and sine of the FS phase."""
    sine, across = cos * end.mean_sine + sin * end.mean_cosine, cos * end.half_sine + sin * end.half_cosine
    return End(end.mean + sine, sine, ZERO, end.half + across, across, ZERO, end.one, end.two, end.share)


@compiled
def bound_parts(drive: Side, g: int, turn: int, room: PartRoom) -> None:
    """Fill the least of `room` with what a side of a `drive` has in each part of cell `g` in a `turn`, mm of arc less
    what is left out of lines."""
    edges, design, beat, t_0, d_0, high = drive
    each, cells = beat.parts.each, len(beat.turn.scan.below)
    turns, at = len(beat.bounds) // (2 + KINDS * (cells + 1)), (turn * cells + g) * (each + 1) * beat.parts.kinds
    cos, sin, sag = beat.bounds[turn], beat.bounds[turns + turn], beat.turn.scan.sag
    for j in range(len(room.least)):
        room.least[j] = HUGE
    changes = changes_of(edges, g)
    for piece in range(3):
        start, end, one, two = piece_of(changes, piece)
        if piece > 0 and end <= start:
            continue
        left = _in_turn(end_of(edges, g, one, two, ZERO), cos, sin)
        right = _in_turn(end_of(edges, g, one, two, ONE), cos, sin)
        # f'' is -(f - c) for what turns with the input, and (Z_CS/Z_FS)^2 times that for the FS teeth.
        upper, lower = (t_0 if one == 0 else -t_0), (t_0 if two == 2 else -t_0)
        of_mean = HALF * (left.mean + right.mean - upper - lower)
        of_half = HALF * (left.half + right.half - upper + lower) - d_0
        faster = HALF * (design.advance * design.advance - ONE)
        of_mean += faster * (left.mean_sine + right.mean_sine)
        of_half += faster * (left.half_sine + right.half_sine)
        fixed, kinds, zeros = beat.parts.fixed, beat.parts.kinds, beat.parts.zeros
        mean_at, half_at = (at if kinds > 0 else zeros), (at + each + 1 if kinds > 1 else zeros)
        _fill_row(fixed, mean_at, room.mean, each, (left.mean, right.mean), PER_SAG * sag * of_mean)
        _fill_row(fixed, half_at, room.half, each, (left.half, right.half), PER_SAG * sag * of_half)
        if len(beat.fs):
            turned = PER_TURN * beat.phases[turn]
            a, b = met_place(left, g, design, cells, left.one), met_place(left, g, design, cells, left.two)
            on = design.advance / narrowed(cells)
            first = (a + turned, on + PER_TURN * (right.one - left.one))
            _fill_places(beat, room, first, (b + turned, on + PER_TURN * (right.two - left.two)))
            _meet_fs(beat, room)
        _bound(beat, room, start * narrowed(each), end * narrowed(each), high)
