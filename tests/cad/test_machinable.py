"""Inside corners that a cutter can make, and discs that are held along the axis: in the solids, not in notes alone."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from wave_generators import drive, scaled

from hdopt.drive.geometry import Structure
from hdopt.errors import HdoptError
from hdopt.geometry.areas import strip_of_disc
from hdopt.geometry.check import _is_valid, volume_of
from hdopt.geometry.contour import Circle
from hdopt.geometry.din471 import RINGS, ring_of, smallest_ring
from hdopt.geometry.din6885 import key_for_bore
from hdopt.geometry.features import KeywayBore, PlainBore
from hdopt.geometry.iso286 import deviations
from hdopt.geometry.job import make_job
from hdopt.geometry.options import ExportOptions
from hdopt.geometry.part import Part, Prism
from hdopt.geometry.slide_features import SlideEdges, Slot, Tongue
from hdopt.geometry.undercut import AT_SHOULDER, IN_CORNER, SMALL, RingGroove, Undercut
from hdopt.geometry.views import half_behind_minor_axis_zero
from hdopt.geometry.walls import require_walls

# Bore, least and largest r2 of DIN 6885-1; the greatest r1 of its keys in tables of makers is the next step each.
R2 = [(7, 0.08, 0.16), (11, 0.08, 0.16), (14, 0.16, 0.25), (30, 0.16, 0.25), (44, 0.25, 0.4), (60, 0.25, 0.4)]
R2 += [(70, 0.4, 0.6), (120, 0.4, 0.6)]


@pytest.mark.parametrize(("bore", "least", "largest"), R2)
def test_corners_of_keyways_follow_the_key(bore, least, largest):
    key = key_for_bore(bore)
    assert key.corner_radii == (least, largest)
    assert least < key.corner < largest


def test_keyway_is_round_in_its_corners_and_reaches_no_farther_than_said():
    bore = KeywayBore(7.0, key_for_bore(14.0), direction=0.7)
    _, slot = bore.tool(0.0, 4.0)
    radii = sorted(face._geomAdaptor().Cylinder().Radius() for face in slot.Faces() if face.geomType() == "CYLINDER")
    assert radii == pytest.approx([0.205, 0.205])
    # The farthest corner of a sharp keyway would lie at hypot(9.3, 2.5) = 9.630 mm.
    far = max(
        math.hypot(*edge.positionAt(share).toTuple()[:2]) for edge in slot.Edges() for share in np.linspace(0, 1, 41)
    )
    assert far == pytest.approx(bore.reach, abs=1e-3) and bore.reach < 9.6
    area = math.pi * 49 + volume_of(slot) / 4 - half_disc_in_strip(7.0, 5.0)
    assert bore.area_with_disc(0.0) == pytest.approx(area, rel=1e-9)
    # A strip as wide as the bore is deep holds all of it; one that ends where the corners begin, all but their bottom.
    assert bore.area_in_strip(2 * bore.bottom) == pytest.approx(area, rel=1e-12)
    corner = bore.key.corner
    rest = (5.0 - 2 * corner) * corner + math.pi * corner**2 / 2
    assert area - bore.area_in_strip(2 * (bore.bottom - corner)) == pytest.approx(rest, rel=1e-9)


def half_disc_in_strip(radius: float, width: float) -> float:
    """Area of a disc's half within a strip, by quadrature."""
    x, weights = np.polynomial.legendre.leggauss(40)
    return float(weights @ np.sqrt(radius**2 - (x * width / 2) ** 2) * width / 2)


def test_countersink_that_ends_in_the_corners_is_refused():
    with pytest.raises(HdoptError, match=r"ends in the corners of the keyway.*bore_chamfer_mm"):
        KeywayBore(7.0, key_for_bore(14.0)).area_with_disc(9.4)


@pytest.mark.parametrize("undercut", [AT_SHOULDER, IN_CORNER, SMALL, Undercut(2.5, 0.3, 0.6)])
def test_volume_of_an_undercut_is_that_of_its_outline(undercut):
    """Pappus' rule over the outline's own points against the closed form, whose only common part is the geometry."""
    arc, flat, slope = undercut.stretches(12.0, 3.0, 1)
    centre = (12.0 - undercut.depth + undercut.radius, 3.0 + undercut.radius)
    assert math.dist(arc[1], centre) == pytest.approx(undercut.radius)
    turn = np.linspace(-math.pi / 2, -math.pi, 4001)
    points = np.column_stack([centre[0] + undercut.radius * np.cos(turn), centre[1] + undercut.radius * np.sin(turn)])
    points = np.vstack([points, [flat[0], flat[2], slope[2]]])
    assert np.allclose(points[0], arc[0]) and np.allclose(points[4000], arc[2])
    assert slope[2] == pytest.approx((12.0, 3.0 + undercut.length))
    assert math.atan2(slope[2][0] - slope[0][0], slope[2][1] - slope[0][1]) == pytest.approx(math.radians(15))
    r, z = points.T
    kept = float(np.sum(np.diff(z) * math.pi * (r[1:] ** 2 + r[1:] * r[:-1] + r[:-1] ** 2) / 3))
    assert undercut.removed_volume(12.0) == pytest.approx(math.pi * 144 * undercut.length - kept, rel=1e-6)


