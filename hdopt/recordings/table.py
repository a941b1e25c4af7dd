"""A table of named channels as a file holds it, before anything is understood: values, unit and clock of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any  # Any: arrays of numbers and of text, as the file's format has them

from numpy.typing import NDArray

from hdopt.arrays import Array


@dataclass(frozen=True)
class Channel:
    """One channel of a file: `values` (n,) of any type, the `unit` that the file states ('' where it states none), and
    its own clock `time_s` (n,) where the file gives it one.

    `said` are sentences on values that were not plain; `unsure` why they can be read in two ways, '' where they cannot.
    """

    values: NDArray[Any]
    unit: str = ""
    time_s: Array | None = None
    said: tuple[str, ...] = field(default=())
    unsure: str = ""


@dataclass(frozen=True)
class Table:
    """The channels of one file by their name or path, and what was noticed on reading it, a sentence each, `doubts` for
    what was lost; `others` are names of columns that were left unread."""

    channels: Mapping[str, Channel]
    notes: tuple[str, ...] = field(default=())
    others: tuple[str, ...] = field(default=())
    doubts: tuple[str, ...] = field(default=())

    @property
    def rows(self) -> int:
        """Rows of the longest channel."""
        return max((len(channel.values) for channel in self.channels.values()), default=0)


MOST_COLUMNS = 64
"""Columns of an array that become channels; one with more is no table of samples."""


def columns_of(name: str, values: NDArray[Any]) -> list[tuple[str, NDArray[Any]]]:
    """The channels that an array of `values` called `name` holds, with their names: itself where it has one dimension
    longer than 1, as column vectors of MATLAB have; 'name[0]', 'name[1]' ... along the shorter of two, whichever way it
    was written; none where there are more."""
    long = [size for size in values.shape if size > 1]
    if len(long) == 1:
        return [(name, values.ravel())]
    if len(long) != 2 or min(long) > MOST_COLUMNS:
        return []
    table = values.reshape(long)
    rows = table if table.shape[0] <= table.shape[1] else table.T
    return [(f"{name}[{place}]", row) for place, row in enumerate(rows)]
