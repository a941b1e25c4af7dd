"""What is said of one drive: converged extremes, the peak-to-peak that a recording can show, and that of a coarse grid.

Over one full relative turn of FS and CS every input angle meets the FS teeth in Z_FS/gcd(Z_FS, Z_CS) phases, while
everything else repeats each input turn. So one input turn of the chosen geometry is sampled, and its essential extremes
over all phases follow (`hdopt.kinematics.essential`). The compiled kernel for many drives is held to these values.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Drive
from hdopt.kinematics.branches import Branches, deepest
from hdopt.kinematics.load_sharing import mesh_tables, misalignment_share
from hdopt.kinematics.waveform import (
    BRANCHES,
    DEFAULT_METHOD,
    deviation_at,
    full_turn,
    geometry_for,
    kinematic_error_arcmin,
)

PLACES = 360
"""Places of an input turn where the branches are sampled: 720 change the base case by 1e-9 arcmin."""
PLACES_MEASURED = 720
"""The same for profiles whose contour is not smooth."""
PLACES_A_MEASURED_TOOTH = 4
"""The same for one tooth of splines whose teeth are known one by one: their mean in mesh varies within one."""
PLACES_PER_TOOTH = 8
"""Of the waveform in which windows of a tooth's width are first laid."""
FINE_PLACES = 256
"""The same for the best windows."""
WINDOWS = 24
"""How many are laid anew."""
ZOOMS = 5
ZOOM_POINTS = 33
CANDIDATES = 24


def sampled_branches(drive: Drive, errors: DriveErrors, geometry: str = DEFAULT_METHOD) -> tuple[Array, Branches]:
    """Input angles (rad, (n,)) of an even grid of one turn, and the branches of `drive` with scalar `errors` there by
    the `geometry` named, (2, 2, n)."""
    geometry_for(drive, geometry)
    places = PLACES if drive.wave_generator.profile.tip_is_smooth else PLACES_MEASURED
    if drive.has_measured_teeth:
        places = max(places, PLACES_A_MEASURED_TOOTH * drive.geometry.circular_spline_teeth)
    theta = np.arange(places, dtype=np.float64) * (2 * np.pi / places)
    found = BRANCHES[geometry](drive, errors, theta)
    return theta, Branches(*(np.ascontiguousarray(values.reshape(2, 2, places)) for values in vars(found).values()))


def extremes_arcmin(
    drive: Drive,
    errors: DriveErrors,
    geometry: str = DEFAULT_METHOD,
    misalignment: float = 1.0,
    tables: tuple[Array, Array] | None = None,
) -> tuple[float, float]:
    """Essential infimum and supremum of the kinematic error of `drive` with scalar `errors`, arcmin, k_e = 1, over one
    full relative turn.

    Jia 2021, Eqs. (16)-(32); `geometry` is "exact" or "closed form"; `misalignment` multiplies the arc that it makes,
    where the teeth in contact share it; `tables` are `mesh_tables` of the drive where they are known already. Angles
    where rims only tie never count, real slivers between two changes of the deepest rim do. Right to 1e-6 arcmin for
    smooth profiles. Errors must keep the deepest points within 60 deg of the major axis.
    """
    from hdopt.kinematics.essential import Sampled, Teeth, essential_extremes

    gear, e = drive.geometry, errors
    _, found = sampled_branches(drive, errors, geometry)
    teeth = Teeth(
        float(e.cs_tooth_amplitude * np.sin(e.cs_tooth_phase)),
        float(e.cs_tooth_amplitude * np.cos(e.cs_tooth_phase)),
        float(e.fs_tooth_amplitude * np.sin(e.fs_tooth_phase)),
        float(e.fs_tooth_amplitude * np.cos(e.fs_tooth_phase)),
        *(mesh_tables(drive) if tables is None else tables),
    )
    tan_alpha = misalignment * float(np.tan(gear.pressure_angle))
    mesh = Sampled(
        found.depth, found.offset_cs, found.offset_fs, tan_alpha, gear.flexspline_advance, gear.beat_phases, teeth
    )
    low, high = essential_extremes.compiled(mesh) if drive.has_measured_teeth else essential_extremes(mesh)
    return low * gear.arcmin_per_mm, high * gear.arcmin_per_mm


