"""Normal equations: inner products of columns of which each row meets one group alone, and small symmetric systems,
solved many thousand times: by Cholesky's factors, and for many subsets of one table.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.linalg.blas import dtrsm
from scipy.linalg.lapack import dposv

from hdopt.arrays import Array, Index
from hdopt.diagnosis.numerical import RANK, SMALL_RIDGE


def solved(matrix: Array, moment: Array) -> Array:
    """x of `matrix` x = `moment` for a symmetric `matrix` (n, n), whose upper triangle counts, and `moment` (n,): by
    Cholesky's factors (LAPACK's `dposv`), and in general where rounding left it no longer positive.

    Raises
    ------
    numpy.linalg.LinAlgError
        if the matrix is singular.
    """
    _, solution, failed = dposv(matrix, moment)
    return np.asarray(np.linalg.solve(matrix, moment) if failed else solution, np.float64)


def least_squares(columns: Array, values: Array) -> Array:
    """The coefficients (q,) of `columns` (n, q) that leave least of `values` (n,), of least size where that leaves them
    open: as `numpy.linalg.lstsq`, which takes singular values of a single column too.
    """
    if columns.shape[1] != 1:
        return np.asarray(np.linalg.lstsq(columns, values, rcond=None)[0], np.float64)
    power = float(columns[:, 0] @ columns[:, 0])
    return np.array([float(columns[:, 0] @ values) / power if power > 0 else 0.0])


def orthonormal(columns: Array) -> Array:
    """An orthonormal basis (n, r) of what the `columns` (n, q), of like size, span beyond rounding: by Cholesky's
    factors of their inner products, taken twice (Yamamoto et al., ETNA 44, 2015: as orthogonal as Householder's), and
    by singular values where the columns hang together so closely that those would lose digits.
    """
    basis = columns
    for _ in range(2):
        try:
            factor = np.linalg.cholesky(basis.T @ basis)
        except np.linalg.LinAlgError:
            return _independent(columns)
        power = np.diag(factor) ** 2
        if power.min() < RANK * power.max():
            return _independent(columns)
        basis = dtrsm(1.0, factor, np.asfortranarray(basis), side=1, lower=1, trans_a=1)
    return np.asarray(basis, np.float64)


def _independent(columns: Array) -> Array:
    """`orthonormal` by singular values, without the directions that are rounding."""
    basis, size, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asfortranarray(basis[:, size > RANK * size[0]])


@dataclass(frozen=True)
class GroupedColumns:
    """Columns (n, q) of which row i is `size`[i] times row `group`[i] of `basis` (g, q): each row meets one group, so
    that sums over the rows of each group hold all their inner products.
    """

    group: Index
    size: Array
    basis: Array

    def gram(self) -> Array:
        """Inner products of the columns with each other, (q, q)."""
        power = np.bincount(self.group, self.size**2, len(self.basis))
        return np.asarray(self.basis.T @ (power[:, None] * self.basis))

    def products(self, columns: Array) -> Array:
        """Inner products with other `columns` (n, k), (q, k)."""
        return np.asarray(self.basis.T @ sums_of_groups(columns, self.group, self.size, len(self.basis)))


def sums_of_groups(columns: Array, group: Index, size: Array, groups: int) -> Array:
    """Sums of `columns` (n, k) times `size` (n,) over the rows of each `group` (n,), of so many (`groups`):
    (groups, k). What `numpy.add.at` gives, in a third of the time.
    """
    sums: Array = _sums_of_groups(np.ascontiguousarray(columns.T), group, size, groups).T
    return sums


@njit(cache=True, nogil=True, fastmath=False)
def _sums_of_groups(columns: Array, group: Index, size: Array, groups: int) -> Array:
    """The same of `columns` (k, n), (k, groups)."""
    sums = np.zeros((len(columns), groups))
    for k in range(len(columns)):
        for i in range(len(group)):
            sums[k, group[i]] += size[i] * columns[k, i]
    return sums


def bordered(white: Array, residual: Array, grouped: GroupedColumns) -> tuple[Array, Array]:
    """Inner products of the columns `white` (n, k) and, after them, of the `grouped` ones (n, q) with each other,
    (k + q, k + q), and of all with the `residual` (n,), (k + q,).
    """
    across = grouped.products(white)
    gram = np.block([[white.T @ white, across.T], [across, grouped.gram()]])
    return gram, np.r_[white.T @ residual, grouped.products(residual[:, None])[:, 0]]


def gains_of_subsets(gram: Array, moment: Array, ends: Index, subsets: Index) -> Array:
    """m' G^-1 m of each of the `subsets` (s, k) of blocks of columns, -1 where one has fewer than k: block i holds the
    columns from `ends`[i] to `ends`[i + 1] of the Gram matrix `gram` (n, n) of unit columns and of their `moment` (n,)
    with what is explained. A small ridge keeps parallel columns solvable.
    """
    gains: Array = _gains(gram, moment, ends, subsets, SMALL_RIDGE)
    return gains


@njit(cache=True, nogil=True, fastmath=False)
def _gains(gram: Array, moment: Array, ends: Index, subsets: Index, ridge: float) -> Array:
    count, most = subsets.shape
    widest = 0
    for i in range(len(ends) - 1):
        widest = max(widest, ends[i + 1] - ends[i])
    column = np.empty(widest * most, np.int64)
    factor, part = np.empty((widest * most, widest * most)), np.empty(widest * most)
    gains = np.empty(count)
    for s in range(count):
        n = 0
        for block in subsets[s]:
            if block < 0:
                continue
            for at in range(ends[block], ends[block + 1]):
                column[n] = at
                n += 1
        gain = 0.0
        # The factor L of L L' = G + ridge, row by row, and with it L^-1 m, whose square is the gain.
        for i in range(n):
            rest = moment[column[i]]
            for j in range(i):
                total = gram[column[i], column[j]]
                for k in range(j):
                    total -= factor[i, k] * factor[j, k]
                factor[i, j] = total / factor[j, j]
                rest -= factor[i, j] * part[j]
            square = gram[column[i], column[i]] + ridge
            for k in range(i):
                square -= factor[i, k] * factor[i, k]
            factor[i, i] = math.sqrt(max(square, ridge * ridge))
            part[i] = rest / factor[i, i]
            gain += part[i] * part[i]
        gains[s] = gain
    return gains
