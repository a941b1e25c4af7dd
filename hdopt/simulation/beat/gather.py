"""What of one drive is to be looked at: the cells and turns, or parts of them, whose bounds may hold an extreme.

A cell that the scan leaves is bounded in every turn, the best first: an extreme lies not far above its bound, so that
from then on few are left. Where effects are shorter than a cell that says little; there the parts of what is left are
bounded as well, and tell.
"""

from __future__ import annotations

from typing import NamedTuple

from hdopt.arrays import Index, Singles
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.minima import GROUP
from hdopt.kinematics.lanes.motion import FS, FS_PHASE, LANES, Design
from hdopt.kinematics.lanes.single import HUGE, ONE, TWO, ZERO, sine_cosine, unsigned
from hdopt.simulation.beat.effects import KINDS, Beat
from hdopt.simulation.beat.on_fs import WINDOWS
from hdopt.simulation.beat.parts import PartRoom, bound_parts
from hdopt.simulation.beat.turns import Side, bound_turns
from hdopt.simulation.turn.rows import (
    BOUNDS,
    D_0,
    HIGHEST_AT,
    LOWEST_AT,
    MARGIN,
    PER_TURN,
    SLACK,
    SLACK_OF_PARTS,
    T_0,
    folded,
)


class Room(NamedTuple):
    """Room for a list of lanes (LANES,), a drive at all edges, what a piece meets on the FS, a cell's bounds in every
    turn, the parts of a cell in one turn; for what may be looked at of one drive: bounds, cells or parts, and turns;
    and lane, cell or part, and turn of what is to be, of both sides, (2, 3, n), and how many that are (2,)."""

    lanes: Index
    edges: Singles
    effects: Singles
    turns: Singles
    parts: PartRoom
    values: Singles
    cells: Index
    at: Index
    queue: Index
    waiting: Index


@compiled
def _any(found: Singles, below: float) -> bool:
    """Whether any of what was `found` goes `below` what must be."""
    count = 0
    for j in range(len(found)):
        count += 1 if found[j] < below else 0
    return count > 0


@compiled
def _note(room: Room, g: int, bounds: Singles, count: int, slack: float, below: float) -> tuple[int, float]:
    """Note after `count` others the turns in which cell `g` goes `below` what must be: how many are noted then, and
    what must be now, since the deviation itself lies not far above its bound."""
    turns, size = room.turns, len(room.turns)
    for j in range(size if _any(turns, below) else 0):
        value = turns[j]
        if value < below:
            room.values[count], room.cells[count], room.at[count] = value, g, j
            count += 1
            below = min(below, value + slack + bounds[2 * size + j] + bounds[3 * size + j])
    return count, below


@compiled
def _note_parts(room: Room, at: tuple[int, int, int], each: int, slack: float, below: float) -> tuple[int, float]:
    """The same of the parts of a cell in a turn, with how many others is in `at`: of neighbours the best stands for
    both."""
    found, (g, turn, count) = room.parts.least, at
    for part in range(each if _any(found, below) else 0):
        value = found[part]
        if value >= below:
            continue
        before, after = found[part - 1] if part else HUGE, found[part + 1] if part + 1 < each else HUGE
        # Neighbours that meet in the best place are equal: the first stands for both.
        if value < before and value <= after:
            room.values[count], room.cells[count], room.at[count] = value, g * each + part, turn
            count += 1
            below = min(below, value + slack)
    return count, below


