"""A measured cam against its study. The measurements are made here from the ellipse's formula, not from the export."""

from __future__ import annotations

import json
import math
import tomllib

import numpy as np
import pytest
from cases import TABLE_1_ELLIPSE
from hypothesis import given, settings
from hypothesis import strategies as st

from hdopt.cli import main
from hdopt.drive.profiles import read_polar
from hdopt.errors import HdoptError
from hdopt.geometry.compare import fit_cam, read_cam
from hdopt.geometry.contour import Circle, ParallelCurve
from hdopt.study import load_study
from hdopt.workflow.compare import compare, write_measured_study

BEARING = 3.0
CAM = ParallelCurve(TABLE_1_ELLIPSE, BEARING)


def measured(distance=-BEARING, error=lambda t: 0.0 * t, turn=0.0, shift=(0.0, 0.0), points=720):
    """Points at a distance outside the ellipse of Table 1 along its normals, turned clockwise and moved."""
    t = np.arange(points) * 2 * np.pi / points
    a, b = TABLE_1_ELLIPSE.semi_major, TABLE_1_ELLIPSE.semi_minor
    normal = np.column_stack([a * np.sin(t), b * np.cos(t)])
    normal /= np.hypot(*normal.T)[:, None]
    x, y = (np.column_stack([b * np.sin(t), a * np.cos(t)]) + (distance + error(t))[:, None] * normal).T
    cos, sin = math.cos(turn), math.sin(turn)
    return np.column_stack([x * cos + y * sin, y * cos - x * sin]) + shift


@given(
    turn=st.floats(-20, 20),
    x=st.floats(-0.02, 0.02),
    y=st.floats(-0.02, 0.02),
    probe=st.floats(0, 5),
)
@settings(max_examples=15, deadline=None)
def test_fit_finds_what_was_done_to_a_perfect_cam(turn, x, y, probe):
    fit = fit_cam(measured(probe - BEARING, turn=math.radians(turn), shift=(x, y)), CAM, probe)
    # An oval of 0.7 mm holds its rotation by the 0.02 um to which the optimiser brings the residuals.
    assert math.degrees(fit.rotation) == pytest.approx(turn, abs=2e-4)
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    assert fit.shift == pytest.approx((x * c - y * s, x * s + y * c), abs=1e-6)
    assert fit.largest < 1e-6
    # The surface, without the probe, lies where the cam was put.
    assert np.abs(CAM.deviation(fit.points - fit.shift)).max() < 1e-6


def test_deviation_and_its_scatter_are_what_was_put_in():
    rng = np.random.default_rng(3)
    noise = rng.normal(0, 2e-4, 720)
    fit = fit_cam(measured(error=lambda t: 0.003 * np.cos(6 * t) + noise), CAM)
    # Six lobes are square to turning and moving an ellipse but for its 1.2 % of ovality.
    assert fit.rms == pytest.approx(math.hypot(0.003 / math.sqrt(2), 2e-4), rel=0.03)
    assert fit.noise == pytest.approx(2e-4, rel=0.15)


def test_disc_has_no_direction():
    circle = Circle(27.0, 0.8)
    angle = np.arange(100) * 2 * np.pi / 100
    points = np.column_stack([27.01 * np.sin(angle) + 0.005, 0.8 + 27.01 * np.cos(angle)])
    fit = fit_cam(points, circle)
    assert fit.rotation == 0.0 and fit.shift == pytest.approx((0.005, 0.0), abs=1e-7)
    assert fit.deviations == pytest.approx(0.01, abs=1e-7)


@given(
    turn=st.floats(-5, 5),
    x=st.floats(-0.02, 0.02),
    amplitude=st.floats(0.001, 0.02),
    lobes=st.sampled_from([4, 6, 8]),
)
@settings(max_examples=10, deadline=None)
def test_minimum_zone_of_even_lobes_is_their_height(turn, x, amplitude, lobes):
    """Chebyshev: a deviation that has its extreme value with alternate signs more often than a move has freedoms cannot
    be made smaller by a move."""
    points = measured(error=lambda t: amplitude * np.cos(lobes * t), turn=math.radians(turn), shift=(x, 0.0))
    fit = fit_cam(points, CAM, method="minimum_zone")
    assert fit.largest == pytest.approx(amplitude, rel=2e-3)
    assert math.degrees(fit.rotation) == pytest.approx(turn, abs=0.01)


