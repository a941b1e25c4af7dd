"""The exported file as a measured wave generator: the same kinematic error as the profile it was made from."""

from __future__ import annotations

from dataclasses import replace

import cases
import numpy as np
import pytest
from wave_generators import drive

from hdopt.drive.profiles import TwoDisk, tip_radius_of_curvature
from hdopt.geometry.measure import measured_profile
from hdopt.geometry.step import read_step
from hdopt.kinematics.extremes import peak_to_peak_by_search_arcmin

pytestmark = pytest.mark.slow

SAME = 1e-4
"""What the round trip may change in the peak-to-peak, arcmin; both sides take the exact geometry."""


@pytest.mark.parametrize("profile", ["ellipse", "two_disk", "resal", "measured"])
def test_file_gives_the_same_kinematic_error(exported, profile):
    original = drive(profile)
    generator = original.wave_generator
    file = read_step(exported(profile).files["step"])
    wrap = generator.profile if isinstance(generator.profile, TwoDisk) else None
    measured = measured_profile(file, generator.bearing_thickness, wrap)
    made = replace(original, wave_generator=replace(generator, profile=measured))
    before, after = (_peak_to_peak(one) for one in (original, made))
    assert after == pytest.approx(before, abs=SAME)


def _peak_to_peak(one) -> float:
    return float(np.squeeze(peak_to_peak_by_search_arcmin(one, cases.BASE_ERRORS)))


def test_two_discs_leave_the_arc_of_the_first_order_formula(exported):
    """The discs share the tip and its curvature with Eq. (38); away from it they may differ, by what the note says."""
    profile = drive("two_disk").wave_generator.profile
    result = exported("two_disk")
    measured = measured_profile(read_step(result.files["step"]), 3.0, profile)
    # Up to 5 deg before the discs' edge: there the spline through the points feels the free part.
    phi = np.linspace(-1, 1, 401) * (profile.wrap_angle - np.radians(5))
    rho = tip_radius_of_curvature(profile)
    offset = profile.semi_major - rho
    circle = offset * np.cos(phi) + np.sqrt(rho**2 - (offset * np.sin(phi)) ** 2)
    assert measured.radius(phi) == pytest.approx(circle, abs=1e-5)
    assert abs(measured.radius(0.0, 2) - profile.radius(0.0, 2)) < 1e-4
    assert 0 < np.max(circle - profile.radius(phi)) < 5.78e-3
    assert "up to 5.78 um outside Eq. (38)" in result.model.notes[0]
