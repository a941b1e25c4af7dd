"""A ratio, a gain or a clock that is off is told as what it is, and hides no physics beside it."""

from itertools import product

import numpy as np
import pandas as pd
import pytest

from hdopt.bench.cases import Spec, simulate
from hdopt.bench.readings import times
from hdopt.diagnosis import diagnose
from hdopt.diagnosis.checks.scale import fitted_scale
from hdopt.diagnosis.inference.catalogue import SKEW
from hdopt.diagnosis.inference.common_slope import common_slope
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.predict import predict
from hdopt.diagnosis.search.candidates import search_terms
from hdopt.diagnosis.settings import DEFAULT
from hdopt.diagnosis.stages import begin, fit_base_in_noise
from hdopt.drive.geometry import ARCMIN
from hdopt.kinematics.cartesian import CartesianModel
from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.recordings.read import recording_from_table
from hdopt.study import load_study

TURN = 2 * np.pi
RATIO, TURNS, RATE, NOISE = 80.0, 40, 30, 0.01
RAMP = np.arange(TURNS * RATE) * TURN / RATE
THETA = np.r_[RAMP, RAMP[::-1]]
"""Forty turns there and back."""
TIME = 0.02 * np.arange(len(THETA))
WAY = np.sign(np.gradient(THETA))

HIDDEN = {
    "nothing": 0 * THETA,
    "friction": 0.3 * WAY,
    "input encoder": 0.2 * np.sin(THETA + 0.4),
    "warming": 0.8 * (1 - np.exp(-TIME / 8)),
    "bent coupling": 0.2 * np.sin(2 * THETA / RATIO + 1.0),
}
GAINS = (0.992, 0.999, 0.9995, 1.001, 1.007)


@pytest.fixture(scope="module")
def study():
    return load_study(drive="csf-25-80")


