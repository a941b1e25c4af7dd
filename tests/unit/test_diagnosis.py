"""The diagnosis on records made here: base recovery, intervals, honest verdicts, the contract, the command.

These records are an effect's own equation on top of the model, with noise. Whether every effect is found by its name
and with its size is asked in `test_named_cases.py`, on records of a bench that shares no code.
"""

import json
import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from hdopt.cli import main
from hdopt.diagnosis import diagnose
from hdopt.diagnosis.inference.base_fit import base_estimate, fit_base
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import FitProblem
from hdopt.diagnosis.inference.noise import Noise, estimate
from hdopt.diagnosis.inference.nuisance import nuisances_for
from hdopt.effects import EFFECTS
from hdopt.errors import HdoptError
from hdopt.kinematics.cartesian import CartesianModel
from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.recording import Recording
from hdopt.recordings.rows import gather
from hdopt.study import load_study

TURN = 2 * np.pi
NOISE = 0.02


@pytest.fixture(scope="module")
def study():
    return load_study(drive="csf-25-80")


@pytest.fixture(scope="module")
def drive(study):
    return study.drive


def bench(study, hidden=None, turns=40, rate=100, seed=0, speeds=(1.0,)):
    """A record forward and back at each speed (rad/s): the model, what is `hidden` (a function of a dict), noise."""
    rng = np.random.default_rng(seed)
    parts = []
    for index, speed in enumerate(speeds):
        there = np.arange(turns * rate) * TURN / rate
        theta = np.r_[there, there[::-1]] + 0.2
        direction = np.r_[np.ones(len(there)), -np.ones(len(there))]
        time = np.arange(len(theta)) * (TURN / rate / speed)
        since = np.r_[there, there]
        torque = 6 * np.sin(0.37 * theta + index)
        state = {
            "theta": theta, "direction": direction, "time": time, "speed": speed * direction, "since": since,
            "torque": torque, "index": index,
        }  # fmt: skip
        error = kinematic_error_arcmin(study.drive, study.errors, theta) + rng.normal(0, NOISE, len(theta))
        if hidden is not None:
            error = error + hidden(state)
        output = theta / 80 - np.radians(error / 60)
        table = pd.DataFrame(
            {
                "time_s": time,
                "input_angle_deg": np.degrees(theta),
                "output_angle_deg": np.degrees(output),
                "torque_Nm": torque,
            }
        )
        parts.append(recording_from_table(table, 80.0, name=f"record {index}"))
    return parts


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_base_recovers_the_waveform_and_what_is_identifiable(drive, study, seed):
    """To the noise: the fit of 12 numbers to 8000 samples leaves no more than the noise and a few parts of it."""
    samples = gather(bench(study, turns=80, seed=seed, rate=60))
    base = CartesianModel.of(drive)
    problem = FitProblem(samples, base, nuisances_for(samples, base).columns(samples), Noise.white(samples, NOISE))
    fit = refine(fit_base(problem, np.random.default_rng(seed)))
    assert np.std(fit.residual) < 1.02 * NOISE
    found = base_estimate(fit)
    # What the teeth of the flexspline do stands alone at its orders: its amplitude is identifiable.
    amplitude = found.parameters["fs_tooth_amplitude_mm"]
    assert amplitude.low - 2e-5 <= study.errors.fs_tooth_amplitude <= amplitude.high + 2e-5
    assert found.open_combinations  # e1 against a_CS and the small tilts are not


def test_noise_model_finds_its_own_colour(study):
    samples = gather(bench(study))
    rng = np.random.default_rng(0)
    white = rng.normal(size=len(samples))
    red = np.zeros(len(samples))
    for i in range(1, len(red)):
        red[i] = 0.7 * red[i - 1] + white[i]
    noise = estimate(samples, red)
    assert noise.ar[0] == pytest.approx(0.7, abs=0.03)
    assert noise.sigma == pytest.approx(1.0, rel=0.03)
    assert len(estimate(samples, white).ar) == 0


