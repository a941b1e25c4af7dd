"""Chains of dimensions: on no sheet does a toleranced dimension follow from others that have tolerances too."""

from __future__ import annotations

import itertools
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from wave_generators import drive, scaled

from hdopt.drive.geometry import Structure
from hdopt.geometry import assembly_sheet, drawing, part_sheets
from hdopt.geometry.callouts import callouts_of
from hdopt.geometry.chains import Length, axial_lengths, without_chains
from hdopt.geometry.inspection import inspection_plan
from hdopt.geometry.job import make_job
from hdopt.geometry.options import ExportOptions
from hdopt.geometry.part import Part, Prism
from hdopt.geometry.sheet import Sheet
from hdopt.geometry.views import View

AXIAL = ("width", "slot, depth", "block, height", "flange to ring groove")
"""Rows of the table of limits that are lengths along the axis and are drawn as such."""

CASES = [
    *itertools.product(("ellipse", "two_disk"), Structure, (1.0,), ({},)),
    ("measured", Structure.INTEGRAL, 1.0, {}),
    *itertools.product(("ellipse",), (Structure.INTEGRAL, Structure.AUTOMATIC), (0.1958, 4.0), ({},)),
    *itertools.product(("two_disk",), (Structure.INTEGRAL, Structure.ONE_WAY_MINOR), (0.2, 4.0), ({},)),
    ("ellipse", Structure.INTEGRAL, 1.0, {"hub_flange_thickness_mm": 14.0}),
    ("ellipse", Structure.INTEGRAL, 1.0, {"hub": False}),
]
"""Every structure with a cam and with discs, small and large; a flange thicker than its seat; a cam on the shaft."""


@pytest.fixture(params=CASES, ids=lambda case: "-".join(str(getattr(one, "value", one)) for one in case))
def job(request, monkeypatch):
    """An export whose sheets have no views: no solid is made."""
    profile, structure, scale, given_sizes = request.param
    monkeypatch.setattr(Part, "build", lambda _: None)
    for module in (drawing, part_sheets, assembly_sheet):
        monkeypatch.setattr(module, "seen_from", lambda *_: View(()), raising=False)
        for name in ("draw_section", "draw_exploded"):
            monkeypatch.setattr(module, name, lambda *_: None, raising=False)
    for name in ("half_behind_minor_axis_zero", "section_at_minor_axis_zero"):
        monkeypatch.setattr(drawing, name, lambda _: [])
    made = drive(profile, structure)
    return make_job(made if scale == 1.0 else scaled(made, scale), ExportOptions(**given_sizes), "csf-25-80")


@pytest.fixture
def dimensions(monkeypatch):
    """Every dimension that is drawn: its sheet's title, whether it is upright, its two ends (mm), its text."""
    drawn = []
    own = Sheet.dimension

    def kept(self, start, end, at, text, vertical, *rest):
        drawn.append((self.title, vertical, *(round(point[1 if vertical else 0], 6) for point in (start, end)), text))
        own(self, start, end, at, text, vertical, *rest)

    monkeypatch.setattr(Sheet, "dimension", kept)
    return drawn


def is_auxiliary(text):
    return re.match(r"\(.*\d\)", text) is not None


def none_follows_from_others(edges):
    """No closed chain: the distances, each a row of +1 and -1 at its ends, are linearly independent."""
    planes = sorted({end for edge in edges for end in edge})
    matrix = np.zeros((len(edges), len(planes)))
    for row, edge in enumerate(edges):
        matrix[row, planes.index(edge[0])], matrix[row, planes.index(edge[1])] = -1.0, 1.0
    return not edges or np.linalg.matrix_rank(matrix) == len(edges)


def test_no_toleranced_dimension_of_a_sheet_follows_from_others(job, dimensions):
    """Faults caught: no length auxiliary; the overall length of a disc with a block toleranced beside both its pieces;
    on the assembly and on the overview, a length or an axis toleranced that other sheets or diameters make."""
    part_sheets.sheets(job)
    drawing.draw(job)
    titles = {title for title, *_ in dimensions}
    assert len(titles) == len(job.made) + 2  # the parts, the assembly, the overview
    for title, vertical in itertools.product(titles, (False, True)):
        drawn = [
            (a, b) for name, up, a, b, text in dimensions if (name, up) == (title, vertical) and not is_auxiliary(text)
        ]
        assert none_follows_from_others(drawn), title
    made_by_parts = [text for title, up, *_, text in dimensions if title.startswith("assembly")]
    assert made_by_parts and all(map(is_auxiliary, made_by_parts))
    two = len(job.model.profiled) == 2
    # On the overview the parts make the whole, two discs and their gap the width that they have together.
    lengths = [text for title, up, *_, text in dimensions if title == job.identity.title and not up][1:]
    assert [is_auxiliary(text) for text in lengths] == [two, True][: len(lengths)]
    assert len(lengths) == (1 if len(job.made) == 1 else 2)
    axes = [text for title, *_, text in dimensions if title == job.identity.title and "axis" in text]
    assert len(axes) == 2 and all(is_auxiliary(text) == two for text in axes)


