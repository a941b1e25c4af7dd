"""Every command has its Python call: the same work, the same options, the same files."""

import inspect
import json
from importlib import import_module
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import hdopt
from hdopt.cli.app import COMMANDS
from hdopt.geometry.formats import FORMATS
from hdopt.tolerance.distributions import Normal, Rayleigh

CALLS = {
    "new": ("new_study",),
    "check": ("check_study",),
    "ke": ("kinematic_error",),
    "profile": ("profile",),
    "stack": ("stack",),
    "sobol": ("sobol", "screen"),
    "allocate": ("allocate",),
    "inspect": ("inspect", "inspect_many"),
    "compensate": ("compensate",),
    "diagnose": ("diagnose", "diagnose_many"),
    "search": ("search",),
    "export": ("export",),
    "compare": ("compare",),
    "explore": ("explore",),
    "run": ("run_study", "verify_run"),
    "studies": ("shipped_studies",),
}
"""Command -> the calls of `hdopt` that do its work."""

OF_A_STUDY = {"drive": "load_study(drive=...)", "overrides": "study.with_(...)", "structure": "study.with_(...)"}
OF_RECORDINGS = {"ratio": "recorded_drive", "columns": "recorded_drive", "bench_file": "recorded_drive"}
EVERYWHERE = {"json_file": "result.to_dict()", "engine": "engine_in_force"}
OTHERWISE = {
    "new": {},
    "check": {},
    "ke": OF_A_STUDY | {"seed": "nothing is random"},
    "profile": OF_A_STUDY | {"profile": "study.with_(profile=...)", "seed": "nothing is random"},
    "stack": OF_A_STUDY | {"resume": "engine", "geometry": "study_problem(study).by(...)"},
    "sobol": OF_A_STUDY | {"no_second_order": "second_order"},
    "allocate": OF_A_STUDY,
    "inspect": OF_RECORDINGS
    | dict.fromkeys(("report_file", "bench_out"), "files")
    | {"each": "inspect_many", "resume": "engine", "serial": "label", "conditions": "label", "check": "result.missed"},
    "compensate": OF_RECORDINGS | {"output": "files", "form": "files"},
    "diagnose": OF_RECORDINGS
    | dict.fromkeys(("report_file", "study_file"), "files")
    | {"each": "diagnose_many", "resume": "engine"},
    "search": OF_A_STUDY | {"study_file": "files"},
    "export": OF_A_STUDY
    | {f"file_{kind}": "files" for kind in FORMATS}
    | {"context": "study.with_(context=...)", "allocation": "tolerances", "seed": "nothing is random"},
    "compare": OF_A_STUDY
    | dict.fromkeys(("plot", "write_study"), "files")
    | {"cam": "measured", "seed": "nothing is random"},
    "explore": OF_A_STUDY,
    "run": OF_A_STUDY | {"verify": "verify_run"},
    "studies": {},
}
"""Option -> how the call says it, where it is not an argument of the same name."""


