"""Parts of a stack: what is kept of a sample, streams and replicates, searches for the worst, what a call hands on."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from hdopt.errors import HdoptError
from hdopt.tolerance import tail, worst_case
from hdopt.tolerance import tail as tail_module
from hdopt.tolerance import worst_case as worst_module
from hdopt.tolerance.copula import CorrelationGroup
from hdopt.tolerance.distributions import Normal, Uniform
from hdopt.tolerance.drive_inputs import tolerance_of
from hdopt.tolerance.empirical import Bins, CountInBins, KeepAll, merge
from hdopt.tolerance.sampling import BLOCK, PlainMonteCarlo, ScrambledSobol, replicate_sizes
from hdopt.tolerance.screening import METHODS, run_screening, salib_problem
from hdopt.tolerance.sensitivity import run_sobol
from hdopt.tolerance.space import InputSpace, Tolerance
from hdopt.tolerance.stack import Replicate, StackRequest, quantile_estimate, run_stack, yield_estimate
from hdopt.tolerance.tail import tail_probability
from hdopt.tolerance.worst_case import Unbounded, check_bounded, find_worst_case
from hdopt.workflow import stack as workflow

VALUES = np.random.default_rng(5).normal(0.0, 1.0, 30_000)
BINS = Bins(low=-2.0, width=0.01, count=400)
"""Of a normal sample 2.3 % lie beyond either end."""


def collected(collector, values):
    for block in np.array_split(values, 7):
        collector.add(block)
    return collector.finish()


@pytest.mark.parametrize("parts", [1, 3])
def test_binned_values_are_the_values_to_a_bin_and_exact_beyond(parts):
    """Would catch values below the bins that are lost or not counted, and a rank half a bin off."""
    exact = np.sort(VALUES)
    binned = merge([collected(CountInBins(BINS), part) for part in np.array_split(VALUES, parts)])
    assert binned.n == len(VALUES)
    ranks = np.array([1, 50, 400, 5000, 15_000, 25_000, 29_700, 30_000])
    found = np.array([binned.ranked(int(rank)) for rank in ranks])
    inside = (exact[ranks - 1] >= -2) & (exact[ranks - 1] < 2)
    assert found[~inside].tolist() == exact[ranks - 1][~inside].tolist()
    assert np.abs(found - exact[ranks - 1])[inside].max() <= BINS.width
    middles = exact[1000:29_000:7]
    offsets = [binned.ranked(1000 + 1 + 7 * i) - middle for i, middle in enumerate(middles)]
    assert abs(np.mean(offsets)) < 0.05 * BINS.width  # 4,000 values fall evenly over their bins
    for x in (-2.5, -1.0, 0.003, 1.5, 2.4):
        assert binned.at_most(x) == pytest.approx(np.count_nonzero(VALUES <= x), abs=int(0.02 * 30_000 * 0.4))
    assert binned.at_most(-2.5) == np.count_nonzero(VALUES <= -2.5)
    assert binned.at_most(2.4) == np.count_nonzero(VALUES <= 2.4)


def test_a_value_that_comes_often_is_at_most_itself():
    kept = collected(KeepAll(), np.array([1.0, 2.0, 2.0, 2.0, 3.0, 4.0, 5.0]))
    assert [kept.at_most(x) for x in (0.9, 1.0, 2.0, 4.9, 5.0)] == [0, 1, 4, 6, 7]


@pytest.mark.parametrize("sampling", [ScrambledSobol(4), PlainMonteCarlo(4)], ids=["sobol", "monte-carlo"])
def test_a_replicate_made_in_parts_is_the_replicate_made_at_once(sampling):
    whole = np.concatenate(list(sampling.blocks(3, 1, BLOCK + 100, 3)))
    later = np.concatenate(list(sampling.blocks(3, 1, BLOCK + 100, 3, BLOCK)))
    assert np.array_equal(later, whole[BLOCK:])
    assert not np.array_equal(whole[:100], whole[BLOCK : BLOCK + 100])


@pytest.mark.parametrize(("n", "replicates"), [(100, 16), (64, 16), (17, 4)])
def test_replicates_share_all_points(n, replicates):
    sizes = replicate_sizes(n, replicates)
    assert (sum(sizes), len(sizes), max(sizes) - min(sizes) <= 1) == (n, replicates, True)


def replicates(above, size=1000, count=16):
    """Replicates of `size` points of which as many as `above` says lie over the limit."""
    return [Replicate(size, 0.0, 1.0, int(a), None) for a in np.broadcast_to(above, count)]


def test_a_share_with_few_beyond_has_the_exact_interval():
    """Clopper and Pearson's of 3 in 16,000; scramblings that mostly saw none say nothing."""
    few = yield_estimate(replicates([3] + [0] * 15), ScrambledSobol(16))
    exact = stats.binomtest(3, 16_000).proportion_ci(0.95, "exact")
    assert (1 - few.high, 1 - few.low) == pytest.approx((exact.low, exact.high), rel=1e-6)
    assert "Clopper" in few.interval


