"""Stacks, intervals, lines, tails and worst cases of responses whose answers are known."""

from dataclasses import dataclass
from math import exp, log, pi, radians, sqrt

import numpy as np
import pytest
from cases import PROFILES, drive
from scipy import stats

from hdopt.drive.errors import DriveErrors
from hdopt.tolerance.capability import UPPER_PERCENTILE, ppk
from hdopt.tolerance.contributors import Contributor
from hdopt.tolerance.copula import CorrelationGroup
from hdopt.tolerance.distributions import Normal, Uniform
from hdopt.tolerance.drive_inputs import Direct, DriveResponse, VectorSum
from hdopt.tolerance.empirical import KeepAll
from hdopt.tolerance.intervals import clopper_pearson, order_statistic_ranks, smallest_n, student_half_width
from hdopt.tolerance.linear_stack import Dimension, linear_problem
from hdopt.tolerance.linearise import linearise
from hdopt.tolerance.sampling import PlainMonteCarlo, ScrambledSobol
from hdopt.tolerance.space import InputSpace, Tolerance
from hdopt.tolerance.stack import (
    ReplicateTask,
    StackRequest,
    _pooled_std,
    _together,
    quantile_estimate,
    run_replicate,
    run_stack,
)
from hdopt.tolerance.tail import _interval, tail_probability
from hdopt.tolerance.worst_case import find_worst_case

ONE = InputSpace({"x": Tolerance(Normal(std=1.0))})
TWO = InputSpace({name: Tolerance(Normal(std=1.0)) for name in "xy"})


def first(inputs):
    return inputs[:, 0]


# stacks


def stacked(response=first, space=ONE, **request):
    return run_stack(response, space, StackRequest(limit=2.0, **({"n": 2**13, "required_yield": 0.95} | request)))


def test_a_normals_own_figures():
    found = stacked()
    assert found.mean.value == pytest.approx(0.0, abs=1e-3)
    assert found.std.value == pytest.approx(1.0, rel=1e-3)
    for q in (0.5, 0.9, 0.95):
        assert found.quantiles[q].value == pytest.approx(stats.norm.ppf(q), abs=5e-3)
    assert found.ppm.value == pytest.approx(1e6 * stats.norm.sf(2.0), rel=0.02)
    assert found.rss == pytest.approx(stats.norm.ppf(0.95), rel=0.01)


@dataclass
class Size:
    """The size of a signed response."""

    def __call__(self, inputs):
        return np.abs(inputs[:, 0])

    def signed(self, inputs):
        return inputs[:, 0]


def test_the_line_of_a_size_has_two_sides():
    """95 % of a normal number lie within 1.96, not below 1.645."""
    assert stacked(Size()).rss == pytest.approx(stats.norm.ppf(0.975), rel=0.01)


def test_what_lies_on_the_limit_keeps_it():
    found = run_stack(lambda x: np.round(x[:, 0]), ONE, StackRequest(limit=1.0, n=2**12, required_yield=0.9))
    assert found.conforming.value == pytest.approx(stats.norm.cdf(1.5), abs=2e-3)


class Blocks:
    """Two blocks of unlike means."""

    name, replicates, independent_points = "blocks", 1, True

    def blocks(self, seed, replicate, n, dimension, start=0):
        yield np.full((300, 1), 0.2) + np.linspace(0, 0.01, 300)[:, None]
        yield np.full((100, 1), 0.9) + np.linspace(0, 0.01, 100)[:, None]


def replicate():
    return run_replicate(ReplicateTask(first, ONE, Blocks(), 1, 0, 400, 1.0, None))


def values():
    return ONE.sample(np.concatenate(list(Blocks().blocks(1, 0, 400, 1))))[:, 0]


def test_a_variance_is_that_of_all_blocks():
    found = replicate()
    assert (found.n, found.above_limit) == (400, int((values() > 1.0).sum()))
    assert found.mean == pytest.approx(values().mean())
    assert found.variance == pytest.approx(values().var())


def part(sample):
    collector = KeepAll()
    collector.add(np.asarray(sample, float))
    from hdopt.tolerance.stack import Replicate

    return Replicate(len(sample), float(np.mean(sample)), float(np.var(sample)), 0, collector.finish())


