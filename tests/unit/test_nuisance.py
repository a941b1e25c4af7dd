"""Drift and time warp as nuisances: fitted beside every model, never named, and they leave real effects to be found."""

import numpy as np
import pandas as pd
import pytest

from hdopt.diagnosis import diagnose
from hdopt.diagnosis.inference.base_fit import beat_warning
from hdopt.diagnosis.inference.nuisance import NUISANCES, nuisances_for
from hdopt.diagnosis.orientation import as_counted
from hdopt.effects import EFFECTS
from hdopt.effects.declared import Quantity
from hdopt.effects.estimate import Parameter
from hdopt.effects.term import Term
from hdopt.errors import HdoptError
from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather
from hdopt.report import Table
from hdopt.report.sections.diagnosis import diagnosis_report
from hdopt.study import load_study

TURN = 2 * np.pi
NOISE = 0.02
BOTH = ("drift", "time-warp")


@pytest.fixture(scope="module")
def study():
    return load_study(drive="csf-25-80")


def clockless(study, turns=30, drift=1.0, warp_deg=4.0, ratio=80.0, seed=0, more=lambda theta: 0.0):
    """One pass whose input angle was computed from a clock: the drive was `warp_deg` ahead at mid-record (1 - x^2 is
    Legendre's second but for a zero), and the bench drifted by `drift` arcmin along a parabola."""
    rng = np.random.default_rng(seed)
    theta = np.arange(turns * 100) * TURN / 100
    x = np.linspace(-1, 1, len(theta))
    true = theta + np.radians(warp_deg) * (1 - x**2)
    error = kinematic_error_arcmin(study.drive, study.errors, true) + drift * x**2 + more(true)
    table = pd.DataFrame({"t": theta, "angle": np.degrees(theta), "error": error + rng.normal(0, NOISE, len(theta))})
    return recording_from_table(table, ratio, "time=t:s,input=angle:deg,error=error:arcmin")


def test_nuisances_are_estimated_and_not_named(study):
    diagnosis = diagnose(clockless(study), study.drive, nuisance=BOTH)
    assert diagnosis.verdict == "adequate"
    drift, warp = (diagnosis.nuisances[name] for name in ("drift_arcmin", "time_warp_deg"))
    assert drift.low < 1.0 < drift.high
    assert warp.low < 4.0 < warp.high
    assert warp.high - warp.low < 1.0
    assert diagnosis.to_dict()["base"]["nuisances"]["time_warp_deg"]["unit"] == "deg"


def test_report_shows_what_was_fitted_beside_the_model(study):
    report = diagnosis_report(diagnose(clockless(study, turns=12), study.drive, nuisance=BOTH), ["clockless.csv"])
    tables = {item.key: item for section in report.sections for item in section.items if isinstance(item, Table)}
    assert list(tables["diagnosis-nuisances"].frame.iloc[:, 0]) == ["drift_arcmin", "time_warp_deg"]


def test_without_them_something_is_claimed(study):
    """The same record taken at its word: drift and warp must show as something."""
    assert diagnose(clockless(study), study.drive).verdict in ("named", "ambiguous", "unknown")


def test_an_effect_beside_them_is_named(study):
    recording = clockless(study, more=lambda theta: 0.15 * np.sin(theta + 0.5))
    diagnosis = diagnose(recording, study.drive, nuisance=BOTH)
    assert [found.id for found in diagnosis.effects] == ["encoder_input_eccentricity"]
    amplitude = diagnosis.effects[0].parameters["amplitude_arcmin"]
    assert amplitude.low < 0.15 < amplitude.high
    # A warp that the eccentricity bent leaves 1.03 of the noise; one standard error of 3000 samples is 0.013.
    assert np.std(diagnosis.evidence.selection.best.fit.residual) < 1.015 * NOISE


