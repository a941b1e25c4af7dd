"""Intervals of amplitude (bounded) and phase (periodic): against the likelihood itself, and their coverage."""

import math

import numpy as np
import pytest

from hdopt.effects.estimate import FitEstimate

LEVEL = 1.96**2


def rise_of_phase(values, covariance, phase_deg):
    """Least rise of the chi-squared of a pair over all amplitudes from zero on, by brute force."""
    phi = math.radians(phase_deg)
    amplitudes = np.linspace(0, 5, 20001)
    left = np.outer([math.cos(phi), math.sin(phi)], amplitudes) - np.asarray(values)[:, None]
    return float(np.einsum("in,ij,jn->n", left, np.linalg.inv(covariance), left).min())


def rise_of_amplitude(values, covariance, amplitude):
    phi = np.linspace(0, 2 * math.pi, 20001)
    left = amplitude * np.array([np.cos(phi), np.sin(phi)]) - np.asarray(values)[:, None]
    return float(np.einsum("in,ij,jn->n", left, np.linalg.inv(covariance), left).min())


@pytest.mark.parametrize("values", [(1.0, 0.2), (-0.9, 0.3), (0.2, -1.4)])
def test_ends_lie_where_the_likelihood_says(values):
    """By brute force over the other parameter, to its grid; the third pair's phase interval crosses no half turn, the
    second's does."""
    covariance = np.array([[0.09, 0.03], [0.03, 0.04]])
    estimate = FitEstimate(np.array(values), covariance)
    phase, amplitude = estimate.phase_deg(0, 1), estimate.amplitude(0, 1)
    assert phase.low < phase.value < phase.high
    for end in (phase.low, phase.high):
        assert rise_of_phase(values, covariance, end) == pytest.approx(LEVEL, rel=1e-3)
    for end in (amplitude.low, amplitude.high):
        assert rise_of_amplitude(values, covariance, end) == pytest.approx(LEVEL, rel=1e-3)


def test_nothing_known_of_the_phase_where_zero_is_possible():
    estimate = FitEstimate(np.array([0.3, 0.1]), 0.04 * np.eye(2))
    phase, amplitude = estimate.phase_deg(0, 1), estimate.amplitude(0, 1)
    assert phase.high - phase.low == 360
    assert amplitude.low == 0


def test_a_strong_pair_keeps_its_standard_deviations():
    """At 50 standard deviations the ellipse is as good as a point's neighbourhood: within 1e-3 of +-1.96 of them."""
    estimate = FitEstimate(np.array([3.0, 4.0]), 0.01 * np.eye(2))
    phase, amplitude = estimate.phase_deg(0, 1), estimate.amplitude(0, 1)
    assert (amplitude.low, amplitude.high) == pytest.approx((5 - 0.196, 5 + 0.196), rel=1e-4)
    assert phase.high - phase.value == pytest.approx(math.degrees(1.96 * 0.1 / 5), rel=1e-3)


def test_a_pair_known_exactly_has_no_width():
    phase = FitEstimate(np.array([1.0, 1.0]), np.zeros((2, 2))).phase_deg(0, 1)
    assert (phase.low, phase.value, phase.high) == pytest.approx((45, 45, 45))


@pytest.mark.parametrize("size", [1.5, 2.5, 5.0])
def test_coverage_of_the_phase(size):
    """Of 2000 pairs at so many standard deviations at least 95 % hold the true phase, less 2.6 of the share's own
    standard deviations: never too seldom, also where the size is hardly known."""
    rng, repeats, held = np.random.default_rng(2), 2000, 0
    for _ in range(repeats):
        pair = np.array([size, 0.0]) + rng.normal(size=2)
        phase = FitEstimate(pair, np.eye(2)).phase_deg(0, 1)
        held += phase.low <= 0 <= phase.high or phase.low <= 360 <= phase.high or phase.low <= -360 <= phase.high
    assert held / repeats >= 0.95 - 2.6 * math.sqrt(0.95 * 0.05 / repeats)


def test_an_interval_is_in_the_unit_of_its_number():
    """Of an amplitude in mm told in um, of a profile of a negative scale with an offset: low and high exchange."""
    pair = FitEstimate(np.array([0.003, 0.004]), 1e-8 * np.eye(2))
    size = pair.amplitude(0, 1, "um", scale=1e3)
    assert (size.value, size.low, size.high) == pytest.approx((5.0, 5.0 - 0.196, 5.0 + 0.196), rel=1e-4)
    profiled = FitEstimate(np.array([2.0]), np.eye(1), {0: (1.0, 5.0)})
    found = profiled.parameter(0, "deg C", scale=-2.0, offset=100.0)
    assert (found.value, found.low, found.high) == (96.0, 90.0, 98.0)
