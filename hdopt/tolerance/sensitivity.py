"""Which inputs matter: Sobol' indices by SALib's estimators, and Shapley effects where inputs are correlated.

Intervals come from independent scramblings of the same design: each scrambling gives every index once, and Student's t
over them needs no resampling.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import TYPE_CHECKING, Any  # Any: values of JSON

import numpy as np
from scipy import special

from hdopt.arrays import Array
from hdopt.errors import HdoptError, unknown_name
from hdopt.parallel.engine import Engine, engine_from
from hdopt.tolerance.intervals import IntervalEstimate, over_scramblings
from hdopt.tolerance.response import Response, evaluate
from hdopt.tolerance.sampling import ScrambledSobol, replicate_sizes
from hdopt.tolerance.space import InputSpace

if TYPE_CHECKING:
    import pandas as pd


SCRAMBLINGS = 16
SMALLEST_PER_SCRAMBLING = 16
MAX_PLAYERS = 12
"""Shapley effects go through every subset of the players: 4096 of 12."""


@dataclass(frozen=True)
class Index:
    """First-order and total index of an input or a group."""

    S1: IntervalEstimate
    ST: IntervalEstimate

    def to_dict(self) -> dict[str, dict[str, float]]:
        return {"S1": self.S1.to_dict(), "ST": self.ST.to_dict()}


@dataclass(frozen=True)
class Convergence:
    """How the indices settle: points per scrambling (k,), estimates and interval half widths by input, (k,) each."""

    points: tuple[int, ...]
    S1: dict[str, tuple[float, ...]]
    ST: dict[str, tuple[float, ...]]
    S1_half_width: dict[str, tuple[float, ...]]
    ST_half_width: dict[str, tuple[float, ...]]


@dataclass(frozen=True)
class SampledResponse:
    """What indices were taken from: `n` base points by `seed`, `evaluations` responses, their `mean` and `std` in
    `unit`."""

    n: int
    evaluations: int
    seed: int
    unit: str
    mean: float
    std: float

    def sample_facts(self) -> dict[str, Any]:
        """These facts as JSON has them, before the indices."""
        return {
            "n": self.n,
            "evaluations": self.evaluations,
            "seed": self.seed,
            f"mean_{self.unit}": self.mean,
            f"std_{self.unit}": self.std,
        }


@dataclass(frozen=True)
class Sobol(SampledResponse):
    """Sobol' indices of a response: by input, by group, and of pairs (`second`)."""

    inputs: dict[str, Index]
    groups: dict[str, Index]
    second: dict[tuple[str, str], IntervalEstimate]
    convergence: Convergence = field(repr=False)
    interval: str = ""
    estimator: str = ""

    def to_dict(self) -> dict[str, Any]:
        return {
            **self.sample_facts(),
            "inputs": {name: index.to_dict() for name, index in self.inputs.items()},
            "groups": {name: index.to_dict() for name, index in self.groups.items()},
            "second_order": [{"inputs": list(pair), **estimate.to_dict()} for pair, estimate in self.second.items()],
            "interval": self.interval,
            "estimator": self.estimator,
        }

    def to_frame(self) -> pd.DataFrame:
        """A pandas table: one row an input or group."""
        import pandas as pd

        rows = [
            (kind, name, i.S1.value, i.S1.low, i.S1.high, i.ST.value, i.ST.low, i.ST.high)
            for kind, indices in (("input", self.inputs), ("group", self.groups))
            for name, i in indices.items()
        ]
        columns = ["kind", "name", "S1", "S1 low", "S1 high", "ST", "ST low", "ST high"]
        return pd.DataFrame(rows, columns=columns).set_index("name")


@dataclass(frozen=True)
class SobolTask:
    """One scrambling of the design."""

    response: Response
    space: InputSpace
    seed: int
    replicate: int
    n: int
    second_order: bool
    blocks: tuple[tuple[int, ...], ...]
    """Columns exchanged together: every input alone, then every group."""


@dataclass(frozen=True)
class SobolReplicate:
    """Indices from one scrambling, for prefixes of its points: shapes (prefixes, blocks); pairs (pairs,)."""

    first: Array
    total: Array
    second: Array
    mean: float
    variance: float