def test_nothing_hidden_is_adequate(study, drive):
    diagnosis = diagnose(bench(study), drive)
    assert diagnosis.verdict == "adequate"
    assert diagnosis.effects == ()
    assert set(diagnosis.below_detection) <= set(EFFECTS)
    assert max(diagnosis.below_detection.values()) < 0.5
    assert diagnosis.fit["heldout_rms_base_arcmin"] == pytest.approx(NOISE, rel=0.1)
    # One record at one speed has no condition to leave out.
    assert diagnosis.fit["heldout_conditions_rms_base_arcmin"] is None
    assert diagnosis.to_dict()["heldout_conditions"] == []


HIDDEN = {
    "circular_spline_lobing": lambda s: 0.12 * np.sin(6 * s["theta"] + 0.3),
    "lost_motion": lambda s: 0.15 * s["direction"],
    "channel_delay": lambda s: 2e-3 * s["speed"] / 80 * 10800 / math.pi,
    "torsional_windup": lambda s: s["torque"] / 31000 * 10800 / math.pi,
    "output_coupling": lambda s: 0.12 * np.sin(2 * s["theta"] / 80 + 0.5),
    "hysteresis": lambda s: 0.15 * s["direction"] * (1 - 2 * np.exp(-np.degrees(s["since"]) / 80 / 1.5)),
    "thermal_drift": lambda s: 0.5 * (1 - np.exp(-s["time"] / 100)),
}
SPEEDS = {"hysteresis": (1.0, 2.0)}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("hysteresis", {"half_loop_arcmin": 0.15, "transition_deg": 1.5 * math.log(10)}),
        ("thermal_drift", {"time_constant_s": 100.0}),
    ],
)
def test_parameters_come_back_within_their_intervals(study, drive, name, parameters):
    """Within twice the 95 % interval: of three, one may well lie outside of it once."""
    diagnosis = diagnose(bench(study, HIDDEN[name], rate=50, speeds=SPEEDS.get(name, (1.0,)), seed=5), drive)
    for parameter, value in parameters.items():
        found = diagnosis.effects[0].parameters[parameter]
        assert abs(found.value - value) < found.high - found.low
        assert found.high - found.low < 0.5 * value


@pytest.mark.slow
def test_structure_outside_the_catalogue_is_unknown(study, drive):
    diagnosis = diagnose(bench(study, lambda s: 0.12 * np.sin(3.37 * s["theta"]), rate=50), drive)
    assert diagnosis.verdict == "unknown"
    assert diagnosis.effects == ()
    assert diagnosis.where["orders_per_input_turn"][0] == pytest.approx(3.37, abs=0.02)


def test_one_direction_at_one_speed_cannot_show_a_delay(study, drive):
    record = bench(study)[0]
    half = len(record) // 2
    table = pd.DataFrame(
        {
            "time_s": record.time[:half],
            "input_angle_deg": np.degrees(record.input_angle[:half]),
            "output_angle_deg": np.degrees(record.input_angle[:half]) / 80 - record.error_arcmin[:half] / 60,
        }
    )
    diagnosis = diagnose(recording_from_table(table, 80.0), drive)
    assert diagnosis.verdict == "adequate"
    said = " ".join(diagnosis.warnings)
    assert "channel_delay cannot be seen here" in said
    assert "lost_motion cannot be seen here: it needs a reversal" in said


def test_short_record_is_insufficient(study, drive):
    record = bench(study, turns=1)[0]
    assert diagnose(record, drive).verdict == "insufficient"


