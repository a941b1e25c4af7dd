"""Drawing sheets: texts that never overlap, datums that are all there and all used, what a shop needs to be told."""

from __future__ import annotations

import itertools
import math
import re
from collections import Counter

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from wave_generators import drive, scaled

from hdopt.drive.geometry import Structure
from hdopt.geometry import assembly_sheet as assembly_drawing
from hdopt.geometry.assembly_sheet import uncrossed
from hdopt.geometry.balloons import APART, RADIUS, places_around
from hdopt.geometry.callouts import callouts_of
from hdopt.geometry.digits import rounded
from hdopt.geometry.drawing import Placed
from hdopt.geometry.export import export_drive
from hdopt.geometry.inspection import inspection_plan
from hdopt.geometry.job import make_job
from hdopt.geometry.mating import MatingRow
from hdopt.geometry.mating_drawing import allowed, fill_mating_sheet, sums
from hdopt.geometry.options import ExportOptions
from hdopt.geometry.part_sheets import sheets
from hdopt.geometry.sheet import Area, Line, Ring, Sheet, Solid, label_box, text_width
from hdopt.geometry.sheet_details import outline
from hdopt.geometry.sheet_title import HEIGHT, WIDTH
from hdopt.geometry.undercut import AT_SHOULDER, IN_CORNER, Undercut

pytestmark = pytest.mark.slow

BOUNDS = {"wg_eccentricity_mm": 0.0075, "wg_tilt_major_deg": 0.1, "wg_tilt_minor_deg": 0.1}
AXIS = {"axis_eccentricity_mm": 0.015, "axis_tilt_y_deg": 0.2, "axis_tilt_x_deg": 0.2}

CASES = [
    ("ellipse", Structure.INTEGRAL, 1.0),
    ("ellipse", Structure.AUTOMATIC, 0.4),
    ("ellipse", Structure.ONE_WAY_MAJOR, 4.0),
    ("resal", Structure.ONE_WAY_MINOR, 1.0),
    ("two_disk", Structure.INTEGRAL, 4.0),
    ("two_disk", Structure.AUTOMATIC, 4.0),
    ("two_disk", Structure.ONE_WAY_MAJOR, 0.4),
    ("two_disk", Structure.ONE_WAY_MINOR, 0.2),
    ("ellipse", Structure.INTEGRAL, 0.1958),
    ("two_disk", Structure.INTEGRAL, 0.1958),
    ("two_disk", Structure.INTEGRAL, 1.9576),
    ("ellipse", Structure.AUTOMATIC, 1.9576),
    ("measured", Structure.INTEGRAL, 1.0),
]
"""Every structure with a cam and with discs; drives of 12 mm and 120 mm within, and others up to 250 mm."""


def job_of(profile, structure, scale):
    made = drive(profile, structure)
    return make_job(made if scale == 1.0 else scaled(made, scale), ExportOptions(), "csf-25-80", BOUNDS | AXIS)


@pytest.mark.parametrize(("profile", "structure", "scale"), CASES)
def test_no_text_lies_on_another_or_off_the_sheet(profile, structure, scale):
    job = job_of(profile, structure, scale)
    drawn = sheets(job)
    assert len(drawn) == 2 + len(job.made)
    for sheet in drawn:
        boxes = [(label.content, label_box(label)) for label in sheet.labels if label.content]
        for content, (left, top, right, low) in boxes:
            assert left > 10 and top > 10 and right < WIDTH - 10 and low < HEIGHT - 10, content
        for (first, a), (second, b) in itertools.combinations(boxes, 2):
            apart = a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]
            assert apart, f"{sheet.title}: {first!r} lies on {second!r}"
        assert crossed(sheet) == [], sheet.title
        assert cut_without_outline(sheet) == [], sheet.title


def cut_without_outline(sheet):
    """Hatched faces whose outermost points no visible line passes: a section of loose hatches. Details, on
    the right, end in the open."""
    seen = np.concatenate(
        [mark.points for mark in sheet.marks if isinstance(mark, Line) and mark.kind == "visible"] or [[(0, 0)]]
    )
    cut = [mark.outer for mark in sheet.marks if isinstance(mark, Area) and mark.outer[:, 0].max() < 270]
    far = [ring[at] for ring in cut for at in (*ring.argmin(0), *ring.argmax(0))]
    return [tuple(point) for point in far if np.hypot(*(seen - point).T).min() > 0.2]


