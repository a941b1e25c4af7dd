"""What the bounds of a beat's cells say, against every zone, rim and phase between the angles of the grid."""

from dataclasses import replace

import numpy as np
import pytest
from cases import CSF_25_80, drive, random_errors
from numba import njit

from hdopt.drive.errors import DriveErrors
from hdopt.drive.geometry import Structure
from hdopt.drive.profiles import Ellipse
from hdopt.drive.teeth import MeasuredTeeth
from hdopt.kinematics.beat_bounds import (
    CEILING,
    CIRCULAR,
    CLEAR,
    FLOOR,
    fill_cells,
    fill_circular,
    fill_nodes,
    largest_of_branches,
)
from hdopt.kinematics.beat_grid import new_work, walk_of
from hdopt.kinematics.beat_tables import BEFORE, WRAPPED, differences, fill_comb, new_teeth, wrap
from hdopt.kinematics.closed_form import branches
from hdopt.kinematics.load_sharing import mesh_tables
from hdopt.kinematics.teeth_kernel import _sample, beat_constants, whole_tables

WITHIN = 16
"""Places looked at within a cell; an infimum over some of its places is never below that over all."""


@njit(error_model="numpy")
def bounds_of(constants, cs, fs, rows):
    """Floor, ceiling and distance from a change of rims in every cell of each drive, (n, 3, m)."""
    m, phases = constants.angles.shape[1] - WRAPPED, constants.phases
    stride_cs, stride_fs = (cs.shape[1] + m - 1) // m, (fs.shape[1] + m - 1) // m
    sampled, work, wrapped = np.empty((3, 2, 2, m + WRAPPED)), new_work(m, phases), np.empty(cs.shape[1] + WRAPPED)
    wrap(cs[0], wrapped)
    on_grid = np.empty((CIRCULAR, 2, m + WRAPPED), np.float32)
    circular = fill_circular(wrapped, differences(cs[0], stride_cs), on_grid)
    comb = fill_comb(fs[0], phases, stride_fs, new_teeth(fs.shape[1], phases))
    found = np.empty((len(rows), 3, m))
    for i in range(len(rows)):
        _sample(constants, rows[i], sampled)
        walk = walk_of(sampled, circular, constants.tan_alpha, constants.advance, comb, work)
        fill_nodes(sampled, constants.tan_alpha, circular, work.nodes)
        fill_cells(circular, comb, walk.slack, work.nodes, work.cells, work.places)
        for j in range(m):
            at = j + BEFORE
            found[i, 0, j], found[i, 1, j] = work.cells[FLOOR, at], work.cells[CEILING, at]
            found[i, 2, j] = work.cells[CLEAR, at]
    return found


@njit
def floor_of(table, phases, differing):
    """What the floor of a comb says for `differing` zones, by lines between its places, which lie above it; and by how
    much cubics may pass it."""
    comb = fill_comb(table, phases, 1, new_teeth(len(table), phases))
    last = len(comb.floor) - 1
    return np.interp(differing, np.linspace(0.0, comb.reach, last + 1), comb.floor), comb.ripple, comb.reach / last


def cubic(table, places):
    """A periodic `table` at `places` by Lagrange's cubic through four neighbours."""
    whole = np.floor(places).astype(int)
    x = places - whole
    a, b, c, d = (table[(whole + k) % len(table)] for k in (-1, 0, 1, 2))
    low = -x * (x - 1) * (x - 2) / 6 * a + (x + 1) * (x - 1) * (x - 2) / 2 * b
    return low - (x + 1) * x * (x - 2) / 2 * c + (x + 1) * x * (x - 1) / 6 * d


