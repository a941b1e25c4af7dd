"""DXF, STL and 3MF files, read with libraries and plain geometry that the export does not use."""

from __future__ import annotations

import itertools
import zipfile

import ezdxf
import numpy as np
import pytest
from ezdxf import path as dxf_path
from hypothesis import given, settings
from hypothesis import strategies as st
from wave_generators import drive

from hdopt.drive.geometry import Structure
from hdopt.drive.profiles import Ellipse
from hdopt.geometry.arcs import ARC_TOLERANCE, enclosed_area, outline_of, outline_of_bore, outline_of_slot, sample
from hdopt.geometry.contour import Circle, ParallelCurve
from hdopt.geometry.din6885 import key_for_bore
from hdopt.geometry.export import export_drive
from hdopt.geometry.features import DBore, KeywayBore
from hdopt.geometry.job import make_job
from hdopt.geometry.options import ExportOptions
from hdopt.geometry.slide_features import Slot

pytestmark = pytest.mark.slow

LAYERS = ("PROFILE", "OUTLINE", "BORE", "HOLES", "BLIND_SLOT", "BLIND_BLOCK", "BLIND_STEP", "SLOT")


@pytest.mark.parametrize("profile", ["ellipse", "resal", "two_disk", "measured"])
def test_dxf_has_closed_outlines_on_layers_in_mm(profile, tmp_path):
    target = tmp_path / "wave.dxf"
    result = export_drive(drive(profile), {"dxf": target}, ExportOptions(hub=False, profile_tolerance_mm=0.02))
    document = ezdxf.readfile(target)
    assert document.header["$INSUNITS"] == 4 and not document.audit().errors
    suffix = "_DISC_1" if profile == "two_disk" else ""
    outlines = {line.dxf.layer: line for line in document.modelspace().query("LWPOLYLINE")}
    assert all(line.closed for line in outlines.values())
    carrier = result.model.profiled[0]
    area = {}
    for name in ("PROFILE", "TOLERANCE_OUTER", "TOLERANCE_INNER"):
        flat = np.array([(p.x, p.y) for p in dxf_path.make_path(outlines[name + suffix]).flattening(1e-5)])
        area[name] = abs(np.sum(flat[1:, 0] * flat[:-1, 1] - flat[:-1, 0] * flat[1:, 1])) / 2
    # Flattening at 1e-5 mm loses up to that over the perimeter of some 175 mm.
    assert area["PROFILE"] == pytest.approx(carrier.contour.area, abs=2e-3)
    ring = carrier.contour.perimeter * 0.01
    assert area["TOLERANCE_OUTER"] - area["PROFILE"] == pytest.approx(ring, rel=2e-3)
    assert area["PROFILE"] - area["TOLERANCE_INNER"] == pytest.approx(ring, rel=2e-3)


@pytest.mark.parametrize(
    ("profile", "structure"), [("ellipse", s) for s in Structure] + [("two_disk", Structure.AUTOMATIC)]
)
def test_dxf_holds_every_part_and_marks_what_is_blind(profile, structure, tmp_path):
    """A blind outline on a cutting layer, or a part that is left out or lies on another, is what a shop would cut."""
    target = tmp_path / "wave.dxf"
    job = make_job(drive(profile, structure), ExportOptions(), "x")
    export_drive(drive(profile, structure), {"dxf": target})
    document = ezdxf.readfile(target)
    lines = list(document.modelspace().query("LWPOLYLINE"))
    texts = [entity.dxf.text for entity in document.modelspace().query("TEXT")]
    outside = {}
    for part in job.model.parts:
        end = "" if part.name == "cam" else f"_{part.name.upper()}"
        own = {line.dxf.layer: line for line in lines if line.dxf.layer in {f"{w}{end}" for w in LAYERS}}
        cut = own.get(f"PROFILE{end}") or own[f"OUTLINE{end}"]
        x = np.array(cut.get_points("xy"))[:, 0]
        outside[part.name] = (x.min(), x.max())
        assert (f"BLIND_SLOT{end}" in own) == (part.slot is not None)
        assert (f"BLIND_BLOCK{end}" in own) == (part.name in ("input_disc", "floating_disc"))
        assert (f"BLIND_STEP{end}" in own) == (part.name in ("hub", "eccentric_hub"))
        assert (f"BORE{end}" in own) and not any(layer.startswith("SLOT") for layer in own)
        if part.slot is not None:
            assert enclosed_area(np.array(own[f"BLIND_SLOT{end}"].get_points("xyb"))) == pytest.approx(part.slot.area)
            note = f"BLIND_SLOT{end}: {part.slot.depth:g} deep from the back"
            assert any(note in text for text in texts)
    spans = sorted(outside.values())
    assert all(before[1] < after[0] for before, after in itertools.pairwise(spans))
    assert all(
        document.layers.get(line.dxf.layer).dxf.linetype == "DASHED" for line in lines if "BLIND" in line.dxf.layer
    )


