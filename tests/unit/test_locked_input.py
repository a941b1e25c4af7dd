"""Torque sweeps against a locked input: what friction, play and a spring do there, element by element in time."""

import math

import numpy as np
import pandas as pd
import pytest

from hdopt.diagnosis import diagnose
from hdopt.diagnosis.predict import predict
from hdopt.effects._friction_torque import torque_behind_friction
from hdopt.errors import HdoptError
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather

SWEEP = np.concatenate([np.linspace(a, b, 500) for a, b in ((-20, 20), (20, -15), (-15, 18), (18, -20))])


def slider(torque, friction):
    """A block that sticks while the torque on its spring is below `friction`: the spring's torque, step by step."""
    behind = [torque[0] - friction * math.copysign(1, torque[1] - torque[0])]
    for now in torque[1:]:
        stretch = now - behind[-1]
        behind.append(behind[-1] + max(stretch - friction, 0) + min(stretch + friction, 0))
    return np.array(behind)


def sweep(friction=0.0, play=0.0, stiffness=3e4, seed=0):
    """A spring of `stiffness` Nm/rad behind `friction` Nm, and `play` arcmin crossed where its torque changes sign."""
    behind = slider(SWEEP, friction)
    windup = behind / stiffness * 10800 / math.pi + 0.5 * play * np.sign(behind)
    noise = np.random.default_rng(seed).normal(0, 0.01, len(SWEEP))
    return recording_from_table(
        pd.DataFrame({"torque": SWEEP, "error": windup + noise}), 80.0, "torque=torque:Nm,error=error:arcmin"
    )


def test_friction_passes_the_torque_on_as_a_slider_does():
    samples = gather([sweep()])
    np.testing.assert_allclose(torque_behind_friction(samples, 3.0), slider(samples.torque, 3.0), atol=1e-9)


def test_spring_alone_has_no_friction():
    diagnosis = diagnose(sweep(), None, 80.0)
    assert [found.id for found in diagnosis.effects] == ["torsional_windup"]
    stiffness = diagnosis.effects[0].parameters["stiffness_1"]
    assert stiffness.value == pytest.approx(3e4, rel=0.01)


def test_spring_behind_friction_is_both():
    diagnosis = diagnose(sweep(friction=8.0), None, 80.0)
    assert {found.id for found in diagnosis.effects} == {"torsional_windup", "hysteresis"}
    parameters = next(found for found in diagnosis.effects if found.id == "hysteresis").parameters
    assert parameters["friction_torque"].value == pytest.approx(8.0, rel=0.03)
    assert parameters["half_loop_arcmin"].value == pytest.approx(8 / 3e4 * 10800 / math.pi, rel=0.05)
    assert parameters["friction_torque"].unit == "Nm"


def test_play_is_crossed_where_the_torque_changes_sign():
    """Of a drive so stiff that it hardly winds up; a softer one's play passes for a soft spring about zero torque."""
    diagnosis = diagnose(sweep(play=2.0, stiffness=1e7), None, 80.0)
    assert [found.id for found in diagnosis.effects] == ["lost_motion"]
    assert diagnosis.effects[0].parameters["lost_motion_arcmin"].value == pytest.approx(2.0, rel=0.02)


def test_input_that_trembles_without_torque_shows_nothing():
    angle = 0.01 * np.random.default_rng(2).standard_normal(600)
    error = 0.01 * np.random.default_rng(3).standard_normal(600)
    table = pd.DataFrame({"angle": angle, "error": error})
    diagnosis = diagnose(recording_from_table(table, 80.0, "input=angle:deg,error=error:arcmin"), None, 80.0)
    assert diagnosis.effects == ()
    assert any("lost_motion cannot be seen" in warning for warning in diagnosis.warnings)


def test_model_predicts_another_sweep():
    diagnosis = diagnose(sweep(friction=8.0), None, 80.0)
    recorded, expected = predict(diagnosis, sweep(friction=8.0, seed=1))
    assert np.std(recorded - expected) < 0.03
    recorded, nothing = predict(diagnosis, sweep(friction=8.0, seed=1), extended=False)
    assert np.std(recorded - nothing) == pytest.approx(np.std(recorded))


def test_nuisances_of_one_recording_predict_no_other():
    table = pd.DataFrame({"angle": np.arange(2000) * 3.6, "error": np.sin(np.arange(2000) * 0.1)})
    recording = recording_from_table(table, 80.0, "input=angle:deg,error=error:arcmin")
    diagnosis = diagnose(recording, None, 80.0, nuisance=("drift",))
    with pytest.raises(HdoptError, match="which no other recording shares"):
        predict(diagnosis, recording)
