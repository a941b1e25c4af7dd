"""Worst case: the largest response over the tolerance box, with a certificate of how sure that is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any  # Any: values of JSON

import numpy as np

from hdopt.arrays import Array
from hdopt.errors import HdoptError
from hdopt.tolerance.response import Response, evaluate, proven_bound
from hdopt.tolerance.sampling import ScrambledSobol
from hdopt.tolerance.space import InputSpace

CORNERS = 2**17
POPULATION = 192
GENERATIONS = 1500
SPREAD = 1e-6
"""Relative spread of the population's responses at which evolution ends: ten roundings of the single-precision kernel.
Below it nothing is told apart (at 1e-10 all generations ran, for a value 6e-7 arcmin larger by its rounding)."""

PROVEN = "proven bound"
BEST_FOUND = "best found"


@dataclass(frozen=True)
class WorstCase:
    """The largest response found, where it is, and `bound`, which no drive in the box exceeds (None: not proven)."""

    value: float
    at: dict[str, float]
    bound: float | None
    evaluations: int

    @property
    def certificate(self) -> str:
        return BEST_FOUND if self.bound is None else PROVEN

    def to_dict(self) -> dict[str, Any]:
        return {
            "value": self.value,
            "bound": self.bound,
            "certificate": self.certificate,
            "at": self.at,
            "evaluations": self.evaluations,
        }


class Unbounded(HdoptError):
    """An input can be arbitrarily large, so that there is no worst case."""


def find_worst_case(
    response: Response, space: InputSpace, seed: int = 1, *, corners: int = CORNERS, generations: int = GENERATIONS
) -> WorstCase:
    """Largest response over the box: corners of all magnitudes with directions free, then differential evolution
    (Storn and Price 1997, scipy.optimize) over the whole box from the best of them.

    `corners` points of `space` start `generations` of evolution, all with `seed`. A `response` that knows a bound
    over a box (`Bounded`) certifies it. Raises `Unbounded` where an input is: there is no worst case then.
    """
    lower, upper = space.box
    check_bounded(space)
    turning = np.array([name in space.turning for name in space.names])
    best_inputs: list[Array] = []
    best_values: list[Array] = []
    evaluations = 0
    for u in ScrambledSobol(1).blocks(seed, 0, corners, space.dimension):
        at = lower + (upper - lower) * np.where(turning, u, np.round(u))
        values = evaluate(response, np.asfortranarray(at), space.names, "the worst-case search")
        keep = np.argsort(values)[-POPULATION:]
        best_inputs.append(at[keep])
        best_values.append(values[keep])
        evaluations += len(values)
    inputs, values = np.concatenate(best_inputs), np.concatenate(best_values)
    order = np.argsort(values)[-POPULATION:]
    inputs, values = inputs[order], values[order]
    place, value = inputs[-1], float(values[-1])
    varying = upper > lower
    if varying.any():
        from scipy.optimize import Bounds, differential_evolution

        width = (upper - lower)[varying]

        def negative(unit: Array) -> Array:
            at = np.tile(lower, (unit.shape[1], 1))
            at[:, varying] += width * unit.T
            return -evaluate(response, np.asfortranarray(at), space.names, "the worst-case search")

        start = np.clip((inputs[:, varying] - lower[varying]) / width, 0, 1)
        result = differential_evolution(
            negative,  # type: ignore[arg-type]  # vectorized: (d, n) in, (n,) out; the stubs know one point a call
            Bounds(np.zeros(len(width)), np.ones(len(width))),
            init=start,
            maxiter=generations,
            tol=SPREAD,
            polish=False,
            updating="deferred",
            vectorized=True,
            rng=np.random.default_rng(seed),
        )
        evaluations += int(result.nfev) * len(start)  # a vectorised call counts as one
        if -result.fun > value:
            value = float(-result.fun)
            place = lower.copy()
            place[varying] += width * result.x
    bound = proven_bound(response, lower, upper)
    return WorstCase(value, dict(zip(space.names, place.tolist(), strict=True)), bound, evaluations)


def check_bounded(space: InputSpace) -> None:
    """Raise `Unbounded` unless every input of `space` has finite bounds."""
    if space.fields:
        raise Unbounded(f"the worst case needs bounded inputs; {', '.join(sorted(space.fields))} are drawn at random")
    lower, upper = space.box
    loose = [n for n, a, b in zip(space.names, lower, upper, strict=True) if not (np.isfinite(a) and np.isfinite(b))]
    if loose:
        raise Unbounded(
            f"the worst case needs bounded inputs; {', '.join(loose)} can be arbitrarily large; "
            "truncate the distribution with lower and upper"
        )
