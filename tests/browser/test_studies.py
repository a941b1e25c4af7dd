"""The report of a shipped study in a real browser."""

from __future__ import annotations

from effect_examples import toml

from hdopt.study import load_study
from hdopt.workflow.run import run_study


def test_the_report_of_the_csf_25_80(look_at, shipped_run):
    findings = look_at(shipped_run.folder / "report.html")
    assert len(findings.figures) >= 13


def test_the_report_of_a_drive_with_effects(look_at, tmp_path):
    effects = {
        "lost_motion": {"lost_motion_arcmin": 0.3, "crossing_arcmin": 0.3},
        "circular_spline_lobing": {"lobes": 6, "radial_amplitude_um": 8.0, "phase_deg": 10.0},
    }
    text = toml(effects, {"motion": "both"}) + '[study]\nsteps = ["effects", "waveform", "orders"]\n'
    (tmp_path / "extended.toml").write_text(text)
    findings = look_at(run_study(load_study(tmp_path / "extended.toml"), tmp_path / "out").report)
    assert len(findings.figures) == 6
