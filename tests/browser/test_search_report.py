"""The trade report in a real browser, from a small search."""

from __future__ import annotations

from hdopt.study import load_study
from hdopt.workflow.run import run_study

SMALL = (
    'search.profiles=["ellipse", "two_disk"]',
    'search.structures=["automatic", "integral"]',
    "search.samples=256",
    "search.front_points=5",
)


def test_the_trade_report_is_drawn_hovered_and_printed(look_at, tmp_path):
    done = run_study(load_study("csf-25-80-design-trade", SMALL), tmp_path)
    findings = look_at(done.report)
    drawn = {"trade-front-nominal-figure", "trade-front-robust-figure", "trade-designs-parallel", "trade-map-figure"}
    assert drawn <= set(findings.figures)
    assert "Pressure angle" in findings.labels["trade-front-robust-figure"]
    assert (tmp_path / "csf-25-80-design-trade-chosen.toml").exists()
