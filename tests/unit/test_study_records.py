"""Every key of a study reaches its own field of the record, in its unit: each is given another number."""

import math

import numpy as np
import pytest

from hdopt.drive.geometry import DriveGeometry
from hdopt.drive.profiles import MeasuredProfile, parallel_profile
from hdopt.drive.roundness import MeasuredRoundness, read_roundness
from hdopt.drive.teeth import MeasuredTeeth, read_teeth
from hdopt.errors import HdoptError
from hdopt.study.costs import ExponentialRow, PiecewiseRow, PowerRow, ReciprocalRow, TableRow
from hdopt.study.drive import (
    ClearancesSection,
    DriveSection,
    MaterialSection,
    RoundnessSection,
    TeethSection,
    WaveGeneratorSection,
)
from hdopt.study.tolerances import (
    BetaRow,
    ContributorRow,
    GradedTeethRow,
    HalfNormalRow,
    LogNormalRow,
    NormalRow,
    PositionZoneRow,
    RayleighRow,
    TriangularRow,
    UniformRow,
)

DRIVE = {
    "flexspline_teeth": 100,
    "circular_spline_teeth": 102,
    "module_mm": 0.5,
    "pressure_angle_deg": 20.0,
    "flexspline_inner_radius_mm": 24.0,
    "flexspline_addendum_mm": 0.31,
    "circular_spline_addendum_mm": 0.32,
    "flexspline_wall_mm": 0.7,
    "contact": "flanks",
}
FACTORS = {"_mm": 1.0, "_mpa": 1.0, "_deg": math.pi / 180, "_um": 1e-3}


def in_base_units(values):
    """Field of the record -> its number, for keys that are named like it with their unit behind."""
    found = {}
    for key, value in values.items():
        ending = next((one for one in FACTORS if key.endswith(one)), "")
        found[key.removesuffix(ending)] = value * FACTORS[ending] if ending else value
    return found


@pytest.mark.parametrize(
    ("section", "values", "renamed"),
    [
        (DriveSection, DRIVE, {}),
        (
            ClearancesSection,
            {
                "backlash_mm": 0.01,
                "cross_slide_clearance_mm": 0.02,
                "slot_1_width_mm": 3.0,
                "slot_2_width_mm": 4.0,
                "disc_radius_mm": 15.0,
            },
            {"cross_slide_clearance": "cross_slide"},
        ),
        (MaterialSection, {"modulus_mpa": 2e5, "poisson": 0.31, "endurance_mpa": 450.0}, {}),
    ],
)
def test_every_key_of_a_section_is_its_own_field(section, values, renamed):
    """Would catch two keys exchanged, one left out, a unit."""
    built = section(**values).build()
    for name, value in in_base_units(values).items():
        assert getattr(built, renamed.get(name, name)) == pytest.approx(value), name


@pytest.mark.parametrize(
    ("row", "values"),
    [
        (NormalRow, {"mean": 0.3, "std": 0.2}),
        (UniformRow, {}),
        (TriangularRow, {"minimum": 0.1, "mode": 0.3, "maximum": 0.9}),
        (RayleighRow, {"scale": 0.4}),
        (HalfNormalRow, {"scale": 0.4}),
        (LogNormalRow, {"median": 0.4, "log_std": 0.3}),
        (BetaRow, {"a": 2.0, "b": 3.0, "minimum": 0.1, "maximum": 0.9}),
    ],
)
def test_every_key_of_a_distribution_is_its_own_field(row, values, tmp_path):
    kind = row.model_fields["distribution"].annotation.__args__[0]
    given = {**values, "lower": 0.15, "upper": 0.85}
    built = row(distribution=kind, **given).build(tmp_path)
    assert {name: getattr(built, name) for name in given} == given


