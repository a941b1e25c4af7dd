"""Laws of the time: drag wears in or settles, which play and friction of the catalogue do not; a wave may grow, which
lines of an encoder do not.
"""

from __future__ import annotations

import numpy as np

from hdopt.arrays import Array
from hdopt.effects.conditions import Conditions
from hdopt.effects.term import Term

LEAST_PASSES = 4
"""Passes of one recording from which what changes with time is told from an offset of the one or the other."""
FADING = (0.1, 0.2, 0.4)
"""Parts of a recording within which drag that wears in fades to 1/e."""


def columns_by_time(conditions: Conditions, term: Term) -> list[Array]:
    """The columns of `term`, alike at all times, under each of the other laws, (n, p) each; none where
    `weights_by_time` has none for the `conditions`, or where the term acts in the zones.
    """
    columns = term.columns
    return [] if columns is None else [columns * weight[:, None] for weight in weights_by_time(conditions)]


def weights_by_time(conditions: Conditions) -> list[Array]:
    """What an offset of all times alike would be multiplied by under each of the other laws, (n,) each, in `conditions`
    of n rows: it fades from the start of each recording on. None where the time is not known, or where a recording has
    too few passes: an offset of one or two passes that changes is also a drift.
    """
    part = part_gone_by(conditions)
    if part is None:
        return []
    turns = (np.diff(conditions.direction[conditions.record == record]) for record in range(conditions.records))
    if any(np.count_nonzero(each) < LEAST_PASSES - 1 for each in turns):
        return []
    return [np.exp(-part / fading) for fading in FADING]


def columns_growing(conditions: Conditions, term: Term) -> list[Array]:
    """The columns of `term`, alike at all times, and beside them what grows of each from nothing at the start of a
    recording, (n, 2 p): one law. None where the time is not known in the `conditions`, or where the term acts in the
    zones.
    """
    columns, part = term.columns, part_gone_by(conditions)
    return [] if columns is None or part is None else [np.column_stack([columns, columns * part[:, None]])]


def part_gone_by(conditions: Conditions) -> Array | None:
    """The part of its recording's time that has gone by at each of the n rows of `conditions`, (n,), 0 to 1; None at a
    locked input, or where a recording has no time."""
    if conditions.locked or conditions.time is None:
        return None
    part = np.empty(len(conditions))
    for record in range(conditions.records):
        rows = conditions.record == record
        time = conditions.time[rows]
        if np.ptp(time) <= 0:
            return None
        part[rows] = (time - time[0]) / np.ptp(time)
    return part
