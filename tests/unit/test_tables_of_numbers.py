"""CSV files that a study names: a spoilt row is no header, columns go by their names, decimal commas are read."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from hdopt.drive.profiles import MeasuredProfile, read_polar
from hdopt.drive.roundness import read_roundness
from hdopt.drive.teeth import read_teeth
from hdopt.errors import HdoptError
from hdopt.tolerance.distributions import MeasuredSample

ANGLES = np.arange(0, 360, 5.0)
RADII = 24.0 + 0.5 * np.cos(2 * np.radians(ANGLES))
ROWS = [f"{a:.1f},{r:.9f}" for a, r in zip(ANGLES, RADII, strict=True)]
TEETH = [f"{tooth},left,{tooth / 10}" for tooth in range(1, 21)]
SAMPLE = ["0.001", "0.003", "0.002"]


def profile_of(path):
    return MeasuredProfile.from_csv(path)


def teeth_of(path):
    return read_teeth(path, 20)


READERS = {
    "cam": (profile_of, ROWS, "0.0,24.5x"),
    "ring": (read_roundness, ROWS, "0.0,24.5x"),
    "teeth": (teeth_of, TEETH, "1,left,O.1"),
    "sample": (MeasuredSample.from_csv, SAMPLE, "0.00l"),
}


@pytest.mark.parametrize("name", READERS)
def test_a_spoilt_first_row_is_no_header(name, tmp_path):
    """It was taken for one and left out without a word."""
    read, rows, spoilt = READERS[name]
    (path := tmp_path / "table.csv").write_text("\n".join([spoilt, *rows[1:]]))
    with pytest.raises(HdoptError, match=rf"line 1: '{re.escape(spoilt)}'; each line must hold"):
        read(path)


@pytest.mark.parametrize("name", READERS)
def test_words_stand_above_the_first_row_below_comments_and_blank_lines(name, tmp_path):
    read, rows, _ = READERS[name]
    (path := tmp_path / "table.csv").write_text("# Rig 3\n\nmeasured values\n" + "\n".join(rows))
    read(path)


@pytest.mark.parametrize("end", ["", ";"])
def test_a_sample_has_decimal_commas_like_every_other_table(end, tmp_path):
    text = f"\ufeffRundlauf [mm]\r\n0,004{end}\r\n0,001{end}\r\n-2,5e-3{end}\r\n"
    (path := tmp_path / "sample.csv").write_text(text, encoding="utf-8")
    assert MeasuredSample.from_csv(path).support == (-0.0025, 0.004)


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_named_columns_are_found_by_their_names(mark, tmp_path):
    """A file that `hdopt compare` takes is one for a study too; radii before angles were read as angles."""
    rows = [mark.join((f"{i}", f"{r:.9f}", f"{a:.1f}", "")) for i, (a, r) in enumerate(zip(ANGLES, RADII, strict=True))]
    (path := tmp_path / "cam.csv").write_text("\n".join([mark.join(("point", "radius_mm", "angle_deg")), *rows]))
    angles, radii = read_polar(path, "cam")
    assert angles == pytest.approx(np.radians(ANGLES))
    assert radii == pytest.approx(RADII, abs=1e-9)


def test_what_a_measuring_machine_writes_above_the_names_is_left_out(tmp_path):
    """But no row of numbers. Faults caught: a second line above the header that ends the reading, rows that are left
    out with it."""
    rows = [f"{a:.1f};{r:.9f}" for a, r in zip(ANGLES, RADII, strict=True)]
    above = ["Prisma 5", "Auftrag 17;4.5.2026", "Pruefer;A. B.;;"]
    (path := tmp_path / "cam.csv").write_text("\n".join([*above, "angle_deg;radius_mm", *rows]))
    assert read_polar(path, "cam")[1] == pytest.approx(RADII, abs=1e-9)
    path.write_text("\n".join([rows[0], "angle_deg;radius_mm", *rows[1:]]))
    with pytest.raises(HdoptError, match="line 2: 'angle_deg;radius_mm'; each line must hold two numbers"):
        read_polar(path, "cam")


def test_a_turn_in_radians_is_told_from_a_gap():
    """Faults caught: no word of it, or that word of degrees with a gap."""
    turn = np.radians(np.radians(ANGLES))
    with pytest.raises(HdoptError, match="gaps of up to 30 deg are allowed; these look like angles in rad, give them"):
        MeasuredProfile(turn, RADII)
    half = ANGLES < 180
    with pytest.raises(HdoptError, match="are allowed$"):
        MeasuredProfile(np.radians(ANGLES[half]), RADII[half])


@pytest.mark.parametrize("reversed_", [False, True])
def test_a_last_point_that_closes_the_turn_is_left_out(reversed_, tmp_path):
    rows = [*ROWS, ROWS[0].replace("0.0,", "360.0,", 1)]
    (path := tmp_path / "cam.csv").write_text("\n".join(rows[::-1] if reversed_ else rows))
    assert len(MeasuredProfile.from_csv(path).angles) == len(ROWS)
    assert len(read_roundness(path)[0]) == len(ROWS)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("angle_deg,diameter_mm\n0,49", "line 1: 'angle_deg,diameter_mm' names diameter; give angles in deg and radii"),
        (
            "x_mm,y_mm\n0,24.5",
            "names x_mm; give angles in deg and radii in mm, and name the columns angle_deg,radius_mm",
        ),
        ("Winkel [gon],Radius [mm]\n0,24.5", "names gon; give angles in deg"),
        ("angle_deg,radius_mm\n0,0,24,5\n", "'0,0,24,5'; .* between decimal commas, semicolons must part the cells"),
        ("0,0,24,5\n", "'0,0,24,5'; .* between decimal commas, semicolons must part the cells"),
        (
            "angle_deg,radius_mm\n0,24.5\n5,nan\n",
            "line 3: '5,nan'; each line must hold finite numbers; leave the point out",
        ),
    ],
)
def test_what_a_table_of_a_curve_holds_else_is_named_with_its_line(text, said, tmp_path):
    (path := tmp_path / "cam.csv").write_text(text)
    with pytest.raises(HdoptError, match=said):
        read_polar(path, "cam")


def test_a_radius_of_nothing_is_named_with_its_angle():
    angles = np.radians(ANGLES)
    radii = np.where(ANGLES == 20, -1.0, RADII)
    with pytest.raises(HdoptError, match="has the radius -1 mm at 20 deg; radii must be above 0, in the second column"):
        MeasuredProfile(angles, radii)
    assert math.isclose(MeasuredProfile(angles, RADII).semi_major, 24.5, rel_tol=1e-6)