def test_a_position_zone_is_a_disc_of_half_its_diameter(tmp_path):
    """A point uniform on a disc of radius R lies within r with probability (r/R)^2."""
    uniform = PositionZoneRow(distribution="position_zone", diameter=0.2).build(tmp_path)
    assert uniform.quantile(np.array([0.25, 0.81])) == pytest.approx([0.05, 0.09])
    normal = PositionZoneRow(distribution="position_zone", diameter=0.2, std=0.03).build(tmp_path)
    assert (normal.scale, normal.support) == (0.03, (0.0, 0.1))


@pytest.mark.parametrize(
    ("row", "place", "cost"),
    [
        (ReciprocalRow(model="reciprocal", a=1.0, b=2.0), 0.5, 1 + 2 / 0.5),
        (PowerRow(model="power", a=1.0, b=2.0, k=0.5), 0.25, 1 + 2 / 0.5),
        (ExponentialRow(model="exponential", a=2.0, b=0.5, fixed=3.0), 0.5, 3 + 2 / math.e),
        (PiecewiseRow(model="piecewise", points=[[1.0, 5.0], [2.0, 3.0]]), 1.5, 4.0),
    ],
)
def test_a_cost_is_that_of_its_keys(row, place, cost):
    assert float(row.build(None).cost(place)) == pytest.approx(cost)


def test_grades_of_a_standard_are_by_diameter_and_module_times_the_factor():
    """ISO 1328-1 class 7 at d = 120 mm and m = 3 mm: 2 (0.002 d + 0.55 sqrt d + 0.7 m + 12) um."""
    row = {"model": "table", "grades": [{"grade": 7, "cost": 2.0}], "system": "iso1328", "factor": 0.5}
    (grade,) = TableRow(**row).build((3.0, 120.0)).grades
    assert grade.tolerance == pytest.approx(0.5 * 2 * (0.24 + 0.55 * 120**0.5 + 2.1 + 12) / 1000)
    assert grade.cost == 2.0
    row = {"model": "table", "grades": [{"grade": "IT7", "cost": 1.0}], "system": "iso286", "nominal_mm": 30.0}
    (grade,) = TableRow(**row, factor=0.5).build(None).grades
    assert grade.tolerance == pytest.approx(0.5 * 0.021)  # 18 to 30 mm, its upper end among them


def test_pitch_tolerances_are_in_micrometres_with_all_that_goes_with_them():
    row = GradedTeethRow(single_pitch_um=5.0, cumulative_pitch_um=17.0, share=0.9, spectrum="one_wave", sine="beside")
    built = row.build("cs_teeth", 0.4, 162)
    assert (built.tolerances.single, built.tolerances.cumulative) == pytest.approx((0.005, 0.017))
    assert (built.share, built.family, built.sine) == (0.9, "one_wave", True)


def test_a_callout_has_its_length_and_spread():
    row = ContributorRow(callout="perpendicularity", value_mm=0.02, feeds="axis_tilt_x_deg", length_mm=25.0, spread=0.2)
    contributor, distribution = row.build("face")
    assert contributor.error_per_mm == pytest.approx(1 / 25)
    assert (contributor.value, contributor.feeds) == (0.02, "axis_tilt")
    wider = row.model_copy(update={"spread": 0.3}).build("face")[1]
    assert float(wider.quantile(np.array([0.5]))[0]) != float(distribution.quantile(np.array([0.5]))[0])


def test_measured_teeth_have_their_place_and_their_centre(tmp_path):
    angle = 2 * math.pi * np.arange(100) / 100
    deviations = 3 * np.sin(angle) + np.cos(5 * angle)
    rows = [f"{i + 1},left,{value:.9f}" for i, value in enumerate(deviations)]
    (tmp_path / "teeth.csv").write_text("tooth,flank,fp_um\n" + "\n".join(rows) + "\n")
    values = read_teeth(tmp_path / "teeth.csv", 100, "left")
    keys = {"file": "teeth.csv", "flank": "left", "first_tooth_deg": 30.0}
    for kind in ("cumulative", "single"):
        for recentre in (True, False):
            built = TeethSection(**keys, deviation=kind, recentre=recentre).build(100, 0.4, tmp_path)
            assert built == MeasuredTeeth.of(values, kind, math.pi / 6, recentre, source="teeth.csv")