def test_a_gear_without_a_model_is_bent_at_its_whole_orders():
    """Whole orders that a warp of 4 deg bends: their amplitudes and the warp are found, and nothing gets a name."""
    theta = np.arange(3000) * TURN / 100
    x = np.linspace(-1, 1, len(theta))
    true = theta + np.radians(4.0) * (1 - x**2)
    error = 0.5 * np.sin(true) + 0.3 * np.sin(2 * true + 1) + np.random.default_rng(4).normal(0, NOISE, len(theta))
    table = pd.DataFrame({"angle": np.degrees(theta), "error": error})
    recording = recording_from_table(table, 80.0, "input=angle:deg,error=error:arcmin")
    diagnosis = diagnose(recording, None, 80.0, nuisance=BOTH)
    assert diagnosis.effects == ()
    for name, truth in (("order_1_arcmin", 0.5), ("order_2_arcmin", 0.3), ("time_warp_deg", 4.0)):
        assert diagnosis.nuisances[name].value == pytest.approx(truth, rel=0.05)
    assert any("whole orders were fitted freely" in warning for warning in diagnosis.warnings)


def test_less_than_one_turn_names_no_friction_for_a_slope():
    """Half a turn back and forth of a gear without a model: an eccentricity and a ratio 1 % off are a curve of the
    angle, the same in both directions, and must not be read as friction or play."""
    there = np.linspace(0, 0.45 * TURN, 300)
    theta = np.tile(np.r_[there, there[::-1]], 8)
    curve = 4 * np.sin(theta + 0.3) + 0.01 * np.degrees(theta) * 60 / 7
    error = curve + np.random.default_rng(2).normal(0, 0.3, len(theta))
    table = pd.DataFrame({"angle": np.degrees(theta), "error": error})
    diagnosis = diagnose(recording_from_table(table, 7.0, "input=angle:deg,error=error:arcmin"), None, 7.0)
    assert diagnosis.effects == ()
    assert any("depends on the angle alone" in warning for warning in diagnosis.warnings)


def test_unknown_nuisance_and_locked_input_are_refused(study):
    recording = clockless(study, turns=10)
    with pytest.raises(HdoptError, match="unknown nuisance in --nuisance 'drfit'; did you mean 'drift'"):
        diagnose(recording, study.drive, nuisance=("drfit",))
    sweep = pd.DataFrame({"torque": np.sin(np.arange(400) / 20), "error": np.arange(400.0)})
    locked = recording_from_table(sweep, 80.0, "torque=torque:Nm,error=error:arcsec")
    with pytest.raises(HdoptError, match="the input stands still"):
        diagnose(locked, study.drive, nuisance=("time-warp",))


def test_what_the_length_cannot_carry_is_told(study):
    assert beat_warning(gather([clockless(study, turns=80)])) is None
    worse = [
        float(beat_warning(gather([clockless(study, turns=turns)])).split("apart ")[1].split(" times")[0])
        for turns in (10, 5)
    ]
    assert 3 < worse[0] < worse[1]


def test_what_a_nuisance_takes_up_comes_from_the_declarations(study, monkeypatch):
    """An effect that declares the nuisance is no candidate beside it, and nothing else is; none declares one that
    cannot be asked for."""
    assert {effect.nuisance for effect in EFFECTS.values()} <= {"", *NUISANCES}
    rows = gather([clockless(study, turns=4)])
    assert nuisances_for(rows, None, ("drift",)).hidden == ("thermal_drift",)
    assert nuisances_for(rows, None, ("time-warp",)).hidden == ()
    monkeypatch.setattr(type(EFFECTS["output_coupling"]), "nuisance", "drift")
    assert set(nuisances_for(rows, None, ("drift",)).hidden) == {"thermal_drift", "output_coupling"}


def test_numbers_that_turn_with_the_error_are_those_of_the_effect():
    """A misspelled name would leave a drift's sign as it is where the angles were counted the other way."""
    for effect in EFFECTS.values():
        assert set(effect.signed_by_error) <= {one.name for one in effect.flat_declared() if isinstance(one, Quantity)}
    one = Parameter(0.3, 0.2, 0.5, "arcmin")
    found = as_counted({"amplitude_arcmin": one, "time_constant_s": one}, Term("thermal_drift", {}))
    assert (found["amplitude_arcmin"].low, found["amplitude_arcmin"].value) == (-0.5, -0.3)
    assert found["time_constant_s"] == one
