"""What a compensation says of how it is applied: sign, law, path, steps of a table, counters that were turned round."""

import json
import math

import numpy as np
import pandas as pd
import pytest

from hdopt.compensation.applied import how_counted
from hdopt.compensation.surface import AT_ONCE, Crossing
from hdopt.compensation.writers import written
from hdopt.recordings.read import recording_from_table
from hdopt.workflow.compensate import compensation_of
from tests.unit.test_compensation_parts import FOUND

RATIO, PER_TURN = 80.0, 20


def said_by(text, form):
    """What a file says of itself, by name."""
    if form == "json":
        return json.loads(text)
    return dict(line[2:].split(": ", 1) for line in text.splitlines() if line.startswith("# "))


def recorded(way):
    """81 input turns of 0.3 arcmin at order 2, by an output counter that counts `way` (+1 or -1) the input."""
    theta = np.arange(81 * PER_TURN) * 2 * np.pi / PER_TURN
    error = 0.3 * np.sin(2 * theta) + np.random.default_rng(1).normal(0, 0.01, len(theta))
    counts = way * (np.degrees(theta) / RATIO - error / 60)
    return recording_from_table(pd.DataFrame({"motor [deg]": np.degrees(theta), "load [deg]": counts}), RATIO)


@pytest.mark.parametrize("name", FOUND)
@pytest.mark.parametrize("form", ["csv", "json"])
def test_every_table_says_its_sign_its_law_and_its_path(name, form):
    """Fault caught: a sentence that the C file alone has."""
    said = said_by(written(FOUND[name], form, {}), form)
    assert said["use"].startswith("output = input/N - error")
    assert "half_return_arcmin path" in said["error"]
    law = "p = k input_rad + j output_rad" if "table" not in name and name != "large" else "of an input turn"
    assert law in said["error"]
    assert "1 forward, -1 backward" in said["path"]


@pytest.mark.parametrize("name", ["table", "large"])
def test_a_table_in_json_says_its_steps(name):
    """Fault caught: a bare matrix, or the steps of rows and columns exchanged."""
    said = json.loads(written(FOUND[name], "json", {}))
    inputs, outputs = np.shape(said["table_arcmin"])
    assert (said["input_step_deg"], said["output_step_deg"]) == (360 / inputs, 360 / outputs)
    assert f"i/{inputs} of an input turn" in said["error"]
    assert f"j/{outputs} of an output turn" in said["error"]


@pytest.mark.parametrize(
    ("crossing", "law", "moved", "path"),
    [
        (AT_ONCE, "is the sign of output_moved", 0.1, 1.0),
        (Crossing(0.5, 1.0, True), "grows by 2 output_moved/return_crossing_output_deg", 0.1, -1 + 2 * 0.1 / 0.5),
        (Crossing(0.5), "s + (path - s) exp(-|output_moved|/return_crossing_output_deg)", 0.1, 1 - 2 * math.exp(-0.2)),
    ],
)
def test_the_law_of_the_path_is_that_of_the_c_function(crossing, law, moved, path, tmp_path):
    """Compiled and asked after a move forward from -1. Fault caught: a law of another crossing, or of radians."""
    import ctypes
    import subprocess
    from dataclasses import replace

    found = replace(FOUND["terms"], back=0.1, crossing=crossing)
    assert law in said_by(written(found, "csv", {}), "csv")["path"]
    (tmp_path / "t.c").write_text(written(found, "c", {}))
    subprocess.run(["cc", "-shared", "-fPIC", "-o", tmp_path / "t.so", tmp_path / "t.c", "-lm"], check=True)
    function = ctypes.CDLL(str(tmp_path / "t.so")).hdopt_path
    function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double, ctypes.c_double]
    assert function(-1.0, math.radians(moved)) == pytest.approx(path)


@pytest.mark.parametrize("form", ["csv", "json", "c"])
def test_a_counter_that_was_turned_round_is_said_in_every_file(form):
    """Its own counts stand at minus what the table says. Fault caught: a table that a controller with that very counter
    adds where it should subtract."""
    recording = recorded(-1)
    # By the counter's own numbers: output = -(input/N - error).
    counts = -(recording.input_angle / RATIO - np.radians(recording.error_arcmin / 60))
    assert np.polyfit(recording.input_angle, counts, 1)[0] == pytest.approx(-1 / RATIO, rel=1e-3)
    made = compensation_of([recording], None, 8, 1)
    assert "in its own counts the output stands at -(input/N - error)" in written(made.found, form, made.facts())
    straight = compensation_of([recorded(1)], None, 8, 1)
    text = written(straight.found, form, straight.facts())
    assert "in its own counts" not in text
    assert "output = 'load [deg]' in deg" in text


def test_of_several_recordings_those_that_were_turned_are_named():
    one, other = recorded(1), recorded(-1)
    assert "turned" not in how_counted([one])
    assert "the output of table was counted" in how_counted([one, other])["turned"]
    assert "the output was counted" in how_counted([other, other])["turned"]
