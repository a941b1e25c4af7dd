"""Every family: its quantiles invert its distribution, truncation keeps the bounds, bad parameters are refused."""

import numpy as np
import pytest
from scipy import stats

from hdopt.errors import HdoptError
from hdopt.tolerance.distributions import (
    FAMILIES,
    Beta,
    HalfNormal,
    LogNormal,
    MeasuredSample,
    Normal,
    Rayleigh,
    Scaled,
    Triangular,
    Uniform,
    moments_of,
)
from tests.benchmarks.distributions import CASES as CASES_OF_TAILS
from tests.benchmarks.distributions import tail_miss

CASES = {
    "normal": (Normal, {"mean": 0.3, "std": 0.2}, stats.norm(0.3, 0.2), (0.1, 0.9)),
    "uniform": (Uniform, {}, stats.uniform(0.1, 0.8), (0.1, 0.9)),
    "triangular": (
        Triangular,
        {"minimum": 0.0, "mode": 0.25, "maximum": 1.0},
        stats.triang(0.25, 0.0, 1.0),
        (0.1, 0.9),
    ),
    "rayleigh": (Rayleigh, {"scale": 0.4}, stats.rayleigh(scale=0.4), (0.1, 0.9)),
    "half_normal": (HalfNormal, {"scale": 0.4}, stats.halfnorm(scale=0.4), (0.1, 0.9)),
    "lognormal": (LogNormal, {"median": 0.4, "log_std": 0.5}, stats.lognorm(0.5, scale=0.4), (0.1, 0.9)),
    "beta": (Beta, {"a": 2.0, "b": 3.0}, stats.beta(2, 3), (0.1, 0.9)),
}
U = np.linspace(1e-6, 1 - 1e-6, 1001)


def test_every_family_has_a_case():
    assert set(CASES) | {"measured"} == set(FAMILIES)


@pytest.mark.parametrize("name", CASES)
def test_truncated_quantiles_are_those_of_the_truncated_distribution(name):
    family, parameters, reference, (lower, upper) = CASES[name]
    truncated = family(**parameters, lower=lower, upper=upper)
    x = truncated.quantile(U)
    share = (reference.cdf(x) - reference.cdf(lower)) / (reference.cdf(upper) - reference.cdf(lower))
    assert share == pytest.approx(U, abs=1e-12)  # rounding of both sides
    assert truncated.support == (lower, upper)
    assert np.all((x >= lower) & (x <= upper))


@pytest.mark.parametrize("name", [name for name in CASES if name != "uniform"])
def test_quantiles_without_truncation(name):
    family, parameters, reference, _ = CASES[name]
    assert family(**parameters).quantile(U) == pytest.approx(reference.ppf(U), rel=1e-9, abs=1e-12)


def test_far_tail_keeps_its_digits():
    """Truncated to beyond 8 standard deviations, where a distribution function near 1 has none left."""
    beyond = Normal(std=1.0, lower=8.0).quantile(np.array([0.5]))
    assert beyond == pytest.approx(stats.norm.isf(0.5 * stats.norm.sf(8.0)), rel=1e-12)


def test_measured_sample(tmp_path):
    path = tmp_path / "runout.csv"
    path.write_text("runout_mm\n0.004\n0.001 # first\n\n0.003\n0.002\n")
    sample = MeasuredSample.from_csv(path)
    assert sample.support == (0.001, 0.004)
    assert sample.quantile([0.0, 0.5, 1.0]) == pytest.approx([0.001, 0.0025, 0.004])
    assert MeasuredSample.from_csv(path, upper=0.0035).support == (0.001, 0.003)


def test_scaling_keeps_the_shape():
    base = Normal(std=0.1, lower=-0.2, upper=0.2)
    half = Scaled(base=base, factor=0.5)
    assert half.support == (-0.1, 0.1)
    assert half.quantile(U) == pytest.approx(0.5 * base.quantile(U))
    shifted = Scaled(base=Uniform(lower=1.0, upper=3.0), factor=0.5, centre=2.0)
    assert shifted.support == (1.5, 2.5)


def test_moments():
    mean, std = moments_of(Uniform(lower=0.0, upper=1.0))
    assert (mean, std) == pytest.approx((0.5, 1 / np.sqrt(12)), rel=1e-6)
    mean, _ = moments_of(Normal(std=1.0), absolute=True)
    assert mean == pytest.approx(np.sqrt(2 / np.pi), rel=1e-3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Normal(std=1.0, lower=1.0, upper=0.5), "inconsistent: lower 1, upper 0.5; lower must be below upper"),
        (lambda: Rayleigh(scale=1.0, upper=-0.1), r"misses everything the distribution can be, \[0, inf\]"),
        (lambda: Normal(std=1e-3, lower=5.0), "no probability is left"),
        (lambda: Normal(std=-1.0), "std of the normal distribution is -1.0; it must be a finite number above 0"),
        (lambda: Uniform(lower=0.0), "upper of the uniform distribution is inf"),
        (lambda: Triangular(minimum=0.0, mode=2.0, maximum=1.0), "they must come in this order"),
        (lambda: Beta(a=0.0, b=1.0), "a of the beta distribution is 0.0"),
        (lambda: MeasuredSample(values=[1.0, np.nan]), "holds a value that is not finite"),
        (lambda: MeasuredSample(values=[1.0, 2.0], lower=1.5), "at least two different ones are needed"),
    ],
)
def test_bad_parameters(make, message):
    with pytest.raises(HdoptError, match=message):
        make()


def test_measured_sample_names_the_bad_line(tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text("0.001\nthin\n")
    with pytest.raises(HdoptError, match=r"line 2: 'thin'; each line must hold one number"):
        MeasuredSample.from_csv(path)
    with pytest.raises(HdoptError, match="cannot be read"):
        MeasuredSample.from_csv(tmp_path / "none.csv")


@pytest.mark.parametrize("name", CASES_OF_TAILS)
def test_a_quantile_has_the_tail_probability_asked_for(name):
    """In the body and far beyond it, where a distribution function near 1 has no digits left: the logarithm of the tail
    is right to 1e-11, a few thousand roundings (a triangle's 1 - x near its end is the worst, 4e-12)."""
    case = CASES_OF_TAILS[name]
    assert tail_miss(case, case.ours.quantile, np.array([0.01, 0.3, 0.5, 0.9, 0.999])) < 1e-11