def run_sobol(
    response: Response,
    space: InputSpace,
    *,
    n: int = 2**14,
    seed: int = 1,
    scramblings: int = SCRAMBLINGS,
    second_order: bool = True,
    engine: Engine | str | None = None,
    unit: str = "arcmin",
) -> Sobol:
    """First-order, total and second-order Sobol' indices (Saltelli et al. 2010, as in SALib) of independent inputs.

    `response` is evaluated over `space`, d inputs wide. `n` base points in all, shared by the `scramblings` that `seed`
    gives; n (2 d + 2 + groups) responses with `second_order`, n (d + 2 + groups) without. `engine` computes the
    scramblings, the one in force if None; `unit` names the response's unit. Raises
    `HdoptError` for correlated inputs (their variance does not split: use `run_shapley`) and for too small an `n`.
    """
    if not space.copula.is_independent:
        correlated = ", ".join(name for group in space.correlations for name in group.names)
        raise HdoptError(
            f"Sobol' indices split the variance of independent inputs; {correlated} are correlated: use Shapley"
        )
    check_scramblings(n, scramblings)
    names = space.names
    group_columns = [tuple(space.index(name) for name in members) for members in space.groups.values()]
    blocks = (*((i,) for i in range(len(names))), *group_columns)
    tasks = [
        SobolTask(response, space, seed, replicate, size, second_order, blocks)
        for replicate, size in enumerate(replicate_sizes(n, scramblings))
    ]
    parts = list(engine_from(engine).map(run_sobol_replicate, tasks))
    first, total = np.array([p.first for p in parts]), np.array([p.total for p in parts])
    indices = [Index(over_scramblings(first[:, -1, b]), over_scramblings(total[:, -1, b])) for b in range(len(blocks))]
    pairs = list(combinations(names, 2)) if second_order else []
    means = np.array([p.mean for p in parts])
    variance = float(np.mean([p.variance for p in parts]) + np.var(means))
    per_point = len(blocks) + 2 + (len(names) if second_order else 0)
    return Sobol(
        n=n,
        evaluations=n * per_point,
        seed=seed,
        unit=unit,
        mean=float(means.mean()),
        std=math.sqrt(variance),
        inputs=dict(zip(names, indices, strict=False)),
        groups=dict(zip(space.groups, indices[len(names) :], strict=True)),
        second={pair: over_scramblings([p.second[j] for p in parts]) for j, pair in enumerate(pairs)},
        convergence=_convergence(names, first, total, min(task.n for task in tasks)),
        interval=f"95 %, t over {scramblings} independent scramblings",
        estimator="SALib: Saltelli et al. 2010 (S1, ST), Saltelli 2002 (second order)",
    )


def check_scramblings(n: int, scramblings: int) -> None:
    """Raise `HdoptError` unless `n` points make at least two `scramblings` of 16 points each."""
    if scramblings < 2:
        raise HdoptError(f"{scramblings} scramblings are asked for; an interval needs at least 2, use 8 to 16")
    if n < scramblings * SMALLEST_PER_SCRAMBLING:
        raise HdoptError(
            f"n is {n}, too small for {scramblings} scramblings of at least {SMALLEST_PER_SCRAMBLING} points; "
            f"the smallest n is {scramblings * SMALLEST_PER_SCRAMBLING}"
        )


def _prefixes(n: int) -> list[int]:
    return [max(n >> shift, 2) for shift in (4, 3, 2, 1)] + [n]


def _convergence(names: Sequence[str], first: Array, total: Array, n: int) -> Convergence:
    def by_input(values: Array) -> dict[str, tuple[float, ...]]:
        return {name: tuple(map(float, values[:, i])) for i, name in enumerate(names)}

    def half_widths(values: Array) -> Array:
        quantile = float(special.stdtrit(len(values) - 1, 0.975))
        widths: Array = quantile * values.std(axis=0, ddof=1) / math.sqrt(len(values))
        return widths

    return Convergence(
        tuple(_prefixes(n)),
        by_input(first.mean(axis=0)),
        by_input(total.mean(axis=0)),
        by_input(half_widths(first)),
        by_input(half_widths(total)),
    )