def test_parts_and_replicates_pool_as_one_sample():
    one, two = np.array([1.0, 2.0, 4.0]), np.array([10.0, 12.0])
    both = np.r_[one, two]
    together = _together(part(one), part(two))
    assert (together.mean, together.variance) == (pytest.approx(both.mean()), pytest.approx(both.var()))
    assert _pooled_std([part(one), part(two)]) == pytest.approx(both.std())


def test_a_quantiles_interval_is_that_of_the_share_below_it():
    """Woodruff 1952: Student's half width of the scramblings' shares, turned back into ranks."""
    samples = np.random.default_rng(0).normal(size=(16, 500))
    parts = [part(row) for row in samples]
    pooled = np.sort(samples.ravel())
    found = quantile_estimate(parts, parts[0].values.joined([p.values for p in parts[1:]]), 0.9, ScrambledSobol(16))
    at = int(np.ceil(8000 * 0.9)) - 1
    shares = (samples <= pooled[at]).mean(axis=1)
    half = stats.t.ppf(0.975, 15) * shares.std(ddof=1) / 4
    assert found.value == pooled[at]
    assert found.low == pooled[int(np.ceil(8000 * (0.9 - half))) - 1]
    assert found.high == pooled[int(np.ceil(8000 * (0.9 + half))) - 1]


# intervals


def test_students_interval():
    sample = [1.0, 1.3, 0.8, 1.1, 1.4]
    low, high = stats.t.interval(0.9, 4, loc=np.mean(sample), scale=stats.sem(sample))
    assert student_half_width(sample, 0.9) == pytest.approx((high - low) / 2)


@pytest.mark.parametrize(("hits", "n"), [(0, 20), (3, 20), (19, 20), (20, 20)])
def test_an_exact_share(hits, n):
    exact = stats.binomtest(hits, n).proportion_ci(0.95, "exact")
    found = clopper_pearson(hits, n)
    assert (found.low, found.high) == pytest.approx((exact.low, exact.high))


@pytest.mark.parametrize(("q", "n"), [(0.5, 100), (0.9, 500), (0.01, 1000)])
def test_ranks_miss_a_quantile_on_either_side_with_2_5_per_cent_at_most(q, n):
    low, high = order_statistic_ranks(q, n)
    below = stats.binom(n, q)
    assert below.cdf(low - 1) <= 0.025 < below.cdf(low)
    assert below.sf(high - 1) <= 0.025 < below.sf(high - 2)


@pytest.mark.parametrize("q", [0.01, 0.5, 0.9973])
def test_the_smallest_sample_that_encloses_a_quantile(q):
    n, far = smallest_n(q), max(q, 1 - q)
    assert far**n <= 0.025 < far ** (n - 1)


def test_performance_by_percentiles():
    """3 sigma of a normal process: what lies above X99.865 is what they leave above."""
    assert UPPER_PERCENTILE == pytest.approx(stats.norm.cdf(3), abs=1e-5)
    assert ppk(10.0, 4.0, 7.0) == pytest.approx(2.0)


# samples


@pytest.mark.parametrize("sampling", [ScrambledSobol(4), PlainMonteCarlo(4)], ids=lambda one: one.name)
def test_seed_and_replicate_make_the_sample(sampling):
    def points(seed, replicate):
        return np.concatenate(list(sampling.blocks(seed, replicate, 64, 3)))

    assert np.array_equal(points(0, 1), points(0, 1))
    for other in ((1, 1), (0, 2), (2, 1)):
        assert not np.array_equal(points(0, 1), points(*other))


def test_a_deviation_shrinks_about_its_middle():
    tolerance = Tolerance.of_deviation(Uniform(lower=1.0, upper=3.0))
    assert tolerance.value == 1.0
    assert tolerance.scaled_to(0.5).quantile(np.array([0.0, 0.5, 1.0])) == pytest.approx([1.5, 2.0, 2.5])


# lines


