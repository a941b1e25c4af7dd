"""Lag at reversal for every structure, and interference."""

from dataclasses import replace

import numpy as np
import pytest
from cases import BASE_ERRORS, drive

from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Clearances, Structure
from hdopt.drive.values import DriveError
from hdopt.errors import MissingValue
from hdopt.kinematics import kinematic_error_arcmin
from hdopt.mechanics.lag import Lag, lag

THETA = np.radians(np.arange(360.0))
CLEARANCES = Clearances(0.03, 0.02, 6.0, 8.0, 15.0)


def lag_of(structure, errors=BASE_ERRORS, clearances=CLEARANCES):
    design = replace(drive(structure=structure), clearances=clearances)
    return lag(design, errors, THETA, kinematic_error_arcmin(design, errors, THETA))


def test_aligned_cross_slide_has_the_lag_of_clearance_over_reach():
    # No offset: each slot acts at the disc's radius, whatever its width, since the corner of the slot lies on it.
    expected = 2 * 0.02 / (80 * 15.0) * 10800 / np.pi
    assert lag_of(Structure.AUTOMATIC, DriveErrors()).cross_slide_arcmin == pytest.approx(np.full(360, expected))


def test_each_structure_has_the_lag_of_its_own_slots():
    parts = {structure: lag_of(structure).cross_slide_arcmin for structure in Structure}
    assert (parts[Structure.INTEGRAL] == 0).all()
    assert parts[Structure.AUTOMATIC] == pytest.approx(parts[Structure.ONE_WAY_MAJOR] + parts[Structure.ONE_WAY_MINOR])
    assert (parts[Structure.ONE_WAY_MAJOR] > 0).all()


def test_teeth_lag_by_the_backlash_less_the_driving_deviation():
    found = lag_of(Structure.INTEGRAL)
    waveform = kinematic_error_arcmin(drive(), BASE_ERRORS, THETA)
    assert found.backlash_arcmin + waveform == pytest.approx(np.full(360, 0.03 * drive().geometry.arcmin_per_mm))
    assert found.interference == 0


def test_interference_is_reported_not_clipped():
    found = lag_of(Structure.INTEGRAL, clearances=replace(CLEARANCES, backlash=0.005))
    assert found.backlash_arcmin.min() < 0
    assert found.to_dict()["interference_share"] == np.mean(found.backlash_arcmin < 0) > 0
    assert found.to_dict()["parts"]["backlash"]["min"] == found.backlash_arcmin.min()


def test_missing_clearances_are_named():
    with pytest.raises(MissingValue, match="the lag needs clearances.backlash_mm"):
        lag_of(Structure.INTEGRAL, clearances=Clearances())
    with pytest.raises(
        MissingValue,
        match=r"automatic structure needs clearances.cross_slide_clearance_mm .* clearances.slot_1_width_mm",
    ):
        lag_of(Structure.AUTOMATIC, clearances=Clearances(backlash=0.01))
    with pytest.raises(MissingValue, match=r"one_way_minor structure needs clearances.slot_2_width_mm, which"):
        lag_of(Structure.ONE_WAY_MINOR, clearances=replace(CLEARANCES, slot_1_width=None, slot_2_width=None))


def test_impossible_clearances_are_refused():
    with pytest.raises(DriveError, match=r"a slot must be narrower than the disc \(20 mm\)"):
        Clearances(slot_1_width=25.0, disc_radius=10.0)
    with pytest.raises(DriveError, match="backlash is -0.1; a clearance must be a finite number, 0 or above"):
        Clearances(backlash=-0.1)


def test_each_slot_runs_off_by_the_offset_along_it():
    """Jia 2021, Eq. (33), from vectors: the input axis' eccentricity stands still, the wave generator's turns with it;
    slot 1 lies along its major axis, slot 2 along the minor."""
    e1, beta, e2, alpha = 0.4, 0.7, 0.25, 2.1
    errors = DriveErrors(
        axis_eccentricity=e1,
        axis_eccentricity_direction=beta,
        wg_eccentricity=e2,
        wg_eccentricity_direction=alpha,
    )
    expected = np.empty((2, len(THETA)))
    for i, theta in enumerate(THETA):  # angles count clockwise from +y
        major, minor = (np.array([np.sin(theta + t), np.cos(theta + t)]) for t in (0, np.pi / 2))
        offset = e1 * np.array([np.sin(beta), np.cos(beta)]) + e2 * (np.cos(alpha) * major + np.sin(alpha) * minor)
        for slot, (axis, width) in enumerate(((major, 6.0), (minor, 8.0))):
            reach = np.sqrt(15.0**2 - (width / 2) ** 2) + abs(offset @ axis)
            expected[slot, i] = 0.02 / (80 * np.hypot(reach, width / 2)) * 10800 / np.pi
    assert lag_of(Structure.ONE_WAY_MAJOR, errors).cross_slide_arcmin == pytest.approx(expected[0], rel=1e-12)
    assert lag_of(Structure.ONE_WAY_MINOR, errors).cross_slide_arcmin == pytest.approx(expected[1], rel=1e-12)
    assert lag_of(Structure.AUTOMATIC, errors).cross_slide_arcmin == pytest.approx(expected.sum(axis=0), rel=1e-12)


def test_flanks_interfere_whatever_play_the_cross_slide_adds():
    """Half of the angles have a negative backlash, and none a negative sum."""
    # Flanks that just touch do not interfere.
    assert Lag(np.zeros(4), np.array([-1.0, 0.0, 0.0, 1.0])).interference == 0.25
    found = Lag(np.array([5.0, 5.0]), np.array([-1.0, 1.0]))
    assert found.interference == 0.5
    assert found.to_dict()["min"] == 4.0


def test_a_lag_is_told_by_its_mean_and_both_ends():
    """Of the sum and of each part; a quarter of the angles interferes."""
    found = Lag(np.array([0.1, 0.2, 0.3, 0.2]), np.array([0.5, -0.1, 0.7, 0.1]))
    told = found.to_dict()
    assert (told["mean"], told["min"], told["max"]) == pytest.approx((0.5, 0.1, 1.0))
    assert tuple(told["parts"]["cross_slide"].values()) == pytest.approx((0.2, 0.1, 0.3))
    assert tuple(told["parts"]["backlash"].values()) == pytest.approx((0.3, -0.1, 0.7))
    assert told["interference_share"] == 0.25