@compiled
def _most_on_fs(work: Singles, i: int, beat: Beat, room: Singles) -> float:
    """How far effects and FS teeth together stay below the sum of their greatest in the drive of lane `i`, mm of
    arc; `room` has room for a group."""
    on_fs, fs = beat.on_fs, work[i + FS]
    sin, cos = sine_cosine(folded(work[i + FS_PHASE] * PER_TURN))
    # A row of lanes first: the compiler keeps the order in which it compares.
    for lane in range(GROUP):
        room[lane] = -HUGE
    for group in range(WINDOWS // GROUP):
        for lane in range(GROUP):
            k = unsigned(group * GROUP + lane)
            after, two = k + unsigned(1), k + unsigned(WINDOWS)
            here = fs * (on_fs.sin[k] * cos + on_fs.cos[k] * sin)
            there = fs * (on_fs.sin[after] * cos + on_fs.cos[after] * sin)
            greatest = max(max(here, there) + on_fs.most[k], max(-here, -there) + on_fs.most[two])
            room[lane] = max(room[lane], greatest)
    most = room[0]
    for lane in range(1, GROUP):
        most = max(most, room[lane])
    less: float = fs + on_fs.highest - most - fs * on_fs.sag
    return less


@compiled
def _look_into(drive: Side, room: Room, at: tuple[int, int, int], allowed: float, below: float) -> tuple[int, float]:
    """Bound the parts of a cell in a turn, which `at` says with how many were noted before, and note what counts."""
    bound_parts(drive, at[0], at[1], room.parts)
    return _note_parts(room, at, drive.beat.parts.each, allowed, below)


@compiled
def _gather_parts(
    drive: Side, room: Room, at: tuple[int, int], slack: tuple[float, float], below: float, first: bool
) -> tuple[int, float]:
    """Note parts of a cell in the turns whose bound says that they may hold an extreme, the best turn of the first cell
    first, so that most of the others are not looked into: `at` says the cell and how many were noted before, `slack`
    how far above its bound the best of a part may lie, and how far below it that of a cell."""
    turns, (g, count), (allowed, deeper), best = room.turns, at, slack, 0
    if first:
        for j in range(len(turns)):
            best = j if turns[j] < turns[best] else best
        count, below = _look_into(drive, room, (g, best, count), allowed, below)
        turns[best] = HUGE
    for j in range(len(turns) if _any(turns, below + deeper) else 0):
        if turns[j] < below + deeper:
            count, below = _look_into(drive, room, (g, j, count), allowed, below)
    return count, below


@compiled
def gather(work: Singles, room: Room, i: int, design: Design, beat: Beat, high: bool) -> tuple[int, float]:
    """Note in `room` of lane `i` of `work`, a drive of a `design` with the effects of a `beat`, all cells and turns, or
    parts of them, that may hold the least (or, `high`, the greatest), the cell of the best bound first: how many, and
    what those must be below that do."""
    turns, bounds, each, cells = room.turns, beat.bounds, beat.parts.each, len(beat.turn.scan.below)
    slot, best = (LANES, int(work[HIGHEST_AT + i])) if high else (0, int(work[LOWEST_AT + i]))
    size, sign = len(turns), (-ONE if high else ONE)
    less = work[MARGIN + i] - (_most_on_fs(work, i, beat, turns) if high and len(beat.fs) else ZERO)
    slack, jump = TWO * (work[SLACK + i] + beat.on_fs.left), TWO * work[MARGIN + i]
    slack = TWO * (work[SLACK_OF_PARTS + i] + beat.parts.beyond) if each > 1 else slack
    # Bounds of cells stand by their own slack beneath those of parts.
    deeper = work[SLACK + i] - work[SLACK_OF_PARTS + i] if each > 1 else ZERO
    drive, count, below = Side(room.edges, design, beat, work[i + T_0], work[i + D_0], high), 0, HUGE
    for k in range(-1, cells):
        g = best if k < 0 else k
        if k == best or (k >= 0 and sign * work[BOUNDS + 2 * LANES * g + slot + i] - less >= below):
            continue
        parted = bound_turns(drive, g, room.effects, turns)
        allowed = slack + (jump if parted else ZERO)
        if each == 1:
            count, below = _note(room, g, bounds[(2 + KINDS * g) * size :], count, allowed, below)
        else:
            count, below = _gather_parts(drive, room, (g, count), (allowed, deeper), below, k < 0)
    return count, below
