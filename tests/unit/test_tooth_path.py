"""The tooth's path, and how far from the major axis flanks can carry."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from cases import CSF_25_80, PROFILES, drive

from hdopt.drive.geometry import Load
from hdopt.drive.profiles import TwoDisk
from hdopt.mechanics.bending import curvature_change, max_curvature_change
from hdopt.mechanics.contact import contact_angle, mean_flank_pressure
from hdopt.mechanics.tooth_path import Mesh

SMOOTH = ("ellipse", "resal", "two_disk")


@dataclass(frozen=True)
class Cosine:
    """w = w0 cos 2 phi exactly: the curve whose path is known in closed form."""

    deflection: float
    name = "cosine"
    tip_is_smooth = True

    def radius(self, phi, derivative=0):
        phi = np.asarray(phi, float)
        radius = CSF_25_80.flexspline_inner_radius
        return (
            radius + self.deflection * np.cos(2 * phi),
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


@pytest.mark.parametrize("ratio", (1.05, 1.12))
def test_more_deflection_than_module_takes_the_trailing_flanks_room(ratio):
    module, alpha = CSF_25_80.module, math.radians(8)
    mesh = Mesh(CSF_25_80, Cosine(ratio * module))
    psi = np.linspace(0, math.pi / 2, 20001)
    t = module / 2 * (2 * psi - ratio * np.sin(2 * psi))
    room = 0.005 + ratio * module * (1 - np.cos(2 * psi)) * math.tan(alpha) + t
    assert mesh.trailing_flank_room(alpha, 0.01) == pytest.approx(room.min(), abs=2e-6)  # a parabola on a 0.5 deg grid
    assert Mesh(CSF_25_80, Cosine(0.98 * module)).trailing_flank_room(alpha, 0.01) == pytest.approx(0.005)


@pytest.mark.parametrize("profile", SMOOTH)
def test_contact_and_pressure_agree_with_the_physics_where_all_overlapped_teeth_carry(profile):
    mesh = Mesh(CSF_25_80, PROFILES[profile])
    assert mesh.contact_angle == pytest.approx(contact_angle(CSF_25_80, PROFILES[profile]), abs=1e-12)
    loaded = replace(drive(PROFILES[profile]), load=Load(63_000.0, 200.0, 15.0))
    assert mesh.flank_pressure(63_000.0, 15.0, mesh.contact_angle) == pytest.approx(mean_flank_pressure(loaded))
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
