"""What following a beat's cells is made of: the least of many numbers, and slopes between the angles of the grid."""

import numpy as np
import pytest
from cases import drive, random_errors
from numba import njit

from hdopt.kinematics.beat_bounds import CIRCULAR, fill_circular
from hdopt.kinematics.beat_grid import walk_bent, zone_along, zone_at
from hdopt.kinematics.beat_tables import (
    WRAPPED,
    along_lane,
    differences,
    fill_comb,
    first_least,
    new_teeth,
    one_lane,
    wrap,
)
from hdopt.kinematics.teeth_kernel import _sample, beat_constants

STEP = 1e-5
"""Cells: short enough for slopes of 1e-7 of their size, long enough for rounding."""


@njit
def least(row):
    return first_least(row)


def test_the_first_of_the_least_is_found():
    """Of either sign, at any place, of any number of them, and of several alike the first."""
    rng = np.random.default_rng(0)
    for n in (1, 2, 7, 80, 129):
        for values in (rng.normal(size=(50, n)), -rng.random((50, n)), rng.integers(-2, 3, (50, n)) * 1e-30):
            rows = values.astype(np.float32)
            assert [least(row.view(np.int32)) for row in rows] == rows.argmin(axis=1).tolist()


@njit
def along(constants, cs, fs, row, places):
    """Of either zone and rim at `places`: value and angle, the slopes of both, the FS term at phase 3, and its slope;
    and the first, the second and the fifth a `STEP` on either side, (2, 2, n, 12)."""
    m = constants.angles.shape[1] - WRAPPED
    sampled, wrapped = np.empty((3, 2, 2, m + WRAPPED)), np.empty(len(cs) + WRAPPED)
    wrap(cs, wrapped)
    on_grid = np.empty((CIRCULAR, 2, m + WRAPPED), np.float32)
    circular = fill_circular(wrapped, differences(cs, len(cs) // m), on_grid)
    comb = fill_comb(fs, constants.phases, len(fs) // m, new_teeth(len(fs), constants.phases))
    bends = _sample(constants, row, sampled)
    walk = walk_bent(sampled, bends, circular, constants.tan_alpha, constants.advance, comb)
    found = np.empty((2, 2, len(places), 12))
    for zone in range(2):
        for k in range(2):
            for i in range(len(places)):
                value, angle, slope, turns = zone_along(walk, zone, k, places[i])
                on_fs, rises = along_lane(comb, angle, 3)
                found[zone, k, i, :6] = value, angle, slope, turns, on_fs, rises
                for side in range(2):
                    value, angle = zone_at(walk, zone, k, places[i] + (2 * side - 1) * STEP)
                    found[zone, k, i, 6 + 3 * side : 9 + 3 * side] = value, angle, one_lane(comb, angle, 3)
    return found


def test_slopes_are_those_of_values():
    """Between the angles of the grid and the places of the tables, for two turns of the grid."""
    rng, constants = np.random.default_rng(1), beat_constants(drive())
    cs, fs = rng.normal(0, 0.002, 12 * 162), rng.normal(0, 0.002, 12 * 160)
    places = rng.uniform(0, 2 * (constants.angles.shape[1] - WRAPPED), 200)
    found = along(constants, cs, fs, random_errors(1, 3, 3.0).to_matrix()[0], places)
    before, after = found[..., 6:9], found[..., 9:12]
    assert found[..., [0, 1, 4]] == pytest.approx((before + after) / 2, abs=1e-6)
    slope = (after - before) / (2 * STEP)
    seen = np.stack([found[..., 2], found[..., 3], found[..., 5] * found[..., 3]], axis=-1)
    # A place of a table in between bends the cubic there.
    assert np.quantile(np.abs(seen - slope), 0.98) < 1e-6
    assert np.abs(slope[..., [0, 2]]).max() > 1e-3
