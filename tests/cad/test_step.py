"""STEP files of every profile and structure, judged from the file."""

from __future__ import annotations

from dataclasses import replace

import cadquery as cq
import numpy as np
import pytest
from wave_generators import drive

from hdopt.drive.geometry import Clearances, Structure
from hdopt.drive.profiles import Ellipse, Resal, TwoDisk
from hdopt.geometry.assembly import wave_generator_model
from hdopt.geometry.check import PROFILE_TOLERANCE, interferences
from hdopt.geometry.export import export_drive
from hdopt.geometry.options import ExportOptions
from hdopt.geometry.step import read_step

QUICK = {
    *(("ellipse", structure) for structure in Structure),
    *((profile, Structure.INTEGRAL) for profile in ("resal", "two_disk", "measured")),
    ("two_disk", Structure.AUTOMATIC),
}

PARTS = {
    Structure.INTEGRAL: ["hub", "cam"],
    Structure.AUTOMATIC: ["input_disc", "floating_disc", "cam"],
    Structure.ONE_WAY_MAJOR: ["input_disc", "cam"],
    Structure.ONE_WAY_MINOR: ["input_disc", "cam"],
}


EVERY_PROFILE_AND_STRUCTURE = [
    # The parallel curve is the same whatever hangs on it: the quick checks take each structure and each profile once.
    pytest.param(profile, structure, marks=[] if quick else pytest.mark.slow)
    for profile in ("ellipse", "resal", "two_disk", "measured")
    for structure in Structure
    for quick in [(profile, structure) in QUICK]
]


@pytest.mark.parametrize(("profile", "structure"), EVERY_PROFILE_AND_STRUCTURE)
def test_every_profile_and_structure_passes_its_check(exported, profile, structure):
    result = exported(profile, structure)
    names = [part["name"] for part in result.to_dict()["parts"]]
    expected = PARTS[structure]
    if profile == "two_disk":
        discs = ["eccentric_hub", "disc_1", "disc_2"]
        expected = [name for name in expected if name not in ("cam", "hub")] + discs
    assert names == expected
    assert 0 < result.to_dict()["max_profile_deviation_um"] <= PROFILE_TOLERANCE * 1e3 or profile == "two_disk"
    assert list(result.files["step"].parent.iterdir()) == [result.files["step"]]


@pytest.mark.slow
@pytest.mark.parametrize(("radius", "seed"), [(9.0, 1), (17.0, 2), (55.0, 3), (120.0, 4)])
def test_rules_make_a_wave_generator_of_every_size(radius, seed, tmp_path):
    """Without a word in [export]: from finger to dinner-plate size, all profiles, all structures in turn."""
    rng = np.random.default_rng(seed)
    deflection, thickness = radius * rng.uniform(0.006, 0.03), radius * rng.uniform(0.05, 0.18)
    profiles = (
        Ellipse.of_equal_perimeter(radius, radius + deflection),
        Resal(radius, deflection),
        TwoDisk(radius, deflection, np.radians(rng.uniform(10, 75))),
    )
    for profile, structure in zip(profiles, rng.permutation(np.array(Structure, dtype=object)), strict=False):
        one = drive(structure=structure, profile=profile, width=0.3 * radius, bearing_thickness=thickness)
        clearances = Clearances(0.01, 0.02, 0.2 * radius, 0.2 * radius, 0.5 * radius)
        result = export_drive(replace(one, clearances=clearances), {"step": tmp_path / "wave.step"})
        assert result.profile_deviation_um <= PROFILE_TOLERANCE * 1e3


def test_file_names_the_study_and_colours_its_parts(exported):
    result = exported("ellipse", Structure.AUTOMATIC, step_schema="AP242")
    text = result.files["step"].read_text()
    assert "study test study" in text and result.identity.fingerprint in text
    assert "AP242_MANAGED_MODEL" in text.split("FILE_SCHEMA")[1].split("ENDSEC")[0]
    file = read_step(result.files["step"])
    assert len({part.colour for part in file.parts}) == 3
    assert "'AUTOMOTIVE_DESIGN" in exported("ellipse").files["step"].read_text()


