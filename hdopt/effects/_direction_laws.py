"""An error that is larger in one direction than in the other: play and friction of the catalogue are no such thing."""

from __future__ import annotations

import numpy as np

from hdopt.arrays import Array
from hdopt.effects.conditions import Conditions
from hdopt.effects.term import Term


def columns_by_direction(conditions: Conditions, term: Term, motion: Array) -> list[Array]:
    """The columns of `term`, which parts the directions, and beside them the first of them times the drive's own error
    `motion` (n,), arcmin: (n, p + 1), in `conditions` of n rows. None of a gear without an error of its own, at a
    locked input, and where the term acts in the zones.
    """
    columns = term.columns
    if columns is None or conditions.locked or np.ptp(motion) == 0:
        return []
    return [np.column_stack([columns, columns[:, 0] * motion])]
