"""Our distributions beside scipy's and OpenTURNS': speed and far tails.

`python -m tests.benchmarks.distributions [QUANTILES]` prints the table. Each library gives quantiles of the same
truncated distributions; "log tail off by" is by how much the logarithm of a quantile's own tail probability misses the
one asked for, with formulas that keep their digits out there (inf: no number, or a probability of zero).
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import openturns as ot
from scipy import special, stats

from hdopt.arrays import Array
from hdopt.tolerance import distributions as own
from hdopt.tolerance.copula import CorrelationGroup, GaussianCopula
from hdopt.workflow.stack import study_problem

Quantile = Callable[[Array], Array]


class Case(NamedTuple):
    """One truncated distribution, ours, and the untruncated ones of the libraries; `log_tail` of the untruncated."""

    ours: own.Truncated
    scipy: Any
    openturns: ot.Distribution
    log_tail: Callable[[Array], Array]


def log_normal_tail(z: Array) -> Array:
    return special.log_ndtr(-z)


def log_triangle_tail(x: Array) -> Array:
    """Of the triangle from 0 over 0.25 to 1."""
    return np.where(x < 0.25, np.log1p(-x * x / 0.25), np.log((1 - x) ** 2 / 0.75))


def normal(lower: float, upper: float) -> Case:
    return Case(own.Normal(std=1.0, lower=lower, upper=upper), stats.norm(), ot.Normal(), log_normal_tail)


def rayleigh(lower: float, upper: float) -> Case:
    ours = own.Rayleigh(scale=1.0, lower=lower, upper=upper)
    return Case(ours, stats.rayleigh(), ot.Rayleigh(1.0), lambda x: -0.5 * x * x)


def half_normal(lower: float, upper: float) -> Case:
    theirs = ot.TruncatedNormal(0.0, 1.0, 0.0, 40.0)
    ours = own.HalfNormal(scale=1.0, lower=lower, upper=upper)
    return Case(ours, stats.halfnorm(), theirs, lambda x: math.log(2) + log_normal_tail(x))


def lognormal(lower: float, upper: float) -> Case:
    ours = own.LogNormal(median=1.0, log_std=0.5, lower=lower, upper=upper)
    return Case(ours, stats.lognorm(0.5), ot.LogNormal(0.0, 0.5), lambda x: log_normal_tail(np.log(x) / 0.5))


def beta(a: float, b: float, lower: float, upper: float) -> Case:
    ours = own.Beta(a=a, b=b, lower=lower, upper=upper)
    return Case(ours, stats.beta(a, b), ot.Beta(a, b, 0.0, 1.0), lambda x: np.log(special.betaincc(a, b, x)))


def triangular(lower: float, upper: float) -> Case:
    ours = own.Triangular(minimum=0.0, mode=0.25, maximum=1.0, lower=lower, upper=upper)
    return Case(ours, stats.triang(0.25), ot.Triangular(0.0, 0.25, 1.0), log_triangle_tail)


CASES = {
    "normal, -2 to 3 sigma": normal(-2.0, 3.0),
    "normal, beyond 8 sigma": normal(8.0, math.inf),
    "rayleigh, to 3 scales": rayleigh(0.0, 3.0),
    "rayleigh, beyond 9 scales": rayleigh(9.0, math.inf),
    "half-normal, to 3 scales": half_normal(0.0, 3.0),
    "half-normal, beyond 8 scales": half_normal(8.0, math.inf),
    "lognormal, 0 to 3 medians": lognormal(0.0, 3.0),
    "lognormal, beyond 60 medians": lognormal(60.0, math.inf),
    "beta(2, 3), 0.1 to 0.9": beta(2.0, 3.0, 0.1, 0.9),
    "beta(2, 20), beyond 0.9": beta(2.0, 20.0, 0.9, 1.0),
    "triangular, 0.1 to 1": triangular(0.1, 1.0),
    "triangular, beyond 0.9999": triangular(0.9999, 1.0),
}


def ways_of(case: Case) -> dict[str, Quantile]:
    """The quantiles of a case by each library: scipy's by its distribution function and by its upper tail."""
    lower, upper = case.ours.lower, case.ours.upper
    low, high = case.scipy.cdf(lower), case.scipy.cdf(upper)
    above, beyond = case.scipy.sf(lower), case.scipy.sf(upper)
    ways: dict[str, Quantile] = {
        "hdopt": case.ours.quantile,
        "scipy ppf": lambda u: case.scipy.ppf(low + u * (high - low)),
        "scipy isf": lambda u: case.scipy.isf(above - u * (above - beyond)),
        "OpenTURNS": by_openturns(case.openturns, lower, upper),
    }
    if isinstance(case.ours, own.Normal):
        ways["truncnorm"] = stats.truncnorm(lower, upper).ppf
    return ways


