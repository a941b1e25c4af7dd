"""The compiled walk of a measured cam against the exact geometry that searches its contour at every input angle."""

import math
from dataclasses import replace

import numpy as np
import pytest
from cases import BASE_ERRORS, PROFILES, TABLE_1_ELLIPSE, TURN, drive, random_errors
from numba import njit

from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import DriveGeometry, Structure
from hdopt.drive.profiles import MeasuredProfile
from hdopt.drive.teeth import MeasuredTeeth
from hdopt.kinematics import contour_kernel
from hdopt.kinematics.extremes import extremes_arcmin
from hdopt.kinematics.peak_to_peak import beat_extremes_arcmin, peak_to_peak_arcmin

ARCMIN = 1e-6
"""Both geometries are exact, and both grids of input angles leave less."""


def ground(seed=1, size=0.002, waves=40):
    """An ellipse as a shop grinds it: waves of 3 to `waves` a turn, of which both tips have their own."""
    rng, k = np.random.default_rng(seed), np.arange(3, waves + 1)
    form = (size / k * np.cos(np.outer(TURN, k) + rng.uniform(0, 2 * np.pi, len(k)))).sum(axis=1)
    return MeasuredProfile(TURN, TABLE_1_ELLIPSE.radius(TURN) + form)


def searched(design, matrix):
    return np.array([extremes_arcmin(design, DriveErrors.from_matrix(row), "exact") for row in matrix])


@pytest.mark.parametrize("structure", Structure, ids=lambda structure: structure.value)
def test_the_exact_geometry_of_the_contour(structure):
    """Would catch a structure that takes away the other eccentricity, and a place that the table gives unpolished."""
    design, matrix = drive(ground(), structure), random_errors(3, seed=5).to_matrix()
    assert beat_extremes_arcmin(design, matrix) == pytest.approx(searched(design, matrix), abs=ARCMIN)


@njit
def place_of(constants, zone, rim):
    start, steps = contour_kernel._start(constants, zone, rim)
    return contour_kernel._polished(constants.points, start, rim, steps)


def test_errors_beyond_what_is_tabulated():
    """Ten times the shipped tolerances; and a motion across beyond the table, whose place is searched: would catch a
    start from the end of the table."""
    design, matrix = drive(ground(seed=2)), random_errors(1, seed=6, scale=10.0).to_matrix()
    expected = pytest.approx(searched(design, matrix), abs=ARCMIN)
    assert beat_extremes_arcmin(design, matrix) == expected
    rim = contour_kernel.Rim(0.0, 1.0, 0.0, 1.0, 0.0, 1.5 * contour_kernel.ACROSS_REACH)
    constants = contour_kernel.contour_constants(design)
    for zone in range(2):
        place = place_of(constants, zone, rim)
        x, y = constants.points[:2]
        far = np.argmax(np.where((y > 0) == (zone == 0), np.hypot(x + rim.v_0, y), 0.0))
        assert (place - far + 4096) % 8192 - 4096 == pytest.approx(0, abs=1)


def test_a_cam_ground_off_centre_is_an_eccentric_one():
    """The ellipse's own points moved by (6, 4) um, without errors: the wave generator of an eccentricity as large. The
    flexspline's teeth are left out: o' is seen from the cam's own centre, which is another one here."""
    x, y = (TABLE_1_ELLIPSE.radius(TURN) * turned for turned in (np.sin(TURN), np.cos(TURN)))
    x, y = x + 0.004, y + 0.006
    design = drive(MeasuredProfile(np.arctan2(x, y), np.hypot(x, y)))
    eccentric = DriveErrors(wg_eccentricity=math.hypot(0.006, 0.004), wg_eccentricity_direction=math.atan2(4, 6))
    beside = {"axis_eccentricity": 0.008, "axis_eccentricity_direction": 0.7, "cs_tooth_amplitude": 0.002}
    low, high = extremes_arcmin(drive(), eccentric.with_(**beside), "exact")
    assert float(peak_to_peak_arcmin(design, DriveErrors(**beside))) == pytest.approx(high - low, abs=ARCMIN)


@pytest.mark.parametrize("teeth", [60, 202, 640])
def test_other_numbers_of_teeth(teeth):
    gear = DriveGeometry(teeth, teeth + 2, 0.396 * 160 / teeth, math.radians(12), 30.65, 0.1, 0.1, 0.74)
    design, matrix = drive(ground(), geometry=gear), random_errors(1, seed=teeth).to_matrix()
    assert beat_extremes_arcmin(design, matrix) == pytest.approx(searched(design, matrix), abs=ARCMIN)


def test_measured_teeth_on_a_measured_cam():
    """Known tooth by tooth, with what the teeth in contact leave of misalignment and of a sine beside the tables."""
    rng = np.random.default_rng(3)
    cs, fs = (MeasuredTeeth.of(rng.normal(0, 0.004, z), "single") for z in (162, 160))
    design, row = replace(drive(ground()), cs_teeth=cs, fs_teeth=fs), BASE_ERRORS.to_matrix()
    walked = beat_extremes_arcmin(design, row, None, 0.9, 0.5)
    halved = BASE_ERRORS.with_(
        cs_tooth_amplitude=0.5 * BASE_ERRORS.cs_tooth_amplitude, fs_tooth_amplitude=0.5 * BASE_ERRORS.fs_tooth_amplitude
    )
    # Cubics join a table's places on one grid and another: within 1e-5 arcmin, as for smooth tips.
    assert walked[0] == pytest.approx(extremes_arcmin(design, halved, "exact", misalignment=0.9), abs=1e-5)


def test_the_measured_case_of_all_profiles():
    design, matrix = drive(PROFILES["measured"]), random_errors(2, seed=9).to_matrix()
    assert beat_extremes_arcmin(design, matrix) == pytest.approx(searched(design, matrix), abs=ARCMIN)