def test_minimum_zone_lies_in_the_middle_of_one_high_spot():
    """A burr of 10 um: the least largest deviation of a cam is half of it, for the whole moves away; squares leave all
    of it. With one burr a shift of 5 um gives +5 at the burr and -5 opposite."""
    circle = Circle(27.0)
    angle = np.arange(360) * 2 * np.pi / 360
    radius = 27.0 + np.where(np.arange(360) == 90, 0.010, 0.0)
    points = np.column_stack([radius * np.sin(angle), radius * np.cos(angle)])
    squares, least = (fit_cam(points, circle, method=method) for method in ("least_squares", "minimum_zone"))
    assert squares.largest == pytest.approx(0.010, rel=0.02)
    assert least.largest == pytest.approx(0.005, rel=1e-3)
    # Across the burr the cam may lie anywhere: the bottom of the largest deviation is flat there.
    assert least.shift[0] == pytest.approx(0.005, abs=1e-6)
    assert least.rotation == 0.0


def test_minimum_zone_is_the_least_of_all_moves_tried():
    rng = np.random.default_rng(8)
    points = measured(error=lambda t: 0.004 * np.cos(3 * t + 1) + 0.002 * np.sin(5 * t) + 0.003 * (t > 5))
    fit = fit_cam(points, CAM, method="minimum_zone")
    assert fit.largest < fit_cam(points, CAM).largest
    sin, cos = math.sin(fit.rotation), math.cos(fit.rotation)
    back = points @ np.array([[cos, sin], [-sin, cos]]) - fit.shift
    assert np.abs(CAM.deviation(back)).max() == pytest.approx(fit.largest, abs=1e-9)
    for turn, x, y in rng.normal(0, [2e-4, 1e-3, 1e-3], (60, 3)).tolist():
        near = back @ np.array([[1.0, turn], [-turn, 1.0]]) - (x, y)
        # The least of the linear programme's own tolerance, 1e-7 um, and a matrix that turns to first order.
        assert np.abs(CAM.deviation(near)).max() >= fit.largest - 2e-6


def test_command_judges_by_the_fit_that_is_asked(tmp_path, capsys):
    """One burr of 6 um: outside +-3.75 um by least squares, within the zone where the cam may move."""
    angle = np.arange(720)
    cam = save(tmp_path / "burr.csv", measured(error=lambda t: np.where(angle == 180, 0.006, 0.0)))
    code, said = run(capsys, cam, "--json", "-")
    assert code == 1 and json.loads(said.out)["fit"]["method"] == "least_squares"
    least = json.loads(said.out)["minimum_zone_um"]
    code, said = run(capsys, cam, "--fit", "minimum_zone", "--json", "-")
    values = json.loads(said.out)
    assert code == 0 and values["met"] and values["minimum_zone_um"] == least
    assert values["deviation_um"]["largest"] == pytest.approx(least / 2)
    code, said = run(capsys, cam, "--fit", "minimum_zone")
    assert "best fit (minimum zone)" in said.out and "least zone that holds every point: " in said.out


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as stopped:
        main(["compare", *map(str, arguments)])
    return stopped.value.code, capsys.readouterr()


def save(path, points):
    np.savetxt(path, points, delimiter=",", header="x_mm,y_mm", comments="")
    return path


