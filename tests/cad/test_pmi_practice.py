"""AP242 text against the recommended practices, by a reader that knows no CAD kernel: each rule finds its own fault."""

from __future__ import annotations

import re

import pytest
from wave_generators import drive

from hdopt.drive.geometry import Structure
from hdopt.geometry.formats import FORMATS
from hdopt.geometry.job import make_job
from hdopt.geometry.options import ExportOptions
from hdopt.geometry.part21_repair import repaired
from hdopt.geometry.pmi_practice import arguments, departures, record

pytestmark = pytest.mark.slow

BOUNDS = {"wg_eccentricity_mm": 0.0075, "wg_tilt_major_deg": 0.1, "wg_tilt_minor_deg": 0.1}


@pytest.fixture(scope="module")
def text(tmp_path_factory):
    target = tmp_path_factory.mktemp("pmi") / "wave.step"
    job = make_job(drive(), ExportOptions(step_schema="AP242"), "x", BOUNDS)
    FORMATS["step"].write(target, job)
    return target.read_text(encoding="latin-1")


def test_a_written_file_keeps_the_practices(text):
    assert departures(text) == []


@pytest.mark.parametrize(
    ("profile", "structure"), [("two_disk", Structure.AUTOMATIC), ("ellipse", Structure.ONE_WAY_MAJOR)]
)
def test_other_structures_keep_them(profile, structure, tmp_path):
    job = make_job(drive(profile, structure), ExportOptions(step_schema="AP242"), "x", BOUNDS)
    FORMATS["step"].write(tmp_path / "wave.step", job)
    assert departures((tmp_path / "wave.step").read_text(encoding="latin-1")) == []


USAGE = r"GEOMETRIC_ITEM_SPECIFIC_USAGE\('','',#(\d+),#"

# What a fault replaces (a pattern, whose first place counts), by what, and what is then said.
FAULTS = {
    "a limit without its type": (
        r"LENGTH_MEASURE_WITH_UNIT\(LENGTH_MEASURE\((\S+?)\),",
        r"MEASURE_WITH_UNIT(\1,",
        "has no type",
    ),
    "a limit that is no length": (
        r"= LENGTH_MEASURE_WITH_UNIT\(",
        "= MEASURE_WITH_UNIT(",
        "a length is a LENGTH_MEASURE",
    ),
    "a reference into nothing": (
        r"DATUM_SYSTEM\('','',#\d+,\.F\.,\(#\d+",
        "DATUM_SYSTEM('','',#46,.F.,(#999999",
        "not in the file",
    ),
    "a zone of zero": (r"LENGTH_MEASURE\(7\.[58]E-03\)", "LENGTH_MEASURE(0.)", "no magnitude above 0"),
    "a tolerance of no kind": (r"POSITION_TOLERANCE\(\)", "ROUGHNESS_TOLERANCE()", "geometric tolerance of no kind"),
    "an unknown zone": ("'cylindrical or circular'", "'round'", "form the practices do not know"),
    "a datum in two letters": (r",\.F\.,'A'\)", ",.F.,'AB')", "one letter"),
    "one letter twice": (r",\.F\.,'B'\)", ",.F.,'A')", "A is the letter of several datums"),
    "a datum of the product's shape": (
        r"DATUM\('','',#(\d+),\.F\.",
        r"DATUM('','',#\1,.T.",
        "not product-definitional",
    ),
    "an unknown size": (r"'diameter'\)", "'width')", "unknown kind 'width'"),
    "a nominal without its name": ("'nominal value'", "'value'", "'nominal value'"),
    "limits of nothing": (r"PLUS_MINUS_TOLERANCE\(", "SOMETHING_ELSE(", "has no limits"),
    "density by volume": (r"(DERIVED_UNIT_ELEMENT\(#\d+),-3\.", r"\1,3.", "unit of the density"),
    "no revision": (r"PRODUCT_DEFINITION_FORMATION\('[0-9a-f]+'", "PRODUCT_DEFINITION_FORMATION(''", "has no revision"),
    "no number": (r"PRODUCT\('WG[^']*'", "PRODUCT(''", "one has none"),
    "a face of nowhere": (USAGE + r"(\d+),\s*#\d+", r"USED(#\1,#\2,#46", "belongs to no face"),
    "a face of another part": (USAGE + r"\d+", r"USED(#\1,#10", "face of another part"),
    "a datum without a feature": (r"DATUM_FEATURE\(\)", "", "established by 0 datum features"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_each_rule_finds_its_fault(fault, text):
    pattern, instead, said = FAULTS[fault]
    instead = instead.replace("USED(", "GEOMETRIC_ITEM_SPECIFIC_USAGE('','',")
    faulty, count = re.subn(pattern, instead, text, count=1)
    assert count == 1 and faulty != text
    assert any(said in failure for failure in departures(faulty)), departures(faulty)


def test_datums_of_another_part_are_found(text):
    """The hub's tolerance with the cam's datum system."""
    systems = re.findall(r"#(\d+) = DATUM_SYSTEM\('','',#(\d+)", text)
    first = systems[0]
    other = next(system for system in systems if system[1] != first[1])
    faulty = text.replace(f"REFERENCE((#{first[0]}))", f"REFERENCE((#{other[0]}))")
    assert faulty != text
    assert any("datums of another part" in failure for failure in departures(faulty))


def test_records_are_read_with_their_strings_and_lists():
    body = "( A_B((#1,#2),'a,(b') B('it''s',$,(1.,2.)) )"
    assert record(body, "B") == ["'it''s'", "$", "(1.,2.)"]
    assert record(body, "A_B") == ["(#1,#2)", "'a,(b'"]
    assert record(body, "A") is None
    assert arguments("X('',(#3),.F.)") == ["''", "(#3)", ".F."]


def test_repair_types_lengths_and_drops_the_zones_of_run_outs():
    written = (
        "#7 = MEASURE_WITH_UNIT(-1.5E-02,#1);\n#8 = TOLERANCE_VALUE(#7,#7);\n"
        "#9 = RUNOUT_ZONE_DEFINITION(#3,());\n#10 = RUNOUT_ZONE_ORIENTATION(#11);\n"
        "#11 = PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.),\n  #2);\n#12 = DATUM('','',#1,.F.,'A');\n"
    )
    assert repaired(written) == (
        "#7 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(-1.5E-02),#1);\n#8 = TOLERANCE_VALUE(#7,#7);\n"
        "#12 = DATUM('','',#1,.F.,'A');\n"
    )
    assert repaired("#1 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.),#2);\n").count("LENGTH_MEASURE_WITH_UNIT") == 1