def test_measured_teeth_are_numbered_either_way_and_have_either_sign(tmp_path):
    """Seen from the other face an inspector numbers counterclockwise: after tooth 1 comes his last. Faults caught: a
    key that does nothing, a table that is turned with its first tooth."""
    rows = [f"{i},left,{value}" for i, value in enumerate((8, 1, 2, 0, 5, 3, -4, -15), 1)]
    (tmp_path / "teeth.csv").write_text("tooth,flank,fp_um\n" + "\n".join(rows) + "\n")
    keys = {"file": "teeth.csv", "deviation": "cumulative", "first_tooth_deg": 90.0, "recentre": False}
    built = {
        (numbered, sign): TeethSection(**keys, numbered=numbered, sign=sign).build(8, 0.4, tmp_path)
        for numbered in ("clockwise", "counterclockwise")
        for sign in (1, -1)
    }
    clockwise, counter = [8, 1, 2, 0, 5, 3, -4, -15], [8, -15, -4, 3, 5, 0, 2, 1]
    for (numbered, sign), teeth in built.items():
        expected = [0.001 * sign * um for um in (clockwise if numbered == "clockwise" else counter)]
        assert teeth.deviations == pytest.approx(expected, abs=1e-12)
        assert teeth.first_angle == math.pi / 2
    assert TeethSection(**keys).build(8, 0.4, tmp_path) == built["clockwise", 1]


def test_a_measured_ring_has_its_filter_its_zero_and_its_sense(tmp_path):
    angle = 2 * math.pi * np.arange(360) / 360
    radii = 32 + 0.004 * np.cos(angle - 0.3) + 0.002 * np.cos(3 * angle)
    rows = [f"{math.degrees(a):.9f},{r:.9f}" for a, r in zip(angle, radii, strict=True)]
    (tmp_path / "ring.csv").write_text("angle_deg,radius_mm\n" + "\n".join(rows) + "\n")
    points = read_roundness(tmp_path / "ring.csv")
    for sense in ("clockwise", "counterclockwise"):
        for recentre in (True, False):
            section = RoundnessSection(file="ring.csv", upr=15, zero_deg=40.0, angles=sense, recentre=recentre)
            expected = MeasuredRoundness.of(
                *points,
                15,
                zero=math.radians(40),
                counterclockwise=sense == "counterclockwise",
                recentre=recentre,
                source="ring.csv",
            )
            assert section.build(0.396, tmp_path) == expected


def test_a_measured_cam_lies_inside_the_bearing(tmp_path):
    angle = np.arange(0, 360, 2.0)
    radius = 24 + 0.4 * np.cos(2 * np.radians(angle))
    rows = [f"{a},{r:.9f}" for a, r in zip(angle, radius, strict=True)]
    (tmp_path / "cam.csv").write_text("angle_deg,radius_mm\n" + "\n".join(rows) + "\n")
    keys = {"profile": "measured", "width_mm": 8.0, "file": "cam.csv", "noise_um": 2.0, "bearing_thickness_mm": 3.0}
    table = MeasuredProfile.from_csv(tmp_path / "cam.csv", 0.002)
    phi = np.linspace(0, 2 * math.pi, 7)
    for surface, inside, expected in (("bearing", 24.0, table), ("cam", 27.0, parallel_profile(table, 3.0))):
        drive = DriveGeometry(100, 102, 0.5, math.radians(20), inside)
        built = WaveGeneratorSection(**keys, surface=surface).build_profile(drive, tmp_path)
        assert built.radius(phi) == pytest.approx(expected.radius(phi), abs=1e-9)


