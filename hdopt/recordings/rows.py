"""Recordings of one drive, gathered into the rows that the diagnosis works on.

Of long recordings a few neighbouring samples are averaged into a row, always equally many, so that a sine is dimmed
evenly and not modulated. The rows hold every order up to a third of their number a turn, which is where all effects
but tooth mesh and encoder interpolation live. Those two are looked for on the rows as recorded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any  # Any: indices and masks alike; columns of several kinds

import numpy as np
from numpy.typing import NDArray

from hdopt.arrays import Array, Index
from hdopt.effects.conditions import Conditions
from hdopt.recordings.passes import Passes, find_passes
from hdopt.recordings.recording import TURN, Recording

MOST_ROWS = 10_000
FEWEST_ROWS_PER_TURN = 64


def neighbours_for(recordings: Sequence[Recording]) -> int:
    """How many neighbouring samples to average: as few as keep the rows at 10 000 or so, and 64 of them a turn.

    `recordings` of one drive.
    """
    rows = sum(len(recording) for recording in recordings)
    turns = sum(recorded_turns(recording) for recording in recordings)
    return max(1, min(round(rows / MOST_ROWS), int(rows / max(turns, 1.0) / FEWEST_ROWS_PER_TURN)))


def recorded_turns(recording: Recording) -> float:
    """Input turns, to and fro, of which `recording` has samples: what it passed over at a gap has none."""
    moved = np.abs(np.diff(recording.input_angle))
    if recording.segment is not None:
        moved = moved[np.diff(recording.segment) == 0]
    return float(moved.sum()) / TURN


@dataclass(frozen=True, kw_only=True)
class Rows(Conditions):
    """Rows of all recordings together: their conditions, and the error beside them; every array has shape (n,).

    `error` KE (arcmin), `block` whole input turns, `weight` samples behind a row relative to the usual; `quantum` step
    of the sensors as it shows in the error, arcmin.
    """

    error: Array
    block: Index
    weight: Array
    quantum: float

    @property
    def blocks(self) -> int:
        return int(self.block[-1]) + 1

    def rows(self, mask: NDArray[Any]) -> Rows:
        """Only the rows in `mask`."""
        arrays = {one.name: getattr(self, one.name) for one in fields(self)}
        changes = {name: value[mask] for name, value in arrays.items() if isinstance(value, np.ndarray)}
        return replace(self, **changes)


def gather(recordings: Sequence[Recording], neighbours: int = 1) -> Rows:
    """All recordings as one `Rows`; the mean of so many `neighbours` makes a row."""
    parts = [_one_record(recording, neighbours) for recording in recordings]
    columns: dict[str, Any] = {}
    for name in parts[0]:
        complete = all(part[name] is not None for part in parts)
        columns[name] = np.concatenate([part[name] for part in parts]) if complete else None
    record = np.repeat(np.arange(len(parts)), [len(part["theta"]) for part in parts])
    piece = _renumber(record, columns["piece"])
    passes = _renumber(record, columns.pop("pass_index"), columns["piece"])
    block = _turn_blocks(passes, columns["direction"], columns["theta"])
    columns["piece"] = piece
    locked = all(recording.input_locked for recording in recordings)
    return Rows(
        ratio=recordings[0].ratio,
        record=record,
        block=block if not locked else np.minimum(np.arange(len(record)) * 40 // len(record), 39),
        locked=locked,
        quantum=max(recording.quantum_arcmin for recording in recordings),
        output_step=max(recording.output_step_arcmin for recording in recordings),
        averaged=sum(len(recording) for recording in recordings) / len(record),
        **columns,
    )


def row_of_each_sample(recordings: Sequence[Recording], neighbours: int) -> Index:
    """The row of `gather(recordings, neighbours)` that each sample of all `recordings` went into, (N,), from 0."""
    parts = [(_rows_of(recording, neighbours)[0], len(recording)) for recording in recordings]
    counts = np.concatenate([np.diff(np.r_[starts, n]) for starts, n in parts])
    return np.repeat(np.arange(len(counts)), counts)


def _rows_of(recording: Recording, neighbours: int) -> tuple[Index, Passes, Index]:
    """The sample that each row begins with, the passes, and the part between gaps of each sample of one recording."""
    n = len(recording)
    segment = recording.segment if recording.segment is not None else np.zeros(n, np.int64)
    if recording.input_locked:
        # The input stands: what moves is the torque, and passes are its sweeps.
        drive_by = recording.torque if recording.torque is not None else np.arange(n, dtype=float)
        passes = find_passes(drive_by, 0.05 * float(np.ptp(drive_by)))
        cell = np.arange(n) // max(1, n // 4000)
    else:
        passes = find_passes(recording.input_angle)
        cell = np.arange(n) // neighbours
    change = (np.diff(cell) != 0) | (np.diff(passes.index) != 0) | (np.diff(segment) != 0)
    return np.r_[0, np.flatnonzero(change) + 1], passes, segment


def _one_record(recording: Recording, neighbours: int) -> dict[str, Any]:
    """The columns of one recording's rows; None for a channel that it does not have."""
    n = len(recording)
    starts, passes, segment = _rows_of(recording, neighbours)
    counts = np.diff(np.r_[starts, n]).astype(float)

    def mean(values: Array | None) -> Any:
        return None if values is None else np.add.reduceat(values, starts) / counts

    theta, time = mean(recording.input_angle), mean(recording.time)
    usual = np.median(counts)
    scale = 1.0 if recording.input_locked else np.degrees(1.0) / recording.ratio
    return {
        "theta": theta,
        "error": mean(recording.error_arcmin),
        "output": mean(recording.output_angle),
        "direction": passes.direction[starts],
        "travel": mean(passes.since_reversal) * scale,
        "first": passes.first[starts],
        "piece": segment[starts],
        "pass_index": passes.index[starts],
        "weight": np.clip(counts / usual, 0.1, 4.0),
        "time": time,
        "speed": None if time is None else _speed(theta, time, segment[starts]),
        "torque": mean(quiet(recording.torque, segment)),
        "temperature": mean(quiet(recording.temperature, segment)),
    }