def test_arcs_of_a_profile_are_few_tangent_and_near():
    curve = ParallelCurve(drive().wave_generator.profile, 3.0)
    outline = outline_of(curve)
    assert len(outline) <= 256
    assert np.abs(curve.deviation(sample(outline, (0.1, 0.37, 0.63, 0.9)))).max() <= ARC_TOLERANCE
    start, end = outline[:, :2], np.roll(outline[:, :2], -1, 0)
    chord = np.arctan2(*(end - start).T[::-1])
    leaving, arriving = chord - 2 * np.arctan(outline[:, 2]), chord + 2 * np.arctan(outline[:, 2])
    corner = np.angle(np.exp(1j * (np.roll(leaving, -1) - arriving)))
    assert np.abs(corner).max() < 1e-9


@given(
    semi_minor=st.floats(20, 29.9),
    share=st.floats(0.01, 0.9),
)
@settings(max_examples=25, deadline=None)
def test_arcs_follow_any_allowed_parallel_curve(semi_minor, share):
    profile = Ellipse(30.0, semi_minor)
    curve = ParallelCurve(profile, share * semi_minor**2 / 30.0)
    outline = outline_of(curve)
    assert enclosed_area(outline) == pytest.approx(curve.area, abs=ARC_TOLERANCE * curve.perimeter + 1e-9)


def test_outlines_of_features_enclose_their_areas():
    for bore in (KeywayBore(7, key_for_bore(14), 0.4), DBore(7, 5.6, 2.0)):
        assert enclosed_area(outline_of_bore(bore)) == pytest.approx(bore.area_with_disc(0.0), rel=1e-12)
    slot = Slot(6, 3, 15, 1.0, 15, closed=True)
    assert enclosed_area(outline_of_slot(slot)) == pytest.approx(slot.area, rel=1e-12)
    assert enclosed_area(outline_of(Circle(5, 1))) == pytest.approx(25 * np.pi, rel=1e-12)


def test_stl_and_3mf_hold_the_made_parts(tmp_path):
    files = {"stl": tmp_path / "wave.stl", "3mf": tmp_path / "wave.3mf"}
    result = export_drive(drive(structure=Structure.AUTOMATIC), files)
    made = [part for part in result.model.parts if not part.context]
    content = files["stl"].read_bytes()
    assert not content.startswith(b"solid")
    count = int.from_bytes(content[80:84], "little")
    assert len(content) == 84 + 50 * count
    rows = (
        np.frombuffer(content[84:], dtype=np.uint8).reshape(count, 50)[:, :48].copy().view("<f4").reshape(count, 4, 3)
    )
    corners = rows[:, 1:].astype(float)
    volume = np.linalg.det(corners).sum() / 6
    assert volume == pytest.approx(sum(part.volume for part in made), rel=2e-3)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.all(np.einsum("ij,ij->i", normal, rows[:, 0]) >= 0)
    with zipfile.ZipFile(files["3mf"]) as archive:
        assert archive.testzip() is None
        text = archive.read("3D/3dmodel.model").decode()
    assert 'unit="millimeter"' in text and 'id="0"' not in text
    for part in made:
        assert f'name="{part.name}"' in text
