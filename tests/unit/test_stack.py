"""Stacks on responses with known distributions: values, honest intervals, the same numbers on every engine."""

import contextvars
import json

import numpy as np
import pytest
from scipy import stats

from hdopt.errors import HdoptError
from hdopt.parallel.cluster import Dask
from hdopt.parallel.engine import engine_from
from hdopt.parallel.local import ThisProcess, Threads
from hdopt.tolerance import stack as stack_module
from hdopt.tolerance.distributions import Normal, Uniform
from hdopt.tolerance.intervals import clopper_pearson, order_statistic_ranks, smallest_n
from hdopt.tolerance.sampling import BLOCK, SAMPLINGS, PlainMonteCarlo, ScrambledSobol
from hdopt.tolerance.space import InputSpace, Tolerance
from hdopt.tolerance.stack import StackRequest, part_size, run_stack

SPACE = InputSpace({f"x{i}": Tolerance(Normal(std=1.0)) for i in range(4)})
LIMIT = 2.7
NORMAL = stats.norm


def total(x):
    """Standard normal: four independent normals, halved."""
    return x.sum(axis=1) / 2


@pytest.mark.parametrize("name", SAMPLINGS)
def test_figures_of_a_normal_response(name):
    result = run_stack(total, SPACE, StackRequest(limit=LIMIT, n=2**18, sampling=SAMPLINGS[name](), seed=0))
    # five standard errors of plain Monte Carlo at this size
    error = 5 / np.sqrt(result.n)
    assert result.mean.value == pytest.approx(0, abs=error)
    assert result.std.value == pytest.approx(1, abs=error)
    for q, estimate in result.quantiles.items():
        truth = NORMAL.ppf(q)
        assert estimate.value == pytest.approx(truth, abs=error * np.sqrt(q * (1 - q)) / NORMAL.pdf(truth))
        assert estimate.low < estimate.value < estimate.high
    conforming = NORMAL.cdf(LIMIT)
    assert result.conforming.value == pytest.approx(conforming, abs=error * np.sqrt(conforming * (1 - conforming)))
    assert result.ppk.value == pytest.approx(LIMIT / NORMAL.ppf(0.99865), abs=0.02)
    assert result.ppm.value == pytest.approx(1e6 * (1 - result.conforming.value))
    assert json.dumps(result.to_dict())
    assert result.to_frame().loc["yield", "value"] == result.conforming.value


@pytest.mark.parametrize(("name", "n"), [("sobol", 2**15), ("sobol", 3000), ("monte-carlo", 2**12)])
def test_intervals_cover_the_truth_as_often_as_they_say(name, n):
    """150 seeds at 95 %. Student's t must come near; exact and rank intervals may only cover more."""
    ppk = LIMIT / NORMAL.ppf(0.99865)
    hits = []
    for seed in range(150):
        result = run_stack(
            total, SPACE, StackRequest(limit=LIMIT, n=n, sampling=SAMPLINGS[name](), seed=seed, engine="process")
        )
        required = result.required_quantile
        hits.append(
            (
                required.low <= NORMAL.ppf(0.9973) <= required.high,
                result.conforming.low <= NORMAL.cdf(LIMIT) <= result.conforming.high,
                result.ppk is None or result.ppk.low <= ppk <= result.ppk.high,
            )
        )
    coverage = np.mean(hits, axis=0)
    # 150 trials at 95 %: 0.89 is 3.4 standard deviations low
    assert coverage.min() >= 0.89, coverage


def test_same_seed_same_numbers_on_every_engine():
    results = [
        run_stack(total, SPACE, StackRequest(limit=LIMIT, n=5000, seed=0, engine=engine)).to_dict()
        for engine in (ThisProcess(), Threads(1), Threads(3), "threads")
    ]
    assert all(result == results[0] for result in results)
    assert results[0] != run_stack(total, SPACE, StackRequest(limit=LIMIT, n=5000, seed=1)).to_dict()


def test_streamed_sample_agrees_with_the_kept_one(monkeypatch):
    kept = run_stack(total, SPACE, StackRequest(limit=LIMIT, n=2**15, seed=0))
    monkeypatch.setattr(stack_module, "KEPT_VALUES", 2**14)
    streamed = run_stack(total, SPACE, StackRequest(limit=LIMIT, n=2**15, seed=0))
    width = 3 * 8 / 2**18  # one bin, of a pilot that spans 8
    for q, estimate in kept.quantiles.items():
        other = streamed.quantiles[q]
        assert other.value == pytest.approx(estimate.value, abs=width)
        # a replicate's count below the quantile may differ by one, of about 20 at the outermost
        assert other.high - other.low == pytest.approx(estimate.high - estimate.low, rel=0.15)
    assert streamed.conforming == kept.conforming
    assert streamed.mean == kept.mean
    assert streamed.histogram[1].sum() == kept.n


def test_all_within_the_limit_is_not_certainty():
    result = run_stack(total, SPACE, StackRequest(limit=100.0, n=4096))
    assert result.conforming.value == 1
    assert result.conforming.low == clopper_pearson(4096, 4096).low < 1


def test_linear_response_is_its_own_line():
    """Slopes 1/2 each, equal shares, and root sum square right to the linearisation's own sampling."""
    result = run_stack(total, SPACE, StackRequest(limit=LIMIT, n=2**14))
    assert list(result.linearisation.slopes.values()) == pytest.approx([0.5] * 4, abs=1e-9)
    assert list(result.linearisation.shares.values()) == pytest.approx([0.25] * 4, abs=1e-3)
    assert result.rss == pytest.approx(NORMAL.ppf(0.9973), rel=1e-3)


