"""Numbers of a study in the units of its keys, against the base units inside: mm, N, rad, s."""

from math import pi

import pytest

from hdopt.study import load_study


def study(*settings):
    return load_study("csf-25-80", settings)


def test_load():
    load = study("load.torque_nm=63", "load.input_speed_rpm=1500", "load.tooth_face_width_mm=9").drive.load
    assert load.torque == pytest.approx(63_000)  # N mm
    assert load.input_speed == pytest.approx(1500 * 2 * pi / 60)
    assert load.tooth_face_width == 9.0


def test_operation():
    found = study("operation.speed_rpm=30", "operation.output_torque_nm=20", "operation.time_s=5").operation
    assert found.speed == pytest.approx(pi)
    assert (found.torque, found.time) == (20.0, 5.0)


def test_angles_of_errors_and_geometry():
    found = study("errors.axis_tilt_y_deg=0.2", "errors.axis_eccentricity_mm=0.01", "drive.pressure_angle_deg=15")
    assert found.errors.axis_tilt_y == pytest.approx(0.2 * pi / 180)
    assert found.errors.axis_eccentricity == 0.01
    assert found.drive.geometry.pressure_angle == pytest.approx(pi / 12)


def test_wrap_angle():
    found = study('wave_generator.profile="two_disk"', "wave_generator.wrap_angle_deg=30")
    assert found.drive.wave_generator.profile.wrap_angle == pytest.approx(pi / 6)
