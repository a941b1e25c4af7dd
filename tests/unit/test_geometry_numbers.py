"""Sizes of parts and what is bought for them, by hand or by quadrature: no solid is built here."""

from __future__ import annotations

import itertools
import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
from cases import PROFILES
from scipy import integrate

from hdopt.errors import HdoptError
from hdopt.geometry import areas, budget, digits, materials, screws
from hdopt.geometry.arcs import enclosed_area, outline_of
from hdopt.geometry.bought import bought
from hdopt.geometry.budget import Budget, Joint, Share
from hdopt.geometry.cam_table import cam_table
from hdopt.geometry.compare import CamFit, fit_cam
from hdopt.geometry.contour import Circle, ParallelCurve
from hdopt.geometry.din471 import RINGS, ring_of, smallest_ring
from hdopt.geometry.din6885 import key_for_bore
from hdopt.geometry.grinding import wheel_path, write_gcode
from hdopt.geometry.iso286 import Fit, deviations, loosest_fit
from hdopt.geometry.options import ExportOptions
from hdopt.geometry.slide_features import SlideEdges
from hdopt.geometry.undercut import Undercut

CAM = ParallelCurve(PROFILES["ellipse"], 2.5)

# screws


def test_threads_engage_a_diameter_of_steel_and_two_of_aluminium():
    assert screws.least_engagement("M5", "42CrMo4") == 5.0
    assert screws.least_engagement("M5", None) == 5.0
    for name in ("AlMgSi1", "EN AW-7075", "Aluminium"):
        assert screws.least_engagement("M3", name) == 6.0


def test_the_longest_screw_is_one_that_is_made_and_fits():
    """Up to the room below its head, and for M3 up to 30 mm."""
    assert [screws.longest_screw("M3", room) for room in (2.9, 3.0, 19.99, 20.0, 200.0)] == [None, 3, 16, 20, 30]
    assert screws.longest_screw("M8", 200.0) == 80


def test_a_flange_is_as_thick_as_the_next_screw_needs():
    """Through 7 mm of cam, 5 mm in the thread: M5 x 12, whose flange is 5 mm; with 5.2 mm, M5 x 16 and 9 mm."""
    assert screws.flange_for("M5", 7.0, 5.0, 3.0) == 5.0
    assert screws.flange_for("M5", 7.0, 5.2, 3.0) == 9.0
    assert screws.flange_for("M5", 6.7, 5.0, 3.0) == 5.5
    assert screws.flange_for("M5", 7.0, 5.0, 8.0) == 8.0
    assert screws.flange_for("M5", 70.0, 5.0, 3.0) == 3.0


def test_a_flange_too_thin_for_its_thread_is_refused_with_one_that_is_not():
    screws.require_engagement("M5", 7.0, 5.0, "steel")
    with pytest.raises(
        HdoptError,
        match=r"engages 3 mm of thread: it goes through 7 mm .* 4.9 mm thick. 5 mm .*hub_flange_thickness_mm = 5 or",
    ):
        screws.require_engagement("M5", 7.0, 4.9, "steel")
    with pytest.raises(HdoptError, match=r"10 mm are needed in aluminium \(2 diameters\)"):
        screws.require_engagement("M5", 7.0, 5.0, "AlMgSi1")


# fits, rings, keys


@pytest.mark.parametrize(
    ("name", "size", "limits"),
    [
        ("H7", 10.0, (0, 15)),
        ("h6", 10.0, (-9, 0)),
        ("g6", 10.0, (-14, -5)),
        ("k5", 20.0, (2, 11)),
        ("n5", 20.0, (15, 24)),
        ("p5", 18.0, (18, 26)),
        ("p5", 18.1, (22, 31)),
        ("js5", 20.0, (-4.5, 4.5)),
        ("H12", 25.0, (0, 210)),
    ],
)
def test_limits_of_sizes_are_those_of_the_standard(name, size, limits):
    """ISO 286-2, um. The upper end of a range belongs to it."""
    assert deviations(name, size) == pytest.approx((limits[0] / 1000, limits[1] / 1000))


def test_play_is_that_of_the_largest_hole_and_the_least_shaft():
    assert Fit(10.0, "H7", "h6").largest_play == pytest.approx(0.024)
    assert Fit(20.0, "H6", "p5").largest_play == 0.0
    assert loosest_fit(10.0, 0.024).name == "H7/h6"
    assert loosest_fit(10.0, 0.0239).name == "H6/h5"
    assert loosest_fit(10.0, 0.0).name == "H6/n5"