def test_a_line_is_drawn_at_the_mean_size_of_tilts():
    """|x| of a normal number: its mean is sqrt(2/pi), its spread sqrt(1 - 2/pi); the slope is that of the size."""
    space = InputSpace({"x": Tolerance(Normal(std=1.0))}, folded=frozenset({"x"}))
    line = linearise(lambda x: 3 * np.abs(x[:, 0]), space, 1)
    assert line.slopes["x"] == pytest.approx(3.0, rel=1e-6)
    assert line.point["x"] == pytest.approx(sqrt(2 / pi), rel=1e-3)
    assert line.std == pytest.approx(3 * sqrt(1 - 2 / pi), rel=1e-2)


def test_directions_add_their_own_spread():
    tolerances = {"m": Tolerance(Uniform(lower=1.0, upper=3.0)), "angle": Tolerance(Uniform(lower=0.0, upper=2 * pi))}
    space = InputSpace(tolerances, turning=frozenset({"angle"}))
    line = linearise(lambda x: 2 * x[:, 0] + 0.5 * np.cos(x[:, 1]), space, 1)
    assert line.linear_std == pytest.approx(4 / sqrt(12), rel=1e-3)
    assert line.turning_std == pytest.approx(0.5 / sqrt(2), rel=1e-3)
    assert line.std == pytest.approx(sqrt(16 / 12 + 0.125), rel=1e-3)
    assert line.rss(2.0) == pytest.approx(line.value + 2 * line.std)
    assert sum(line.shares.values()) == pytest.approx(1.0)


@pytest.mark.parametrize("rho", [0.6, -0.6])
def test_correlated_inputs_add_with_their_covariance(rho):
    group = (CorrelationGroup(("x", "y"), [[1.0, rho], [rho, 1.0]]),)
    line = linearise(lambda x: x.sum(axis=1), InputSpace(TWO.tolerances, group), 1)
    assert line.std == pytest.approx(sqrt(2 + 2 * rho), rel=0.02)


# tails and worst cases


def test_a_tails_interval_is_coxs():
    """Of log-normal estimates: exp(+- t sqrt(s2/n + s2^2/(2 (n - 1)))) about their mean; from 0 where one missed."""
    runs = [1e-6, 2e-6, 1.5e-6, 3e-6]
    s2 = np.var(np.log(runs), ddof=1)
    half = stats.t.ppf(0.975, 3) * sqrt(s2 / 4 + s2**2 / 6)
    mean = np.mean(runs)
    assert _interval(runs) == pytest.approx((mean * exp(-half), mean * exp(half)))
    low, high = _interval([*runs, 0.0])
    assert low == 0.0
    assert high > np.mean([*runs, 0.0])
    assert log(high) > log(mean)


class Proven:
    """x of a normal number cut at 3 on either side: never above 3."""

    space = InputSpace({"x": Tolerance(Normal(std=1.0, lower=-3.0, upper=3.0))})

    def __call__(self, inputs):
        return inputs[:, 0]

    def upper_bound(self, lower, upper):
        return float(upper[0])


def tail(limit, seed=1):
    return tail_probability(Proven(), Proven.space, limit, seed=seed, replicates=3, level_size=2000)


def test_a_proof_makes_zero_and_only_where_it_holds():
    assert tail(3.0).probability == 0.0 and tail(3.0).method == "proven bound"
    found = tail(1.5)
    assert found.method == "subset simulation"
    inside = stats.norm.cdf(3) - stats.norm.cdf(-3)
    assert found.probability == pytest.approx((stats.norm.cdf(3) - stats.norm.cdf(1.5)) / inside, rel=0.15)


def test_the_tails_seed_reaches_its_runs():
    assert tail(1.5).replicates == tail(1.5).replicates != tail(1.5, seed=2).replicates
    assert len(set(tail(1.5).replicates)) == 3