def test_command_says_within_and_outside(tmp_path, capsys):
    inside = save(tmp_path / "in.csv", measured(error=lambda t: 0.003 * np.cos(6 * t)))
    code, said = run(capsys, inside, "--study", "csf-25-80", "--json", "-")
    values = json.loads(said.out)
    assert code == 0 and values["met"] is True
    assert values["deviation_um"]["largest"] == pytest.approx(3.0, abs=0.1)
    assert set(values["fit"]) == {"method", "rotation_deg", "shift_um"}
    outside = save(tmp_path / "out.csv", measured(error=lambda t: 0.006 * np.cos(6 * t)))
    code, said = run(capsys, outside, "--plot", tmp_path / "plot.svg", "--csv", tmp_path / "points.csv")
    assert code == 1 and "OUTSIDE the profile's zone of 7.5 um" in said.out
    assert len((tmp_path / "points.csv").read_text().splitlines()) == 721
    assert "deviation along the normal" in (tmp_path / "plot.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize(("surface", "distance"), [("cam", -BEARING), ("bearing", 0.0)])
def test_measured_cam_goes_on_to_kinematic_error(surface, distance, tmp_path, capsys):
    from hdopt import kinematic_error, load_study

    cam = save(tmp_path / "cam.csv", measured(distance + 2.0, turn=math.radians(4)))
    study = tmp_path / "own.toml"
    code, _ = run(capsys, cam, "--probe-radius-mm", 2, "--surface", surface, "--write-study", study)
    assert code == 0
    assert tomllib.loads(study.read_text())["wave_generator"]["surface"] == surface
    # A perfect cam gives the kinematic error of the design, to what its points hold.
    own, design = (
        kinematic_error(load_study(source)).to_dict()["peak_to_peak_arcmin"] for source in (study, "csf-25-80")
    )
    assert own == pytest.approx(design, abs=2e-4)


def test_a_study_that_cannot_be_written_leaves_no_table_behind(tmp_path):
    save(tmp_path / "cam.csv", measured())
    study = load_study("csf-25-80")
    result = compare(study, tmp_path / "cam.csv")
    (tmp_path / "taken.toml").mkdir()
    with pytest.raises(HdoptError, match="it is a folder"):
        write_measured_study(study, result, tmp_path / "taken.toml")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cam.csv", "taken.toml"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,2\n", "a line must name the columns angle_deg,radius_mm or x_mm,y_mm"),
        ("angle_deg,radius_mm\n1,2\n3,x\n", "line 3: does not hold angle_deg and radius_mm as numbers"),
        ("angle_deg,radius_mm\n1,nan\n", "line 2: holds a number that is not finite"),
        ("angle_deg,radius_mm\n0,5,28,05\n", "line 2: holds 4 cells under 2 names; does a decimal comma stand"),
        ("angle_deg;radius_mm\n0,5;1.028,05\n", "line 2: does not hold angle_deg and radius_mm as numbers"),
        ("angle_deg,radius_mm\n1,28\n", "has 1 point; at least 16 are needed"),
        (
            "angle_deg,radius_mm\n" + "".join(f"{i},28\n" for i in range(180)),
            "the points leave [0-9]+ deg of the cam out",
        ),
        ("angle_deg,radius_mm\n" + "".join(f"{i},31.5\n" for i in range(360)), "not of|mm off the cam of this study"),
    ],
)
def test_unusable_measurements_are_refused(text, message, tmp_path, capsys):
    import re

    (tmp_path / "cam.csv").write_text(text)
    code, said = run(capsys, tmp_path / "cam.csv")
    assert code == 2 and re.search(message, said.err), said.err
    # Would catch a refusal that points to a line of the study, whose 162 teeth its 162 deg happen to equal.
    assert said.err.startswith(f"hdopt: {tmp_path / 'cam.csv'}"), said.err


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16"])
@pytest.mark.parametrize("separator", [";", "\t"])
def test_files_of_german_machines_say_the_same(encoding, separator, tmp_path):
    """Decimal commas, words above the names, a further column, Windows' encoding; as a study's measured profile too."""
    points = measured(error=lambda t: 0.003 * np.cos(5 * t), points=90)
    angle, radius = np.degrees(np.arctan2(*points.T)) % 360, np.hypot(*points.T)
    plain, german = tmp_path / "plain.csv", tmp_path / "german.csv"
    rows = [(f"{a:.6f}", f"{r:.6f}", "1.5") for a, r in zip(angle, radius, strict=True)]
    names = ("angle_deg", "radius_mm", "force_n")
    plain.write_text("\n".join(",".join(row) for row in (names, *rows)))
    lines = ["Prüfer: Müller, Raum 3", *(separator.join(row).replace(".", ",") for row in (names, *rows))]
    german.write_bytes("\r\n".join(lines).encode(encoding))
    assert read_cam(german).tolist() == read_cam(plain).tolist()
    own = tmp_path / "own.csv"
    own.write_bytes("\r\n".join(separator.join(row[:2]).replace(".", ",") for row in rows).encode(encoding))
    assert [column.tolist() for column in read_polar(own, "cam")] == [
        np.radians([float(row[0]) for row in rows]).tolist(),
        [float(row[1]) for row in rows],
    ]


@pytest.mark.parametrize(
    ("off_um", "lobes_um", "status"), [(2.0, 3.0, 0), (40.0, 3.0, 0), (2.0, 6.0, 1), (40.0, 6.0, 1)]
)
def test_form_and_location_are_each_told_and_the_form_decides(off_um, lobes_um, status, tmp_path, capsys):
    """Would catch a location beyond its bound that is said to be kept, and a verdict on the form that takes it in: the
    bound is 5 um here, the half zone 3.75 um."""
    cam = save(
        tmp_path / "cam.csv", measured(error=lambda t: lobes_um / 1e3 * np.cos(6 * t), shift=(0.0, off_um / 1e3))
    )
    study = ("--set", 'tolerances.wg_eccentricity_mm={distribution="half_normal",scale=0.002,upper=0.005}')
    study = (*study, "--set", "export.profile_tolerance_mm=0.0075")
    code, said = run(capsys, cam, *study, "--json", tmp_path / "a.json")
    values = json.loads((tmp_path / "a.json").read_text())
    form, location = lobes_um <= 3.75, off_um <= 5.0
    assert code == status == (not values["met"])
    assert (values["met"], values["eccentricity_met"]) == (form, location)
    assert f"form: {'within' if form else 'OUTSIDE'} the profile's zone of 7.5 um" in said.out
    assert f"um, {'within' if location else 'BEYOND'} the 5 um of the tolerances" in said.out
    lost = [name for name, met in (("form", form), ("location", location)) if not met]
    assert (f"not kept: {' and '.join(lost)}" in said.out) == bool(lost)
    assert ("the verdict is on the form" in said.out) == (form and not location)


