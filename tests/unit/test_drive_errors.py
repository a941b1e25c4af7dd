"""The errors of one drive or of many: to a matrix and back."""

import numpy as np
import pytest

from hdopt.drive.errors import AMPLITUDE_NAMES, ERROR_NAMES, DriveErrors
from hdopt.drive.geometry import DriveGeometry
from hdopt.errors import HdoptError
from hdopt.study import load_study


@pytest.mark.parametrize("shape", [(), (1,), (5,), (2, 3)])
def test_errors_come_back_from_their_matrix(shape):
    """One drive, several, and drives in a table. Faults caught: columns in another order, an axis that is not the last,
    one drive taken for several, a matrix of several drives refused."""
    matrix = np.abs(np.random.default_rng(0).normal(size=(*shape, len(ERROR_NAMES))))
    errors = DriveErrors.from_matrix(matrix)
    assert errors.shape == shape
    for i, name in enumerate(ERROR_NAMES):
        np.testing.assert_array_equal(getattr(errors, name), matrix[..., i])
    np.testing.assert_array_equal(errors.to_matrix(), matrix.reshape(-1, len(ERROR_NAMES)))


def test_a_single_error_of_several_drives_is_that_of_all():
    errors = DriveErrors(axis_eccentricity=np.array([0.01, 0.02, 0.03]), wg_tilt_major=0.1)
    assert errors.shape == (3,)
    np.testing.assert_array_equal(errors.to_matrix()[:, ERROR_NAMES.index("wg_tilt_major")], 0.1)


@pytest.mark.parametrize("columns", [11, 13, 1])
def test_a_matrix_of_other_columns_is_refused(columns):
    with pytest.raises(ValueError, match="12 errors"):
        DriveErrors.from_matrix(np.zeros((4, columns)))


@pytest.mark.parametrize("name", AMPLITUDE_NAMES)
def test_a_size_below_zero_is_refused_and_a_tilt_is_not(name):
    with pytest.raises(ValueError, match=f"{name} holds a negative value"):
        DriveErrors(**{name: np.array([0.01, -0.01])})
    assert DriveErrors(axis_tilt_x=-0.01).axis_tilt_x == -0.01


def test_an_error_that_is_none_is_refused():
    with pytest.raises(HdoptError, match="axis_eccentricity"):
        DriveErrors().with_(axis_excentricity=0.1)


@pytest.mark.parametrize(("fs", "cs"), [(160, 160), (160, 161), (160, 164), (160, 322), (162, 160)])
def test_a_tooth_difference_other_than_two_is_refused(fs, cs):
    """322 is twice 160 and two more. Faults caught: a remainder for the difference, a difference counted either way."""
    geometry = load_study(drive="csf-25-80").drive.geometry
    given = {name: getattr(geometry, name) for name in vars(geometry)}
    with pytest.raises(HdoptError, match="teeth|tooth difference"):
        DriveGeometry(**given | {"flexspline_teeth": fs, "circular_spline_teeth": cs})
