"""Monte Carlo stacks: how a response spreads when its inputs spread as the tolerances say.

The sample comes in independent replicates (scramblings, or streams of plain Monte Carlo), each evaluated block by
block, so memory does not grow with the sample. Every figure carries the interval that fits its sampling.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any  # Any: values of JSON

import numpy as np
from scipy import special

from hdopt.arrays import Array
from hdopt.errors import HdoptError
from hdopt.parallel.engine import Engine, engine_from
from hdopt.tolerance import capability
from hdopt.tolerance.empirical import Bins, Collector, CountInBins, Empirical, KeepAll, merge
from hdopt.tolerance.fused import FusedPass, fused_pass
from hdopt.tolerance.intervals import (
    IntervalEstimate,
    clopper_pearson,
    order_statistic_ranks,
    over_scramblings,
    smallest_n,
    student_half_width,
)
from hdopt.tolerance.linearise import DIRECTIONS, Linearisation, linearise
from hdopt.tolerance.response import Response, Signed, evaluate
from hdopt.tolerance.sampling import BLOCK, Sampling, ScrambledSobol, replicate_sizes
from hdopt.tolerance.space import InputSpace

if TYPE_CHECKING:
    import pandas as pd


KEPT_VALUES = 2**24
"""Up to here every value is kept (128 MiB); a larger sample is counted in bins."""
PART = 2**20
"""Points of one task at least; up to 16 of them in all, a task is a replicate."""
MOST_PARTS = 4096
PILOT = 2**12
FEW = 4
"""Fewer points than this beyond a quantile per scrambling, and its interval is made from ranks instead."""
REPORTED_QUANTILES = (0.5, 0.9, 0.99)
HISTOGRAM_BINS = 120


@dataclass(frozen=True)
class ReplicateTask:
    """All that one replicate needs, to be evaluated anywhere."""

    response: Response
    space: InputSpace
    sampling: Sampling
    seed: int
    replicate: int
    n: int
    limit: float
    bins: Bins | None
    start: int = 0
    """The first point of this task; `n` is the point after its last. A long replicate is several."""
    fused: FusedPass | None = None
    """The compiled pass that makes the values; None on the general path."""

    def general(self, u: Array, start: int) -> Array:
        """The responses at the points `u` (k, d) of the unit cube, of which the first is point `start`, shape (k,).

        Raises `HdoptError` where one is not finite.
        """
        where = f"replicate {self.replicate} of seed {self.seed}, counted from {start}"
        return evaluate(self.response, self.space.sample(u), self.space.names, where)


@dataclass(frozen=True)
class Replicate:
    """What one replicate leaves: moments, values above the limit, and its empirical distribution."""

    n: int
    mean: float
    variance: float
    above_limit: int
    values: Empirical


def run_replicate(task: ReplicateTask) -> Replicate:
    """Sample the replicate of `task`, or the part of it that the task asks for, block by block.

    Raises `HdoptError` where a response is not finite.
    """
    collector: Collector = KeepAll() if task.bins is None else CountInBins(task.bins)
    count, mean, squares, above = 0, 0.0, 0.0, 0
    for values in _values(task):
        collector.add(values)
        above += int(np.count_nonzero(values > task.limit))
        block_mean = float(values.mean())
        shift = block_mean - mean
        total = count + len(values)
        squares += float(np.square(values - block_mean).sum()) + shift * shift * count * len(values) / total
        mean += shift * len(values) / total
        count = total
    return Replicate(count, mean, squares / count, above, collector.finish())


def _values(task: ReplicateTask) -> Iterator[Array]:
    """The responses of a task, block by block."""
    if task.fused is not None and isinstance(task.sampling, ScrambledSobol):
        yield from _values_of_sobol(task, task.sampling, task.fused)
        return
    start = task.start
    for u in task.sampling.blocks(task.seed, task.replicate, task.n, task.space.dimension, start):
        values = None if task.fused is None else task.fused.of_points(u)
        yield task.general(u, start) if values is None else values
        start += len(u)


def _values_of_sobol(task: ReplicateTask, sampling: ScrambledSobol, fused: FusedPass) -> Iterator[Array]:
    """The same where the compiled pass makes the points too."""
    dimension = task.space.dimension
    scrambling = sampling.scrambling(task.seed, task.replicate, task.n, dimension)
    for start in range(task.start, task.n, BLOCK):
        stop = min(start + BLOCK, task.n)
        values = fused.of_sobol(scrambling, start, stop)
        if values is None:
            values = task.general(next(sampling.blocks(task.seed, task.replicate, stop, dimension, start)), start)
        yield values


def _replicates(tasks: Sequence[ReplicateTask], engine: Engine) -> list[Replicate]:
    """Every replicate, sampled in parts of a size that depends on the number of points alone: so do the numbers."""
    size = part_size(sum(task.n for task in tasks))
    pieces = [
        replace(task, start=start, n=min(start + size, task.n)) for task in tasks for start in range(0, task.n, size)
    ]
    found: dict[int, Replicate] = {}
    for piece, part in zip(pieces, engine.map(run_replicate, pieces), strict=True):
        before = found.get(piece.replicate)
        found[piece.replicate] = part if before is None else _together(before, part)
    return [found[task.replicate] for task in tasks]


def part_size(n: int) -> int:
    """Points that one task samples of `n` in all: a second's work or so, in 4096 tasks and a few at most."""
    return -(-max(PART, n // MOST_PARTS) // BLOCK) * BLOCK


def _together(one: Replicate, two: Replicate) -> Replicate:
    """Two parts of a replicate as one (Chan, Golub and LeVeque 1983)."""
    n, shift = one.n + two.n, two.mean - one.mean
    squares = one.variance * one.n + two.variance * two.n + shift * shift * one.n * two.n / n
    values = merge([one.values, two.values])
    return Replicate(n, one.mean + shift * two.n / n, squares / n, one.above_limit + two.above_limit, values)


@dataclass(frozen=True)
class Stack:
    """The distribution of a response under its tolerances. `unit` names the response's unit ('arcmin', 'mm', ...).

    `path` is 'fused' where one compiled pass made every drive from its point, 'general' where inputs and responses
    were made one after the other; figures agree to the rounding of single precision.
    `quantiles` by probability; `ppk` is None where the sample is too small for X99.865, and `notes` says so.
    `linearisation` with `rss`, its value at the quantile of the required yield.
    """

    n: int
    sampling: str
    path: str
    seed: int
    unit: str
    limit: float
    required_yield: float
    mean: IntervalEstimate
    std: IntervalEstimate
    quantiles: dict[float, IntervalEstimate]
    conforming: IntervalEstimate
    ppk: IntervalEstimate | None
    linearisation: Linearisation
    rss: float
    histogram: tuple[Array, Array] = field(repr=False)
    notes: tuple[str, ...] = ()

    @property
    def ppm(self) -> IntervalEstimate:
        """Parts per million beyond the limit."""
        return self.conforming.map(lambda share: 1e6 * (1 - share))

    @property
    def required_quantile(self) -> IntervalEstimate:
        """The quantile at the required yield: it must not exceed the limit."""
        return self.quantiles[self.required_yield]

    def to_dict(self) -> dict[str, Any]:
        line, unit = self.linearisation, self.unit
        return {
            "n": self.n,
            "sampling": self.sampling,
            "path": self.path,
            "seed": self.seed,
            f"limit_{unit}": self.limit,
            "required_yield": self.required_yield,
            f"mean_{unit}": self.mean.value,
            f"std_{unit}": self.std.value,
            "quantiles": {f"{q:g}": estimate.to_dict() for q, estimate in self.quantiles.items()},
            "yield": self.conforming.to_dict(),
            "ppm": self.ppm.value,
            "ppk": None if self.ppk is None else self.ppk.value,
            f"rss_{unit}": self.rss,
            "contributions": line.shares,
            "intervals": {
                f"mean_{unit}": self.mean.to_dict(),
                f"std_{unit}": self.std.to_dict(),
                "ppm": self.ppm.to_dict(),
                "ppk": None if self.ppk is None else self.ppk.to_dict(),
            },
            "interval": {
                "confidence": self.mean.confidence,
                "mean": self.mean.interval,
                "quantiles": self.required_quantile.interval,
                "yield": self.conforming.interval,
                "ppk": None if self.ppk is None else self.ppk.interval,
            },
            "linearisation": {
                "operating_point": line.point,
                "slopes": line.slopes,
                f"mean_{unit}": line.value,
                f"std_{unit}": line.std,
                f"mean_error_{unit}": line.value - self.mean.value,
                f"std_error_{unit}": line.std - self.std.value,
                f"rss_error_{unit}": self.rss - self.required_quantile.value,
            },
            "notes": list(self.notes),
        }

    def to_frame(self) -> pd.DataFrame:
        """A pandas table: one row a figure, with its interval."""
        import pandas as pd

        rows = {f"mean, {self.unit}": self.mean, f"standard deviation, {self.unit}": self.std}
        rows |= {f"quantile {q:g}, {self.unit}": estimate for q, estimate in self.quantiles.items()}
        rows |= {"yield": self.conforming, "ppm beyond the limit": self.ppm}
        if self.ppk is not None:
            rows["Ppk"] = self.ppk
        return pd.DataFrame(
            [(name, e.value, e.low, e.high, e.interval) for name, e in rows.items()],
            columns=["figure", "value", "low", "high", "interval"],
        ).set_index("figure")


@dataclass(frozen=True)
class StackRequest:
    """What is asked of a stack.

    `limit` is the upper limit in `unit`, `required_yield` the share that must keep it, `n` the samples in all, drawn by
    `sampling` with `seed`; `quantiles` are reported beside the usual ones; `engine` computes the replicates. `fused`:
    one compiled pass makes the drives where it can. `linearised` takes the place of a response that is dear, and
    `directions` are those that its straight line is averaged over.
    """

    limit: float
    required_yield: float = 0.9973
    n: int = 2**18
    sampling: Sampling = field(default_factory=ScrambledSobol)
    seed: int = 1
    engine: Engine | str | None = None
    quantiles: Sequence[float] = ()
    unit: str = "arcmin"
    fused: bool = True
    linearised: Response | None = None
    directions: int = DIRECTIONS


def run_stack(response: Response, space: InputSpace, request: StackRequest) -> Stack:
    """Sample `response` over `space` and report its distribution against the limit, as `request` asks.

    Raises `HdoptError` where n is too small for a quantile asked for, or a response is not finite.
    """
    sampling, n, seed, required = request.sampling, request.n, request.seed, request.required_yield
    if not 0 < required < 1:
        raise HdoptError(f"the required yield is {required!r}; it must lie between 0 and 1, such as 0.9973")
    _check_size(n, sampling, [required, *request.quantiles])
    asked = [q for q in sorted({required, *request.quantiles, *REPORTED_QUANTILES}) if n >= smallest_n(q)]
    sizes = replicate_sizes(n, sampling.replicates)
    bins = None if n <= KEPT_VALUES else Bins.around(_pilot(response, space, sampling, seed, sizes[0]))
    fused = fused_pass(response, space) if request.fused else None
    parts = _replicates(
        [
            ReplicateTask(response, space, sampling, seed, replicate, size, request.limit, bins, fused=fused)
            for replicate, size in enumerate(sizes)
        ],
        engine_from(request.engine),
    )
    pooled = merge(part.values for part in parts)
    two_sided = isinstance(response, Signed)
    straight = request.linearised or response
    line = linearise(straight.signed if isinstance(straight, Signed) else straight, space, seed, request.directions)
    z = float(special.ndtri((1 + required) / 2 if two_sided else required))
    performance, notes = _performance(parts, pooled, sampling, request.limit)
    return Stack(
        n=n,
        sampling=f"{sampling.replicates} x {sampling.name}" if not sampling.independent_points else sampling.name,
        path="general" if fused is None else "fused",
        seed=seed,
        unit=request.unit,
        limit=request.limit,
        required_yield=required,
        mean=over_scramblings([part.mean for part in parts], _pooled_mean(parts)),
        std=over_scramblings([part.variance**0.5 for part in parts], _pooled_std(parts)),
        quantiles={q: quantile_estimate(parts, pooled, q, sampling) for q in asked},
        conforming=yield_estimate(parts, sampling),
        ppk=performance,
        linearisation=line,
        rss=line.rss(z),
        histogram=pooled.histogram(HISTOGRAM_BINS),
        notes=notes,
    )


def _check_size(n: int, sampling: Sampling, quantiles: Sequence[float]) -> None:
    if n < 2 * sampling.replicates:
        raise HdoptError(f"n is {n}; at least {2 * sampling.replicates} samples are needed, two per replicate")
    for q in quantiles:
        if not 0 < q < 1:
            raise HdoptError(f"the quantile {q!r} is asked for; it must lie between 0 and 1")
        if n < (least := smallest_n(q)):
            raise HdoptError(
                f"n is {n}, too small for the quantile {q:.12g} with its 95 % interval; the smallest n is {least}"
            )


def _pilot(response: Response, space: InputSpace, sampling: Sampling, seed: int, n: int) -> Array:
    u = next(sampling.blocks(seed, 0, min(PILOT, n), space.dimension))
    return evaluate(response, space.sample(u), space.names, "the pilot sample")


def _pooled_mean(parts: Sequence[Replicate]) -> float:
    return float(np.average([part.mean for part in parts], weights=[part.n for part in parts]))


def _pooled_std(parts: Sequence[Replicate]) -> float:
    mean, weights = _pooled_mean(parts), [part.n for part in parts]
    return float(np.sqrt(np.average([part.variance + (part.mean - mean) ** 2 for part in parts], weights=weights)))


def yield_estimate(parts: Sequence[Replicate], sampling: Sampling) -> IntervalEstimate:
    """Share within the limit, from the replicates `parts` of one sample drawn by `sampling`.

    Over scramblings by Student's t, unless hardly any point lies beyond the limit (or within): then Clopper-Pearson as
    for independent points, which scrambled ones, being more even, keep."""
    n = sum(part.n for part in parts)
    above = sum(part.above_limit for part in parts)
    if sampling.independent_points:
        return clopper_pearson(n - above, n)
    if min(above, n - above) < FEW * len(parts):
        exact = clopper_pearson(n - above, n)
        few = "Clopper-Pearson (too few beyond the limit to compare scramblings)"
        return IntervalEstimate(exact.value, exact.low, exact.high, few)
    shares = over_scramblings([1 - part.above_limit / part.n for part in parts], 1 - above / n)
    return IntervalEstimate(shares.value, max(shares.low, 0.0), min(shares.high, 1.0), shares.interval)


def quantile_estimate(parts: Sequence[Replicate], pooled: Empirical, q: float, sampling: Sampling) -> IntervalEstimate:
    """Quantile `q` (0 to 1) of the values of all `parts` together, which are `pooled`, with its interval.

    For `sampling` by scramblings: the t-interval of the share below it, turned back into values (Woodruff 1952), which
    is right for skewed tails. For independent points, or where few lie beyond: order statistics.
    """
    n = pooled.n
    value = pooled.ranked(_rank(q, n))
    beyond = n * min(q, 1 - q)
    if not sampling.independent_points and beyond >= FEW * len(parts):
        half = student_half_width([part.values.at_most(value) / part.n for part in parts])
        low, high = _rank(max(q - half, 0.0), n), _rank(min(q + half, 1.0), n)
        return IntervalEstimate(
            value, pooled.ranked(low), pooled.ranked(high), f"t over {len(parts)} scramblings, inverted"
        )
    low, high = order_statistic_ranks(q, n)
    kind = "order statistics" if sampling.independent_points else "order statistics (too few points beyond)"
    return IntervalEstimate(value, pooled.ranked(max(low, 1)), pooled.ranked(min(high, n)), kind)


def _rank(q: float, n: int) -> int:
    return min(max(int(np.ceil(n * q - 1e-9)), 1), n)


def _performance(
    parts: Sequence[Replicate], pooled: Empirical, sampling: Sampling, limit: float
) -> tuple[IntervalEstimate | None, tuple[str, ...]]:
    """Ppk; over scramblings by Student's t, otherwise from the intervals of both percentiles, each at half the risk."""
    needed, n = smallest_n(capability.UPPER_PERCENTILE, 0.975), pooled.n
    if n < needed:
        return None, (f"Ppk is left out: X99.865 with an interval needs n of at least {needed}, n is {n}",)

    def performance(values: Empirical) -> float:
        median, upper = (values.ranked(_rank(q, values.n)) for q in (capability.MEDIAN, capability.UPPER_PERCENTILE))
        return capability.ppk(limit, median, upper)

    value = performance(pooled)
    if not np.isfinite(value):
        return IntervalEstimate(value, value, value, "nothing varies"), ()
    if not sampling.independent_points and n * (1 - capability.UPPER_PERCENTILE) >= FEW * len(parts):
        return over_scramblings([performance(part.values) for part in parts], value), ()
    ranks = [order_statistic_ranks(q, n, 0.975) for q in (capability.MEDIAN, capability.UPPER_PERCENTILE)]
    medians, uppers = ([pooled.ranked(min(max(rank, 1), n)) for rank in pair] for pair in ranks)
    corners = [capability.ppk(limit, median, upper) for median in medians for upper in uppers]
    return IntervalEstimate(value, min(corners), max(corners), "order statistics of both percentiles"), ()
