"""The noise's autoregression: its filter, its gaps, its order, and how much rougher the noise is than it."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import linalg, signal
from test_cross_validation import RATE, noisy, rows_of, without_base

from hdopt.diagnosis.alternatives.in_time import strongest_frequencies
from hdopt.diagnosis.inference import residual_noise
from hdopt.diagnosis.inference.noise import (
    Noise,
    _covariance,
    autoregression,
    estimate,
    predictable_share,
    weights_with_a_past,
)
from hdopt.diagnosis.inference.residual_noise import measure_noise, roughness
from hdopt.diagnosis.settings import DEFAULT

AR = np.array([0.5, -0.3, 0.15])


def in_pieces(rows, length):
    """`rows` with a gap after every `length` of them."""
    from dataclasses import replace

    return replace(rows, piece=np.arange(len(rows)) // length)


@pytest.mark.parametrize("columns", [1, 3, 11])
def test_the_filter_is_that_of_the_signal_library(columns):
    """x_t - sum a_k x_{t-k}, for a few columns and for many side by side."""
    values = np.random.default_rng(0).normal(size=(200, columns))
    white = Noise(AR, 1.0, np.ones(200)).whiten(values)
    assert white == pytest.approx(signal.lfilter(np.r_[1.0, -AR], [1.0], values, axis=0), abs=1e-12)
    assert Noise(AR, 1.0, np.ones(200)).whiten(values[:, 0]) == pytest.approx(white[:, 0], abs=1e-12)


@pytest.mark.parametrize("ar", [AR, AR[:0]])
def test_blocks_are_whitened_beside_each_other(ar):
    """Columns in rows, in columns and alone, each as it is whitened by itself, weights and all."""
    rng = np.random.default_rng(1)
    noise = Noise(ar, 1.0, rng.uniform(0.0, 2.0, 200))
    blocks = [rng.normal(size=(200, 3)), np.asfortranarray(rng.normal(size=(200, 2))), rng.normal(size=(200, 1))]
    white = noise.whitened(blocks)
    alone = [signal.lfilter(np.r_[1.0, -ar], [1.0], column) * noise.root_weight for column in np.hstack(blocks).T]
    np.testing.assert_allclose(white, np.column_stack(alone), atol=1e-12)
    assert white.flags.f_contiguous


def test_weights_stop_at_a_gap():
    rows = in_pieces(noisy(2), 12)
    weighed = weights_with_a_past(rows, 3) > 0
    assert np.array_equal(weighed, np.arange(len(rows)) % 12 >= 3)


def test_rows_left_out_take_those_with_them_that_the_filter_reaches():
    rows = noisy(2)
    left_out = np.zeros(len(rows), bool)
    left_out[[10, 30]] = True
    kept = Noise(AR, 1.0, np.ones(len(rows))).without(left_out).root_weight
    assert np.array_equal(np.flatnonzero(kept == 0), [10, 11, 12, 13, 30, 31, 32, 33])


def test_noise_is_not_looked_for_across_a_gap():
    """Pieces with means of their own, 40 rows each, that flip from piece to piece: within a piece rows are alike, and
    the coefficient is near 1; across the gaps they are opposite. The innovations are those of the rows with a past.
    """
    rows = in_pieces(noisy(40), 40)
    rng = np.random.default_rng(1)
    own = np.where(rows.piece % 2, 1.0, -1.0) + rng.normal(0, 0.05, len(rows))
    noise = estimate(rows, own)
    same = rows.piece[1:] == rows.piece[:-1]
    products, powers = own[1:][same] @ own[:-1][same] / same.sum(), own @ own / len(rows)
    assert noise.ar.sum() == pytest.approx(products / powers, abs=0.01)
    white = noise.whiten(own)
    assert noise.sigma**2 * np.sum(noise.root_weight > 0) == pytest.approx(white @ white, rel=1e-9)


def test_coefficients_solve_yule_and_walker():
    """The covariance of a known autoregression gives its coefficients back, as the Toeplitz system does."""
    impulse = signal.lfilter([1.0], np.r_[1.0, -AR], np.r_[1.0, np.zeros(400)])
    covariance = np.array([impulse[lag:] @ impulse[: len(impulse) - lag] for lag in range(5)])
    found = autoregression(covariance, 20_000)
    assert found == pytest.approx(linalg.solve_toeplitz(covariance[:3], covariance[1:4]), rel=1e-9)
    assert found == pytest.approx(AR, abs=1e-6)


def test_one_more_coefficient_must_be_worth_it():
    """A correlation of 0.09 among 1000 rows gains 8.1 in 2 log L: more than the margin of 6, less than that and
    Schwarz's log(1000) = 6.9 together; one of 0.15 gains 22.8."""
    assert len(autoregression(np.array([1.0, 0.09, 0.0]), 1000)) == 0
    assert len(autoregression(np.array([1.0, 0.15, 0.0225]), 1000)) == 1


