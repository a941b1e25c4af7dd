"""The samples as recorded behind the rows that a compensation is fitted to.

Of long recordings the mean of a few samples makes a row: a fit loses nothing by that, but the noise of a mean is less
than that of a sample. A controller subtracts from samples, and a peak-to-peak is one of samples: what is left is judged
on them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdopt.arrays import Array, Index, Mask
from hdopt.recordings.recording import Recording
from hdopt.recordings.rows import Rows, gather, row_of_each_sample


@dataclass(frozen=True)
class Samples:
    """Samples in the order recorded: `each` (N) holds one a row, with the speed and the turn of the row that it went
    into, and `row` (N,) numbers that, from 0."""

    each: Rows
    row: Index

    def means(self, values: Array) -> Array:
        """The mean over each row (n,) of `values` (N,) of the samples."""
        return np.asarray(np.bincount(self.row, values) / np.bincount(self.row), float)

    def of_rows(self, some: Mask) -> Samples:
        """Those that went into `some` of the rows (n,), recordings and rows numbered anew."""
        mine = some[self.row]
        part = self.each.rows(mine)
        part = replace(part, record=np.unique(part.record, return_inverse=True)[1])
        return Samples(part, (np.cumsum(some) - 1)[self.row[mine]])

    def with_error(self, error: Array) -> Samples:
        """The same with another `error` (N,), arcmin."""
        return replace(self, each=replace(self.each, error=error))


def samples_of(recordings: Sequence[Recording], rows: Rows, neighbours: int) -> Samples:
    """The samples of `recordings`, of which `rows` are the means of so many `neighbours`.

    The speed is that of the rows: over a few samples it would be an encoder's steps and the clock's jitter.
    """
    if neighbours == 1:
        return Samples(rows, np.arange(len(rows)))
    row = row_of_each_sample(recordings, neighbours)
    speed = None if rows.speed is None else rows.speed[row]
    return Samples(replace(gather(recordings), speed=speed, block=rows.block[row]), row)
