"""Drives with effects that repeat every input turn, in lanes: against the kernel that takes every turn for itself."""

from dataclasses import replace

import numba
import numpy as np
import pytest
from cases import PROFILES, drive, random_errors
from effect_examples import EXAMPLES, NAMES

from hdopt.drive.geometry import Structure
from hdopt.effects import EFFECTS
from hdopt.kinematics.compiled_closed_form import OPTIONS
from hdopt.kinematics.kernel import describe, design_of
from hdopt.kinematics.lanes.motion import FS, LANES
from hdopt.simulation import EffectValues, Operation, batch
from hdopt.simulation.batch import matrix_peak_to_peak_arcmin, stacked_peak_to_peak_arcmin, tabulate
from hdopt.simulation.turn import kernel, ripple, rows
from hdopt.simulation.turn.effects import turn_of
from hdopt.simulation.turn.scan import fill_parts
from hdopt.study import load_study

DRIVE = load_study(drive="csf-25-80").drive
GEAR = DRIVE.geometry
FORWARD = Operation(torque=20.0, speed=3.0, temperature_difference=5.0, time=0.0)
DRIVES = 128
PER_PERIOD = 128
"""Places of the reference's table in a period: between them straight lines dim a sine by (pi/128)^2/2 = 3e-4, of 0.3
arcmin at most here. The 32 of a stack would dim it by 5e-3, which is more than is to be shown."""


def values_of(name, keys):
    return EffectValues(name, *EFFECTS[name].values(keys, GEAR))


def repeats(table):
    """Whether every turn of a table is as the first, and nothing stands on the FS, which turns on by a tooth or two."""
    turns = np.stack([table.zones[:, 0], table.zones[:, 1], table.beside]).reshape(3, GEAR.beat_phases, -1)
    return not table.fs.size and np.ptp(turns, axis=1).max() < 1e-9


def tables():
    """Label and effects of every example that a stack can count and that repeats every turn, and of none."""
    yield pytest.param([], id="none")
    for label, (name, keys) in zip(NAMES, EXAMPLES, strict=True):
        if name == "resonance" or keys.get("lines") == 4001:
            continue
        effects = [values_of(name, keys)]
        if repeats(tabulate(DRIVE, effects, FORWARD)):
            yield pytest.param(effects, id=label)


@pytest.fixture
def finely(monkeypatch):
    """A table as a stack makes it, but with finer places."""

    def table(effects):
        with monkeypatch.context() as patch:
            patch.setattr(batch, "TABLE_PER_PERIOD", PER_PERIOD)
            return tabulate(DRIVE, effects, FORWARD)

    return table


@pytest.mark.parametrize("effects", list(tables()))
def test_lanes_find_what_every_turn_for_itself_has(effects, finely):
    """99 % of drives within 1e-3 arcmin and all within 5e-3, at the shipped tolerances and at three times them: what is
    asked of the base's kernel, whose parabolas these are."""
    rows = np.concatenate([random_errors(DRIVES, seed=1, scale=k).to_matrix() for k in (1.0, 3.0)])
    expected = matrix_peak_to_peak_arcmin(DRIVE, rows, finely(effects))
    off = np.abs(stacked_peak_to_peak_arcmin(DRIVE, rows, tabulate(DRIVE, effects, FORWARD)) - expected)
    assert np.quantile(off, 0.99) < 1e-3
    assert off.max() < 5e-3


LOBES = EffectValues("circular_spline_lobing", {"lobes": 6}, (0.001, 0.0005))


IN_ZONES = next(keys for name, keys in EXAMPLES if name == "tooth_mesh" and "zone_1_amplitude_um" in keys)