def test_every_cut_face_has_its_own_outline(monkeypatch):
    """Whatever lies behind it: each ring of a hatched face is a closed visible line, hole or outside."""
    monkeypatch.setattr(assembly_drawing, "draw_view", lambda *_: None)
    sheet = Sheet(WIDTH, HEIGHT, "section", "")
    assembly_drawing.draw_section(sheet, Placed((90.0, 96.0), 1.0), list(job_of(*CASES[0]).made))
    closed = [mark.points for mark in sheet.marks if isinstance(mark, Line) and mark.kind == "visible" and mark.closed]
    areas = [mark for mark in sheet.marks if isinstance(mark, Area)]
    assert len(areas) > 2
    for area in areas:
        for ring in (area.outer, *area.holes):
            assert any(len(line) == len(ring) and np.allclose(line, ring) for line in closed)


def crossed(sheet):
    """Texts that a line runs through or comes nearer to than 0.2 mm: it enters the box between its two ends."""
    pieces = []
    for mark in sheet.marks:
        if isinstance(mark, Ring):
            turn = np.linspace(0, 2 * np.pi, 61)
            points = np.column_stack([np.cos(turn), np.sin(turn)]) * mark.radius + mark.centre
        elif isinstance(mark, Line):
            points = np.vstack([mark.points, mark.points[:1]]) if mark.closed else mark.points
        else:
            continue
        pieces.append(np.stack([points[:-1], points[1:]], axis=1))
    starts, ends = np.moveaxis(np.concatenate(pieces), 1, 0)
    steps = np.where(np.abs(ends - starts) < 1e-9, 1e-9, ends - starts)
    found = []
    for label in sheet.labels:
        left, top, right, low = label_box(label)
        shares = np.sort(
            [(np.array([left, top]) - 0.2 - starts) / steps, (np.array([right, low]) + 0.2 - starts) / steps], 0
        )
        enters, leaves = np.maximum(shares[0].max(1), 0.0), np.minimum(shares[1].min(1), 1.0)
        if label.content and (enters < leaves).any():
            found.append(label.content)
    return found


def test_widths_of_texts_are_those_of_the_font():
    """Against the advance widths of DejaVu Sans itself (units of 1/2048 em): capital M has 1767, i has 569."""
    assert text_width("MMMMMMMMMM", 10.0) == pytest.approx(10 * 10 * 1767 / 2048, rel=0.02)
    assert text_width("iiiiiiiiii", 10.0) == pytest.approx(10 * 10 * 569 / 2048, rel=0.05)


@pytest.mark.parametrize("profile", ["ellipse", "resal", "two_disk"])
@pytest.mark.parametrize("structure", list(Structure))
def test_every_datum_is_drawn_once_and_used(profile, structure):
    job = job_of(profile, structure, 1.0)
    for part in job.model.parts:
        callouts = callouts_of(part, job.model)
        drawn = [callout.datum for callout in callouts if callout.datum]
        used = {letter for callout in callouts for frame in callout.frames for letter in frame.datums}
        assert len(drawn) == len(set(drawn)) and set(drawn) == used, part.name
        round_rim = profile == "two_disk"
        for callout in callouts:
            assert not (callout.boxed and "profile" in callout.lines[0] and round_rim)
            # A theoretically exact dimension has no tolerance but its frame's.
            assert callout.frames or not callout.boxed, callout.lines
            if part.name == "cam":
                assert all(frame.symbol != "coaxiality" for frame in callout.frames)