def converged_peak_to_peak_arcmin(drive: Drive, errors: DriveErrors, geometry: str = DEFAULT_METHOD) -> float:
    """Essential supremum less essential infimum of `drive` with scalar `errors`, arcmin, k_e = 1; `geometry` is "exact"
    or "closed form"."""
    low, high = extremes_arcmin(drive, errors, geometry)
    return high - low


def evened_out_arcmin(drive: Drive, errors: DriveErrors, k_e: float, geometry: str = DEFAULT_METHOD) -> float:
    """The same of `drive` with scalar `errors`, by `geometry`, where the teeth in contact even it out, arcmin: by `k_e`
    of all; but with measured teeth each term in its own way, misalignment, common to all teeth, by its mean, sines by
    k_e, measured teeth by the mean in their table."""
    if not drive.has_measured_teeth:
        return k_e * converged_peak_to_peak_arcmin(drive, errors, geometry)
    sines = errors.with_(
        cs_tooth_amplitude=k_e * errors.cs_tooth_amplitude, fs_tooth_amplitude=k_e * errors.fs_tooth_amplitude
    )
    low, high = extremes_arcmin(drive, sines, geometry, misalignment_share(drive))
    return high - low


def peak_to_peak_by_search_arcmin(drive: Drive, errors: DriveErrors, geometry: str = DEFAULT_METHOD) -> Array:
    """`converged_peak_to_peak_arcmin` of `drive` for arrays of `errors` by the `geometry` named, drive by drive; the
    result has the errors' shape."""
    rows = (DriveErrors.from_matrix(row) for row in errors.to_matrix())
    tables = mesh_tables(drive)
    spans = [np.ptp(extremes_arcmin(drive, row, geometry, tables=tables)) for row in rows]
    return np.reshape(spans, errors.shape)


def tooth_width_peak_to_peak_arcmin(drive: Drive, errors: DriveErrors, geometry: str = DEFAULT_METHOD) -> float:
    """The peak-to-peak that holds over the width of one FS tooth (2 pi/Z_FS of input angle), arcmin, k_e = 1.

    That is what a recording can show: the largest level that `drive` with scalar `errors` stays above over a window of
    that width, less the smallest that it stays below. `geometry` is "exact" or "closed form". Right to 1e-4 arcmin.
    """
    teeth = drive.geometry.flexspline_teeth
    waveform = interpolated_waveform(drive, errors, geometry)
    theta = full_turn(drive, teeth * PLACES_PER_TOOTH)
    return held_peak_to_peak(waveform, theta, waveform(theta), 2 * np.pi / teeth)


def interpolated_waveform(
    drive: Drive, errors: DriveErrors, geometry: str = DEFAULT_METHOD
) -> Callable[[Array], Array]:
    """The kinematic error (arcmin, k_e = 1) of `drive` with scalar `errors` as a function of input angles (rad, (n,)).

    The branches of the `geometry` named are sampled once and joined by cubic splines, right to 1e-7 arcmin.
    """
    _, found = sampled_branches(drive, errors, geometry)
    values = np.stack(list(vars(found).values()))
    splines = periodic_spline(values)

    def waveform(theta: Array) -> Array:
        points = deepest(Branches(*splines(theta)))
        error: Array = drive.geometry.arcmin_per_mm * np.max(deviation_at(drive, errors, theta, points), axis=0)
        return error

    return waveform


