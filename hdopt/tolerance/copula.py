"""Correlation between inputs: a Gaussian copula over groups of them.

OpenTURNS' normal copula gives the same numbers at 50 times the cost, and none with only some of the inputs given:
`python -m tests.benchmarks.distributions`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from hdopt.arrays import Array
from hdopt.errors import HdoptError
from hdopt.words import counted


@dataclass(frozen=True)
class CorrelationGroup:
    """Inputs that vary together: their names and the correlation matrix of their normal scores, shape (k, k)."""

    names: tuple[str, ...]
    matrix: ArrayLike = field(repr=False)

    def __post_init__(self) -> None:
        matrix = np.asarray(self.matrix, float)
        size = len(self.names)
        where = f"the correlation matrix of {', '.join(self.names)}"
        if len(set(self.names)) != size or size < 2:
            raise HdoptError(f"{where} names {counted(size, 'input')}; it must name at least two, each once")
        if matrix.shape != (size, size):
            raise HdoptError(f"{where} has shape {matrix.shape}; it must be {size} x {size}")
        if not np.all(np.isfinite(matrix)) or not np.allclose(matrix, matrix.T, atol=1e-12):
            raise HdoptError(f"{where} is not symmetric; entry (i, j) must equal entry (j, i)")
        if not np.allclose(np.diag(matrix), 1, atol=1e-12):
            raise HdoptError(f"{where} has a diagonal of {np.diag(matrix)}; every entry there must be 1")
        smallest = float(np.linalg.eigvalsh(matrix)[0])
        if smallest <= 1e-10:
            raise HdoptError(
                f"{where} is not positive definite: its smallest eigenvalue is {smallest:.3g}, it must be above 0; "
                "no set of errors can be correlated like this, bring the entries nearer to zero"
            )
        object.__setattr__(self, "matrix", matrix)


@dataclass(frozen=True)
class GaussianCopula:
    """Independent normal scores in, correlated ones out; the identity where no group is given."""

    names: tuple[str, ...]
    groups: tuple[CorrelationGroup, ...] = ()

    def __post_init__(self) -> None:
        seen: set[str] = set()
        for group in self.groups:
            for name in group.names:
                if name not in self.names:
                    from hdopt.errors import unknown_name

                    raise HdoptError(unknown_name("input in a correlation group", name, self.names))
                if name in seen:
                    raise HdoptError(f"{name} is in two correlation groups; put all inputs it goes with into one")
                seen.add(name)

    @property
    def is_independent(self) -> bool:
        return not self.groups

    @cached_property
    def correlation(self) -> Array:
        """The whole correlation matrix of normal scores, shape (d, d)."""
        matrix = np.eye(len(self.names))
        for group in self.groups:
            matrix[np.ix_(self._columns(group), self._columns(group))] = group.matrix
        return matrix

    def _columns(self, group: CorrelationGroup) -> list[int]:
        return [self.names.index(name) for name in group.names]

    def correlate(self, u: Array) -> Array:
        """Independent uniforms of shape (n, d) in (0, 1) to dependent ones; a copy where anything changes."""
        from scipy import special

        if self.is_independent:
            return u
        u = u.copy()
        for group in self.groups:
            columns = self._columns(group)
            scores = special.ndtri(u[:, columns]) @ np.linalg.cholesky(np.asarray(group.matrix, float)).T
            u[:, columns] = special.ndtr(scores)
        return u

    def condition(self, given: Sequence[int], scores: Array, noise: Array) -> Array:
        """Normal scores of all inputs where those of the columns `given` keep their values in `scores` (n, d) and the
        others are drawn from their conditional distribution by `noise` (n, d) of independent standard normals."""
        given, free = list(given), [i for i in range(len(self.names)) if i not in set(given)]
        result = scores.copy()
        if not free:
            return result
        r = self.correlation
        if given:
            gain = np.linalg.solve(r[np.ix_(given, given)], r[np.ix_(given, free)])
            mean = scores[:, given] @ gain
            covariance = r[np.ix_(free, free)] - r[np.ix_(free, given)] @ gain
        else:
            mean, covariance = np.zeros(len(free)), r[np.ix_(free, free)]
        result[:, free] = mean + noise[:, free] @ np.linalg.cholesky(covariance).T
        return result
