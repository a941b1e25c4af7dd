"""The straight line of a response, its shares, and the interval of a tail, by hand."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from hdopt.tolerance import tail
from hdopt.tolerance.distributions import Normal, Uniform
from hdopt.tolerance.linearise import JOINTLY, Linearisation, _variance_alone, linearise
from hdopt.tolerance.space import InputSpace, Tolerance

TURN = 2 * math.pi


def space(turning=(), folded=(), **inputs):
    tolerances = {name: Tolerance(distribution) for name, distribution in inputs.items()}
    return InputSpace(tolerances, turning=frozenset(turning), folded=frozenset(folded))


AROUND = Uniform(lower=0.0, upper=TURN)


def test_a_line_is_found_with_shares_of_its_own_spreads():
    """5 + 2 a + 3 b: slopes and mean to rounding, shares of (2 s_a)^2 and (3 s_b)^2 whatever the sample's own
    correlation, which 64 points have."""
    line = linearise(
        lambda x: 5 + 2 * x[:, 0] + 3 * x[:, 1],
        space(a=Normal(mean=1.0, std=0.1), b=Normal(mean=2.0, std=0.2)),
        1,
        directions=64,
    )
    assert line.slopes == pytest.approx({"a": 2.0, "b": 3.0})
    assert line.value == pytest.approx(5 + 2 * line.point["a"] + 3 * line.point["b"])
    parts = {"a": (2 * line.spreads["a"]) ** 2, "b": (3 * line.spreads["b"]) ** 2}
    assert line.shares == pytest.approx({name: part / sum(parts.values()) for name, part in parts.items()})
    assert line.linear_std == pytest.approx(math.sqrt(sum(parts.values())))
    assert line.turning_std == pytest.approx(0.0, abs=1e-12)


def test_parts_of_a_line_add_as_squares_about_its_mean():
    line = Linearisation({}, 2.0, {}, {}, turning_std=0.4, linear_std=0.3, shares={})
    assert line.std == pytest.approx(0.5)
    assert line.rss(3.0) == pytest.approx(3.5)


def test_a_folded_input_keeps_its_sign():
    """x between -1 and 1 has no slope by its size: half of the drives go up with it. Its mean size of 1/2, to either
    side, is what signs make."""
    line = linearise(lambda x: x[:, 0], space(folded=("x",), x=Uniform(lower=-1.0, upper=1.0)), 1)
    assert line.slopes["x"] == pytest.approx(0.0, abs=0.01)
    assert line.turning_std == pytest.approx(0.5, rel=0.01)


@pytest.mark.parametrize(
    ("response", "alone", "jointly"),
    [
        (lambda x: 2 * np.cos(x[:, 0]) + 1, (1.0, 0.0), 0.0),
        (lambda x: np.cos(x[:, 0]) + np.cos(x[:, 1]), (0.5, 0.5), 0.0),
        (lambda x: np.cos(x[:, 0] - x[:, 1]), (0.0, 0.0), 1.0),
    ],
)
def test_directions_have_what_they_do_alone_and_the_rest_jointly(response, alone, jointly):
    """Two directions all round: of a sum of both each half, of their difference nothing alone."""
    line = linearise(response, space(turning=("p", "q"), p=AROUND, q=AROUND), 1)
    # 32 bins keep all but 0.3 % of a cosine, and what they scatter, 31/4064 of the other input, is taken off.
    assert [line.shares["p"], line.shares["q"], line.shares[JOINTLY]] == pytest.approx([*alone, jointly], abs=0.015)


def test_what_bins_scatter_by_themselves_is_no_share():
    """Noise of 512 values in 32 bins: their means scatter by 31/512 of it. Over twenty draws what is left is a tenth
    of that, for a share is not below zero."""
    rng = np.random.default_rng(0)
    found = [_variance_alone(rng.normal(size=512), rng.random(512)) for _ in range(20)]
    assert np.mean(found) < 0.25 * 31 / 512


def test_a_line_follows_its_seed():
    curved, inputs = (lambda x: np.exp(np.cos(x[:, 0]))), space(turning=("p",), p=AROUND)
    one, again, other = (linearise(curved, inputs, seed, directions=64).value for seed in (1, 1, 2))
    assert one == again != other


RUNS = [1e-4, 2e-4, 1.5e-4, 4e-4, 0.8e-4]


@pytest.fixture
def tailed(monkeypatch):
    """The tail from simulations that gave these probabilities, of a response without a bound."""

    def of(runs):
        answers = iter(runs)
        monkeypatch.setattr(tail, "_subset_simulation", lambda *about: (next(answers), 100))
        inputs = space(a=Normal(mean=0.0, std=1.0))
        engine = SimpleNamespace(map=lambda work, seeds: map(work, seeds))
        monkeypatch.setattr(tail, "for_large_items", lambda engine: engine)
        monkeypatch.setattr(tail, "engine_from", lambda asked: engine)
        return tail.tail_probability(lambda x: x[:, 0], inputs, 3.0, replicates=len(runs), level_size=1000, engine=None)

    return of


def test_a_tail_is_the_mean_of_its_runs_with_coxs_interval(tailed):
    """Land 1972 for log-normal runs, with Student's t: mean exp(-+ t sqrt(s^2/n + s^4/(2 (n - 1)))), s of the logs."""
    found = tailed(RUNS)
    s = np.var(np.log(RUNS), ddof=1)
    half = stats.t.ppf(0.975, 4) * math.sqrt(s / 5 + s**2 / 8)
    assert found.probability == pytest.approx(np.mean(RUNS))
    assert (found.low, found.high) == pytest.approx((np.mean(RUNS) * math.exp(-half), np.mean(RUNS) * math.exp(half)))
    assert found.evaluations == 500


def test_a_tail_that_no_run_reached_is_below_what_the_last_level_could_show(tailed):
    """No hit among 5000 points of the last level: 3.7/5000 there at 97.5 %, times a tenth for each level before."""
    found = tailed([0.0] * 5)
    assert found.probability == 0.0
    at_last = 1 - 0.025 ** (1 / 5000)
    assert found.high == pytest.approx(at_last * 0.1 ** (tail.MAX_LEVELS - 1), rel=1e-6)


def test_a_run_that_missed_takes_the_lower_end_away(tailed):
    found = tailed([0.0, *RUNS])
    assert found.low == 0.0 < found.probability < found.high