def test_a_share_stays_below_one():
    found = yield_estimate(replicates([120, 0] + [1] * 14), ScrambledSobol(16))
    assert found.interval.startswith("t over")
    assert found.high == 1.0


def test_a_quantile_with_few_beyond_has_ranks_for_its_ends():
    values = np.array_split(np.random.default_rng(2).permutation(np.linspace(0, 1, 1600)), 16)
    parts = [Replicate(100, 0.5, 1 / 12, 0, collected(KeepAll(), part)) for part in values]
    pooled = merge(part.values for part in parts)
    assert quantile_estimate(parts, pooled, 0.99, ScrambledSobol(16)).interval.startswith("order statistics")
    assert quantile_estimate(parts, pooled, 0.5, ScrambledSobol(16)).interval.startswith("t over")


class Bent:
    """Largest where a = 1 and the direction is 90 deg, between the ends of its range."""

    def __call__(self, inputs):
        return inputs[:, 0] * (1 + np.sin(np.radians(inputs[:, 1])))


BOX = InputSpace(
    {
        "a": Tolerance.of_magnitude(Uniform(lower=0.0, upper=1.0)),
        "a_direction_deg": Tolerance(Uniform(lower=0.0, upper=360.0), None),
    },
    turning=frozenset({"a_direction_deg"}),
)


def test_the_corners_of_a_worst_case_have_free_directions():
    """Without evolution: the best of 2,048 corners has its direction within a few degrees of 90."""
    found = find_worst_case(Bent(), BOX, 3, corners=2048, generations=0)
    assert found.value == pytest.approx(2.0, abs=1e-4)
    assert found.at["a"] == 1.0


def test_a_worst_case_evolves_from_its_best_corners_with_its_seed(monkeypatch):
    """Would catch a search that begins anywhere, and a seed that reaches the corners or the evolution alone."""
    import scipy.optimize

    starts, seeds = [], []

    def noted(function, bounds, *, init, rng, **options):
        starts.append(init)
        seeds.append(rng.random())
        return SimpleNamespace(nfev=1, fun=0.0, x=np.zeros(2))

    monkeypatch.setattr(scipy.optimize, "differential_evolution", noted)
    for seed in (3, 3, 4):
        find_worst_case(Bent(), BOX, seed, corners=2048)
    start = starts[0]
    assert start.shape == (worst_module.POPULATION, 2) and np.all(start[:, 0] == 1.0)
    assert np.abs(360 * start[:, 1] - 90).max() < 60  # the best tenth or so
    assert np.array_equal(starts[0], starts[1]) and not np.array_equal(starts[0], starts[2])
    assert seeds[0] == seeds[1] != seeds[2]


