"""`hdopt explore`: the page's data from a study; what the page then does is tested in a browser."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from click.testing import CliRunner

import hdopt
from hdopt.cli.app import cli
from hdopt.drive.errors import STUDY_KEYS
from hdopt.kinematics.peak_to_peak import matrix_peak_to_peak_arcmin
from hdopt.study import load_study
from hdopt.workflow.explore import CLOUD_N, explore, explorer_page


def data_of(page):
    return json.loads(re.search(r'id="explorer-data">(.*?)</script>', page).group(1))


@pytest.fixture(scope="module")
def shipped():
    return data_of(explorer_page(load_study("csf-25-80"), 64).html)


def test_every_error_has_a_slider_that_starts_at_the_study(shipped):
    study = load_study("csf-25-80")
    sliders = {one["key"]: one for one in shipped["parameters"]}
    assert set(sliders) == {*STUDY_KEYS, "pressure_angle_deg", "width_mm", "wrap_angle_deg"}
    for key in STUDY_KEYS:
        assert sliders[key]["value"] == study.data["errors"][key]
        assert sliders[key]["low"] <= sliders[key]["value"] <= sliders[key]["high"]
    assert sliders["pressure_angle_deg"]["value"] == 12  # not 12.000000000000002
    assert sliders["wg_tilt_major_deg"]["low"] == -sliders["wg_tilt_major_deg"]["high"] == pytest.approx(-0.3, abs=0.01)
    assert [one["value"] for one in shipped["choices"]] == ["ellipse", "integral"]


def test_the_cloud_is_the_stack_of_the_tolerances(shipped):
    errors, peaks = np.array(shipped["cloud"]["errors"]), np.array(shipped["cloud"]["peak_to_peak"])
    assert errors.shape == (64, 12)
    rows = errors * np.array([1.0 if key.endswith("_mm") else np.pi / 180 for key in STUDY_KEYS])
    # errors are written in five digits
    assert peaks == pytest.approx(matrix_peak_to_peak_arcmin(load_study("csf-25-80").drive, rows), rel=2e-4)
    found = hdopt.stack("csf-25-80", 2**14).stack
    # four standard errors of a mean of 64 independent drives; those of Sobol' points are smaller
    assert peaks.mean() == pytest.approx(found.mean.value, abs=4 * found.std.value / 8)
    tolerances = load_study("csf-25-80").data["tolerances"]
    for column, key in enumerate(STUDY_KEYS):
        row = tolerances[key]
        assert errors[:, column].max() <= row["upper"]
        assert errors[:, column].min() >= row.get("lower", 0)


def test_the_same_seed_gives_the_same_page_and_another_a_different_one():
    study = load_study("csf-25-80")
    pages = [explorer_page(study, 16, seed).html for seed in (0, 0, 1)]
    assert pages[0] == pages[1] != pages[2]


def test_a_study_without_tolerances_has_a_page_without_a_cloud(tmp_path):
    text = """
[drive]
flexspline_teeth = 100
circular_spline_teeth = 102
module_mm = 0.5
pressure_angle_deg = 20
flexspline_inner_radius_mm = 24.0
[wave_generator]
width_mm = 8.0
"""
    (tmp_path / "own.toml").write_text(text)
    result = explore(tmp_path / "own.toml", tmp_path / "page.html")
    assert result.drives == 0
    assert result.notes == ("There is no cloud of drives: the study has no [tolerances] and no [requirement].",)
    data = data_of(result.file.read_text())
    assert data["cloud"] is None
    assert data["requirement"] is None
    assert data["command"] == "own.toml"
    assert str(tmp_path) not in result.file.read_text()


def test_effects_are_said_to_be_left_out(tmp_path):
    (tmp_path / "with.toml").write_text(
        'drive = "csf-25-80"\n[effects.lost_motion]\nlost_motion_arcmin = 0.3\ncrossing_arcmin = 0.3\n'
    )
    result = explore(tmp_path / "with.toml", tmp_path / "page.html", 4)
    assert result.notes == ("Left out here are the study's effects: Lost motion.",)
    assert result.notes[0] in result.file.read_text().replace("&#39;", "'")


def test_what_the_closed_form_does_not_know_is_refused(tmp_path):
    phi = np.arange(0, 360, 5.0)
    rows = "\n".join(f"{angle},{30.65 + 0.396 * np.cos(np.radians(2 * angle))}" for angle in phi)
    (tmp_path / "cam.csv").write_text(rows)
    wave_generator = '[wave_generator]\nprofile = "measured"\nfile = "cam.csv"\nsurface = "bearing"\n'
    (tmp_path / "cam.toml").write_text(f'drive = "csf-25-80"\n{wave_generator}')
    with pytest.raises(hdopt.HdoptError, match=r"needs smooth tips, and this profile is measured; take --set wave"):
        explore(tmp_path / "cam.toml", tmp_path / "page.html")
    teeth = "\n".join(f"{tooth},right,{0.5 * np.sin(tooth)}" for tooth in range(1, 163))
    (tmp_path / "teeth.csv").write_text(f"tooth,flank,fp_um\n{teeth}\n")
    (tmp_path / "teeth.toml").write_text(
        'drive = "csf-25-80"\n[cs_teeth]\nfile = "teeth.csv"\ndeviation = "cumulative"\n'
    )
    with pytest.raises(hdopt.HdoptError, match=r"this study has teeth measured one by one; take a study without"):
        explore(tmp_path / "teeth.toml", tmp_path / "page.html")
    assert not (tmp_path / "page.html").exists()


@pytest.mark.parametrize("n", [0, -3, 20_001])
def test_a_cloud_of_no_drives_or_too_many_is_refused(n):
    with pytest.raises(hdopt.HdoptError, match=f"the cloud has {n} drives; give 1 to 20000"):
        explorer_page(load_study("csf-25-80"), n)


def test_the_command_writes_the_page_and_says_so(tmp_path):
    page, answer = tmp_path / "page.html", tmp_path / "answer.json"
    arguments = ["explore", "csf-25-80", "--set", "width_mm=8", "-n", "16", "-o", str(page), "--json", str(answer)]
    done = CliRunner().invoke(cli, arguments, standalone_mode=False)
    assert done.exit_code == 0
    assert "explorer with a cloud of 16 drives" in done.output
    said = json.loads(answer.read_text())
    assert said["file"] == str(page)
    assert said["drives"] == 16 != CLOUD_N
    data = data_of(page.read_text())
    assert data["command"] == "csf-25-80 --set width_mm=8"
    assert next(one for one in data["parameters"] if one["key"] == "width_mm")["value"] == 8


def test_the_study_that_the_page_copies_has_no_empty_section():
    """Would catch '[export]' without a key at the end of what is copied."""
    text = data_of(explorer_page(load_study("csf-25-80"), 4).html)["toml"]
    assert "[drive]" in text and not re.search(r"^\[\w+\]\s*(\Z|\n\s*\[)", text, re.M)
