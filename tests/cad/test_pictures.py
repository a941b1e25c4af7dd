"""The drawing and the picture: what they show, and that their checks can fail."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from wave_generators import drive

from hdopt.drive.geometry import Structure
from hdopt.geometry import drawing, picture
from hdopt.geometry.check import CheckFailed
from hdopt.geometry.export import export_drive
from hdopt.geometry.job import make_job
from hdopt.geometry.options import ExportOptions
from hdopt.geometry.views import section_at_minor_axis_zero, seen_from
from hdopt.report.sections.geometry import geometry_section

pytestmark = pytest.mark.slow

BOUNDS = {"wg_eccentricity_mm": 0.0075, "wg_tilt_major_deg": 0.1, "wg_tilt_minor_deg": 0.1}


@pytest.mark.parametrize(
    ("profile", "structure"),
    [("ellipse", Structure.INTEGRAL), ("two_disk", Structure.AUTOMATIC)],
    ids=["cam", "discs"],
)
def test_drawing_names_sizes_tolerances_and_assumptions(profile, structure, tmp_path):
    target = tmp_path / "wave.svg"
    result = export_drive(drive(profile, structure), {"svg": target}, name="test study", bounds=BOUNDS)
    texts = [element.text for element in ElementTree.parse(target).iter("{http://www.w3.org/2000/svg}text")]
    said = "\n".join(texts)
    assert "wave generator test study" in said and result.identity.fingerprint in said
    for row in result.dimensions:
        assert row.tolerance in texts
    for assumption in result.model.assumptions:
        assert assumption.key.removeprefix("export.") in texts
    for part in result.model.parts:
        assert part.name.replace("_", " ") in texts
    # Everything lies on the sheet.
    places = re.findall(r'<text x="([-\d.]+)" y="([-\d.]+)"', target.read_text(encoding="utf-8"))
    x, y = np.array(places, float).T
    assert (x.min(), y.min()) > (10, 10) and x.max() < 410 and y.max() < 287


@pytest.mark.parametrize("profile", ["ellipse", "two_disk"])
@pytest.mark.parametrize("structure", [Structure.INTEGRAL, Structure.AUTOMATIC])
def test_fits_in_the_overview_are_those_of_the_limits(profile, structure):
    """A bore that is H6 on its own sheet was H7 here, and a hole H11 was H13."""
    job = make_job(drive(profile, structure), ExportOptions(), "x", BOUNDS)
    said = re.findall(r">⌀([\d.]+) ([A-Z]\w+)(?:/(\w+))?<", drawing.draw(job))
    limits = {
        (round(row.nominal, 4), row.tolerance.split()[0]) for row in job.dimensions if row.nominal and row.tolerance
    }
    assert said
    for size, hole, shaft in said:
        assert (float(size), hole) in limits and (not shaft or (float(size), shaft) in limits)


def test_section_of_a_cam_is_its_cut_face():
    result = export_drive(drive(), {}, ExportOptions(hub=False, mount="plain", bore_mm=14, chamfer_mm=0.5))
    (cam,) = result.model.parts
    regions = section_at_minor_axis_zero(cam.build())
    assert len(regions) == 2
    area = 0.0
    for region in regions:
        x, y = region.outer.T
        area += abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2
    box = cam.contour.box
    # Two rectangles from bore to profile, less outer chamfer, lead-in and two countersinks, each twice.
    lead_in = np.tan(np.radians(15)) / 2
    assert area == pytest.approx((box[3] - box[1] - 14) * 9 - 2 * (0.125 + lead_in + 2 * 0.125), rel=1e-6)


def test_view_shows_the_profile_to_scale():
    cam = export_drive(drive(), {}, ExportOptions(hub=False)).model.parts[0]
    low_x, low_y, high_x, high_y = seen_from([cam.build()], *drawing.FRONT).box
    assert (low_x, low_y, high_x, high_y) == pytest.approx(cam.contour.box, abs=drawing_tolerance())


def drawing_tolerance() -> float:
    from hdopt.geometry.views import SAGITTA

    return SAGITTA


def test_drawing_without_its_table_fails_the_check(monkeypatch, tmp_path):
    monkeypatch.setattr(drawing, "_key_dimensions", lambda *_: None)
    with pytest.raises(CheckFailed, match="lacks the dimensions"):
        export_drive(drive(), {"svg": tmp_path / "wave.svg"})
    assert list(tmp_path.iterdir()) == []


def render(tmp_path, **options):
    try:
        return export_drive(drive(), {"png": tmp_path / "wave.png"}, ExportOptions(hub=False, **options))
    except picture.NoPicture as reason:
        pytest.skip(str(reason))


def test_picture_shows_the_cam_in_its_colour_and_a_blank_one_fails(tmp_path, monkeypatch):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOImage import vtkPNGReader

    result = render(tmp_path)
    assert result.checks["png"] == {"width": 1600, "height": 1000}
    reader = vtkPNGReader()
    reader.SetFileName(str(result.files["png"]))
    reader.Update()
    pixels = vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars()).astype(int)
    red, green, blue = pixels[:, :3].T
    # The cam is blue; the paper is white.
    assert np.mean((blue > red + 15) & (blue > green)) > 0.1
    assert np.mean((red > 250) & (green > 250) & (blue > 250)) > 0.3

    result.files["png"].unlink()
    monkeypatch.setattr(picture, "_scene", lambda job: {})
    with pytest.raises(CheckFailed, match="it is blank"):
        export_drive(drive(), {"png": tmp_path / "wave.png"}, ExportOptions(hub=False))
    assert list(tmp_path.iterdir()) == []


def test_machine_without_opengl_is_told_what_to_install(monkeypatch, tmp_path):
    # VTK's renderer for machines with neither display nor EGL; its library is not part of the wheel.
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "vtkOSOpenGLRenderWindow")
    try:
        export_drive(drive(), {"png": tmp_path / "wave.png"}, ExportOptions(hub=False))
    except picture.NoPicture as error:
        assert "install libegl1" in str(error) and list(tmp_path.iterdir()) == []
    else:
        pytest.skip("this machine has OSMesa")


def test_report_section_shows_drawing_parts_and_tolerances(tmp_path):
    from hdopt.report import Download, Picture, Table

    target = tmp_path / "wave.svg"
    result = export_drive(drive(), {"svg": target}, bounds=BOUNDS)
    section = geometry_section(result, {"svg": target.read_text(encoding="utf-8")})
    pictures = [item for item in section.items if isinstance(item, Picture)]
    (whole,) = (item for item in section.items if isinstance(item, Download))
    assert (whole.content, whole.opens) == (target.read_text(encoding="utf-8"), True)
    tables = {item.key: item.frame for item in section.items if isinstance(item, Table)}
    # The page has tables of its own; the drawing in it keeps the views.
    views = ElementTree.fromstring(pictures[0].content)
    said = [element.text for element in views.iter("{http://www.w3.org/2000/svg}text")]
    assert "A – A" in said and "Key dimensions" not in said and "56.092  major axis" in said
    assert list(tables) == ["geometry-parts", "geometry-dimensions", "geometry-assumed"]
    assert list(tables["geometry-parts"]["part"]) == ["hub", "cam"]
    assert "axis within diameter 0.015" in set(tables["geometry-dimensions"]["tolerance"])


def test_step_of_a_run_writes_files_and_a_section(tmp_path):
    from hdopt.study import load_study
    from hdopt.workflow.steps import Context, find_step

    result = find_step("geometry")(load_study("csf-25-80"), Context(tmp_path))
    assert {path.suffix for path in result.files} >= {".step", ".dxf", ".svg"}
    assert all(path.is_file() for path in result.files) and result.answer
    assert result.sections[0].key == "geometry" and result.results["max_profile_deviation_um"] < 0.05