def read(theta, output, ratio=RATIO):
    table = {"time_s": TIME[: len(theta)], "input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(output)}
    return recording_from_table(pd.DataFrame(table), ratio, name="record")


def angles(study, hidden):
    """Input and output angle (rad) of the drive with `hidden` (arcmin) in its error."""
    error = kinematic_error_arcmin(study.drive, study.errors, THETA) + hidden
    error = error + np.random.default_rng(5).normal(0, NOISE, len(THETA))
    return THETA, THETA / RATIO - error * ARCMIN


@pytest.fixture(scope="module")
def starts(study):
    """The first state of each hidden physics with nothing off, by its name."""
    known = {}

    def start(name):
        if name not in known:
            known[name] = begin([read(*angles(study, HIDDEN[name]))], CartesianModel.of(study.drive), 3, DEFAULT)
        return known[name]

    return start


@pytest.mark.parametrize(("gain", "name"), list(product(GAINS, HIDDEN)))
def test_a_gain_that_is_off_leaves_all_else_as_it_was(study, starts, gain, name):
    """Whatever is hidden: the gain comes out right, and the base leaves what it leaves with nothing off, but for
    the part that one free slope takes. Fault caught: the slope left in, so that base and noise are fitted to it.
    """
    theta, output = angles(study, HIDDEN[name])
    state = begin([read(theta, gain * output)], CartesianModel.of(study.drive), 3, DEFAULT)
    assert state.nuisances.taken.input_gain == 1.0
    scale = fitted_scale(state.base, state.nuisances)
    # The slope of what is hidden itself: 0.8 arcmin of warming over 135 degrees of output is 1e-4.
    assert scale.gain == pytest.approx(gain, abs=1e-4)
    assert scale.found
    before, after = (np.std(one.base.residual) for one in (starts(name), state))
    assert after < 1.1 * before
    assert after > (0.5 if name in ("warming", "bent coupling") else 0.9) * before


@pytest.mark.parametrize("name", HIDDEN)
def test_nothing_is_taken_out_where_the_scale_is_right(starts, name):
    """Physics of a drive's own size is never taken for a scale. Fault caught: a threshold of nothing."""
    assert starts(name).nuisances.taken is None


@pytest.mark.parametrize("gain", [0.993, 1.003])
def test_an_input_that_counts_wrongly_is_told_from_the_output(study, starts, gain):
    """All orders of the drive stand elsewhere then: only the corrected angle fits. Fault caught: the angle left as it
    was, which leaves the whole of the drive's own error.
    """
    theta, output = angles(study, HIDDEN["friction"])
    state = begin([read(gain * theta, output)], CartesianModel.of(study.drive), 3, DEFAULT)
    # Friction and the drive's own error have some slope of their own, which the fit beside them tells from a scale.
    assert state.nuisances.taken.input_gain == pytest.approx(gain, abs=5e-5)
    assert fitted_scale(state.base, state.nuisances).input_gain == pytest.approx(gain, abs=5e-5)
    assert np.std(state.base.residual) < 1.1 * np.std(starts("friction").base.residual)


def test_recordings_share_one_slope_and_keep_their_zeros(study):
    """Fault caught: a slope between recordings of different zeros."""
    theta, output = angles(study, HIDDEN["nothing"])
    far, settings = read(theta + 40 * TURN, output + 3.0 + 40 * TURN / RATIO), DEFAULT.nuisance
    assert common_slope([read(theta, output), far], settings) is None
    scaled = [read(theta, 1.001 * output), read(theta + 40 * TURN, 1.001 * output + 3.0 + 40 * TURN / RATIO)]
    # The drive's own error, 1.3 arcmin peak to peak over 10 arcmin of drift, has some slope of its own.
    assert common_slope(scaled, settings).slope == pytest.approx(-0.001 / RATIO, rel=0.05)


def test_a_wrong_ratio_of_a_gear_without_a_model_is_found():
    """Eight turns, a ratio off by 0.8 %: once `adequate` at 9.5 arcmin without a word."""
    theta = RAMP[: 8 * RATE]
    output = theta / 50.4 + np.random.default_rng(2).normal(0, 0.02, len(theta)) * ARCMIN
    diagnosis = diagnose(read(theta, output, 50.0), ratio=50.0)
    assert (diagnosis.verdict, diagnosis.effects) == ("adequate", ())
    scale = diagnosis.evidence.scale
    assert scale.found and scale.low < 50 / 50.4 < scale.high
    assert scale.ratio == pytest.approx(50.4, abs=0.001)
    assert diagnosis.fit["heldout_rms_extended_arcmin"] < 0.03
    assert "a ratio or gain that is off" in diagnosis.says
    assert any("as if the ratio were 50.4" in one for one in diagnosis.warnings)
    recorded, said = predict(diagnosis, read(theta, output, 50.0))
    assert np.std(recorded - said) < 0.03


def test_clocks_that_run_apart_are_no_effect(study):
    """The output's clock runs 2e-4 slow: a delay that grows. Found as a skew with its rate, outdoing a constant delay;
    one that does not grow is `channel_delay`. Fault caught: the wrong sign or unit, or no column at all.
    """
    rate, speed = 2e-4, np.gradient(THETA, TIME)
    for hidden, better in ((rate * TIME, SKEW), (0.01 + 0 * TIME, "channel_delay")):
        theta, output = angles(study, hidden * speed / RATIO / ARCMIN)
        fit = fit_base_in_noise(begin([read(theta, output)], CartesianModel.of(study.drive), 3, DEFAULT)).base
        probe = FitProbe(fit)
        terms = search_terms(probe, only=[SKEW, "channel_delay"])
        best = max(terms, key=probe.gain)
        assert best.effect == better
        if better == SKEW:
            assert probe.solve(best)[1][0] == pytest.approx(rate, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize(("effect", "seed"), [("hysteresis", 540), ("thermal_drift", 620)])
def test_an_effect_beside_a_gain_that_is_off_is_still_named(study, effect, seed):
    """Bench cases with an output encoder of gain 1.001; both were `unknown`, friction once `adequate`."""
    rng = np.random.default_rng(0)
    case = Spec("single", seed, (effect,), 1.0, size="brief")
    tables = [times(output=1.001)(table, rng) for table in simulate(case).tables]
    diagnosis = diagnose([recording_from_table(table, RATIO) for table in tables], study.drive)
    assert diagnosis.verdict == "named"
    assert [one.id for one in diagnosis.effects] == [effect]
    # 0.003 %: an eccentric drive and a slow drift both leave some slope.
    assert diagnosis.evidence.scale.gain == pytest.approx(1.001, abs=3e-5)
