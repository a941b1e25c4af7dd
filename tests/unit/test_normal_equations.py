"""Small systems and the gains of subsets: the same as NumPy's general solution."""

import numpy as np
import pytest

from hdopt.diagnosis.inference.normal_equations import (
    GroupedColumns,
    bordered,
    gains_of_subsets,
    least_squares,
    orthonormal,
    solved,
    sums_of_groups,
)
from hdopt.diagnosis.numerical import SMALL_RIDGE


@pytest.fixture(scope="module")
def columns():
    table = np.random.default_rng(3).normal(size=(40, 9))
    return table / np.linalg.norm(table, axis=0)


@pytest.mark.parametrize("count", [1, 3])
def test_least_squares_are_those_of_the_library(columns, count):
    """Of one column too, which is worked out by itself; one of zeros takes nothing."""
    values = np.arange(40.0)
    expected = np.linalg.lstsq(5 * columns[:, :count], values, rcond=None)[0]
    assert least_squares(5 * columns[:, :count], values) == pytest.approx(expected, rel=1e-12)
    assert least_squares(np.zeros((40, count)), values) == pytest.approx(np.zeros(count))


def test_a_system_is_solved(columns):
    gram, moment = columns.T @ columns, np.arange(9.0)
    np.testing.assert_allclose(gram @ solved(gram, moment), moment, atol=1e-12)


def test_rounding_that_leaves_a_matrix_not_positive_stops_nothing():
    matrix, moment = np.diag([1.0, -1e-12]), np.array([1.0, 1e-12])
    np.testing.assert_allclose(solved(matrix, moment), [1.0, -1.0])


def test_a_singular_matrix_is_refused():
    with pytest.raises(np.linalg.LinAlgError):
        solved(np.zeros((2, 2)), np.ones(2))


@pytest.mark.parametrize("apart", [1.0, 1e-3, 1e-4, 1e-6])
def test_a_basis_is_orthonormal_and_spans_its_columns(apart):
    """Columns of which two lie so far (`apart`) from each other. Faults caught: one pass alone, orthogonal to 1e-9 at
    1e-4; factors of what hangs together more closely."""
    columns = np.random.default_rng(8).normal(size=(200, 6))
    columns[:, 5] = columns[:, 4] + apart * columns[:, 5]
    basis = orthonormal(columns)
    np.testing.assert_allclose(basis.T @ basis, np.eye(6), atol=1e-13)
    # What rounding of the columns leaves of their small difference.
    np.testing.assert_allclose(basis @ (basis.T @ columns), columns, atol=1e-14 / apart + 1e-13)


def test_a_basis_leaves_out_what_is_rounding():
    """A column that is the sum of others, to the last digit or to a hundredth of what counts."""
    columns = np.random.default_rng(9).normal(size=(200, 5))
    for rest in (0.0, 1e-9):
        twice = np.column_stack([columns, columns[:, :2].sum(1) + rest * columns[:, 2] ** 2])
        basis = orthonormal(twice)
        assert basis.shape == (200, 5)
        np.testing.assert_allclose(basis @ (basis.T @ columns), columns, atol=1e-7)


def test_gains_of_subsets_are_those_of_their_columns(columns):
    """Blocks of two, three, one and three columns, alone and together; each against least squares of its own."""
    target = np.random.default_rng(4).normal(size=40)
    ends = np.array([0, 2, 5, 6, 9])
    subsets = np.array([[0, -1, -1], [2, -1, -1], [0, 3, -1], [1, 2, 3], [0, 1, 3]])
    found = gains_of_subsets(columns.T @ columns, columns.T @ target, ends, subsets)
    for subset, gain in zip(subsets, found, strict=True):
        own = np.concatenate([np.arange(ends[i], ends[i + 1]) for i in subset if i >= 0])
        fitted = columns[:, own] @ np.linalg.lstsq(columns[:, own], target, rcond=None)[0]
        # The ridge takes its share of the gain, at most its ratio to the smallest eigenvalue.
        least = np.linalg.eigvalsh(columns[:, own].T @ columns[:, own])[0]
        assert gain == pytest.approx(fitted @ fitted, rel=2 * SMALL_RIDGE / least)


def test_a_column_twice_gains_as_much_as_once():
    gram, moment = np.ones((2, 2)), np.array([0.6, 0.6])
    found = gains_of_subsets(gram, moment, np.array([0, 1, 2]), np.array([[0, -1], [0, 1]]))
    assert found[1] == pytest.approx(found[0], rel=1e-6)


def test_columns_by_groups_have_the_products_that_they_have_written_out():
    """Seven groups of which one is met by no row, four columns, three others. Faults caught: the size once in the gram
    or twice in the products, blocks on the wrong side of the diagonal, the residual as a column."""
    rng = np.random.default_rng(6)
    group = rng.choice([0, 1, 2, 3, 5, 6], size=50)
    grouped = GroupedColumns(group, rng.normal(size=50), rng.normal(size=(7, 4)))
    white, residual = rng.normal(size=(50, 3)), rng.normal(size=50)
    columns = np.hstack([white, grouped.size[:, None] * grouped.basis[grouped.group]])
    gram, moment = bordered(white, residual, grouped)
    np.testing.assert_allclose(gram, columns.T @ columns, atol=1e-12)
    np.testing.assert_allclose(moment, columns.T @ residual, atol=1e-12)


@pytest.mark.parametrize("order", ["C", "F"])
def test_sums_of_groups_are_those_row_by_row(order):
    rng = np.random.default_rng(7)
    columns, group, size = rng.normal(size=(60, 5)), rng.choice([0, 1, 3], size=60), rng.normal(size=60)
    expected = np.zeros((5, 5))
    np.add.at(expected, group, columns * size[:, None])
    assert np.array_equal(sums_of_groups(np.array(columns, order=order), group, size, 5), expected)
