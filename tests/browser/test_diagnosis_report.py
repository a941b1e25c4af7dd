"""The diagnosis report in a real browser: a delay over two speeds, which has a picture for nearly every domain."""

from __future__ import annotations

import pytest

from hdopt.diagnosis import diagnose
from hdopt.report.html import write_report
from hdopt.report.sections.diagnosis import diagnosis_report
from hdopt.study import load_study
from tests.unit.test_diagnosis import HIDDEN, bench


@pytest.mark.slow
def test_the_diagnosis_report_is_drawn_hovered_and_printed(look_at, tmp_path):
    study = load_study(drive="csf-25-80")
    records = bench(study, HIDDEN["channel_delay"], turns=8, speeds=(1.0, 5.0))
    diagnosis = diagnose(records, study.drive)
    findings = look_at(write_report(diagnosis_report(diagnosis, ["slow", "fast"]), tmp_path))
    assert {
        "diagnosis-heldout",
        "diagnosis-conditions",
        "diagnosis-waveform",
        "diagnosis-spectrum",
        "diagnosis-speed",
        "diagnosis-reversal",
    } <= set(findings.figures)
