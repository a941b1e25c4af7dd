"""A quantile function as a table of cubics, for compiled passes: cells that shrink toward both ends with the tail.

A number u of (0, 1) has the smaller part v = min(u, 1 - u). Every octave of v has 16 cells of its own on either side,
so that a root at the end of the support or a tail without one is as smooth in its cells as the middle is in its own.
Whether a table is good enough is measured when it is made: what has a kink or a step has no table.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from hdopt.arrays import Array, Singles
from hdopt.tolerance.distributions import Distribution

OCTAVES = 32
"""Octaves of v: from 1/2 down to 2^-33, which Sobol' points of 30 bits never pass."""
CELL_BITS = 4
"""Bits of the mantissa of v that number the cells of an octave."""
SIDE = OCTAVES << CELL_BITS
"""Cells of one side; those of the upper side follow those of the lower one."""
SMALLEST = 0.5 ** (OCTAVES + 1)
ROUNDING = 2.0**-22
"""Largest error of a table, as a share of the value or of the interquartile range: four units of single precision,
in which the kernel takes the value anyway."""
CHECKED = 7
"""Places of a cell at which the table is compared with the function, ends included."""


def quantile_table(distribution: Distribution, factor: float = 1.0) -> Singles | None:
    """The quantiles of a `distribution` times a `factor`, as cubics in the place t in [0, 1) within a cell.

    Shape (2 SIDE, 4), lowest power first, cells of the lower side from the smallest v on. None where cubics miss the
    quantiles by more than `ROUNDING`.
    """
    lower = _cells()[:, None]
    width = np.repeat(0.5 ** np.arange(OCTAVES + 1, 1, -1), 1 << CELL_BITS)[:, None] / (1 << CELL_BITS)
    nodes = 0.5 - 0.5 * np.cos(np.pi * (np.arange(4) + 0.5) / 4)
    cubics = np.linalg.solve(np.vander(nodes, increasing=True), _both_sides(distribution, lower + width * nodes).T).T
    table = np.ascontiguousarray(factor * cubics, np.float32)
    places = np.linspace(0, 1, CHECKED)
    expected = factor * _both_sides(distribution, lower + width * places)
    found = table.astype(float) @ np.vander(places, 4, increasing=True).T
    spread = abs(factor) * float(np.ptp(distribution.quantile([0.25, 0.75])))
    allowed = ROUNDING * np.maximum(np.abs(expected), spread)
    return table if bool(np.all(np.abs(found - expected) <= allowed)) else None


@cache
def _cells() -> Array:
    """Where the cells of one side begin, from the smallest v on, shape (SIDE,)."""
    shares = 1 + np.arange(1 << CELL_BITS) / (1 << CELL_BITS)
    return np.outer(0.5 ** np.arange(OCTAVES + 1, 1, -1), shares).ravel()


def _both_sides(distribution: Distribution, v: Array) -> Array:
    """Quantiles at `v` (SIDE, k) and at 1 - v, one below the other."""
    return np.concatenate([distribution.quantile(v), distribution.quantile(1 - v)])