def test_rings_lie_in_their_grooves():
    """A groove is below the shaft and wider than its ring, which reaches beyond it; no larger shaft has a smaller
    groove. By name, the ring of 20 mm: 1.2 mm in a groove of 19 mm."""
    for ring, larger in zip(RINGS, (*RINGS[1:], None), strict=True):
        assert 0 < ring.depth < ring.width
        assert ring.thickness < ring.groove_width < ring.thickness + 0.2
        assert larger is None or (larger.groove > ring.groove and larger.land >= ring.land)
    ring = ring_of(20.0)
    assert (ring.name, ring.depth, ring.groove_class) == ("DIN 471 - 20 x 1.2", 0.5, "h11")
    assert (ring_of(10.0).groove_class, ring_of(24.0).groove_class) == ("h10", "h12")
    assert ring_of(20.5) is None
    assert smallest_ring(20.0, 19.0).shaft == 20
    assert smallest_ring(20.0, 19.01).shaft == 21
    assert smallest_ring(20.1, 3.0).shaft == 21
    assert smallest_ring(121.0, 3.0) is None


def test_keys_go_with_their_bores():
    """DIN 6885-1: above 17 to 22 mm a key of 6, above 22 to 30 mm of 8; t2's tolerance up to 6 mm of height 0.1."""
    assert [key_for_bore(bore).width for bore in (17.0, 17.1, 22.0, 22.1)] == [5, 6, 6, 8]
    six, eight = key_for_bore(20.0), key_for_bore(25.0)
    assert (six.shaft_depth, six.hub_depth, six.hub_depth_tolerance) == (3.5, 2.8, 0.1)
    assert (eight.hub_depth, eight.hub_depth_tolerance, eight.corner) == (3.3, 0.2, pytest.approx(0.205))
    with pytest.raises(HdoptError, match="5.9 mm has no keyway"):
        key_for_bore(5.9)


# areas and volumes


def test_areas_are_integrals():
    """Of a disc of 5 mm, by quadrature: a strip through its centre, what lies beyond a chord, a slot's part outside."""

    def half_chord(x):
        return math.sqrt(25 - x**2)

    strip = integrate.quad(lambda x: 2 * half_chord(x), -2, 2)[0]
    assert areas.strip_of_disc(4.0, 5.0) == pytest.approx(strip)
    assert areas.strip_of_disc(20.0, 5.0) == pytest.approx(25 * math.pi)
    assert areas.segment_of_disc(5.0, 3.0) == pytest.approx(integrate.quad(lambda x: 2 * half_chord(x), 3, 5)[0])
    assert areas.segment_of_disc(5.0, 5.1) == 0.0
    outside = integrate.quad(lambda x: 7.0 - half_chord(x), -2, 2)[0]
    assert areas.slot_outside_disc(4.0, 7.0, 5.0) == pytest.approx(outside)
    assert areas.slot_outside_disc(4.0, 4.0, 5.0) == 0.0
    assert areas.obround(10.0, 4.0) == pytest.approx(40 + 4 * math.pi)
    corner = integrate.quad(lambda x: 2 - math.sqrt(4 - x**2), 0, 1.5)[0]
    assert areas.round_corner(2.0, 1.5) == pytest.approx(corner)
    assert areas.round_corner(2.0, 9.0) == pytest.approx(4 - math.pi)


@pytest.mark.parametrize("undercut", [Undercut(1.0, 0.1, 0.2), Undercut(0.6, 0.1, 0.1)])
def test_an_undercut_takes_what_its_outline_encloses(undercut):
    """Rings of its outline below the cylinder of 8 mm, less those above, by quadrature along the axis; it comes back at
    15 degrees."""
    arc, flat, slope = undercut.stretches(8.0, 3.0, 1)
    (_, _, corner), (_, _, foot), (_, _, end) = arc, flat, slope
    r, low = undercut.radius, 8.0 - undercut.depth
    assert (corner, end) == ((low, pytest.approx(3.0 + r)), (8.0, pytest.approx(3.0 + undercut.length)))
    assert math.degrees(math.atan2(end[0] - foot[0], end[1] - foot[1])) == pytest.approx(15.0)

    def outline(z):
        if z < r:
            return low + r - math.sqrt(r**2 - (r - z) ** 2)
        return low if z + 3.0 < foot[1] else low + (z + 3.0 - foot[1]) * math.tan(math.radians(15))

    ends = [0, r, foot[1] - 3.0, undercut.length]
    volume = sum(
        integrate.quad(lambda z: math.pi * (64 - outline(z) ** 2), a, b)[0] for a, b in itertools.pairwise(ends)
    )
    assert undercut.removed_volume(8.0) == pytest.approx(volume, rel=1e-6)
    assert undercut.rise == pytest.approx(r - undercut.depth)


