"""The return error's path after a reversal: which side the drive leans to, in -1..1, over the output's travel.

Friction lets the error cross from one side to the other over a travel of its own (P. Dahl, "A solid friction model",
Aerospace Corp. TOR-158, 1968, exponent 1); play crosses in a straight line, over the travel that it is wide. A
controller keeps the state: it moves towards the direction of motion from wherever it stood. Where it stood when a
recording began, the recording decides: on the side of its motion, on the other, or relaxed between both.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping

import numpy as np

from hdopt.arrays import Array, Mask
from hdopt.compensation.surface import AT_ONCE, Crossing
from hdopt.effects._friction_torque import passes_of
from hdopt.effects.conditions import Conditions

TRIED = 12
"""Crossings tried, evenly spaced in their logarithm."""
STARTS = (1.0, 0.0, -1.0)
LOW_ORDERS = 6
SHORTEST_ROWS = 3.0
"""Shortest crossing that is tried, in rows: one that is over sooner cannot be told from one at once."""
LONGEST_SHARE = 0.5
"""Longest crossing that is tried, as a share of the longest travel between reversals."""
Paths = Mapping[Crossing, Array]


def paths_of(conditions: Conditions, half_arcmin: float = 0.0) -> Paths:
    """Crossing -> path (n,) in -1..1 along the `conditions`, for every crossing worth trying; `AT_ONCE` is the
    direction itself. {} where nothing reverses.

    `half_arcmin` is half the return error, about: play is as wide.
    """
    if not conditions.reverses:
        return {}
    steps = np.abs(np.diff(conditions.travel))
    least = SHORTEST_ROWS * float(np.median(steps[steps > 0]))
    most = LONGEST_SHARE * float(conditions.travel.max())
    tried = np.geomspace(least, most, TRIED) if most > least else ()
    each = [Crossing(float(deg), start) for deg, start in itertools.product(tried, STARTS)]
    if half_arcmin:
        each += [Crossing(abs(half_arcmin) / 30, start, True) for start in STARTS]
    return {crossing: path_of(conditions, crossing) for crossing in (AT_ONCE, *each)}


def half_about(conditions: Conditions, error: Array) -> float:
    """Half the return error (arcmin) in the `error` (n,) along the `conditions`, about: beside a zero of each recording
    and the lowest orders of the input. 0 where nothing reverses."""
    if not conditions.reverses:
        return 0.0
    phases = np.outer(conditions.theta, np.arange(1, LOW_ORDERS + 1))
    zeros = (conditions.record[:, None] == np.arange(conditions.records)).astype(float)
    return half_return(error, np.column_stack([zeros, np.cos(phases), np.sin(phases)]), conditions.direction)


def path_of(conditions: Conditions, crossing: Crossing) -> Array:
    """The path (n,) in -1..1 along the `conditions` for a `crossing`; zeros where nothing reverses."""
    if not conditions.reverses:
        return np.zeros(len(conditions))
    if crossing.deg == 0:
        return conditions.direction
    path = np.empty(len(conditions))
    last = 0.0
    for rows in passes_of(conditions):
        side = float(conditions.direction[rows.start])
        before = crossing.start * side if conditions.first[rows.start] else last
        travel = conditions.travel[rows] / crossing.deg
        if crossing.straight:
            path[rows] = np.clip(before + 2 * side * travel, -1.0, 1.0)
        else:
            path[rows] = side + (before - side) * np.exp(-travel)
        last = float(path[rows.stop - 1])
    return path


def crossing_of(left: Array, zeros: Array, paths: Paths, independent: float) -> Crossing:
    """The crossing of `paths` that fits what harmonics `left` (n,) arcmin best beside the columns `zeros` (n, q).

    One over a length is taken only where it is better than at once by more than its own number, by Bayes' information
    criterion over the `independent` share of the values; the mean over neighbouring rows is not mistaken for it.
    """
    basis, _ = np.linalg.qr(zeros)
    rest = left - basis @ (basis.T @ left)
    squares = {}
    for crossing, path in paths.items():
        new = path - basis @ (basis.T @ path)
        squares[crossing] = float(rest @ rest) - float(new @ rest) ** 2 / max(float(new @ new), 1e-300)
    best = min(squares, key=lambda crossing: squares[crossing])
    gain = len(left) * independent * math.log(max(squares[AT_ONCE], 1e-300) / max(squares[best], 1e-300))
    return best if gain > math.log(len(left)) + 2 * math.log(len(paths)) else AT_ONCE


def half_return(left: Array, zeros: Array, path: Array) -> float:
    """Half the return error (arcmin) in `left` (n,), whose side is `path` (n,), beside the columns `zeros` (n, q)."""
    return float(np.linalg.lstsq(np.column_stack([zeros, path]), left, rcond=1e-8)[0][-1])


def some_of(paths: Paths, rows: Mask) -> Paths:
    """`paths` on those of their `rows` (n,) only."""
    return {crossing: path[rows] for crossing, path in paths.items()}
