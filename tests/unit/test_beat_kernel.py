"""Drives with effects that differ from turn to turn, in lanes: against the kernel that takes every turn for itself."""

from dataclasses import replace

import numba
import numpy as np
import pytest
from cases import PROFILES, drive, random_errors
from effect_examples import EXAMPLES, NAMES

from hdopt.drive.geometry import Structure
from hdopt.effects import EFFECTS
from hdopt.kinematics.compiled_closed_form import OPTIONS
from hdopt.kinematics.kernel import design_of
from hdopt.kinematics.lanes.minima import GROUP
from hdopt.kinematics.lanes.motion import FS, FS_PHASE, LANES
from hdopt.kinematics.peak_to_peak import matrix_peak_to_peak_arcmin as base_alone
from hdopt.simulation import EffectValues, Operation, batch
from hdopt.simulation.batch import matrix_peak_to_peak_arcmin, stacked_peak_to_peak_arcmin, tabulate
from hdopt.simulation.beat.effects import KINDS, beat_of
from hdopt.simulation.beat.gather import _most_on_fs
from hdopt.simulation.beat.kernel import beat_block
from hdopt.simulation.beat.turns import End, _lower_on_fs, _raise_on_fs
from hdopt.simulation.turn.rows import BOUNDS
from hdopt.study import load_study

DRIVE = load_study(drive="csf-25-80").drive
GEAR = DRIVE.geometry
FORWARD = Operation(torque=20.0, speed=3.0, temperature_difference=5.0, time=0.0)
DRIVES = 64
FINER = 4
"""How many times finer the reference's table is than a stack's: between places are straight lines, which dim a sine,
and an extreme at the end of the last turn is half a place short."""
LABELS = [
    f"{name}-{i}"
    for i, (name, keys) in enumerate(EXAMPLES)
    if name in {"fs_tooth_harmonics", "encoder_output_eccentricity", "bearing_pass"}
    or (name in {"encoder_interpolation", "output_coupling"} and keys["shaft"] == "output")
    or (name == "local_tooth_defect" and keys["on"] in {"flexspline", "output"})
    or (name == "thermal_drift" and "time_constant_s" in keys)
]
"""Every example that differs from turn to turn."""


def first_of(name):
    """The label of the first example of an effect: their numbers move with every example that is added."""
    return next(label for label in NAMES if label.rsplit("-", 1)[0] == name)


CAGE, ON_FS = first_of("bearing_pass"), first_of("fs_tooth_harmonics")


def effect(label, of=DRIVE):
    name, keys = EXAMPLES[NAMES.index(label)]
    return [EffectValues(name, *EFFECTS[name].values(keys, of.geometry))]


def off_by(monkeypatch, of, effects, scales=(1.0, 3.0)):
    """How far DRIVES drives at as many times the shipped tolerances as each of the `scales` are from the reference,
    arcmin."""
    rows = np.concatenate([random_errors(DRIVES, seed=1, scale=k).to_matrix() for k in scales])
    table = tabulate(of, effects, FORWARD)
    assert table.in_lanes(of.geometry.arcmin_per_mm, of.geometry.beat_phases, of.geometry.flexspline_advance)[1]
    with monkeypatch.context() as patch:
        for places in ("TABLE_PER_TURN", "TABLE_PER_PERIOD"):
            patch.setattr(batch, places, FINER * getattr(batch, places))
        expected = matrix_peak_to_peak_arcmin(of, rows, tabulate(of, effects, FORWARD))
    return np.abs(stacked_peak_to_peak_arcmin(of, rows, table) - expected)


@pytest.mark.parametrize("label", LABELS)
def test_lanes_find_what_every_turn_for_itself_has(label, monkeypatch):
    """As asked of effects that repeat every turn."""
    off = off_by(monkeypatch, DRIVE, effect(label))
    assert np.quantile(off, 0.99) < 1e-3
    assert off.max() < 5e-3


OTHERS = [structure for structure in Structure if structure is not Structure.INTEGRAL]
SMOOTH = [name for name, profile in PROFILES.items() if profile.tip_is_smooth]


@pytest.mark.parametrize("label", [CAGE, ON_FS])
@pytest.mark.parametrize(
    ("profile", "structure"), [*((name, Structure.INTEGRAL) for name in SMOOTH), *(("ellipse", s) for s in OTHERS)]
)
def test_any_structure_and_smooth_profile(label, profile, structure, monkeypatch):
    of = drive(PROFILES[profile], structure)
    off = off_by(monkeypatch, of, effect(label, of))
    assert np.quantile(off, 0.99) < 1e-3
    # Held along the minor axis, rims of both zones change almost together: a stretch too short to see may be believed.
    assert off.max() < (1e-2 if structure is Structure.ONE_WAY_MINOR else 5e-3)


