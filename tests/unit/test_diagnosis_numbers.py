"""Numbers on the way to a verdict, on rows whose content is known: orders, spectra, slopes, noise, what pays."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from test_cross_validation import RATE, noisy, rows_of, without_base

from hdopt.diagnosis.inference import generic_basis, residual_noise
from hdopt.diagnosis.inference.common_slope import TakenSlope, common_slope, input_is_off
from hdopt.diagnosis.inference.fit import extend
from hdopt.diagnosis.inference.neighbour_noise import noise_between_neighbours
from hdopt.diagnosis.inference.noise import Noise, autoregression, without_lines
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.inference.residual_noise import measure_noise, roughness
from hdopt.diagnosis.settings import DEFAULT
from hdopt.diagnosis.verdict.named_effect import _meant, main_orders, share_of
from hdopt.drive.geometry import ARCMIN
from hdopt.effects.term import Term
from hdopt.recordings.recording import Recording

TURN = 2 * np.pi


def turns(count):
    return np.arange(count * RATE) * TURN / RATE


@pytest.fixture(scope="module")
def long():
    """A record of two output turns and a half, without anything in it."""
    return without_base(rows_of(np.zeros(200 * RATE)))


def test_orders_that_hold_most_of_an_effect(long):
    """The strongest and what has three tenths of its amplitude, in rising order; a multiple of 1/N is given as such.
    Faults caught: orders in rad, by their place in the list, of a fifth of the size."""
    theta = long.problem.rows.theta
    contribution = 0.4 * np.sin(7 * theta) + np.sin((2 + 1 / 80) * theta) + 0.2 * np.sin(11 * theta) + 5.0
    assert main_orders(long, contribution) == [2.0125, 7.0]
    assert main_orders(long, np.sin(3.3666 * theta)) == [pytest.approx(3.3666, abs=0.25 / 200)]


@pytest.mark.parametrize(
    ("order", "span", "meant"), [(2.012, 200, 2.0125), (2.009, 200, 2.009), (2.011, 20, 2.0), (2.02, 20, 2.02)]
)
def test_what_order_is_meant_is_a_matter_of_the_records_length(order, span, meant):
    """A quarter of a resolution step about an order: in 20 turns of N = 80 no multiple of 1/N is claimed."""
    assert _meant(order, span, 80.0, DEFAULT.verdict) == pytest.approx(meant)


def test_the_share_of_an_effect_is_of_what_the_others_leave():
    """0.3 sin in noise of 0.1: its power over all that is there without it."""
    wave = 0.3 * np.sin(3.3 * turns(40))
    fit = without_base(rows_of(wave + np.random.default_rng(1).normal(0, 0.1, len(wave))), sigma=0.1)
    columns = np.column_stack([np.sin(3.3 * turns(40)), np.cos(3.3 * turns(40))])
    fit = extend(fit, [Term("output_coupling", {}, columns=columns)])
    assert share_of(fit, 0) == pytest.approx(0.045 / (0.045 + 0.01), rel=0.05)


def test_a_spectrum_gives_amplitudes_at_orders_of_the_shaft_that_is_asked():
    """Of an output encoder's own angle a wave stands at N times its order, whatever the error makes of the input's."""
    theta = turns(80)
    probe = FitProbe(without_base(rows_of(0.3 * np.sin(7.3 * theta + 0.4))))
    grid = np.array([7.3, 6.9])
    # The nearest quarter of a resolution step dims a line by at most sinc(1/8)
    assert probe.spectrum(grid) == pytest.approx([0.3, 0.0], abs=0.01)
    assert probe.spectrum(grid, of_output=True) == pytest.approx([0.3, 0.0], abs=0.01)


@pytest.mark.parametrize(("inflation", "share", "taken"), [(1.0, 1.1, 1), (1.0, 0.9, 0), (3.0, 1.1, 1), (3.0, 0.9, 0)])
def test_a_column_of_the_generic_basis_must_pay_for_itself(monkeypatch, inflation, share, taken):
    """Half its gain, in noise that is rougher, against Schwarz's half logarithm of the rows and the choice among the
    groups. Faults caught: gains that are not halved, or forget the inflation or the noise; a choice that costs nothing.
    """
    n, sigma = 1000, 0.5
    column = np.sqrt(2) * np.sin(np.arange(n) * 0.7)
    needed = inflation * (np.log(n) + 2 * DEFAULT.generic.other_cost)
    size = np.sqrt(share * needed * sigma**2 / (column @ column))
    problem = SimpleNamespace(settings=DEFAULT)
    probe = SimpleNamespace(
        fit=SimpleNamespace(problem=problem),
        rows=type("Rows", (), {"span_turns": 20.0, "__len__": lambda self: n})(),
        noise=SimpleNamespace(whiten=lambda values: values, sigma=sigma),
        project=lambda values: values,
        white_residual=size * column,
    )
    monkeypatch.setattr(generic_basis, "generic_columns", lambda rows, probe: (column[:, None], ["time"]))
    columns, domains = generic_basis.useful_columns(probe, inflation)
    assert (columns.shape[1], len(domains)) == (taken, taken)


def recorded(slope, noise=0.0, count=20, start=0.0):
    """A slope of the error over its record (arcmin end to end), and noise, over so many turns."""
    angle = start + np.linspace(0.0, count * TURN, 2000)
    error = slope * (angle - start) / (count * TURN) + np.random.default_rng(0).normal(0, max(noise, 1e-12), 2000)
    return Recording("", 80.0, angle, error)


def test_a_slope_is_taken_out_where_it_is_long_large_and_most_of_what_varies():
    """A slope of s has s^2/12 of power. Faults caught: any of the three left out, or a fifth of it enough."""
    settings = DEFAULT.nuisance
    large = 2 * settings.slope_arcmin
    found = common_slope([recorded(large)], settings)
    assert found.slope == pytest.approx(large * ARCMIN / (20 * TURN))
    assert common_slope([recorded(large, count=1)], settings) is None
    assert common_slope([recorded(settings.slope_arcmin / 2)], settings) is None
    power = large**2 / 12
    assert common_slope([recorded(large, np.sqrt(power * 0.5 / 0.5))], settings) is None
    assert common_slope([recorded(large, np.sqrt(power * 0.1 / 0.9))], settings) is not None


def test_a_slope_that_was_taken_out_leaves_the_angle_as_the_drive_turned():
    """The input counts 1.25 times too far: its angle is what it was over 1.25, and the error is free of the slope."""
    taken = TakenSlope(0.0, 3.0, input_gain=1.25)
    (after,) = taken.take_out([recorded(0.0)])
    np.testing.assert_allclose(after.input_angle, recorded(0.0).input_angle / 1.25)
    assert taken.turned == TakenSlope(0.0, -3.0, 1.25)
    slope = TakenSlope(0.02, 3.0).of_input(80.0)
    assert slope.input_gain == pytest.approx(1 / (1 - 80 * 0.02))


def test_the_input_is_off_where_the_base_fits_clearly_better_alone_and_beside_smooth_columns():
    clear = np.exp(DEFAULT.nuisance.slope_axis)
    assert input_is_off((1.01 * clear, 1.01 * clear), (1.0, 1.0), DEFAULT.nuisance)
    for as_recorded in ((0.99 * clear, 9.0), (9.0, 0.99 * clear), (9.0, 0.5)):
        assert not input_is_off(as_recorded, (1.0, 1.0), DEFAULT.nuisance)


def test_the_noise_of_neighbours_is_that_of_the_usual_recording():
    """Recordings of 0.1, 0.3 and 2 arcmin: one bad one does not count, nor do a few bad samples."""
    rng = np.random.default_rng(2)
    records = [SimpleNamespace(error_arcmin=rng.normal(0, sigma, 20_000)) for sigma in (0.1, 0.3, 2.0)]
    records[1].error_arcmin[::100] += 5.0
    assert noise_between_neighbours(records) == pytest.approx(0.3, rel=0.06)  # 3 % of the differences hold a bad one


def test_roughness_is_that_of_the_usual_column():
    """Noise that is one number a turn is rough to a constant, not to columns that change their sign within a turn."""
    block = np.arange(60).repeat(RATE)
    g = np.random.default_rng(2).normal(size=60)
    noise = Noise(np.zeros(0), 1.0, np.ones(len(block)))
    even, odd = np.ones(len(block)), np.tile([1.0, -1.0], len(block) // 2)
    usual = roughness(noise, g[block], np.column_stack([even, odd, odd]), block)
    assert usual == pytest.approx(0.0, abs=1e-12)
    assert roughness(noise, g[block], even[:, None], block) == pytest.approx(RATE * np.mean(g**2))


def test_steps_are_no_wander_of_the_noise():
    """Six steps of fifty times the noise in white noise: it stays white, and as small as it is."""
    rows = noisy(40)
    stairs = np.repeat([0.0, 1.0, 2.0, 1.3, 0.6, 1.6, 2.6], [280] * 6 + [len(rows) - 1680])
    noise = measure_noise(without_base(rows_of(np.asarray(rows.error) + stairs))).noise
    assert noise.sigma == pytest.approx(0.02, rel=0.1)
    assert abs(noise.ar.sum()) < 0.2


def test_what_is_measured_has_smooth_columns_and_steps_taken_out(monkeypatch):
    """Fault caught: steps not looked for, whose rise then is the noise's colour."""
    asked = []
    monkeypatch.setattr(residual_noise, "find_steps", lambda left, settings: asked.append(len(left)) or ([], None))
    measure_noise(without_base(noisy(12)))
    assert asked == [12 * RATE]


@pytest.mark.parametrize(("pole", "kept"), [(0.99, 0.99), (-0.99, None), (0.5, 0.5), (-0.5, -0.5)])
def test_an_alternating_noise_is_a_line_and_a_slow_one_is_none(pole, kept):
    """One real pole: below zero it is a line at half the row rate, drawn in; above zero slow wander, of any size."""
    most = DEFAULT.noise.largest_oscillating_pole
    assert without_lines(np.array([pole])) == pytest.approx([-most if kept is None else kept])


def test_a_correlation_of_one_is_no_stationary_noise():
    """Rows that are all but equal: the recursion keeps to a reflection that a stationary noise may have."""
    found = autoregression(np.array([1.0, 1.0]), 10_000)
    assert found == pytest.approx([DEFAULT.noise.largest_reflection])