@pytest.mark.parametrize("mount", ["keyway", "d_bore"])
@pytest.mark.parametrize("structure", list(Structure))
@pytest.mark.parametrize("profile", ["ellipse", "two_disk"])
def test_what_locks_the_rotation_has_its_place_to_the_datum_before_it(profile, structure, mount):
    """A keyway, a flat, a slot or bolt holes that are a datum: general tolerances would leave them 0.1 mm and more."""
    job = make_job(drive(profile, structure), ExportOptions(mount=mount), "csf-25-80", BOUNDS | AXIS)
    plan = Counter((row.part, row.zone_mm) for row in inspection_plan(job))
    for part in job.model.parts:
        callouts = callouts_of(part, job.model)
        first = next((c.datum for c in callouts if c.datum), "")
        for callout in callouts:
            if callout.datum not in ("", first) and not callout.datum_faces:
                assert any(frame.datums == first and frame.zone <= 0.1 for frame in callout.frames), callout.lines
        measured = Counter((part.name, frame.zone) for callout in callouts for frame in callout.frames)
        assert measured <= plan, part.name


def test_a_keyway_lies_within_the_tolerance_of_its_width_and_turns_the_profile_by_little():
    """JS9 of 5 mm is +-15 um (ISO 286-2): two grooves half of 30 um off, 7 mm from the axis, turn by 30 um / 7 mm."""
    job = job_of("ellipse", Structure.INTEGRAL, 1.0)
    (keyway,) = (c for c in callouts_of(job.model.part("hub"), job.model) if "keyway" in c.lines[0])
    assert [(f.symbol, f.zone, f.datums) for f in keyway.frames] == [("symmetry", pytest.approx(0.03), "A")]
    (groove,) = (row for row in job.mating if "groove" in row.feature)
    assert groove.value_mm == pytest.approx(0.03)
    assert f"by {math.degrees(0.03 / 7):.2g} deg" in groove.requirement


@pytest.mark.parametrize(("radius", "flat"), [(1.5, 1.2), (7.0, 5.6)])
def test_flats_of_bore_and_shaft_never_meet(radius, flat):
    """Position 0.05 leaves the bore's flat up to 0.025 mm nearer to the axis, where the shaft's ends."""
    made = drive("ellipse", Structure.INTEGRAL)
    options = ExportOptions(mount="d_bore", bore_mm=2 * radius, d_flat_mm=flat)
    job = make_job(made, options, "csf-25-80", BOUNDS | AXIS)
    (row,) = (row for row in job.mating if row.feature == "flat")
    assert row.value_mm == pytest.approx(flat - 0.025)
    # Worst: the bore's flat 0.025 farther, the shaft's 0.075 nearer; the edge of the flat closes the gap.
    turn = math.degrees(0.1 / math.sqrt(radius**2 - flat**2))
    assert f"turn by {turn:.2g} deg" in row.requirement


@pytest.mark.parametrize(
    ("nominal", "limits", "said"),
    [
        (17.6184, None, 17.62),  # general: 0.2 to either side (ISO 2768-m)
        (1.9622, (0.0, 0.04), 1.963),  # a least size is rounded up, a largest one down: both on the safe side
        (0.7819, (-0.04, 0.0), 0.781),
        (105.48053, (-0.0025, 0.0025), 105.4805),
        (6.0, (0.0, 0.1), 6.0),
    ],
)
def test_sizes_are_rounded_to_their_safe_side(nominal, limits, said):
    assert rounded(nominal, limits) == said


@pytest.mark.parametrize(("profile", "structure", "scale"), [CASES[4], CASES[7], CASES[11]])
def test_no_dimension_has_digits_that_its_tolerance_makes_meaningless(profile, structure, scale):
    """A last digit is worth a twentieth of the tolerance's width at most, and a hundredth at least (but 1 um)."""
    job = job_of(profile, structure, scale)
    for row in job.dimensions:
        if row.nominal is None or row.lower is None or row.upper is None:
            continue
        wide = row.upper - row.lower
        needed = max(0, math.ceil(math.log10(20 / wide) - 1e-9))
        assert row.nominal == round(row.nominal, min(needed, 4)), row.name
    ends = [
        (row.nominal, row.nominal + (row.lower or 0), row.nominal + (row.upper or 0))
        for row in job.dimensions
        if row.nominal
    ]
    boxes = [part.contour.box for part in job.model.parts if part.contour is not None]
    exact = [size for box in boxes for size in (box[3] - box[1], box[2] - box[0])]
    known = {f"{size:.4f}" for size in [*itertools.chain.from_iterable(ends), *exact]}
    for sheet in sheets(job)[1:-1]:
        lengths = [label.content for label in sheet.labels if re.fullmatch(r"Ø?[1-9]\d*\.\d{3,}", label.content)]
        # A cam 17.6184 mm wide, with 0.2 to either side, stands there as 17.62.
        assert {f"{float(length.strip('Ø')):.4f}" for length in lengths} <= known, sheet.title


