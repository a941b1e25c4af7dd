"""The kinematic error over Cartesian errors: the model of the other kinematics, its slope, and the way back."""

import numpy as np
import pytest

from hdopt.kinematics.cartesian import CartesianModel, to_cartesian, to_drive_errors
from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.study import load_study

TURN = 2 * np.pi


@pytest.fixture(scope="module")
def study():
    return load_study(drive="csf-25-80")


@pytest.fixture(scope="module")
def drive(study):
    return study.drive


def test_waveform_is_the_models(drive, study):
    """The compiled form for fits and the library's waveform are one model (both sum the same terms: rounding only)."""
    rng = np.random.default_rng(2)
    model = CartesianModel.of(drive)
    theta = np.linspace(0, 80 * TURN, 4001)
    for _ in range(5):
        errors = to_drive_errors(rng.normal(size=12) * 0.005, model.half_width)
        value, _, _ = model.evaluate(theta, to_cartesian(errors, model.half_width))
        np.testing.assert_allclose(value, kinematic_error_arcmin(drive, errors, theta, "closed form"), atol=1e-10)


def test_jacobian_is_the_slope(drive):
    rng = np.random.default_rng(4)
    model = CartesianModel.of(drive)
    theta = np.linspace(0, 20, 997)
    parameters = rng.normal(size=12) * 0.005
    _, _, jacobian = model.evaluate(theta, parameters)
    for j in range(12):
        step = np.eye(12)[j] * 1e-7
        slope = (model.evaluate(theta, parameters + step)[0] - model.evaluate(theta, parameters - step)[0]) / 2e-7
        # The median: a central difference is wrong where it straddles a change of zone or rim.
        assert np.median(np.abs(slope - jacobian[:, j])) < 1e-5


def test_errors_and_cartesian_are_inverse(study):
    there = to_cartesian(study.errors, 4.5)
    np.testing.assert_allclose(to_drive_errors(there, 4.5).to_matrix(), study.errors.to_matrix(), atol=1e-12)
