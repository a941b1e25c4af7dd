"""The compiled kernel of drives with measured teeth: the beat of both splines' tables, drive after drive.

The closed form gives both rims' outermost points in both zones on a grid of one turn; `beat_lanes` walks the beat on
it. Tooth sines beside a table are added to it, so that every tooth term is one table over its spline.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from hdopt.arrays import Array
from hdopt.drive.geometry import Drive
from hdopt.kinematics.beat_bounds import CIRCULAR, DEPTH, ON_CS, ON_FS, Bends, bends_of_motion, fill_circular
from hdopt.kinematics.beat_grid import grid_angles, new_work, walk_bent
from hdopt.kinematics.beat_lanes import extremes_in_lanes
from hdopt.kinematics.beat_tables import (
    WRAPPED,
    circle,
    differences,
    fill_comb,
    new_teeth,
    with_sine,
    wrap,
)
from hdopt.kinematics.closed_form import TipGeometry, tip_geometry
from hdopt.kinematics.compiled_closed_form import motion_at, motion_of_row, rim_constants, rim_depth
from hdopt.kinematics.inner import inner
from hdopt.kinematics.load_sharing import PLACES_PER_TOOTH

FEWEST_ANGLES, ANGLES_PER_TOOTH = 120, 0.75
"""Grid angles of one input turn at least, and for each tooth of the circular spline. More of them are no more right:
what a cell may hide is computed, and followed."""
ABREAST = 16
"""Angles that the processor takes at once: grids are multiples of it, since what is left over goes one by one."""

compiled = inner(error_model="numpy", fastmath=False)


class BeatConstants(NamedTuple):
    """What the kernel knows of a design: its tip; tan of the pressure angle times the share of misalignment; the factor
    of tooth sines; Z_CS/Z_FS; the number of FS phases; cos and sin of the grid angles, (2, m + 4), and of the places of
    either spline's table, (2, 12 Z) each."""

    tip: TipGeometry
    tan_alpha: float
    sine_share: float
    advance: float
    phases: int
    angles: Array
    cs_circle: Array
    fs_circle: Array


def beat_constants(drive: Drive, misalignment: float = 1.0, sine_share: float = 1.0) -> BeatConstants:
    """The constants of `drive`; `misalignment` and `sine_share` multiply what it makes, and what tooth sines beside a
    table make, where the teeth in contact share them."""
    gear = drive.geometry
    fewest = max(FEWEST_ANGLES, int(ANGLES_PER_TOOTH * gear.circular_spline_teeth))
    m = (fewest + ABREAST - 1) // ABREAST * ABREAST
    tan_alpha = misalignment * math.tan(gear.pressure_angle)
    return BeatConstants(
        tip_geometry(drive),
        tan_alpha,
        sine_share,
        gear.flexspline_advance,
        gear.beat_phases,
        grid_angles(m),
        circle(PLACES_PER_TOOTH * gear.circular_spline_teeth),
        circle(PLACES_PER_TOOTH * gear.flexspline_teeth),
    )


def whole_tables(drive: Drive, tables: tuple[Array, Array]) -> tuple[Array, Array]:
    """`tables` of CS and FS, as `mesh_tables` gives them for `drive`, as rows (1, 12 Z), mm of arc; zeros for a spline
    whose teeth are not measured."""
    gear = drive.geometry
    teeth = gear.circular_spline_teeth, gear.flexspline_teeth
    cs, fs = (
        np.ascontiguousarray(table[None, :] if len(table) else np.zeros((1, PLACES_PER_TOOTH * z)))
        for table, z in zip(tables, teeth, strict=True)
    )
    return cs, fs


@compiled
def _sample(constants: BeatConstants, row: Array, branches: Array) -> Bends:
    """Fill the `branches` (3, 2, 2, m + 4) of one drive on the grid angles; how far they bend at most."""
    tip = constants.tip
    motion, _, _ = motion_of_row(tip, row)
    rim = rim_constants(tip)
    cos, sin = constants.angles[0], constants.angles[1]
    for j in range(len(cos)):
        e_a, e_l, t_a, t_l = motion_at(motion, cos[j], sin[j])
        for zone in range(2):
            for k in range(2):
                found = rim_depth(rim, e_a, e_l, t_a, t_l, 1.0 - 2.0 * zone, 1.0 - 2.0 * k)
                branches[DEPTH, zone, k, j], branches[ON_CS, zone, k, j], branches[ON_FS, zone, k, j] = found
    return bends_of_motion(motion, rim, len(cos) - WRAPPED)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=False)
def beat_extremes_block(constants: BeatConstants, cs: Array, fs: Array, rows: Array, out: Array) -> None:
    """Fill `out` (n, 2) with the essential infimum and supremum of each row of errors `rows` (n, 12), mm of arc.

    `constants` of the design; `cs`, `fs` tables over one turn of the splines, (1, 12 Z) for all drives or (n, 12 Z).
    """
    m, phases = constants.angles.shape[1] - WRAPPED, constants.phases
    n_cs, n_fs = cs.shape[1], fs.shape[1]
    stride_cs, stride_fs = (n_cs + m - 1) // m, (n_fs + m - 1) // m
    branches = np.empty((3, 2, 2, m + WRAPPED))
    work = new_work(m, phases)
    teeth = new_teeth(n_fs, phases)
    on_cs, on_fs, wrapped = np.empty(n_cs), np.empty(n_fs), np.empty(n_cs + WRAPPED)
    wrap(cs[0], wrapped)
    rows_cs = np.empty((CIRCULAR, 2, m + WRAPPED), np.float32)
    circular = fill_circular(wrapped, differences(cs[0], stride_cs), rows_cs)
    comb = fill_comb(fs[0], phases, stride_fs, teeth)
    for i in range(len(rows)):
        row = rows[i]
        if len(cs) > 1 or row[8] > 0.0:
            own = cs[i if len(cs) > 1 else 0]
            with_sine(own, constants.sine_share * row[8], row[9], constants.cs_circle, on_cs)
            wrap(on_cs, wrapped)
            circular = fill_circular(wrapped, differences(on_cs, stride_cs), rows_cs)
        if len(fs) > 1 or row[10] > 0.0:
            own = fs[i if len(fs) > 1 else 0]
            with_sine(own, constants.sine_share * row[10], row[11], constants.fs_circle, on_fs)
            comb = fill_comb(on_fs, phases, stride_fs, teeth)
        bends = _sample(constants, row, branches)
        walk = walk_bent(branches, bends, circular, constants.tan_alpha, constants.advance, comb)
        out[i, 0], out[i, 1] = extremes_in_lanes(walk, work)
