"""What changes in time as no noise does: steps, slips, slow waves; and slow effects against slow wander."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from hdopt.diagnosis import diagnose
from hdopt.diagnosis.checks.slow_wander import lost_in_wander, slow_wave
from hdopt.diagnosis.checks.step_detection import sudden_steps
from hdopt.diagnosis.inference import noise as noise_model
from hdopt.diagnosis.inference.change_points import find_steps
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.search.candidates import joint_fit
from hdopt.diagnosis.settings import DEFAULT
from hdopt.drive.geometry import ARCMIN
from hdopt.effects import EFFECTS
from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather
from hdopt.study import load_study

TURN = 2 * np.pi
RATIO = 80.0
ROWS = 6000
TURNS = 60
THETA = np.linspace(0, TURNS * TURN, ROWS)
"""60 turns forward, 100 rows a turn, a hundredth of a second apart."""
SEEDS = [0, 1, 2]
SLOW_COST = DEFAULT.search.slow_cost


@pytest.fixture(scope="module")
def study():
    return load_study(drive="csf-25-80")


def record(error, theta=THETA):
    table = {
        "time_s": 0.01 * np.arange(len(theta)),
        "input_angle_deg": np.degrees(theta),
        "output_angle_deg": np.degrees(theta / RATIO - error * ARCMIN),
    }
    return recording_from_table(pd.DataFrame(table), RATIO, name="record")


def fit_of(error):
    """An offset fitted to `error`, with the noise that an autoregression makes of the rest."""
    samples = gather([record(error)])
    problem = FitProblem(samples, None, np.ones((len(samples), 1)), Noise.white(samples, float(np.std(error))))
    bare = refine(evaluate(problem, np.zeros(0), np.zeros(1), (), ()))
    return evaluate(problem.with_noise(noise_model.estimate(samples, bare.residual)), np.zeros(0), bare.offsets, (), ())


def coloured(rng, pole=0.6, size=0.02):
    return lfilter([1.0], [1.0, -pole], rng.normal(0, size, ROWS))


def stick_slip(rng, size=0.3):
    """Creeps up at a steady rate and slips back after irregular distances."""
    error, level = np.empty(ROWS), 0.0
    for i in range(ROWS):
        level += size / 150
        if level > size * rng.uniform(0.7, 1.3):
            level = 0.0
        error[i] = level
    return error


@pytest.mark.parametrize("seed", SEEDS)
def test_steps_are_found_where_and_as_high_as_they_are(seed):
    rng = np.random.default_rng(seed)
    rows, heights = [900, 2500, 4200, 5200], [0.15, -0.2, 0.12, 0.3]
    stairs = sum(h * (np.arange(ROWS) >= r) for r, h in zip(rows, heights, strict=True))
    found, without = find_steps(stairs + coloured(rng))
    assert len(found) == 4
    assert max(min(abs(f - r) for f in found) for r in rows) <= 8
    assert np.std(without) < 1.15 * np.std(coloured(np.random.default_rng(seed)))


@pytest.mark.parametrize("seed", SEEDS)
def test_neither_a_walk_nor_a_slope_nor_a_wave_has_steps(seed):
    rng = np.random.default_rng(seed)
    along = np.linspace(0, 1, ROWS)
    for smooth in (np.cumsum(rng.normal(0, 0.003, ROWS)), 2 * along, 0.3 * np.sin(20 * along), np.zeros(ROWS)):
        found, without = find_steps(smooth + coloured(rng))
        assert found == []
        assert np.ptp(without) > 0


def test_slips_give_themselves_away_and_noise_does_not():
    rng = np.random.default_rng(3)
    noise = coloured(rng)
    steps = sudden_steps(fit_of(stick_slip(rng) + noise))
    assert len(steps.rows) > 20
    assert steps.rms > 0.03
    assert not sudden_steps(fit_of(noise)).any
    assert not sudden_steps(fit_of(np.cumsum(rng.normal(0, 0.01, ROWS)))).any


def read_in_steps(error, step):
    """`fit_of` an `error` as an encoder of this `step` reads it."""
    fit = fit_of(step * np.round(error / step))
    return replace(fit, problem=replace(fit.problem, rows=replace(fit.problem.rows, output_step=step)))


@pytest.mark.parametrize("steps_of_noise", [0.2, 0.3, 0.37, 0.45, 0.6, 1.0])
def test_noise_that_crosses_an_encoders_steps_does_not_slip(steps_of_noise):
    """The error moves in steps of the encoder: where its noise crosses two at once that is no event, whatever the noise
    is in units of the step.
    """
    step = 0.04
    noise = coloured(np.random.default_rng(6), 0.5, steps_of_noise * step * math.sqrt(1 - 0.5**2))
    assert not sudden_steps(read_in_steps(noise, step)).any


@pytest.mark.parametrize("steps_of_noise", [0.45, 0.6, 1.0])
def test_slips_of_many_steps_of_an_encoder_are_found(steps_of_noise):
    """Where the noise crosses steps at all: below that the creeping between slips is steps itself."""
    step, rng = 0.04, np.random.default_rng(6)
    noise = coloured(rng, 0.5, steps_of_noise * step * math.sqrt(1 - 0.5**2))
    wander = 0.1 * np.sin(THETA / 40)
    assert sudden_steps(read_in_steps(noise + wander + stick_slip(rng, 12 * step), step)).any


def test_a_glitch_of_the_readout_or_a_pulse_at_an_angle_is_no_slip():
    rng = np.random.default_rng(4)
    glitches = np.zeros(ROWS)
    glitches[rng.choice(ROWS, 40, replace=False)] = 0.5
    assert not sudden_steps(fit_of(coloured(rng) + glitches)).any
    at_an_angle = 0.5 * (np.mod(THETA, TURN) < 0.2)
    assert not sudden_steps(fit_of(coloured(rng) + at_an_angle)).any


@pytest.mark.parametrize("seed", SEEDS)
def test_a_slow_wave_is_told_from_wander(seed):
    rng = np.random.default_rng(seed)
    wander = lfilter([1.0], [1.0, -0.998], rng.normal(0, 0.004, ROWS))
    noise = rng.normal(0, 0.02, ROWS)
    assert slow_wave(fit_of(wander + noise)) is None
    wave = slow_wave(fit_of(0.2 * np.sin(TURN * np.arange(ROWS) * 0.01 / 5.3) + wander + noise))
    assert wave.period == pytest.approx(5.3, rel=0.05)
    assert wave.rms == pytest.approx(0.2 / np.sqrt(2), rel=0.15)


def warmed(error):
    """A drift fitted to `error` beside an offset."""
    start = fit_of(error)
    return joint_fit(start, [EFFECTS["thermal_drift"].term(start.problem.rows, {"time_constant_s": 20.0})])


def test_a_drift_stands_in_noise_and_is_lost_in_a_walk():
    """Of ten walks, whose drift as fitted takes half their power and more, a few may pass for one; no drift is lost."""
    lost = []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        drift = 0.2 * (1 - np.exp(-np.arange(ROWS) * 0.01 / 20.0))
        assert not lost_in_wander(warmed(drift + coloured(rng)), 0, SLOW_COST)
        lost.append(lost_in_wander(warmed(np.cumsum(rng.normal(0, 0.006, ROWS)) + coloured(rng)), 0, SLOW_COST))
    assert sum(lost) >= 8


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["slips", "steps", "wave"])
def test_what_changes_in_time_is_unknown(study, kind):
    rng = np.random.default_rng(5)
    rows = np.arange(ROWS)
    hidden = {
        "slips": stick_slip(rng),
        "steps": 0.25 * ((rows > 800).astype(float) - (rows > 2100) + (rows > 2900) + (rows > 4700)),
        "wave": 0.25 * np.sin(TURN * rows * 0.01 / 7.1),
    }[kind]
    error = kinematic_error_arcmin(study.drive, study.errors, THETA) + hidden + rng.normal(0, 0.015, ROWS)
    diagnosis = diagnose(record(error), study.drive)
    assert diagnosis.verdict == "unknown"
    assert diagnosis.where["domain"] == "time"
    assert diagnosis.effects == ()


@pytest.mark.slow
def test_a_hub_that_slips_at_one_angle_is_unknown(study):
    """By another amount each turn, at 100 deg of the input: twice the noise, 0.03 arcmin. Fault caught: `adequate`, as
    the noise model took the slips up."""
    rng, turns = np.random.default_rng(5), 120
    theta = np.linspace(0, turns * TURN, 60 * turns)
    turn = np.floor(theta / TURN - 100 / 360).astype(int) + 1
    hidden = rng.normal(0, 0.03, turns + 1)[turn]
    error = kinematic_error_arcmin(study.drive, study.errors, theta) + hidden + rng.normal(0, 0.017, len(theta))
    diagnosis = diagnose(record(error, theta), study.drive)
    assert (diagnosis.verdict, diagnosis.effects) == ("unknown", ())
    assert diagnosis.where["domain"] == "angle"
    assert diagnosis.where["input_angle_deg"] == pytest.approx(100, abs=10)
    assert diagnosis.where["rms_arcmin"] == pytest.approx(0.03, rel=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["friction under load", "creep under load"])
def test_what_follows_the_torque_as_no_effect_does_is_unknown(study, kind):
    """There and back over 30 turns at two speeds, a torque that swings seven times, 0.04 arcmin in noise of 0.02. Fault
    caught: the noise model takes it up, and the answer is `adequate`."""
    rng = np.random.default_rng(7)
    there = np.linspace(0, 30 * TURN, ROWS // 2)
    theta = np.r_[there, there[::-1]]
    time = 0.01 * np.cumsum(np.r_[np.ones(ROWS // 2), 2 * np.ones(ROWS // 2)])
    speed = np.gradient(theta, time)
    torque = 25 * np.sin(TURN * 7 * time / time[-1])
    late = lfilter([0.01], [1, -0.99], torque)
    shape = {"friction under load": torque * speed, "creep under load": late}[kind]
    hidden = 0.04 * shape / np.std(shape)
    error = kinematic_error_arcmin(study.drive, study.errors, theta) + hidden + rng.normal(0, 0.02, ROWS)
    table = {
        "time_s": time,
        "input_angle_deg": np.degrees(theta),
        "output_angle_deg": np.degrees(theta / RATIO - error * ARCMIN),
        "torque_Nm": torque,
    }
    diagnosis = diagnose(recording_from_table(pd.DataFrame(table), RATIO, name="record"), study.drive)
    assert (diagnosis.verdict, diagnosis.effects) == ("unknown", ())
    assert diagnosis.where["domain"] == "torque"
    assert diagnosis.where["rms_arcmin"] == pytest.approx(0.04, rel=0.1)