def test_seat_has_its_undercut_in_the_solid():
    job = make_job(drive(), ExportOptions(), "x")
    hub, solid = next((part, solid) for part, solid in job.made if part.name == "hub")
    tori = [face for face in solid.Faces() if face.geomType() == "TORUS"]
    assert [face._geomAdaptor().Torus().MinorRadius() for face in tori] == pytest.approx([0.2])
    assert volume_of(solid) == pytest.approx(hub.volume, rel=1e-9)
    assert any("DIN 509-E0.2" in line for line in said(job, "hub"))


def test_a_cam_without_a_countersink_gets_an_undercut_that_does_not_rise():
    job = make_job(drive(), ExportOptions(bore_chamfer_mm=0.0), "x")
    assert job.model.part("hub").body[1].foot == IN_CORNER and IN_CORNER.rise == 0.0


@pytest.mark.parametrize("scale", [0.4, 1.0, 4.0])
@pytest.mark.parametrize("structure", [Structure.INTEGRAL, Structure.AUTOMATIC])
def test_discs_stand_between_flange_and_ring(structure, scale):
    made = drive("two_disk", structure)
    job = make_job(made if scale == 1.0 else scaled(made, scale), ExportOptions(), "x")
    hub, disc = job.model.part("eccentric_hub"), job.model.part("disc_2")
    flange, _, journal = hub.body
    ring, groove = ring_of(2 * journal.outline.radius), journal.groove
    assert ring is not None
    assert groove == RingGroove(disc.top, ring.groove_width, ring.depth)
    assert hub.top - groove.bottom - groove.width == pytest.approx(ring.land)
    assert flange.top <= job.model.part("disc_1").bottom
    wall = next(a.value for a in job.model.assumptions if a.key == "export.minimum_wall_mm")
    assert journal.outline.least_radius - groove.depth - hub.bore.reach >= wall - 1e-9
    words = said(job, "eccentric_hub")
    assert any(f"Ø{ring.groove:g}" in line and ring.name in line for line in words)
    limits = {row.name: row for row in job.dimensions if row.part == "eccentric_hub"}
    assert limits["ring groove, diameter"].upper == 0.0
    assert limits["ring groove, width"].lower == 0.0


@pytest.mark.parametrize("scale", [0.17, 0.1958, 0.25, 0.4, 1.0])
def test_undercuts_of_short_journals_do_not_run_into_each_other(scale):
    """A 12 mm drive had journals whose two undercuts overlapped: solids that pass Open CASCADE's check, have the volume
    of the closed form, and are cut by nothing."""
    job = make_job(scaled(drive("two_disk"), scale), ExportOptions(), "x")
    _, first, second = job.model.part("eccentric_hub").body
    gap, thick = 0.2, job.model.part("disc_1").top - job.model.part("disc_1").bottom
    # The disc sits from the gap at the flange to half a gap before the step.
    seat = min(-first.head.length, -gap / 2) - max(first.bottom + first.foot.length, first.bottom + gap)
    assert seat >= 0.5 * thick and first.straight > 0
    assert second.groove.bottom - max(second.foot.length, gap / 2) >= 0.5 * thick
    for part, solid in job.made:
        assert volume_of(half_behind_minor_axis_zero(solid)) == pytest.approx(part.volume / 2, rel=1e-7), part.name


def test_discs_too_thin_for_their_undercuts_are_refused():
    with pytest.raises(HdoptError, match=r"undercuts .* leave 0\.1\d* mm of the seat of a disc 0\.4\d* mm thick"):
        make_job(scaled(drive("two_disk"), 0.13), ExportOptions(), "x")


def test_a_recess_that_runs_into_the_next_is_refused():
    long = Prism(Circle(10.0), 0.0, 1.5, foot=AT_SHOULDER, head=IN_CORNER)
    with pytest.raises(HdoptError, match=r"what its undercuts leave of a seat is -0\.1 mm"):
        require_walls([Part("hub", (0, 0, 0, 1), (long,))], 0.5)
    require_walls([Part("hub", (0, 0, 0, 1), (replace(long, top=1.7),))], 0.5)


def test_journals_without_a_ring_are_said_to_have_none():
    job = make_job(drive("two_disk"), ExportOptions(journal_radius_mm=13.3), "x")
    assert job.model.part("eccentric_hub").body[2].groove is None
    assert any("no retaining ring for journals of 26.6 mm" in note for note in job.model.notes)


