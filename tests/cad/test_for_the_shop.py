"""Cam table, G-code, inspection plan and mating sheet, judged by arithmetic that the export does not use."""

from __future__ import annotations

import csv
import math
import re

import numpy as np
import pytest
from cases import TABLE_1_ELLIPSE
from wave_generators import drive

from hdopt.drive.geometry import Structure
from hdopt.errors import HdoptError
from hdopt.geometry import grinding
from hdopt.geometry.callouts import callouts_of
from hdopt.geometry.check import CheckFailed
from hdopt.geometry.contour import ParallelCurve
from hdopt.geometry.export import export_drive
from hdopt.geometry.inspection import inspection_plan
from hdopt.geometry.job import make_job
from hdopt.geometry.options import ExportOptions

BOUNDS = {
    "wg_eccentricity_mm": 0.0075,
    "wg_tilt_major_deg": 0.1,
    "wg_tilt_minor_deg": 0.1,
    "axis_eccentricity_mm": 0.015,
    "axis_tilt_y_deg": 0.2,
    "axis_tilt_x_deg": 0.2,
}


def rows_of(path):
    with open(path, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def test_cam_table_against_the_formula_of_an_ellipse(tmp_path):
    target = tmp_path / "cam.csv"
    export_drive(drive(profile=TABLE_1_ELLIPSE), {"cam": target}, ExportOptions(cam_resolution_deg=0.25))
    rows = rows_of(target)
    assert len(rows) == 1440 and [float(row["angle_deg"]) for row in rows[:3]] == [0, 0.25, 0.5]
    a, b = TABLE_1_ELLIPSE.semi_major, TABLE_1_ELLIPSE.semi_minor
    for row in rows[::37]:
        angle, normal = math.radians(float(row["angle_deg"])), math.radians(float(row["normal_deg"]))
        radius = float(row["radius_mm"])
        # Three millimetres outward along the stated normal lies the ellipse x^2/b^2 + y^2/a^2 = 1.
        x = radius * math.sin(angle) + 3 * math.sin(normal)
        y = radius * math.cos(angle) + 3 * math.cos(normal)
        assert (x / b) ** 2 + (y / a) ** 2 == pytest.approx(1, abs=1e-8)
        t = math.atan2(x / b, y / a)
        kappa = a * b / (a**2 * math.sin(t) ** 2 + b**2 * math.cos(t) ** 2) ** 1.5
        assert float(row["curvature_per_mm"]) == pytest.approx(kappa / (1 - 3 * kappa), rel=1e-6)


def test_table_of_a_disc(tmp_path):
    target = tmp_path / "disc.csv"
    result = export_drive(drive("two_disk"), {"cam": target})
    circle = result.model.profiled[0].contour
    for row in rows_of(target)[::50]:
        angle, radius = math.radians(float(row["angle_deg"])), float(row["radius_mm"])
        off = math.hypot(radius * math.sin(angle), radius * math.cos(angle) - circle.offset)
        assert off == pytest.approx(circle.radius, abs=2e-7)


@pytest.mark.parametrize("profile", ["ellipse", "resal"])
@pytest.mark.parametrize("wheel", [25.0, 300.0])
def test_wheel_of_the_code_grinds_the_cam(profile, wheel, tmp_path):
    target = tmp_path / "cam.ngc"
    made = drive(profile)
    export_drive(made, {"gcode": target}, ExportOptions(wheel_radius_mm=wheel))
    text = target.read_text()
    moves = np.array(re.findall(r"^G1 C([\d.]+) X([\d.]+) F", text, re.MULTILINE), float)
    assert moves[-1, 0] == pytest.approx(360, abs=1e-4) and np.all(np.diff(moves[:, 0]) > 0)
    # The support function of the cam in the work's frame: a wheel at C, X touches where the centre's distance to the
    # cam is the wheel's radius. Distances are measured to a dense polygon of the cam, not by the export's own curve.
    t = np.linspace(0, 2 * np.pi, 20001)
    r, r1 = made.wave_generator.profile.radius(t), made.wave_generator.profile.radius(t, 1)
    length = np.hypot(r, r1)
    x = r * np.sin(t) - 3 * (r * np.sin(t) - r1 * np.cos(t)) / length
    y = r * np.cos(t) - 3 * (r * np.cos(t) + r1 * np.sin(t)) / length
    for angle, distance in moves[:: len(moves) // 40].tolist():
        centre = distance * math.sin(math.radians(angle)), distance * math.cos(math.radians(angle))
        gap = np.hypot(x - centre[0], y - centre[1]).min() - wheel
        # The polygon's points are 9 um apart: the nearest one is at most 3e-7 mm farther than the curve.
        assert gap == pytest.approx(0, abs=2e-5)


def test_code_for_another_wheel_fails_its_check(tmp_path, monkeypatch):
    original = grinding.write_gcode

    def write(path, job):
        original(path, job)
        path.write_text(path.read_text().replace("WHEEL RADIUS 200.0000", "WHEEL RADIUS 200.0010"))

    monkeypatch.setattr(grinding, "write_gcode", write)
    with pytest.raises(CheckFailed, match=r"its wheel leaves .* and cuts in 1\.\d+ um"):
        export_drive(drive(), {"gcode": tmp_path / "cam.ngc"})
    assert list(tmp_path.iterdir()) == []


def test_discs_have_no_code(tmp_path):
    with pytest.raises(HdoptError, match="two discs are round and are ground round"):
        export_drive(drive("two_disk"), {"gcode": tmp_path / "cam.ngc"})


def test_wheel_leaves_nothing_where_it_touches_and_all_where_it_does_not():
    cam = ParallelCurve(TABLE_1_ELLIPSE, 3.0)
    text = "(WHEEL RADIUS 10.0 MM)\nG1 C0 X38.046\nG1 C0.001 X38.046\n"
    left = grinding.ground_cam(text, cam, np.array([[0.0, 28.046], [27.318, 0.0]]))
    assert left[0] == pytest.approx(0, abs=1e-6) and left[1] == pytest.approx(math.hypot(27.318, 38.046) - 10, abs=1e-3)


@pytest.mark.parametrize("structure", [Structure.INTEGRAL, Structure.AUTOMATIC])
def test_inspection_plan_holds_every_tolerance(structure, tmp_path):
    target = tmp_path / "plan.csv"
    result = export_drive(drive(structure=structure), {"inspection": target}, bounds=BOUNDS)
    rows = rows_of(target)
    listed = {(row["part"], row["feature"]) for row in rows}
    for row in result.dimensions:
        if row.lower is not None:
            assert (row.part, row.name) in listed
    for budget in result.model.plan.budgets:
        for share in budget.shares:
            assert share.zone is None or (share.part, share.feature) in listed
    for row in rows:
        width = float(row["zone_mm"] or 0) or float(row["upper_mm"]) - float(row["lower_mm"])
        assert float(row["uncertainty_mm"]) == pytest.approx(width / 10, abs=1e-6) and int(row["points"]) >= 5


@pytest.mark.parametrize("profile", ["ellipse", "two_disk"])
@pytest.mark.parametrize("structure", list(Structure))
def test_inspection_plan_holds_every_frame_and_no_micrometer_measures_a_zone(profile, structure):
    job = make_job(drive(profile, structure), ExportOptions(), "x", BOUNDS)
    plan = inspection_plan(job)
    for part in job.model.parts:
        for callout in callouts_of(part, job.model):
            for frame in callout.frames:
                # A disc's rim has its coaxiality in the budget, as the position about the hole.
                assert any(row.part == part.name and row.zone_mm == frame.zone for row in plan), (part.name, frame)
    for row in plan:
        if row.zone_mm is not None or row.feature == "perimeter":
            assert "micrometer" not in row.instrument and "caliper" not in row.instrument, row.feature
    assert len({(row.part, row.feature) for row in plan}) == len(plan)


def test_mating_sheet_spends_no_more_than_the_bounds(tmp_path):
    target = tmp_path / "mating.csv"
    export_drive(drive(), {"mating": target}, bounds=BOUNDS)
    rows = rows_of(target)
    spent = {}
    for row in rows:
        if row["takes"]:
            spent[row["feeds"]] = spent.get(row["feeds"], 0.0) + float(row["takes"])
    assert spent["axis_eccentricity"] == pytest.approx(0.015) and spent["axis_tilt"] == pytest.approx(0.2)
    # An axis is off by half of a coaxiality, of a clearance on diameter, of a run-out.
    off_axis = [row for row in rows if row["feeds"] == "axis_eccentricity"]
    assert [float(row["value_mm"]) for row in off_axis] == pytest.approx([2 * float(row["takes"]) for row in off_axis])
    # The shaft is that of the bore's fit: 14 n5 is +20/+12 um (ISO 286-2).
    assert rows[0]["requirement"] == "diameter 14 n5 (+20/+12 um)"
    # Perpendicularity over the face's diameter is the tangent of its share of the tilt.
    face = next(row for row in rows if "mounting face" in row["feature"])
    assert float(face["value_mm"]) / float(face["over_mm"]) == pytest.approx(math.tan(math.radians(0.1)), rel=1e-4)


def test_contributors_of_the_study_stand_on_the_mating_sheet(tmp_path):
    target = tmp_path / "mating.csv"
    own = {"housing": {"callout": "coaxiality", "value_mm": 0.02, "feeds": "axis_eccentricity"}}
    export_drive(drive(), {"mating": target}, bounds=BOUNDS, contributors=own)
    rows = [row for row in rows_of(target) if row["feeds"] == "axis_eccentricity"]
    assert [(row["feature"], float(row["takes"])) for row in rows] == [("housing", 0.01)]