def test_roughness_is_the_power_of_the_turns_sums():
    """Noise that is one number g a turn: its sum over m rows has m^2 g^2, that of white noise m s^2."""
    block = np.arange(60).repeat(RATE)
    g = np.random.default_rng(2).normal(size=60)
    noise = Noise(np.zeros(0), 0.7, np.ones(len(block)))
    found = roughness(noise, g[block], np.ones((len(block), 3)), block)
    assert found == pytest.approx(RATE * np.mean(g**2) / 0.7**2, rel=1e-12)


@pytest.mark.parametrize(("power", "inflation"), [(0.3, 1.0), (5.0, 5.0), (1e4, DEFAULT.noise.largest_inflation)])
def test_noise_is_rougher_by_what_its_scores_show(monkeypatch, power, inflation):
    """Never smoother than its model, and no rougher than noise can be."""
    monkeypatch.setattr(residual_noise, "roughness", lambda *_: power)
    assert measure_noise(without_base(noisy(12))).inflation == inflation


def test_a_line_is_no_noise():
    """A sine of five times the noise at an order of nothing else, on the spectrum's own grid."""
    theta = np.arange(40 * RATE) * 2 * np.pi / RATE
    rows = rows_of(0.1 * np.sin(7.375 * theta) + np.random.default_rng(7).normal(0, 0.02, len(theta)))
    noise = measure_noise(without_base(rows)).noise
    # The sine alone has 0.07 rms; what is left of it lies a part of a resolution step beside the lines taken out.
    assert noise.sigma == pytest.approx(0.02, rel=0.25)


@pytest.mark.parametrize("hz", [3.1, 44.9, 48.5])
def test_lines_are_looked_for_up_to_half_the_row_rate(hz):
    """Rows at 100 Hz; mains fold to any frequency below 50. Fault caught: a search that ends at 45 Hz and leaves a line
    at 48.5 to the noise, however strong it is.
    """
    rows = noisy(40)
    wave = np.sin(2 * np.pi * hz * rows.time + 0.3)
    found = strongest_frequencies(rows, wave, DEFAULT.alternatives)
    assert found[0] == pytest.approx(hz, abs=0.25 / np.ptp(rows.time))


def test_each_lag_has_rows_behind_it():
    """Pieces of 45 rows have twenty for each of two lags, pieces of 400 for all that a noise may have."""
    rows = noisy(40)
    for length, lags in ((45, 2), (400, DEFAULT.noise.highest_order)):
        covariance = _covariance(in_pieces(rows, length).piece, rows.error, DEFAULT.noise)
        assert len(covariance) == 1 + lags


def test_what_the_rows_before_tell_of_a_residual():
    """Of white noise nothing, of a first-order autoregression its coefficient's square, of a sine all, and nothing over
    a gap. Faults caught: power for share, a lag forgotten, the pieces joined."""
    rng = np.random.default_rng(2)
    white = rng.normal(0, 3.0, 20000)
    rows = SimpleNamespace(piece=np.zeros(20000, np.int64))
    assert predictable_share(rows, white) < 1e-3
    assert predictable_share(rows, signal.lfilter([1.0], [1.0, -0.5], white)) == pytest.approx(0.25, abs=0.02)
    assert predictable_share(rows, np.sin(0.7 * np.arange(20000))) > 0.95
    apart = SimpleNamespace(piece=np.arange(20000) // 50)
    steps = np.repeat(rng.choice([-1.0, 1.0], 400), 50)
    assert predictable_share(apart, steps + 1e-3 * white) > 0.9