def test_rings_follow_the_standard():
    """Rows of DIN 471 as makers print them; and what every row has in common."""
    assert (ring_of(16).groove, ring_of(16).groove_width, ring_of(16).land) == (15.2, 1.1, 1.2)
    assert ring_of(16).depth == pytest.approx(0.4)
    assert (ring_of(10).groove, ring_of(10).groove_class) == (9.6, "h10")
    assert (ring_of(20).groove, ring_of(20).groove_class) == (19.0, "h11")
    assert [ring_of(size).width for size in (16, 19, 45, 70)] == [2.2, 2.5, 4.7, 6.6]
    assert (ring_of(45).groove, ring_of(45).groove_width) == (42.5, 1.85)
    assert (ring_of(70).groove, ring_of(70).groove_width) == (67.0, 2.65)
    assert ring_of(26.6) is None and ring_of(52) is None
    assert smallest_ring(22.1, 0).shaft == 24 and smallest_ring(20, 20.9).shaft == 22
    for ring in RINGS:
        assert ring.groove < ring.shaft and ring.land == pytest.approx(3 * ring.depth, abs=0.051)
        assert (
            ring.depth < ring.width < ring.shaft / 3 and 0.1 - 1e-9 <= ring.groove_width - ring.thickness <= 0.15 + 1e-9
        )
    # ISO 286-1: h12 at 28.6 mm and H13 at 1.6 mm, the groove of a ring of 30 mm.
    assert deviations("h12", 28.6) == (-0.21, 0.0) and deviations("H13", 1.6) == (0.0, 0.14)
    assert [ring.shaft for ring in RINGS] == sorted({ring.shaft for ring in RINGS})


SLIDING = [Structure.AUTOMATIC, Structure.ONE_WAY_MAJOR, Structure.ONE_WAY_MINOR]


@pytest.mark.parametrize("profile", ["ellipse", "two_disk"])
@pytest.mark.parametrize("structure", SLIDING)
@pytest.mark.parametrize("scale", [0.2, 1.0, 4.0])
def test_edges_of_slides_pass_over_the_corners_of_their_mates(profile, structure, scale):
    """A block whose sharp edge meets a round corner stands on it, not on its flanks."""
    job = make_job(scaled(drive(profile, structure), scale), ExportOptions(), "x")
    pairs = [(below.body[-1], above.slot) for below, above in itertools.pairwise(job.model.parts) if above.slot]
    assert len(pairs) == len(structure.slots)
    for block, slot in pairs:
        assert 0 < slot.edges.corner < block.edges.chamfer
        assert 0 < block.edges.corner < slot.edges.chamfer
        # Of the flanks three quarters are left between corner and chamfer, but for their rounding to a micrometre.
        assert slot.edges.corner + slot.edges.chamfer <= 0.25 * slot.depth + 0.002


def sharp_slide(part):
    """The part with sharp corners in its slot and on its block."""
    body = tuple(replace(piece, edges=SlideEdges()) if isinstance(piece, Tongue) else piece for piece in part.body)
    return replace(part, body=body, slot=part.slot and replace(part.slot, edges=SlideEdges()))


@pytest.mark.parametrize("structure", SLIDING)
def test_solids_have_the_corners_of_their_slots(structure):
    """Bevels where flanks meet bottom, mouth, foot and top; and a solid that is valid at every point, as files need."""
    job = make_job(drive("ellipse", structure), ExportOptions(), "x")
    for part, solid in job.made:
        sharp = sharp_slide(part)
        # Against the same part with sharp corners, for the cam's profile is right to a few parts in 1e8 only.
        rounded = volume_of(solid) - volume_of(sharp.build())
        assert rounded == pytest.approx(part.volume - sharp.volume, abs=2e-9 * part.volume), part.name
        assert _is_valid(solid)
        bevels = [face for face in solid.Faces() if is_bevel(face)]
        inside = (part.slot is not None) + isinstance(part.body[-1], Tongue)
        # Each slot or block has two corners and two edges, and lies on both sides of the bore.
        assert len(bevels) == 8 * inside, part.name


def is_bevel(face) -> bool:
    """A plane at 45 degrees to the axis."""
    return face.geomType() == "PLANE" and math.isclose(abs(face.normalAt().z), math.sqrt(0.5), rel_tol=1e-9)


def test_volume_of_a_bevelled_slot_is_that_of_its_slices():
    """A strip of a disc by plain sums over thin slices."""
    edges = SlideEdges(0.4, 0.6)
    slot, block = Slot(6.0, 3.0, 15.0, 0.3, 15.0, False, edges), Tongue(15.0, 6.0, 0.3, 1.0, 4.0, edges)
    up = (np.arange(20000) + 0.5) / 20000 * 3.0
    corner = np.maximum(0.0, 0.4 - up)
    chamfer = np.maximum(0.0, up - 2.4)
    for volume, width in (
        (slot.volume_beside(PlainBore(2.0)), 6.0 - 2 * corner + 2 * chamfer),
        (block.volume - block.bore_volume(PlainBore(2.0)), 6.0 + 2 * corner - 2 * chamfer),
    ):
        slices = [strip_of_disc(w, 15.0) - strip_of_disc(w, 2.0) for w in width.tolist()]
        assert volume == pytest.approx(3.0 * np.mean(slices), rel=1e-6)


def said(job, part: str) -> list[str]:
    from hdopt.geometry.callouts import callouts_of

    return [line for callout in callouts_of(job.model.part(part), job.model) for line in callout.lines]