def by_openturns(untruncated: ot.Distribution, lower: float, upper: float) -> Quantile:
    """`TruncatedDistribution`; where it refuses so little probability, no number."""
    try:
        truncated = ot.TruncatedDistribution(untruncated, ot.Interval([lower], [upper], [True], [upper < math.inf]))
    except TypeError:
        return lambda u: np.full(u.shape, math.nan)
    return lambda u: np.array(truncated.computeQuantile(ot.Point(u.tolist())).asPoint())


def tail_miss(case: Case, quantile: Quantile, u: Array) -> float:
    """By how much the logarithm of the tail probability misses at most; `u` (n,) in (0, 1)."""
    lower, upper = (np.array([bound]) for bound in case.ours.support)
    with np.errstate(divide="ignore", invalid="ignore"):
        low = float(case.log_tail(lower)[0])
        high = float(case.log_tail(upper)[0]) if np.isfinite(upper[0]) else -math.inf
        wanted = low + np.logaddexp(np.log1p(-u) + np.log1p(-math.exp(high - low)), high - low)
        missed = np.abs(case.log_tail(np.asarray(quantile(u), float)) - wanted)
    return float(np.where(np.isfinite(missed), missed, math.inf).max())


def seconds(work: Callable[[], object]) -> float:
    """Processor time, the best of three."""
    taken = []
    for _ in range(3):
        start = time.process_time()
        work()
        taken.append(time.process_time() - start)
    return min(taken)


def copulas() -> dict[str, Quantile]:
    """Three inputs with correlations of 0.5, by us and by OpenTURNS: independent uniforms (n, 3) to dependent ones."""
    matrix = np.full((3, 3), 0.5) + 0.5 * np.eye(3)
    group = GaussianCopula(("a", "b", "c"), (CorrelationGroup(("a", "b", "c"), matrix),))
    theirs = ot.NormalCopula(ot.CorrelationMatrix(matrix.tolist())).getInverseIsoProbabilisticTransformation()
    return {"hdopt": group.correlate, "OpenTURNS": lambda u: np.array(theirs(ot.Sample(special.ndtri(u))))}


def main(n: int) -> None:
    """Print the table, ours timed by `n` quantiles."""
    print(f"{'':32s} {'':10s} {'ns a quantile':>14s} {'log tail off by':>16s}")
    for name, case in CASES.items():
        for library, quantile in ways_of(case).items():
            u = np.random.default_rng(0).random(n if library != "OpenTURNS" else n // 20)
            cost = 1e9 * seconds(lambda quantile=quantile, u=u: quantile(u)) / len(u)
            off = tail_miss(case, quantile, np.array([0.01, 0.3, 0.5, 0.9, 0.999]))
            print(f"{name:32s} {library:10s} {cost:14.1f} {off:16.1e}", flush=True)
    u = np.random.default_rng(0).random((n // 20, 3))
    for library, transform in copulas().items():
        cost = 1e9 * seconds(lambda transform=transform: transform(u)) / len(u)
        print(f"{'gaussian copula of three':32s} {library:10s} {cost:14.1f} a row", flush=True)
    problem = study_problem("csf-25-80")
    points = np.random.default_rng(0).random((n // 5, problem.space.dimension))
    inputs = problem.space.sample(points)
    sampling = 1e9 * seconds(lambda: problem.space.sample(points)) / len(points)
    response = 1e9 * seconds(lambda: problem.response(inputs)) / len(points)
    print(f"a drive of the stack of csf-25-80: inputs {sampling:.0f} ns, response {response:.0f} ns")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)
