"""The teeth's mesh: flanks of every tooth found from a dense record, and the table over the beat, also in C."""

import ctypes
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from hdopt.compensation.mesh import Beat, beat_of, fit_mesh, formed_mesh, largest, shows_mesh
from hdopt.compensation.surface import Harmonics, nothing
from hdopt.compensation.teeth import CELLS, Teeth
from hdopt.compensation.writers import written
from hdopt.drive.errors import DriveErrors
from hdopt.kinematics.cartesian import CartesianModel, to_cartesian
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather
from hdopt.study import load_study

RATIO, TURN, NOISE, PER_TURN = 80.0, 2 * np.pi, 0.01, 400
ROUND = np.arange(CELLS) * (TURN / CELLS)


@pytest.fixture(scope="module")
def truth():
    """Flanks that rise by 1 um within each pitch of the circular spline, 20 % more or less from tooth to tooth."""
    model = CartesianModel.of(load_study(drive="csf-25-80").drive)
    errors = to_cartesian(
        DriveErrors(axis_eccentricity=0.006, wg_eccentricity=0.003, wg_eccentricity_direction=1.0,
        cs_tooth_amplitude=0.002, fs_tooth_amplitude=0.001), model.half_width)  # fmt: skip
    place = 162 * ROUND / TURN
    tooth = 1 + 0.2 * np.random.default_rng(4).normal(size=162)
    form = 1e-3 * tooth[place.astype(int)] * np.sin(np.pi * place) ** 2
    return Teeth(model, errors, 1.0, form, np.zeros(CELLS))


def record(truth, turns, seed, per_turn=PER_TURN):
    theta = np.arange(round(turns * per_turn)) * TURN / per_turn
    error = truth.at(theta) + np.random.default_rng(seed).normal(0, NOISE, len(theta))
    frame = {"input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(theta) / RATIO - error / 60}
    return gather([recording_from_table(pd.DataFrame(frame), RATIO)])


def test_flanks_are_found_from_a_drive_whose_errors_are_far_off(truth):
    """From eccentricities four times too large, the circular spline's sine set against them (as a fit of the errors
    alone may end), the zones' places are off by more than a tooth. 2600 numbers of 16 000 rows add 8 % of the noise."""
    rows = record(truth, 41, 1)
    off = truth.errors * np.array([4.0, 4.0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1])
    bare = Teeth.bare(truth.model, off, 1.0)
    found = fit_mesh(rows, np.ones((len(rows), 1)), bare)
    fresh = record(truth, 41, 2)
    plain = replace(truth, cs=np.zeros(1), fs=np.zeros(1))
    assert np.std(fresh.error - plain.at(fresh.theta)) > 3 * NOISE
    assert np.std(fresh.error - found.at(fresh.theta)) < 1.3 * NOISE


def test_a_record_shows_the_mesh_only_with_two_samples_a_tooth(truth):
    assert shows_mesh(record(truth, 2, 1))
    assert not shows_mesh(record(truth, 2, 1, per_turn=320))


def test_the_table_over_the_beat_is_the_error_on_its_way(truth):
    """On its points exact in every input turn, before the first and after the last too. Between them, an eighth of a
    pitch apart, a kink where one flank's rise, up to pi forms a pitch, hands over to the other's fall is cut by up to
    2 pi/8/4 of the form; the sine's own 4 % come to it."""
    table = beat_of(truth, nothing(0.1), RATIO)
    rows, turns = table.values.shape
    assert (rows, turns) == (8 * 162, 80)
    theta = np.arange(-3 * rows, 83 * rows, 7) * (TURN / rows)
    mean = np.mean(truth.at(np.arange(rows * turns) * (TURN / rows)))
    assert table.at(theta, theta / RATIO, 1.0) - 0.1 == pytest.approx(truth.at(theta) - mean, abs=1e-9)
    theta = theta + 0.5 * TURN / rows
    form = 1e-3 * truth.model.arcmin_per_mm
    assert np.abs(table.at(theta, theta / RATIO) - truth.at(theta) + mean).max() < 0.24 * form


def test_an_output_angle_off_by_less_than_half_an_input_turn_finds_the_same_turn(truth):
    table = beat_of(truth, nothing(), RATIO)
    theta = np.random.default_rng(1).uniform(0, 80 * TURN, 500)
    for off in (-0.45, 0.45):
        assert table.at(theta, (theta + off * TURN) / RATIO) == pytest.approx(table.at(theta, theta / RATIO), abs=1e-12)


def test_the_largest_harmonics_of_a_beat_are_those_that_are_there():
    terms = Harmonics(np.array([162, 161, 2]), np.array([0, -3, 2]), np.array([0.3, 0.2, 0.0]), np.array([0, 0.1, 0.1]))
    theta = np.arange(80 * 400) * (TURN / 400)
    found = largest(terms.at(theta, theta / RATIO), RATIO, 3)
    assert sorted(zip(found.k.tolist(), found.j.tolist(), strict=True)) == [(2, 2), (161, -3), (162, 0)]
    assert found.at(theta, theta / RATIO) == pytest.approx(terms.at(theta, theta / RATIO), abs=1e-9)


def test_coefficients_hold_the_mesh_as_far_as_they_go(truth):
    found, off = formed_mesh(truth, nothing(), 64, 0.1, RATIO)
    theta = np.arange(80 * 410) * (TURN / 410)
    left = truth.at(theta) - found.at(theta, theta / RATIO)
    assert len(found) <= 64
    assert np.ptp(left) == pytest.approx(off, rel=0.1)
    plain = replace(truth, cs=np.zeros(1), fs=np.zeros(1))
    assert np.std(left) < 0.6 * np.std(truth.at(theta) - plain.at(theta))
    assert isinstance(formed_mesh(truth, nothing(), None, 0.1, RATIO)[0], Beat)


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_the_controllers_table_is_ours(tmp_path):
    """Every turn, both signs of the angles and the seam of the beat, to 1e-6 arcmin."""
    table = Beat(np.random.default_rng(1).normal(0, 0.1, (30, 5)), 0.02)
    (tmp_path / "c.c").write_text(written(table, "c", {}))
    subprocess.run(["cc", "-shared", "-fPIC", "-Wall", "-Werror", "-o", "c.so", "c.c", "-lm"], cwd=tmp_path, check=True)
    error = ctypes.CDLL(str(tmp_path / "c.so")).hdopt_error_arcmin
    error.restype, error.argtypes = ctypes.c_double, [ctypes.c_double] * 3
    theta = np.r_[np.random.default_rng(2).uniform(-60, 60, 500), np.arange(-20, 20) * TURN]
    ours = table.at(theta, theta / 5, 1.0)
    assert [error(one, one / 5, 1.0) for one in theta.tolist()] == pytest.approx(ours.tolist(), abs=1e-6)
    for form in ("csv", "json"):
        assert "input turn" in written(table, form, {})