DEFECT = first_of("local_tooth_defect")
LINES = next(name for name, (_, keys) in zip(NAMES, EXAMPLES, strict=True) if keys.get("lines") == 4001)
"""What is finer than a cell: the pulse of a tooth of the FS, and waves beside the zones."""


@pytest.mark.parametrize("sign", [1, -1], ids=["rises", "sinks"])
@pytest.mark.parametrize("label", [DEFECT, LINES, ON_FS])
@pytest.mark.parametrize(
    ("profile", "structure"), list(zip(["ellipse", "resal", "two_disk", "ellipse"], Structure, strict=True))
)
def test_what_is_finer_than_a_cell_is_found_part_by_part(label, sign, profile, structure, monkeypatch):
    """Of either sign, as waves of the FS are from edge to edge, and in drives without any errors."""
    of = drive(PROFILES[profile], structure)
    (one,) = effect(label, of)
    other = [replace(one, coefficients=tuple(sign * c for c in one.coefficients))]
    off = off_by(monkeypatch, of, other, scales=(0.0, 1.0, 3.0))
    # As above, of rims that change almost together: 2 % of drives, up to 0.02 arcmin.
    held = structure is Structure.ONE_WAY_MINOR
    assert np.quantile(off, 0.96 if held else 0.99) < 1e-3
    assert off.max() < (2.5e-2 if held else 5e-3)


@pytest.mark.parametrize(("lines", "fewest"), [(4001, 3204), (4096, 1640)])
def test_parts_are_as_fine_as_there_is_room_for(lines, fewest):
    """4001 lines have a part for each of the table's places; of 4096 these were more than bounds are kept of, which are
    half as many, and not none: turn by turn such a drive takes 13 times as long."""
    (one,) = effect(LINES)
    table = tabulate(DRIVE, [replace(one, shape={**one.shape, "lines": lines})], FORWARD)
    (beat,) = table.in_lanes(GEAR.arcmin_per_mm, GEAR.beat_phases, GEAR.flexspline_advance)[1]
    cells = len(beat.turn.scan.below)
    assert cells <= 120 and cells * beat.parts.each == fewest
    rows = random_errors(DRIVES, seed=4).to_matrix()
    off = np.abs(stacked_peak_to_peak_arcmin(DRIVE, rows, table) - matrix_peak_to_peak_arcmin(DRIVE, rows, table))
    # The reference has straight lines between 32 places of a wave, which dim it by half a percent.
    assert off.max() < 2e-3


@numba.njit(**OPTIONS)
def joint_most(work, beat, room, out):
    """Fill `out` (LANES,) with the greatest that is granted to FS teeth and effects on the FS together, mm of arc."""
    for i in range(LANES):
        out[i] = work[FS + i] + beat.on_fs.highest - _most_on_fs(work, i, beat, room)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("label", [DEFECT, ON_FS])
def test_fs_teeth_and_effects_on_the_fs_are_granted_what_they_reach_together(label, sign):
    """Neither less than at any of 20,000 places in either zone, nor more by what a stretch of either leaves open, which
    the answers that others compare would hide."""
    (one,) = effect(label)
    table = tabulate(DRIVE, [replace(one, coefficients=tuple(sign * c for c in one.coefficients))], FORWARD)
    (beat,) = table.in_lanes(GEAR.arcmin_per_mm, GEAR.beat_phases, GEAR.flexspline_advance)[1]
    work, granted = np.zeros(BOUNDS, np.float32), np.zeros(LANES)
    rng, places = np.random.default_rng(0), 20_000
    amplitude, phase = 4e-3 * rng.random(LANES), 2 * np.pi * rng.random(LANES)
    work[FS : FS + LANES], work[FS_PHASE : FS_PHASE + LANES] = amplitude, phase
    joint_most(work, beat, np.zeros(GROUP, np.float32), granted)
    angle = 2 * np.pi * np.arange(places) / places
    grid = 2 * np.pi * np.arange(table.fs.shape[1] + 1) / table.fs.shape[1]
    one, two = (np.interp(angle, grid, np.append(zone, zone[0])) for zone in table.fs)
    sine = amplitude[:, None] * np.sin(angle + phase[:, None])
    reached = np.maximum(one + sine, two - sine).max(axis=1)
    # A stretch of 1/128 of a turn counts as all at its greatest: half of it away the sum falls by its own slopes.
    slope = amplitude + np.abs(np.gradient(table.fs, grid[1], axis=1)).max()
    assert (granted >= reached - 1e-8).all()
    assert (granted <= reached + np.pi / 128 * slope + 1e-8).all()


