"""The tooth's path, and how far from the major axis flanks can carry."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from cases import CSF_25_80, PROFILES, drive
from scipy.integrate import quad

from hdopt.drive.geometry import Load
from hdopt.drive.profiles import TwoDisk
from hdopt.mechanics.bending import curvature_change, max_curvature_change
from hdopt.mechanics.contact import TIPS, contact_angle
from hdopt.mechanics.contact_model import mean_flank_pressure
from hdopt.mechanics.tooth_gap import LEADING, TRAILING, Flanks, gap_at, tooth_place
from hdopt.mechanics.tooth_path import Mesh

SMOOTH = ("ellipse", "resal", "two_disk")


@dataclass(frozen=True)
class Cosine:
    """w = w0 cos 2 phi exactly: the curve whose path is known in closed form."""

    deflection: float
    undeformed: float = CSF_25_80.flexspline_inner_radius
    name = "cosine"
    tip_is_smooth = True

    def radius(self, phi, derivative=0):
        phi = np.asarray(phi, float)
        return (
            self.undeformed + self.deflection * np.cos(2 * phi),
            -2 * self.deflection * np.sin(2 * phi),
            -4 * self.deflection * np.cos(2 * phi),
        )[derivative]


@pytest.mark.parametrize("ratio", (0.97, 1.0, 1.08))
def test_the_path_is_that_of_the_rack_approximation(ratio):
    module = CSF_25_80.module
    mesh = Mesh(CSF_25_80, Cosine(ratio * module))
    for psi in (0.1, 0.6, 1.2):
        withdrawal, shift = mesh.path(psi)
        assert shift == pytest.approx(module / 2 * (2 * psi - ratio * math.sin(2 * psi)), abs=1e-13)
        assert withdrawal == pytest.approx(ratio * module * (1 - math.cos(2 * psi)), abs=1e-12)


@pytest.mark.parametrize("alpha_deg", (5, 12, 20))
def test_without_play_the_flank_is_free_where_the_path_is_flatter_than_it(alpha_deg):
    mesh = Mesh(CSF_25_80, Cosine(CSF_25_80.module))
    psi = mesh.free_flank_angle(math.radians(alpha_deg), 1e-9)
    slope = (psi - math.sin(psi) * math.cos(psi)) / (2 * math.sin(psi) ** 2)
    assert slope == pytest.approx(math.tan(math.radians(alpha_deg)), abs=1e-8)


MANY = replace(
    CSF_25_80, flexspline_teeth=32_000, circular_spline_teeth=32_002, flexspline_inner_radius=0.198 * 32_000 - 1.03
)
"""A drive of so many teeth that it is a rack: what is left of the rounding of its pitch lines is m^2/R = 2.5e-5 mm."""
RACK = 4 * MANY.module**2 / (MANY.module * MANY.flexspline_teeth / 2)


@pytest.mark.parametrize("ratio", (0.97, 1.0, 1.08))
def test_many_teeth_move_as_the_rack_approximation_says(ratio):
    """Ishikawa, EP 0 266 972: x = m (theta - kappa sin theta)/2, y = kappa m cos theta, theta = 2 phi."""
    module = MANY.module
    ring = Mesh(MANY, Cosine(ratio * module, MANY.flexspline_inner_radius)).ring
    start = tooth_place(ring, 0.0)[1]
    for phi in (0.1, 0.6, 1.2):
        sideways, height, lean = tooth_place(ring, phi)
        assert sideways == pytest.approx(module / 2 * (2 * phi - ratio * math.sin(2 * phi)), abs=RACK)
        assert start - height == pytest.approx(ratio * module * (1 - math.cos(2 * phi)), abs=RACK)
        assert lean == pytest.approx(0, abs=1e-3)


def s_profile(module, pitch, neutral):
    """The tooth form of Ishikawa, EP 0 266 972: half the path of a tooth, as it is on the space and turned round on the
    tooth, so that both touch at the path's middle all the way out. Its contact begins at the height `pitch` above the
    neutral line."""
    theta = np.linspace(0.0, math.pi, 2001)
    x, y = module / 4 * (theta - np.sin(theta)), module / 2 * np.cos(theta)
    half = math.pi * module / 4
    tooth = np.stack([half - x, pitch - y], axis=1)
    space = np.stack([half + x, neutral + pitch + y], axis=1)
    return Flanks(tooth, space)


def test_s_profiles_touch_all_the_way_out_on_a_rack():
    module = MANY.module
    ring = Mesh(MANY, Cosine(module, MANY.flexspline_inner_radius)).ring
    flanks = s_profile(module, 0.66, ring.neutral)
    for phi in np.radians((5, 20, 40, 60, 80)):
        assert gap_at(ring, flanks, phi, LEADING) == pytest.approx(0, abs=RACK)
        assert gap_at(ring, flanks, phi, TRAILING) > 0


def test_the_lean_of_few_teeth_closes_the_gap_of_an_s_profile():
    """What the rack leaves out: 6 to 8 um of a CSF-25-80's S-profile, between nothing and the lean times the height of
    the point that touches. The least gap is that of both curves laid over each other point by point."""
    module, pitch = CSF_25_80.module, 0.66
    ring = Mesh(CSF_25_80, Cosine(module)).ring
    flanks = s_profile(module, pitch, ring.neutral)
    for phi in np.radians((20, 30)):
        x0, y0, lean = tooth_place(ring, phi)
        x, y = flanks.tooth.T
        across, up = x0 + x * math.cos(lean) + y * math.sin(lean), y0 + y * math.cos(lean) - x * math.sin(lean)
        common = np.linspace(max(up.min(), flanks.space[:, 1].min()), min(up.max(), flanks.space[:, 1].max()), 20_001)
        tooth = np.interp(common, up, across)
        space = np.interp(common, flanks.space[::-1, 1], flanks.space[::-1, 0])
        found = gap_at(ring, flanks, phi, LEADING)
        assert found == pytest.approx((space - tooth).min(), abs=1e-6)  # 2,001 points of a curve leave its sag
        assert -lean * (pitch - module / 2 * math.cos(2 * phi)) < found < -0.005


@pytest.mark.parametrize("profile", SMOOTH)
def test_a_tooth_stands_where_its_share_of_the_neutral_line_ends(profile):
    """The place by quadrature of the profile itself, the lean by its slope."""
    mesh = Mesh(CSF_25_80, PROFILES[profile])
    neutral = CSF_25_80.flexspline_inner_radius + CSF_25_80.flexspline_wall / 2

    def speed(at):
        radius, slope = (float(PROFILES[profile].radius(at, k)) for k in (0, 1))
        return math.hypot(radius + CSF_25_80.flexspline_wall / 2, slope)

    def length(to):
        return quad(speed, 0, to, points=[math.radians(60)] if to > math.radians(60) else None, epsabs=1e-11)[0]

    whole = length(math.pi / 2)
    for phi in (0.2, 0.7, 1.3):
        undeformed = length(phi) / whole * math.pi / 2
        space = undeformed * 160 / 162
        radius, slope = (float(PROFILES[profile].radius(phi, k)) for k in (0, 1))
        rho = radius + CSF_25_80.flexspline_wall / 2
        expected = rho * math.sin(phi - space), rho * math.cos(phi - space), phi - math.atan2(slope, rho) - space
        # Cubics over one degree of the line's length leave 3e-9 of its radius where the wrap ends.
        assert tooth_place(mesh.ring, phi) == pytest.approx(expected, abs=3e-7)
    assert neutral == mesh.ring.neutral


@pytest.mark.parametrize("profile", SMOOTH)
def test_gaps_are_half_the_backlash_on_the_major_axis_and_lean_parts_tip_and_root(profile):
    mesh, alpha = Mesh(CSF_25_80, PROFILES[profile]), math.radians(12)
    leading, trailing = mesh.gaps(np.array([0.0, math.radians(15)]), alpha, 0.01)
    assert (leading[0], trailing[0]) == pytest.approx((0.005, 0.005), abs=1e-12)
    ring, flanks = mesh.ring, mesh.flanks(alpha, 0.01)
    x0, y0, lean = tooth_place(ring, math.radians(15))
    by_hand = []
    for x, y in flanks.tooth:
        across, up = x0 + x * math.cos(lean) + y * math.sin(lean), y0 + y * math.cos(lean) - x * math.sin(lean)
        (x1, y1), (x2, y2) = flanks.space
        by_hand.append((x1 + (up - y1) / (y2 - y1) * (x2 - x1) - across, up))
    (_, _), (at_tip, tip) = by_hand
    assert tip > flanks.space[0, 1]
    assert leading[1] == pytest.approx(at_tip, abs=1e-12)  # the tip leans forward: it is the first to touch


@pytest.mark.parametrize("profile", SMOOTH)
def test_the_free_angle_grows_with_pressure_angle_and_play(profile):
    mesh = Mesh(CSF_25_80, PROFILES[profile])
    angles = [mesh.free_flank_angle(math.radians(a), 0.01) for a in (4, 8, 12, 20, 30)]
    assert (np.diff(angles) > 0).all()
    plays = [mesh.free_flank_angle(math.radians(12), e) for e in (0.002, 0.01, 0.03)]
    assert (np.diff(plays) > 0).all()
    assert mesh.free_flank_angle(math.radians(44), 0.5) == math.pi / 2


@pytest.mark.parametrize("profile", SMOOTH)
def test_room_runs_out_where_the_free_angle_ends(profile):
    mesh = Mesh(CSF_25_80, PROFILES[profile])
    psi = mesh.free_flank_angle(math.radians(9), 0.01)
    withdrawal, shift = mesh.path(psi)
    assert 0.005 + withdrawal * math.tan(math.radians(9)) - shift == pytest.approx(0, abs=1e-14)


@pytest.mark.parametrize("profile", SMOOTH)
def test_the_relief_is_the_largest_overlap_of_straight_flanks_that_carry(profile):
    mesh, alpha = Mesh(CSF_25_80, PROFILES[profile]), math.radians(12)
    leading, _ = mesh.gaps(np.linspace(0, mesh.carrying_angle(alpha, 0.01), 400), alpha, 0.01)
    assert leading.min() < -0.01
    assert mesh.tip_relief(alpha, 0.01) == pytest.approx(-leading.min(), abs=1e-5)
    assert mesh.tip_relief(math.radians(40), 0.01) == 0


@pytest.mark.parametrize("ratio", (1.05, 1.12))
def test_more_deflection_than_module_takes_the_trailing_flanks_room(ratio):
    module, alpha = CSF_25_80.module, math.radians(8)
    mesh = Mesh(CSF_25_80, Cosine(ratio * module))
    _, trailing = mesh.gaps(np.linspace(0, math.pi / 6, 4001), alpha, 0.01)
    assert trailing.min() < 0.005
    assert mesh.trailing_flank_room(alpha, 0.01) == pytest.approx(trailing.min(), abs=1e-9)
    assert Mesh(CSF_25_80, Cosine(0.98 * module)).trailing_flank_room(alpha, 0.01) == pytest.approx(0.005)


@pytest.mark.parametrize("profile", SMOOTH)
def test_contact_and_pressure_agree_with_the_physics_where_all_overlapped_teeth_carry(profile):
    mesh = Mesh(CSF_25_80, PROFILES[profile])
    assert mesh.contact_angle == pytest.approx(contact_angle(CSF_25_80, PROFILES[profile]), abs=1e-12)
    loaded = replace(drive(PROFILES[profile]), load=Load(63_000.0, 200.0, 15.0))
    assert mesh.contact(TIPS, 0.2, None).flank_pressure(63_000.0, 15.0) == pytest.approx(mean_flank_pressure(loaded))
    assert mesh.carrying_angle(math.radians(12), 0.01) < mesh.contact_angle
    assert mesh.carrying_angle(math.radians(44), 0.5) == mesh.contact_angle


@pytest.mark.parametrize("profile", SMOOTH)
def test_bending_agrees_with_the_physics(profile):
    mesh = Mesh(CSF_25_80, PROFILES[profile])
    # The physics takes the largest of 0.025 deg steps, the mesh of 1 deg steps with a parabola between.
    assert mesh.largest_curvature_change == pytest.approx(max_curvature_change(CSF_25_80, PROFILES[profile]), rel=1e-5)


def test_the_end_of_the_wrap_is_looked_at_itself():
    """The third derivative jumps there, between places of the grid: the largest change of a small wrap lies on it."""
    wrap = math.radians(9.95)
    profile = TwoDisk(30.65, 0.396, wrap)
    at_its_end = abs(float(curvature_change(CSF_25_80, profile, wrap)))
    assert Mesh(CSF_25_80, profile).largest_curvature_change == pytest.approx(at_its_end, rel=1e-5)
