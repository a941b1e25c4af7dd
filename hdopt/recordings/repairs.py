"""Repairs of a recording's rows and angles: each fault is found, then repaired with a warning, or refused.

A repair never invents data: rows are dropped, angles unwrapped, whole turns put back across a gap.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NoReturn  # Any: indices and masks alike

import numpy as np
from numpy.typing import NDArray

from hdopt.arrays import Array, Index
from hdopt.drive.geometry import ARCMIN
from hdopt.errors import HdoptError
from hdopt.recordings.recording import TURN
from hdopt.words import counted

LARGEST_LOSS = 0.5
"""Refuse a file that loses more than this share of its rows."""
GAP_FACTOR = 4.0
"""A step longer than this many typical ones is a gap."""
RESTART_ROWS = 20
"""So many rows in succession, all earlier than the middle one of as many before them, are a clock that starts anew."""
MOST_JUMPS = 500
"""Backward steps of the clock that are looked at one by one."""


class Checks:
    """The channels of one recording on their way through the checks, with the warnings collected."""

    def __init__(self, channels: Mapping[str, Array], ratio: float, name: str) -> None:
        self.channels = dict(channels)
        self.ratio = ratio
        self.name = name
        self.warnings: list[str] = []
        self.said: list[str] = []
        self.rows_read = len(next(iter(channels.values())))

    def warn(self, text: str) -> None:
        self.warnings.append(f"{self.name}: {text}")

    def say(self, text: str) -> None:
        """Something that was understood, which asks nothing of anybody."""
        self.said.append(text)

    def refuse(self, text: str) -> NoReturn:
        raise HdoptError(f"{self.name}: {text}")

    def keep(self, rows: NDArray[Any]) -> None:
        self.channels = {key: values[rows] for key, values in self.channels.items()}

    def __len__(self) -> int:
        return len(next(iter(self.channels.values())))

    def get(self, channel: str) -> Array | None:
        return self.channels.get(channel)


def error_arcmin(checks: Checks) -> Array:
    """KE = input/N - output in arcmin, or the error as it was recorded.

    `checks` holds the rows so far.
    """
    if "error" in checks.channels:
        return checks.channels["error"] / ARCMIN
    return (checks.channels["input"] / checks.ratio - checks.channels["output"]) / ARCMIN


def drop_empty_channels(checks: Checks) -> None:
    """An optional channel without any number is no channel.

    `checks` holds the rows so far, and is changed in place.
    """
    for channel in ("time", "torque", "temperature"):
        values = checks.get(channel)
        if values is not None and not np.isfinite(values).any():
            checks.warn(f"the {channel} column holds no numbers and is left out")
            del checks.channels[channel]


def drop_incomplete_rows(checks: Checks) -> None:
    """Rows with a NaN, an infinity or text where a number is due.

    `checks` holds the rows so far, and is changed in place.
    """
    for channel in ("torque", "temperature"):
        values = checks.get(channel)
        if values is not None and 0 < (~np.isfinite(values)).mean() <= 0.9:
            # A slow channel is often logged at a lower rate than the angles: interpolate it instead of losing the rows.
            good = np.isfinite(values)
            if good.mean() < 0.9:
                index = np.arange(len(values))
                checks.channels[channel] = np.interp(index, index[good], values[good])
                checks.warn(f"{channel} is given in {good.mean():.0%} of the rows and interpolated between them")
    good = np.all([np.isfinite(values) for values in checks.channels.values()], axis=0)
    lost = int((~good).sum())
    if lost:
        first = int(good.argmin()) + 1
        checks.keep(good)
        checks.warn(f"{counted(lost, 'row')} with missing values dropped, the first row {first} of the numbers")
    if lost > LARGEST_LOSS * checks.rows_read:
        checks.refuse(f"{lost} of {checks.rows_read} rows hold missing values; more than half is lost")


def order_rows_in_time(checks: Checks) -> None:
    """Rows out of order are sorted where few; a clock that keeps running backward is refused.

    `checks` holds the rows so far, and is changed in place.
    """
    time = checks.get("time")
    if time is None or len(time) < 2:
        return
    backward = np.diff(time) < 0
    if not backward.any():
        return
    share = backward.mean()
    if share > 0.5:
        checks.refuse("time runs backward through most of the file; reverse the rows, or map time=NAME:-s")
    if share > 0.02:
        checks.refuse(
            f"time runs backward at {int(backward.sum())} of {len(time)} rows; recordings may have been joined: "
            "split the file, or leave time out of --columns"
        )
    # A restarted clock: many rows after the jump repeat times from before it. After a stamp that is swapped with a far
    # one, all rows are earlier than that stamp, but not than those before it.
    for jump in np.flatnonzero(backward)[:MOST_JUMPS]:
        before = float(np.median(time[max(jump + 1 - RESTART_ROWS, 0) : jump + 1]))
        following = time[jump + 1 : jump + 1 + RESTART_ROWS]
        if len(following) == RESTART_ROWS and (following <= before).all():
            checks.refuse(
                f"the clock starts anew at row {int(jump) + 2}; the file joins several recordings: split it there"
            )
    order = np.argsort(time, kind="stable")
    if _travel(checks, np.arange(len(time))) < _travel(checks, order):
        checks.channels["time"] = time[order]
        stamps = counted(int(backward.sum()), "time stamp was", "time stamps were")
        checks.warn(f"{stamps} out of order, the angles were not: the stamps were sorted")
        return
    checks.keep(order)
    rows = counted(int(backward.sum()), "row was", "rows were")
    checks.warn(f"{rows} out of order in time; sorted")


def _travel(checks: Checks, order: NDArray[Any]) -> float:
    """How far the angles move in all where the rows stand in `order` (n,)."""
    angles = (checks.get(channel) for channel in ("input", "output"))
    return sum(float(np.abs(np.diff(angle[order])).sum()) for angle in angles if angle is not None)


def drop_repeated_rows(checks: Checks) -> None:
    """A row whose time equals the one before it was written twice.

    `checks` holds the rows so far, and is changed in place.
    """
    time = checks.get("time")
    if time is None or len(time) < 2:
        return
    same = np.r_[False, np.diff(time) == 0]
    if same.any():
        if same.mean() > LARGEST_LOSS:
            checks.refuse(
                f"{int(same.sum())} of {len(time)} rows repeat the time of the row before; "
                "time is too coarse: write it with more digits, or leave it out of --columns"
            )
        checks.keep(~same)
        checks.warn(f"{counted(int(same.sum()), 'repeated row')} dropped")


def lock_missing_input(checks: Checks) -> None:
    """Without an input channel the input was locked: only torque moved.

    `checks` holds the rows so far, and is changed in place.
    """
    if "input" in checks.channels:
        if np.ptp(checks.channels["input"]) == 0 and checks.get("torque") is None:
            checks.refuse("the input angle never changes and no torque was recorded; there is nothing to explain")
        return
    if checks.get("torque") is None:
        checks.refuse("no input angle was recorded; map one with --columns input=NAME:UNIT")
    checks.channels["input"] = np.zeros(len(checks))


def unwrap_angles(checks: Checks) -> None:
    """Angles that jump back by a whole turn, or by the range of a counter, are counted on.

    `checks` holds the rows so far, and is changed in place.
    """
    for channel in ("input", "output"):
        angle = checks.get(channel)
        if angle is None or len(angle) < 3:
            continue
        if np.ptp(angle) > 1.02 * TURN:
            unwrap_counter(checks, channel, angle)
            continue
        steps = np.diff(angle)
        jumps = np.abs(steps) > 0.5 * TURN
        if not jumps.any():
            continue
        typical = np.median(np.abs(steps[~jumps])) if (~jumps).any() else TURN
        if jumps.mean() > 0.4 or typical > 0.3 * TURN:
            checks.refuse(
                f"the {channel} angle is wrapped to one turn and moves about {typical / TURN:.2g} turns a sample; "
                "the turns cannot be counted: sample faster, or record it unwrapped"
            )
        checks.channels[channel] = np.unwrap(angle, period=TURN)
        places = counted(int(jumps.sum()), "place")
        checks.warn(f"the {channel} angle was wrapped to one turn and has been unwrapped at {places}")


def unwrap_counter(checks: Checks, channel: str, angle: Array) -> None:
    """A counter of several whole turns that overflows: equal jumps over its whole range, a whole number of turns.

    `channel` of `checks` has the readings `angle`, (n,) rad.
    """
    steps = np.diff(angle)
    jumps = np.abs(steps) > 0.9 * np.ptp(angle)
    if not jumps.any() or (np.abs(steps[~jumps]) > 0.25 * np.ptp(angle)).any():
        return
    turns = round((float(np.median(np.abs(steps[jumps]))) + float(np.median(np.abs(steps[~jumps])))) / TURN)
    if turns < 2 or np.abs(np.abs(steps[jumps]) / TURN - turns).max() > 0.3:
        return
    checks.channels[channel] = np.unwrap(angle, period=turns * TURN)
    checks.warn(
        f"the {channel}'s counter runs over after {counted(turns, 'turn')}; it has been counted on at "
        f"{counted(int(jumps.sum()), 'place')}"
    )


def find_gaps(checks: Checks) -> Index:
    """Segment number of each row: it counts up where time (or, without time, the input) jumps.

    `checks` holds the rows so far, and is changed in place.
    """
    time, angle = checks.get("time"), checks.channels["input"]
    steps = np.diff(time) if time is not None else np.abs(np.diff(angle))
    typical = np.median(steps[steps > 0]) if (steps > 0).any() else 0.0
    gaps = steps > GAP_FACTOR * typical if typical > 0 else np.zeros(len(steps), bool)
    if time is None:
        # A speed that varies is no gap: only steps far from their neighbours count.
        gaps &= steps > 0.02 * TURN
    if gaps.any():
        lost = float(steps[gaps].sum())
        what = f"{lost:.3g} s" if time is not None else counted(f"{lost / TURN:.3g}", "input turn")
        checks.warn(f"{counted(int(gaps.sum()), 'gap')} ({what} missing in all); the parts are kept apart")
    return np.asarray(np.r_[0, np.cumsum(gaps)], np.int64)


def restore_whole_turns(checks: Checks, segment: Index) -> None:
    """Whole turns lost in a gap of a wrapped angle are put back: the error must not jump by a whole turn.

    `checks` holds the rows, `segment` (n,) their parts.
    """
    if "output" not in checks.channels or segment[-1] == 0:
        return
    angle, output = checks.channels["input"], checks.channels["output"]
    starts = np.flatnonzero(np.diff(segment)) + 1
    jump = (angle[starts] - angle[starts - 1]) - checks.ratio * (output[starts] - output[starts - 1])
    turns = np.round(jump / TURN)
    turns[np.abs(jump - turns * TURN) >= 0.2 * TURN] = 0
    if turns.any():
        lost = np.zeros(len(angle))
        lost[starts] = turns * TURN
        checks.channels["input"] = angle - np.cumsum(lost)
        checks.warn(f"whole input turns lost in {counted(int((turns != 0).sum()), 'gap')} have been put back")


def drop_outliers(checks: Checks, segment: Index) -> Index:
    """Single samples far from their neighbours, forward and back at once, are read-out faults.

    `checks` holds the rows, `segment` (n,) their parts; returns the segments that stay.
    """
    error = error_arcmin(checks)
    if len(error) < 20:
        return segment
    from scipy.ndimage import median_filter

    off = np.abs(error - median_filter(error, size=7, mode="nearest"))
    scale = 1.4826 * np.median(off) + 1e-12
    spikes = off > max(25 * scale, 1.0)
    if 0 < spikes.mean() <= 0.02:
        checks.keep(~spikes)
        samples = counted(int(spikes.sum()), "sample")
        checks.warn(f"{samples} far from their neighbours (backward jumps, read-out faults) dropped")
        kept: Index = segment[~spikes]
        return kept
    return segment
