"""What is kept of a sample's responses: all values, or counts in fine bins where there are too many to keep."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Protocol, Self

import numpy as np

from hdopt.arrays import Array, Index

BINS = 2**18
"""Bins of a streamed sample; one is about the pilot's range / 87000 wide."""


class Empirical(Protocol):
    """An empirical distribution of `n` values."""

    @property
    def n(self) -> int: ...

    def ranked(self, rank: int) -> float:
        """The value of this rank, counted from 1."""

    def at_most(self, x: float) -> int:
        """How many values are at most x."""

    def histogram(self, bins: int) -> tuple[Array, Array]:
        """Edges (bins + 1,) and counts (bins,) of equal bins over the range of the values."""

    def joined(self, others: Sequence[Self]) -> Self:
        """All values of this distribution and of `others`, which are of the same kind."""


class Collector(Protocol):
    """Takes values block by block, then gives their empirical distribution."""

    def add(self, values: Array) -> None: ...

    def finish(self) -> Empirical: ...


@dataclass(frozen=True)
class SortedValues:
    """Every value, sorted."""

    values: Array = field(repr=False)

    @property
    def n(self) -> int:
        return len(self.values)

    def ranked(self, rank: int) -> float:
        return float(self.values[rank - 1])

    def at_most(self, x: float) -> int:
        return int(np.searchsorted(self.values, x, side="right"))

    def histogram(self, bins: int) -> tuple[Array, Array]:
        edges = np.linspace(self.values[0], self.values[-1], bins + 1)
        return edges, np.histogram(self.values, edges)[0]

    def joined(self, others: Sequence[SortedValues]) -> SortedValues:
        return SortedValues(np.sort(np.concatenate([self.values, *(part.values for part in others)]), kind="stable"))


@dataclass(frozen=True)
class Bins:
    """Equal bins from `low`, each `width` wide."""

    low: float
    width: float
    count: int = BINS

    @classmethod
    def around(cls, pilot: Array) -> Bins:
        """Bins well past both ends of a pilot sample."""
        span = max(float(np.ptp(pilot)), 1e-9 * max(1.0, float(np.max(np.abs(pilot)))))
        return cls(float(np.min(pilot)) - span / 2, 3 * span / BINS)


@dataclass(frozen=True)
class BinnedValues:
    """Counts in bins, and exactly the few values beyond them on either side. A ranked value is right to one bin."""

    bins: Bins
    counts: Index = field(repr=False)
    below: Array = field(repr=False)
    above: Array = field(repr=False)

    @property
    def n(self) -> int:
        return int(self.counts.sum()) + len(self.below) + len(self.above)

    def ranked(self, rank: int) -> float:
        if rank <= len(self.below):
            return float(self.below[rank - 1])
        rank -= len(self.below)
        cumulative = np.cumsum(self.counts)
        if rank > cumulative[-1]:
            return float(self.above[rank - int(cumulative[-1]) - 1])
        index = int(np.searchsorted(cumulative, rank))
        before = cumulative[index] - self.counts[index]
        return float(self.bins.low + self.bins.width * (index + (rank - before - 0.5) / self.counts[index]))

    def at_most(self, x: float) -> int:
        if x < self.bins.low:
            return int(np.searchsorted(self.below, x, side="right"))
        position = (x - self.bins.low) / self.bins.width
        whole = min(int(position), self.bins.count)
        count = len(self.below) + int(self.counts[:whole].sum())
        if whole < self.bins.count:
            return count + int(self.counts[whole] * (position - whole))
        return count + int(np.searchsorted(self.above, x, side="right"))

    def histogram(self, bins: int) -> tuple[Array, Array]:
        filled = np.flatnonzero(self.counts)
        edges = np.linspace(
            self.bins.low + self.bins.width * filled[0], self.bins.low + self.bins.width * (filled[-1] + 1), bins + 1
        )
        centres = self.bins.low + self.bins.width * (np.arange(self.bins.count) + 0.5)
        return edges, np.histogram(centres, edges, weights=self.counts)[0]

    def joined(self, others: Sequence[BinnedValues]) -> BinnedValues:
        parts = [self, *others]
        return BinnedValues(
            self.bins,
            np.sum([part.counts for part in parts], axis=0),
            np.sort(np.concatenate([part.below for part in parts])),
            np.sort(np.concatenate([part.above for part in parts])),
        )


class KeepAll:
    """Collects every value."""

    def __init__(self) -> None:
        self._blocks: list[Array] = []

    def add(self, values: Array) -> None:
        self._blocks.append(values)

    def finish(self) -> SortedValues:
        return SortedValues(np.sort(np.concatenate(self._blocks)))


class CountInBins:
    """Counts values in bins; memory does not grow with their number."""

    def __init__(self, bins: Bins) -> None:
        self._bins = bins
        self._counts = np.zeros(bins.count, np.int64)
        self._below: list[Array] = []
        self._above: list[Array] = []

    def add(self, values: Array) -> None:
        from hdopt.tolerance.count_kernel import count_in_bins

        low, width = self._bins.low, self._bins.width
        if count_in_bins(values, low, width, self._counts) < len(values):
            index = np.floor((values - low) / width)
            self._below.append(values[index < 0])
            self._above.append(values[index >= self._bins.count])

    def finish(self) -> BinnedValues:
        return BinnedValues(self._bins, self._counts, _sorted(self._below), _sorted(self._above))


def _sorted(blocks: Sequence[Array]) -> Array:
    return np.sort(np.concatenate([np.empty(0), *blocks]))


def merge(parts: Iterable[Empirical]) -> Empirical:
    """The values of all `parts` together; they are of one kind and there is at least one."""
    first, *others = parts
    return first.joined(others)
