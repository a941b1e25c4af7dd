"""Converged peak-to-peak of the kinematic error for arrays of drives, on all cores."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from hdopt.deviations import DriveErrors
from hdopt.drive import Drive
from hdopt.kinematics.closed_form import tip_geometry

Array = NDArray[np.float64]

BLOCK = 8192
"""Drives a thread takes at a time: long enough to hide the hand-over, short enough to keep all cores busy."""


def peak_to_peak_arcmin(drive: Drive, errors: DriveErrors, workers: int | None = None) -> Array:
    """Converged peak-to-peak kinematic error (supremum less infimum over one full relative turn), arcmin, k_e = 1.

    `errors` may hold arrays; the result has their common shape. Within 1e-3 arcmin of the exact geometry for 99 % of
    drives of the shipped tolerances (measured by `tests/benchmarks/test_peak_to_peak_speed.py`). A measured profile,
    whose two tips may differ, takes the exact geometry drive by drive, some thousand times slower. `workers` threads,
    all cores if None; the result does not depend on it.
    """
    if not drive.wave_generator.profile.tip_is_smooth:
        from hdopt.kinematics.extremes import peak_to_peak_by_search_arcmin

        return peak_to_peak_by_search_arcmin(drive, errors)
    return matrix_peak_to_peak_arcmin(drive, errors.to_matrix(), workers).reshape(errors.shape)


def matrix_peak_to_peak_arcmin(drive: Drive, matrix: Array, workers: int | None = None) -> Array:
    """The same for errors as rows of `DriveErrors.to_matrix`, shape (n, 12) -> (n,); smooth-tipped profiles only."""
    from hdopt.kinematics.kernel import peak_to_peak_block

    matrix = np.ascontiguousarray(matrix, dtype=np.float64)
    gear, tip = drive.geometry, tip_geometry(drive)
    tan_alpha = float(np.tan(gear.pressure_angle))
    advance = gear.circular_spline_teeth / gear.flexspline_teeth
    out = np.empty(len(matrix))

    def fill(start: int) -> None:
        block = slice(start, start + BLOCK)
        peak_to_peak_block(tip, tan_alpha, advance, float(gear.beat_phases), matrix[block], out[block])

    starts = range(0, len(matrix), BLOCK)
    workers = min(workers or os.cpu_count() or 1, len(starts))
    if workers <= 1:
        for start in starts:
            fill(start)
    else:
        with ThreadPoolExecutor(workers) as pool:
            list(pool.map(fill, starts))
    return out * gear.arcmin_per_mm
