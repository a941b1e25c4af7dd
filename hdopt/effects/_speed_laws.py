"""Laws by which drag depends on the size of the speed, which play and friction of the catalogue do not."""

from __future__ import annotations

import numpy as np

from hdopt.arrays import Array
from hdopt.effects.conditions import Conditions
from hdopt.effects.term import Term

LEAST_RANGE = 1.15
"""Largest over smallest speed, but for a twentieth at either end, below which no law of the speed shows."""
ENDS = 0.05
"""Share of the rows at either end of the speeds, and the least part of the largest speed, which a reversal passes."""
POWERS = (-0.5, 0.5)
"""By a root of the speed, and by one over it."""
GROWING = (1.0, 2.0)
"""With the speed, and with its square."""
FADING = (0.25, 0.5)
"""Parts of the largest speed within which boundary friction fades into that of a film (Stribeck)."""


def columns_by_speed(conditions: Conditions, term: Term) -> list[Array]:
    """The columns of `term`, alike at every speed, under each of the other laws, (n, p) each; none where
    `weights_by_speed` has none for the `conditions`, or where the term acts in the zones.
    """
    columns = term.columns
    return [] if columns is None else [columns * weight[:, None] for weight in weights_by_speed(conditions)]


def waves_by_speed(conditions: Conditions, columns: Array) -> list[Array]:
    """The `columns` (n, p), waves of parts that turn, which are as large at every speed, where they would fade or grow
    with it, (n, p) each: ripple of a motor or of its drive. None where the `conditions` know no speed that varies.
    """
    weights = weights_by_speed(conditions)
    if weights:
        part = np.abs(conditions.known_speed) / np.max(np.abs(conditions.known_speed))
        weights += [part**power for power in GROWING]
    return [columns * weight[:, None] for weight in weights]


def weights_by_speed(conditions: Conditions) -> list[Array]:
    """What an offset of every speed alike would be multiplied by under each of the other laws, (n,) each, in
    `conditions` of n rows; none where the speed is not known or hardly varies.
    """
    if conditions.locked or conditions.speed is None:
        return []
    size = np.abs(conditions.speed)
    low, high = np.quantile(size, [ENDS, 1 - ENDS])
    if high < LEAST_RANGE * low or high <= 0:
        return []
    part = np.maximum(size / np.max(size), ENDS)
    return [*(part**power for power in POWERS), *(np.exp(-part / width) for width in FADING)]
