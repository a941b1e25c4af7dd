"""Contact angle, teeth in mesh, flank pressure, curvature change and bending stress."""

from dataclasses import replace

import numpy as np
import pytest
from cases import CSF_25_80, PROFILES, drive

from hdopt.drive.geometry import Clearances, Load, Material
from hdopt.drive.profiles import Ellipse
from hdopt.errors import HdoptError, MissingValue
from hdopt.mechanics.bending import (
    bending_stress,
    curvature_change,
    fatigue_safety,
    hoop_stress,
    max_bending_stress,
    max_curvature_change,
)
from hdopt.mechanics.contact import (
    FLANKS,
    TIPS,
    contact_angle,
    homogenization_coefficient,
    meshing_teeth,
    tip_overlap,
)
from hdopt.mechanics.contact_model import contact_of, mean_flank_pressure
from hdopt.mechanics.tooth_path import Mesh

EVERY = pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES.keys())
STEEL = Material(206_000.0, 0.3)


class CosineRing:
    """w = w0 cos 2 phi: the ring whose curvature change has a textbook value."""

    name, tip_is_smooth = "cosine", True

    def __init__(self, radius, deflection):
        self.undeformed, self.deflection = radius, deflection
        self.semi_major = radius + deflection

    def radius(self, phi, derivative=0):
        w0, phi = self.deflection, np.asarray(phi, float)
        if derivative == 0:
            return self.undeformed + w0 * np.cos(2 * phi)
        return -2 * w0 * np.sin(2 * phi) if derivative == 1 else -4 * w0 * np.cos(2 * phi)


@EVERY
def test_tips_cross_at_the_contact_angle_and_overlap_inside_it(profile):
    angle = contact_angle(CSF_25_80, profile)
    assert tip_overlap(CSF_25_80, profile, angle) == pytest.approx(0, abs=1e-12)
    assert (tip_overlap(CSF_25_80, profile, np.linspace(0, 0.999 * angle)) > 0).all()
    assert (tip_overlap(CSF_25_80, profile, np.linspace(1.001 * angle, np.pi / 2)) < 0).all()


def test_contact_needs_tips_that_reach_and_that_clear():
    short = replace(CSF_25_80, flexspline_addendum=0.01, circular_spline_addendum=0.01)
    shallow = replace(CSF_25_80, flexspline_inner_radius=30.65, flexspline_addendum=0.9)
    with pytest.raises(HdoptError, match=r"never reach each other: their tips miss by 0\.0?\d+ mm"):
        contact_angle(replace(short, flexspline_inner_radius=30.8), PROFILES["ellipse"])
    with pytest.raises(HdoptError, match="overlap all round"):
        contact_angle(shallow, PROFILES["ellipse"])
    with pytest.raises(MissingValue, match="the contact angle needs drive.flexspline_addendum_mm"):
        contact_angle(replace(CSF_25_80, flexspline_addendum=None), PROFILES["ellipse"])


def test_more_teeth_in_mesh_even_out_more():
    assert meshing_teeth(CSF_25_80, np.pi) == 81
    assert homogenization_coefficient(25.0) == pytest.approx(0.2)
    assert homogenization_coefficient(25.0, 0.8) == pytest.approx(0.16)
    with pytest.raises(HdoptError, match=r"k_B is 0.5; .* gives 0.8 to 1.0"):
        homogenization_coefficient(25.0, 0.5)


@pytest.mark.parametrize("counts", [None, TIPS, FLANKS])
def test_k_e_and_flank_pressure_count_the_same_teeth(counts):
    """Would catch k_e over tips that overlap beside a pressure over flanks that carry, as a search once had it."""
    design = replace(
        drive(),
        geometry=replace(CSF_25_80, contact=counts),
        load=Load(torque=63_000.0, tooth_face_width=15.0),
        clearances=Clearances(backlash=0.01),
    )
    mesh = Mesh(design.geometry, design.wave_generator.profile)
    angle = mesh.carrying_angle(CSF_25_80.pressure_angle, 0.01) if counts == FLANKS else mesh.contact_angle
    assert (angle < mesh.contact_angle) == (counts == FLANKS)
    teeth = CSF_25_80.circular_spline_teeth * angle / (2 * np.pi)
    contact = contact_of(design)
    assert contact.homogenization() == pytest.approx(teeth**-0.5, rel=1e-12)
    # By the midpoint rule over 20,000 places, right to 1e-9.
    phi = (np.arange(20_000) + 0.5) * angle / 20_000
    depth = 2 * teeth * tip_overlap(CSF_25_80, mesh.profile, phi).mean()
    force = 63_000.0 / (CSF_25_80.module * CSF_25_80.flexspline_teeth / 2)
    assert mean_flank_pressure(design) == pytest.approx(force / (15.0 * depth), rel=1e-7)


