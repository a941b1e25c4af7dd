"""Exports in processes of their own: what a first export does, no earlier one can have prepared."""

from __future__ import annotations

import os
import re
import subprocess
import sys

import pytest

from hdopt.cli import main
from hdopt.geometry.formats import FORMATS

pytestmark = pytest.mark.slow

HDOPT = (sys.executable, "-c", "from hdopt.cli import main; main()")


def assert_first_export(text: str, schema: str) -> None:
    """What only a first export of a process can get wrong: its schema, and curves that are written twice."""
    assert re.search(r"FILE_SCHEMA\s*\(\s*\(\s*'" + schema, text)
    assert "PCURVE" not in text and "SURFACE_CURVE" not in text.replace("SEAM_CURVE", "")


def test_first_export_of_a_process_has_its_schema_and_no_repeated_curves(tmp_path):
    """AP214 by the command; the processes below begin with AP242."""
    target = tmp_path / "wave.step"
    command = [*HDOPT, "export", "--step", str(target), "--set", "export.step_schema=AP214"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert_first_export(target.read_text(encoding="latin-1"), "AUTOMOTIVE_DESIGN")


def test_earlier_file_is_replaced_with_a_word(tmp_path, capsys):
    target = tmp_path / "wave.dxf"
    said = []
    for _ in range(2):
        with pytest.raises(SystemExit) as done:
            main(["export", "--dxf", str(target)])
        assert not done.value.code
        said.append(capsys.readouterr().out)
    first, second = said
    assert "in place of an earlier file" not in first
    assert f"wrote {target} (dxf, read back and checked, in place of an earlier file)" in second


WRITER = """
import sys
from pathlib import Path
import hdopt
from hdopt.geometry.formats import FORMATS
from hdopt.geometry.job import make_job
from hdopt.geometry.options import ExportOptions
job = make_job(hdopt.load_study("csf-25-80").drive, ExportOptions(context=True, step_schema="AP242"), "csf-25-80")
for kind, form in FORMATS.items():
    if kind != "png":
        form.write(Path(sys.argv[1]) / (kind + form.suffixes[0]), job)
"""


def test_two_processes_write_the_same_bytes(tmp_path):
    """Every format but the picture, which a library renders.

    Five parts have colours, the context's are seen through: the order of none may hang on addresses in memory or on the
    hashes of texts, and no file may have the clock or a random number.
    """
    assert next(iter(FORMATS)) == "step"
    kept = {}
    for run in ("1", "2"):
        folder = tmp_path / run
        folder.mkdir()
        moment = {**os.environ, "SOURCE_DATE_EPOCH": "1790000000", "PYTHONHASHSEED": run}
        subprocess.run([sys.executable, "-c", WRITER, str(folder)], env=moment, capture_output=True, check=True)
        kept[run] = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert len(kept["1"]) == len(FORMATS) - 1
    assert [name for name in kept["1"] if kept["1"][name] != kept["2"][name]] == []
    assert_first_export(kept["1"]["step.step"].decode("latin-1"), "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING")
    assert b"'2026-09-21T14:13:20'" in kept["1"]["step.step"]
    assert b"2026-09-21T14:13:20" in kept["1"]["dxf.dxf"]
