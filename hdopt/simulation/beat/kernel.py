"""The compiled peak-to-peak of many drives with effects that differ from turn to turn, in a few microseconds each.

As with effects that repeat (`simulation.turn`), blocks of 128 drives in single precision: all cells of one turn are
bounded, over all turns at once. Cells that may hold an extreme are taken for one drive in every turn, lanes along the
turns (`beat.turns`), and what still may hold one is looked at in dense lists (`beat.looks`). A drive's value depends on
nothing but its own errors. Numba's cache looks at this file's date alone: touch it where another part changes.
"""

from __future__ import annotations

import numpy as np

from hdopt.arrays import Array, Index, Singles
from hdopt.kinematics.compiled_closed_form import compiled, entry
from hdopt.kinematics.kernel import describe
from hdopt.kinematics.lanes.candidates import at_most, first_order, second_order
from hdopt.kinematics.lanes.minima import GROUP
from hdopt.kinematics.lanes.motion import LANES, Design, motion_of, teeth_of
from hdopt.kinematics.lanes.single import HUGE, ZERO, narrowed, single
from hdopt.simulation.beat.edges import ON_CIRCLE, ROWS, fill_edges
from hdopt.simulation.beat.effects import KINDS, OFFSET, Beat
from hdopt.simulation.beat.gather import Room, gather
from hdopt.simulation.beat.looks import IN, PHASE, look_again, look_at_list
from hdopt.simulation.beat.parts import PartRoom
from hdopt.simulation.beat.turns import ON_FS_ROWS
from hdopt.simulation.turn.rows import (
    ANGLE,
    BOUNDS,
    GREATEST,
    LEAST,
    LIST,
    OFFSETS,
    SLACK,
    SLACK_OF_PARTS,
    middle,
)
from hdopt.simulation.turn.scan import fill_parts, scan

FAR, BENT, THIRD = single(OFFSET), single(4.0), single(1 / 3)
"""Where effects on the FS are not looked at; how much faster than the errors terms of second order turn, squared."""


@compiled
def _fill_slack(work: Singles, design: Design, beat: Beat) -> None:
    """Fill how far a branch may lie beyond a straight line over a cell, and bound the offsets."""
    for i in range(LANES):
        m, teeth = motion_of(work, i, design), teeth_of(work, i)
        f, second = first_order(m, teeth, design.tan_alpha), second_order(m, teeth, design)
        swing = at_most(f.t_cos, f.t_sin) + at_most(f.d_cos, f.d_sin) + teeth.fs
        across = at_most(m.el_cos, m.el_sin) + abs(m.el_0) + at_most(m.tl_cos, m.tl_sin) + abs(m.tl_0)
        off = across * design.rim.per_flatness
        work[i + OFFSETS] = off
        sag, far = beat.turn.scan.sag, (beat.fs_range if off > FAR else ZERO)
        work[i + SLACK] = sag * (swing + BENT * second) + far
        # A parabola leaves the third order out, a sixth of the width or so as much as the second.
        work[i + SLACK_OF_PARTS] = (
            sag * (beat.turn.scan.half * THIRD * swing + BENT * second + beat.turn.cs_range) + far
        )


@compiled
def _queue(queue: Index, waiting: int, room: Room, count: int, below: float, i: int) -> int:
    """Queue of the `count` cells and turns noted of lane i those not above `below`: how many are waiting."""
    values, cells, at = room.values, room.cells, room.at
    for k in range(count):
        if values[k] <= below:
            queue[0, waiting], queue[1, waiting], queue[2, waiting] = i, cells[k], at[k]
            waiting += 1
    return waiting