def test_another_reader_finds_the_cam(exported):
    """CadQuery's plain importer, sections and measures: none of the code that wrote or checked the file."""
    solids = cq.importers.importStep(str(exported("ellipse").files["step"])).solids().vals()
    cam = min(solids, key=lambda solid: solid.BoundingBox().zlen)
    box = cam.BoundingBox()
    assert (box.zmin, box.zmax) == pytest.approx((-4.5, 4.5), abs=1e-6)
    middle = cam.intersect(cq.Face.makePlane(80, 80)).Faces()[0]
    x, y = np.array([middle.outerWire().positionAt(t).toTuple()[:2] for t in np.linspace(0, 1, 401)]).T
    # The inner parallel of an ellipse has the normal of the ellipse: P - t n, here solved for without hdopt.
    profile = drive("ellipse").wave_generator.profile
    a, b = profile.semi_major, profile.semi_minor
    u = np.linspace(0, 2 * np.pi, 200001)
    length = np.hypot(a * np.sin(u), b * np.cos(u))
    ox, oy = b * np.sin(u) - 3 * a * np.sin(u) / length, a * np.cos(u) - 3 * b * np.cos(u) / length
    nearest = [np.hypot(ox - px, oy - py).min() for px, py in zip(x, y, strict=True)]
    # The nearest of the points is up to half their spacing (0.9 mm/1000) away.
    assert max(nearest) < 5e-4
    assert (x.max(), y.max()) == pytest.approx((b - 3, a - 3), abs=1e-6)


def test_interference_is_found(exported):
    """The check of interference can fail: a part pushed by a hair into its neighbour is reported."""
    file = read_step(exported("ellipse", Structure.AUTOMATIC).files["step"])
    assert interferences(file.parts) == []

    def moved(name: str, *by: float):
        shift = cq.Location(cq.Vector(*by))
        return [
            replace(part, shape=part.shape.moved(shift), solids=tuple(s.moved(shift) for s in part.solids))
            if part.name == name
            else part
            for part in file.parts
        ]

    # The block has 0.01 mm of clearance to either side, the discs 0.1 mm of axial play.
    assert interferences(moved("input_disc", 0.009, 0, 0)) == []
    assert "input_disc and floating_disc overlap" in interferences(moved("input_disc", 0.011, 0, 0))[0]
    assert "floating_disc and cam overlap" in interferences(moved("cam", 0, 0, -0.101))[0]


@pytest.mark.slow
@pytest.mark.parametrize("profile", ["ellipse", "two_disk"])
def test_context_stands_around_without_touching(exported, profile):
    result = exported(profile, context=True)
    context = [part["name"] for part in result.to_dict()["parts"] if part["context"]]
    assert context == ["bearing_inner_race", "bearing_outer_race", "flexspline_ring", "circular_spline"]
    model = wave_generator_model(drive(profile), ExportOptions(context=True))
    file = read_step(result.files["step"])
    rings = [part for part in model.parts if part.context]
    assert interferences(file.parts, rings) == []
    # A flexspline ring that reaches 0.01 mm further in than the file's outer race ends.
    index = [part.name for part in rings].index("flexspline_ring")
    body = rings[index].body[0]
    rings[index] = replace(rings[index], body=(replace(body, inner=body.inner.inward(0.01)),))
    pair = [part for part in file.parts if part.name in ("bearing_outer_race", "flexspline_ring")]
    assert any("bearing_outer_race and flexspline_ring" in line for line in interferences(pair, rings))


def test_flat_of_a_d_bore_has_no_invalid_curve(exported, tmp_path):
    """Judged at every point of every curve on its surfaces, which Open CASCADE's usual check is not."""
    from OCP.BRepCheck import BRepCheck_Analyzer

    from hdopt.geometry.step import read_step

    result = exported("ellipse", hub=False, mount="d_bore")
    (solid,) = read_step(result.files["step"]).parts[0].solids
    assert BRepCheck_Analyzer(solid.wrapped, True, False, True).IsValid()
