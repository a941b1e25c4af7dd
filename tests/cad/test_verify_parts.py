"""A run that writes parts is repeated by `--verify`, on whatever day: its files bear the moment of their writing."""

import json
import subprocess
import sys

import pytest


def hdopt(folder, *arguments):
    command = [sys.executable, "-m", "hdopt", "run", *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder)


@pytest.mark.slow
def test_parts_written_later_are_the_same_and_a_changed_one_is_told(tmp_path):
    """Would catch the second at which STEP and DXF, and with them the page, were written; and a mask over more."""
    made = hdopt(tmp_path, "csf-25-80", "-o", "out", "--set", 'study.steps=["geometry"]')
    assert made.returncode == 0, made.stderr
    drawing = tmp_path / "out" / "wave-generator.dxf"
    drawing.write_text(drawing.read_text().replace("\nLINE\n", "\nPOINT\n", 1))
    repeated = hdopt(tmp_path, "--verify", "out", "--json", "verified.json")
    assert repeated.returncode == 1, repeated.stderr
    said = json.loads((tmp_path / "verified.json").read_text())
    assert said["differing"] == ["wave-generator.dxf"] and "wave-generator.step" in said["same"]
