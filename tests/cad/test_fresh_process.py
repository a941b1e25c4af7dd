"""Exports in processes of their own: what a first export does, no earlier one can have prepared."""

from __future__ import annotations

import os
import re
import subprocess
import sys

import pytest

pytestmark = pytest.mark.slow

HDOPT = (sys.executable, "-c", "from hdopt.cli import main; main()")


@pytest.mark.parametrize(
    ("schema", "named"), [("AP214", "AUTOMOTIVE_DESIGN"), ("AP242", "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING")]
)
def test_first_export_of_a_process_has_its_schema_and_no_repeated_curves(schema, named, tmp_path):
    target = tmp_path / "wave.step"
    command = [*HDOPT, "export", "--step", str(target), "--set", f"export.step_schema={schema}"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    text = target.read_text(encoding="latin-1")
    assert re.search(r"FILE_SCHEMA\s*\(\s*\(\s*'" + named, text)
    assert "PCURVE" not in text and "SURFACE_CURVE" not in text.replace("SEAM_CURVE", "")


def test_earlier_file_is_replaced_with_a_word(tmp_path):
    target = tmp_path / "wave.dxf"
    command = [*HDOPT, "export", "--dxf", str(target)]
    first, second = (subprocess.run(command, capture_output=True, text=True, check=True).stdout for _ in range(2))
    assert "in place of an earlier file" not in first
    assert f"wrote and checked {target} (dxf), in place of an earlier file" in second


def test_two_processes_write_the_same_bytes(tmp_path):
    """Five parts have colours, the context's are seen through: the order of none may hang on addresses in memory."""
    kept = {}
    for run in ("first", "second"):
        target = tmp_path / f"{run}.step"
        command = [*HDOPT, "export", "--context", "--set", "export.step_schema=AP242", "--step", str(target)]
        moment = {**os.environ, "SOURCE_DATE_EPOCH": "1790000000"}
        subprocess.run(command, env=moment, capture_output=True, check=True)
        kept[run] = target.read_bytes()
    assert kept["first"] == kept["second"]
    assert b"'2026-09-21T14:13:20'" in kept["first"]