def between(design, row, m):
    """Least driving deviation and largest of a zone at `WITHIN` places of each of `m` cells, over all phases, (m,)."""
    gear = design.geometry
    cs, fs = (table[0] for table in whole_tables(design, mesh_tables(design)))
    theta = (np.arange(m)[:, None] + np.linspace(0, 1, WITHIN)).ravel() * (2 * np.pi / m)
    points = branches(design, DriveErrors.from_matrix(row), theta)
    phases = np.arange(gear.beat_phases)[:, None] / gear.beat_phases * len(fs)
    zones = []
    for zone, side in enumerate((1.0, -1.0)):
        deep = np.where(points.depth[zone, 0] >= points.depth[zone, 1], 0, 1), np.arange(len(theta))
        on_cs = theta + side * points.offset_cs[zone][deep] + np.pi * zone
        on_fs = gear.flexspline_advance * theta + side * points.offset_fs[zone][deep] + np.pi * zone
        beside = np.tan(gear.pressure_angle) * points.depth[zone][deep] + cubic(cs, on_cs / (2 * np.pi) * len(cs))
        zones.append(beside + cubic(fs, on_fs / (2 * np.pi) * len(fs) + phases))
    driving = np.maximum(*zones)
    return driving.min(axis=0).reshape(m, WITHIN).min(axis=1), driving.max(axis=0).reshape(m, WITHIN).max(axis=1)


def with_teeth(design, cs, fs):
    """`design` whose teeth deviate by what `cs` and `fs` make of an angle on their spline, mm."""
    turns = (
        2 * np.pi * np.arange(z) / z for z in (design.geometry.circular_spline_teeth, design.geometry.flexspline_teeth)
    )
    of_cs, of_fs = (
        MeasuredTeeth.of(of(turn) + 0 * turn, "cumulative") for of, turn in zip((cs, fs), turns, strict=True)
    )
    return replace(design, cs_teeth=of_cs, fs_teeth=of_fs)


def nothing(turn):
    return 0.0


def runout(turn):
    return 0.05 * np.sin(turn + 1) + 0.01 * np.sin(3 * turn)


def waves(turn):
    return 0.02 * np.sin(13 * turn + 1)


def damaged(turn):
    return 0.05 * (np.arange(len(turn)) == 7)


def random(turn):
    return np.random.default_rng(len(turn)).normal(0, 0.02, len(turn))


def found_in(design, matrix):
    """Floors and ceilings of each drive's cells, (n, m), and what is between."""
    constants = beat_constants(design)
    found = bounds_of(constants, *whole_tables(design, mesh_tables(design)), matrix)
    true = np.array([between(design, row, found.shape[2]) for row in matrix])
    return found, true


def of_size(teeth):
    radius = CSF_25_80.flexspline_inner_radius * teeth / 160
    gear = replace(CSF_25_80, flexspline_teeth=teeth, circular_spline_teeth=teeth + 2, flexspline_inner_radius=radius)
    return drive(Ellipse.of_equal_perimeter(radius, radius + gear.module), geometry=gear)


TEETH = [nothing, runout, waves, damaged, random]
DRIVES = {structure.value: drive(structure=structure) for structure in Structure} | {
    "98": of_size(98),
    "320": of_size(320),
}


@pytest.mark.parametrize("design", DRIVES.values(), ids=DRIVES)
def test_nothing_between_the_angles_passes_the_bounds(design):
    """With each kind of teeth on either spline, without errors, at the shipped tolerances and at three times them. And
    bounds are worth their while: what is not met in a cell leaves less than a fifth of them to follow."""
    for i, (cs, fs) in enumerate([(one, two) for one in TEETH for two in TEETH]):
        toothed = with_teeth(design, cs, fs)
        matrix = np.concatenate([random_errors(1, i, scale).to_matrix() for scale in (0.0, 1.0, 3.0)])
        matrix[:, [8, 10]] = 0.0
        found, true = found_in(toothed, matrix)
        assert (found[:, 0] <= true[:, 0]).all()
        assert (found[:, 1] >= true[:, 1]).all()
        if cs is fs is random:
            assert (found[1:, 0] < true[1:, 0].min(axis=1)[:, None]).mean() < 0.2
            assert (found[1:, 1] > true[1:, 1].max(axis=1)[:, None]).mean() < 0.2


def test_bounds_allow_for_single_precision():
    """A wave generator that is off along its major axis alone gives each zone one depth all turn long: nothing but
    rounding stands between it and its bounds. Rounded to the nearest, half of them would lie on the wrong side."""
    matrix = np.zeros((200, 12))
    matrix[:, 4] = np.random.default_rng(1).uniform(0.001, 0.02, 200)
    constants, tables = beat_constants(drive()), (np.zeros((1, 12 * 162)), np.zeros((1, 12 * 160)))
    found = bounds_of(constants, *tables, matrix)
    depth = constants.tan_alpha * matrix[:, 4:5]
    assert (found[:, 0] < depth).all() and (found[:, 1] > depth).all()
    assert found[:, :2] == pytest.approx(np.stack([depth, depth], 1) + np.zeros((1, 1, found.shape[2])), abs=1e-6)