def run_sobol_replicate(task: SobolTask) -> SobolReplicate:
    """Evaluate the scrambling of `task`, an A, B, AB, BA design, and estimate its indices.

    Raises `HdoptError` where the response does not vary, or is not finite.
    """
    space, d = task.space, task.space.dimension
    u = np.concatenate(list(ScrambledSobol().blocks(task.seed, task.replicate, task.n, 2 * d)))
    a, b = space.sample(u[:, :d]), space.sample(u[:, d:])

    def values(inputs: Array, label: str) -> Array:
        where = f"block {label} of scrambling {task.replicate}, seed {task.seed}"
        return evaluate(task.response, inputs, space.names, where)

    def exchanged(base: Array, other: Array, columns: Sequence[int], label: str) -> Array:
        mixed = base.copy(order="F")
        mixed[:, columns] = other[:, columns]
        return values(mixed, label)

    y_a, y_b = values(a, "A"), values(b, "B")
    ab = np.stack([exchanged(a, b, list(block), f"AB{j}") for j, block in enumerate(task.blocks)])
    ba = [exchanged(b, a, [j], f"BA{j}") for j in range(d)] if task.second_order else []
    mean, std = float(np.mean(np.r_[y_a, y_b])), float(np.std(np.r_[y_a, y_b]))
    if std == 0:
        raise HdoptError(f"the response is {mean:g} for every sample; there is no variance to attribute")
    y_a, y_b, ab = (y_a - mean) / std, (y_b - mean) / std, (ab - mean) / std
    prefixes = _prefixes(task.n)
    first, total = np.swapaxes([first_and_total(y_a[:m], y_b[:m], ab[:, :m]) for m in prefixes], 0, 1)
    second = second_order_indices(y_a, y_b, ab[:d], (np.array(ba) - mean) / std) if task.second_order else np.zeros(0)
    return SobolReplicate(first, total, second, mean, std * std)


def first_and_total(y_a: Array, y_b: Array, y_ab: Array) -> tuple[Array, Array]:
    """First-order and total indices (Saltelli et al. 2010) as SALib estimates them, for all blocks at once.

    `y_a`, `y_b` of shape (n,); `y_ab` of shape (blocks, n): responses at A with each block's columns from B.
    """
    variance = np.var(np.concatenate([y_a, y_b]))
    first = (y_ab - y_a) @ y_b / len(y_a) / variance
    total = np.square(y_ab - y_a).mean(axis=1) / 2 / variance
    return first, total


def second_order_indices(y_a: Array, y_b: Array, y_ab: Array, y_ba: Array) -> Array:
    """Second-order indices (Saltelli 2002) of all pairs as SALib estimates them, in the order of `combinations`.

    `y_a`, `y_b` (n,) are the responses at A and B; `y_ab`, `y_ba` (d, n) those at A with one column from B, and at B
    with one column from A. `run_sobol_replicate` standardizes the responses first, as SALib does.
    """
    variance, n = np.var(np.concatenate([y_a, y_b])), len(y_a)
    first = first_and_total(y_a, y_b, y_ab)[0]
    closed = (y_ba @ y_ab.T / n - y_a @ y_b / n) / variance
    pairs = np.triu_indices(len(y_ab), 1)
    indices: Array = (closed - first[:, None] - first)[pairs]
    return indices


@dataclass(frozen=True)
class Shapley(SampledResponse):
    """Shapley effects of the players (inputs or groups): shares of the variance that sum to 1, correlated or not.

    `indices` hold each player's S1 (variance of the mean given it) and ST (variance left when all others are known).
    """

    effects: dict[str, IntervalEstimate]
    indices: dict[str, Index]
    interval: str = ""

    def to_dict(self) -> dict[str, Any]:
        return {
            **self.sample_facts(),
            "shapley": {name: effect.to_dict() for name, effect in self.effects.items()},
            "inputs": {name: index.to_dict() for name, index in self.indices.items()},
            "interval": self.interval,
            "estimator": "all subsets, pick-freeze with exact conditional sampling of the Gaussian copula",
        }

    def to_frame(self) -> pd.DataFrame:
        """A pandas table: one row a player."""
        import pandas as pd

        rows = [(name, e.value, e.low, e.high) for name, e in self.effects.items()]
        return pd.DataFrame(rows, columns=["player", "Shapley effect", "low", "high"]).set_index("player")


@dataclass(frozen=True)
class ShapleyTask:
    """One scrambling of the Shapley design; `players` are the columns each player moves."""

    response: Response
    space: InputSpace
    seed: int
    replicate: int
    n: int
    players: tuple[tuple[int, ...], ...]


