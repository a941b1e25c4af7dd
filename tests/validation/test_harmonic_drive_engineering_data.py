"""Forces and life of the wave generator as Harmonic Drive SE publishes them.

Engineering Data HFUS-2A, 1019658 11/2014: Eqs. 21.2, 21.3 (life), 34.4 with its worked example (axial force). And the
stiffness of a thin ring: Timoshenko, Strength of Materials, Part I.
"""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from cases import CSF_25_80

from hdopt.mechanics.bearing_life import (
    BearingConstants,
    axial_force,
    bearing_life_h,
    bearing_load,
    radial_force,
    ring_force,
)

RPM = 2 * math.pi / 60
CONSTANTS = BearingConstants(rated_torque=63_000.0, rated_speed=2000 * RPM)


def test_the_worked_example_of_the_axial_force():
    """CSD-32-50 under 200 N m: 215 N, of which 16 N are the additional force of the CSD series."""
    diameter, teeth = 32 * 2.54, CSF_25_80.flexspline_teeth
    size_32 = replace(CSF_25_80, module=diameter / teeth, pressure_angle=math.radians(30))
    assert axial_force(size_32, 200_000.0, 0.07) + 16 == pytest.approx(215, abs=0.5)


@pytest.mark.parametrize("torque, speed, hours", ((1.0, 1.0, 35_000), (0.5, 1.0, 280_000), (1.0, 2.0, 17_500)))
def test_life_follows_torque_and_speed_as_the_makers_say(torque, speed, hours):
    """L50 = 35,000 h (n_N/n)(T_N/T)^3, L10 a fifth of it, for the drive they rate and without the ring's own force."""
    rated = bearing_load(CSF_25_80, CONSTANTS.rated_torque, CONSTANTS.friction, 0.0)
    load = bearing_load(CSF_25_80, torque * CONSTANTS.rated_torque, CONSTANTS.friction, 0.0)
    life = bearing_life_h(load, 9.0, rated, 9.0, speed * CONSTANTS.rated_speed, CONSTANTS)
    assert 5 * life == pytest.approx(hours)


def test_friction_makes_a_wedge_press_harder():
    """A tooth pushed into its space: (2 T/d) tan(alpha + rho), rho = arctan(mu), and the ring's force beside it."""
    tangential = 2 * 63_000.0 / (CSF_25_80.module * CSF_25_80.flexspline_teeth)
    expected = tangential * math.tan(CSF_25_80.pressure_angle + math.atan(0.07)) + 40.0
    assert bearing_load(CSF_25_80, 63_000.0, 0.07, 40.0) == pytest.approx(expected)
    assert bearing_load(CSF_25_80, 63_000.0, 0.0, 0.0) == pytest.approx(radial_force(CSF_25_80, 63_000.0))


def test_width_and_pressure_angle_as_assumed():
    """ISO 281's Z^(2/3) Dw^1.8 with Z ~ 1/Dw: twice the width, 2^(3 * 17/15) the life."""
    rated = bearing_load(CSF_25_80, 63_000.0, 0.07, 0.0)
    one, two = (bearing_life_h(rated, b, rated, 9.0, CONSTANTS.rated_speed, CONSTANTS) for b in (9.0, 18.0))
    assert two / one == pytest.approx(2 ** (3 * (1.8 - 2 / 3)))
    flat = replace(CSF_25_80, pressure_angle=math.radians(6))
    assert bearing_load(flat, 63_000.0, 0.0, 0.0) == pytest.approx(radial_force(flat, 63_000.0))
    assert bearing_load(flat, 63_000.0, 0.07, 0.0) < rated


def test_the_ring_opens_by_what_it_is_pulled_with():
    """Unit-load integral of a thin ring pulled by opposite forces P: its diameter grows P R^3/(E I) (pi/4 - 2/pi)."""
    modulus, face = 206_000.0, 15.0
    force = ring_force(CSF_25_80, 0.396, modulus, face)
    radius, inertia = 30.65 + 0.37, face * 0.74**3 / 12
    phi = [(i + 0.5) * math.pi / 2 / 20_000 for i in range(20_000)]
    # Moment P R (cos phi/2 - 1/pi) from the force, the redundant moment taken out; energy -> diameter.
    growth = sum(4 * (math.cos(p) / 2 - 1 / math.pi) ** 2 for p in phi) * (math.pi / 2 / 20_000)
    assert force * radius**3 / (modulus * inertia) * growth == pytest.approx(2 * 0.396, rel=1e-6)
