"""What is always free: columns of each recording's own, and slopes that are those of the curve they belong to."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from test_cross_validation import RATE, noisy

from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.inference.nuisance import Nuisances, base_slope, nuisances_for, order_slope
from hdopt.drive.geometry import ARCMIN
from hdopt.kinematics.cartesian import CartesianModel, to_cartesian
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather
from hdopt.study import load_study


def recording(zero, turns=4):
    theta = np.arange(turns * RATE) * 2 * np.pi / RATE
    error = zero + 0.3 * np.sin(theta)
    table = {"input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(theta / 80 - error * ARCMIN)}
    return recording_from_table(pd.DataFrame(table), 80.0, name="record")


def test_each_recording_drifts_by_itself():
    rows = gather([recording(0.0), recording(100.0), recording(-40.0)])
    blocks = nuisances_for(rows, None, ("drift",)).blocks(rows)
    for kind, width in (("zero", 1), ("drift", 2)):
        assert blocks[kind].shape[1] == 3 * width
        for column in blocks[kind].T:
            assert len(set(rows.record[np.abs(column) > 1e-12])) == 1


def test_recordings_of_one_zero_share_it():
    rows = gather([recording(0.0), recording(0.5)])
    assert nuisances_for(rows, None).blocks(rows)["zero"].shape[1] == 1


def test_the_slope_of_whole_orders_is_that_of_their_sum():
    rows = noisy(3)
    nuisances = Nuisances(False, orders=(1, 3))
    offsets = np.array([0.7, 0.5, -0.2, 0.3, 0.4])
    fit = SimpleNamespace(problem=SimpleNamespace(rows=rows), offsets=offsets)
    theta, step = np.linspace(0, 7, 50), 1e-5

    def curve(at):
        return sum(
            s * np.sin(k * at) + c * np.cos(k * at) for k, (s, c) in zip((1, 3), offsets[1:].reshape(2, 2), strict=True)
        )

    slope = (curve(theta + step) - curve(theta - step)) / (2 * step)
    assert order_slope(fit, nuisances)(theta) == pytest.approx(slope, abs=1e-8)


def test_the_slope_of_the_base_integrates_to_the_base():
    study = load_study(drive="csf-25-80")
    base, rows = CartesianModel.of(study.drive), noisy(3)
    problem = FitProblem(rows, base, np.ones((len(rows), 1)), Noise.white(rows, 0.02))
    fit = evaluate(problem, to_cartesian(study.errors, base.half_width), np.zeros(1), (), ())
    theta = np.linspace(0, 6, 6001)
    slope = base_slope(fit)(theta)
    rise = np.r_[0, np.cumsum((slope[1:] + slope[:-1]) / 2 * np.diff(theta))]
    value = base.evaluate(theta, fit.errors)[0]
    # Right to a few steps of 1e-3 rad times the slope, 1 arcmin/rad: at some angle the driving zone changes within one.
    assert rise == pytest.approx(value - value[0], abs=5e-3)
