"""The shipped studies' reports in a real browser."""

from __future__ import annotations

import pytest

from hdopt.run import run_study
from hdopt.study import load_study


@pytest.mark.parametrize("name", ["csf-25-80", "paper-reproduction"])
def test_the_report_of_a_shipped_study(name, look_at, tmp_path):
    findings = look_at(run_study(load_study(name), tmp_path).report)
    assert len(findings.figures) >= 9
