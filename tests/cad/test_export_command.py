"""`hdopt export` from outside: JSON keys, tables, tolerances of an allocation, and what it does not import."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from hdopt.cli import main
from hdopt.study import load_study


def run(capsys, *arguments: str) -> tuple[int, str]:
    with pytest.raises(SystemExit) as stopped:
        main(["export", *arguments])
    return stopped.value.code, capsys.readouterr().out


def test_json_has_the_agreed_keys(tmp_path, capsys):
    target = tmp_path / "wave.step"
    code, out = run(capsys, "csf-25-80", "--step", str(target), "--json", "-")
    result = json.loads(out)
    assert code == 0
    assert result["file"] == str(target) and target.is_file()
    assert result["max_profile_deviation_um"] < 0.05
    cam = next(part for part in result["parts"] if part["name"] == "cam")
    # Table 1's ellipse less 3 mm of bearing all round: 2 (30.318 - 3), 2 (31.046 - 3), and the width.
    assert cam["bounding_box_mm"] == pytest.approx([54.636, 56.092, 9.0], abs=2e-6)
    assert cam["volume_mm3"] == pytest.approx(cam["expected_volume_mm3"], rel=1e-6)
    assert result["assumptions"]["export.bore_mm"] == 14.0


def test_nothing_is_written_without_a_file(capsys):
    code, out = run(capsys)
    assert code == 0 and "nothing written: give --step" in out
    assert "axis within diameter 0.015  [wg_eccentricity_mm]" in out
    assert "parallelism 0.01571 over 9  [wg_tilt_major_deg]" in out


SLIDE = "clearances.cross_slide_clearance_mm"


@pytest.mark.parametrize(("clearance", "code"), [(0.02, 1), (0.01, 0)])
def test_the_last_line_says_whether_the_budgets_are_kept(capsys, clearance, code):
    """e2 may be 0.0075 mm. Half of the slide's clearance is 0.01, and m5 in H6 lets the shaft lie 2 um aside; zones of
    0.5 um each for block and profile leave 0.0075 - 0.002 - 0.0005 = 0.005 mm."""
    asked = ("csf-25-80", "--structure", "one_way_major", "--set", f"{SLIDE}={clearance}")
    said = run(capsys, *asked, "--check")
    last = said[1].splitlines()[-1]
    assert said[0] == code
    if code:
        assert "the budget of wg_eccentricity is NOT KEPT: 0.0157 of 0.0075 mm; slot and block" in last
        assert last.endswith("takes 0.01 mm, 0.005 mm are left for it at most")
        assert run(capsys, *asked)[0] == 0
        assert json.loads(run(capsys, *asked, "--json", "-")[1])["budgets_kept"] is False
    else:
        assert last == "  all budgets are kept"


def test_given_values_are_not_called_assumed(capsys):
    code, out = run(capsys, "--set", "bore_mm=12", "--set", "chamfer_mm=0.3", "--json", "-")
    assumed = json.loads(out)["assumptions"]
    assert code == 0 and not {"export.bore_mm", "export.chamfer_mm"} & set(assumed) and "export.mount" in assumed


def test_tolerances_of_an_allocation(tmp_path, capsys):
    allocation = tmp_path / "allocation.json"
    allocation.write_text(json.dumps({"errors": {"wg_eccentricity_mm": {"tolerance": 0.002, "cost": 3.0}}}))
    _, out = run(capsys, "--allocation", str(allocation))
    assert "axis within diameter 0.004  [wg_eccentricity_mm]" in out
    allocation.write_text(json.dumps({"study": "other", "errors": {"wg_eccentricity_mm": {"tolerance": 0.002}}}))
    with pytest.raises(SystemExit) as stopped:
        main(["export", "--allocation", str(allocation)])
    assert stopped.value.code == 2 and "is of the study 'other', not of 'csf-25-80'" in capsys.readouterr().err
    allocation.write_text("{}")
    with pytest.raises(SystemExit) as stopped:
        main(["export", "--allocation", str(allocation)])
    assert stopped.value.code == 2 and "holds no tolerances" in capsys.readouterr().err


def test_contributors_take_the_place_of_the_errors_they_feed(tmp_path, capsys):
    study = tmp_path / "own.toml"
    study.write_text(
        'drive = "csf-25-80"\n[contributors]\n'
        'seat_runout = { callout = "total_runout", value_mm = 0.008, feeds = "wg_eccentricity" }\n'
        'housing = { callout = "coaxiality", value_mm = 0.02, feeds = "axis_eccentricity" }\n'
    )
    _, out = run(capsys, str(study))
    assert "total runout 0.008  [contributor seat_runout]" in out
    assert "axis within" not in out and "housing" not in out
    assert "[wg_tilt_major_deg]" in out


def test_python_call(tmp_path):
    import hdopt

    result = hdopt.export(load_study("csf-25-80"), {"step": tmp_path / "wave.step"})
    assert result.to_dict()["structure"] == "integral"


@pytest.mark.parametrize("code", ["import hdopt.cli.export", "import hdopt", "import hdopt.geometry.export"])
def test_cadquery_is_imported_only_when_solids_are_made(code):
    check = f"{code}; import sys; assert not {{'cadquery', 'OCP', 'ezdxf', 'vtkmodules'}} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", check], check=True)


def test_help_and_tables_do_without_cadquery():
    code = (
        "import sys\nfrom hdopt.cli import main\n"
        "try:\n    main(['export'])\nexcept SystemExit as stopped:\n    assert stopped.code == 0\n"
        "assert not {'cadquery', 'OCP'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
