"""Rare events: the probability, down to 1e-7 and below, that a response exceeds a limit.

Either of two meshing zones can break the limit, and each in many directions: the failure region has many design points,
so methods around one of them (FORM, SORM, its importance sampling) find only a part. Subset simulation (Au and Beck
2001, OpenTURNS) needs none: it walks to the limit through nested levels. It is run in independent replicates, whose
spread gives the interval: the coefficient of variation that one run reports leaves out the dependence between levels.
"""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from functools import partial
from typing import Any  # Any: values of JSON

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from hdopt.arrays import Array
from hdopt.errors import HdoptError
from hdopt.parallel.engine import Engine, engine_from, for_large_items
from hdopt.tolerance.intervals import CONFIDENCE, clopper_pearson
from hdopt.tolerance.response import Response, evaluate, proven_bound
from hdopt.tolerance.space import InputSpace

REPLICATES = 16
LEVEL_SIZE = 20_000
LEVEL_PROBABILITY = 0.1
PROPOSAL_RANGE = 2.0
CHAIN_BLOCK = 1000
MAX_LEVELS = 16
"""Levels of a tenth: probabilities below 1e-16 are not told from zero."""
_one_at_a_time = threading.Lock()
"""OpenTURNS draws from one stream a process: two simulations at once would take numbers from each other."""


@dataclass(frozen=True)
class Tail:
    """P(response > limit) with its interval. `note` says what the number rests on; `replicates` hold every run's."""

    limit: float
    probability: float
    low: float
    high: float
    method: str
    evaluations: int
    note: str = ""
    replicates: tuple[float, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        return {
            "limit": self.limit,
            "probability": self.probability,
            "low": self.low,
            "high": self.high,
            "method": self.method,
            "evaluations": self.evaluations,
            "note": self.note,
        }


def tail_probability(
    response: Response,
    space: InputSpace,
    limit: float,
    *,
    seed: int = 1,
    replicates: int = REPLICATES,
    level_size: int = LEVEL_SIZE,
    engine: Engine | str | None = None,
) -> Tail:
    """P(`response` > `limit`) over `space`, with a 95 % interval over `replicates` independent subset simulations.

    Each simulation has a stream of its own from `seed` and takes `level_size` points a level (Au and Beck 2001). They
    run on `engine` (by default the one in force): each in a process of its own where it has any, else one after another
    on all threads; the answer is the same. Exactly zero where a proven bound of the response over its bounded inputs
    does not exceed the limit. Raises `HdoptError` for a limit that is not finite.
    """
    if not math.isfinite(limit):
        raise HdoptError(f"the tail's limit is {limit!r}; it must be a finite number")
    bound = _proven_bound(response, space)
    if bound is not None and bound <= limit:
        note = (
            f"exactly zero: the inputs are bounded, and no drive within their bounds exceeds {bound:.6g}, "
            f"which the limit {limit:g} is not below"
        )
        return Tail(limit, 0.0, 0.0, 0.0, "proven bound", 0, note)
    seeds = [int(child.generate_state(1)[0]) for child in np.random.SeedSequence(seed).spawn(replicates)]
    simulate = partial(_subset_simulation, response, space, limit, level_size)
    found = list(for_large_items(engine_from(engine)).map(simulate, seeds))
    runs, evaluations = [probability for probability, _ in found], sum(used for _, used in found)
    if not any(runs):
        ceiling = clopper_pearson(0, replicates * level_size).high * LEVEL_PROBABILITY ** (MAX_LEVELS - 1)
        note = f"no response above {limit:g} was found; where inputs are bounded the probability may be exactly zero"
        return Tail(limit, 0.0, 0.0, ceiling, "subset simulation", evaluations, note, tuple(runs))
    low, high = _interval(runs)
    note = f"95 % interval over {replicates} independent subset simulations (Cox's, for log-normal estimates)"
    return Tail(limit, float(np.mean(runs)), low, high, "subset simulation", evaluations, note, tuple(runs))


def _interval(runs: list[float]) -> tuple[float, float]:
    """Interval of the mean of positive, skewed estimates: Cox's for log-normal data (Land 1972; Zhou and Gao 1997),
    with Student's t. A product of level probabilities is close to log-normal. 0 below where a run missed."""
    mean, met = float(np.mean(runs)), np.log([run for run in runs if run > 0])
    if len(met) < 2:
        return 0.0, mean * len(runs)
    variance, count = float(np.var(met, ddof=1)), len(met)
    spread = math.sqrt(variance / count + variance**2 / (2 * (count - 1)))
    half = float(special.stdtrit(count - 1, 0.5 + CONFIDENCE / 2)) * spread
    return (0.0 if count < len(runs) else mean * math.exp(-half)), mean * math.exp(half)


def _proven_bound(response: Response, space: InputSpace) -> float | None:
    """The response's own bound, where all inputs are bounded."""
    lower, upper = space.box
    return proven_bound(response, lower, upper) if np.all(np.isfinite(lower) & np.isfinite(upper)) else None


def _subset_simulation(
    response: Response, space: InputSpace, limit: float, level_size: int, seed: int
) -> tuple[float, int]:
    """One run in the space of independent standard normal numbers; returns the probability and the responses used."""
    with _one_at_a_time:
        return _simulated(response, space, limit, level_size, seed)


def _simulated(response: Response, space: InputSpace, limit: float, level_size: int, seed: int) -> tuple[float, int]:
    import openturns as ot

    correlations = space.copula

    def values(sample: ArrayLike) -> Array:
        scores = np.asarray(sample, float)
        u = np.clip(special.ndtr(scores), 1e-300, 1 - 2.0**-53)
        inputs = space.sample(u) if correlations.is_independent else space.from_uniform(correlations.correlate(u))
        return evaluate(response, inputs, space.names, "the tail simulation")[:, None]

    ot.RandomGenerator.SetSeed(seed)
    function = ot.PythonFunction(space.dimension, 1, func_sample=values)
    output = ot.CompositeRandomVector(function, ot.RandomVector(ot.Normal(space.dimension)))
    event = ot.ThresholdEvent(output, ot.Greater(), limit)
    simulation = ot.SubsetSampling(event, PROPOSAL_RANGE, LEVEL_PROBABILITY)
    block = min(CHAIN_BLOCK, level_size)
    simulation.setBlockSize(block)
    simulation.setMaximumOuterSampling(level_size // block)
    simulation.setMinimumProbability(LEVEL_PROBABILITY**MAX_LEVELS)
    try:
        simulation.run()
    except RuntimeError as error:
        if "too small" not in str(error):
            raise
        return 0.0, int(function.getEvaluationCallsNumber())  # below the smallest probability that is told from zero
    return float(simulation.getResult().getProbabilityEstimate()), int(function.getEvaluationCallsNumber())