def test_flanks_that_carry_need_a_backlash():
    design = replace(drive(), geometry=replace(CSF_25_80, contact=FLANKS), clearances=Clearances())
    with pytest.raises(MissingValue, match=r"contact of the flanks needs clearances.backlash_mm"):
        contact_of(design)


def test_flank_pressure_is_load_over_the_summed_overlap():
    design = replace(drive(), load=Load(torque=63_000.0, tooth_face_width=15.0))
    angle = contact_angle(CSF_25_80, design.wave_generator.profile)
    # By hand: every tooth of one flank in both zones, at its own place.
    pitch = 2 * np.pi / CSF_25_80.circular_spline_teeth
    teeth = np.arange(pitch / 2, angle, pitch)
    depth = 2 * tip_overlap(CSF_25_80, design.wave_generator.profile, teeth).sum()
    force = 63_000.0 / (CSF_25_80.module * CSF_25_80.flexspline_teeth / 2)
    # A sum over single teeth against an integral over the angle: they differ by less than half a tooth of 26.
    assert mean_flank_pressure(design) == pytest.approx(force / (15.0 * depth), rel=0.02)
    assert mean_flank_pressure(design, 126_000.0) == pytest.approx(2 * mean_flank_pressure(design))


@pytest.mark.parametrize(
    ("load", "missing"),
    [(Load(torque=1.0), "load.tooth_face_width_mm"), (Load(tooth_face_width=1.0), "load.torque_nm")],
)
def test_flank_pressure_says_which_number_is_missing(load, missing):
    with pytest.raises(MissingValue, match=f"the flank pressure needs {missing}"):
        mean_flank_pressure(replace(drive(), load=load))


def test_small_cosine_deflection_bends_the_tip_by_three_w0_over_r_squared():
    ring, geometry = CosineRing(30.65, 1e-4), replace(CSF_25_80, flexspline_wall=1e-6)
    # Timoshenko's linear ring, right to first order in w0/R = 3e-6.
    assert curvature_change(geometry, ring, 0.0) == pytest.approx(3 * 1e-4 / 30.65**2, rel=1e-4)
    assert curvature_change(geometry, ring, np.pi / 2) == pytest.approx(-3 * 1e-4 / 30.65**2, rel=1e-4)


def test_the_neutral_line_lies_half_a_wall_outside():
    """3 w0/(R + s/2)^2 of a ring 2 mm thick: 6 % less than at its inner wall."""
    ring, geometry = CosineRing(30.65, 1e-4), replace(CSF_25_80, flexspline_wall=2.0)
    assert curvature_change(geometry, ring, 0.0) == pytest.approx(3 * 1e-4 / 31.65**2, rel=1e-3)


@EVERY
def test_largest_curvature_change_is_the_largest(profile):
    phi = np.linspace(0, 2 * np.pi, 40_001)
    assert max_curvature_change(CSF_25_80, profile) == pytest.approx(
        np.abs(curvature_change(CSF_25_80, profile, phi)).max(), rel=1e-6
    )


def test_a_ring_blown_up_has_the_hoop_stress_of_its_strain():
    """E times the growth of the radius over the radius; a profile that is too short presses nothing."""
    for growth, expected in ((0.03, 206_000 * 0.03 / 30.65), (-0.03, 0.0)):
        round_one = Ellipse(30.65 + growth, 30.65 + growth - 1e-9)
        assert hoop_stress(STEEL, CSF_25_80, round_one) == pytest.approx(expected, rel=1e-6)


def test_safety_falls_with_alternating_and_steady_stress():
    """Haigh's straight line: 450/(180 + 0.2 100), and the plain ratio without a steady stress."""
    assert fatigue_safety(450.0, 180.0, 100.0, 0.2) == pytest.approx(2.25)
    assert fatigue_safety(450.0, 180.0, 0.0, 0.2) == pytest.approx(2.5)


def test_stress_of_a_ring_and_of_a_plate():
    assert bending_stress(STEEL, 0.74, 1e-3) == pytest.approx(206_000 * 0.74 * 1e-3 / 2)
    assert bending_stress(STEEL, 0.74, 1e-3, plate=True) == pytest.approx(206_000 * 0.74e-3 / 2 / (1 - 0.09))
    design = replace(drive(), material=STEEL)
    assert max_bending_stress(design, plate=True) == pytest.approx(max_bending_stress(design) / 0.91)


def test_stress_says_which_number_is_missing():
    with pytest.raises(MissingValue, match=r"bending stress needs material.modulus_mpa and material.poisson"):
        max_bending_stress(drive())
    with pytest.raises(MissingValue, match=r"drive.flexspline_wall_mm"):
        curvature_change(replace(CSF_25_80, flexspline_wall=None), PROFILES["resal"], 0.0)
