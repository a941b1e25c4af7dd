"""Converged peak-to-peak of the kinematic error for arrays of drives, on all cores."""

from __future__ import annotations

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Drive
from hdopt.kinematics.closed_form import tip_geometry
from hdopt.parallel.shared_memory import in_blocks

BLOCK = 8192
"""Drives a thread takes at a time: long enough to hide the hand-over, short enough to keep all cores busy."""

SEARCH_BLOCK = 16
"""The same where each drive is searched."""


def peak_to_peak_arcmin(drive: Drive, errors: DriveErrors) -> Array:
    """Converged peak-to-peak kinematic error (supremum less infimum over one full relative turn), arcmin, k_e = 1.

    `errors` may hold arrays; the result has their common shape. Within 1e-3 arcmin of the exact geometry for 99 % of
    drives of the shipped tolerances (measured by `tests/benchmarks/test_peak_to_peak_speed.py`). A measured profile,
    whose two tips may differ, takes the exact geometry drive by drive, some thousand times slower. Spread over the
    threads of the engine in force; the result does not depend on them.
    """
    if not drive.wave_generator.profile.tip_is_smooth:
        from hdopt.kinematics.extremes import peak_to_peak_by_search_arcmin

        return peak_to_peak_by_search_arcmin(drive, errors)
    return matrix_peak_to_peak_arcmin(drive, errors.to_matrix()).reshape(errors.shape)


def matrix_peak_to_peak_arcmin(drive: Drive, matrix: Array) -> Array:
    """The same for a `drive` with errors as rows of the `matrix` of `DriveErrors.to_matrix`, shape (n, 12) -> (n,);
    smooth-tipped profiles only.

    Measured teeth have no extremes in closed form: the phases of the beat are searched, drive by drive, thousands of
    times slower.
    """
    matrix = np.ascontiguousarray(matrix, dtype=np.float64)
    if drive.has_measured_teeth:
        return _searched(drive, matrix)
    from hdopt.kinematics.kernel import peak_to_peak_block

    gear, tip = drive.geometry, tip_geometry(drive)
    tan_alpha = float(np.tan(gear.pressure_angle))
    advance = gear.flexspline_advance
    out = np.empty(len(matrix))

    def fill(block: slice) -> None:
        peak_to_peak_block(tip, tan_alpha, advance, float(gear.beat_phases), matrix[block], out[block])

    in_blocks(len(matrix), BLOCK, fill)
    return out * gear.arcmin_per_mm


def _searched(drive: Drive, matrix: Array) -> Array:
    from hdopt.kinematics.extremes import peak_to_peak_by_search_arcmin
    from hdopt.kinematics.waveform import CLOSED_FORM

    out = np.empty(len(matrix))

    def fill(block: slice) -> None:
        out[block] = peak_to_peak_by_search_arcmin(drive, DriveErrors.from_matrix(matrix[block]), CLOSED_FORM)

    in_blocks(len(matrix), SEARCH_BLOCK, fill)
    return out