def exposed(command):
    """The options of a command that its function is given, by their names in Python."""
    params = import_module(f"hdopt.cli.{command}").command.params
    return {param.name for param in params if param.expose_value}


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_its_call_with_every_option(command):
    """Fails for a command without a call, and for an option that no argument of its calls says."""
    calls = [getattr(hdopt, name) for name in CALLS[command]]
    arguments = {name for call in calls for name in inspect.signature(call).parameters}
    said = set(OTHERWISE[command]) | set(EVERYWHERE)
    assert exposed(command) <= arguments | said
    for call in calls:
        types = call.__annotations__
        assert set(types) == {*inspect.signature(call).parameters, "return"}, f"{call.__name__} is not fully typed"
        assert "Any" not in types.values()


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_and_its_calls_are_in_the_guide(command):
    guide = (Path(__file__).parents[2] / "docs" / "python.md").read_text()
    rows = [line for line in guide.splitlines() if line.startswith(f"| `{command}` |")]
    assert len(rows) == 1
    assert all(f"hdopt.{name}" in rows[0] for name in CALLS[command])


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Eight turns there and back of the shipped drive, 0.5 arcmin of play hidden in noise of 0.01."""
    study = hdopt.load_study("csf-25-80")
    there = np.arange(8 * 60) * 2 * np.pi / 60
    theta = np.r_[there, there[::-1]]
    from hdopt.kinematics.waveform import kinematic_error_arcmin

    error = kinematic_error_arcmin(study.drive, study.errors, theta) + 0.25 * np.repeat([1.0, -1.0], len(there))
    error += np.random.default_rng(0).normal(0, 0.01, len(theta))
    table = {"time_s": np.arange(len(theta)) * 0.1, "input_angle_deg": np.degrees(theta)}
    table["output_angle_deg"] = np.degrees(theta) / 80 - error / 60
    file = tmp_path_factory.mktemp("bench") / "run.csv"
    pd.DataFrame(table).to_csv(file, index=False)
    return file


@pytest.mark.slow
def test_diagnose_from_python_writes_what_the_command_writes(recording, tmp_path):
    """Verdict, report and written study: byte for byte those of `hdopt diagnose --report --write-study`. Both search by
    themselves, so the same seed gives the same answer twice."""
    from hdopt.cli import main

    files = {"report": tmp_path / "python.html", "study": tmp_path / "python.toml"}
    found = hdopt.diagnose(recording, "csf-25-80", files=files)
    with pytest.raises(SystemExit) as end:
        main(["diagnose", str(recording), "--report", str(tmp_path / "cli.html"), "--write-study",
              str(tmp_path / "cli.toml"), "--json", str(tmp_path / "cli.json")])  # fmt: skip
    assert end.value.code == 0
    said = json.loads((tmp_path / "cli.json").read_text())
    ours = json.loads(json.dumps(found.to_dict()))
    assert {key: said[key] for key in ours} == ours
    for ending in ("html", "toml"):
        assert (tmp_path / f"python.{ending}").read_bytes() == (tmp_path / f"cli.{ending}").read_bytes()
    assert [effect.id for effect in hdopt.load_study(files["study"]).effects] == [one.id for one in found.effects]


def test_a_file_that_cannot_be_written_is_said_before_the_work(recording, tmp_path, monkeypatch):
    monkeypatch.setattr("hdopt.workflow.diagnose.diagnose_records", lambda *given: pytest.fail("worked in vain"))
    with pytest.raises(hdopt.HdoptError, match="nowhere"):
        hdopt.diagnose(recording, "csf-25-80", files={"report": tmp_path / "nowhere" / "page.html"})
    with pytest.raises(hdopt.HdoptError, match="unknown file to write"):
        hdopt.diagnose(recording, "csf-25-80", files={"reprot": tmp_path / "page.html"})
    with pytest.raises(hdopt.HdoptError, match="give `drive` as a study"):
        hdopt.diagnose(recording, hdopt.load_study().drive, files={"study": tmp_path / "fitted.toml"})


@pytest.mark.slow
def test_inspect_and_compensate_take_every_form_of_a_drive_alike(recording, tmp_path):
    study = hdopt.load_study("csf-25-80")
    forms = ["csf-25-80", study, study.drive, hdopt.recorded_drive("csf-25-80")]
    limits = {"peak_to_peak": 1.0}
    sheets = [hdopt.inspect(recording, form, limits).to_dict() for form in forms]
    assert all(sheet == sheets[0] for sheet in sheets)
    hdopt.inspect([recording], study, files={"csv": tmp_path / "sheet.csv", "bench": tmp_path / "bench.toml"})
    again = hdopt.recorded_drive("csf-25-80", bench=tmp_path / "bench.toml")
    assert hdopt.inspect(recording, again, limits).rms == pytest.approx(sheets[0]["rms_arcmin"])
    either = [recording, hdopt.read_recording(recording, 80.0)]
    of_file, of_record = (hdopt.inspect_many([one], "csf-25-80", limits) for one in either)
    assert of_file.drives == of_record.drives
    made = hdopt.compensate(recording, "csf-25-80", 8, files={"json": tmp_path / "table.json"})
    assert made.worth == (tmp_path / "table.json").exists()


@pytest.mark.slow
def test_a_stack_of_records_is_the_stack_of_the_study(tmp_path):
    """The same drive and distributions as records and as a study file: the same sample to the last bit."""
    study = hdopt.load_study("csf-25-80")
    tolerances = {
        "axis_eccentricity_mm": Rayleigh(scale=0.003, upper=0.01),
        "axis_tilt_x_deg": Normal(std=0.03, lower=-0.1, upper=0.1),
    }
    records = hdopt.ToleranceProblem.of_drive(study.drive, tolerances, 1.0, errors=study.errors)
    rows = {
        "axis_eccentricity_mm": {"distribution": "rayleigh", "scale": 0.003, "upper": 0.01},
        "axis_tilt_x_deg": {"distribution": "normal", "std": 0.03, "lower": -0.1, "upper": 0.1},
    }
    of_file = study.with_({"tolerances": rows, "requirement.peak_to_peak_arcmin": 1.0, "contributors": {}})
    ours, theirs = hdopt.stack(records, 2**12).stack, hdopt.stack(of_file, 2**12).stack
    assert ours.to_dict() == theirs.to_dict()
    first, second = hdopt.sobol(records, 2**9), hdopt.sobol(of_file, 2**9)
    assert first.sobol is not None and second.sobol is not None
    assert first.sobol.to_dict() == second.sobol.to_dict()
