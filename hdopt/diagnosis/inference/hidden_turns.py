"""Turns that are hidden from a whole diagnosis: recordings made as if they had never been read."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from hdopt.arrays import Array, Index, Mask
from hdopt.diagnosis.settings import HeldOutSettings
from hdopt.recordings.recording import Recording
from hdopt.recordings.rows import Rows, gather, neighbours_for


@dataclass(frozen=True)
class NestedHeldOut:
    """Errors (arcmin rms) on `turns` whole turns that no stage of a diagnosis saw: of its `base` and of all that it
    chose (`extended`), which were `effects` (ids, in the order of the alphabet), both without the ripple that it found,
    and of the `drive_alone` with it.
    """

    base: float
    extended: float
    turns: int
    effects: tuple[str, ...]
    drive_alone: float


def hidden_samples(
    recordings: Sequence[Recording], rng: np.random.Generator, settings: HeldOutSettings
) -> tuple[Mask, ...] | None:
    """Of each of the `recordings` the samples to hide, (n,): whole turns drawn by `rng`, a share of them by the
    `settings`. None where too few can be spared.

    A turn in which a pass, a recording or a piece of it begins or ends is never hidden: what the drive does after a
    reversal depends on where that was.
    """
    rows = gather(recordings)
    if len(rows) != sum(len(one) for one in recordings):
        return None  # A slow sweep of a locked input, of which many samples make one row.
    free = uncut_blocks(rows)
    most = min(turns_to_hide(recordings, rows.blocks, settings), len(free))
    if most < settings.fewest_turns or rows.blocks - most < settings.nested_training:
        return None
    chosen = np.isin(rows.block, rng.permutation(free)[:most])
    bounds = np.cumsum([0, *(len(one) for one in recordings)])
    return tuple(chosen[a:b] for a, b in pairwise(bounds))


def turns_to_hide(recordings: Sequence[Recording], turns: int, settings: HeldOutSettings) -> int:
    """How many of the `turns` of the `recordings` to hide: a share of them, or as many as leave no more rows than a
    diagnosis needs, by the `settings`.
    """
    rows = sum(len(one) for one in recordings) / neighbours_for(recordings)
    needed = max(math.ceil(turns * settings.nested_rows / rows), settings.nested_training)
    return max(round(settings.nested_share * turns), turns - needed)


def uncut_blocks(rows: Rows) -> Index:
    """Numbers of the turns of `rows` at whose ends the motion goes on as it was."""
    same = (np.diff(rows.record) == 0) & (np.diff(rows.direction) == 0) & (np.diff(rows.piece) == 0)
    cut = np.r_[True, ~same] | np.r_[~same, True]
    return np.setdiff1d(rows.block, rows.block[cut])


def without_samples(recordings: Sequence[Recording], hidden: Sequence[Mask]) -> tuple[Recording, ...]:
    """`recordings` without their `hidden` samples, (n,) of each: a gap is left where they were."""
    return tuple(_without(one, mask) for one, mask in zip(recordings, hidden, strict=True))


def _without(recording: Recording, hidden: Mask) -> Recording:
    kept = ~hidden
    segment = np.zeros(len(recording), np.int64) if recording.segment is None else recording.segment
    # Counted up at every change between hidden and kept, so that each gap parts two segments.
    segment = segment + np.r_[0, np.cumsum(np.diff(hidden.astype(np.int64)) != 0)]

    def rest(values: Array | None) -> Array | None:
        return None if values is None else values[kept]

    return replace(
        recording,
        input_angle=recording.input_angle[kept],
        error_arcmin=recording.error_arcmin[kept],
        time=rest(recording.time),
        torque=rest(recording.torque),
        temperature=rest(recording.temperature),
        scatter_arcmin=rest(recording.scatter_arcmin),
        segment=segment[kept],
    )


def shares_of_samples(recordings: Sequence[Recording], values: Sequence[Mask], neighbours: int) -> Array:
    """Means of `values` (n,) of each of the `recordings` over the samples of each row, where so many `neighbours` make
    one.
    """
    marked = [replace(one, error_arcmin=own.astype(float)) for one, own in zip(recordings, values, strict=True)]
    return gather(marked, neighbours).error
