"""A file that is not what it should be: exit status 1, the fault named, and no file left that looks finished."""

from __future__ import annotations

import math

import cadquery as cq
import pytest
from wave_generators import drive

from hdopt.cli import main
from hdopt.geometry import solids, step
from hdopt.geometry.arcs import _biarcs
from hdopt.geometry.check import CheckFailed
from hdopt.geometry.export import export_drive
from hdopt.geometry.options import ExportOptions

pytestmark = pytest.mark.slow


def coarse_splines(monkeypatch):
    """Splines of 8 spans: a fine-looking cam, a micrometre off."""
    monkeypatch.setattr(solids, "spans_needed", lambda curve: 8)


def a_scaled_ellipse(monkeypatch):
    """The cam as an ellipse of the right axes instead of the parallel curve: at most 0.23 um off."""
    curve_type = solids.ParallelCurve

    def points(self, phi):
        import numpy as np

        phi, (right, top) = np.atleast_1d(phi), self.box[2:]
        u = np.arctan2(np.sin(phi) / right, np.cos(phi) / top)
        return np.stack([right * np.sin(u), top * np.cos(u)], 1)

    monkeypatch.setattr(curve_type, "points", points)
    monkeypatch.setattr(solids, "BUILD_TOLERANCE", math.inf)
    monkeypatch.setattr("hdopt.geometry.arcs.ARC_TOLERANCE", math.inf)


def a_forgotten_countersink(monkeypatch):
    monkeypatch.setattr(
        "hdopt.geometry.part.countersink_tool", lambda *_: cq.Solid.makeSphere(0.1, cq.Vector(0, 0, 99))
    )


def inches(monkeypatch):
    rename(monkeypatch, "SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT(.CENTI.,.METRE.)")


def another_name(monkeypatch):
    rename(monkeypatch, "'cam'", "'can'")


def another_study(monkeypatch):
    rename(monkeypatch, "fingerprint ", "fingerprint 0")


def a_shifted_part(monkeypatch):
    original = step.write_step

    def write(path, parts, *rest):
        shift = cq.Location(cq.Vector(0, 0, -0.2))
        moved = [(part, cq.Solid(solid.moved(shift).wrapped) if part.name == "cam" else solid) for part, solid in parts]
        original(path, moved, *rest)

    monkeypatch.setattr(step, "write_step", write)


def rename(monkeypatch, old: str, new: str) -> None:
    original = step.write_step

    def write(path, *rest):
        original(path, *rest)
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))

    monkeypatch.setattr(step, "write_step", write)


FAULTS = {
    coarse_splines: "um off the analytic curve; 0.05 um are allowed",
    a_scaled_ellipse: "um off the analytic curve; 0.05 um are allowed",
    a_forgotten_countersink: "hub has a volume of",
    inches: "unit of length is not the millimetre",
    another_name: "holds the parts hub, can, not hub, cam",
    another_study: "its header does not say 'hdopt",
    a_shifted_part: "cam spans",
}


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.__name__)
def test_fault_in_a_step_file(fault, monkeypatch, tmp_path, capsys):
    fault(monkeypatch)
    with pytest.raises(SystemExit) as stopped:
        main(["export", "--step", str(tmp_path / "wave.step"), "--dxf", str(tmp_path / "wave.dxf")])
    said = capsys.readouterr()
    assert stopped.value.code == 1
    assert FAULTS[fault] in said.err and said.out == ""
    assert list(tmp_path.iterdir()) == []


def test_a_file_of_an_earlier_export_stays(monkeypatch, tmp_path):
    target = tmp_path / "wave.step"
    export_drive(drive(), {"step": target}, name="first")
    before = target.read_bytes()
    coarse_splines(monkeypatch)
    with pytest.raises(CheckFailed):
        export_drive(drive(), {"step": target}, name="second")
    assert target.read_bytes() == before and list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("$INSUNITS\n 70\n4\n", "$INSUNITS\n 70\n1\n", "unit is not the millimetre"),
        ("\n 70\n1\n 10\n", "\n 70\n0\n 10\n", "is not closed"),
        ("fingerprint ", "fingerprint 0", "does not name the study"),
    ],
)
def test_fault_in_a_dxf_file(old, new, message, monkeypatch, tmp_path):
    from hdopt.geometry import dxf

    original = dxf.write_dxf

    def write(path, job):
        original(path, job)
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))

    monkeypatch.setattr(dxf, "write_dxf", write)
    with pytest.raises(CheckFailed, match=message):
        export_drive(drive(), {"dxf": tmp_path / "wave.dxf"})
    assert list(tmp_path.iterdir()) == []


def test_coarse_arcs_fail_the_check_of_a_dxf(monkeypatch, tmp_path):
    from hdopt.geometry import arcs, cut_outlines, dxf

    coarse = cut_outlines.outline_of

    def write_with_coarse_arcs(path, job):
        with monkeypatch.context() as patched:
            patched.setattr(arcs, "ARC_TOLERANCE", 0.1)
            original(path, job)

    original = dxf.write_dxf
    monkeypatch.setattr(dxf, "write_dxf", write_with_coarse_arcs)
    with pytest.raises(CheckFailed, match="um off the analytic curve"):
        export_drive(drive(), {"dxf": tmp_path / "wave.dxf"})
    assert coarse is cut_outlines.outline_of and _biarcs is arcs._biarcs


def test_hole_in_a_mesh(monkeypatch, tmp_path):
    from hdopt.geometry import mesh

    original = mesh.triangles

    def torn(solid):
        found, vertices, indices = original(solid)
        return found[1:], vertices, indices[1:]

    monkeypatch.setattr(mesh, "triangles", torn)
    # Coarse: a hole is a hole.
    monkeypatch.setattr(mesh, "CHORD", 0.1)
    monkeypatch.setattr(mesh, "ANGLE", 0.5)
    plain = ExportOptions(hub=False, mount="plain", chamfer_mm=0, lead_in_length_mm=0)
    for kind in ("stl", "3mf"):
        with pytest.raises(CheckFailed, match="is not closed: an edge lacks its neighbour"):
            export_drive(drive("two_disk"), {kind: tmp_path / f"wave.{kind}"}, plain)
    assert list(tmp_path.iterdir()) == []
