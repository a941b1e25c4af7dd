"""Point sets of the unit cube in independent replicates: scrambled Sobol' points, or plain Monte Carlo.

A replicate's numbers depend on the seed and its own index alone, so any number of workers gives the same sample.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from hdopt.arrays import Array, Bits
from hdopt.errors import HdoptError

if TYPE_CHECKING:
    from scipy.stats import qmc

BLOCK = 2**16
"""Points made at a time: 12 inputs of them fit in 6 MB, so that the sample's size does not bound memory."""

MAX_SOBOL_DIMENSION = 21201
"""Dimensions that scipy's direction numbers (Joe and Kuo) serve."""

SOBOL_BITS = 30


class Sampling(Protocol):
    """A way to draw points: `replicates` independent streams, and whether the points of one are independent."""

    @property
    def name(self) -> str: ...

    @property
    def replicates(self) -> int: ...

    @property
    def independent_points(self) -> bool: ...

    def blocks(self, seed: int, replicate: int, n: int, dimension: int, start: int = 0) -> Iterator[Array]:
        """Points `start` to `n` of one replicate in blocks of shape (at most BLOCK, dimension), inside (0, 1).

        They are the same whether a replicate is made in one go or from several starts, multiples of BLOCK."""


def replicate_generator(seed: int, replicate: int) -> np.random.Generator:
    """The random numbers of one replicate; every seed counts, 0 included."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(replicate,)))


def replicate_sizes(n: int, replicates: int) -> list[int]:
    """`n` points shared out over the replicates, as evenly as whole numbers allow."""
    return [n // replicates + (index < n % replicates) for index in range(replicates)]


class Scrambling(NamedTuple):
    """One scrambling of Sobol' points: its digital `shift` (d,) and direction `numbers` (d, SOBOL_BITS)."""

    shift: Bits
    numbers: Bits


@dataclass(frozen=True)
class ScrambledSobol:
    """Independent scramblings of Sobol' points (scipy.stats.qmc: linear matrix scramble and digital shift).

    Each point is uniform, so every size is unbiased; powers of two per scrambling are the most even. The spread between
    scramblings gives the interval: points of one scrambling are not independent.
    """

    replicates: int = 16
    name: str = "scrambled Sobol' points"
    independent_points = False

    def scrambling(self, seed: int, replicate: int, n: int, dimension: int) -> Scrambling:
        """What makes the first `n` points of `blocks` in `dimension` inputs, for `replicate` under `seed`.

        scipy has no public way to it; a test holds the points made of it to those of `blocks`. Raises `HdoptError`
        where there are fewer points than `n`.
        """
        engine = self._engine(seed, replicate, n, dimension)
        return Scrambling(engine._shift, engine._sv)  # type: ignore[attr-defined]  # not public

    def _engine(self, seed: int, replicate: int, n: int, dimension: int) -> qmc.Sobol:
        from scipy.stats import qmc

        if n > 2**SOBOL_BITS:
            raise HdoptError(
                f"{n} points a scrambling are asked for; Sobol' points of {SOBOL_BITS} bits end at {2**SOBOL_BITS}; "
                "use more scramblings or plain Monte Carlo"
            )
        return qmc.Sobol(dimension, scramble=True, bits=SOBOL_BITS, rng=replicate_generator(seed, replicate))

    def blocks(self, seed: int, replicate: int, n: int, dimension: int, start: int = 0) -> Iterator[Array]:
        engine = self._engine(seed, replicate, n, dimension)
        half_step = 0.5**SOBOL_BITS / 2  # the points lie on a grid that holds 0: move them to the middle of its cells
        if start:
            engine.fast_forward(start)
        for first in range(start, n, BLOCK):
            size = min(BLOCK, n - first)
            # a first draw that is no power of two makes scipy warn: round it up and leave the rest unused
            points = engine.random(size if first else 1 << (size - 1).bit_length())[:size]
            points += half_step
            yield points


@dataclass(frozen=True)
class PlainMonteCarlo:
    """Independent points, in streams so that workers can share them."""

    replicates: int = 16
    name: str = "plain Monte Carlo"
    independent_points = True

    def blocks(self, seed: int, replicate: int, n: int, dimension: int, start: int = 0) -> Iterator[Array]:
        rng = replicate_generator(seed, replicate)
        if start:
            rng.bit_generator.advance(start * dimension)  # type: ignore[attr-defined]  # PCG64's: one step a number
        for first in range(start, n, BLOCK):
            points = rng.random((min(BLOCK, n - first), dimension))
            yield np.maximum(points, 2.0**-54, out=points)  # (0, 1) instead of [0, 1)


SAMPLINGS: dict[str, type] = {"sobol": ScrambledSobol, "monte-carlo": PlainMonteCarlo}
"""The samplings by the name a command uses."""
