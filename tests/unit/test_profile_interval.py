"""Profile-likelihood intervals: the ends of a parabola, bounds, coverage, and an effect whose parameter is bounded."""

import numpy as np
import pandas as pd
import pytest

from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.inference.nuisance import nuisances_for
from hdopt.diagnosis.inference.profile_interval import (
    HeldParameter,
    is_parabola,
    profile_interval,
    profiled_estimates,
    shape_parameter,
)
from hdopt.diagnosis.numerical import NORMAL_95
from hdopt.diagnosis.settings import DEFAULT, ProfileSettings
from hdopt.effects import EFFECTS
from hdopt.effects.local_tooth_defect import Seat
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather, neighbours_for

SETTINGS = ProfileSettings()
CHI2_95 = NORMAL_95**2
REPEATS = 400
SPREAD = 2.6 * np.sqrt(0.95 * 0.05 / REPEATS)
"""Half width within which the coverage of right 95 % intervals lies in 99 of 100 such tests."""


def held(objective, value, sigma, unit=1.0, lowest=-np.inf, highest=np.inf):
    """A parameter whose profile is known as a function, held within bounds."""

    def held_at(asked):
        reached = float(np.clip(asked, lowest, highest))
        return objective(reached), reached

    return HeldParameter(value, sigma, held_at, objective(value), unit)


def test_a_parabola_ends_at_its_standard_deviations():
    one = held(lambda x: 7 + 3 * ((x - 2) / 0.4) ** 2, 2.0, 0.4, unit=3.0)
    assert is_parabola(one, SETTINGS)
    ends = profile_interval(one, CHI2_95, SETTINGS)
    assert ends == pytest.approx((2 - NORMAL_95 * 0.4, 2 + NORMAL_95 * 0.4), abs=SETTINGS.tolerance * 0.4)


def test_ends_of_a_known_skew_profile():
    """The logarithm of the parameter has a parabola: its ends are the exponentials of that one's."""
    one = held(lambda x: (np.log(x) / 0.5) ** 2, 1.0, 0.5, lowest=1e-9)
    assert not is_parabola(one, SETTINGS)
    low, high = profile_interval(one, CHI2_95, SETTINGS)
    assert (low, high) == pytest.approx((np.exp(-0.98), np.exp(0.98)), abs=SETTINGS.tolerance * 0.5)


def test_a_bound_ends_it_where_the_objective_does_not():
    """Near zero, which it cannot pass: a wrong end would be -0.38."""
    one = held(lambda x: ((x - 0.6) / 0.5) ** 2, 0.6, 0.5, lowest=0.0)
    assert not is_parabola(one, SETTINGS)
    low, high = profile_interval(one, CHI2_95, SETTINGS)
    assert low == 0.0
    assert high == pytest.approx(0.6 + 0.98, abs=SETTINGS.tolerance * 0.5)
    level = held(lambda x: 1 - np.exp(-((x / 0.5) ** 2)), 0.0, 0.5)
    assert profile_interval(level, CHI2_95, SETTINGS) == (-np.inf, np.inf)


def line(rng):
    """A slope of 2 in 60 points: its estimate, its standard deviation and its profile."""
    x = np.linspace(-1, 1, 60)
    y = 2 * x + rng.normal(0, 0.3, len(x))
    columns = np.column_stack([x, np.ones_like(x)])

    def objective(slope):
        left = y - slope * x
        return float(np.sum((left - left.mean()) ** 2))

    found = np.linalg.lstsq(columns, y, rcond=None)[0]
    unit = objective(found[0]) / (len(x) - 2)
    return held(objective, found[0], np.sqrt(unit / np.sum(x * x)), unit), 2.0


T = np.linspace(0, 2, 60)
LENGTHS = np.geomspace(0.05, 400, 3000)
RISES = 1 - np.exp(-T / LENGTHS[:, None])


def saturation(rng):
    """The length 2.5 of a(1 - exp(-t/length)), seen up to 2 only, in 60 points; its amplitude is free beside it."""
    y = 1 - np.exp(-T / 2.5) + rng.normal(0, 0.1, len(T))

    def objective(length):
        column = 1 - np.exp(-T / length)
        return float(y @ y - (column @ y) ** 2 / (column @ column))

    best = float(LENGTHS[np.argmax((RISES @ y) ** 2 / (RISES**2).sum(1))])
    column = 1 - np.exp(-T / best)
    size = column @ y / (column @ column)
    slopes = np.column_stack([column, -size * T / best**2 * np.exp(-T / best)])
    unit = objective(best) / (len(T) - 2)
    return held(objective, best, np.sqrt(unit * np.linalg.inv(slopes.T @ slopes)[1, 1]), unit, 0.05, 400.0), 2.5


def coverage(toy):
    """Share of +-1.96 standard deviations and of profile intervals that hold the truth, and of the repeats whose
    objective is no parabola."""
    rng = np.random.default_rng(1)
    normal, profiled, bent = [], [], []
    for _ in range(REPEATS):
        one, truth = toy(rng)
        normal.append(abs(one.value - truth) <= NORMAL_95 * one.sigma)
        bent.append(not is_parabola(one, SETTINGS))
        low, high = profile_interval(one, CHI2_95, SETTINGS)
        profiled.append(low <= truth <= high)
    return np.mean(normal), np.mean(profiled), np.mean(bent)


