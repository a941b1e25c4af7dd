"""The report of a shipped study in a real browser."""

from __future__ import annotations

from hdopt.run import run_study
from hdopt.study import load_study


def test_the_report_of_the_csf_25_80(look_at, tmp_path):
    findings = look_at(run_study(load_study("csf-25-80"), tmp_path).report)
    assert len(findings.figures) >= 13