def test_frames_take_their_zones_from_the_budget():
    job = job_of("ellipse", Structure.INTEGRAL, 1.0)
    cam = [frame for callout in callouts_of(job.model.part("cam"), job.model) for frame in callout.frames]
    profile = next(frame for frame in cam if frame.symbol == "profile")
    # Half of 2 x 7.5 um for the cam's place on its bore, the other half for the seat on the hub's bore.
    assert profile.zone == pytest.approx(0.0075) and profile.datums == "DE"
    hub = [frame for callout in callouts_of(job.model.part("hub"), job.model) for frame in callout.frames]
    assert next(frame for frame in hub if frame.symbol == "coaxiality").value == "Ø0.0075"


def sheet_of(job, name):
    return next(sheet for sheet in sheets(job) if sheet.title.startswith(name))


def test_undercuts_have_details_with_their_sizes():
    job = job_of("two_disk", Structure.INTEGRAL, 1.0)
    said = [label.content for label in sheet_of(job, "eccentric hub").labels]
    # One corner at the flange, two at the step between the journals.
    assert said.count("Z") == 1 and said.count("Y") == 2
    assert "Z  20:1  DIN 509-E0.2×0.1" in said and "Y  20:1  relief" in said
    for size in ("R0.2", "R0.1", "0.6", "1"):
        assert size in said
    assert said.count("15°") == 2 and said.count("0.1") == 2
    plain = [label.content for label in sheet_of(job, "disc 1").labels]
    assert not {"Z", "Y", "15°"} & set(plain)


@pytest.mark.parametrize("undercut", [AT_SHOULDER, IN_CORNER, Undercut(2.5, 0.3, 0.6)])
def test_detail_has_the_outline_of_the_undercut(undercut):
    """Its radius, depth, length and slope, each measured on the points drawn."""
    made = outline(undercut)
    arc, foot, end = made[:-2], made[-2], made[-1]
    centre = (undercut.radius, undercut.radius - undercut.depth)
    assert np.hypot(*(arc - centre).T) == pytest.approx(np.full(len(arc), undercut.radius))
    assert arc[0] == pytest.approx((0.0, centre[1])) and arc[-1] == pytest.approx((undercut.radius, -undercut.depth))
    assert foot[1] == -undercut.depth and end == pytest.approx((undercut.length, 0.0))
    assert math.degrees(math.atan2(end[1] - foot[1], end[0] - foot[0])) == pytest.approx(15.0)


def test_countersinks_and_edges_say_at_which_end():
    model = job_of("ellipse", Structure.ONE_WAY_MINOR, 1.0).model
    cam = [line for callout in callouts_of(model.part("cam"), model) for line in callout.lines]
    assert "countersunk 0.5 × 45° at the front" in cam
    assert "outer edges: 0.3 × 45° at the back, 1 × 15° at the front" in cam


def test_slot_in_the_back_lies_hidden_in_the_front_view():
    job = job_of("ellipse", Structure.ONE_WAY_MINOR, 1.0)
    hidden = [mark for mark in sheet_of(job, "cam").marks if isinstance(mark, Line) and mark.kind == "hidden"]
    slot, scale = job.model.part("cam").slot, 2.0
    assert len(hidden) == 1
    wide, high = np.ptp(hidden[0].points, axis=0)
    # Along the minor axis, which lies across the sheet.
    assert (wide, high) == pytest.approx((scale * 2 * slot.reach, scale * slot.width), rel=1e-3)


