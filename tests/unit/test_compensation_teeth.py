"""Lobes, long waves and a damaged tooth inside the meshing zones: found from a record, and nothing found in noise."""

from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest

from hdopt.compensation import teeth as module
from hdopt.compensation.surface import nothing
from hdopt.compensation.teeth import CELLS, Teeth, fit_teeth
from hdopt.compensation.zones import formed
from hdopt.drive.errors import DriveErrors
from hdopt.kinematics.cartesian import CartesianModel, to_cartesian
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather
from hdopt.study import load_study
from hdopt.workflow.compensation_trials import model_of

RATIO, TURN, NOISE, PER_TURN = 80.0, 2 * np.pi, 0.01, 150
HEIGHT = 2.5e-3 * load_study(drive="csf-25-80").drive.geometry.arcmin_per_mm
ROUND = np.arange(CELLS) * (TURN / CELLS)


@cache
def truth(kind, sense=1.0):
    """Teeth by hand: 2 um of 3 and 1 um of 5 waves round the circular spline; or one tooth of the flexspline 2.5 um up,
    its neighbours half as much; or none."""
    model = CartesianModel.of(load_study(drive="csf-25-80").drive)
    errors = to_cartesian(
        DriveErrors(axis_eccentricity=0.006, wg_eccentricity=0.003, wg_eccentricity_direction=1.0,
        cs_tooth_amplitude=0.002, fs_tooth_amplitude=0.001), model.half_width)  # fmt: skip
    bare = Teeth.bare(model, errors, sense)
    none = np.zeros(CELLS)
    if kind == "lobes":
        return replace(bare, cs=2e-3 * np.sin(3 * ROUND) + 1e-3 * np.cos(5 * ROUND), fs=none)
    if kind == "tooth":
        return replace(bare, cs=none, fs=2.5e-3 * np.maximum(1 - np.abs(ROUND - 2.0) / (2 * TURN / 160), 0))
    return bare


def record(kind, sense, seed=1):
    theta = np.arange(82 * PER_TURN) * TURN / PER_TURN
    error = truth(kind, sense).at(theta) + np.random.default_rng(seed).normal(0, NOISE, len(theta))
    frame = {"input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(theta) / RATIO - error / 60}
    return gather([recording_from_table(pd.DataFrame(frame), RATIO)])


def fitted(rows, kind, sense):
    """Started from the drive without its teeth; its errors may move by a few um."""
    start = truth("none", sense)
    return fit_teeth(rows, np.ones((len(rows), 1)), start, np.full(12, 1e-6)), start


def left(rows, error):
    return float(np.std(rows.error - error))


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("kind", ["lobes", "tooth"])
def test_what_stands_on_a_spline_is_found(kind, sense):
    """On an unseen run the noise is left. 60 waves, 2.5 rows each, leave out 0.13 of a triangle of 4.5 deg half width:
    the integral of sin^2 x/x^2 from 60 * 4.5 deg/2 on; the noise of the fit is added."""
    found, start = fitted(record(kind, sense), kind, sense)
    fresh = record(kind, sense, seed=2)
    assert left(fresh, start.at(fresh.theta)) > 1.4 * NOISE
    assert left(fresh, found.at(fresh.theta)) < 1.04 * NOISE
    off = found.at(fresh.theta) - truth(kind, sense).at(fresh.theta)
    assert np.ptp(off) < 0.13 * HEIGHT * (kind == "tooth") + 2 * NOISE


def test_nothing_is_found_in_noise():
    """250 free coefficients of white noise would add their share, 14 % of it; weighed ones less than half of that."""
    found, _ = fitted(record("none", 1.0), "none", 1.0)
    theta = np.arange(20_000) * (TURN * 80 / 20_000)
    off = found.at(theta) - truth("none").at(theta)
    assert np.std(off - off.mean()) < 0.07 * NOISE


def test_what_means_of_samples_dim_is_made_up_for():
    """Rows of 4 samples over 6 deg hold the means of the waves at those samples: mended they are the waves."""
    teeth = replace(truth("lobes"), cs=1e-3 * np.sin(20 * ROUND + 1), fs=1e-3 * np.cos(31 * ROUND))
    width, apart = np.radians(6.0), np.radians(1.5) * (np.arange(4) - 1.5)
    seen = replace(teeth, cs=np.mean([1e-3 * np.sin(20 * (ROUND + d) + 1) for d in apart], axis=0),
        fs=np.mean([1e-3 * np.cos(31 * (ROUND + d)) for d in apart], axis=0))  # fmt: skip
    mended = seen.sharpened(width, 4)
    assert np.ptp(seen.fs) < 0.8 * np.ptp(teeth.fs)
    assert mended.cs == pytest.approx(teeth.cs, abs=1e-9)
    assert mended.fs == pytest.approx(teeth.fs, abs=1e-9)
    assert seen.sharpened(width, 1) is seen


@pytest.mark.parametrize(("kind", "table"), [("tooth", True), ("lobes", False)])
def test_a_form_is_as_good_as_what_is_left_asks_for(kind, table):
    """64 terms for lobes, off by no more than a twentieth of what is left; a tooth needs the finer table. Halfway
    between its points 0.9 and 1.9 deg apart the tip of a tooth 4.5 deg to either side is off by 0.31 of its height."""
    teeth = truth(kind)
    found, said = formed(teeth, nothing(), None, 0.4)
    theta = np.arange(80 * 170) * TURN / 170
    off = found.at(theta, theta / RATIO) - teeth.at(theta)
    assert np.ptp(off) < (0.31 * HEIGHT if table else 0.06 * 0.4)
    assert hasattr(found, "values") == table
    assert said < 0.05 * 0.4
    few, off = formed(teeth, nothing(), 20, 0.4)
    assert len(few) <= 20
    assert off == pytest.approx(np.ptp(few.at(theta, theta / RATIO) - teeth.at(theta)), rel=0.2)


def test_lobes_that_make_the_wrong_sign_fit_better_do_not_decide_it():
    """Five lobes as large as the drive's own errors: the model alone leaves less of the mirrored error."""
    teeth = replace(truth("none"), cs=1.5e-3 * np.sin(5 * ROUND + 1), fs=np.zeros(CELLS))
    theta = np.arange(82 * 30) * TURN / 30
    error = teeth.at(theta) + np.random.default_rng(1).normal(0, NOISE, len(theta))
    frame = {"input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(theta) / RATIO - error / 60}
    rows = gather([recording_from_table(pd.DataFrame(frame), RATIO)])
    drive = load_study(drive="csf-25-80").drive
    right, wrong = (model_of(rows, drive, 1, sign).rms_arcmin for sign in (1.0, -1.0))
    assert right > 1.2 * wrong
    assert model_of(rows, drive, 1).sign == 1


def test_a_long_record_is_fitted_on_some_of_its_rows(monkeypatch):
    """Would catch memory that grows with the record: of 12 300 rows at most 5000 reach the fit, enough for lobes."""
    seen = []
    weighed = module._weighed
    monkeypatch.setattr(module, "MOST_ROWS", 5000)
    monkeypatch.setattr(module, "_weighed", lambda design, *rest: seen.append(len(design)) or weighed(design, *rest))
    found, _ = fitted(record("lobes", 1.0), "lobes", 1.0)
    fresh = record("lobes", 1.0, seed=2)
    assert max(seen) <= 5000
    assert left(fresh, found.at(fresh.theta)) < 1.1 * NOISE
