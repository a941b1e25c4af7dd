"""What follows the wave generator's width in a search: tilts over its bore, flank pressure, the written file."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hdopt.kinematics.peak_to_peak import peak_to_peak_arcmin
from hdopt.optimize.design_space import Combination
from hdopt.optimize.objectives import NOMINAL, ROBUST, WG_TILTS, Point, find_quantity
from hdopt.study import load_study
from hdopt.workflow.search_setup import setup_of
from hdopt.workflow.write_design import _scaled

SMALL = ("search.samples=256", "search.robust=false")


def setup(*changes):
    return setup_of(load_study("csf-25-80-design-trade", (*SMALL, *changes)), 1)


def design(made, width):
    combination = Combination("ellipse", made.space.baseline.wave_generator.structure)
    return made.space.design(combination, {"width_mm": width})


@pytest.mark.parametrize("key", [NOMINAL, ROBUST, "lag_arcmin", "evened_out_arcmin"])
def test_a_tilt_over_the_bore_grows_as_the_width_falls(key):
    """Every quantity of a design of two thirds of the width is that of tilts 1.5 times as large, held by a shoulder."""
    bore = setup()
    shoulder = setup("search.trade.wg_tilt_major_over=shoulder", "search.trade.wg_tilt_minor_over=shoulder")
    own = bore.trade.errors
    larger = own.with_(wg_tilt_major=1.5 * own.wg_tilt_major, wg_tilt_minor=1.5 * own.wg_tilt_minor)
    sample = bore.trade.drawn().copy()
    sample[:, list(WG_TILTS)] *= 1.5
    by_hand = replace(shoulder.trade, errors=larger, sample=sample)
    value = find_quantity(key).value
    assert value(bore.trade, design(bore, 6.0)) == pytest.approx(value(by_hand, design(shoulder, 6.0)), rel=1e-12)
    assert value(bore.trade, design(bore, 9.0)) == pytest.approx(value(shoulder.trade, design(shoulder, 9.0)))
    if key != "lag_arcmin":
        assert value(bore.trade, design(bore, 6.0)) > 1.01 * value(shoulder.trade, design(shoulder, 6.0))


@pytest.mark.parametrize("key", [NOMINAL, ROBUST, "lag_arcmin"])
def test_slopes_over_the_width_hold_what_the_tilts_do(key):
    made = setup("search.trade.wg_tilt_minor_over=shoulder")
    combination = Combination("ellipse", made.space.baseline.wave_generator.structure)
    quantity = find_quantity(key)

    def point(width):
        return Point(made.space, made.trade, combination, {"width_mm": width}, (("width_mm", 1e-4),))

    step = 0.1 if key == ROBUST else 1e-3
    slopes = quantity.pieces(point(7.0))[1]
    low, high = (quantity.pieces(point(7.0 + side * step))[0] for side in (-1, 1))
    wide = (high - low) / (2 * step)
    # Envelopes are smooth. The quantile's values are of real FS phases, which move under a small step: a wide one
    # leaves a tenth; without the tilts the slope would be some three times as large.
    assert slopes[:, 0] == pytest.approx(wide, rel=0.15 if key == ROBUST else 1e-3, abs=1e-5)


def test_flank_pressure_follows_the_width():
    made = setup()
    pressures = [find_quantity("flank_pressure_mpa").value(made.trade, design(made, width)) for width in (9.0, 6.0)]
    assert pressures[1] / pressures[0] == pytest.approx(1.5)


def test_the_exact_error_of_a_design_has_its_own_tilts():
    made = setup()
    narrow = design(made, 6.0)
    errors = made.trade.errors_of(narrow)
    assert math.degrees(errors.wg_tilt_major) == pytest.approx(0.15)
    assert errors.axis_tilt_y == made.trade.errors.axis_tilt_y
    rows = made.trade.of(errors.with_(wg_tilt_major=made.trade.errors.wg_tilt_major).to_matrix(), narrow)
    assert rows[0, WG_TILTS[0]] == pytest.approx(errors.wg_tilt_major)
    assert float(peak_to_peak_arcmin(narrow.drive, errors)) > 0
    assert np.shares_memory(made.trade.rows, replace(made.trade, over_bore=(False, False)).of(made.trade.rows, narrow))


def test_a_written_tolerance_keeps_its_shape():
    row = {"distribution": "normal", "mean": 0.0, "std": 0.03, "lower": -0.1, "upper": 0.1, "cost": {"a": 1, "b": 2}}
    assert _scaled(row, 1.5) == {**row, "std": 0.045, "lower": -0.15, "upper": 0.15}
