"""Slides and what holds the discs, at the limits of their drawings: nothing jams, stands on a bottom or leans."""

from __future__ import annotations

import math

import pytest
from wave_generators import drive, scaled

from hdopt.drive.geometry import Structure
from hdopt.geometry.callouts import callouts_of
from hdopt.geometry.inspection import inspection_plan
from hdopt.geometry.job import make_job
from hdopt.geometry.options import ExportOptions

SLIDING = [Structure.AUTOMATIC, Structure.ONE_WAY_MAJOR, Structure.ONE_WAY_MINOR]
BOUNDS = {"wg_eccentricity_mm": 0.0075, "wg_tilt_major_deg": 0.1, "wg_tilt_minor_deg": 0.1}


def job_of(profile, structure, scale=1.0, bounds=BOUNDS):
    made = drive(profile, structure)
    return make_job(made if scale == 1.0 else scaled(made, scale), ExportOptions(), "x", bounds)


def limits(job, part, name):
    """Least and largest size of a dimension, mm."""
    row = next(row for row in job.dimensions if (row.part, row.name) == (part, name))
    return row.nominal + row.lower, row.nominal + row.upper


def frames(job, part, begins):
    """The frames of a part's slot or block."""
    (found,) = (c for c in callouts_of(job.model.part(part), job.model) if c.lines[0].startswith(begins))
    return found.datum, {(frame.symbol, frame.datums): frame.zone for frame in found.frames}


@pytest.mark.parametrize("profile", ["ellipse", "two_disk"])
@pytest.mark.parametrize("structure", SLIDING)
@pytest.mark.parametrize("bounds", [BOUNDS, {}])
def test_blocks_and_slots_are_square_and_leave_play(profile, structure, bounds):
    job = job_of(profile, structure, bounds=bounds)
    carrier = "cam" if profile == "ellipse" else "eccentric_hub"
    pairs = [("input_disc", carrier)]
    if structure is Structure.AUTOMATIC:
        pairs = [("input_disc", "floating_disc"), ("floating_disc", carrier)]
        slot_letter, _ = frames(job, "floating_disc", "slot")
        _, block = frames(job, "floating_disc", "block")
        # Square to the slot in its back: no more than the play of a slide lets the disc turn in any case.
        assert block["perpendicularity", slot_letter] == pytest.approx(0.02)
    for below, above in pairs:
        _, slot = frames(job, above, "slot")
        _, block = frames(job, below, "block")
        (upright,) = slot.values()
        # Worst sizes and both leaning: a quarter of the least clearance is left at least.
        least = limits(job, above, "slot")[0] - limits(job, below, "block")[1]
        leaning = min(block.values())
        assert least == pytest.approx(0.02) and least - upright - leaning >= 0.25 * least
        assert limits(job, above, "slot, depth")[0] >= limits(job, below, "block, height")[1]
        listed = {(row.part, row.feature): row.zone_mm for row in inspection_plan(job)}
        assert listed[above, "slot square to the back"] == upright
    # The shaft's keyway lies across the block of the input disc.
    _, first = frames(job, "input_disc", "block")
    assert ("perpendicularity", "B") in first
    assert (("symmetry", "A") in first) == (structure is not Structure.AUTOMATIC and bool(bounds))


@pytest.mark.parametrize("structure", SLIDING)
def test_axial_play_that_tilts_stands_on_the_mating_sheet(structure):
    """Thicknesses of 0.4 mm tolerance make no play of 0.013 mm: someone has to be told to set it."""
    job = job_of("ellipse", structure)
    rows = [row for row in job.mating if row.feature.startswith("slide between")]
    budget = next(budget for budget in job.model.plan.budgets if budget.of == "wg_tilt")
    shares = [share.takes for share in budget.shares if share.feature.startswith("slide")]
    assert len(rows) == len(structure.slots) and all("shims" in row.requirement for row in rows)
    assert [math.radians(row.takes) for row in rows] == pytest.approx(shares)
    assert [row.value_mm for row in rows] == pytest.approx([30 * math.tan(share) for share in shares])


@pytest.mark.parametrize("scale", [0.1958, 1.0, 1.9576])
@pytest.mark.parametrize("structure", [Structure.INTEGRAL, Structure.ONE_WAY_MINOR])
def test_ring_goes_into_its_groove_over_the_thickest_discs(structure, scale):
    job = job_of("two_disk", structure, scale)
    thickest = sum(limits(job, name, "width")[1] for name in ("disc_1", "disc_2"))
    assert limits(job, "eccentric_hub", "flange to ring groove")[0] >= thickest
    hub = job.model.part("eccentric_hub")
    held = hub.body[2].groove.bottom - hub.body[0].top
    # On the sheet to three decimals at least, rounded up.
    assert 0 <= limits(job, "eccentric_hub", "flange to ring groove")[0] - held < 1e-3


def test_offset_of_the_journals_has_one_tolerance():
    """A disc of its own is round, and where its journal lies is told once: by the position zone of the frame."""
    job = job_of("two_disk", Structure.INTEGRAL)
    (row,) = (row for row in job.dimensions if "offset" in row.name)
    hub = callouts_of(job.model.part("eccentric_hub"), job.model)
    (frame,) = (frame for callout in hub for frame in callout.frames if frame.symbol == "position")
    assert (row.part, row.lower, row.tolerance) == ("eccentric_hub", None, f"position {frame.value}")
