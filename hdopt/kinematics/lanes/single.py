"""Elementary functions in single precision without branches, so that the compiler runs them in lanes.

Phases may be any number of turns: they are reduced in double precision first, and everything after is a polynomial.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import cast

import numpy as np

from hdopt.arrays import Array, Singles
from hdopt.kinematics.compiled_closed_form import compiled


def single(value: float) -> float:
    """`value` in single precision: a plain number in a kernel would widen all that it meets."""
    return cast("float", np.float32(value))


def singles(values: Array) -> Singles:
    """`values` of any shape in single precision, row by row."""
    return np.ascontiguousarray(values, dtype=np.float32)


narrowed = cast("Callable[[float], float]", np.float32)
"""The same inside kernels."""

unsigned = cast("Callable[[int], int]", np.uintp)
"""A place in an array that is not counted from its end: the compiler need not ask."""

ZERO, HALF, ONE, TWO = single(0.0), single(0.5), single(1.0), single(2.0)
PI, HALF_PI, TURN = single(math.pi), single(math.pi / 2), single(2 * math.pi)
TINY = single(1e-30)
"""What keeps a quotient of two zeros finite."""
HUGE = single(1e30)
"""Larger than any deviation, and finite."""
PER_TURN = 1 / (2 * math.pi)
"""Turns in a radian, in double precision."""

# Least-squares fits in r^2 over |r| <= 1/4 turn, weighted until the error was even: 3e-8 and 3e-10 beside rounding.
S0, S1, S2, S3, S4 = (single(c) for c in (6.28318528, -41.34168072, 81.60248511, -76.58139641, 39.76161701))
C1, C2, C3, C4, C5 = (single(c) for c in (-19.73920855, 64.93934663, -85.45357163, 60.14401509, -24.98223776))
A0, A1, A2, A3 = (single(c) for c in (0.99999611, -0.33317376, 0.19807880, -0.13233510))
A4, A5, A6 = (single(c) for c in (0.07962632, -0.03360627, 0.00681245))
SIXTH, TWELFTH, TWENTIETH, THIRTIETH = (single(1 / n) for n in (6, 12, 20, 30))
T3, T5, T7, T9 = (single(c) for c in (1 / 3, 2 / 15, 17 / 315, 62 / 2835))


@compiled
def reduced(angle: float) -> float:
    """An `angle` (rad, double precision) in turns between -1/2 and 1/2, in single precision."""
    turns = angle * PER_TURN
    return narrowed(turns - np.floor(turns + 0.5))


@compiled
def sine_cosine(turns: float) -> tuple[float, float]:
    """Sine and cosine of `turns` between -1/2 and 1/2, to 1e-7."""
    half = np.floor(turns + turns + HALF)
    sign = ONE - TWO * abs(half)
    r = turns - HALF * half
    z = r * r
    sine = r * (S0 + z * (S1 + z * (S2 + z * (S3 + z * S4))))
    cosine = ONE + z * (C1 + z * (C2 + z * (C3 + z * (C4 + z * C5))))
    return sign * sine, sign * cosine


@compiled
def tangent(x: float) -> float:
    """tan(`x`) by its series: to 1e-7 up to 0.3 rad, more than any tilt for which the closed form holds."""
    z = x * x
    return x + x * z * (T3 + z * (T5 + z * (T7 + z * T9)))


@compiled
def angle_of(sine: float, cosine: float) -> float:
    """The angle between -pi and pi, rad, of a `sine` and a `cosine` of any common scale, to 3e-7."""
    up, along = abs(sine), abs(cosine)
    x = min(up, along) / max(max(up, along), TINY)
    z = x * x
    angle = x * (A0 + z * (A1 + z * (A2 + z * (A3 + z * (A4 + z * (A5 + z * A6))))))
    angle = HALF_PI - angle if up > along else angle
    angle = PI - angle if cosine < ZERO else angle
    return -angle if sine < ZERO else angle


@compiled
def rotated(cosine: float, sine: float, x: float) -> tuple[float, float]:
    """(`cosine`, `sine`) turned by the angle `x`, rad, |x| <= 1/2 (by series, to 2e-7)."""
    z = x * x
    c = ONE - z * HALF * (ONE - z * TWELFTH * (ONE - z * THIRTIETH))
    s = x * (ONE - z * SIXTH * (ONE - z * TWENTIETH))
    return cosine * c - sine * s, sine * c + cosine * s


@compiled
def clipped(x: float, low: float, high: float) -> float:
    """`x` between `low` and `high`."""
    return min(high, max(low, x))
