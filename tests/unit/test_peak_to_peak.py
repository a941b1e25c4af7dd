"""The compiled peak-to-peak against the search that looks everywhere, and against walking the beat."""

from types import SimpleNamespace

import numpy as np
import pytest
from cases import BASE_ERRORS, PROFILES, drive, random_errors
from hypothesis import given, settings
from hypothesis import strategies as st

from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import DriveGeometry, Structure
from hdopt.kinematics import peak_to_peak_arcmin
from hdopt.kinematics.extremes import (
    extremes_arcmin,
    peak_to_peak_by_search_arcmin,
    walked_peak_to_peak_arcmin,
)
from hdopt.kinematics.peak_to_peak import matrix_peak_to_peak_arcmin
from hdopt.optimize.objectives import PeakToPeakQuantile
from hdopt.parallel.engine import engine_in_force

SMOOTH = [profile for profile in PROFILES.values() if profile.tip_is_smooth]


@pytest.mark.parametrize("structure", Structure, ids=lambda structure: structure.value)
@pytest.mark.parametrize("profile", SMOOTH, ids=lambda profile: profile.name)
def test_kernel_finds_what_the_search_finds(profile, structure):
    design, errors = drive(profile, structure), random_errors(60, seed=len(profile.name))
    difference = np.abs(peak_to_peak_arcmin(design, errors) - peak_to_peak_by_search_arcmin(design, errors))
    # What the kernel promises: parabolas stand for the branches next to an extreme.
    assert np.quantile(difference, 0.95) < 1e-3
    assert difference.max() < 5e-3


def test_search_is_the_limit_of_walking_the_beat():
    converged = np.ptp(extremes_arcmin(drive(), BASE_ERRORS))
    walked = [walked_peak_to_peak_arcmin(drive(), BASE_ERRORS, np.radians(grid), 80) for grid in (1.0, 0.2, 0.05)]
    assert walked == sorted(walked)
    assert walked[-1] < converged < walked[-1] + 0.0005


@pytest.mark.parametrize("teeth", [(100, 102), (101, 103), (200, 202)])
def test_other_tooth_numbers_odd_ones_too(teeth):
    design = drive(geometry=DriveGeometry(*teeth, 0.5, 0.3, 30.65))
    errors = random_errors(20, seed=3)
    found, searched = peak_to_peak_arcmin(design, errors), peak_to_peak_by_search_arcmin(design, errors)
    assert found == pytest.approx(searched, abs=5e-3)


@settings(max_examples=25, deadline=None)
@given(teeth=st.integers(30, 320), index=st.integers(0, 999))
def test_a_search_sees_every_phase_of_the_beat(teeth, index):
    """Z_FS/2 phases instead of Z_FS/gcd(Z_FS, Z_CS) are wrong for odd tooth numbers, by 0.04 arcmin at Z_FS = 61."""
    design = drive(geometry=DriveGeometry(teeth, teeth + 2, 0.5, 0.3, 30.65))
    errors = random_errors(8, seed=index)
    sample = errors.to_matrix()
    conditions = SimpleNamespace(drawn=lambda: sample, of=lambda drives, design: drives, teeth=None, added=None)
    found = PeakToPeakQuantile()._sample(conditions, SimpleNamespace(drive=design))
    searched = peak_to_peak_by_search_arcmin(design, errors)
    # What the compiled kernel promises.
    assert np.abs(found - searched).max() < 5e-3


@pytest.mark.parametrize(
    "errors",
    [
        DriveErrors(),
        DriveErrors(wg_eccentricity=0.005, wg_tilt_major=0.002),
        DriveErrors(fs_tooth_amplitude=0.002),
        DriveErrors(cs_tooth_amplitude=0.002, cs_tooth_phase=1.0),
        DriveErrors(axis_eccentricity=0.01),
        DriveErrors(axis_tilt_x=0.01),
    ],
)
def test_single_causes_and_none(errors):
    searched = np.ptp(extremes_arcmin(drive(), errors, "closed form"))
    assert float(peak_to_peak_arcmin(drive(), errors)) == pytest.approx(searched, abs=1e-6)


