"""Study files: what is read, what --set changes, and what every fault is told."""

import math

import pytest

from hdopt.drive.geometry import Structure
from hdopt.errors import HdoptError
from hdopt.study import load_study, shipped_drives, shipped_studies
from hdopt.study.tolerances import RequirementSection

OWN = """
[drive]
flexspline_teeth = 200
circular_spline_teeth = 202
module_mm = 0.25
pressure_angle_deg = 20
flexspline_inner_radius_mm = 24.2
[wave_generator]
profile = "two_disk"
structure = "one_way_minor"
width_mm = 7.5
wrap_angle_deg = 30
[errors]
wg_eccentricity_mm = 0.004
wg_eccentricity_direction_deg = 10
axis_tilt_x_deg = 0.1
"""


@pytest.fixture
def write(tmp_path):
    def written(text, name="mine.toml"):
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return written


def test_an_own_drive_is_read_into_base_units(write):
    study = load_study(write(OWN))
    assert study.name == "mine"
    assert study.drive.geometry.ratio == 100
    assert study.drive.geometry.pressure_angle == pytest.approx(math.radians(20))
    assert study.drive.wave_generator.structure is Structure.ONE_WAY_MINOR
    assert study.drive.wave_generator.profile.semi_major == pytest.approx(24.45)
    assert study.errors.axis_tilt_x == pytest.approx(math.radians(0.1))
    assert study.errors.axis_eccentricity == 0


def test_the_shipped_drive_is_the_one_of_the_paper():
    drive = load_study().drive
    assert (drive.geometry.ratio, drive.geometry.module, drive.wave_generator.width) == (80, 0.396, 9.0)
    assert drive.wave_generator.profile.semi_minor == 30.318
    assert drive.load.torque == 63_000


@pytest.mark.parametrize("name", shipped_studies())
def test_every_shipped_study_loads(name):
    study = load_study(name)
    assert study.title
    if "drive" in study.sections:
        assert study.drive


def test_a_section_is_what_its_reader_takes_it_for():
    study = load_study(overrides=["requirement.yield=0.99"])
    assert study.section("requirement", RequirementSection).required_yield == 0.99
    assert study.find("export", RequirementSection) is None
    with pytest.raises(TypeError, match="tolerances.* is a TolerancesSection, not a RequirementSection"):
        study.find("tolerances", RequirementSection)
    with pytest.raises(HdoptError, match="a shop needs a .export. section, which csf-25-80.toml does not have; add it"):
        study.section("export", RequirementSection, "a shop")


def test_a_misspelt_key_in_a_file_is_answered_with_the_name_that_the_file_uses(write):
    with pytest.raises(HdoptError, match="unknown key 'yeild'; did you mean 'yield'"):
        load_study(write(OWN + "[requirement]\npeak_to_peak_arcmin = 1\nyeild = 0.9\n"))


@pytest.mark.parametrize("name", shipped_drives())
def test_every_shipped_drive_loads_by_name(name):
    assert load_study(drive=name).drive


def test_a_study_starts_from_the_shipped_drive_it_names(write):
    study = load_study(write('drive = "csf-25-80"\n[wave_generator]\nwidth_mm = 7\n[errors]\nwg_tilt_major_deg = 0\n'))
    assert study.drive.wave_generator.width == 7
    assert study.drive.wave_generator.profile.semi_minor == 30.318
    assert study.errors.wg_tilt_major == 0
    assert study.errors.axis_eccentricity == 0.010


def test_a_drive_option_takes_the_place_of_the_studys_own(write):
    study = load_study(write(OWN), drive="csf-25-80")
    assert study.drive.geometry.ratio == 80
    assert study.errors.wg_eccentricity == 0.004


