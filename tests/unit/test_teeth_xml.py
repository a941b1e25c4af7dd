"""Measured teeth from XML files whose schema nobody knows beforehand."""

import numpy as np
import pytest

from hdopt.drive.teeth_xml import read_teeth_xml
from hdopt.drive.values import DriveError
from hdopt.errors import HdoptError
from hdopt.study import load_study

LEFT, RIGHT = np.linspace(-3, 4, 9).round(3), np.linspace(5, -2, 9).round(3)
BOTH = enumerate(zip(LEFT, RIGHT, strict=True), start=1)
EACH = "".join(f"<Tooth no='{k}'><Left>{a}</Left><Right>{b}</Right></Tooth>" for k, (a, b) in BOTH)
FILES = {
    "an element a tooth": (f"<Gear xmlns='urn:gear'><Pitch>{EACH}</Pitch></Gear>", ".//Tooth/Left"),
    "a list by its attribute": (
        f"<g:Gear xmlns:g='urn:gear'><g:Pitch g:flank='right'>{' '.join(map(str, RIGHT))}</g:Pitch>"
        f"<g:Pitch g:flank='left'>{'; '.join(map(str, LEFT))}</g:Pitch></g:Gear>",
        ".//Pitch[@flank='left']",
    ),
    "lists in parts": (f"<a><b><v>{LEFT[0]},{LEFT[1]}</v><v>{' '.join(map(str, LEFT[2:]))}</v></b></a>", "b/v"),
}  # fmt: skip


XML = ('xml_path = "v"', 'xml_unit = "um"')


@pytest.fixture
def file(tmp_path):
    def write(text, name="teeth.xml"):
        (tmp_path / name).write_text(text, encoding="utf-8")
        return tmp_path / name

    return write


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize(("unit", "factor"), [("um", 1e-3), ("mm", 1.0)])
def test_numbers_stand_in_the_order_of_the_file(file, name, unit, factor):
    """Would catch the other flank, an order by value, and units a thousand times off."""
    text, where = FILES[name]
    assert read_teeth_xml(file(text), 9, where, unit) == pytest.approx(factor * LEFT, abs=1e-15)


@pytest.mark.parametrize(
    ("where", "unit", "said"),
    [
        (None, "um", r"say where its deviations stand.*with 9 numbers the file has './Pitch/Tooth/Left'"),
        (".//Tooth/Left", None, "say the unit of its deviations: xml_unit = 'um' or 'mm'"),
        (".//Tooth/Left", "inch", "say the unit of its deviations"),
        (".//Tooth", "um", r"finds 0 numbers; this spline has 9 teeth. with 9 numbers the file has './Pitch/Tooth/L"),
        (".//Tooth/*", "um", "finds 18 numbers; this spline has 9 teeth"),
        (".//Tooth[", "um", "is no path"),
        ("//Tooth/Left", "um", "is no path"),
        ("", "um", "finds 0 numbers"),
        (".//Note", "um", "finds text that is no number"),
    ],
)
def test_what_does_not_give_one_number_a_tooth_is_refused(file, where, unit, said):
    text = FILES["an element a tooth"][0].replace("<Pitch>", "<Note>drawn by hand</Note><Pitch>")
    with pytest.raises(DriveError, match=said) as refused:
        read_teeth_xml(file(text), 9, where, unit)
    assert "drawn by hand" not in str(refused.value)


def test_paths_of_more_numbers_are_listed_with_their_counts(file):
    """A list of both flanks under one name: an attribute tells them apart."""
    with pytest.raises(DriveError, match=r"no path of the file has 9 numbers; more have ./Pitch \(18\): choose by"):
        read_teeth_xml(file(FILES["a list by its attribute"][0]), 9, None, "um")
    with pytest.raises(DriveError, match="no path of the file has 9 numbers or more"):
        read_teeth_xml(file("<a><b>1</b></a>"), 9, None, "um")


@pytest.mark.parametrize(
    "text",
    [
        "tooth,flank,fp_um\n1,left,2.0\n",
        "<a><b>1</a>",
        "",
        "<!DOCTYPE a [<!ENTITY x 'y'>]><a>&x;</a>",
        "<?xml version='1.0' encoding='no-such'?><a/>",
    ],
    ids=["CSV", "not closed", "empty", "DOCTYPE", "unknown encoding"],
)
def test_a_file_that_is_no_plain_xml_is_refused(file, text):
    with pytest.raises(DriveError, match=r"teeth\.xml: cannot be read as XML"):
        read_teeth_xml(file(text), 9, ".//b", "um")


def test_a_number_that_is_not_finite_is_refused(file, tmp_path):
    text = "<a>" + "".join(f"<v>{value}</v>" for value in [*np.zeros(161), "nan"]) + "</a>"
    file(text)
    study = ('drive = "csf-25-80"', "[cs_teeth]", 'file = "teeth.xml"', 'deviation = "single"', *XML)
    (tmp_path / "s.toml").write_text("\n".join(study), encoding="utf-8")
    with pytest.raises(HdoptError, match="holds a deviation that is not finite"):
        _ = load_study(tmp_path / "s.toml").drive


def test_a_study_takes_them_as_it_takes_a_table(file, tmp_path):
    """The same drive from XML and from CSV; what belongs to the other is refused."""
    pitch = np.random.default_rng(1).normal(0, 4, 162).round(3)
    file("<a>" + "".join(f"<v>{value}</v>" for value in pitch) + "</a>")
    file("\n".join(f"{k + 1},left,{value}" for k, value in enumerate(pitch)), "teeth.csv")

    def drive(name, *more):
        text = ['drive = "csf-25-80"', "[cs_teeth]", f'file = "{name}"', 'deviation = "single"', *more]
        (tmp_path / "s.toml").write_text("\n".join(text), encoding="utf-8")
        return load_study(tmp_path / "s.toml").drive

    assert drive("teeth.xml", *XML).cs_teeth.deviations == pytest.approx(drive("teeth.csv").cs_teeth.deviations)
    with pytest.raises(HdoptError, match="is no XML file"):
        drive("teeth.csv", *XML)
    with pytest.raises(HdoptError, match="its flank is said by xml_path"):
        drive("teeth.xml", *XML, 'flank = "left"')


@pytest.mark.parametrize("text", ["{}", " {} ", "{} ; {}", "{};{}", "{} {}"])
def test_decimal_commas_are_no_further_numbers(tmp_path, text):
    """Half as many elements as teeth, each with a comma, passed for all teeth: 1,25 was 1 and 25."""
    given = [-1.25, 0.5, 3e-1, 12.75, 0.0, -0.125, 2.5, 7.75]
    words = [f"{value:.3f}".replace(".", ",") for value in given]
    each = text.count("{}")
    elements = (text.format(*words[i : i + each]) for i in range(0, len(words), each))
    (tmp_path / "t.xml").write_text(f"<g>{''.join(f'<v>{one}</v>' for one in elements)}</g>")
    assert read_teeth_xml(tmp_path / "t.xml", 8, ".//v", "mm").tolist() == pytest.approx(given)
    with pytest.raises(DriveError, match="finds 8 numbers; this spline has 16 teeth"):
        read_teeth_xml(tmp_path / "t.xml", 16, ".//v", "mm")


def test_commas_part_numbers_that_have_points_or_stand_in_a_row(tmp_path):
    (tmp_path / "t.xml").write_text("<g><v>1.5,2.5</v><v>3, 4, 5</v><v>6,7,8</v></g>")
    assert read_teeth_xml(tmp_path / "t.xml", 8, ".//v", "mm").tolist() == [1.5, 2.5, 3, 4, 5, 6, 7, 8]