def test_kinked_response_keeps_its_shares():
    """|x| + |y| with x twice as wide: slopes about zero would be nil; the folded line gives 4 : 1."""
    space = InputSpace({"x": Tolerance(Normal(std=2.0)), "y": Tolerance(Normal(std=1.0))}, folded=frozenset({"x", "y"}))
    result = run_stack(lambda z: np.abs(z).sum(axis=1), space, StackRequest(limit=9.0, n=2**14))
    assert result.linearisation.shares["x"] == pytest.approx(0.8, abs=0.005)
    assert result.linearisation.std == pytest.approx(result.std.value, rel=0.01)


def test_not_a_number_names_its_sample():
    def broken(x):
        return np.where(x[:, 1] > 2.5, np.nan, 1.0)

    with pytest.raises(HdoptError, match=r"the response is nan for sample \d+ of replicate 0 of seed 7.*x1 = 2\.\d+"):
        run_stack(broken, SPACE, StackRequest(limit=LIMIT, n=2**13, seed=7, engine="process"))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"n": 1000}, r"n is 1000, too small for the quantile 0\.9973 .*; the smallest n is 1365"),
        ({"n": 1365, "quantiles": (0.9999,)}, "the smallest n is 36887"),
        ({"n": 8}, "at least 32 samples are needed"),
        ({"required_yield": 99.73}, "it must lie between 0 and 1"),
        ({"engine": "thread"}, "unknown engine 'thread'; did you mean 'threads'"),
        ({"engine": "dask://localhost"}, "write dask://HOST:PORT"),
    ],
)
def test_bad_requests(options, message):
    with pytest.raises(HdoptError, match=message):
        run_stack(total, SPACE, StackRequest(**({"limit": LIMIT} | options)))


def test_smallest_n_is_the_smallest():
    for q in (0.5, 0.9, 0.9973):
        n = smallest_n(q)
        assert order_statistic_ranks(q, n)[1] <= n
        assert order_statistic_ranks(q, n - 1)[1] > n - 1 or order_statistic_ranks(q, n - 1)[0] < 1


def test_order_statistic_ranks_cover():
    low, high = order_statistic_ranks(0.9, 1000)
    below = stats.binom(1000, 0.9)
    assert below.cdf(low - 1) <= 0.025 < below.cdf(low)
    assert below.sf(high - 1) <= 0.025 < below.sf(high - 2)


def test_clopper_pearson_matches_scipy():
    ours, theirs = clopper_pearson(7, 50), stats.binomtest(7, 50).proportion_ci(method="exact")
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high), rel=1e-9)


@pytest.mark.parametrize("sampling", [ScrambledSobol(), PlainMonteCarlo()])
def test_points_depend_on_seed_and_replicate_alone(sampling):
    first, again, other, zero = (
        np.concatenate(list(sampling.blocks(seed, replicate, 70_000, 3)))
        for seed, replicate in ((5, 2), (5, 2), (5, 3), (0, 2))
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other) and not np.array_equal(first, zero)
    assert first.min() > 0 and first.max() < 1


def test_uniform_inputs_have_no_tolerance_error():
    space = InputSpace({"x": Tolerance.of_deviation(Uniform(lower=1.0, upper=3.0))})
    narrowed = space.with_tolerances({"x": 0.5})
    assert narrowed.box == (pytest.approx([1.5]), pytest.approx([2.5]))
    with pytest.raises(HdoptError, match="unknown input 'y'"):
        space.with_tolerances({"y": 1.0})


def test_engines_by_name():
    assert contextvars.Context().run(engine_from, None) == Threads()  # where none is in force
    assert engine_from("threads:3") == Threads(3)
    assert engine_from("dask://host:8786") == Dask("host:8786")


@pytest.mark.parametrize("sampling", [ScrambledSobol(), PlainMonteCarlo()])
def test_a_replicate_made_from_several_starts_has_the_same_points(sampling):
    whole = np.concatenate(list(sampling.blocks(3, 1, 3 * BLOCK + 5, 4)))
    parts = [
        np.concatenate(list(sampling.blocks(3, 1, min(start + BLOCK, 3 * BLOCK + 5), 4, start)))
        for start in range(0, 3 * BLOCK + 5, BLOCK)
    ]
    assert np.array_equal(whole, np.concatenate(parts))


def test_work_splits_by_size():
    assert [part_size(n) for n in (1000, 2**24, 10**9, 10**12)] == [2**20, 2**20, 2**20, 244187136]
    assert part_size(10**12) % BLOCK == 0


def test_parts_of_a_replicate_make_the_replicate(monkeypatch):
    """Small parts instead of large ones: counts are the same, moments agree to rounding."""
    space = InputSpace({"x": Tolerance(Normal(std=1.0))})
    request = StackRequest(limit=2.0, n=16 * 3 * BLOCK, seed=0)
    one = run_stack(lambda x: x[:, 0], space, request)
    monkeypatch.setattr("hdopt.tolerance.stack.PART", BLOCK)
    many = run_stack(lambda x: x[:, 0], space, request)
    assert many.quantiles == one.quantiles and many.conforming == one.conforming
    assert (many.mean.value, many.std.value) == pytest.approx((one.mean.value, one.std.value), rel=1e-12, abs=1e-12)
