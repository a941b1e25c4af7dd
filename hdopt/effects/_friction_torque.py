"""Friction on the output side, seen with the input locked: the spring feels the torque less the friction.

A Coulomb element of friction torque r in series with the load passes the torque on as the play (stop) operator does:
p = max(T - r, min(T + r, p before)), rate-independent (Krasnosel'skii, Pokrovskii, "Systems with Hysteresis", 1989;
Ruderman, Hoffmann, Bertram, "Modeling and identification of elastic robot joints with hysteresis and backlash", IEEE
Trans. Ind. Electron. 56, 2009). The output then winds up by phi(p) instead of phi(T), with phi of two slopes that meet
at a knee, odd in torque. What hysteresis adds to the windup is phi(p) - phi(T): widest where the spring is softest, and
nothing at a reversal until the torque has come back by 2 r.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from hdopt.arrays import Array
from hdopt.drive.geometry import ARCMIN
from hdopt.effects.conditions import Conditions


def passes_of(conditions: Conditions) -> Iterator[slice]:
    """The rows of each pass of the `conditions`: between reversals, and between recordings."""
    turned = (np.diff(conditions.direction) != 0) | (np.diff(conditions.record) != 0)
    bounds = [0, *(np.flatnonzero(turned) + 1), len(conditions)]
    for start, end in itertools.pairwise(bounds):
        yield slice(int(start), int(end))


def torque_behind_friction(conditions: Conditions, friction: float) -> Array:
    """Play operator p (Nm, (n,)) of the torque of the `conditions` for a `friction` torque r (Nm); before the first
    reversal fully on one side.
    """
    torque = conditions.known_torque
    behind = np.empty(len(conditions))
    for rows in passes_of(conditions):
        direction = float(conditions.direction[rows.start])
        pushed = np.maximum.accumulate(direction * torque[rows] - friction)
        before = -np.inf if conditions.first[rows.start] else direction * behind[rows.start - 1]
        behind[rows] = direction * np.maximum(pushed, before)
    return behind


def friction_columns(conditions: Conditions, friction: float, knee: float) -> Array:
    """phi(p) - phi(T) for the two slopes of a spring with its knee at `knee` (Nm) behind `friction` (Nm), and the
    unknown state at the start of a recording, on the rows of the `conditions`; (n, 2 or 3).

    In arcmin per coefficient, compliances in 1e-5 rad/Nm as in `torsional_windup`.
    """
    torque = conditions.known_torque
    behind = torque_behind_friction(conditions, friction)
    columns = [behind - torque, np.clip(behind, -knee, knee) - np.clip(torque, -knee, knee)]
    columns = [column * (1e-5 / ARCMIN) for column in columns]
    if conditions.first.any():
        columns.append(np.where(conditions.first, np.exp(-conditions.travel / friction), 0.0))
    return np.column_stack(columns)


def half_loop(values: Array, friction: float, knee: float) -> float:
    """Half the distance of the two directions at zero torque, arcmin, from the coefficients `values` (2 or 3) of
    `friction_columns` at the same `friction` and `knee` (Nm).
    """
    return float(abs(values[0] * friction + values[1] * min(friction, knee)) * (1e-5 / ARCMIN))
