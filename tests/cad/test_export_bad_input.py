"""Input that no wave generator can be made from: one clear message, exit status 2, nothing half-written."""

from __future__ import annotations

import pytest
from click.testing import CliRunner
from wave_generators import drive

from hdopt.cli import main

SLIDING = ("--structure", "automatic")

CASES = {
    "bore larger than the cam": (
        ("--set", "bore_mm=60"),
        "bore is larger than the cam allows: it may have at most 50.6",
    ),
    "bore larger than the input disc": (
        ("--structure", "one_way_major", "--set", "bore_mm=29"),
        "bore is larger than the input disc allows: it may have at most 26 mm",
    ),
    "no room for the hub": (
        ("--set", "bore_mm=40", "--set", "hub=true"),
        r"the hub's seat of 54 mm is larger than the cam allows: 50\.64 mm, .* export.hub = false",
    ),
    "keyway through the wall": (
        ("--set", "bore_mm=50", "--set", "hub=false"),
        r"keyway .* goes through the wall of the cam: it reaches 29\.\d+ mm",
    ),
    "keyway through a hub's wall": (
        ("--set", "hub_seat_mm=19"),
        r"keyway .* goes through the wall of the hub: it reaches 9\.\d+ mm .* smaller export.bore_mm",
    ),
    "bore without a key": (("--set", "bore_mm=5", "--set", "mount=keyway"), "no keyway in DIN 6885-1"),
    "bearing too thick": (
        ("--set", "bearing_thickness_mm=29.7"),
        "crosses itself: .* 29.61 mm; give a thinner bearing",
    ),
    # hypot(1 - r, 4 - r) + r with the keyway's corner radius r = 0.12 mm.
    "bearing leaves no room": (
        ("--set", "bearing_thickness_mm=27", "--set", "bore_mm=6"),
        "goes through the wall of the cam: it reaches 4.099 mm",
    ),
    "clearance closes a slot": (
        (*SLIDING, "--set", "cross_slide_clearance_mm=5.5"),
        "the clearance closes the slot: a block of 0.5 mm is left",
    ),
    "slot past the rim": (
        (*SLIDING, "--set", "disc_radius_mm=26"),
        "reaches 29.*the cam allows 25.*smaller.*disc_radius",
    ),
    "slot deeper than the disc": (
        (*SLIDING, "--set", "slot_depth_mm=6", "--set", "disc_thickness_mm=7"),
        "is 6 mm in a disc 7 mm thick; 2 mm have to be left",
    ),
    "nothing to slide in": ((*SLIDING, "--set", "axial_gap_mm=4"), "do not reach into them"),
    "bolts in a sliding cam": ((*SLIDING, "--set", "bolt_count=6"), "cam of the automatic structure slides"),
    "bolt circle too wide": (("--set", "bolt_circle_mm=52"), r"bolt circle of 52 mm .* may have .* to 47"),
    "too many bolts": (("--set", "bolt_count=24"), "run into each other"),
    "flat outside the bore": (("--set", "mount=d_bore", "--set", "d_flat_mm=8"), "less than 7 mm from the axis"),
    "edges wider than the rim": (("--set", "lead_in_length_mm=8.8"), "leave nothing of a rim 9 mm wide"),
    "disc journal too small": (
        ("--set", "profile=two_disk", "--set", "journal_radius_mm=10"),
        "journals have a radius",
    ),
    "narrower than a wall": (("--set", "width_mm=1.0"), "cam: its axial width is 1 mm; 2 mm are needed"),
    "almost no width": (("--set", "width_mm=0.001"), r"width_mm: is 0\.001; it must be greater than or equal to 0\.1"),
    "no seat for the bearing": (
        ("--set", "lead_in_length_mm=5"),
        r"leave the bearing less than half of a rim 9 mm wide; give a smaller export.chamfer_mm",
    ),
    "sliver between two holes": (
        ("--set", "bolt_count=19"),
        r"the web between two bolt holes is 1\.9[0-9]* mm; 2 mm are needed",
    ),
    "flange of little thread": (
        ("--set", "hub_flange_thickness_mm=0.5"),
        r"M3 x 8, engages 0 mm of thread.* 3 mm are needed in steel .* give export.hub_flange_thickness_mm = 3",
    ),
    "thin flange": (
        ("--set", "hub_flange_thickness_mm=0.5", "--set", "bolt_count=0"),
        r"hub: its axial width is 0\.5 mm; 2 mm are needed .* change export.hub_flange_thickness_mm",
    ),
    "countersinks meet": (("--set", "bore_chamfer_mm=4.2"), "the bore that its countersinks leave|between counters"),
    "countersunk flat": (
        ("--set", "mount=d_bore", "--set", "bore_chamfer_mm=0.5", "--set", "hub=false"),
        "a D-bore is not countersunk: its edges are broken by hand",
    ),
    "fit that nobody knows": (("--set", "shaft_fit=H7/g9"), "the fit 'H7/g9' is not known; give one of H7/h6"),
    "bound that nothing keeps": (
        ("--set", "tolerances.wg_eccentricity_mm.upper=2e-5", "--set", "tolerances.wg_eccentricity_mm.scale=1e-5"),
        "leaves a zone below 0.5 um, which no shop holds",
    ),
    "unknown mount": (("--set", "mount=glue"), "'glue'; it must be 'keyway', 'd_bore' or 'plain'"),
    "unknown key": (("--set", "export.bore=3"), "did you mean 'export.bore_mm'"),
    "negative chamfer": (("--set", "export.chamfer_mm=-1"), "greater than or equal to 0"),
}


