"""The converged peak-to-peak by search: slow, sure, and valid for every geometry. The compiled kernel is held to it.

Over one full relative turn of FS and CS every input angle meets the FS teeth in Z_FS/gcd(Z_FS, Z_CS) phases, while
everything else repeats each input turn. So one input turn is scanned, with all phases at each angle, not N turns.
Where the deepest rim switches, tau steps; the extremes are one-sided limits there, which a repeated zoom approaches.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hdopt.deviations import DriveErrors
from hdopt.drive import Drive
from hdopt.kinematics.waveform import circular_spline_term, geometry_for, kinematic_error_arcmin

Array = NDArray[np.float64]

GRID_DEG = 0.25
ZOOMS = 5
ZOOM_POINTS = 33
CANDIDATES = 24
BISECTIONS = 36
CLUSTER = np.geomspace(1e-6, np.radians(GRID_DEG), 12)


def extremes_arcmin(drive: Drive, errors: DriveErrors, geometry: str | None = None) -> tuple[float, float]:
    """Infimum and supremum of the kinematic error of one drive over a full relative turn, arcmin (k_e = 1).

    `errors` must be scalars. One input turn is scanned every 0.25 deg, and closely around every change of the deepest
    rim, with every FS phase; the best local extremes are zoomed into until their cells are below 1e-6 deg.
    """
    theta = _scan(drive, errors, geometry)
    low, high = _over_phases(drive, errors, theta, geometry)
    lowest = zoom_lowest(lambda angles: _over_phases(drive, errors, angles, geometry)[0], theta, low)
    highest = -zoom_lowest(lambda angles: -_over_phases(drive, errors, angles, geometry)[1], theta, -high)
    scale = drive.geometry.arcmin_per_mm
    return lowest * scale, highest * scale


def _scan(drive: Drive, errors: DriveErrors, geometry: str | None) -> Array:
    """Angles of one input turn to look at first: a regular grid, and clusters on both sides of every rim change."""
    deepest_points = geometry_for(drive, geometry)
    grid = np.arange(0, 2 * np.pi, np.radians(GRID_DEG))
    rim = deepest_points(drive, errors, grid).rim
    changes = []
    for zone in (0, 1):
        before = np.flatnonzero(rim[zone] != np.roll(rim[zone], -1))
        if len(before) == 0:
            continue
        low, high, start = grid[before], grid[before] + np.radians(GRID_DEG), rim[zone][before]
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            same = deepest_points(drive, errors, middle).rim[zone] == start
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        changes += [*low, *high]
    clusters = np.add.outer(changes, np.concatenate([-CLUSTER[::-1], [0.0], CLUSTER])).ravel()
    return np.unique(np.concatenate([grid, np.mod(clusters, 2 * np.pi)]))


def _over_phases(drive: Drive, errors: DriveErrors, theta: Array, geometry: str | None) -> tuple[Array, Array]:
    """Least and greatest max(tau_1, tau_2) over all FS phases at each angle, mm of arc; shape of `theta` (n,)."""
    points = geometry_for(drive, geometry)(drive, errors, theta)
    without_fs = points.depth * np.tan(drive.geometry.pressure_angle) + circular_spline_term(errors, points, theta)
    gear = drive.geometry
    phases = np.arange(gear.beat_phases) * (2 * np.pi / gear.beat_phases)
    x = (gear.circular_spline_teeth / gear.flexspline_teeth) * theta + errors.fs_tooth_phase + phases[:, None]
    zone_1 = without_fs[0] + errors.fs_tooth_amplitude * np.sin(x + points.offset_fs[0])
    zone_2 = without_fs[1] - errors.fs_tooth_amplitude * np.sin(x - points.offset_fs[1])
    driving = np.maximum(zone_1, zone_2)
    return driving.min(axis=0), driving.max(axis=0)


def zoom_lowest(function, theta: Array, values: Array, period: float = 2 * np.pi) -> float:
    """Least value of `function` near the lowest local minima of its `values` at the angles `theta` of one period."""
    local = np.flatnonzero((values <= np.roll(values, 1)) & (values <= np.roll(values, -1)))
    local = local[np.argsort(values[local])[:CANDIDATES]]
    gaps = np.diff(np.append(theta, theta[0] + period))
    half = np.maximum(gaps[local], gaps[local - 1])[:, None]
    centres, best = theta[local], float(values.min())
    for _ in range(ZOOMS):
        fine = centres[:, None] + half * np.linspace(-1, 1, ZOOM_POINTS)
        found = function(fine.ravel()).reshape(fine.shape)
        best = min(best, float(found.min()))
        centres = fine[np.arange(len(centres)), found.argmin(axis=1)]
        half = half * 2.0 / (ZOOM_POINTS - 1)
    return best


def peak_to_peak_by_search_arcmin(drive: Drive, errors: DriveErrors, geometry: str | None = None) -> Array:
    """Converged peak-to-peak, arcmin, for arrays of `errors`: supremum less infimum, drive by drive."""
    matrix = errors.to_matrix()
    spans = [np.ptp(extremes_arcmin(drive, DriveErrors.from_matrix(row), geometry)) for row in matrix]
    return np.reshape(spans, errors.shape)


def walked_peak_to_peak_arcmin(
    drive: Drive, errors: DriveErrors, sampling: float, turns: int, geometry: str | None = None
) -> float:
    """Peak-to-peak only on a grid: every `sampling` rad over `turns` input turns from 0, the end included, arcmin.

    This is what Jia 2021 publishes (10 deg, 80 turns); it lies below the converged value.
    """
    steps = round(turns * 2 * np.pi / sampling)
    theta = np.minimum(np.arange(steps + 1) * sampling, turns * 2 * np.pi)
    return float(np.ptp(kinematic_error_arcmin(drive, errors, theta, geometry)))
