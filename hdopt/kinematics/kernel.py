"""The compiled kernel: converged peak-to-peak of many drives, each in a fifth of a microsecond.

Blocks of 128 drives are laid out row by row, one drive a lane, and every step runs over all lanes without a branch:
first-order candidates of the minimum, the least of them looked at, then in dense lists those that second order could
still lower below it, then the crests. Phases are reduced in double precision, everything after is in single precision.
A drive's value depends on nothing but its own errors: not on its lane, its block or the thread. Numba's cache looks at
this file's date alone: touch it where a part of it, in `lanes`, changes.
"""

from __future__ import annotations

import math

import numpy as np

from hdopt.arrays import Array, Index, Singles
from hdopt.drive.geometry import Drive
from hdopt.kinematics.closed_form import RimConstants, TipGeometry, rim_constants, tip_geometry
from hdopt.kinematics.compiled_closed_form import compiled, entry
from hdopt.kinematics.lanes.candidates import (
    BOUNDS,
    CANDIDATES,
    COSINES,
    FIXED,
    FLAT,
    KINDS,
    LEADING,
    MARGIN,
    ROOM,
    SINES,
    TANGENT,
    VERTEX,
    fill_candidates,
)
from hdopt.kinematics.lanes.maxima import fill_highest
from hdopt.kinematics.lanes.minima import GROUP, fill_lowest
from hdopt.kinematics.lanes.motion import (
    AREA,
    COS,
    CS_COS,
    CS_SIN,
    DESCRIPTION,
    E1_X,
    E1_Y,
    E2_MAJOR,
    E2_MINOR,
    FS,
    FS_PHASE,
    KIND,
    LANES,
    MOVED,
    SIN,
    TAN_MAJOR,
    TAN_MINOR,
    TAN_X,
    TAN_Y,
    VALUE,
    Design,
)
from hdopt.kinematics.lanes.single import TURN, narrowed, reduced, rotated, sine_cosine, single, tangent

FLAT_BOUND, FLAT_COS, FLAT_SIN = (start + 4 * LANES for start in (BOUNDS, COSINES, SINES))
"""The candidate where t is nearest to zero."""
LEAST, AT_COS, AT_SIN, AT_MOVED = (ROOM + LANES * row for row in range(4))
"""The least deviation of each lane, where it lies, and how far that is from the place it was seen from, rad."""
LIST = ROOM + 4 * LANES
"""The second work area: candidates that may win, dense."""
WORK = LIST + AREA
AROUND = (single(-0.4), single(-0.2), single(0.2), single(0.4))
"""Where else to look, rad, if t only touches zero: second order then moves its zeros far."""
TRUSTED = single(1e-7)
"""mm rad^2: where terms of second order times the square of the distance are larger, the least is looked at again."""


def design_of(drive: Drive) -> Design:
    """What all drives built as `drive` share, in single precision; smooth-tipped profiles only."""
    gear, tip = drive.geometry, tip_geometry(drive)
    spacing = 2 * math.pi / gear.beat_phases
    return Design(
        TipGeometry(*map(single, tip)),
        RimConstants(*map(single, rim_constants(tip))),
        *map(single, (math.tan(gear.pressure_angle), gear.flexspline_advance, spacing, 1 / spacing)),
    )


@compiled
def describe(errors: Array, work: Singles) -> None:
    """Describe in the first area of `work` the drives with `errors` (12 LANES,), error by error."""
    for i in range(LANES):
        sine, cosine = sine_cosine(reduced(errors[LANES + i]))
        size = narrowed(errors[i])
        work[i + E1_X], work[i + E1_Y] = size * sine, size * cosine
    for i in range(LANES):
        work[i + TAN_Y] = tangent(narrowed(errors[2 * LANES + i]))
        work[i + TAN_X] = tangent(narrowed(errors[3 * LANES + i]))
    for i in range(LANES):
        sine, cosine = sine_cosine(reduced(errors[5 * LANES + i]))
        size = narrowed(errors[4 * LANES + i])
        work[i + E2_MINOR], work[i + E2_MAJOR] = size * sine, size * cosine
    for i in range(LANES):
        work[i + TAN_MAJOR] = tangent(narrowed(errors[6 * LANES + i]))
        work[i + TAN_MINOR] = tangent(narrowed(errors[7 * LANES + i]))
    for i in range(LANES):
        sine, cosine = sine_cosine(reduced(errors[9 * LANES + i]))
        size = narrowed(errors[8 * LANES + i])
        work[i + CS_COS], work[i + CS_SIN] = size * sine, size * cosine
    for i in range(LANES):
        work[i + FS] = narrowed(errors[10 * LANES + i])
        work[i + FS_PHASE] = TURN * reduced(errors[11 * LANES + i])


