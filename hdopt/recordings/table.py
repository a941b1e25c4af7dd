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
    its own clock `time_s` (n,) where the file gives it one."""

    values: NDArray[Any]
    unit: str = ""
    time_s: Array | None = None


@dataclass(frozen=True)
class Table:
    """The channels of one file by their name or path, and what was noticed on reading it, a sentence each; `others` are
    names of columns that were left unread."""

    channels: Mapping[str, Channel]
    notes: tuple[str, ...] = field(default=())
    others: tuple[str, ...] = field(default=())

    @property
    def rows(self) -> int:
        """Rows of the longest channel."""
        return max((len(channel.values) for channel in self.channels.values()), default=0)