def test_without_a_drive_model(study):
    rng = np.random.default_rng(0)
    theta = np.r_[np.linspace(0, 60, 2000), np.linspace(60, 0, 2000)]
    # Play of 6 arcmin: the output stands until the input has come back by as much.
    play = np.r_[np.full(2000, 3.0), np.maximum(3 - (60 - theta[2000:]) / 7.2 * 10800 / math.pi, -3)]
    error = play + rng.normal(0, 0.3, 4000)
    table = pd.DataFrame(
        {
            "time_s": np.arange(4000) * 0.01,
            "input_angle_deg": np.degrees(theta),
            "output_angle_deg": np.degrees(theta) / 7.2 - error / 60,
        }
    )
    diagnosis = diagnose(recording_from_table(table, 7.2), ratio=7.2)
    # At one speed a delay between the channels looks much the same: either is named, or both are offered.
    offered = [{found.id for found in diagnosis.effects}, *map(set, diagnosis.ambiguous_with)]
    assert {"lost_motion"} in offered
    assert diagnosis.base.parameters == {}


def test_the_catalogue_is_complete_and_speaks():
    assert len(EFFECTS) == 16
    for name, effect in EFFECTS.items():
        assert effect.id == name
        assert effect.separating and effect.domain


def test_command_writes_the_contract(study, tmp_path):
    record = bench(study, HIDDEN["output_coupling"], rate=50)[0]
    table = pd.DataFrame(
        {
            "time_s": record.time,
            "input_angle_deg": np.degrees(record.input_angle),
            "output_angle_deg": np.degrees(record.input_angle) / 80 - record.error_arcmin / 60,
        }
    )
    file, out, page, fitted = (tmp_path / name for name in ("r.csv", "o.json", "o.html", "fitted.toml"))
    table.to_csv(file, index=False)
    with pytest.raises(SystemExit) as end:
        main(["diagnose", str(file), "--json", str(out), "--report", str(page), "--write-study", str(fitted)])
    assert end.value.code == 0
    result = json.loads(out.read_text())
    assert {"schema", "verdict", "effects", "ambiguous_with", "separating_test", "base", "fit", "below_detection",
            "warnings"} <= set(result)  # fmt: skip
    assert result["effects"][0]["id"] == "output_coupling"
    assert set(result["effects"][0]["where"]) == {
        "domain", "orders_per_input_turn", "direction", "share_of_residual", "rms_arcmin",
    }  # fmt: skip
    assert result["effects"][0]["where"]["orders_per_input_turn"] == [0.025]
    pair = result["confounded"][0]
    assert pair["pair"] == ["output_coupling", "encoder_output_eccentricity"]
    assert pair["imitates"] > 0.99 and pair["angle_deg"] < 1 and "coupling" in pair["separating"]
    assert "twice a turn" in page.read_text()
    assert "What could be mistaken for it" in page.read_text()
    assert load_study(fitted).errors.fs_tooth_amplitude == pytest.approx(study.errors.fs_tooth_amplitude, rel=0.1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--drive", "none"], "give --ratio X"),
        (["--drive", "csf-25-81"], "unknown study"),
        (["--columns", "input=a:deg"], "either output= or error="),
    ],
)
def test_unusable_input_ends_with_two(tmp_path, capsys, arguments, message):
    file = tmp_path / "r.csv"
    file.write_text("time_s,input_angle_deg,output_angle_deg\n0,0,0\n")
    with pytest.raises(SystemExit) as end:
        main(["diagnose", str(file), *arguments])
    assert end.value.code == 2
    assert message in capsys.readouterr().err


def test_all_recordings_are_of_one_ratio(drive, study, monkeypatch):
    """Recordings at hand were read with some ratio: it must be the drive's. Fault caught: the others refused."""
    monkeypatch.setattr("hdopt.diagnosis.pipeline.gather_evidence", lambda *about: "evidence")
    monkeypatch.setattr("hdopt.diagnosis.verdict.draw.draw_verdict", lambda evidence, warnings: (evidence, warnings))
    theta = np.arange(400) * 0.1
    one = Recording("one", drive.geometry.ratio, theta, np.zeros(400), warnings=("a gap",))
    assert diagnose([one, one], drive) == ("evidence", ("a gap", "a gap"))
    with pytest.raises(HdoptError, match="different ratios"):
        diagnose([one, replace(one, ratio=drive.geometry.ratio + 0.5)], drive)


def test_no_recordings():
    with pytest.raises(HdoptError, match="at least one file"):
        diagnose([])