@compiled
def _look_at_list(work: Singles, lanes: Index, count: int, design: Design, again: bool) -> None:
    """Look at the `count` candidates in the second area of `work`, of the drives in `lanes`."""
    groups = (count + GROUP - 1) // GROUP
    for j in range(count, groups * GROUP):
        lanes[j] = lanes[0]
        for row in range(COS // LANES, KIND // LANES + 1):
            work[LIST + row * LANES + j] = work[LIST + row * LANES]
    for row in range(DESCRIPTION):
        for j in range(groups * GROUP):
            work[LIST + row * LANES + j] = work[row * LANES + lanes[j]]
    fill_lowest(work, LIST, groups, design)
    for j in range(count):
        lane, at = lanes[j], LIST + j
        if again or work[at + VALUE] < work[LEAST + lane]:
            work[LEAST + lane] = work[at + VALUE]
            work[AT_COS + lane], work[AT_SIN + lane] = work[at + COS], work[at + SIN]
            work[AT_MOVED + lane] = work[at + MOVED]


@compiled
def _look_at_others(work: Singles, lanes: Index, design: Design) -> None:
    """Look at every candidate that second order could put below the least found so far."""
    count = 0
    for candidate in range(CANDIDATES):
        slot = candidate * LANES
        for i in range(LANES):
            if work[BOUNDS + slot + i] - work[MARGIN + i] < work[LEAST + i] and work[LEADING + i] != candidate:
                lanes[count] = i
                at = LIST + count
                work[at + COS] = work[COSINES + slot + i]
                work[at + SIN] = work[SINES + slot + i]
                work[at + KIND] = VERTEX if candidate < 4 else (work[KINDS + i] if candidate < 6 else TANGENT)
                count += 1
                if count == LANES:
                    _look_at_list(work, lanes, count, design, False)
                    count = 0
    for i in range(LANES):
        if work[KINDS + i] == FLAT and work[FLAT_BOUND + i] - work[MARGIN + i] < work[LEAST + i]:
            if count + len(AROUND) > LANES:
                _look_at_list(work, lanes, count, design, False)
                count = 0
            for step in AROUND:
                at = LIST + count
                lanes[count] = i
                cos, sin = rotated(work[FLAT_COS + i], work[FLAT_SIN + i], step)
                work[at + COS], work[at + SIN], work[at + KIND] = cos, sin, FIXED
                count += 1
    if count:
        _look_at_list(work, lanes, count, design, False)


@compiled
def _look_again(work: Singles, lanes: Index, design: Design) -> None:
    """Look once more, from the least found, where that lies too far from where it was seen."""
    count = 0
    for i in range(LANES):
        if work[AT_MOVED + i] * work[AT_MOVED + i] * work[MARGIN + i] > TRUSTED:
            lanes[count] = i
            at = LIST + count
            work[at + COS], work[at + SIN], work[at + KIND] = work[AT_COS + i], work[AT_SIN + i], FIXED
            count += 1
    if count:
        _look_at_list(work, lanes, count, design, True)


@compiled
def block_of_lanes(errors: Array, work: Singles, lanes: Index, design: Design) -> None:
    """Fill VALUE of the first area of `work` (WORK,) with the peak-to-peak, mm of arc, of the drives with `errors`
    (12 LANES,), error by error; `lanes` (LANES,) is room for a list, `design` what the drives share."""
    describe(errors, work)
    fill_candidates(work, design)
    fill_lowest(work, 0, LANES // GROUP, design)
    for i in range(LANES):
        work[LEAST + i], work[AT_MOVED + i] = work[VALUE + i], work[MOVED + i]
        work[AT_COS + i], work[AT_SIN + i] = work[COS + i], work[SIN + i]
    _look_at_others(work, lanes, design)
    _look_again(work, lanes, design)
    fill_highest(work, design)
    for i in range(LANES):
        work[VALUE + i] -= work[LEAST + i]


@entry
def peak_to_peak_block(design: Design, matrix: Array, out: Array) -> None:
    """Fill `out` (n,) with the peak-to-peak of each row of `matrix` (n, 12), mm of arc.

    `design` is what the drives share. Rows hold errors in the order of ERROR_NAMES, mm and rad; valid where the closed
    form is.
    """
    n, names = matrix.shape
    work, errors, lanes = np.zeros(WORK, np.float32), np.zeros(names * LANES), np.zeros(LANES, np.int64)
    for start in range(0, n, LANES):
        count = min(LANES, n - start)
        for name in range(names):
            for i in range(count):
                errors[name * LANES + i] = matrix[start + i, name]
        # The last block's spare lanes keep what they held: drives of the block before, or none.
        block_of_lanes(errors, work, lanes, design)
        for i in range(count):
            out[start + i] = work[VALUE + i]