def test_the_worst_case_lies_in_a_corner_or_between_them():
    space = InputSpace({name: Tolerance(Uniform(lower=-1.0, upper=2.0)) for name in "abc"})
    corner = find_worst_case(lambda x: x @ np.array([1.0, -2.0, 0.5]), space, corners=256, generations=1)
    assert corner.value == pytest.approx(2.0 + 2.0 + 1.0)
    wide = InputSpace({name: Tolerance(Uniform(lower=-1.0, upper=2.0)) for name in "abcdefghij"})
    slopes = np.linspace(-3, 4, 10)
    tried = -1 + 3 * np.round(next(ScrambledSobol(1).blocks(1, 0, 512, 10)))
    found = find_worst_case(lambda x: x @ slopes, wide, corners=512, generations=1)
    assert found.value >= (tried @ slopes).max()
    inner = find_worst_case(lambda x: 4 - ((x - 0.3) ** 2).sum(axis=1), space, corners=256, generations=40)
    assert inner.value == pytest.approx(4.0, abs=1e-3)
    assert list(inner.at.values()) == pytest.approx([0.3] * 3, abs=0.05)


# from inputs to drives


def test_callouts_add_as_vectors_of_half_their_diameters():
    """Coaxialities of 0.02 at 0 deg and 0.04 at 90 deg: an eccentricity of sqrt(0.01^2 + 0.02^2) mm."""
    terms = [Contributor(name, "coaxiality", value, "axis_eccentricity") for name, value in (("a", 0.02), ("b", 0.04))]
    feed = VectorSum("axis_eccentricity", ((0, 1, terms[0].error_per_mm), (2, 3, terms[1].error_per_mm)))
    errors = {}
    feed.fill(np.array([[0.02, 0.0, 0.04, 90.0]]), errors)
    assert errors["axis_eccentricity"] == pytest.approx([sqrt(0.01**2 + 0.02**2)])
    assert errors["axis_eccentricity_direction"] == pytest.approx([np.arctan2(0.02, 0.01)])
    widest = {}
    feed.widest(np.array([0.02, 360.0, 0.04, 360.0]), widest)
    assert widest["axis_eccentricity"] == pytest.approx(0.03)


@pytest.mark.parametrize("callout", ["perpendicularity", "parallelism"])
def test_a_tilt_is_its_callout_over_its_length(callout):
    assert Contributor("face", callout, 0.02, "wg_tilt", 25.0).error_per_mm == pytest.approx(1 / 25)


def response(homogenization=1.0):
    feeds = (Direct(0, "axis_eccentricity"), Direct(1, "axis_tilt_y"))
    return DriveResponse(drive(PROFILES["ellipse"]), DriveErrors(fs_tooth_amplitude=0.001), feeds, homogenization)


def test_inputs_are_in_the_units_of_the_study():
    found = response().errors(np.array([[0.01, 0.2]]))
    assert found.axis_eccentricity == pytest.approx([0.01])
    assert found.axis_tilt_y == pytest.approx([radians(0.2)])
    assert found.fs_tooth_amplitude == 0.001


@pytest.mark.parametrize(("lower", "upper"), [((0.0, -0.1), (0.01, 0.3)), ((0.0, -0.3), (0.01, 0.1))])
def test_the_widest_errors_are_the_largest_of_either_side(lower, upper):
    widest = response().widest_errors(np.array(lower), np.array(upper))
    assert widest.axis_eccentricity == pytest.approx(0.01)
    assert widest.axis_tilt_y == pytest.approx(radians(0.3))


def test_many_teeth_even_out_the_bound():
    box = np.array([0.0, -0.2]), np.array([0.01, 0.2])
    assert response(0.2).upper_bound(*box) == pytest.approx(0.2 * response().upper_bound(*box))


@pytest.mark.parametrize("sigmas", [3.0, 6.0])
def test_a_dimension_has_its_sigmas_within_its_tolerance(sigmas):
    """0.6 mm to either side: one standard deviation is 0.2 and 0.1 mm. The tails beyond the tolerance, 2.7e-3 of all at
    three sigmas, are cut off. Fault caught: a fixed number of sigmas."""
    _, space = linear_problem({"gap": Dimension(1.0, 0.6, sigmas)})
    kept = stats.norm.cdf(sigmas) - stats.norm.cdf(-sigmas)
    u = (stats.norm.cdf(1.0) - stats.norm.cdf(-sigmas)) / kept
    assert space.sample(np.array([[u]]))[0, 0] == pytest.approx(0.6 / sigmas, rel=1e-9)
