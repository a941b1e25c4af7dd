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
from hdopt.kinematics.beat_grid import CEILING, FLOOR, Walk, fill_bounds, fill_changes, fill_grid, margins, new_work
from hdopt.kinematics.beat_lanes import _cut_cells, _promising, extremes_in_lanes
from hdopt.kinematics.beat_tables import BEFORE, FLOORS, WRAPPED, differences, fill_comb, wrap
from hdopt.kinematics.kernel import design_of, peak_to_peak_block
from hdopt.kinematics.load_sharing import mesh_tables
from hdopt.kinematics.teeth_kernel import BeatConstants, _sample, beat_constants, whole_tables
from tests.cases import drive, random_errors

DRIVES = 4000
STAGES = ("outermost points", "how far cells bend", "zones at the angles", "changes of rims", "bounds", "cells left")


@njit(error_model="numpy")
def walked(stages: int, slack: float, constants: BeatConstants, cs: Array, fs: Array, rows: Array) -> tuple[int, int]:
    """Do the first `stages` of each drive; the cells that could hold an infimum or a supremum even once both are known,
    with bounds of so much of their `slack`."""
    m, phases = constants.angles.shape[1] - WRAPPED, constants.phases
    stride_cs, stride_fs = (cs.shape[1] + m - 1) // m, (fs.shape[1] + m - 1) // m
    branches, work, wrapped = np.empty((3, 2, 2, m + WRAPPED)), new_work(m, phases), np.empty(cs.shape[1] + WRAPPED)
    grid, combed = work.grid, np.empty((fs.shape[1] // phases + WRAPPED, 2 * phases))
    wrap(cs[0], wrapped)
    cs_bends, comb = differences(cs[0], stride_cs), fill_comb(fs[0], phases, stride_fs, combed, np.empty(FLOORS))
    least = largest = 0
    for row in rows:
        _sample(constants, row, branches)
        if stages > 1:
            margin, beside = margins(branches, constants.tan_alpha, cs_bends, comb, work)
            walk = Walk(branches, wrapped, constants.tan_alpha, constants.advance, comb, margin, beside)
            if stages == 6:
                infimum, supremum = extremes_in_lanes(walk, work)
                for j in range(BEFORE, grid.shape[1] - WRAPPED + BEFORE):
                    least += grid[FLOOR, j] + (1 - slack) * margin < infimum
                    largest += grid[CEILING, j] - (1 - slack) * margin > supremum
            elif stages > 2:
                fill_grid(walk, grid)
                changes = fill_changes(grid, work.changes) if stages > 3 else 0
                if stages == 5:
                    fill_bounds(walk, grid)
                    least += _cut_cells(work, changes) + _promising(grid)[0] * 0
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
        until = seconds(walked, stages, 1.0, *given) / DRIVES * 1e6
        print(f"{name:22}{until - before:6.2f} us, so far {until / sine:4.0f} times the sine")
        before = until
    for slack in (1.0, 0.5, 0.0):
        least, largest = walked(6, slack, *given)
        print(f"cells that {slack:.0%} of the slack leaves: {least / DRIVES:.1f} least, {largest / DRIVES:.1f} largest")


if __name__ == "__main__":
    main()