def test_a_location_that_nothing_bounds_is_not_missed(tmp_path):
    """Would catch a location that nothing bounds taken for one that is missed."""
    from hdopt.workflow.compare import CompareResult

    fit = fit_cam(measured(shift=(0.3, 0.0)), CAM)
    free = CompareResult("s", "cam", "cam", 0.0, 0.0075, fit, None)
    assert free.met and free.eccentricity_met is None


def polar_rows(points=72, places=6):
    """Angle (deg) and radius (mm) of a perfect cam as text, from the ellipse's formula."""
    at = measured(points=points)
    angle = np.degrees(np.arctan2(*at.T)) % 360
    return [(f"{a:.9f}", f"{r:.{places}f}") for a, r in zip(angle.tolist(), np.hypot(*at.T).tolist(), strict=True)]


def table(path, rows):
    path.write_text("\n".join(["angle_deg,radius_mm", *map(",".join, rows)]))
    return path


def refused(path, capsys):
    """What either command says of one measured cam: `compare`, and `ke` of a study that has it; None each where it is
    taken."""
    said = []
    given = (
        f"wave_generator.{key}"
        for key in ("profile=measured", f"file={path}", "surface=cam", "bearing_thickness_mm=3.0")
    )
    ke = ["ke", "csf-25-80", *(word for one in given for word in ("--set", one))]
    for arguments in (["compare", str(path), "--write-study", str(path.parent / "own.toml")], ke):
        with pytest.raises(SystemExit) as stopped:
            main(arguments)
        said.append(capsys.readouterr().err if stopped.value.code == 2 else None)
    return said


@pytest.mark.parametrize(
    ("places", "last_um", "taken"),
    [(6, 0.0, True), (3, 1.0, True), (3, 2.0, False), (6, 0.002, False), (6, 50.0, False)],
)
def test_a_closing_point_may_differ_by_the_files_rounding_alone(places, last_um, taken, tmp_path, capsys):
    """Would catch a closing point of another radius that one command drops and the other counts, and one that is
    refused for the last digit of the file."""
    rows = polar_rows(places=places)
    closing = ("360", f"{float(rows[0][1]) + last_um / 1e3:.{places}f}")
    path = table(tmp_path / "cam.csv", [*rows, closing])
    said = refused(path, capsys)
    if taken:
        assert said == [None, None]
        assert len(read_cam(path)) == len(rows) == len(read_polar(path, "cam")[0])
    else:
        assert all(f"{last_um:.4g} um apart" in message for message in said), said
        assert f"{path}: closes the turn" in said[0]
        assert not (tmp_path / "own.toml").exists()


def test_an_angle_that_comes_twice_is_refused_by_both_commands(tmp_path, capsys):
    """Would catch `compare --write-study` that writes a study which `ke` refuses; also by points x_mm,y_mm."""
    rows = polar_rows()
    rows.insert(10, (rows[9][0], f"{float(rows[9][1]) + 0.02:.6f}"))
    path = table(tmp_path / "cam.csv", rows)
    angle = float(rows[9][0])
    assert all(f"gives the angle {angle:.6g} deg twice; keep one" in said for said in refused(path, capsys))
    assert sorted(one.name for one in tmp_path.iterdir()) == ["cam.csv"]
    points = measured()
    twice = save(tmp_path / "xy.csv", np.vstack([points, points[180] * 1.001]))
    with pytest.raises(HdoptError, match=r"xy\.csv: gives the angle .* deg twice"):
        read_cam(twice)
    # The first point again at the end closes the turn.
    assert len(read_cam(save(tmp_path / "xy.csv", np.vstack([points, points[:1]])))) == len(points)
    # A part that lies beside the machine's origin has two points in one direction from there.
    aside = save(tmp_path / "aside.csv", points + np.array([0.0, 100.0]))
    assert len(read_cam(aside)) == len(points)


def test_no_study_is_written_whose_table_is_refused(tmp_path, capsys):
    """Would catch a study of a cam that its own reader refuses: here one that was measured beside the axis."""
    aside = save(tmp_path / "aside.csv", measured(shift=(0.0, 100.0)))
    code, said = run(capsys, aside, "--write-study", tmp_path / "own.toml")
    assert code == 2 and "of the measured cam, as its study is to have it" in said.err
    assert sorted(one.name for one in tmp_path.iterdir()) == ["aside.csv"]