@pytest.mark.parametrize("ends", [{}, {"lower": 0.0}, {"upper": 1.0}])
def test_what_is_open_at_either_end_has_no_worst_case_and_no_proof(ends):
    space = InputSpace({"a": Tolerance(Normal(mean=0.5, std=0.1, **ends), None)})
    with pytest.raises(Unbounded, match="a can be arbitrarily large"):
        check_bounded(space)

    class Proven:
        def __call__(self, inputs):
            return np.zeros(len(inputs))

        def upper_bound(self, lower, upper):
            return 0.0

    assert tail_module._proven_bound(Proven(), space) is None


def test_teeth_drawn_at_random_have_no_worst_case():
    space = InputSpace({"cs_teeth": Tolerance(Uniform(lower=0.0, upper=1.0), None)}, fields=frozenset({"cs_teeth"}))
    with pytest.raises(Unbounded, match="drawn at random"):
        check_bounded(space)


def test_every_run_of_a_tail_has_a_seed_of_its_own(monkeypatch):
    seeds = []
    monkeypatch.setattr(tail_module, "_subset_simulation", lambda *given: (seeds.append(given[-1]) or 0.1, 1))
    space = InputSpace({"a": Tolerance(Normal(mean=0.0, std=1.0), None)})
    for seed in (3, 4):
        tail_probability(Bent(), space, 1.0, seed=seed, replicates=8, engine="process")
    assert len(set(seeds)) == 16


def test_a_tilt_is_toleranced_to_either_side():
    spread = Uniform(lower=-0.1, upper=0.3)
    assert tolerance_of("axis_tilt_x", spread) == Tolerance(spread, pytest.approx(0.2), pytest.approx(0.1))
    assert tolerance_of("axis_eccentricity", spread).value == 0.3
    assert tolerance_of("axis_eccentricity_direction", spread).value is None


def space_of(*distributions, correlated=False):
    names = "abc"[: len(distributions)]
    matrix = np.eye(len(names)) + 0.8 * (1 - np.eye(len(names)))
    groups = (CorrelationGroup(tuple(names), matrix),) if correlated else ()
    return InputSpace({n: Tolerance(d, None) for n, d in zip(names, distributions, strict=True)}, groups)


def total(inputs):
    return inputs.sum(axis=1)


def test_an_open_end_lies_a_thousandth_inside_the_cube():
    half = Normal(mean=0.0, std=1.0, lower=-1.0)
    bounds = salib_problem(space_of(Uniform(lower=0.0, upper=1.0), half, Normal(mean=0.0, std=1.0)))["bounds"]
    assert bounds == [[0.0, 1.0], [0.0, 0.999], [0.001, 0.999]]


@pytest.mark.parametrize("method", [name for name, one in METHODS.items() if one.independent])
def test_methods_of_independent_inputs_refuse_correlated_ones(method):
    uniform = Uniform(lower=0.0, upper=1.0)
    with pytest.raises(HdoptError, match="takes independent inputs"):
        run_screening(total, space_of(uniform, uniform, correlated=True), method, n=128)


def test_a_screening_samples_what_is_correlated():
    uniform = Uniform(lower=0.0, upper=1.0)
    found = run_screening(total, space_of(uniform, uniform, correlated=True), "pawn", n=512, engine="process")
    assert stats.pearsonr(*stats.norm.ppf(found.X).T).statistic == pytest.approx(0.8, abs=0.05)


@pytest.mark.parametrize("method", METHODS)
def test_a_method_takes_enough_points_as_a_rule(method):
    """A power of two, as scrambled sequences want, twice what is refused as too small, or more. Fault caught: a rule of
    two points, written 2 % 12."""
    n = METHODS[method].n
    assert n >= 256 and n & (n - 1) == 0


@pytest.mark.parametrize("method", METHODS)
def test_a_screening_of_too_few_points_is_refused(method):
    """128 are enough for any; the message says so, and how many the method takes as a rule."""
    uniform = Uniform(lower=0.0, upper=1.0)
    said = f"n is 127, too small for {method}; take at least 128, as a rule {METHODS[method].n}"
    with pytest.raises(HdoptError, match=said):
        run_screening(total, space_of(uniform, uniform), method, n=127)


