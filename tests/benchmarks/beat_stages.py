"""Where the time of a drive with measured teeth goes, and how many cells its bounds leave.

`python -m tests.benchmarks.beat_stages` says both: microseconds on one thread, and multiples of a drive with sines.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
from numba import njit

from hdopt.arrays import Array
from hdopt.drive.teeth import MeasuredTeeth
from hdopt.kinematics.beat_bounds import CEILING, CIRCULAR, FLOOR, fill_cells, fill_circular, fill_nodes
from hdopt.kinematics.beat_grid import new_work, walk_bent
from hdopt.kinematics.beat_lanes import extremes_in_lanes
from hdopt.kinematics.beat_tables import BEFORE, WRAPPED, differences, fill_comb, new_teeth, wrap
from hdopt.kinematics.kernel import design_of, peak_to_peak_block
from hdopt.kinematics.load_sharing import mesh_tables
from hdopt.kinematics.teeth_kernel import BeatConstants, _sample, beat_constants, whole_tables
from tests.cases import drive, random_errors

DRIVES = 4000
STAGES = ("outermost points", "what bounds allow for", "zones at the angles", "bounds", "cells left")


@njit(error_model="numpy")
def walked(stages: int, constants: BeatConstants, cs: Array, fs: Array, rows: Array) -> tuple[int, int]:
    """Do the first `stages` of each drive; the cells that could hold an infimum or a supremum even once both are
    known."""
    m, phases = constants.angles.shape[1] - WRAPPED, constants.phases
    stride_cs, stride_fs = (cs.shape[1] + m - 1) // m, (fs.shape[1] + m - 1) // m
    branches, work, wrapped = np.empty((3, 2, 2, m + WRAPPED)), new_work(m, phases), np.empty(cs.shape[1] + WRAPPED)
    wrap(cs[0], wrapped)
    on_grid = np.empty((CIRCULAR, 2, m + WRAPPED), np.float32)
    circular = fill_circular(wrapped, differences(cs[0], stride_cs), on_grid)
    comb = fill_comb(fs[0], phases, stride_fs, new_teeth(fs.shape[1], phases))
    least = largest = 0
    for row in rows:
        bends = _sample(constants, row, branches)
        if stages > 1:
            walk = walk_bent(branches, bends, circular, constants.tan_alpha, constants.advance, comb)
            if 2 < stages < 5:
                fill_nodes(branches, constants.tan_alpha, circular, work.nodes)
            if stages == 4:
                fill_cells(circular, comb, walk.slack, work.nodes, work.cells, work.places)
            if stages > 4:
                infimum, supremum = extremes_in_lanes(walk, work)
                for i in range(BEFORE, m + BEFORE):
                    least += work.cells[FLOOR, i] < infimum
                    largest += work.cells[CEILING, i] > supremum
    return least, largest


def main() -> None:
    """Print the microseconds of each stage on one thread, beside those of a drive with sines, and the cells left."""
    rng = np.random.default_rng(3)
    cs, fs = (MeasuredTeeth.of(rng.normal(0, 0.004, z), "single") for z in (162, 160))
    design = replace(drive(), cs_teeth=cs, fs_teeth=fs)
    errors = random_errors(DRIVES, seed=0)
    rows = errors.with_(cs_tooth_amplitude=0.0, fs_tooth_amplitude=0.0).to_matrix()
    given = beat_constants(design), *whole_tables(design, mesh_tables(design)), rows

    def seconds(work, *arguments) -> float:
        work(*arguments)
        taken = []
        for _ in range(5):
            start = time.process_time()
            work(*arguments)
            taken.append(time.process_time() - start)
        return min(taken)

    sine = seconds(peak_to_peak_block, design_of(drive()), errors.to_matrix(), np.empty(DRIVES)) / DRIVES * 1e6
    before = 0.0
    for stages, name in enumerate(STAGES, 1):
        until = seconds(walked, stages, *given) / DRIVES * 1e6
        print(f"{name:22}{until - before:6.2f} us, so far {until / sine:4.0f} times the sine")
        before = until
    least, largest = walked(len(STAGES), *given)
    print(f"cells that bounds leave: {least / DRIVES:.1f} least, {largest / DRIVES:.1f} largest")


if __name__ == "__main__":
    main()