@pytest.mark.parametrize("effect", [LOBES, values_of("tooth_mesh", IN_ZONES)], ids=["lobes", "ripple"])
def test_a_drive_counts_for_itself_alone(effect):
    """To the bit, whatever stands beside it in its block and list, also part by part of a cell."""
    rows, table = random_errors(300, seed=2, scale=3.0).to_matrix(), tabulate(DRIVE, [effect], Operation())
    found, order = stacked_peak_to_peak_arcmin(DRIVE, rows, table), np.random.default_rng(0).permutation(300)
    assert (stacked_peak_to_peak_arcmin(DRIVE, rows[order], table) == found[order]).all()
    assert (stacked_peak_to_peak_arcmin(DRIVE, rows[7:8], table) == found[7:8]).all()


def test_parts_are_looked_at_whenever_there_is_no_more_room(monkeypatch):
    """To the bit what room for the parts of many cells gives. Faults caught: a cell left out, or listed twice as if it
    were the first, where the list was full before it."""
    table = tabulate(DRIVE, [values_of("tooth_mesh", IN_ZONES)], FORWARD)
    rows = random_errors(400, seed=4, scale=3.0).to_matrix()
    found = []
    for cells in (1, 2, 50):
        monkeypatch.setattr(kernel, "ROOMS", cells)
        found.append(stacked_peak_to_peak_arcmin(DRIVE, rows, table))
    assert found[0].tolist() == found[1].tolist() == found[2].tolist()


def test_both_directions_share_one_range():
    """A lobing both ways is that of one; a shift between the ways of 0.3 arcmin adds just that."""
    rows = random_errors(16, seed=3).to_matrix()
    one_way, both = (tabulate(DRIVE, [LOBES], Operation(motion=motion)) for motion in ("forward", "both"))
    assert (stacked_peak_to_peak_arcmin(DRIVE, rows, both) == stacked_peak_to_peak_arcmin(DRIVE, rows, one_way)).all()
    shifted = replace(both, beside=both.beside + np.array([[0.0], [0.3]]))
    added = stacked_peak_to_peak_arcmin(DRIVE, rows, shifted) - stacked_peak_to_peak_arcmin(DRIVE, rows, both)
    assert added == pytest.approx(np.full(16, 0.3), abs=1e-5)


@pytest.mark.parametrize(
    ("profile", "structure"),
    [
        *((name, Structure.INTEGRAL) for name, profile in PROFILES.items() if profile.tip_is_smooth),
        *(("ellipse", structure) for structure in Structure if structure is not Structure.INTEGRAL),
    ],
)
def test_any_structure_and_smooth_profile(profile, structure):
    of, keys = drive(PROFILES[profile], structure), {"amplitude_arcmin": 0.1, "phase_deg": 15.0}
    eccentric = EffectValues("encoder_input_eccentricity", *EFFECTS["encoder_input_eccentricity"].values(keys, GEAR))
    rows = np.concatenate([random_errors(DRIVES, seed=7, scale=k).to_matrix() for k in (1.0, 3.0)])
    table = tabulate(of, [LOBES, eccentric], FORWARD)
    off = np.abs(stacked_peak_to_peak_arcmin(of, rows, table) - matrix_peak_to_peak_arcmin(of, rows, table))
    assert np.quantile(off, 0.99) < 1e-3
    # Held along the minor axis, turns are taken one by one, and still a stretch too short to see may be believed.
    assert off.max() < (1e-2 if structure is Structure.ONE_WAY_MINOR else 5e-3)


def test_what_ripples_is_bounded_by_its_envelope():
    """No wave of the mesh, twice as many as parts would need, may leave what the scan grants a cell: seen at places
    that are no cell's edge."""
    table = tabulate(DRIVE, [values_of("tooth_mesh", IN_ZONES)], FORWARD)
    (turn,), _ = table.in_lanes(GEAR.arcmin_per_mm, GEAR.beat_phases, GEAR.flexspline_advance)
    cells = len(turn.scan.below)
    assert len(turn.fine.below) == turn.fine.parts * cells > 8 * cells
    least, greatest = table.cs.min(), table.cs.max()
    # What is slow is nothing here, so that the envelope is all: half as much again would look at cells for nothing.
    assert (turn.scan.below >= -least).all() and (turn.scan.below < -1.1 * least).all()
    assert (turn.scan.above >= greatest).all() and (turn.scan.above < 1.1 * greatest).all()