def test_a_screening_has_its_seed():
    uniform = Uniform(lower=0.0, upper=1.0)
    one, same, other = (
        run_screening(total, space_of(uniform, uniform), "morris", n=128, seed=seed, engine="process").X
        for seed in (3, 3, 4)
    )
    assert np.array_equal(one, same) and not np.array_equal(one, other)


def test_groups_pairs_and_counts_of_sobol_indices_in_closed_form():
    """y = a + 2 b + 3 a c of normal inputs: V = 1 + 4 + 9, and the pair (a, c) alone makes 9."""

    def response(inputs):
        a, b, c = inputs.T
        return a + 2 * b + 3 * a * c

    normal = Normal(mean=0.0, std=1.0)
    plain = space_of(normal, normal, normal)
    space = InputSpace(plain.tolerances, groups={"ac": ("a", "c"), "bc": ("b", "c")})
    found = run_sobol(response, space, n=2**14, seed=2, engine="process")
    first = {"a": 1, "b": 4, "c": 0}
    whole = {"a": 10, "b": 4, "c": 9}
    for name in "abc":
        assert found.inputs[name].S1.value == pytest.approx(first[name] / 14, abs=0.03)
        assert found.inputs[name].ST.value == pytest.approx(whole[name] / 14, abs=0.03)
    assert found.groups["ac"].S1.value == pytest.approx(10 / 14, abs=0.03)
    assert found.groups["bc"].ST.value == pytest.approx(13 / 14, abs=0.03)
    assert {pair: round(e.value * 14) for pair, e in found.second.items()} == {
        ("a", "b"): 0,
        ("a", "c"): 9,
        ("b", "c"): 0,
    }
    assert found.evaluations == 2**14 * (2 * 3 + 2 + 2)
    band, estimates = found.convergence.ST_half_width["b"][-1], found.inputs["b"].ST
    assert band == pytest.approx((estimates.high - estimates.low) / 2, rel=1e-9)


@pytest.fixture
def handed_on(monkeypatch):
    """What a stack hands to its parts, by part, in place of the work."""
    got = {}

    def stack_of(response, space, request):
        got["request"] = request
        return SimpleNamespace(conforming=None)

    monkeypatch.setattr(workflow, "run_stack", stack_of)
    monkeypatch.setattr(workflow, "_exact_at", lambda problem, worst: ())
    monkeypatch.setattr(workflow, "_method", lambda problem, seed: (None, None))
    monkeypatch.setattr(worst_case, "find_worst_case", lambda *given: got.update(worst=given[2:]))
    monkeypatch.setattr(tail, "tail_probability", lambda *given, **more: got.update(tail=(given[2], more)))
    return got


def test_a_stack_hands_on_all_that_was_asked(handed_on):
    workflow.stack(
        n=640,
        tail=1.7,
        worst_case=True,
        sampling="monte-carlo",
        quantiles=(0.8,),
        seed=7,
        engine="process",
    )
    request = handed_on["request"]
    problem = workflow.study_problem(None)
    assert (request.n, request.seed, tuple(request.quantiles), request.engine) == (640, 7, (0.8,), "process")
    assert (request.limit, request.required_yield, request.unit) == (problem.limit, problem.required_yield, "arcmin")
    assert isinstance(request.sampling, PlainMonteCarlo)
    assert handed_on["worst"] == (7,)
    limit, more = handed_on["tail"]
    assert (limit, more["seed"], more["engine"]) == (1.7, 7, "process")


def test_a_quantile_that_the_sample_cannot_enclose_is_left_out():
    """0.99 needs 368 values, 0.9 needs 36; nobody asked for either."""
    space = space_of(Uniform(lower=0.0, upper=1.0))
    found = run_stack(total, space, StackRequest(limit=0.5, required_yield=0.5, n=128, engine="process", unit="mm"))
    assert set(found.quantiles) == {0.5, 0.9}