@pytest.mark.parametrize(
    ("surface", "times", "said"),
    [
        (
            "bearing",
            1000,
            r"at 24400 mm on the major axis, 2\.438e\+04 mm beyond drive\.flexspline_inner_radius_mm = 24;",
        ),
        ("bearing", 2, "at 48.8 mm on the major axis, 24.8 mm beyond"),
        ("bearing", 1 / 25.4, "at 0.96063 mm on the major axis, 23.04 mm below"),
        ("cam", 1, "at 27.4 mm on the major axis, 3.4 mm beyond"),
    ],
    ids=["um", "diameters", "inches", "the bearing called a cam"],
)
def test_a_measured_curve_of_another_size_is_refused(surface, times, said, tmp_path):
    """As an ellipse of that size is: its error was computed, with a note that the teeth miss each other by 23 mm."""
    angle = np.arange(0, 360, 2.0)
    radius = (24 + 0.4 * np.cos(2 * np.radians(angle))) * times
    rows = [f"{a},{r:.9f}" for a, r in zip(angle, radius, strict=True)]
    (tmp_path / "cam.csv").write_text("\n".join(rows))
    keys = {"profile": "measured", "width_mm": 8.0, "file": "cam.csv", "bearing_thickness_mm": 3.0}
    drive = DriveGeometry(100, 102, 0.5, math.radians(20), 24.0)
    with pytest.raises(HdoptError, match=rf"{said}.*measure radii in mm from the axis, and say by surface"):
        WaveGeneratorSection(**keys, surface=surface).build_profile(drive, tmp_path)


@pytest.mark.parametrize(
    ("unit", "tolerance"),
    [("nm", 33e3), ("um", 33.0), ("\u00b5m", 33.0), ("mm", 0.033), ("cm", 0.0033), ("m", 33e-6), ("in", 0.033 / 25.4)],
)
def test_grades_of_a_standard_come_in_the_unit_of_the_stack(unit, tolerance):
    """IT8 from 18 to 30 mm is 33 um (ISO 286-1, Table 1). Fault caught: millimetres taken for the stack's own unit,
    which makes the grade a thousand times too fine in um; and a factor, a ratio of lengths, that is not one."""
    row = {"model": "table", "grades": [{"grade": "IT8", "cost": 1.0}], "system": "iso286", "nominal_mm": 20.0}
    assert TableRow(**row).build(None, unit).grades[0].tolerance == pytest.approx(tolerance, rel=1e-12)
    assert TableRow(**row, factor=0.5).build(None, unit).grades[0].tolerance == pytest.approx(tolerance / 2, rel=1e-12)


def test_grades_of_a_standard_for_an_angle_need_a_factor():
    """An angle of 0.013 mm over 20 mm is 0.013/20 rad. Fault caught: 0.013 mm read as 0.013 deg; a factor of 1 that
    was written taken for none; and one that converts a unit once more."""
    row = {"model": "table", "grades": [{"grade": "IT6", "cost": 1.0}], "system": "iso286", "nominal_mm": 20.0}
    with pytest.raises(
        HdoptError, match=r"in 'deg', which is no length .*write factor = the tolerance in deg for each"
    ):
        TableRow(**row).build(None, "deg")
    over_20_mm = TableRow(**row, factor=math.degrees(1 / 20)).build(None, "deg").grades[0].tolerance
    assert over_20_mm == pytest.approx(0.013 / 20 * 180 / math.pi)
    assert TableRow(**row, factor=1.0).build(None, "deg").grades[0].tolerance == pytest.approx(0.013)
    with pytest.raises(HdoptError, match="factor is 1000, the um in a mm; .* leave it out"):
        TableRow(**row, factor=1000.0).build(None, "um")


def test_grades_that_a_study_states_itself_are_in_its_own_unit():
    """Fault caught: a conversion of tolerances that no standard gives."""
    row = TableRow(model="table", grades=[{"grade": "A", "tolerance": 4.0, "cost": 1.0}])
    assert [row.build(None, unit).grades[0].tolerance for unit in ("um", "in", "deg")] == [4.0, 4.0, 4.0]
