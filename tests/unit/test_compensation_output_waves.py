"""A coupling's or an encoder's wave over the output's turn: set apart before the drive's errors are fitted."""

import numpy as np
import pandas as pd
import pytest

from hdopt.drive.errors import DriveErrors
from hdopt.kinematics.cartesian import CartesianModel, to_cartesian
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather
from hdopt.study import load_study
from hdopt.workflow import compensation_trials as trials
from hdopt.workflow.compensation_trials import model_of

RATIO, TURN, NOISE, PER_TURN = 80.0, 2 * np.pi, 0.01, 24
DRIVE = load_study(drive="csf-25-80").drive
MODEL = CartesianModel.of(DRIVE)
WAVES = [(1, 0.25), (2, 0.4)]


def error_of(rng, theta):
    """A drive's error: eccentricities of 2 to 8 um, tilt, teeth to 2 um, any directions."""
    errors = DriveErrors(
        axis_eccentricity=rng.uniform(0.002, 0.008), axis_eccentricity_direction=rng.uniform(0, TURN),
        wg_eccentricity=rng.uniform(0.002, 0.008), wg_eccentricity_direction=rng.uniform(0, TURN),
        axis_tilt_x=rng.normal(0, 5e-4), axis_tilt_y=rng.normal(0, 5e-4), cs_tooth_amplitude=rng.uniform(0, 0.002),
        fs_tooth_amplitude=rng.uniform(0, 0.002))  # fmt: skip
    return MODEL.evaluate(theta, to_cartesian(errors, MODEL.half_width))[0]


def rows_of(error, theta):
    frame = {"input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(theta) / RATIO - error / 60}
    return gather([recording_from_table(pd.DataFrame(frame), RATIO)])


def angles(turns):
    return np.arange(round(turns * PER_TURN)) * TURN / PER_TURN


def test_the_drives_errors_are_found_beside_waves_over_the_outputs_turn():
    """Waves 1 and 2 as large as the drive's own error, as a coupling makes them. Twenty free columns of 1944 rows: the
    fit is off by a tenth of the noise, less than half of it with noise that means nothing to the waves."""
    theta, rng = angles(81), np.random.default_rng(3)
    own = error_of(rng, theta)
    waves = sum(size * np.sin(j * theta / RATIO + j) for j, size in WAVES)
    rows = rows_of(own + waves + rng.normal(0, NOISE, len(theta)), theta)
    off = model_of(rows, DRIVE, 1, 1.0).predict(theta) - own
    free = [function(j * theta / RATIO) for j, _ in WAVES for function in (np.cos, np.sin)]
    columns = np.column_stack([np.ones(len(theta)), theta, *free])
    assert np.std(off - columns @ np.linalg.lstsq(columns, off, rcond=None)[0]) < 0.5 * NOISE


@pytest.mark.parametrize(("seed", "turns"), [(0, 81), (7, 81), (1, 39)])
def test_a_drive_without_such_waves_is_fitted_without_them(monkeypatch, seed, turns):
    """What its kinks make of waves over the output's turn, as large as its error's rms at times, belongs to the drive;
    less than half of the output's turn parts no wave from a drift."""
    rng, theta, given = np.random.default_rng(seed), angles(turns), []
    fit_rows = trials.fit_rows
    monkeypatch.setattr(trials, "fit_rows", lambda *some: given.append(some[4]) or fit_rows(*some))
    own = error_of(rng, theta)
    rows = rows_of(own + rng.normal(0, NOISE, len(theta)), theta)
    off = model_of(rows, DRIVE, 1, 1.0).predict(theta) - own
    assert given == [None]
    assert np.std(off) < 0.5 * NOISE
