"""The cam as a STEP file, written and checked: under 2 s beyond CadQuery's own import."""

from __future__ import annotations

import subprocess
import sys

import cases
import pytest

LIMIT = 2.0
"""Seconds, the promise: a first export in a fresh process, with everything it imports besides CadQuery.

The export runs on one thread, so processor time is what an idle machine takes, whatever else runs beside the test.
"""

FRESH = """
import time
import cadquery
start = time.process_time()
from hdopt.cli import cli
cli.main(["export", "csf-25-80", "--set", "hub=false", "--step", {path!r}, "--json", {json!r}], standalone_mode=False)
print(time.process_time() - start)
"""


def test_first_export_of_a_cam(tmp_path):
    script = FRESH.format(path=str(tmp_path / "cam.step"), json=str(tmp_path / "cam.json"))
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert float(done.stdout.split()[-1]) < LIMIT


@pytest.mark.benchmark(group="cam STEP, written and checked")
def test_export_of_a_cam(benchmark, tmp_path):
    from hdopt.geometry.export import export_drive
    from hdopt.study.export import ExportSection

    target = tmp_path / "cam.step"
    benchmark(export_drive, cases.drive(), {"step": target}, ExportSection(hub=False))
    assert target.is_file()