def test_no_rim_changes_in_a_cell_called_clear():
    """Where the wave generator's tilt is a little less than the input axis', the lower rim comes out for a moment
    within a cell: both ends of it say nothing of that."""
    gaps, matrix = np.concatenate([-np.geomspace(1e-8, 1e-3, 40), np.geomspace(1e-8, 1e-3, 40)]), np.zeros((80, 12))
    place = np.random.default_rng(2).uniform(0, 2 * np.pi, 80)
    tilt = 0.003
    matrix[:, 2], matrix[:, 3] = np.arctan(tilt * np.cos(place)), np.arctan(tilt * np.sin(place))
    matrix[:, 6] = np.arctan(tilt * (1 + gaps))
    constants, tables = beat_constants(drive()), (np.zeros((1, 12 * 162)), np.zeros((1, 12 * 160)))
    clear = bounds_of(constants, *tables, matrix)[:, 2] > 0
    m = clear.shape[1]
    assert clear.mean() > 0.9
    theta = (np.arange(m)[:, None] + np.linspace(0, 1, 200)).ravel() * (2 * np.pi / m)
    for row, ok in zip(matrix, clear, strict=True):
        depth = branches(drive(), DriveErrors.from_matrix(row), theta).depth
        first = (depth[:, 0] > depth[:, 1]).reshape(2, m, 200)
        alike = (first == first[:, :, :1]).all(axis=(0, 2))
        assert alike[ok].all()


@njit
def bends_of(constants, rows):
    """What a drive's motion says of its branches and what these show: depth, size and turn, (n, 2, 3)."""
    m = constants.angles.shape[1] - WRAPPED
    sampled, room, found = np.empty((3, 2, 2, m + WRAPPED)), np.empty((3, m + WRAPPED), np.float32), []
    for row in rows:
        found.append((_sample(constants, row, sampled), largest_of_branches(sampled, room[0], room[1], room[2])))
    return found


@pytest.mark.parametrize("structure", Structure)
def test_branches_bend_no_further_than_their_motion_says(structure):
    """Each error alone, in every pair, and all of them, far beyond what is shipped; and not by much less: a bound three
    times too wide would leave more cells to follow."""
    pairs = np.random.default_rng(6).uniform(0.2, 1.0, (64, 12)) * np.array([0.1, 6, 0.02, 0.02] * 3)
    for i, (one, other) in enumerate((one, other) for one in range(8) for other in range(8)):
        pairs[i, [k for k in (0, 2, 3, 4, 6, 7) if k not in (one, other)]] = 0.0
    matrix = np.concatenate([pairs, *(random_errors(100, 7, scale).to_matrix() for scale in (1.0, 3.0, 10.0))])
    said, seen = np.moveaxis(np.array(bends_of(beat_constants(drive(structure=structure)), matrix)), 1, 0)
    # Seen is in single precision.
    assert (said >= seen * (1 - 1e-6)).all()
    assert (said[64:164] < 3 * seen[64:164] + 1e-9).mean() > 0.9


@pytest.mark.parametrize("sigma", [0.0, 0.004])
def test_the_floor_of_two_zones_is_below_every_place(sigma):
    """Of either difference between them, with cubics between the places of the table."""
    rng = np.random.default_rng(4)
    table = rng.normal(0, sigma, 240)
    differing = np.linspace(0, 1.01 * np.ptp(table) + 1e-12, 300)
    floor, ripple, step = floor_of(table, 10, differing)
    places = np.arange(0, 240, 0.05)
    one, two = cubic(table, places), cubic(table, places + 120)
    for sign in (1, -1):
        half = sign * differing[:, None] / 2
        least = np.maximum(one + half, two - half).min(axis=1)
        # Lines between tabulated differences lie above the floor by half a step's rise at most.
        assert (floor - step / 2 - ripple <= least + 1e-15).all()
        assert sigma == 0.0 or (floor > least - 3 * sigma).all()
