"""Converged peak-to-peak of the kinematic error for arrays of drives, on all cores."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Drive
from hdopt.parallel.shared_memory import in_blocks

BLOCK = 8192
"""Drives a thread takes at a time: long enough to hide the hand-over, short enough to keep all cores busy."""

BEAT_BLOCK = 512
"""The same where each drive's beat is walked; what all of them share is made anew for each block."""


def peak_to_peak_arcmin(drive: Drive, errors: DriveErrors) -> Array:
    """Converged peak-to-peak kinematic error (supremum less infimum over one full relative turn), arcmin, k_e = 1.

    The `errors` of `drive` may hold arrays; the result has their common shape. The closed form in single precision:
    within 1e-3 arcmin of the exact geometry for 99.9 % of drives of the shipped tolerances, for 99 % of drives of three
    times them (measured by `python -m tests.benchmarks.kernel_accuracy`). A measured profile, whose two tips may
    differ, takes the exact geometry, some thousand times slower (`contour_kernel`). Spread over the threads of the
    engine in force; the result does not depend on them.
    """
    return matrix_peak_to_peak_arcmin(drive, errors.to_matrix()).reshape(errors.shape)


def matrix_peak_to_peak_arcmin(drive: Drive, matrix: Array) -> Array:
    """The same for a `drive` with errors as rows of the `matrix` of `DriveErrors.to_matrix`, shape (n, 12) -> (n,).

    Measured teeth have no extremes in closed form: the beat is walked, some 20 times slower. Its values are within
    1e-5 arcmin of `extremes_arcmin` in the closed form (`tests/unit/test_teeth_kernel.py`); at twice the shipped
    tolerances two infima of 6,000 drives, held one way, lay 1.1e-5 and 3.7e-5 arcmin above it. So it is for a measured
    profile, in the exact geometry (`tests/unit/test_contour_kernel.py`).
    """
    matrix = np.ascontiguousarray(matrix, dtype=np.float64)
    if drive.has_measured_teeth or not drive.wave_generator.profile.tip_is_smooth:
        low, high = beat_extremes_arcmin(drive, matrix).T
        return np.asarray(high - low)
    from hdopt.kinematics.kernel import design_of, peak_to_peak_block

    design = design_of(drive)
    out = np.empty(len(matrix))

    def fill(block: slice) -> None:
        peak_to_peak_block(design, matrix[block], out[block])

    in_blocks(len(matrix), BLOCK, fill)
    return out * drive.geometry.arcmin_per_mm


def beat_extremes_arcmin(
    drive: Drive,
    matrix: Array,
    tables: tuple[Array, Array] | None = None,
    misalignment: float = 1.0,
    sine_share: float = 1.0,
) -> Array:
    """Essential infimum and supremum of the kinematic error (arcmin, k_e = 1) of a `drive` with measured teeth or a
    measured profile and errors as rows of the `matrix` of `DriveErrors.to_matrix`, (n, 12) -> (n, 2). In the closed
    form where the profile's tips are smooth, else in the exact geometry.

    `tables` of CS and FS over one turn, mm of arc, (1, 12 Z) for all drives or (n, 12 Z), each drive its own; without
    them those of `drive`. Where the teeth in contact share a term, `misalignment` multiplies the arc that misalignment
    makes, and `sine_share` the sines that stand beside a table.
    """
    from hdopt.kinematics.load_sharing import mesh_tables
    from hdopt.kinematics.teeth_kernel import whole_tables

    walk = _walk_of(drive, misalignment, sine_share)
    cs, fs = whole_tables(drive, mesh_tables(drive)) if tables is None else tables
    matrix = np.ascontiguousarray(matrix, dtype=np.float64)
    out = np.empty((len(matrix), 2))

    def fill(block: slice) -> None:
        of_cs, of_fs = (table if len(table) == 1 else table[block] for table in (cs, fs))
        walk(of_cs, of_fs, matrix[block], out[block])

    in_blocks(len(matrix), BEAT_BLOCK, fill)
    return out * drive.geometry.arcmin_per_mm


def _walk_of(drive: Drive, misalignment: float, sine_share: float) -> Callable[[Array, Array, Array, Array], None]:
    """What walks the beat of drives that are built as `drive`: tables of CS and FS, rows of errors, and where the
    extremes go (mm of arc); `misalignment` and `sine_share` as in `beat_extremes_arcmin`."""
    if drive.wave_generator.profile.tip_is_smooth:
        from hdopt.kinematics.teeth_kernel import beat_constants, beat_extremes_block

        return partial(beat_extremes_block, beat_constants(drive, misalignment, sine_share))
    from hdopt.kinematics.contour_kernel import contour_constants, contour_extremes_block

    return partial(contour_extremes_block, contour_constants(drive, misalignment, sine_share))