@compiled
def _look(work: Singles, room: Room, design: Design, beat: Beat, side: int, waiting: int, fewest: int) -> int:
    """Look at what is waiting for a `side` while there are `fewest` at least: at the middle of a cell in a turn; later
    cells are seen from the next turn. How many are left."""
    lanes, queue, phases = room.lanes, room.queue[side], beat.phases
    cells = len(beat.turn.scan.below) * beat.parts.each
    done = 0
    while waiting - done >= fewest:
        count = min(LANES, waiting - done)
        for k in range(count):
            angle, turn = middle(narrowed(queue[1, done + k]), cells), queue[2, done + k]
            after = turn + 1 if turn + 1 < len(phases) else 0
            at = after if angle < ZERO else turn
            work[LIST + ANGLE + k], work[LIST + IN + k], work[LIST + PHASE + k] = angle, narrowed(at), phases[at]
            lanes[k] = queue[0, done + k]
        look_at_list(work, lanes, count, design, beat, side == 1)
        done += count
    for k in range(waiting - done):
        for row in range(3):
            queue[row, k] = queue[row, done + k]
    return waiting - done


@compiled
def _find(work: Singles, room: Room, design: Design, beat: Beat) -> None:
    """Fill the least of the drives of `work`, and the negative of the greatest."""
    cells, waiting = len(beat.turn.scan.below), room.waiting
    waiting[0] = waiting[1] = 0
    for i in range(LANES):
        work[LEAST + i], work[GREATEST + i] = HUGE, HUGE
    # Sides and numbers of places are counted, not written out: each of them would be compiled for itself.
    fewest = len(room.lanes)
    for i in range(LANES):
        fill_edges(room.edges, work, i, design, beat.circle, beat.turn.cs, cells)
        for side in range(2):
            count, below = gather(work, room, i, design, beat, side == 1)
            waiting[side] = _queue(room.queue[side], waiting[side], room, count, below, i)
            if waiting[side] >= fewest:
                waiting[side] = _look(work, room, design, beat, side, waiting[side], fewest)
    for side in range(2):
        _look(work, room, design, beat, side, waiting[side], len(waiting) // 2)


@entry
def beat_block(design: Design, matrix: Array, beat: Beat, out: Array) -> None:
    """Lower `out` (n, 2), mm of arc, to the least driving deviation of each row of `matrix` (n, 12), and to the
    negative of the greatest, with the effects of a `beat`.

    `design` is what the drives share. Rows hold errors in the order of ERROR_NAMES, mm and rad; valid where the closed
    form is.
    """
    n, names = matrix.shape
    cells, turns = len(beat.turn.scan.below), len(beat.bounds) // (2 + KINDS * len(beat.turn.scan.cos))
    work = np.zeros(BOUNDS + 2 * LANES * cells, np.float32)
    every, each = cells * turns * beat.parts.each, beat.parts.each
    values, at = np.empty(every, np.float32), np.empty(every, np.int64)
    edges, effects = (
        np.zeros(ROWS * len(beat.circle) // ON_CIRCLE, np.float32),
        np.zeros(ON_FS_ROWS * turns if len(beat.fs) else 0, np.float32),
    )
    queue = np.empty((2, 3, every + LANES), np.int64)
    lanes, of_cell = np.zeros(LANES, np.int64), np.empty(turns, np.float32)
    of_part, edge = np.empty(every, np.int64), GROUP * ((each + GROUP - 1) // GROUP + 1)
    parts = PartRoom(
        np.zeros(edge, np.float32),
        np.zeros(edge, np.float32),
        np.zeros(edge, np.float32),
        np.zeros(edge, np.float32),
        np.zeros(edge, np.float32),
    )
    room = Room(lanes, edges, effects, of_cell, parts, values, of_part, at, queue, np.zeros(2, np.int64))
    errors = np.zeros(names * LANES)
    for start in range(0, n, LANES):
        count = min(LANES, n - start)
        for name in range(names):
            for i in range(count):
                errors[name * LANES + i] = matrix[start + i, name]
        # The last block's spare lanes keep what they held: drives of the block before, or none.
        describe(errors, work)
        fill_parts(work, design, beat.turn)
        _fill_slack(work, design, beat)
        scan(work, beat.turn)
        _find(work, room, design, beat)
        look_again(work, room.lanes, design, beat)
        for i in range(count):
            out[start + i, 0] = min(out[start + i, 0], work[LEAST + i])
            out[start + i, 1] = min(out[start + i, 1], work[GREATEST + i])
