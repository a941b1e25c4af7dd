"""Fits and position tolerances keep the bounds that the tolerances of the study set."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from wave_generators import drive

from hdopt.drive.geometry import Structure
from hdopt.geometry.assembly import wave_generator_model
from hdopt.geometry.budget import Bounds
from hdopt.geometry.iso286 import LADDER, deviations, fit_of
from hdopt.geometry.job import make_job
from hdopt.geometry.options import ExportOptions
from hdopt.geometry.walls import walls_of

# ISO 286-2:2010, Tables 6 to 20: deviations in um, lower and upper.
PUBLISHED = {
    ("H7", 24.0): (0, 21),
    ("H6", 14.0): (0, 11),
    ("h6", 24.0): (-13, 0),
    ("k5", 40.0): (2, 13),
    ("m5", 5.0): (4, 9),
    ("n5", 60.0): (20, 33),
    ("p5", 100.0): (37, 52),
    ("g6", 8.0): (-14, -5),
    ("JS9", 5.0): (-15, 15),
}


@pytest.mark.parametrize(("name", "size"), PUBLISHED)
def test_deviations_are_those_of_the_standard(name, size):
    assert [1e3 * limit for limit in deviations(name, size)] == pytest.approx(PUBLISHED[name, size], abs=1e-9)


def test_ladder_of_fits_leaves_less_play_with_every_step():
    for size in (3.0, 8.0, 14.0, 24.0, 45.0, 100.0, 160.0):
        plays = [fit_of(name, size).largest_play for name in LADDER]
        assert plays == sorted(plays, reverse=True) and plays[-1] == 0.0


@given(
    profile=st.sampled_from(["ellipse", "resal", "two_disk"]),
    structure=st.sampled_from([Structure.INTEGRAL, Structure.AUTOMATIC]),
    eccentricity=st.floats(0.004, 0.05),
    tilt=st.floats(0.08, 1.0),
)
@settings(max_examples=40, deadline=None)
def test_shares_never_exceed_the_bound(profile, structure, eccentricity, tilt):
    bounds = Bounds(eccentricity, math.radians(tilt))
    model = wave_generator_model(drive(profile, structure), None, bounds)
    for budget in model.plan.budgets:
        assert budget.met, budget
        # Worked out again from the limits of every fit, not from the shares.
        plays = [f.hole_limits[1] - f.shaft_limits[0] for f in model.plan.fits]
        zones = [share.zone for share in budget.shares if share.zone is not None]
        if budget.of == "wg_eccentricity":
            assert sum(max(0.0, play) for play in plays) / 2 + sum(zones) / 2 <= eccentricity * (1 + 1e-9)
            assert model.profile_zone <= max(zones)


def test_automatic_structure_has_no_budget_of_eccentricity():
    model = wave_generator_model(drive(structure=Structure.AUTOMATIC), None, Bounds(0.001, math.radians(0.1)))
    assert [budget.of for budget in model.plan.budgets] == ["wg_tilt"]


def test_clearance_that_the_study_gives_breaks_the_bound_and_is_said_to():
    model = wave_generator_model(drive(structure=Structure.ONE_WAY_MAJOR), None, Bounds(0.0075))
    (budget,) = model.plan.budgets
    # A cross-slide clearance of 0.02 mm lets the cam lie 0.01 mm off across the slot.
    assert not budget.met and budget.spent > 0.01
    tight = drive(structure=Structure.ONE_WAY_MAJOR)
    tight = replace(tight, clearances=replace(tight.clearances, cross_slide=0.004))
    assert wave_generator_model(tight, None, Bounds(0.0075)).plan.budgets[0].met


def test_drawing_gives_the_limits_of_the_fits():
    job = make_job(drive(), ExportOptions(shaft_fit="H7/h6"), "x", {"wg_eccentricity_mm": 0.05})
    rows = {(row.part, row.name): row for row in job.dimensions}
    bore = rows["hub", "bore"]
    assert (bore.lower, bore.upper, bore.tolerance) == (0.0, pytest.approx(0.018), "H7 +0.018/0")
    seat, hole = rows["hub", "seat"], rows["cam", "bore"]
    assert seat.nominal == hole.nominal == 24.0
    assert hole.upper - seat.lower <= 0.05


def test_disc_and_its_offset_share_the_profile_zone():
    job = make_job(drive("two_disk"), ExportOptions(profile_tolerance_mm=0.01), "x")
    rows = {row.name: row for row in job.dimensions}
    radius, offset = rows["disc diameter"].upper / 2, rows["offset of the journals' axes"].tolerance
    assert offset.startswith("position Ø") and radius + float(offset[10:]) / 2 == pytest.approx(0.01 / 2)
    # A disc of its own is round: the offset is the hub's.
    assert rows["offset of the journals' axes"].part == "eccentric_hub"


@given(
    scale=st.floats(0.3, 4.0),
    profile=st.sampled_from(["ellipse", "two_disk"]),
    structure=st.sampled_from(list(Structure)),
)
@settings(max_examples=30, deadline=None)
def test_rules_leave_the_least_wall_everywhere(scale, profile, structure):
    from wave_generators import scaled

    model = wave_generator_model(scaled(drive(profile, structure), scale))
    least = next(a.value for a in model.assumptions if a.key == "export.minimum_wall_mm")
    for part in model.parts:
        for wall in walls_of(part):
            assert wall.thickness >= wall.share * least - 1e-9, wall
        assert part.volume > 0
