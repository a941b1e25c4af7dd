"""Quantities of a design that a search weighs, each against what it is made of."""

from dataclasses import replace
from math import sqrt
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from hdopt.mechanics.bearing_life import bearing_life_h, bearing_load, ring_force
from hdopt.mechanics.bending import hoop_stress, max_bending_stress
from hdopt.mechanics.tooth_path import Mesh
from hdopt.optimize.design_space import Combination, Structure
from hdopt.optimize.objectives import Point, find_quantity
from hdopt.study import load_study
from hdopt.workflow.search_setup import setup_of


@pytest.fixture(scope="module")
def problem():
    return setup_of(load_study("csf-25-80"), 1).problem(Combination("ellipse", Structure.AUTOMATIC))


@pytest.fixture(scope="module")
def design(problem):
    return problem.space.design(problem.combination, problem.space.baseline_values)


def of(key, problem, design):
    return find_quantity(key).value(problem.trade, design)


def test_safety_is_endurance_over_notched_bending_and_a_share_of_the_hoop_stress(problem, design):
    """The wave generator of Table 1 as it stands: its perimeter stretches the ring, 222 MPa (E times the stretch)."""
    own = Mesh(design.drive.geometry, problem.space.baseline.wave_generator.profile)
    table_1 = replace(design, mesh=own)
    hoop = of("hoop_stress_mpa", problem, table_1)
    assert hoop == pytest.approx(222, abs=0.5)
    assert hoop == pytest.approx(hoop_stress(design.drive.material, own.geometry, own.profile), rel=1e-12)
    bending = of("bending_stress_mpa", problem, table_1)
    expected = design.drive.material.endurance / (2.2 * bending + 0.2 * hoop)
    assert of("bending_safety", problem, table_1) == pytest.approx(expected, rel=1e-12)


def test_safety_is_endurance_over_notched_stress_where_nothing_is_stretched(problem, design):
    assert of("hoop_stress_mpa", problem, design) == pytest.approx(0, abs=1e-6)
    stress = max_bending_stress(design.drive)
    assert of("bending_stress_mpa", problem, design) == pytest.approx(stress, rel=1e-6)
    expected = design.drive.material.endurance / (2.2 * stress)
    assert problem.trade.notch_factor == 2.2
    assert of("bending_safety", problem, design) == pytest.approx(expected, rel=1e-6)


def test_teeth_within_an_angle_are_its_share_of_a_turn(problem, design):
    """One side counted, as Jia 2021, Eq. (13); k_e is one over their root."""
    angle = of("carrying_angle_deg", problem, design)
    teeth = design.drive.geometry.circular_spline_teeth
    assert of("carrying_teeth", problem, design) == pytest.approx(teeth * angle / 360)
    meshing = of("carrying_teeth", problem, design)
    evened = of("evened_out_arcmin", problem, design) / of("peak_to_peak_arcmin", problem, design)
    assert evened == pytest.approx(problem.trade.k_b / sqrt(meshing))


def test_life_is_under_the_load_of_torque_and_ring(problem, design):
    trade, gear = problem.trade, design.drive.geometry
    reference = trade.reference
    bent = design.drive.wave_generator.profile.semi_major - gear.flexspline_inner_radius
    ring = ring_force(gear, bent, design.drive.material.modulus, trade.face_width)
    rated_bent = reference.wave_generator.profile.semi_major - reference.geometry.flexspline_inner_radius
    rated_ring = ring_force(reference.geometry, rated_bent, reference.material.modulus, trade.face_width)
    load = bearing_load(gear, trade.torque, trade.bearing.friction, ring)
    rated = bearing_load(reference.geometry, trade.bearing.rated_torque, trade.bearing.friction, rated_ring)
    widths = design.drive.wave_generator.width, reference.wave_generator.width
    expected = bearing_life_h(load, widths[0], rated, widths[1], trade.speed, trade.bearing)
    assert ring > 0.01 * load
    assert of("bearing_life_h", problem, design) == pytest.approx(expected)


def test_size_is_that_of_the_circular_spline(problem, design):
    gear = design.drive.geometry
    assert of("pitch_diameter_mm", problem, design) == pytest.approx(gear.module * gear.circular_spline_teeth)


def test_a_quantile_is_harrells_and_daviss(problem, design):
    """Beta weights of the order statistics (Biometrika 69, 1982): near the sample's own upper quantile."""
    trade = replace(problem.trade, quantile=0.95, sample=np.random.default_rng(0).normal(size=(200, 12)))
    edges = stats.beta.cdf(np.arange(201) / 200, 201 * 0.95, 201 * 0.05)
    assert trade.weights == pytest.approx(np.diff(edges))
    quantity = find_quantity("peak_to_peak_quantile_arcmin")
    values = np.arange(200.0)[::-1]
    found = type("Fixed", (type(quantity),), {"_sample": lambda self, trade, design: values})()
    assert found.value(trade, design) == pytest.approx(np.quantile(values, 0.95), abs=1.5)


def test_slopes_are_derivatives(problem):
    """Of the ratio of two lengths and of a square, over a free variable."""
    name = next(iter(problem.space.baseline_values))
    values = dict(problem.space.baseline_values)
    point = Point(problem.space, problem.trade, problem.combination, values, ((name, 1e-6),))

    def width(design):
        return design.drive.wave_generator.width

    def square(design):
        return width(design) ** 2

    slope = point.slopes(width)
    assert point.slopes(square) == pytest.approx(2 * width(point.design) * slope, rel=1e-6, abs=1e-9)
    below, above = point.pair(0)
    assert slope[0] * 2e-6 == pytest.approx(width(above) - width(below), abs=1e-12)


def test_slopes_are_central_differences_over_the_free_variables():
    """Of x squared at 5 and -3 y, and of x y: right to rounding for squares, whatever the steps. Would catch a
    difference over one step that is taken for two."""
    space = SimpleNamespace(design=lambda combination, values: values)
    point = Point(space, None, None, {"x": 5.0, "y": 2.0, "z": 1.0}, (("x", 0.1), ("y", 0.01)))
    slopes = point.slopes(lambda v: np.array([v["x"] ** 2 - 3 * v["y"], v["x"] * v["y"] + v["z"]]))
    np.testing.assert_allclose(slopes, [[10.0, 2.0], [-3.0, 5.0]], rtol=1e-9)
