"""The return error's path after a reversal: which side the drive leans to, in -1..1, over the output's travel.

Friction lets the error cross from one side to the other over a travel of its own (P. Dahl, "A solid friction model",
Aerospace Corp. TOR-158, 1968, exponent 1); play crosses at once. A controller keeps the state: it moves towards the
direction of motion by exp(-travel/crossing), from wherever it stood.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from hdopt.arrays import Array, Mask
from hdopt.effects._friction_law import Law
from hdopt.effects.conditions import Conditions
from hdopt.effects.hysteresis import friction_state

TRIED = 12
"""Crossings tried, evenly spaced in their logarithm."""
SHORTEST_ROWS = 3.0
"""Shortest crossing that is tried, in rows: one that is over sooner cannot be told from one at once."""
LONGEST_SHARE = 0.5
"""Longest crossing that is tried, as a share of the longest travel between reversals."""
AT_ONCE = 0.0


def paths_of(conditions: Conditions) -> dict[float, Array]:
    """Crossing (deg of output) -> path (n,) in -1..1 along the `conditions`, for every crossing worth trying; `AT_ONCE`
    is the direction itself. {} where nothing reverses."""
    if not conditions.reverses:
        return {}
    steps = np.abs(np.diff(conditions.travel))
    least = SHORTEST_ROWS * float(np.median(steps[steps > 0]))
    most = LONGEST_SHARE * float(conditions.travel.max())
    tried = np.geomspace(least, most, TRIED) if most > least else ()
    return {AT_ONCE: conditions.direction} | {float(d): friction_state(conditions, float(d), Law.DAHL) for d in tried}


def path_of(conditions: Conditions, crossing_deg: float) -> Array:
    """The path (n,) in -1..1 along the `conditions` for a `crossing_deg` of output; zeros where nothing reverses."""
    if not conditions.reverses:
        return np.zeros(len(conditions))
    return conditions.direction if crossing_deg == AT_ONCE else friction_state(conditions, crossing_deg, Law.DAHL)


def crossing_of(left: Array, zeros: Array, paths: Mapping[float, Array], independent: float) -> float:
    """The crossing of `paths` that fits what harmonics `left` (n,) arcmin best beside the columns `zeros` (n, q).

    One over a length is taken only where it is better than at once by more than its own number, by Bayes' information
    criterion over the `independent` share of the values; the mean over neighbouring rows is not mistaken for it.
    """
    squares = {crossing: _squares_left(left, zeros, path) for crossing, path in paths.items()}
    best = min(squares, key=lambda crossing: squares[crossing])
    gain = len(left) * independent * math.log(max(squares[AT_ONCE], 1e-300) / max(squares[best], 1e-300))
    return best if gain > math.log(len(left)) + 2 * math.log(len(paths)) else AT_ONCE


def half_return(left: Array, zeros: Array, path: Array) -> float:
    """Half the return error (arcmin) in `left` (n,), whose side is `path` (n,), beside the columns `zeros` (n, q)."""
    return float(np.linalg.lstsq(np.column_stack([zeros, path]), left, rcond=1e-8)[0][-1])


def _squares_left(left: Array, zeros: Array, path: Array) -> float:
    columns = np.column_stack([zeros, path])
    rest = left - columns @ np.linalg.lstsq(columns, left, rcond=1e-8)[0]
    return float(rest @ rest)


def some_of(paths: Mapping[float, Array], rows: Mask) -> dict[float, Array]:
    """`paths` on those of their `rows` (n,) only."""
    return {crossing: path[rows] for crossing, path in paths.items()}
