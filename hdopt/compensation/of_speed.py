"""A compensation that takes the speed: what all speeds share, an error that grows with the speed, and each speed's own.

A delay of one channel, or a viscous drag on the drive's spring, makes a return error in proportion to the speed. A load
that swings on the drive's spring makes other harmonics at each speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from hdopt.arrays import Array
from hdopt.compensation.mesh import Beat
from hdopt.compensation.surface import Crossing, Harmonics, Surface
from hdopt.compensation.zones import Zones
from hdopt.recordings.recording import TURN
from hdopt.recordings.rows import Rows

Angular: TypeAlias = Harmonics | Zones | Surface | Beat
"""A function of both angles and the direction alone."""

APART = 0.1
"""Share by which speeds differ that are two."""
FEW, MANY = 10.0, 90.0
"""Percentiles of the speed between which it must differ by so much: starts and stops alone are no second speed."""
LOW_ORDERS = 6


@dataclass(frozen=True)
class OfSpeed:
    """What all speeds have in `common`, with `lag` arcmin for each r/min of the input, signed with it; and at each of
    the `speeds` (r/min, rising, negative backward) what that one has of its `own`, in between by straight lines, beyond
    them as at the nearest."""

    common: Angular
    lag: float = 0.0
    speeds: tuple[float, ...] = ()
    own: tuple[Harmonics, ...] = field(default=())

    def __len__(self) -> int:
        return len(self.common) + sum(len(one) for one in self.own)

    @property
    def back(self) -> float:
        return self.common.back

    @property
    def crossing(self) -> Crossing:
        return self.common.crossing

    def at(self, inputs: Array, outputs: Array, direction: Array | float = 0.0, rpm: Array | float = 0.0) -> Array:
        """Error (arcmin, n) at input and output angles `inputs`, `outputs` (n,) rad, `direction` +1, -1, 0 or the path
        between, and the input's speed `rpm` (r/min, (n,) or one for all, negative backward)."""
        value = self.common.at(inputs, outputs, direction) + self.lag * np.asarray(rpm)
        for number, one in enumerate(self.own):
            corner = [float(other == number) for other in range(len(self.own))]
            value = value + np.interp(rpm, self.speeds, corner) * one.at(inputs, outputs)
        return np.asarray(value, float)


def signed_rpm(rows: Rows) -> Array:
    """The input speed (n,) of `rows`, r/min, negative backward; zeros without a clock."""
    return np.zeros(len(rows)) if rows.speed is None else np.asarray(rows.speed * (60 / TURN), float)


def with_speed(common: Angular, lag: float, own: dict[float, Harmonics]) -> Angular | OfSpeed:
    """`common` alone where nothing depends on the speed; else with its `lag`, and each speed's `own` (r/min ->)."""
    worth = own if any(len(one) for one in own.values()) else {}
    if not lag and not worth:
        return common
    speeds = tuple(sorted(worth))
    return OfSpeed(common, lag, speeds, tuple(worth[speed] for speed in speeds))


def shows_lag(rpm: Array) -> bool:
    """Whether an input speed `rpm` (n,) r/min varies by more than starts and stops make it, in both directions."""
    if not (rpm > 0).any() or not (rpm < 0).any():
        return False
    few, many = np.percentile(np.abs(rpm), [FEW, MANY])
    return bool(many > (1 + APART) * few)


def lag_of(left: Array, columns: Array, rpm: Array, independent: float) -> float:
    """What is `left` (n,) arcmin for each r/min of an input speed `rpm` (n,), beside free `columns` (n, q).

    0 where that takes no more than chance, by Bayes' information criterion over the `independent` share of the values.
    """
    basis, _ = np.linalg.qr(columns)
    rest = left - basis @ (basis.T @ left)
    new = rpm - basis @ (basis.T @ rpm)
    lag = float(new @ rest) / max(float(new @ new), 1e-300)
    before, after = (max(float(one @ one), 1e-300) for one in (rest, rest - lag * new))
    gain = len(left) * independent * math.log(before / after)
    return lag if gain > 2 * math.log(len(left)) else 0.0


def low_orders(theta: Array) -> Array:
    """Sines and cosines (n, 12) of the lowest orders of input angles `theta` (n,) rad."""
    phases = np.outer(theta, np.arange(1, LOW_ORDERS + 1))
    return np.hstack([np.cos(phases), np.sin(phases)])