def test_sheets_as_pdf_and_as_archive(tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1790000000")
    files = {"pdf": tmp_path / "wave.pdf", "drawings": tmp_path / "wave.zip"}
    result = export_drive(drive(), files, bounds=BOUNDS)
    assert result.checks["pdf"]["pages"] == result.checks["drawings"]["sheets"] == 4
    # A3 in points.
    box = re.search(rb"/MediaBox \[\s*0 0 ([\d.]+) ([\d.]+)\s*\]", files["pdf"].read_bytes())
    assert [float(value) * 25.4 / 72 for value in box.groups()] == pytest.approx([WIDTH, HEIGHT], abs=0.1)
    first = files["drawings"].read_bytes()
    import zipfile

    with zipfile.ZipFile(files["drawings"]) as archive:
        text = archive.read("01-hub.svg").decode()
    for said in ("M3-6H", "keyway 5 JS9", "corners R", "ISO 13715", "ISO 22081", "mass", "2026-09-21", "ISO 5459"):
        assert said in text, said
    assert first[:2] == b"PK"


def test_mating_sheet_says_every_row_and_spends_the_bound():
    job = job_of("ellipse", Structure.INTEGRAL, 1.0)
    drawn = Sheet(WIDTH, HEIGHT, "mating parts", "")
    fill_mating_sheet(drawn, job)
    said = [label.content for label in drawn.labels]
    for row in job.mating:
        assert row.feature in said and row.requirement in said
    # Four shares of e1 = 15 um, each 7.5 um on diameter; two of the tilts' 0.2 deg.
    assert said.count("0.0075") == 4 and said.count("0.00375 mm") == 4 and said.count("0.1 deg") == 2
    assert any(line.startswith("e1") and line.endswith(": 0.015 mm, within the bound of 0.015 mm") for line in said)
    assert any(line.endswith(": 0.2 deg, within the bound of 0.2 deg") for line in said)


@pytest.mark.parametrize(
    ("profile", "structure", "scale"),
    [
        ("ellipse", Structure.INTEGRAL, 1.0),
        ("two_disk", Structure.INTEGRAL, 0.1958),
        ("two_disk", Structure.AUTOMATIC, 1.9576),
    ],
)
def test_numbers_in_the_assembly_are_those_of_the_parts_list(profile, structure, scale):
    """Screws and rings too, each joined to what it is."""
    job = job_of(profile, structure, scale)
    sheet = sheet_of(job, "assembly")
    rings = [mark.centre for mark in sheet.marks if isinstance(mark, Ring) and mark.radius == RADIUS]
    numbers = [label.content for label in sheet.labels if any(math.dist(label.at, at) < 1.01 for at in rings)]
    said = [label.content for label in sheet.labels]
    listed = said[said.index("mass, g") + 1 :]
    rows = [row for row in listed if row in {str(number) for number in range(1, 10)}]
    expected = len(job.made) + 1
    assert sorted(numbers) == sorted(rows) == [str(number) for number in range(1, expected + 1)]
    # The last is what is bought; its line ends in a filled cut of the ring or at the axis of a screw.
    end = rings[numbers.index(str(expected))]
    lines = [mark.points for mark in sheet.marks if isinstance(mark, Line) and len(mark.points) == 2]
    tip = next(line[0] for line in lines if abs(math.dist(line[1], end) - RADIUS) < 1e-6)
    if profile == "ellipse":
        axes = [mark.points for mark in sheet.marks if isinstance(mark, Line) and mark.kind == "axis"]
        assert any(abs(axis[0, 1] - tip[1]) < 1e-9 and axis[:, 0].min() < tip[0] < axis[:, 0].max() for axis in axes)
        # 9 mm of cam and 3.5 mm of flange: M3 x 12 holds in three of them.
        assert "ISO 4762 - M3 × 12" in said
    else:
        cuts = [mark.points for mark in sheet.marks if isinstance(mark, Solid) and len(mark.points) == 4]
        assert len(cuts) == 2
        assert any((cut.min(0) - 1e-9 <= tip).all() and (tip <= cut.max(0) + 1e-9).all() for cut in cuts)
        ring = job.model.part("eccentric_hub").body[2].outline
        assert f"DIN 471 - {2 * ring.radius:g} x" in " ".join(said)


@given(st.lists(st.tuples(st.floats(0, 50), st.floats(0, 60)), min_size=1, max_size=8, unique=True))
@settings(max_examples=60, deadline=None)
def test_lines_to_numbers_do_not_cross(points):
    """By the angles at which the lines are seen: each pair lies wholly on one side of the other."""
    ends = [(70.0, 7.5 * row) for row in range(len(points))]
    order = uncrossed(list(zip(points, range(len(points)), strict=True)), ends)
    assert sorted(number for _, number in order) == list(range(len(points)))
    share = np.linspace(0, 1, 201)[:, None]
    for i, j in itertools.combinations(range(len(points)), 2):
        one, other = (np.array(order[k][0]) * (1 - share) + np.array(ends[k]) * share for k in (i, j))
        low, high = max(one[0, 0], other[0, 0]), 70.0
        x = np.linspace(low, high, 50)
        apart = np.interp(x, other[:, 0], other[:, 1]) - np.interp(x, one[:, 0], one[:, 1])
        assert apart.min() > -1e-6 or apart.max() < 1e-6


@example([(7.0, 2.0)])
@example([(7.0, 2.2)])
@given(st.lists(st.tuples(st.floats(-40, 40), st.floats(-40, 40)), min_size=1, max_size=8))
@settings(max_examples=60, deadline=None)
def test_numbers_round_a_view_keep_apart_and_off_what_is_drawn(tips):
    """A ring apart from every other, from letters and dimension, and from a line; near its own direction if that is
    free."""
    sheet, start, end = Sheet(400, 300, "", ""), np.array([160.0, 60.0]), np.array([160.0, 140.0])
    sheet.line(tuple(start), tuple(end))
    centre = (100.0, 100.0)
    places = np.array(places_around(sheet, [(100 + x, 100 + y) for x, y in tips], centre, 60.0))
    rays = places - centre
    assert np.hypot(*rays.T) == pytest.approx(np.full(len(tips), 60.0))
    angles = [*np.arctan2(rays[:, 1], rays[:, 0]), *np.radians([-90, 90, 180])]
    for one, other in itertools.combinations(angles[: len(tips)], 2):
        assert abs(math.remainder(one - other, 2 * math.pi)) > APART - 1e-9
    for one, fixed in itertools.product(angles[: len(tips)], angles[len(tips) :]):
        assert abs(math.remainder(one - fixed, 2 * math.pi)) > APART - 1e-9
    share = np.clip((places - start) @ (end - start) / 80.0**2, 0, 1)[:, None]
    assert (np.hypot(*(places - start - share * (end - start)).T) > RADIUS).all()
    wanted = math.atan2(tips[0][1], tips[0][0]) if math.hypot(*tips[0]) > 1e-6 else 0.0
    nearest = min(abs(math.remainder(wanted - angle, 2 * math.pi)) for angle in angles[-3:])
    blocked = 60.0 - 60.0 * math.cos(wanted) < RADIUS or nearest < APART
    assert blocked or math.remainder(angles[0] - wanted, 2 * math.pi) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("name", ["disc 1", "disc 2"])
def test_discs_are_drawn_about_their_own_axis(name):
    sheet = sheet_of(job_of("two_disk", Structure.INTEGRAL, 0.1958), name)
    seen = np.concatenate([m.points for m in sheet.marks if isinstance(m, Line) and m.kind == "visible"])
    front = seen[seen[:, 0] < 170]
    middle = (front.min(0) + front.max(0)) / 2
    across = [m.points for m in sheet.marks if isinstance(m, Line) and m.kind == "axis"]
    assert any(line[:, 1] == pytest.approx([middle[1]] * 2, abs=0.02) for line in across)
    # As round on the sheet as its lines are wide: the points of circles lie on them, and their chords close by.
    rim = front[np.hypot(*(front - middle).T) > 0.9 * np.ptp(front[:, 0]) / 2]
    angles = np.sort(np.arctan2(*(rim - middle).T))
    sagitta = np.ptp(front[:, 0]) / 2 * (1 - np.cos(np.diff(angles).max() / 2))
    assert sagitta < 0.05


@pytest.mark.parametrize("bounds", [{}, BOUNDS], ids=["no bounds", "bounds"])
@pytest.mark.parametrize("profile", ["ellipse", "resal", "two_disk", "measured"])
@pytest.mark.parametrize("structure", list(Structure))
def test_every_zone_that_the_plan_checks_has_its_frame(profile, structure, bounds):
    """Would catch a form that is inspected though no drawing asks for it, as the rims of two discs once: ISO 8015 lets
    neither size nor coaxiality bound it. Every zone of the plan has a frame, a form one of its symbol."""
    job = make_job(drive(profile, structure), ExportOptions(), "csf-25-80", bounds)
    frames = Counter(
        (part.name, frame.zone, frame.symbol if frame.symbol in ("profile", "cylindricity") else "")
        for part in job.model.parts
        for callout in callouts_of(part, job.model)
        for frame in callout.frames
    )
    planned = Counter(
        (row.part, row.zone_mm, form if (form := row.feature.split(" of ")[0]) in ("profile", "cylindricity") else "")
        for row in inspection_plan(job)
        if row.zone_mm is not None
    )
    # One frame may be measured twice, as the profile alone and about its datums.
    assert set(planned) == set(frames) and frames <= planned
    assert all((part.name, job.model.profile_zone, "cylindricity") in planned for part in job.model.profiled) == (
        profile == "two_disk"
    )


def test_the_sheet_of_a_disc_asks_for_the_form_that_the_plan_checks():
    """Would catch a frame that the callouts have and the sheet leaves out: the zone stands in a frame of its own,
    with two slanted tangents of a circle for its symbol."""
    job = job_of("two_disk", Structure.INTEGRAL, 1.0)
    names = [part.name for part, _ in job.made]
    drawn = dict(zip(names, sheets(job)[1:], strict=False))
    zone = next(row.zone_mm for row in inspection_plan(job) if row.feature.startswith("cylindricity of the rim"))
    for name in ("disc_1", "disc_2"):
        (label,) = (
            label for label in drawn[name].labels if label.content == f"{zone:.4g}" and label.anchor == "middle"
        )
        leaning = [
            mark
            for mark in drawn[name].marks
            if isinstance(mark, Line)
            and len(mark.points) == 2
            and abs(mark.points[0][1] - label.at[1]) < 5
            and 0 < label.at[0] - mark.points[0][0] < 14
            and 0.5 < abs(mark.points[1][0] - mark.points[0][0]) < 3
            and abs(mark.points[1][1] - mark.points[0][1]) > 2
        ]
        assert len(leaning) == 2


def test_the_mating_sheet_says_which_sums_exceed_their_bound_and_which_have_none():
    """Would catch "no more than its bound" over a sum that is beyond it, or that the study gives no bound for."""
    rows = tuple(
        MatingRow("p", "f", "r", 1.0, None, feeds, takes, unit)
        for feeds, takes, unit in (
            ("wg_eccentricity", 0.008, "mm"),
            ("wg_eccentricity", 0.004, "mm"),
            ("wg_tilt", 0.5, "deg"),
            ("axis_tilt", 0.05, "deg"),
            ("axis_tilt", 0.05, "deg"),
        )
    )
    said = sums(rows, {"wg_eccentricity": 0.009, "axis_tilt": 0.1})
    assert [kept for _, kept in said] == [True, False, True]
    beyond = next(line for line, kept in said if not kept)
    assert beyond.startswith("e2") and beyond.endswith(": 0.012 mm, BEYOND the bound of 0.009 mm")
    assert any(line.startswith("α2") and line.endswith("0.5 deg; the study gives no bound") for line, _ in said)
    assert any(line.startswith("β2") and line.endswith("0.1 deg, within the bound of 0.1 deg") for line, _ in said)
    job = make_job(drive("ellipse", Structure.AUTOMATIC), ExportOptions(), "x", {"wg_eccentricity_mm": 0.009} | AXIS)
    assert allowed(job) == {"wg_eccentricity": 0.009, "axis_eccentricity": 0.015, "axis_tilt": 0.2}
    drawn = Sheet(WIDTH, HEIGHT, "mating parts", "")
    fill_mating_sheet(drawn, job)
    assert not any("no more than its bound" in label.content for label in drawn.labels)
