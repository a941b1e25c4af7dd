"""Recordings given twice: what repeats itself exactly is no second measurement, and nothing may be judged by it."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Sequence

import numpy as np

from hdopt.arrays import Index
from hdopt.errors import HdoptError
from hdopt.recordings.recording import Recording

FIRST_ROWS = 16
"""Rows of the shorter recording that are looked for in the longer one before all of them are compared."""
SAME_CLOCK = 1e-3
"""Share of a usual sample interval by which two clocks may differ from row to row and be one: digits of a file."""


def refuse_repeats(recordings: Sequence[Recording]) -> None:
    """Raise `HdoptError` where two of the `recordings` hold the same rows, or all rows of one are rows of another.

    Names and clocks' zeros do not count: a copy under another name, or with times from another zero, is the same.
    """
    for (one, first), (two, second) in itertools.combinations(enumerate(recordings, start=1), 2):
        short, long = sorted((first, second), key=len)
        place = place_in(short, long)
        if place is None:
            continue
        both = f"{first.name} and {second.name} (recordings {one} and {two})"
        how = f"{both} hold the same rows"
        if len(short) < len(long):
            how = f"{both}: the shorter is rows {place + 1} to {place + len(short)} of the longer"
        raise HdoptError(f"{how}: what was measured once would count twice; leave one of them out, or record once more")


def place_in(short: Recording, long: Recording) -> int | None:
    """The row of `long` from which on its rows are those of `short`, which has no more; None where they are not.

    Compared are input angle, error, torque and temperature, bit by bit, and the steps of the clock. Where a channel was
    recorded in one of them alone, the others decide.
    """
    rows = len(short)
    starts: Index = np.arange(len(long) - rows + 1)
    channels = [(short.input_angle, long.input_angle), (short.error_arcmin, long.error_arcmin)]
    channels += [
        (here, there)
        for here, there in ((short.torque, long.torque), (short.temperature, long.temperature))
        if here is not None and there is not None
    ]
    for row, (here, there) in itertools.product(range(min(rows, FIRST_ROWS)), channels):
        starts = starts[there[starts + row] == here[row]]
    for start in starts.tolist():
        same = all(np.array_equal(here, there[start : start + rows]) for here, there in channels)
        if same and _same_clock(short, long, start):
            return int(start)
    return None


def _same_clock(short: Recording, long: Recording, start: int) -> bool:
    """Whether the clock of `short` steps as that of `long` does from row `start` on; True without two clocks."""
    if short.time is None or long.time is None or len(short) < 2:
        return True
    here, there = np.diff(short.time), np.diff(long.time[start : start + len(short)])
    return bool(np.abs(here - there).max() <= SAME_CLOCK * float(np.median(np.abs(there))))


def fingerprint(recording: Recording) -> str:
    """What a `recording` shares with one of the same rows: a digest of input angle, error, torque and temperature."""
    digest = hashlib.sha256()
    for channel in (recording.input_angle, recording.error_arcmin, recording.torque, recording.temperature):
        digest.update(b"none" if channel is None else np.ascontiguousarray(channel).tobytes())
    return digest.hexdigest()
