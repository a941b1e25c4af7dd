"""What an operating condition makes of input angles, and what the extended model adds where."""

from types import SimpleNamespace

import numpy as np
import pytest

from hdopt.kinematics.closed_form import deepest_points
from hdopt.kinematics.waveform import deviation_at
from hdopt.simulation.model import ExtendedModel
from hdopt.simulation.operation import RPM, Operation
from hdopt.study import load_study

RATIO, SPAN = 80.0, 2 * np.pi * 80
THETA = np.linspace(10.0, 400.0, 40)
BOTH = Operation(motion="both", torque=20.0, speed=60 * RPM, temperature_difference=5.0, time=7.0)


def test_a_revolution_a_minute():
    assert 60 * RPM == pytest.approx(2 * np.pi)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_there_and_back_are_one_motion(direction):
    """The row before is the end of the other pass; travel in deg of output; the clock goes on from the start from cold,
    on the way back after the whole way there."""
    c = BOTH.conditions(RATIO, THETA, direction, SPAN)
    start = 0.0 if direction > 0 else SPAN
    assert (c.theta[0], c.direction[0], c.first[0]) == (start, -direction, True)
    assert np.all(c.direction[1:] == direction) and not c.first[1:].any()
    assert c.travel[1:] == pytest.approx(np.degrees(np.abs(THETA - start)) / RATIO)
    waited = 0.0 if direction > 0 else SPAN
    assert c.time[1:] == pytest.approx(7.0 + (waited + np.abs(THETA - start)) / (2 * np.pi))
    assert np.all(c.speed[1:] == direction * 2 * np.pi)
    assert set(c.torque) == {20.0} and set(c.temperature) == {5.0}
    assert BOTH.of_pass(c.theta) == pytest.approx(THETA)


def test_one_way_has_no_reversal():
    c = Operation(speed=2.0).conditions(RATIO, THETA, 1.0, SPAN)
    assert c.first.all() and len(c) == len(THETA)
    assert c.time == pytest.approx(THETA / 2.0)
    assert c.torque is None and c.temperature is None


class Lifted:
    """An effect that lifts zone 1 alone, by 0.01 mm of arc, or adds 0.3 arcmin beside the zones."""

    id, needs, follows_base, coefficients = "lifted", {}, False, (1.0,)

    def __init__(self, beside):
        self.beside = beside

    def highest_order(self, ratio):
        return 100.0

    def term(self, rows):
        n = len(rows)
        zones = None if self.beside else np.stack([np.full((n, 1), 0.01), np.zeros((n, 1))])
        return SimpleNamespace(zones=zones, met=None, columns=np.full((n, 1), 0.3) if self.beside else None)


@pytest.fixture(scope="module")
def model():
    study = load_study("csf-25-80")
    return ExtendedModel(study.drive, study.errors, (), homogenization=0.2, geometry="closed form")


def test_the_zones_are_lifted_before_the_larger_drives(model):
    """k_e (2 pi/l_FS) max(tau_1 + lift, tau_2), Jia 2021, Eqs. (31), (32)."""
    theta, lifted = np.linspace(0, 50, 300), model.with_effects([Lifted(beside=False)])
    points = deepest_points(model.drive, model.errors, theta)
    deviation = deviation_at(model.drive, model.errors, theta, points)
    expected = np.maximum(deviation[0] + 0.01, deviation[1]) * 0.2 * model.drive.geometry.arcmin_per_mm
    assert lifted.driven(theta, points) == pytest.approx(expected)


def test_what_is_beside_the_zones_is_not_evened_out(model):
    theta = np.linspace(0, 50, 300)
    added = model.with_effects([Lifted(beside=True)])
    assert added.waveform(theta) - model.waveform(theta) == pytest.approx(0.3)


def test_a_ripple_has_sixteen_samples_a_period(model):
    assert model.with_effects([Lifted(beside=True)]).samples_per_turn == 1600
