"""A measured cam has two zones of two sides: what is told of its contact may not hang on where its table begins."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from cases import CSF_25_80, PROFILES, drive
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from hdopt.drive.geometry import Clearances, Load
from hdopt.drive.profiles import MeasuredProfile
from hdopt.mechanics.contact import FLANKS, TIPS, contact_angle, tip_overlap
from hdopt.mechanics.contact_model import contact_of, mean_flank_pressure
from hdopt.mechanics.tooth_path import Mesh

ANGLES = np.arange(360) * (2 * math.pi / 360)
MEAN, OVAL = CSF_25_80.flexspline_inner_radius, CSF_25_80.module


def table(turned=0.0, mirrored=False, waves=(0.02, 0.012, -0.008), bump=None):
    """Points of one lopsided cam: an oval with the given sine `waves` of 1, 3 and 1 (across) a turn, mm, and a `bump`
    (mm) of 20 deg about an angle; read from a start that lies `turned` rad along it, in the other direction where it is
    `mirrored`."""
    phi = (-ANGLES if mirrored else ANGLES) + turned
    first, third, across = waves
    radii = MEAN + OVAL * np.cos(2 * phi) + first * np.cos(phi) + third * np.cos(3 * phi + 0.7) + across * np.sin(phi)
    if bump is not None:
        height, at = bump
        off = np.angle(np.exp(1j * (phi - at)))
        radii = radii + height * np.where(np.abs(off) < math.radians(10), np.cos(9 * off) ** 4, 0.0)
    return MeasuredProfile(ANGLES, radii)


def built(profile, counts):
    gear = replace(CSF_25_80, contact=counts)
    wave_generator = replace(drive().wave_generator, profile=profile)
    load = Load(torque=63_000.0, tooth_face_width=15.0)
    clearances = Clearances(backlash=0.01)
    return replace(drive(), geometry=gear, wave_generator=wave_generator, load=load, clearances=clearances)


def told(profile, counts=TIPS):
    """Contact angle, k_e and mean flank pressure of one cam."""
    one = built(profile, counts)
    contact = contact_of(one)
    return contact.angle, contact.homogenization(), mean_flank_pressure(one)


@given(
    waves=st.tuples(*[st.floats(-0.02, 0.02)] * 3),
    turned=st.sampled_from([0.0, math.pi]),
    mirrored=st.booleans(),
    counts=st.sampled_from([TIPS, FLANKS]),
)
@settings(max_examples=25, deadline=None)
def test_half_a_turn_and_a_mirror_leave_the_contact_of_one_part_as_it_is(waves, turned, mirrored, counts):
    """Would catch contact that is read from one quarter of the table: 56.4 deg of a part that gives 51.5 deg where its
    table begins half a turn away."""
    other = table(turned, mirrored, waves)
    # The spline is fitted anew; 360 points hold the curve to some 1e-12 mm.
    assert told(other, counts) == pytest.approx(told(table(waves=waves), counts), rel=1e-9)


@pytest.mark.parametrize("counts", [TIPS, FLANKS])
def test_a_bump_counts_alike_on_every_side(counts):
    """Would catch sides of unlike weight, or a side that is left out: a bump where the tips part makes the contact
    longer by the same amount on whichever of the four sides it lies, and so does one where flanks cease to run free."""
    place = math.radians(54 if counts == TIPS else 30)
    plain = told(table(waves=(0, 0, 0)), counts)
    places = [place, -place, math.pi + place, math.pi - place]
    bumped = [told(table(waves=(0, 0, 0), bump=(0.01, at)), counts) for at in places]
    for values in bumped:
        assert values == pytest.approx(bumped[0], rel=1e-9)
        assert values[2] != pytest.approx(plain[2], rel=1e-6)
    assert bumped[0][0] - plain[0] > math.radians(0.05)


def test_the_contact_angle_is_the_mean_of_the_four_crossings():
    """Would catch a mean of the radii in place of that of the angles, and a side that is counted twice: the crossings
    are found here from the formula of the cam itself."""
    missing = CSF_25_80.module - CSF_25_80.flexspline_addendum - CSF_25_80.circular_spline_addendum

    def overlap(phi):
        return OVAL * math.cos(2 * phi) + 0.02 * math.cos(phi) + 0.012 * math.cos(3 * phi + 0.7) - 0.008 * math.sin(phi)

    crossings = [
        brentq(lambda psi, tip=tip, sense=sense: overlap(tip + sense * psi) - missing, 0.0, math.pi / 2, xtol=1e-14)
        for tip in (0.0, math.pi)
        for sense in (1, -1)
    ]
    assert np.ptp(crossings) > math.radians(1)
    by_hand = sum(crossings) / 4
    assert contact_angle(CSF_25_80, table()) == pytest.approx(by_hand, abs=1e-9)
    assert contact_of(built(table(), TIPS)).angle == pytest.approx(by_hand, abs=1e-8)
    # Teeth in mesh of all sides together: those whose tips overlap anywhere on the turn, a quarter of them.
    phi = (np.arange(200_000) + 0.5) * (2 * math.pi / 200_000)
    share = np.mean(tip_overlap(CSF_25_80, table(), phi) > 0)
    assert contact_of(built(table(), TIPS)).teeth == pytest.approx(162 * share / 4, abs=2e-3)


@pytest.mark.parametrize("profile", ["ellipse", "resal", "two_disk"])
def test_symmetric_profiles_are_looked_at_from_one_side_only(profile):
    """Would catch a last digit of a symmetric profile that changes with the sides: its angle is the one root itself."""
    curve = PROFILES[profile]
    root = brentq(lambda phi: float(tip_overlap(CSF_25_80, curve, phi)), 0.0, math.pi / 2, xtol=1e-14)
    assert contact_angle(CSF_25_80, curve) == root
    mesh = Mesh(CSF_25_80, curve)
    assert mesh.sides == (mesh,)