def quiet(values: Array | None, segment: Index) -> Array | None:
    """A slow channel with its read-out noise averaged away: noise in a regressor would make its effect look smaller.

    The longest of several centred means whose difference from the record is still nothing but the noise that
    neighbouring samples show.

    `values` (n,) or None; `segment` (n,) counts up at gaps.
    """
    if values is None or len(values) < 200:
        return values
    jumps = np.diff(values, 2)
    noise = 1.4826 * float(np.median(np.abs(jumps))) / np.sqrt(6)
    if noise <= 0:
        noise = float(np.median(np.abs(np.diff(values)[np.diff(values) != 0]))) if np.any(np.diff(values)) else 0.0
    best = values
    inner = np.diff(segment) == 0
    for window in (5, 9, 17, 33, 65, 129):
        kernel = np.ones(window) / window
        padded = np.pad(values, window // 2, mode="edge")
        smooth = np.convolve(padded, kernel, "valid")
        # Near a gap the mean would mix both sides: keep the record there.
        near_gap = np.convolve(np.r_[False, ~inner].astype(float), np.ones(window), "same") > 0
        smooth = np.where(near_gap, values, smooth)
        off = float(np.mean((values - smooth) ** 2))
        if off > 1.1 * noise**2 * (1 - 1 / window):
            break
        best = smooth
    return best


def _speed(theta: Array, time: Array, segment: Index, half_window: int = 2) -> Array:
    """Input speed by least squares over five neighbouring rows of one segment (clock jitter and encoder steps average
    out).
    """
    n = len(theta)
    offsets = np.arange(-half_window, half_window + 1)
    rows = np.clip(np.arange(n)[:, None] + offsets, 0, n - 1)
    good = segment[rows] == segment[:, None]
    count = np.maximum(good.sum(1), 1)
    t = np.where(good, time[rows], 0.0)
    a = np.where(good, theta[rows], 0.0)
    t_mean, a_mean = t.sum(1) / count, a.sum(1) / count
    dt = np.where(good, time[rows] - t_mean[:, None], 0.0)
    spread = (dt**2).sum(1)
    slope = (dt * np.where(good, theta[rows] - a_mean[:, None], 0.0)).sum(1)
    speed: Array = np.divide(slope, spread, out=np.zeros(n), where=spread > 0)
    return speed


def _renumber(*keys: Index) -> Index:
    """0, 1, 2, ... counted up wherever one of the keys changes from one row to the next."""
    change = np.zeros(len(keys[0]), np.int64)
    for key in keys:
        change[1:] |= np.diff(key) != 0
    return np.cumsum(change)


def _turn_blocks(passes: Index, direction: Array, theta: Array) -> Index:
    """Whole input turns; a rest shorter than a third of a turn joins the block before it (or after it, at a start).

    A turn begins once: where the input stands at an end of one, noise goes to and fro over it in every other row.
    """
    turn = np.empty(len(theta), np.int64)
    for one in np.split(np.arange(len(theta)), np.flatnonzero(np.diff(passes)) + 1):
        turn[one] = np.floor(np.maximum.accumulate(direction[one] * theta[one]) / TURN)
    block = _renumber(passes, turn)
    size = np.bincount(block)
    usual = np.median(size)
    small = size < usual / 3
    keep = ~small
    if not keep.any():
        return np.zeros(len(block), np.int64)
    merged = np.cumsum(keep) - 1
    renumbered: Index = np.maximum(merged, 0)[block]
    return renumbered