@numba.njit(**OPTIONS)
def on_fs_alone(met, low, high):
    """Lower `low` (turns,) to the least of a piece on which nothing stands but what is `met` on the FS, the mean and
    half the difference of both zones at its start, then at its end, and `high` to the negative of the greatest."""
    nothing, none = np.zeros((2 + 2 * KINDS) * len(low), np.float32), np.float32(0)
    left = End(none, none, none, none, none, none, none, none, none)
    right = End(none, none, none, none, none, none, none, none, np.float32(1))
    _lower_on_fs(nothing, 2 * len(low), met, 2, left, right, none, low)
    _raise_on_fs(nothing, 2 * len(low), met, 2, left, right, none, high)


def test_a_piece_goes_from_what_is_met_on_the_fs_at_its_start_to_that_at_its_end():
    """The larger of the two zones along straight lines, at a thousand places of the piece, for each turn. Fault caught:
    the start's for the end's, in the mean or in the difference: an extreme that the bounds exclude is rarely missed."""
    turns, share = 16, np.linspace(0, 1, 1001)[:, None]
    met = np.random.default_rng(7).normal(0, 1e-3, (4, turns))
    low, high = np.full((2, turns), 1.0, np.float32)
    on_fs_alone(met.ravel().astype(np.float32), low, high)
    mean, half = (met[row] + share * (met[row + 2] - met[row]) for row in (0, 1))
    larger = mean + np.abs(half)
    np.testing.assert_allclose(low, larger.min(axis=0), atol=5e-6)  # half a step of the places, by the lines' slope
    np.testing.assert_allclose(-high, larger.max(axis=0), atol=1e-9)


@pytest.mark.parametrize("on_fs", [False, True])
def test_effects_of_nothing_leave_the_base(on_fs):
    """Every turn looked at for itself, as the base's kernel over all FS phases at once: to what single precision and
    parabolas of either leave."""
    gear, rows = DRIVE.geometry, random_errors(DRIVES, seed=2).to_matrix()
    turns, per_mm = gear.beat_phases, gear.arcmin_per_mm
    fs = np.zeros((2, 1440 if on_fs else 0))
    beat = beat_of(np.zeros((2, 1440 * turns)), np.zeros((2, 0)), fs, turns, gear.flexspline_advance, per_mm)
    out = np.full((DRIVES, 2), np.inf)
    beat_block(design_of(DRIVE), rows, beat, out)
    assert -per_mm * out.sum(axis=1) == pytest.approx(base_alone(DRIVE, rows), abs=2e-3)


def test_a_drive_counts_for_itself_alone():
    """To the bit, whatever stands beside it in its block and list."""
    rows, table = random_errors(200, seed=2, scale=3.0).to_matrix(), tabulate(DRIVE, effect(CAGE), FORWARD)
    found, order = stacked_peak_to_peak_arcmin(DRIVE, rows, table), np.random.default_rng(0).permutation(200)
    assert (stacked_peak_to_peak_arcmin(DRIVE, rows[order], table) == found[order]).all()
    assert (stacked_peak_to_peak_arcmin(DRIVE, rows[7:8], table) == found[7:8]).all()


def test_with_what_stands_on_the_cs_and_repeats():
    """Lobes of the CS beside the cage: both are met."""
    lobes = EffectValues("circular_spline_lobing", {"lobes": 6}, (0.001, 0.0005))
    rows, table = random_errors(DRIVES, seed=6, scale=3.0).to_matrix(), tabulate(DRIVE, [*effect(CAGE), lobes], FORWARD)
    off = stacked_peak_to_peak_arcmin(DRIVE, rows, table, 0.8) - matrix_peak_to_peak_arcmin(DRIVE, rows, table, 0.8)
    assert np.abs(off).max() < 1e-3


def test_both_directions_share_one_range():
    """A shift between the ways of 0.3 arcmin adds just that."""
    rows = random_errors(16, seed=3).to_matrix()
    one_way = tabulate(DRIVE, effect(first_of("encoder_output_eccentricity")), Operation(motion="forward"))
    both = replace(one_way, zones=np.repeat(one_way.zones, 2, axis=0), beside=np.repeat(one_way.beside, 2, axis=0))
    shifted = replace(both, beside=both.beside + np.array([[0.0], [0.3]]))
    alone, together = (stacked_peak_to_peak_arcmin(DRIVE, rows, table) for table in (one_way, shifted))
    assert together - alone == pytest.approx(np.full(16, 0.3), abs=1e-5)
