"""Doubts on sizes that do not go together: each stands or falls at the border that its constant names, by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from hdopt import load_study
from hdopt.drive.profiles import Ellipse
from hdopt.mechanics.sizes import doubts

DRIVE = load_study("csf-25-80").drive
MODULE, TEETH = DRIVE.geometry.module, DRIVE.geometry.flexspline_teeth
PITCH_RADIUS = MODULE * TEETH / 2


def with_sizes(**sizes):
    return replace(DRIVE, geometry=replace(DRIVE.geometry, **sizes))


def bent_by(modules, stretched=0.0):
    """The drive with an ellipse that bends its wall by so many modules, its perimeter that of a wall `stretched`
    modules of radius larger."""
    inner = DRIVE.geometry.flexspline_inner_radius
    profile = Ellipse.of_equal_perimeter(inner + stretched * MODULE, inner + modules * MODULE)
    return replace(DRIVE, wave_generator=replace(DRIVE.wave_generator, profile=profile))


def test_the_shipped_drive_raises_no_doubt():
    assert doubts(DRIVE) == ()


@pytest.mark.parametrize(
    ("modules", "doubted"), [(0.79, True), (0.81, False), (1.0, False), (1.19, False), (1.21, True)]
)
def test_a_deflection_is_usual_from_four_fifths_to_six_fifths_of_the_module(modules, doubted):
    """Would catch a deflection that is not taken over the module, or another border."""
    found = doubts(bent_by(modules))
    assert bool(found) == doubted
    if doubted:
        (says,) = found
        assert f"by {modules * MODULE:.4g} mm, {modules:.3g} modules" in says


@pytest.mark.parametrize(("stretched", "says"), [(0.21, "stretch"), (0.19, ""), (-0.19, ""), (-0.21, "compress")])
def test_a_perimeter_differs_from_the_walls_by_a_fifth_of_a_module_of_radius(stretched, says):
    """Would catch a perimeter that is not taken over 2 pi, the other sign, and another border."""
    found = doubts(bent_by(1.0, stretched))
    assert bool(found) == bool(says)
    if says:
        inner = DRIVE.geometry.flexspline_inner_radius
        assert f"would {says} " in found[0]
        assert f"as from {inner:.4g} to {inner + stretched * MODULE:.4g} mm" in found[0]


@pytest.mark.parametrize(
    ("modules_inside", "says"), [(-0.01, "inside"), (0.01, ""), (0.73, ""), (1.99, ""), (2.01, "beyond")]
)
def test_a_wall_ends_within_two_modules_below_the_pitch_circle(modules_inside, says):
    """Would catch teeth counted whole instead of half for the radius, a wall left out, the other side, and another
    border."""
    outside = PITCH_RADIUS - modules_inside * MODULE
    found = doubts(with_sizes(flexspline_wall=outside - DRIVE.geometry.flexspline_inner_radius))
    assert bool(found) == bool(says)
    if says:
        (sentence,) = found
        assert f"= {PITCH_RADIUS:.4g} mm, lies {abs(modules_inside):.3g} modules {says} its wall" in sentence
        assert f"ends at {outside:.4g} mm" in sentence


def test_a_wall_that_is_not_given_raises_no_doubt():
    assert doubts(with_sizes(flexspline_wall=None)) == ()


@pytest.mark.parametrize("name", ["flexspline_addendum", "circular_spline_addendum"])
@pytest.mark.parametrize(("modules", "doubted"), [(0.49, True), (0.51, False), (0.79, False), (0.81, True)])
def test_an_addendum_is_usual_from_half_to_four_fifths_of_the_module(name, modules, doubted):
    found = doubts(with_sizes(**{name: modules * MODULE}))
    assert bool(found) == doubted
    if doubted:
        assert f"{name}_mm is {modules:.3g} times the module of {MODULE:g} mm, where 0.5 to 0.8 is usual" in found[0]
        assert found[0].endswith("look whether it was written for another module")


def test_two_addenda_of_another_module_are_one_doubt():
    (said,) = doubts(with_sizes(flexspline_addendum=MODULE, circular_spline_addendum=MODULE))
    assert "flexspline_addendum_mm is 1 and circular_spline_addendum_mm is 1 times" in said
    assert said.endswith("they were written for another module")


def test_each_doubt_stands_by_itself():
    """A module left over from a drive with twice as many teeth is doubted in all that is measured in modules."""
    other = with_sizes(module=2 * MODULE)
    assert len(doubts(other)) == 3
    assert math.isclose(other.geometry.module, 2 * MODULE)