def test_coverage_of_a_line():
    normal, profiled, bent = coverage(line)
    assert bent == 0
    assert profiled == pytest.approx(normal, abs=0.01)  # ends within 1 % of each other: 1 in 400 may differ, or 2
    assert profiled == pytest.approx(0.95, abs=SPREAD)


def test_coverage_of_a_length_that_is_hardly_reached():
    """Where +-1.96 standard deviations hold the truth too seldom (88 %), profiles hold it as often as they say."""
    normal, profiled, bent = coverage(saturation)
    assert bent > 0.9
    assert profiled == pytest.approx(0.95, abs=SPREAD)
    assert normal < 0.95 - SPREAD


def drifting(tau_over_duration, noise, seed=3):
    """A fit of thermal drift in time to a gear without a base: 0.4 arcmin towards the end with this time constant."""
    turns, rate = 30, 24
    theta = np.arange(turns * rate) * 2 * np.pi / rate
    time = np.arange(len(theta)) * 0.5
    tau = tau_over_duration * time[-1]
    error = 0.4 * (1 - np.exp(-time / tau)) + np.random.default_rng(seed).normal(0, noise, len(theta))
    return fitted(theta, time, error, noise, "thermal_drift", {"time_constant_s": tau}), tau, time[-1]


def fitted(theta, time, error, noise, effect, shape):
    """A fit of one effect to a gear without a base, from its true shape."""
    table = {"time_s": time, "input_angle_deg": np.degrees(theta)}
    table["output_angle_deg"] = np.degrees(theta) / 50 - error / 60
    recordings = (recording_from_table(pd.DataFrame(table), 50.0),)
    rows = gather(recordings, neighbours_for(recordings))
    problem = FitProblem(rows, None, nuisances_for(rows, None).columns(rows), Noise.white(rows, noise))
    term = EFFECTS[effect].term(rows, shape)
    start = evaluate(problem, np.empty(0), np.zeros(problem.nuisance.shape[1]), [term], [np.full(term.width, 0.4)])
    return refine(start, 60)


def test_an_effect_with_a_bounded_parameter():
    """A time constant near the record's length, in much noise: the profile's high end is far out or the bound of ten
    records. What is said is never narrower than +-1.96 standard deviations, and stops at the bound of a hundredth."""
    fit, tau, duration = drifting(1.0, 0.25)
    (estimate,) = profiled_estimates(fit)
    at = fit.terms[0].width
    value, sigma = estimate.values[at], np.sqrt(estimate.covariance[at, at])
    unit = fit.expected_rises()[fit.problem.nuisance.shape[1] + at] * sigma**2
    one = shape_parameter(fit, 0, "time_constant_s", sigma, unit)
    low, high = profile_interval(one, CHI2_95, SETTINGS)
    assert low < tau < high <= 10 * duration
    assert high - value > 1.5 * (value - low) > 0
    assert one.rise(low) == pytest.approx(CHI2_95, rel=0.05)  # 0.02 standard deviations of the end, and of the refit
    said = EFFECTS["thermal_drift"].parameters(fit.terms[0], estimate)["time_constant_s"]
    assert said.low == pytest.approx(max(0.01 * duration, min(low, value - NORMAL_95 * sigma)), rel=1e-3)
    assert said.high == pytest.approx(max(high, value + NORMAL_95 * sigma), rel=0.02)


def test_an_effect_that_is_well_known_keeps_its_standard_deviations():
    fit, _, _ = drifting(0.2, 0.01)
    (estimate,) = profiled_estimates(fit)
    assert estimate.profiles == {}


def test_what_is_said_is_wider_than_the_noise_alone_has_it():
    """Every number of a term, shapes and coefficients. Fault caught: the intervals that held 88 of 100 truths."""
    fit, _, _ = drifting(0.2, 0.01)
    (estimate,), (plain,) = profiled_estimates(fit), fit.estimates()
    np.testing.assert_allclose(estimate.covariance, DEFAULT.profile.widened**2 * plain.covariance)
    assert DEFAULT.profile.widened > 1


def test_a_held_shape_stays_while_the_others_move():
    """Fails where a refit frees again what is held, which every rebuilt term would: the width of a bump off its place
    is another than at it, and the place must stay off."""
    theta = np.arange(30 * 96) * 2 * np.pi / 96
    bump = np.exp(-0.5 * ((np.mod(theta, 2 * np.pi) - 2.0) / np.radians(12)) ** 2)
    error = 0.5 * bump + np.random.default_rng(0).normal(0, 0.02, len(theta))
    shape = {"on": Seat.CIRCULAR_SPLINE_ONCE, "centre": 2.0, "width_deg": 12.0}
    fit = fitted(theta, np.arange(len(theta)) * 0.1, error, 0.02, "local_tooth_defect", shape)
    (estimate,) = profiled_estimates(fit)
    at = fit.terms[0].width
    sigma = np.sqrt(estimate.covariance[at, at])
    one = shape_parameter(fit, 0, "centre", sigma, fit.expected_rises()[fit.problem.nuisance.shape[1] + at] * sigma**2)
    asked = one.value + 10 * sigma
    assert one.held_at(asked)[1] == asked
    assert one.rise(asked) == pytest.approx(100, rel=0.1)  # a bump's place has nearly a parabola
