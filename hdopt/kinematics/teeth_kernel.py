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
from hdopt.kinematics.beat_lanes import FLOORS, Walk, extremes_in_lanes, fill_comb, new_nodes, second_difference
from hdopt.kinematics.closed_form import TipGeometry, tip_geometry
from hdopt.kinematics.compiled_closed_form import motion_at, motion_of_row, rim_constants, rim_depth
from hdopt.kinematics.load_sharing import PLACES_PER_TOOTH

FEWEST_ANGLES, ANGLES_PER_TOOTH = 120, 0.75
"""Grid angles of one input turn at least, and for each tooth of the circular spline. More of them are no more right:
what a cell may hide is computed, and followed."""

compiled = njit(error_model="numpy", fastmath=False)


class BeatConstants(NamedTuple):
    """What the kernel knows of a design: its tip; tan of the pressure angle times the share of misalignment; the factor
    of tooth sines; Z_CS/Z_FS; the number of FS phases; cos and sin of the grid angles, (m,) each."""

    tip: TipGeometry
    tan_alpha: float
    sine_share: float
    advance: float
    phases: int
    cos: Array
    sin: Array


def beat_constants(drive: Drive, misalignment: float = 1.0, sine_share: float = 1.0) -> BeatConstants:
    """The constants of `drive`; `misalignment` and `sine_share` multiply what it makes, and what tooth sines beside a
    table make, where the teeth in contact share them."""
    gear = drive.geometry
    m = max(FEWEST_ANGLES, int(ANGLES_PER_TOOTH * gear.circular_spline_teeth))
    theta = np.arange(m) * (2 * math.pi / m)
    tan_alpha = misalignment * math.tan(gear.pressure_angle)
    return BeatConstants(
        tip_geometry(drive),
        tan_alpha,
        sine_share,
        gear.flexspline_advance,
        gear.beat_phases,
        np.cos(theta),
        np.sin(theta),
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
def _sample(constants: BeatConstants, row: Array, depth: Array, offset_cs: Array, offset_fs: Array) -> None:
    """Fill the branches (2, 2, m) of one drive on the grid angles."""
    tip = constants.tip
    motion, _, _ = motion_of_row(tip, row)
    rim = rim_constants(tip)
    for j in range(len(constants.cos)):
        e_a, e_l, t_a, t_l = motion_at(motion, constants.cos[j], constants.sin[j])
        for zone in range(2):
            for k in range(2):
                found = rim_depth(rim, e_a, e_l, t_a, t_l, 1.0 - 2.0 * zone, 1.0 - 2.0 * k)
                depth[zone, k, j], offset_cs[zone, k, j], offset_fs[zone, k, j] = found


@compiled
def depth_bend(depth: Array) -> float:
    """Largest second difference of any branch of `depth` (2, 2, m), mm, over its grid."""
    found = 0.0
    for zone in range(2):
        for k in range(2):
            found = max(found, second_difference(depth[zone, k], 1))
    return found


@compiled
def with_sine(table: Array, amplitude: float, phase: float, out: Array) -> None:
    """Fill `out` (n,) with a spline's `table` (n,) and a sine of `amplitude` and `phase` (rad) of one wave beside it,
    mm of arc; rotated step by step.
    """
    n = len(table)
    turn, cos_turn, sin_turn = 2 * math.pi / n, math.cos(2 * math.pi / n), math.sin(2 * math.pi / n)
    cos, sin = math.cos(phase), math.sin(phase)
    for i in range(n):
        if i % 64 == 0:
            cos, sin = math.cos(phase + i * turn), math.sin(phase + i * turn)
        out[i] = table[i] + amplitude * sin
        cos, sin = cos * cos_turn - sin * sin_turn, sin * cos_turn + cos * sin_turn


@njit(cache=True, nogil=True, error_model="numpy", fastmath=False)
def beat_extremes_block(constants: BeatConstants, cs: Array, fs: Array, rows: Array, out: Array) -> None:
    """Fill `out` (n, 2) with the essential infimum and supremum of each row of errors `rows` (n, 12), mm of arc.

    `constants` of the design; `cs`, `fs` tables over one turn of the splines, (1, 12 Z) for all drives or (n, 12 Z).
    """
    m, phases = len(constants.cos), constants.phases
    n_cs, n_fs = cs.shape[1], fs.shape[1]
    stride_cs, stride_fs = (n_cs + m - 1) // m, (n_fs + m - 1) // m
    depth, offset_cs, offset_fs = np.empty((2, 2, m)), np.empty((2, 2, m)), np.empty((2, 2, m))
    nodes, lanes = new_nodes(m), np.empty((2, 2, phases))
    comb_rows, floor = np.empty((n_fs // phases, 2 * phases)), np.empty(FLOORS)
    on_cs, on_fs = cs[0], fs[0]
    with_cs, with_fs = np.empty(n_cs), np.empty(n_fs)
    cs_bend = second_difference(on_cs, stride_cs)
    comb = fill_comb(on_fs, phases, stride_fs, comb_rows, floor)
    for i in range(len(rows)):
        row = rows[i]
        if len(cs) > 1 or row[8] > 0.0:
            with_sine(cs[i if len(cs) > 1 else 0], constants.sine_share * row[8], row[9], with_cs)
            on_cs, cs_bend = with_cs, second_difference(with_cs, stride_cs)
        if len(fs) > 1 or row[10] > 0.0:
            with_sine(fs[i if len(fs) > 1 else 0], constants.sine_share * row[10], row[11], with_fs)
            comb = fill_comb(with_fs, phases, stride_fs, comb_rows, floor)
        _sample(constants, row, depth, offset_cs, offset_fs)
        bend = constants.tan_alpha * depth_bend(depth) + cs_bend
        walk = Walk(depth, offset_cs, offset_fs, on_cs, constants.tan_alpha, constants.advance, comb, bend)
        out[i, 0], out[i, 1] = extremes_in_lanes(walk, nodes, lanes)
