"""The kinematic error over Cartesian errors: the model of the other kinematics, its slope, and the way back."""

import numpy as np
import pytest

from hdopt.effects.met import met_angles
from hdopt.kinematics.cartesian import PARAMETERS, CartesianModel, to_cartesian, to_drive_errors
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


@pytest.mark.parametrize("rows", [1, 127, 128, 129, 300])
def test_every_angle_is_evaluated_as_if_alone(drive, rows):
    """Blocks of lanes have edges; what acts in the zones goes with its own angle."""
    rng = np.random.default_rng(rows)
    model = CartesianModel.of(drive)
    theta, extra = rng.uniform(0, 500, rows), rng.normal(size=(2, rows)) * 1e-3
    errors = rng.normal(size=12) * 0.01
    together = model.evaluate(theta, errors, extra)
    for i in {0, rows // 2, rows - 1}:
        alone = model.evaluate(theta[i : i + 1], errors, extra[:, i : i + 1])
        for one, many in zip(alone, together, strict=True):
            np.testing.assert_array_equal(one[0], many[i])


def test_far_tips_are_met_at_their_sine(drive):
    """Errors a hundred times too large move the tip round the spline by radians: the compiled sines are those of the
    mathematical library there too, to 1e-12 of teeth of 10 mm."""
    model = CartesianModel.of(drive)
    theta = np.linspace(0, 80 * TURN, 4001)
    cartesian = np.array([3.0, -2.0, 0.1, 0.2, 1.0, 2.0, 0.1, 0.1, 10.0, -5.0, 8.0, 3.0])
    errors = to_drive_errors(cartesian, model.half_width)
    value, _, _ = model.evaluate(theta, cartesian)
    np.testing.assert_allclose(
        value, kinematic_error_arcmin(drive, errors, theta, "closed form"), rtol=1e-11, atol=1e-8
    )


@pytest.mark.parametrize("rows", [1, 129, 300])
def test_waves_are_met_where_the_zone_is(drive, rows):
    """Against the waves at the angles that `met_angles` gives, added to both zones from outside. Faults caught: a wave
    met at its zone's end, one spline's waves on the other, a slope that forgets how many waves there are."""
    model = CartesianModel.of(drive)
    rng = np.random.default_rng(2)
    theta = rng.uniform(0, 500, rows)
    errors = 0.01 * rng.normal(size=PARAMETERS)
    on_cs, on_fs = 1e-3 * rng.normal(size=(2, 5)), 1e-3 * rng.normal(size=(2, 12))
    angles = met_angles(theta, model.advance, model.beyond_at(model.rotation(theta), errors))
    extra, rises = np.zeros((2, rows)), np.zeros((2, 2, rows))
    for spline, waves in enumerate((on_cs, on_fs)):
        for k, (a, b) in enumerate(waves.T, start=1):
            extra += a * np.sin(k * angles[spline]) + b * np.cos(k * angles[spline])
            rises[spline] += k * (a * np.cos(k * angles[spline]) - b * np.sin(k * angles[spline]))
    expected = model.evaluate_at(model.rotation(theta), errors, extra, rises)
    found = model.evaluate_at(model.rotation(theta), errors, waves=(on_cs, on_fs))
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9 * np.abs(other).max(), rtol=0)