def test_any_errors_may_be_zero():
    """Would catch a stretch of angles that no rule lets in: the value is then 1e32."""
    matrix = random_errors(300, seed=4).to_matrix()
    matrix[np.random.default_rng(1).random(matrix.shape) < 0.5] = 0.0
    for structure in Structure:
        design = drive(PROFILES["resal"], structure)
        found = matrix_peak_to_peak_arcmin(design, matrix)
        searched = peak_to_peak_by_search_arcmin(design, DriveErrors.from_matrix(matrix[:40]), "closed form")
        assert np.abs(found).max() < 5.0
        assert np.abs(found[:40] - searched).max() < 1e-3


def test_arrays_keep_their_shape_and_engines_do_not_matter():
    errors = random_errors(20_000, seed=1)
    found = []
    for engine in ("process", "threads:2"):
        with engine_in_force(engine):
            found.append(peak_to_peak_arcmin(drive(), errors))
    one, two = found
    assert np.array_equal(one, two)
    grid = BASE_ERRORS.with_(axis_eccentricity=np.linspace(0, 0.01, 3)[:, None], wg_tilt_major=np.zeros(4))
    assert peak_to_peak_arcmin(drive(), grid).shape == (3, 4)


def test_a_value_depends_on_its_own_drive_alone():
    """Would catch a spare lane, a neighbour or a remainder loop that reaches into a drive's value."""
    matrix = random_errors(700, seed=2).to_matrix()
    matrix[::50] = 0.0
    whole = matrix_peak_to_peak_arcmin(drive(), matrix)
    order = np.random.default_rng(0).permutation(len(matrix))
    assert np.array_equal(matrix_peak_to_peak_arcmin(drive(), matrix[order]), whole[order])
    assert [float(matrix_peak_to_peak_arcmin(drive(), row[None])[0]) for row in matrix[:60]] == whole[:60].tolist()
    assert np.array_equal(matrix_peak_to_peak_arcmin(drive(), np.asfortranarray(matrix)), whole)


@pytest.mark.parametrize("turns", [1, -1, 1000])
def test_whole_turns_of_phases_change_nothing(turns):
    """Would catch phases that are reduced in single precision: 1000 turns cost it 4e-4 rad."""
    errors = random_errors(200, seed=8)
    turned = errors.with_(
        **{
            name: getattr(errors, name) + turns * 2 * np.pi
            for name in ("axis_eccentricity_direction", "wg_eccentricity_direction", "cs_tooth_phase", "fs_tooth_phase")
        }
    )
    # A few roundings of single precision: 2e-9 mm of 108 arcmin/mm each.
    assert peak_to_peak_arcmin(drive(), turned) == pytest.approx(peak_to_peak_arcmin(drive(), errors), abs=2e-6)


@pytest.mark.parametrize("structure", Structure, ids=lambda structure: structure.value)
def test_three_times_the_shipped_tolerances(structure):
    """99 % within 1e-3 arcmin and all within 5e-3 is measured on 20,000 drives; here on a few of the hardest profile.

    Would catch FS phases chosen by the first-order gap (2e-2 arcmin) and zeros of t looked for where first order has
    them (2e-2).
    """
    design, errors = drive(PROFILES["two_disk"], structure), random_errors(100, seed=46, scale=3.0)
    searched = peak_to_peak_by_search_arcmin(design, errors, "closed form")
    difference = np.abs(peak_to_peak_arcmin(design, errors) - searched)
    assert np.mean(difference <= 1e-3) >= 0.95
    assert difference.max() < 5e-3


def test_a_measured_profile_goes_through_its_contour():
    measured, analytic = (drive(PROFILES["measured"]), drive())
    expected = np.ptp(extremes_arcmin(analytic, BASE_ERRORS, "exact"))
    assert float(peak_to_peak_arcmin(measured, BASE_ERRORS)) == pytest.approx(expected, abs=1e-5)