@numba.njit(**OPTIONS)
def bounds_of_parts(errors, work, near, design, turn, low):
    """Fill `low` (parts of a turn, LANES) with what no drive falls below in any part, mm of arc."""
    describe(errors, work)
    fill_parts(work, design, turn)
    ripple._describe(work, near, LANES, turn.fine.width)
    for e in range(len(turn.fine.below) + 1):
        ripple._bound_low(work, LANES, design, turn, e)
        if e:
            low[e - 1] = work[rows.NEAR + rows.LOW : rows.NEAR + rows.LOW + LANES]


@pytest.mark.parametrize("scale", [0.0, 1.0, 3.0])
@pytest.mark.parametrize(("order", "shift"), [(160, 0.0), (160, 2.0), (100, np.pi)])
def test_no_part_of_a_cell_falls_below_its_bound(scale, order, shift):
    """To first order, in every part of every drive: not by what waves of the zones go below their chords either. The
    margin, of second order, hides that from the answers that others compare."""
    places, per_part, amplitude = 32 * order, 9, 1e-3
    angle = 2 * np.pi * np.arange(places) / places
    waves = amplitude * np.cos(order * angle + np.array([[0.3], [0.3 + shift]]))
    turn = turn_of(waves, np.zeros((2, 0)), 1, GEAR.arcmin_per_mm)
    parts = len(turn.fine.below)
    work = np.zeros(rows.BOUNDS + 2 * LANES * len(turn.scan.below), np.float32)
    low, errors = np.zeros((parts, LANES)), random_errors(LANES, seed=11, scale=scale).to_matrix().T.ravel()
    bounds_of_parts(errors, work, np.arange(LANES), design_of(DRIVE), turn, low)

    def row(at):
        return work[at : at + LANES].astype(float)

    within = 2 * np.pi / parts * (np.arange(parts)[:, None] + np.linspace(0, 1, per_part)).ravel()[:, None]
    cos, sin = np.cos(within), np.sin(within)
    one, two = (amplitude * np.cos(order * within + phase) for phase in (0.3, 0.3 + shift))
    t = row(rows.T_COS) * cos + row(rows.T_SIN) * sin + row(rows.T_0)
    d = row(rows.D_COS) * cos + row(rows.D_SIN) * sin + row(rows.D_0) + (one - two) / 2
    driving = np.abs(t) + (one + two) / 2 + np.maximum(0, np.abs(d) - row(FS))
    least = driving.reshape(parts, per_part, LANES).min(axis=1)
    # The base's own chords leave w^2/8 of what it swings by, single precision a few units in the last of 0.1 mm.
    swing = np.hypot(row(rows.T_COS), row(rows.T_SIN)) + np.hypot(row(rows.D_COS), row(rows.D_SIN))
    assert (low <= least + (2 * np.pi / parts) ** 2 / 8 * swing + 1e-7).all()
    # A bound that holds for nothing would look at all: it keeps within the chords' own depth.
    depth = 2 * float(turn.fine.below.max() + turn.fine.above.max())
    assert np.quantile(least - low, 0.99) < depth + 1e-7


def test_k_e_evens_out_the_zones_and_not_what_is_beside():
    keys = next(keys for n, keys in EXAMPLES if n == "encoder_input_eccentricity")
    table = tabulate(DRIVE, [values_of("encoder_input_eccentricity", keys)], FORWARD)
    rows = random_errors(64, seed=5).to_matrix()
    off = stacked_peak_to_peak_arcmin(DRIVE, rows, table, 0.6) - matrix_peak_to_peak_arcmin(DRIVE, rows, table, 0.6)
    assert np.abs(off).max() < 1e-3