def periodic_spline(values: Array) -> Callable[[Array], Array]:
    """The periodic cubic spline through `values` (..., n) on an even grid of one turn from 0, as a function of angles
    (rad, (k,)) -> (..., k). Its slopes solve a cyclic system, which Fourier's transform makes diagonal."""
    n = values.shape[-1]
    turn = 2 * np.pi * np.arange(n // 2 + 1) / n
    # d[i-1] + 4 d[i] + d[i+1] = 3 (y[i+1] - y[i-1]), slopes a cell.
    slopes = np.fft.irfft(np.fft.rfft(values) * (3j * np.sin(turn) / (2 + np.cos(turn))), n)
    rise = np.roll(values, -1, -1) - values
    after = np.roll(slopes, -1, -1)
    pieces = np.stack([values, slopes, 3 * rise - 2 * slopes - after, slopes + after - 2 * rise])

    def spline(theta: Array) -> Array:
        place = np.mod(theta, 2 * np.pi) * (n / (2 * np.pi))
        cell = place.astype(np.int64)
        x = place - cell
        a, b, c, d = np.take(pieces, cell, axis=-1, mode="wrap")
        return np.asarray(a + x * (b + x * (c + x * d)))

    return spline


def held_peak_to_peak(waveform: Callable[[Array], Array], theta: Array, values: Array, width: float) -> float:
    """Range that the periodic `waveform` over angles (rad) holds over windows of `width` (rad); its unit.

    `values` are those at `theta`, an even grid (n,) of its period. The best windows of the grid are laid anew on a
    finer one.
    """
    return _held_high(waveform, theta, values, width) + _held_high(lambda x: -waveform(x), theta, -values, width)


def _held_high(waveform: Callable[[Array], Array], theta: Array, values: Array, width: float) -> float:
    """The largest level that `waveform` stays above over a window."""
    from numpy.lib.stride_tricks import sliding_window_view

    step = theta[1] - theta[0]
    cells = max(int(width / step), 1)
    levels = sliding_window_view(np.concatenate([values, values[:cells]]), cells + 1).min(axis=1)
    fine = width / FINE_PLACES
    best = float(levels.max())
    reach = int(np.ceil(2 * step / fine))
    for start in theta[np.argsort(levels)[-WINDOWS:]]:
        path = waveform(start + fine * np.arange(-reach, FINE_PLACES + reach + 1))
        best = max(best, float(sliding_window_view(path, FINE_PLACES + 1).min(axis=1).max()))
    return best


def zoom_lowest(function: Callable[[Array], Array], theta: Array, values: Array, period: float = 2 * np.pi) -> float:
    """Least value of `function` near the lowest local minima of its `values` at the angles `theta` (rad, (n,)) of one
    `period`."""
    return lowest_and_where(function, theta, values, period)[1]


def lowest_and_where(
    function: Callable[[Array], Array], theta: Array, values: Array, period: float = 2 * np.pi
) -> tuple[float, float]:
    """Angle (rad, within a `period` from 0) and least value of `function` near the lowest local minima of its `values`
    at the angles `theta` (rad, (n,)) of one `period`, rad."""
    local = np.flatnonzero((values <= np.roll(values, 1)) & (values <= np.roll(values, -1)))
    local = local[np.argsort(values[local])[:CANDIDATES]]
    gaps = np.diff(np.append(theta, theta[0] + period))
    half = np.maximum(gaps[local], gaps[local - 1])[:, None]
    centres, place, best = theta[local], float(theta[values.argmin()]), float(values.min())
    for _ in range(ZOOMS):
        fine = centres[:, None] + half * np.linspace(-1, 1, ZOOM_POINTS)
        found = function(fine.ravel()).reshape(fine.shape)
        if found.min() < best:
            place, best = float(fine.ravel()[found.argmin()]) % period, float(found.min())
        centres = fine[np.arange(len(centres)), found.argmin(axis=1)]
        half = half * 2.0 / (ZOOM_POINTS - 1)
    return place, best


def walked_peak_to_peak_arcmin(
    drive: Drive, errors: DriveErrors, sampling: float, turns: float, geometry: str = DEFAULT_METHOD
) -> float:
    """Peak-to-peak of `drive` with scalar `errors` only on a grid: every `sampling` rad over `turns` input turns from
    0, the end included, arcmin; `geometry` is "exact" or "closed form".

    This is what Jia 2021 publishes (10 deg, 80 turns); it lies below the converged value.
    """
    steps = round(turns * 2 * np.pi / sampling)
    theta = np.minimum(np.arange(steps + 1) * sampling, turns * 2 * np.pi)
    return float(np.ptp(kinematic_error_arcmin(drive, errors, theta, geometry)))
