"""Friction on the output side, seen with the input locked: the spring feels the torque less the friction.

A Coulomb element of friction torque r in series with the load passes the torque on as the play (stop) operator does:
p = max(T - r, min(T + r, p before)), rate-independent (Krasnosel'skii, Pokrovskii, "Systems with Hysteresis", 1989;
Ruderman, Hoffmann, Bertram, "Modeling and identification of elastic robot joints with hysteresis and backlash", IEEE
Trans. Ind. Electron. 56, 2009). The output then winds up by phi(p) instead of phi(T), with phi of two slopes that meet
at a knee, odd in torque. What hysteresis adds to the windup is phi(p) - phi(T): widest where the spring is softest, and
nothing at a reversal until the torque has come back by 2 r.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hdopt.diagnosis.samples import Samples
from hdopt.drive import ARCMIN

Array = NDArray[np.float64]


def torque_behind_friction(samples: Samples, friction: float) -> Array:
    """Play operator p (Nm) of the recorded torque, row by row; before the first reversal fully on one side."""
    behind = np.empty(len(samples))
    starts = np.r_[0, np.flatnonzero((np.diff(samples.direction) != 0) | (np.diff(samples.record) != 0)) + 1]
    ends = np.r_[starts[1:], len(samples)]
    for start, end in zip(starts, ends, strict=True):
        rows = slice(start, end)
        direction = samples.direction[start]
        pushed = np.maximum.accumulate(direction * samples.torque[rows] - friction)
        before = -np.inf if samples.first[start] else direction * behind[start - 1]
        behind[rows] = direction * np.maximum(pushed, before)
    return behind


def friction_columns(samples: Samples, friction: float, knee: float) -> Array:
    """phi(p) - phi(T) for the two slopes, and the unknown state at the start of a recording; (n, 2 or 3).

    In arcmin per coefficient, compliances in 1e-5 rad/Nm as in `torsional_windup`.
    """
    torque = samples.torque
    behind = torque_behind_friction(samples, friction)
    columns = [behind - torque, np.clip(behind, -knee, knee) - np.clip(torque, -knee, knee)]
    columns = [column * (1e-5 / ARCMIN) for column in columns]
    if samples.first.any():
        columns.append(np.where(samples.first, np.exp(-samples.travel / friction), 0.0))
    return np.column_stack(columns)


def half_loop(values: Array, friction: float, knee: float) -> float:
    """Half the distance of the two directions at zero torque, arcmin, from the coefficients of `friction_columns`."""
    return abs(values[0] * friction + values[1] * min(friction, knee)) * (1e-5 / ARCMIN)
