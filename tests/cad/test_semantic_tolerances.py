"""Tolerances in an AP242 file, read from its Part 21 text with regular expressions of this test alone."""

from __future__ import annotations

import re

import cadquery as cq
import pytest
from wave_generators import drive

from hdopt.drive.geometry import Structure
from hdopt.geometry import semantic
from hdopt.geometry.callouts import Flank, callouts_of
from hdopt.geometry.check import CheckFailed
from hdopt.geometry.export import export_drive
from hdopt.geometry.job import make_job
from hdopt.geometry.options import ExportOptions
from hdopt.geometry.part21 import Part21, StatedSize, StatedTolerance

pytestmark = pytest.mark.slow

BOUNDS = {"wg_eccentricity_mm": 0.0075, "wg_tilt_major_deg": 0.1, "wg_tilt_minor_deg": 0.1}


def export(path, profile="ellipse", structure=Structure.INTEGRAL):
    return export_drive(drive(profile, structure), {"step": path}, ExportOptions(step_schema="AP242"), "x", BOUNDS)


def test_zones_sizes_datums_and_products_stand_in_the_text(tmp_path):
    target = tmp_path / "wave.step"
    result = export(target)
    text = " ".join(target.read_text().split())
    # The cam: 7.5 um about its bore D and bolt pattern E; the hub: seat Ø7.5 um about its bore A (the budget's values).
    magnitude = {
        number: float(value)
        for number, value in re.findall(r"#(\d+) = LENGTH_MEASURE_WITH_UNIT\(LENGTH_MEASURE\(([^)]*)\)", text)
    }
    zones = {}
    for body in re.findall(r"= (\( [^;]*GEOMETRIC_TOLERANCE\('[^;]*);", text):
        kind = re.search(r"(\w+)_TOLERANCE\( ?\)", body).group(1)
        zones.setdefault(kind, []).append(magnitude[re.search(r"TOLERANCE\('','',#(\d+)", body).group(1)])
    assert zones["SURFACE_PROFILE"] == [0.0075] and zones["COAXIALITY"] == [0.0075]
    assert sorted(zones["PERPENDICULARITY"]) == [0.0078, 0.0345] and zones["POSITION"] == [0.1, 0.1]
    assert all(value > 0 for values in zones.values() for value in values)
    letters = re.findall(r"= DATUM\('','',#\d+,\.F\.,'(\w)'\)", text)
    assert sorted(letters) == list("ABDEF")
    names = {name: (number, words) for number, name, words in Part21.of(text).products()}
    assert names["hub"][0].endswith("-01") and "42CrMo4" in names["hub"][1]
    assert zones["SYMMETRY"] == [pytest.approx(0.03)]
    assert "density measure" in text and result.checks["step"]["tolerances"] == 7


@pytest.mark.parametrize(("profile", "structure"), [("two_disk", Structure.INTEGRAL), ("ellipse", Structure.AUTOMATIC)])
def test_every_structure_carries_its_tolerances(profile, structure, tmp_path):
    target = tmp_path / "wave.step"
    result = export(target, profile, structure)
    found = Part21.of(target.read_text())
    assert len(found.tolerances()) == result.checks["step"]["tolerances"] > 3
    assert found.faces_with_tolerances() > 3
    # A letter is one datum of one part: no part's tolerance refers to a feature of another.
    datums = [body for body in found.instances.values() if body.startswith("DATUM(")]
    letters = [body[-3] for body in datums]
    assert len(letters) == len(set(letters)) >= 3


@pytest.mark.parametrize("profile", ["ellipse", "two_disk"])
def test_widths_lie_between_faces_that_are_so_far_apart(profile):
    """Of keyways, slots and blocks, whose sides a bore cuts in two."""
    job = make_job(drive(profile, Structure.AUTOMATIC), ExportOptions(), "x", BOUNDS)
    seen = 0
    for part, solid in job.made:
        for callout in callouts_of(part, job.model):
            if callout.size is not None and isinstance(callout.faces[0], Flank):
                one, other = (cq.Face(face) for face in semantic.opposite(solid, callout.faces[0]))
                across = (one.Center() - other.Center()).dot(one.normalAt())
                assert abs(across) == pytest.approx(callout.size[0], abs=1e-9), (part.name, callout.lines[0])
                seen += 1
    assert seen == 5


def test_magnitudes_of_zero_fail_the_check(tmp_path, monkeypatch):
    original = semantic._add_frame

    def forget(tolerances, labels, frame, datums):
        from dataclasses import replace

        original(tolerances, labels, replace(frame, zone=0.0), datums)

    monkeypatch.setattr(semantic, "_add_frame", forget)
    with pytest.raises(CheckFailed, match="its geometric tolerances are"):
        export(tmp_path / "wave.step")
    assert list(tmp_path.iterdir()) == []


def test_reader_of_the_text_knows_the_form_of_the_standard():
    """The example of CAx-IF's recommended practices for PMI, in short: position of a hole to A and B, and its size."""
    text = """DATA;
#1=DATUM('','',#9,.F.,'A');
#2=DATUM('','',#9,.F.,'B');
#3=DATUM_REFERENCE_COMPARTMENT('','',#9,.F.,#1,$);
#4=DATUM_REFERENCE_COMPARTMENT('','',#9,.F.,#2,$);
#5=DATUM_SYSTEM('a; b','',#9,.F.,(#3,#4));
#6=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.05),#8);
#7=(GEOMETRIC_TOLERANCE('','',#6,#10)GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE((#5))POSITION_TOLERANCE());
#9=PRODUCT_DEFINITION_SHAPE('','',#8);
#11=DIMENSIONAL_SIZE(#10,'diameter');
#12=DIMENSIONAL_CHARACTERISTIC_REPRESENTATION(#11,#13);
#13=SHAPE_DIMENSION_REPRESENTATION('',(#14),#8);
#14=(LENGTH_MEASURE_WITH_UNIT()MEASURE_REPRESENTATION_ITEM()MEASURE_WITH_UNIT(POSITIVE_LENGTH_MEASURE(24.),#8)
REPRESENTATION_ITEM('nominal value'));
#15=TOLERANCE_VALUE(#16,#17);
#16=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(-0.013),#8);
#17=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.),#8);
#18=PLUS_MINUS_TOLERANCE(#15,#11);
ENDSEC;"""
    file = Part21.of(text)
    assert file.tolerances() == [StatedTolerance("position", 0.05, "AB")]
    assert file.sizes() == [StatedSize(24.0, -0.013, 0.0)]
