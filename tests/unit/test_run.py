"""`hdopt run` and its steps: every step builds its section from a study, and says what it cannot do."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from cases import drive
from test_report import files_in

from hdopt.drive.geometry import Structure
from hdopt.errors import HdoptError, MissingLibrary
from hdopt.kinematics import peak_to_peak_arcmin
from hdopt.kinematics.extremes import converged_peak_to_peak_arcmin
from hdopt.report.sections.words import percent
from hdopt.study import load_study, shipped_studies
from hdopt.workflow.requirement import of_run
from hdopt.workflow.run import run_study, steps_of
from hdopt.workflow.run_verdict import section_of_run
from hdopt.workflow.steps import Context, find_step
from hdopt.workflow.steps.design import map_arcmin, sensitivities, with_width
from hdopt.workflow.steps.profiles import alternatives, profiles
from hdopt.workflow.steps.structures import structures

MINIMAL = """
[drive]
flexspline_teeth = 100
circular_spline_teeth = 102
module_mm = 0.5
pressure_angle_deg = 20
flexspline_inner_radius_mm = 24.0
[wave_generator]
width_mm = 8.0
[errors]
axis_eccentricity_mm = 0.01
axis_eccentricity_direction_deg = 30
"""

CONTEXT = Context(Path("unused"))


@pytest.fixture(scope="module")
def study():
    return load_study("csf-25-80")


@pytest.fixture
def minimal(tmp_path):
    (tmp_path / "minimal.toml").write_text(MINIMAL)
    return load_study(tmp_path / "minimal.toml")


def test_a_run_leaves_a_page_its_numbers_and_the_results_of_each_step(study, shipped_run):
    folder = shipped_run.folder
    assert shipped_run.result["report"] == str(folder / "report.html")
    results = json.loads((folder / "results.json").read_text())
    assert list(results["steps"]) == list(steps_of(study)[1])
    assert results["steps"]["waveform"]["peak_to_peak_arcmin"] == pytest.approx(
        converged_peak_to_peak_arcmin(study.drive, study.errors)
    )
    assert (folder / "orders-table.csv").is_file()
    assert study.title in (folder / "report.html").read_text()


def headings(page: str) -> list[str]:
    return re.findall(r'<h2[^>]*><span class="number">\d+</span>([^<]+)</h2>', page)


def test_the_page_begins_with_the_verdict_and_ends_with_the_inputs(tmp_path):
    """And tells nothing of the folder that it was written to: it is handed round."""
    steps = 'steps = ["waveform", "structures", "explorer"]'
    own = "[load] # see [[mine]]\n[wave_generator]\nwidth_mm = 9.0 # by caliper\n"
    (tmp_path / "mine.toml").write_text(f'drive = "csf-25-80"\n{own}[study]\n{steps}\n')
    study = load_study(tmp_path / "mine.toml")
    page = run_study(study, tmp_path / "out").report.read_text()
    shown = headings(page)
    assert shown[0] == "Verdict"
    assert shown[-2:] == ["Explorer", "Inputs"]
    said = "The drive in [errors] has 1.369 arcmin peak-to-peak, 1 arcmin is allowed: 0.369 arcmin too much."
    assert f'<p class="ruling missed"><b>Missed.</b> {said}</p>' in page
    assert "one-way, major axis, 1.062 arcmin" in page
    inside = files_in(page)
    (tmp_path / "again.toml").write_bytes(inside["mine.toml"])
    assert load_study(tmp_path / "again.toml").data == study.data
    # what the study file says of its numbers, and what ships says of the others
    assert b"width_mm = 9.0 # by caliper\n" in inside["mine.toml"] and b"# assumed" in inside["mine.toml"]
    assert "by caliper</td>" in page and "The base case of Jia 2021, Table 2." in page
    assert "See [ [mine]]." in page, "a comment is no reference to a figure of the page"
    assert inside["explorer.html"] == (tmp_path / "out" / "explorer.html").read_bytes()
    assert not any(str(tmp_path).encode() in content for content in inside.values())
    assert str(tmp_path) not in page


def test_a_verdict_on_many_drives_says_what_the_one_drive_is():
    """A single drive above the limit beside a yield that is met looks like a contradiction; the page explains it."""
    found = {
        "stack": {
            "yield": {"value": 0.99871},
            "required_yield": 0.9973,
            "limit_arcmin": 1.0,
            "quantiles": {"0.9973": {"value": 0.98765}},
            "contributions": {"wg_tilt_major_deg": 0.2, "cs_tooth_amplitude_mm": 0.7, "axis_tilt_x_deg": 0.001},
        },
        "waveform": {"peak_to_peak_arcmin": 1.369, "required_arcmin": 1.0},
    }
    section = section_of_run(of_run(load_study("csf-25-80"), found), found)
    ruling, points = section.items
    assert ruling.met
    assert (
        ruling.text.replace("\u00a0", " ")
        == "99.87 % of drives to these tolerances stay within 1 arcmin; 99.73 % must."
    )
    said = " ".join(points.sentences)
    assert "stay below 0.9877 arcmin, 0.0123 arcmin below the limit" in said
    assert "CS tooth amplitude (70 %) and WG tilt major (20 %)" in said
    assert "It is one example" in said
    assert section_of_run(None, found) is None
    allocation = {"status": "not verified", "total_cost": 12.0, "verified_yield": {"value": 0.98}}
    for status, words in (("verified", "tolerances that keep it cost 12"), ("not verified", "only 98")):
        told = {**found, "allocate": {**allocation, "status": status}}
        said = " ".join(section_of_run(of_run(load_study("csf-25-80"), told), told).items[1].sentences)
        assert words in said.replace("\u00a0", " ")
        assert ("keep it" in said) == (status == "verified")
    parts = section_of_run(of_run(load_study("csf-25-80"), found), {"stack": {**found["stack"], "method": None}})
    said = parts.items[0].text + " ".join(parts.items[1].sentences)
    assert "assemblies" in said and "drives" not in said, "a stack of dimensions has no drives"


def test_a_share_is_never_rounded_to_a_whole():
    """Would catch 100.00 % beside 99.9989 % on one page."""
    said = [percent(share).replace("\u00a0", " ") for share in (0.98812, 0.9998, 0.999989, 1 - 2e-9, 1.0)]
    assert said == ["98.81 %", "99.98 %", "99.9989 %", "99.99999980 %", "100.00 %"]


def test_a_study_lists_its_steps(tmp_path, study):
    (tmp_path / "mine.toml").write_text('drive = "csf-25-80"\n[study]\nsteps = ["orders", "waveform"]\n')
    assert steps_of(load_study(tmp_path / "mine.toml")) == (True, ("orders", "waveform"))
    listed, asked = steps_of(study)
    assert not listed
    assert set(asked) >= {"waveform", "orders", "lag", "structures", "profiles", "sensitivities", "design_map"}


@pytest.mark.parametrize(
    ("steps", "message"),
    [
        ('["wavefrom"]', r"mine.toml, line 3, study.steps: unknown step 'wavefrom'; did you mean 'waveform'"),
        ("[]", r"mine.toml, line 3, study.steps: is empty; name at least one of waveform, effects, orders"),
    ],
)
def test_steps_that_cannot_be_done_are_refused_before_anything_runs(steps, message, tmp_path):
    (tmp_path / "mine.toml").write_text(f'drive = "csf-25-80"\n[study]\nsteps = {steps}\n')
    with pytest.raises(HdoptError, match=message):
        run_study(load_study(tmp_path / "mine.toml"), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_steps_do_without_what_a_study_does_not_give(minimal):
    frame = next(
        item.frame for item in find_step("structures")(minimal, CONTEXT).sections[0].items if hasattr(item, "frame")
    )
    assert list(frame.columns) == ["structure", "peak_to_peak_arcmin"]
    with pytest.raises(HdoptError, match=r"the lag needs clearances.backlash_mm"):
        find_step("lag")(minimal, CONTEXT)
    with pytest.raises(HdoptError, match=r"bending of the ring needs drive.flexspline_wall_mm"):
        find_step("profiles")(minimal, CONTEXT)


def test_an_error_that_is_nil_and_its_direction_have_no_sensitivity(minimal):
    found = sensitivities(minimal, CONTEXT).results
    assert set(found) == {
        "method",
        "base_arcmin",
        "Axis eccentricity",
        "Axis eccentricity, direction",
        "Pressure angle",
        "WG width",
    }
    assert found["Axis eccentricity"]["low_arcmin"] < found["base_arcmin"] < found["Axis eccentricity"]["high_arcmin"]


def test_the_map_goes_through_the_design(study):
    angles, widths = np.array([10.0, 12.0]), np.array([9.0, 11.0])
    values = map_arcmin(study.drive, study.errors, angles, widths)
    assert values[1, 0] == pytest.approx(float(peak_to_peak_arcmin(study.drive, study.errors)), rel=1e-12)
    wider = float(peak_to_peak_arcmin(with_width(study.drive, 11.0), study.errors))
    assert values[1, 1] == pytest.approx(wider, rel=1e-12)


def test_profiles_start_with_the_studys_own_and_all_deflect_alike(study):
    offered = alternatives(study)
    assert next(iter(offered)) == "ellipse"
    assert set(offered) == {"ellipse", "resal", "two_disk"}
    assert offered["ellipse"] is study.drive.wave_generator.profile
    assert [profile.semi_major for profile in offered.values()] == pytest.approx([31.046] * 3)
    results = profiles(study, CONTEXT).results
    assert results["resal"]["contact_angle_deg"] == pytest.approx(54.99, abs=0.03)  # Jia 2021, Table 4


def test_structures_are_those_of_the_drive_with_nothing_else_changed(study):
    results = structures(study, CONTEXT).results
    for structure in Structure:
        expected = converged_peak_to_peak_arcmin(drive(structure=structure), study.errors)
        assert results[structure.value]["peak_to_peak_arcmin"] == pytest.approx(expected, rel=1e-12)


def test_a_step_nobody_listed_is_left_out_where_a_number_is_missing(minimal, tmp_path):
    result = run_study(minimal, tmp_path / "out")
    assert "clearances.backlash_mm" in result.steps["lag"].results["left_out"]
    assert "Left out: the lag needs clearances.backlash_mm" in result.report.read_text()


def test_a_listed_step_with_a_missing_number_is_refused(tmp_path):
    (tmp_path / "mine.toml").write_text(MINIMAL + '[study]\nsteps = ["lag"]\n')
    with pytest.raises(HdoptError, match=r"the lag needs clearances.backlash_mm"):
        run_study(load_study(tmp_path / "mine.toml"), tmp_path / "out")


def test_a_step_nobody_listed_is_left_out_where_the_machine_lacks_a_library(minimal, tmp_path, monkeypatch):
    def lacking(study, context):
        raise MissingLibrary("CadQuery cannot be loaded; on Debian install libgl1")

    monkeypatch.setattr("hdopt.workflow.steps.waveform.orders", lacking)
    result = run_study(minimal, tmp_path / "out")
    assert "install libgl1" in result.steps["orders"].results["left_out"]
    assert result.answer


def test_a_trade_page_begins_with_a_verdict_too():
    """Would catch the page of a search alone, which began without a word on the requirement."""
    quantities = {"peak_to_peak_quantile_arcmin": 0.72, "peak_to_peak_arcmin": 0.65}
    search = {
        "objective": "peak_to_peak_quantile_arcmin",
        "best": {"quantities": quantities},
        "baseline": {"quantities": {"peak_to_peak_quantile_arcmin": 1.094}},
        "active": [{"title": "Mean flank pressure"}, {"title": "Pressure angle"}],
    }
    study = load_study("csf-25-80-design-trade")
    section = section_of_run(of_run(study, {"search": search}), {"search": search})
    ruling, points = section.items
    assert ruling.met and ruling.text == (
        "99.73 % of drives with the chosen wave generator stay within 0.72 arcmin peak-to-peak, 1 arcmin is allowed: "
        "0.28 arcmin to spare."
    )
    assert points.sentences == (
        "With the study's own wave generator it is 1.094 arcmin instead of 0.72 arcmin: "
        "[[trade-chosen-against-baseline]].",
        "What holds it is mean flank pressure and pressure angle: [[trade-chosen-prices]].",
    )
    other = study.with_({"requirement.yield": 0.99})
    assert of_run(other, {"search": search}) is None, "the quantile of another share of drives proves nothing"


@pytest.mark.parametrize("name", shipped_studies())
def test_the_inputs_hold_every_section_of_a_study(name):
    """Would catch a section, of a step that brings its own or of measured teeth, that the page is silent about."""
    from hdopt.report.sections.inputs import inputs_section

    teeth = {"cs_teeth": {"file": "teeth.csv", "deviation": "single"}}
    data = {**load_study(name).data, **teeth}
    keys = {getattr(item, "key", "") for item in inputs_section(data, "", name).items}
    assert {f"inputs-{section.replace('_', '-')}" for section in data if section != "study" and data[section]} <= keys