@pytest.mark.parametrize("case", CASES)
def test_refused_with_a_message_and_nothing_written(case, tmp_path, capsys):
    arguments, message = CASES[case]
    target = tmp_path / "wave.step"
    with pytest.raises(SystemExit) as stopped:
        main(["export", "csf-25-80", "--step", str(target), "--dxf", str(tmp_path / "wave.dxf"), *arguments])
    assert stopped.value.code == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.startswith("hdopt: ")
    assert _found(message, said.err), said.err
    assert list(tmp_path.iterdir()) == []


def test_folder_that_cannot_be_written(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "missing", tmp_path / "file"):
        with pytest.raises(SystemExit) as stopped:
            main(["export", "--dxf", str(tmp_path / "wave.dxf"), "--step", str(folder / "wave.step")])
        assert stopped.value.code == 2
        assert "give a file in a folder that exists and can be written" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_target_that_is_a_folder_or_named_twice(tmp_path, capsys):
    for arguments, message in (
        (["--step", str(tmp_path / "w.txt")], "w.txt does not end in .step or .stp"),
        (["--dxf", str(tmp_path / "w.step")], "w.step does not end in .dxf"),
        (["--step", "/dev/null"], "null does not end in .step or .stp"),
        (["--step", str(tmp_path)], "it is a folder; give the name of a file"),
        (["--step", str(tmp_path / "a"), "--dxf", str(tmp_path / "a")], "is given for two outputs"),
    ):
        with pytest.raises(SystemExit) as stopped:
            main(["export", *arguments])
        assert stopped.value.code == 2 and message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_missing_numbers_are_named():
    from dataclasses import replace

    from hdopt.drive.geometry import Clearances, Structure
    from hdopt.errors import MissingValue
    from hdopt.geometry.export import export_drive

    with pytest.raises(MissingValue, match=r"needs wave_generator\.bearing_thickness_mm"):
        export_drive(drive(bearing_thickness=None), {})
    bare = replace(drive(structure=Structure.ONE_WAY_MINOR), clearances=Clearances())
    with pytest.raises(
        MissingValue, match=r"clearances\.cross_slide_clearance_mm and .*disc_radius_mm and .*slot_2_wid"
    ):
        export_drive(bare, {})


def test_machine_without_the_libraries_of_cadquery(monkeypatch, tmp_path):
    import sys

    from hdopt.errors import HdoptError
    from hdopt.geometry.export import export_drive

    monkeypatch.setitem(sys.modules, "cadquery", None)
    files = tmp_path / "files"
    files.mkdir()
    with pytest.raises(HdoptError, match=r"CadQuery is not installed; pip install cadquery"):
        export_drive(drive(), {"step": files / "wave.step"})
    (tmp_path / "cadquery.py").write_text("raise ImportError('libGL.so.1: cannot open shared object file')")
    monkeypatch.delitem(sys.modules, "cadquery")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(HdoptError, match="CadQuery cannot be loaded .* on Debian install libgl1"):
        export_drive(drive(), {"step": files / "wave.step"})
    assert list(files.iterdir()) == []
    export_drive(drive(), {"dxf": files / "wave.dxf"})


def test_help_names_every_format():
    from hdopt.cli.export import command
    from hdopt.geometry.formats import FORMATS

    text = CliRunner().invoke(command, ["--help"]).output
    assert all(f"--{kind} " in text for kind in FORMATS)


def _found(pattern: str, text: str) -> bool:
    import re

    return re.search(pattern, text, re.DOTALL) is not None
