"""`hdopt search` from the outside: JSON keys, exit statuses, words."""

from __future__ import annotations

import json

import pytest

import hdopt
from hdopt.cli import main

SMALL = ("--set", 'search.profiles=["ellipse"]', "--set", 'search.structures=["automatic"]')


def run(capsys, *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as ended:
        main(["search", *arguments])
    written = capsys.readouterr()
    return ended.value.code, written.out, written.err


def test_json_has_the_keys_others_read_and_nothing_else_is_printed(capsys):
    status, out, _ = run(capsys, "csf-25-80", *SMALL, "--set", "search.front_points=3", "--json", "-")
    found = json.loads(out)
    assert status == 0
    assert {"best", "front", "evaluations", "algorithm", "stopped_because"} <= set(found)
    assert len(found["front"]) >= 3
    assert found["stopped_because"].startswith("converged")
    assert found["best"]["quantities"]["peak_to_peak_arcmin"] < 1.0


def test_a_person_reads_what_the_limits_cost(capsys):
    status, out, _ = run(capsys, "csf-25-80", *SMALL, "--no-fronts")
    assert status == 0
    assert "held by" in out
    # A narrower generator carries the same torque on less face: the pressure of the design as it was holds it.
    assert "Mean flank pressure at most 9.046 MPa" in out
    assert "not modelled: tooth separation" in out


def test_no_design_is_status_1(capsys):
    limits = "search.limits={peak_to_peak_arcmin={max=0.05}}"
    status, out, _ = run(capsys, "csf-25-80", *SMALL, "--set", limits, "--set", 'search.objective="width_mm"')
    assert status == 1
    assert "flank_pressure_mpa: empty, as no design was found that meets all limits" in out
    assert "hypervolume" not in out
    assert "no design meets all limits" in out
    assert "Peak-to-peak at most 0.05 arcmin" in out


def test_unusable_input_is_status_2_with_the_place(capsys):
    status, out, err = run(capsys, "csf-25-80", "--set", 'search.profiles=["elipse"]')
    assert status == 2
    assert out == ""
    assert "search.profiles" in err
    assert "Traceback" not in err


def test_the_best_design_is_judged_and_written(capsys, tmp_path):
    """Would catch a verdict on another number than the best design's, and a study that is not the one chosen."""
    file = tmp_path / "chosen.toml"
    status, out, _ = run(capsys, "csf-25-80", *SMALL, "--no-fronts", "--write-study", str(file), "--json",
                         str(tmp_path / "found.json"))  # fmt: skip
    found = json.loads((tmp_path / "found.json").read_text())
    assert status == 0
    assert out.splitlines()[-1].startswith("requirement met: peak-to-peak, best design 0.")
    value = found["requirement"]["value"]
    assert value == found["best"]["quantities"]["peak_to_peak_arcmin"]
    # written to a nanometre and read back; the kernel's closed form against the exact geometry
    assert hdopt.kinematic_error(file).peak_to_peak_arcmin == pytest.approx(value, abs=1e-3)
    missed = "requirement.peak_to_peak_arcmin=0.1"
    status, out, _ = run(capsys, "csf-25-80", *SMALL, "--no-fronts", "--set", missed, "--check")
    assert status == 1 and "requirement missed" in out


def test_the_broken_limits_of_every_combination_are_named(capsys, tmp_path):
    limits = "search.limits={peak_to_peak_arcmin={max=0.05}}"
    file = tmp_path / "chosen.toml"
    objective = ("--set", 'search.objective="width_mm"')
    status, out, _ = run(
        capsys, "csf-25-80", *SMALL, "--no-fronts", "--set", limits, *objective, "--write-study", str(file)
    )
    assert status == 1 and not file.exists()
    assert "breaks Peak-to-peak at most 0.05 arcmin" in out
    assert "not written, as no design keeps the limits" in out
