"""Exports in processes of their own: what a first export does, no earlier one can have prepared."""

from __future__ import annotations

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
