"""One file dropped in is a whole effect: in a study, `ke`, `stack`, `diagnose`, the JSON, the report and the docs."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from hdopt.drive.geometry import ARCMIN
from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.study import load_study

ID = "windage_drag"
COMMAND = "from hdopt.cli import main; main()"
TOY = '''
"""Drag of the air on the load, that winds the output up: a power of speed, against the motion."""

import numpy as np

from hdopt.effects.base import Effect
from hdopt.effects.declared import Quantity

RATED = 10.0  # rad/s


class WindageDrag(Effect):
    id = "windage_drag"
    domain = "speed"
    separating = "run the joint in a vacuum, or without its cover"
    shifts_one_way = True
    needs = {"speed": "speed_rpm"}
    declared = (
        Quantity("drag_arcmin", "arcmin", "at 10 rad/s of the input", "d", (-2.0, 2.0), scale=1.0),
        Quantity("exponent", "1", "power of speed", "p", (1.5, 3.0), above=0.0),
    )
    examples = ({"drag_arcmin": 0.2, "exponent": 2.0},)

    def columns(self, conditions, shape):
        speed = conditions.known_speed / RATED
        return (np.sign(speed) * np.abs(speed) ** shape["exponent"])[:, None]
'''

STUDY = f"""drive = "csf-25-80"
[operation]
motion = "both"
speed_rpm = 95.49296585513721
include = "drive"
[effects.{ID}]
drag_arcmin = 0.2
exponent = 2.0
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("dropped")
    (made / "effects").mkdir()
    (made / "effects" / "windage_drag.py").write_text(TOY)
    (made / "study.toml").write_text(STUDY)
    return made


def run(folder, *arguments, python=False):
    """A command with the one file dropped in; its standard output."""
    command = ["-c", *arguments] if python else ["-c", COMMAND, *arguments]
    environment = os.environ | {"HDOPT_EFFECTS": str(folder / "effects")}
    done = subprocess.run([sys.executable, *command], capture_output=True, text=True, env=environment, cwd=folder)
    assert done.returncode == 0, done.stderr
    return done.stdout


def recording(folder):
    """Two hundred speeds there and back, the drag on the drive's own error, and noise of 0.01 arcmin."""
    rng = np.random.default_rng(4)
    study = load_study(drive="csf-25-80")
    time = np.arange(0, 60, 0.02)
    half = len(time) // 2
    speed = 8 + 6 * np.sin(2 * np.pi * time / 17)
    speed[half:] *= -1
    theta = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * 0.02)])
    error = kinematic_error_arcmin(study.drive, study.errors, theta) + rng.normal(0, 0.01, len(theta))
    error = error + 0.2 * np.sign(speed) * (np.abs(speed) / 10) ** 2.3
    output = theta / 80 - error * ARCMIN
    path = folder / "recording.csv"
    pd.DataFrame({"time_s": time, "input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(output)}).to_csv(
        path, index=False, float_format="%.9f"
    )
    return path


def test_without_the_file_nobody_knows_it(folder):
    environment = {key: value for key, value in os.environ.items() if key != "HDOPT_EFFECTS"}
    command = [sys.executable, "-c", COMMAND, "ke", "study.toml"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=folder)
    assert done.returncode == 2
    assert f"effects.{ID}: unknown key '{ID}'" in done.stderr


def test_a_study_and_ke_know_it(folder):
    told = json.loads(run(folder, "ke", "study.toml", "--json", "-"))
    (effect,) = told["effects"]
    assert (effect["id"], effect["origin"], effect["counted"]) == (ID, "drive", True)
    assert effect["parameters"] == {"drag_arcmin": 0.2, "exponent": 2.0}
    # At rated speed 0.2 arcmin each way: both passes lie 0.4 apart.
    assert effect["adds_arcmin"] == pytest.approx(0.4, abs=1e-6)


@pytest.mark.slow
def test_stack_counts_it(folder):
    """Drive by drive, beside the error: 200 drives show it as 2000 do, for which the default yield would ask."""
    few = ("stack", "study.toml", "-n", "200", "--set", "requirement.yield=0.9", "--json", "-")
    bare = json.loads(run(folder, *few, "--set", "operation.include=none"))
    told = json.loads(run(folder, *few))
    assert told["mean_arcmin"] == pytest.approx(bare["mean_arcmin"] + 0.4, abs=2e-3)


@pytest.mark.slow
def test_diagnose_names_it_with_its_numbers(folder):
    path = recording(folder)
    told = json.loads(
        run(folder, "diagnose", str(path), "--drive", "csf-25-80", "--json", "-", "--report", "report.html")
    )
    assert told["verdict"] in ("named", "ambiguous")
    assert [effect["id"] for effect in told["effects"]] == [ID]
    numbers = told["effects"][0]["parameters"]
    # Half of the numbers' own 95 % interval is 2 sigma: three sigma are asked.
    for name, value in {"drag_arcmin": 0.2, "exponent": 2.3}.items():
        found = numbers[name]
        assert abs(found["value"] - value) < 0.75 * (found["high"] - found["low"])
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "Windage drag" in page and "exponent" in page


def test_the_docs_table_has_it(folder):
    page = Path(__file__).parents[2] / "docs" / "conventions.md"
    code = (
        "import pathlib, sys; from hdopt.workflow.effect_docs import renewed; "
        f"sys.stdout.write(renewed(pathlib.Path({str(page)!r}).read_text()))"
    )
    assert f"| `{ID}` | `drag_arcmin`; `exponent` | beside | drive | speed |" in run(folder, code, python=True)


def test_the_docs_tables_are_those_of_the_catalogue():
    from hdopt.workflow.effect_docs import renewed

    page = (Path(__file__).parents[2] / "docs" / "conventions.md").read_text(encoding="utf-8")
    assert renewed(page) == page, "renew with: python -m hdopt.workflow.effect_docs docs/conventions.md"