@pytest.mark.parametrize(
    ("override", "read"),
    [
        ("wave_generator.width_mm=8", lambda study: study.drive.wave_generator.width == 8),
        ("width_mm=8", lambda study: study.drive.wave_generator.width == 8),
        ("structure=automatic", lambda study: study.drive.wave_generator.structure is Structure.AUTOMATIC),
        ("axis_eccentricity_mm=0.02", lambda study: study.errors.axis_eccentricity == 0.02),
        (" module_mm = 0.4 ", lambda study: study.drive.geometry.module == 0.4),
    ],
)
def test_set_changes_a_key_by_last_name_or_path(override, read):
    assert read(load_study(overrides=[override]))


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("widht_mm=8", "--set unknown key 'widht_mm'; did you mean 'width_mm'?"),
        ("wave_generator.widht_mm=8", "did you mean 'wave_generator.width_mm'?"),
        ("upper=8", "--set upper: ambiguous; write tolerances"),
        ("width_mm", "--set 'width_mm' has no '='; write KEY=VALUE"),
        ("width_mm=-1", "--set wave_generator.width_mm: is -1; it must be greater than or equal to 0.1"),
        ("width_mm=wide", "--set wave_generator.width_mm: is 'wide'; it must be a number"),
        ("width_mm=inf", "--set wave_generator.width_mm: is inf; it must be a finite number"),
        ("structure=floating", "is 'floating'; it must be 'integral', 'automatic'"),
        ("requirement.yield=1", "--set requirement.yield: is 1; it must be less than 1"),
        ("requirement.yeild=0.99", "did you mean 'requirement.yield'?"),
        ("requirement.required_yield=0.99", "unknown key 'requirement.required_yield'"),
    ],
)
def test_set_refuses_what_it_cannot_do(override, message):
    with pytest.raises(HdoptError) as caught:
        load_study(overrides=[override])
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "module_mm = 0.25",
            "modul_mm = 0.25",
            "line 5, drive.modul_mm: unknown key 'modul_mm'; did you mean 'module_mm'?",
        ),
        ("module_mm = 0.25", "", "mine.toml, line 2, drive.module_mm: is missing; give it"),
        ("module_mm = 0.25", "module_mm = -0.25", "line 5, drive.module_mm: is -0.25; it must be greater"),
        ("module_mm = 0.25", "module_mm = nan", "line 5, drive.module_mm: is nan; it must be a finite number"),
        ("module_mm = 0.25", 'module_mm = "0.25"', "line 5, drive.module_mm: is '0.25'; it must be a number"),
        ("module_mm = 0.25", "module_mm = ", "mine.toml is not valid TOML: Invalid value (at line 5"),
        ("= 202", "= 199", "circular_spline_teeth is 199, flexspline_teeth is 200; the circular spline must have more"),
        ("= 202", "= 204", "the tooth difference is 4 (204 - 200); the model is of two-lobed wave generators"),
        ("= 202", "= 202.5", "line 4, drive.circular_spline_teeth: is 202.5; it must be a whole number"),
        (
            "wrap_angle_deg = 30",
            "wrap_angle_deg = 90",
            "line 12, wave_generator.wrap_angle_deg: is 90; it must be less",
        ),
        ("wrap_angle_deg = 30", "", "line 8, wave_generator: the two-disk profile needs wave_generator.wrap_angle_deg"),
        ('"two_disk"', '"twodisk"', "line 9, wave_generator.profile: is 'twodisk'; it must be 'ellipse'"),
        ('"two_disk"', '"measured"', "the measured profile needs wave_generator.file"),
        ('"two_disk"', '"measured"\nfile = "none.csv"', 'say what the measured file shows: surface = "cam"'),
        ('"two_disk"', '"measured"\nfile = "none.csv"\nsurface = "cam"', "none.csv: cannot be read"),
        ('"two_disk"', '"ellipse"\nsemi_minor_mm = 25', "semi_minor is 25 mm, semi_major 24.45 mm; the minor axis"),
        ("[errors]", "[erors]", "mine.toml, line 13, erors: unknown section 'erors'; did you mean 'errors'?"),
        ("wg_eccentricity_direction_deg = 10", "", "wg_eccentricity_mm needs errors.wg_eccentricity_direction_deg"),
        ("wg_eccentricity_mm = 0.004", "wg_eccentricity_mm = -0.004", "it must be greater than or equal to 0"),
        ("[drive]", 'drive = "csf-25"\n[drives]', "line 2, drive: unknown drive 'csf-25'; did you mean 'csf-25-80'?"),
    ],
)
def test_every_fault_of_a_study_file_is_one_clear_message(write, old, new, message):
    assert old in OWN
    with pytest.raises(HdoptError) as caught:
        study = load_study(write(OWN.replace(old, new, 1)))
        assert study.drive and study.errors
    assert message in str(caught.value)


def test_files_that_cannot_be_read(tmp_path):
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00\x01")
    (tmp_path / "latin.toml").write_bytes(b'drive = "csf-25-80"\n# 3 \xb5m\n')
    (tmp_path / "cut.toml").write_text('drive = "csf-25-80"\n[errors]\naxis_tilt_x_deg')
    for name, message in (
        ("none.toml", "cannot read"),
        ("binary.toml", "is not a text file: line 1, byte 0 is not UTF-8"),
        ("latin.toml", "is not a text file: line 2, byte 24 is not UTF-8"),
        ("cut.toml", "(at the end, line 3)"),
    ):
        with pytest.raises(HdoptError) as caught:
            load_study(tmp_path / name)
        assert message in str(caught.value)
    with pytest.raises(HdoptError, match=r"unknown study 'csf-25-08'; did you mean 'csf-25-80'"):
        load_study("csf-25-08")


def test_a_study_without_errors_says_so_where_they_are_needed(write):
    study = load_study(write(OWN.split("[errors]")[0]))
    assert study.drive
    with pytest.raises(HdoptError, match=r"needs a \[errors\] section"):
        _ = study.errors
