"""A measured profile whose points scatter: how far, where, and that it is said where it makes the curvature."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from cases import CSF_25_80, TABLE_1_ELLIPSE, drive
from hypothesis import given, settings
from hypothesis import strategies as st

from hdopt.drive.profiles import MeasuredProfile, curvature, parallel_profile
from hdopt.drive.scatter import differences, scatter_of_points
from hdopt.errors import HdoptError
from hdopt.geometry.contour import ParallelCurve
from hdopt.workflow.measured_parts import words_on_measured_parts
from hdopt.workflow.rough_profile import words_on_a_rough_profile

TURN = np.arange(720) * (2 * math.pi / 720)
CAM = TABLE_1_ELLIPSE.radius(TURN) - 3.0


def said_of(profile):
    return words_on_a_rough_profile(replace(drive(), wave_generator=replace(drive().wave_generator, profile=profile)))


@given(
    order=st.sampled_from([2, 4, 6, 8]),
    steps=st.lists(st.floats(0.5, 2.0), min_size=24, max_size=60),
    at=st.integers(0, 23),
)
@settings(max_examples=40, deadline=None)
def test_differences_leave_no_polynomial_and_weigh_scatter_as_one(order, steps, at):
    """Would catch steps taken for even, weights that are not scaled to one, and a point that is off its own place: a
    polynomial of a lower degree has no difference, and the weights' squares add up to one."""
    angles = np.cumsum(steps) / sum(steps) * 2 * math.pi
    away = np.angle(np.exp(1j * (angles - angles[at])))
    radii = 30 + away ** (order - 1)
    assert differences(angles, radii, order)[at] == pytest.approx(0, abs=1e-9)
    units = np.array([differences(angles, np.eye(len(angles))[j], order)[at] for j in range(len(angles))])
    assert np.sum(units**2) == pytest.approx(1)


@pytest.mark.parametrize("points", [72, 720])
def test_scatter_is_found_beside_the_smooth_curve(points):
    """Would catch the oval itself taken for scatter: at 5 deg steps its second differences are some 5 um."""
    angles = np.arange(points) * (2 * math.pi / points)
    noise = np.random.default_rng(4).normal(0, 5e-4, points)
    true = np.sqrt(np.mean(noise**2))
    found, _ = scatter_of_points(angles, TABLE_1_ELLIPSE.radius(angles) + noise)
    # Neighbouring differences share points: those of 72 tell the standard deviation within some 20 %.
    assert found == pytest.approx(true, rel=0.4 if points == 72 else 0.08)
    clean, _ = scatter_of_points(angles, TABLE_1_ELLIPSE.radius(angles))
    assert clean < 1e-4 * found if points == 720 else clean < 0.1 * found
    spoilt = TABLE_1_ELLIPSE.radius(angles) + np.where(np.arange(points) == 40, 0.01, 0.0)
    assert scatter_of_points(angles, spoilt)[1] == 40


@pytest.mark.parametrize("on_the_cam", [False, True])
def test_scatter_that_makes_the_curvature_is_named_with_its_remedy(on_the_cam):
    """Would catch a curvature of the scatter told without a word, a note that stays when its own advice was taken, and
    the points of the flexspline's wall judged in place of those that were measured."""
    noise = np.random.default_rng(1).normal(0, 1e-3, 720)
    noise[301] += 0.006
    radii = CAM + noise

    def profile(noise):
        table = MeasuredProfile(TURN, radii, noise, source="cam.csv")
        return parallel_profile(table, 3.0) if on_the_cam else table

    (said,) = said_of(profile(0.0))
    assert "the points of cam.csv scatter by " in said and "most at 150.5 deg" in said
    advice = float(said.partition("wave_generator.noise_um = ")[2].partition(",")[0])
    assert advice == pytest.approx(1000 * np.sqrt(np.mean(noise**2)), rel=0.08)
    assert said_of(profile(advice / 1000)) == []
    (little,) = said_of(profile(1e-4))
    assert "noise_um = 0.1 is less" in little
    # It is true: a change of curvature of the ellipse is 3 w0/R^2 to first order, what is told many times that.
    w0, radius = CSF_25_80.module, CSF_25_80.flexspline_inner_radius
    told = np.abs(curvature(profile(0.0), TURN + 0.001) - 1 / radius).max()
    assert told > 30 * 3 * w0 / radius**2


@pytest.mark.parametrize("points", [16, 36, 720])
def test_a_clean_table_is_left_in_peace(points):
    """Would catch a warning of the oval itself where points are few, or of a table's last digit."""
    angles = np.arange(points) * (2 * math.pi / points)
    assert said_of(MeasuredProfile(angles, np.round(TABLE_1_ELLIPSE.radius(angles), 6))) == []
    assert said_of(TABLE_1_ELLIPSE) == []


def test_a_contour_that_scatter_makes_cross_itself_names_the_noise():
    """Would catch advice to make the bearing thinner alone, where the points scatter."""
    rough = MeasuredProfile(TURN, TABLE_1_ELLIPSE.radius(TURN) + np.random.default_rng(1).normal(0, 0.01, 720))
    with pytest.raises(HdoptError, match=r"crosses itself: .* as wave_generator\.noise_um"):
        ParallelCurve(rough, 3.0)
    with pytest.raises(HdoptError) as of_an_ellipse:
        ParallelCurve(TABLE_1_ELLIPSE, 31.0)
    assert "noise_um" not in str(of_an_ellipse.value)


def test_scatter_is_said_wherever_the_cam_counts():
    """With `ke`, stacks, searches and what is recorded, once. Would catch words that only `hdopt ke --profile` prints,
    and the same twice."""
    noise = np.random.default_rng(4).normal(0, 1e-3, len(TURN))
    profile = parallel_profile(MeasuredProfile(TURN, CAM + noise, source="cam.csv"), 3.0)
    rough = replace(drive(), wave_generator=replace(drive().wave_generator, profile=profile))
    words = words_on_measured_parts(rough)
    assert [word for word in words if "scatter by" in word] == words_on_a_rough_profile(rough)
    assert len(words_on_a_rough_profile(rough)) == 1
    assert not any("scatter" in word for word in words_on_measured_parts(drive()))