def run_shapley(
    response: Response,
    space: InputSpace,
    *,
    players: Mapping[str, Sequence[str]] | None = None,
    n: int = 2**14,
    seed: int = 1,
    scramblings: int = SCRAMBLINGS,
    engine: Engine | str | None = None,
    unit: str = "arcmin",
) -> Shapley:
    """Shapley effects (Owen 2014; Song, Nelson and Staum 2016) of `players`, by default every input of `space`.

    `response` is evaluated on `n` points in all, shared by the `scramblings` that `seed` gives, `engine` computes them
    (the one in force if None), and `unit` names the response's unit.
    For every subset J, E[Var(Y | X_-J)] = E (Y - Y')^2/2, where Y' shares X_-J and draws X_J anew from its exact
    conditional distribution. 2^players n responses. Raises `HdoptError` for more than 12 players.
    """
    players = players or {name: (name,) for name in space.names}
    for name in (name for members in players.values() for name in members):
        if name not in space.names:
            raise HdoptError(unknown_name("input", name, space.names))
    if len(players) > MAX_PLAYERS:
        raise HdoptError(
            f"{len(players)} players have {2 ** len(players)} subsets; at most {MAX_PLAYERS} are allowed: put inputs "
            "that belong together into groups"
        )
    check_scramblings(n, scramblings)
    columns = tuple(tuple(space.index(name) for name in members) for members in players.values())
    tasks = [
        ShapleyTask(response, space, seed, replicate, size, columns)
        for replicate, size in enumerate(replicate_sizes(n, scramblings))
    ]
    parts = list(engine_from(engine).map(run_shapley_replicate, tasks))
    effects, first, total = (np.array([getattr(p, name) for p in parts]) for name in ("effects", "first", "total"))
    means = np.array([p.mean for p in parts])
    return Shapley(
        n=n,
        evaluations=n * 2 ** len(players),
        seed=seed,
        unit=unit,
        mean=float(means.mean()),
        std=math.sqrt(float(np.mean([p.variance for p in parts]) + np.var(means))),
        effects={name: over_scramblings(effects[:, i]) for i, name in enumerate(players)},
        indices={
            name: Index(over_scramblings(first[:, i]), over_scramblings(total[:, i])) for i, name in enumerate(players)
        },
        interval=f"95 %, t over {scramblings} independent scramblings",
    )


@dataclass(frozen=True)
class ShapleyReplicate:
    """Shapley effects, first-order and total indices of the players from one scrambling, shape (players,)."""

    effects: Array
    first: Array
    total: Array
    mean: float
    variance: float


def run_shapley_replicate(task: ShapleyTask) -> ShapleyReplicate:
    """Go through all subsets of the players with the one scrambling of `task`.

    Raises `HdoptError` where the response does not vary, or is not finite.
    """
    space, d, count = task.space, task.space.dimension, len(task.players)
    u = np.concatenate(list(ScrambledSobol().blocks(task.seed, task.replicate, task.n, 2 * d)))
    noise = special.ndtri(u[:, d:])
    scores = space.copula.condition((), np.zeros((task.n, d)), special.ndtri(u[:, :d]))

    def values(at: Array, label: str) -> Array:
        where = f"{label} of scrambling {task.replicate}, seed {task.seed}"
        return evaluate(task.response, space.from_scores(at), space.names, where)

    y = values(scores, "the sample")
    mean, variance = float(y.mean()), float(y.var())
    if variance == 0:
        raise HdoptError(f"the response is {mean:g} for every sample; there is no variance to attribute")
    moved = {column for player in task.players for column in player}
    left = np.zeros(2**count)  # E[Var(Y | all but the players in the subset)], by the subset's bits
    for subset in range(1, 2**count):
        drawn = {c for i, player in enumerate(task.players) if subset >> i & 1 for c in player}
        if drawn == moved and len(moved) == d:
            left[subset] = variance
            continue
        given = [column for column in range(d) if column not in drawn]
        left[subset] = float(
            np.mean((y - values(space.copula.condition(given, scores, noise), f"subset {subset}")) ** 2) / 2
        )
    whole = left[-1]
    effects = np.zeros(count)
    for subset in range(2**count):
        size = bin(subset).count("1")
        for i in range(count):
            if not subset >> i & 1:
                weight = 1 / (count * math.comb(count - 1, size))
                effects[i] += weight * (left[subset | 1 << i] - left[subset])
    full = 2**count - 1
    first = np.array([whole - left[full ^ (1 << i)] for i in range(count)])
    total = np.array([left[1 << i] for i in range(count)])
    return ShapleyReplicate(effects / whole, first / whole, total / whole, mean, variance)