def test_every_face_of_a_part_has_its_place_by_toleranced_lengths(job):
    """Faults caught: a second link of a chain auxiliary, which leaves a face without a place; a length auxiliary that
    stands in the table of limits; a length of the table that is not drawn; the end of a slot or groove left out."""
    for part, _ in job.made:
        lengths = axial_lengths(part)
        kept = [(round(one.low, 6), round(one.high, 6)) for one in lengths if not one.auxiliary]
        faces = {round(z, 6) for piece in part.body for z in (piece.bottom, piece.top)}
        faces |= {round(piece.groove.bottom, 6) for piece in part.body if isinstance(piece, Prism) and piece.groove}
        faces |= {round(part.bottom + part.slot.depth, 6)} if part.slot else set()
        assert {end for one in kept for end in one} == faces
        # As many as it takes, none of which follows from the others: each face hangs on every other.
        assert none_follows_from_others(kept) and len(kept) == len(faces) - 1
        rows = {row.name: row for row in job.dimensions if row.part == part.name and row.name in AXIAL}
        assert {one.row for one in lengths if one.row} == set(rows)
        for one in lengths:
            assert not (one.row and one.auxiliary)
            assert not one.row or one.size == pytest.approx(rows[one.row].nominal, abs=0.05)


def test_what_is_auxiliary_is_not_measured(job, dimensions):
    """Fault caught: the inspection plan has the limits of a length that stands in parentheses on the sheet."""
    plan = inspection_plan(job)
    part_sheets.sheets(job)
    for part, _ in job.made:
        title = next(name for name, *_ in dimensions if name.startswith(part.name.replace("_", " ")))
        drawn = [text for name, up, *_, text in dimensions if name == title and not up]
        measured = [row.nominal_mm for row in plan if row.part == part.name and row.feature in AXIAL]
        toleranced = [float(text) for text in drawn if not is_auxiliary(text)]
        assert all(toleranced.count(size) >= measured.count(size) for size in measured)


def test_a_slot_has_one_width_and_a_thread_its_flanges_depth(job):
    """Fault caught: the radius of a slot's round end, half its width of 5 um, with 0.1 mm of its own; the depth of a
    thread through a flange beside the flange's thickness."""
    for part, _ in job.made:
        said = " ".join(line for callout in callouts_of(part, job.model) for line in callout.lines)
        assert not re.search(r"ends R|through \d", said)


Z = st.integers(0, 6).map(float)


@given(st.lists(st.tuples(Z, Z, st.sampled_from(["", "", "width"])).filter(lambda row: row[0] < row[1]), max_size=12))
@settings(max_examples=200, deadline=None)
def test_one_link_of_every_chain_is_auxiliary_and_the_least_important_one(rows):
    """By linear algebra. Faults caught: planes tied to the last of their chain only, not to all of it; the order of
    importance left out."""
    found = without_chains(Length(*row) for row in {row[:2]: row for row in rows}.values())
    assert sorted((one.low, one.high) for one in found) == sorted({row[:2] for row in rows})
    kept = [(one.low, one.high) for one in found if not one.auxiliary]
    assert none_follows_from_others(kept)
    for one in found:
        if one.auxiliary:
            assert not none_follows_from_others([*kept, (one.low, one.high)])
    # Of those with limits of their own none gives way to one without.
    own = [(one.low, one.high) for one in found if one.row]
    assert not none_follows_from_others(own) or not any(one.auxiliary for one in found if one.row)


def said(lengths):
    return [(one.size, one.auxiliary) for one in sorted(lengths, key=lambda one: one.size)]


def test_the_link_without_a_function_is_the_auxiliary_one():
    """Fault caught: the whole auxiliary where a piece has no limits; or a piece with limits, for the whole."""
    hub = [Length(-8.0, -4.5), Length(-4.5, 4.5), Length(-8.0, 4.5, "width")]
    assert said(without_chains(hub)) == [(3.5, False), (9.0, True), (12.5, False)]
    disc = [Length(0.0, 7.0, "width"), Length(7.0, 10.0, "block, height"), Length(0.0, 10.0)]
    assert said(without_chains(disc)) == [(3.0, False), (7.0, False), (10.0, True)]
    # Of two with one general tolerance the upper one, though the whole has a wider one.
    stepped = [Length(0.0, 21.0), Length(21.0, 41.0), Length(0.0, 41.0)]
    assert said(without_chains(stepped)) == [(20.0, True), (21.0, False), (41.0, False)]


def test_planes_that_arithmetic_moves_apart_are_one():
    """Fault caught: a chain taken for open where 0.1 + 0.2 is not 0.3."""
    found = without_chains([Length(0.0, 0.1), Length(0.1, 0.3), Length(0.0, 0.1 + 0.2)])
    assert [one.auxiliary for one in found].count(True) == 1
