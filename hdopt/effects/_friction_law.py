"""Laws of pre-sliding friction: how the friction state crosses over after a reversal.

The state y, counted along the motion, runs from -1 (dragged the other way) to 1 over the travel x since the reversal,
in units of the law's own length. Sources: P. Dahl, "A solid friction model", Aerospace Corp. TOR-158, 1968, exponent 1;
Maxwell-slip elements whose break-away distances are evenly spread up to the length, or over a decade about it as their
logarithms are, so that the last give way late (Lampaert, Al-Bender, Swevers, 2003); Y.-K. Wen, "Method for random
vibration of hysteretic systems", J. Eng. Mech. Div. 102, 1976, with equal weights of loading and unloading, dy/dx = 1
for y < 0 and 1 - y^n above, n = 1 and 2. Not among them: one spring with one slider, whose straight crossing is that of
play.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from hdopt.arrays import Array


@dataclass(frozen=True)
class FrictionLaw:
    """`cross(y, x)`: the state after travel x (n,) since a reversal at y (counted along the new motion); `half` the
    travel after which a full reversal stands at y = 0, `transition` that after which it stands at y = 0.8: nine tenths
    of the loop are crossed.
    """

    cross: Callable[[float, Array], Array]
    half: float
    transition: float


def _dahl(y: float, x: Array) -> Array:
    return np.asarray(1 - (1 - y) * np.exp(-x))


def _maxwell_slip(y: float, x: Array) -> Array:
    u = np.minimum(x, 1)
    return np.asarray(y + (1 - y) * (2 * u - u**2))


LAST = math.log(10) / 0.9
"""Of break-away distances spread over a decade, the longest in units of their mean; the shortest is a tenth of it."""


def _maxwell_slip_wide(y: float, x: Array) -> Array:
    u = np.minimum(x / LAST, 1)
    among = (np.log(10 * np.maximum(u, 0.1)) + 1 - u) / math.log(10)
    return np.asarray(y + (1 - y) * np.where(u < 0.1, u * 9 / math.log(10), among))


def _bouc_wen(y: float, x: Array) -> Array:
    start = min(y, 0.0)
    beyond = np.maximum(x + start, 0)
    return np.where(x + start < 0, x + start, 1 - (1 - max(y, 0.0)) * np.exp(-beyond))


def _bouc_wen_square(y: float, x: Array) -> Array:
    start = min(y, 0.0)
    beyond = np.maximum(x + start, 0)
    return np.where(x + start < 0, x + start, np.tanh(beyond + math.atanh(min(max(y, 0.0), 1 - 1e-12))))


class Law(StrEnum):
    """A law of pre-sliding friction."""

    DAHL = "dahl"
    MAXWELL_SLIP = "maxwell_slip"
    BOUC_WEN = "bouc_wen"
    BOUC_WEN_SQUARE = "bouc_wen_square"
    MAXWELL_SLIP_WIDE = "maxwell_slip_wide"


LAWS = {
    Law.DAHL: FrictionLaw(_dahl, math.log(2), math.log(10)),
    Law.MAXWELL_SLIP: FrictionLaw(_maxwell_slip, 1 - math.sqrt(0.5), 1 - math.sqrt(0.1)),
    Law.BOUC_WEN: FrictionLaw(_bouc_wen, 1.0, 1 + math.log(5)),
    Law.BOUC_WEN_SQUARE: FrictionLaw(_bouc_wen_square, 1.0, 1 + math.atanh(0.8)),
    Law.MAXWELL_SLIP_WIDE: FrictionLaw(_maxwell_slip_wide, 0.1328641047763453 * LAST, 0.46539958110077795 * LAST),
}
"""By name."""
NAMES = tuple(LAWS)