def test_bevels_of_a_block_add_at_its_foot_and_take_at_its_top():
    """A block 4 wide, 3 high and 10 long: triangles of c^2/2 on both sides at 45 degrees; of a slot the contrary."""
    edges = SlideEdges(0.2, 0.3)
    triangles = 10.0 * (0.2**2 - 0.3**2)
    assert edges.volume(4.0, 3.0, 1, lambda width: 10 * width) == pytest.approx(120 + triangles)
    assert edges.volume(4.0, 3.0, -1, lambda width: 10 * width) == pytest.approx(120 - triangles)
    small = SlideEdges.of(10.0, 1.0)
    assert (small.corner, small.chamfer) == (pytest.approx(0.1), pytest.approx(0.15))
    assert SlideEdges.of(10.0, 9.0).corner == 0.2


def test_arcs_enclose_the_area_of_their_curve():
    """Arcs miss it by 20 nm at most: a strip of so much along its perimeter."""
    for contour in (CAM, Circle(7.0, 0.4)):
        assert enclosed_area(outline_of(contour)) == pytest.approx(contour.area, abs=2e-5 * contour.perimeter)


# cams


@pytest.mark.parametrize("contour", [CAM, Circle(20.0, 0.4)])
def test_a_cams_table_is_its_curve(contour):
    """Angle and radius are a point of it; the normal is square to neighbours and points outward; the curvature is the
    change of the normal along the way, all by central differences over half a degree."""
    angle, radius, normal, curvature = cam_table(contour, 0.5).T
    points = np.column_stack([radius * np.sin(angle), radius * np.cos(angle)])
    assert np.abs(contour.deviation(points)).max() < 1e-9
    chord = np.roll(points, -1, 0) - np.roll(points, 1, 0)
    outward = np.column_stack([np.sin(normal), np.cos(normal)])
    assert np.abs((chord * outward).sum(1) / np.hypot(*chord.T)).max() < 1e-4
    assert ((points * outward).sum(1) > 0).all()
    turned = np.angle(np.exp(1j * (np.roll(normal, -1) - np.roll(normal, 1))))
    assert curvature == pytest.approx(turned / np.hypot(*chord.T), rel=1e-3)


def test_the_wheels_centre_runs_its_radius_outside(tmp_path):
    """Every node of the path; one turn takes a quarter of a minute by the inverse times of its blocks."""
    work, distance = wheel_path(CAM, 40.0).T
    centres = np.column_stack([distance * np.sin(work), distance * np.cos(work)])
    assert CAM.deviation(centres) == pytest.approx(np.full(len(centres), 40.0), abs=1e-6)
    model = SimpleNamespace(profiled=[SimpleNamespace(contour=CAM)], wheel_radius=40.0)
    job = SimpleNamespace(model=model, identity=SimpleNamespace(title="a cam", description="of a test"))
    write_gcode(tmp_path / "cam.ngc", job)
    rates = re.findall(r"^G1 C\S+ X\S+ F(\S+)$", (tmp_path / "cam.ngc").read_text(), re.MULTILINE)
    assert sum(1 / float(rate) for rate in rates) == pytest.approx(1 / 4.0, rel=1e-4)


def test_a_measured_cam_is_laid_onto_the_nominal_one():
    """A circle measured by a ball of 1 mm, off by (0.03, -0.02) mm and 0.004 mm too large."""
    angle = np.arange(72) * math.radians(5)
    middle = np.array([0.03, 0.4 - 0.02])
    points = middle + (20.0 + 1.0 + 0.004) * np.column_stack([np.sin(angle), np.cos(angle)])
    found = fit_cam(points, Circle(20.0, 0.4), probe_radius=1.0)
    assert found.shift == pytest.approx((0.03, -0.02), abs=1e-9)
    assert found.rotation == 0.0
    assert found.deviations == pytest.approx(np.full(72, 0.004), abs=1e-9)
    assert np.hypot(*(found.points - middle).T) == pytest.approx(np.full(72, 20.004), abs=1e-6)


def test_the_scatter_of_a_point_is_that_of_noise_beside_a_smooth_form():
    """Second differences of white noise have six times its variance; six waves a turn of 5 um have almost none."""
    angle = np.arange(3600) * math.radians(0.1)
    deviations = 0.005 * np.sin(6 * angle) + np.random.default_rng(0).normal(0, 1e-3, 3600)
    fit = CamFit(0.0, (0.0, 0.0), angle, deviations, np.zeros((3600, 2)))
    assert fit.noise == pytest.approx(1e-3, rel=0.05)
    assert fit.rms == pytest.approx(math.sqrt(0.005**2 / 2 + 1e-6), rel=0.02)
    assert fit.largest == np.abs(deviations).max()


# budgets, digits, masses


def test_play_makes_a_part_eccentric_by_its_half_and_lean_over_its_length():
    joint, fit = Joint("shaft", "hub", "shaft", 10.0, 8.0, play=0.01), Fit(10.0, "H7", "h6")
    assert budget._eccentricity_of(joint, fit).takes == pytest.approx((0.024 + 0.01) / 2)
    assert budget._tilt_of(joint, fit).takes == pytest.approx(math.atan(0.034 / 8.0))


