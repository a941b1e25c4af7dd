"""Drawing sheets: texts that never overlap, datums that are all there and all used, what a shop needs to be told."""

from __future__ import annotations

import itertools
import re

import pytest
from wave_generators import drive, scaled

from hdopt.drive.geometry import Structure
from hdopt.geometry.callouts import callouts_of
from hdopt.geometry.export import export_drive
from hdopt.geometry.job import make_job
from hdopt.geometry.mating_drawing import fill_mating_sheet
from hdopt.geometry.options import ExportOptions
from hdopt.geometry.part_sheets import HEIGHT, WIDTH, sheets
from hdopt.geometry.sheet import Sheet, label_box, text_width

pytestmark = pytest.mark.slow

BOUNDS = {"wg_eccentricity_mm": 0.0075, "wg_tilt_major_deg": 0.1, "wg_tilt_minor_deg": 0.1}
AXIS = {"axis_eccentricity_mm": 0.015, "axis_tilt_y_deg": 0.2, "axis_tilt_x_deg": 0.2}

CASES = [
    ("ellipse", Structure.INTEGRAL, 1.0),
    ("two_disk", Structure.AUTOMATIC, 0.4),
    ("two_disk", Structure.INTEGRAL, 4.0),
    ("ellipse", Structure.ONE_WAY_MAJOR, 4.0),
    ("ellipse", Structure.INTEGRAL, 0.4),
    ("resal", Structure.ONE_WAY_MINOR, 1.0),
]


def job_of(profile, structure, scale):
    made = drive(profile, structure)
    return make_job(made if scale == 1.0 else scaled(made, scale), ExportOptions(), "csf-25-80", BOUNDS | AXIS)


@pytest.mark.parametrize(("profile", "structure", "scale"), CASES)
def test_no_text_lies_on_another_or_off_the_sheet(profile, structure, scale):
    job = job_of(profile, structure, scale)
    drawn = sheets(job)
    assert len(drawn) == 2 + len(job.made)
    for sheet in drawn:
        boxes = [(label.content, label_box(label)) for label in sheet.labels if label.content]
        for content, (left, top, right, low) in boxes:
            assert left > 10 and top > 10 and right < WIDTH - 10 and low < HEIGHT - 10, content
        for (first, a), (second, b) in itertools.combinations(boxes, 2):
            apart = a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]
            assert apart, f"{sheet.title}: {first!r} lies on {second!r}"


def test_widths_of_texts_are_those_of_the_font():
    """Against the advance widths of DejaVu Sans itself (units of 1/2048 em): capital M has 1767, i has 569."""
    assert text_width("MMMMMMMMMM", 10.0) == pytest.approx(10 * 10 * 1767 / 2048, rel=0.02)
    assert text_width("iiiiiiiiii", 10.0) == pytest.approx(10 * 10 * 569 / 2048, rel=0.05)


@pytest.mark.parametrize("profile", ["ellipse", "resal", "two_disk"])
@pytest.mark.parametrize("structure", list(Structure))
def test_every_datum_is_drawn_once_and_used(profile, structure):
    job = job_of(profile, structure, 1.0)
    for part in job.model.parts:
        callouts = callouts_of(part, job.model)
        drawn = [callout.datum for callout in callouts if callout.datum]
        used = {letter for callout in callouts for frame in callout.frames for letter in frame.datums}
        assert len(drawn) == len(set(drawn)) and set(drawn) == used, part.name
        round_rim = profile == "two_disk"
        for callout in callouts:
            assert not (callout.boxed and "profile" in callout.lines[0] and round_rim)
            if part.name == "cam":
                assert all(frame.symbol != "coaxiality" for frame in callout.frames)


def test_frames_take_their_zones_from_the_budget():
    job = job_of("ellipse", Structure.INTEGRAL, 1.0)
    cam = [frame for callout in callouts_of(job.model.part("cam"), job.model) for frame in callout.frames]
    profile = next(frame for frame in cam if frame.symbol == "profile")
    # Half of 2 x 7.5 um for the cam's place on its bore, the other half for the seat on the hub's bore.
    assert profile.zone == pytest.approx(0.0075) and profile.datums == "DE"
    hub = [frame for callout in callouts_of(job.model.part("hub"), job.model) for frame in callout.frames]
    assert next(frame for frame in hub if frame.symbol == "coaxiality").value == "Ø0.0075"


def test_sheets_as_pdf_and_as_archive(tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1790000000")
    files = {"pdf": tmp_path / "wave.pdf", "drawings": tmp_path / "wave.zip"}
    result = export_drive(drive(), files, bounds=BOUNDS)
    assert result.checks["pdf"]["pages"] == result.checks["drawings"]["sheets"] == 4
    # A3 in points.
    box = re.search(rb"/MediaBox \[\s*0 0 ([\d.]+) ([\d.]+)\s*\]", files["pdf"].read_bytes())
    assert [float(value) * 25.4 / 72 for value in box.groups()] == pytest.approx([WIDTH, HEIGHT], abs=0.1)
    first = files["drawings"].read_bytes()
    import zipfile

    with zipfile.ZipFile(files["drawings"]) as archive:
        text = archive.read("01-hub.svg").decode()
    for said in ("M3-6H", "keyway 5 JS9", "corners R", "ISO 13715", "ISO 22081", "mass", "2026-09-21", "ISO 5459"):
        assert said in text, said
    assert first[:2] == b"PK"


def test_mating_sheet_says_every_row_and_spends_the_bound():
    job = job_of("ellipse", Structure.INTEGRAL, 1.0)
    drawn = Sheet(WIDTH, HEIGHT, "mating parts", "")
    fill_mating_sheet(drawn, job)
    said = [label.content for label in drawn.labels]
    for row in job.mating:
        assert row.feature in said and row.requirement in said
    # Four shares of e1 = 15 um, each 7.5 um on diameter; two of the tilts' 0.2 deg.
    assert said.count("0.0075") == 4 and said.count("0.00375 mm") == 4 and said.count("0.1 deg") == 2
    assert any(line.startswith("e1") and line.endswith(": 0.015 mm") for line in said)
    assert any(line.endswith(": 0.2 deg") for line in said)
