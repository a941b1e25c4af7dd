"""Lag at reversal for every structure, and interference."""

from dataclasses import replace

import numpy as np
import pytest
from cases import BASE_ERRORS, drive

from hdopt.deviations import DriveErrors
from hdopt.drive import Clearances, DriveError, Structure
from hdopt.errors import MissingValue
from hdopt.kinematics import kinematic_error_arcmin
from hdopt.kinematics.lag import lag

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