def test_what_the_fits_leave_is_shared_out_and_rounded_down():
    """Of 0.05 mm the fits take 0.0201; two position zones share the rest, half of a zone's diameter each: 0.0299 mm,
    to a tenth of a micrometre below."""
    shares = [Share("hub", "fit", "H7/h6", 0.0201)]
    found = budget._filled("wg_eccentricity", "mm", 0.05, shares, [("hub", "place", 0.5), ("cam", "place", 0.5)])
    assert [share.zone for share in found.shares] == [None, 0.0299, 0.0299]
    assert found.met
    tight = budget._filled("wg_eccentricity", "mm", 0.05035, shares, [("hub", "place", 0.5), ("cam", "place", 0.25)])
    assert [share.zone for share in tight.shares] == [None, 0.0302, 0.0605]
    with pytest.raises(HdoptError, match="which no shop holds"):
        budget._filled("wg_eccentricity", "mm", 0.0203, shares, [("hub", "place", 0.5)])


def test_a_budget_is_kept_to_its_last_digit_and_said_in_its_unit():
    kept = Budget("wg_tilt", "deg", math.radians(0.1), (Share("hub", "fit", "H7/h6", math.radians(0.1)),))
    over = Budget("wg_tilt", "deg", math.radians(0.1), (Share("hub", "fit", "H7/h6", math.radians(0.101)),))
    assert (kept.met, over.met) == (True, False)
    assert "is kept: 0.1 of 0.1 deg" in kept.verdict
    assert "NOT KEPT: 0.101 of 0.1 deg; fit (H7/h6) takes 0.101 deg, 0.1 deg are left" in over.verdict
    assert kept.to_dict()["spent"] == pytest.approx(0.1)


def test_a_fit_may_use_half_of_its_share_of_a_bound():
    """Of an eccentricity of 0.024 mm that two joints share each 0.006, or 0.012 on diameter; of a tilt half over the
    length and the joints that lean."""
    joint = Joint("shaft", "hub", "shaft", 10.0, 8.0)
    none = budget.Bounds()
    assert budget._fit(joint, 1, 1, 0.024, none).name == "H7/h6"
    assert budget._fit(joint, 1, 1, 0.0239, none).name == "H6/h5"
    assert budget._fit(joint, 2, 1, 0.030, none).name == "H6/h5"
    assert budget._fit(joint, 1, 1, None, budget.Bounds(tilt=0.0061)).name == "H7/h6"
    assert budget._fit(joint, 1, 1, None, budget.Bounds(tilt=0.0059)).name == "H6/h5"
    assert budget._fit(joint, 1, 2, None, budget.Bounds(tilt=0.0119)).name == "H6/h5"
    assert budget._fit(joint, 1, 1, None, none).name == budget.USUAL_FIT


def test_a_bought_screw_engages_what_stands_out_of_the_cam():
    """7 mm of cam on a flange of 5: M5 x 12, 5 mm of it in the thread."""
    bolts = SimpleNamespace(count=4, hole=5.5, radius=12.0)
    hub = SimpleNamespace(name="hub", bolts=bolts, body=(), bottom=-5.0, top=0.0)
    cam = SimpleNamespace(name="cam", bolts=bolts, body=(), bottom=0.0, top=7.0)
    (found,) = bought(SimpleNamespace(made=[(hub, None), (cam, None)]))
    assert (found.thread, found.length, found.engaged) == ("M5", 12, 5.0)
    assert found.words[0] == "screw, 4 off, 5 mm in thread"


def test_sizes_have_the_digits_that_their_tolerance_leaves():
    """A twentieth of the tolerance's width; a least size is rounded up, a largest one down."""
    assert digits.rounded(12.34567, (-0.1, 0.1)) == 12.35
    assert digits.rounded(12.34123, (0.0, 0.1)) == 12.342
    assert digits.rounded(12.34999, (-0.1, 0.0)) == 12.349
    assert digits.rounded(12.341234, (0.0, 0.001)) == 12.3413
    assert digits.general_limits(30.0) == (-0.2, 0.2)
    assert digits.general_limits(30.1) == (-0.3, 0.3)


def test_a_part_weighs_its_volume_by_its_own_density():
    """g/cm^3 are 1e-6 kg/mm^3; a hardness is that of the usual material only."""
    part = SimpleNamespace(name="cam", volume=2000.0)
    assert materials.mass(part, ExportOptions()) == pytest.approx(2000 * 7.85e-6)
    own = ExportOptions(cam_material="Ti6Al4V", cam_density_g_cm3=4.43)
    assert materials.mass(part, own) == pytest.approx(2000 * 4.43e-6)
    assert (materials.material(part, own).hardness, materials.material(part, own).assumed) == ("", False)
    assert materials.material(part, ExportOptions()).hardness_assumed
