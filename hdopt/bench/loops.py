"""Path-dependent elements, stepped along the samples."""

from __future__ import annotations

import numba
import numpy as np

from hdopt.bench.arrays import Array


@numba.njit(cache=True, fastmath=False)
def play(position: Array, gap: Array) -> Array:
    """Follower (n,) of a play (backlash) operator on a path `position` (n,), whose full width `gap` (n,), in the unit
    of the path, may change from sample to sample. It starts at the side that the first twenty samples press against."""
    follower = np.empty_like(position)
    y = position[0] - 0.5 * gap[0] * np.sign(position[min(20, position.size - 1)] - position[0])
    for i in range(position.size):
        y = min(max(y, position[i] - 0.5 * gap[i]), position[i] + 0.5 * gap[i])
        follower[i] = y
    return follower


@numba.njit(cache=True, fastmath=False)
def maxwell_slip(position: Array, slip: Array, weight: Array) -> Array:
    """Force (n,) of Jenkins elements in parallel along a path `position` (n,): element k slips at a deflection of
    `slip`[k], in the unit of the path, with a force `weight`[k]. All start without deflection."""
    force = np.empty_like(position)
    deflection = np.zeros(slip.size)
    last = position[0]
    for i in range(position.size):
        move = position[i] - last
        last = position[i]
        total = 0.0
        for k in range(slip.size):
            deflection[k] = min(max(deflection[k] + move, -slip[k]), slip[k])
            total += weight[k] * deflection[k] / slip[k]
        force[i] = total
    return force


@numba.njit(cache=True, fastmath=False)
def bouc_wen(position: Array, length: float, exponent: float, beta: float) -> Array:
    """Bouc-Wen force z (n,) along a path `position` x (n,), +-1 when it slips.

    dz/dx = (1 - |z|^n (1 - beta + beta sign(z dx)))/`length`, n the `exponent`, `beta` how much unloading differs.
    Each sample's move is made in short steps, so that the force depends on the path alone.
    """
    force = np.empty_like(position)
    z = 0.0
    last = position[0]
    for i in range(position.size):
        move = (position[i] - last) / length
        last = position[i]
        steps = int(abs(move) / 0.05) + 1
        for _ in range(steps):
            d = move / steps
            along = 1.0 if d * z > 0 else -1.0
            rate = 1 - abs(z) ** exponent * (1 - beta + beta * along)
            middle = z + 0.5 * d * rate
            along = 1.0 if d * middle > 0 else -1.0
            z += d * (1 - abs(middle) ** exponent * (1 - beta + beta * along))
        force[i] = z
    return force


@numba.njit(cache=True, fastmath=False)
def first_order_noise(white: Array, keep: float) -> Array:
    """AR(1) noise of unit variance from `white` noise (n,) of unit variance; `keep` (0 to 1) is what a sample keeps of
    the one before."""
    coloured = np.empty_like(white)
    x = white[0]
    drive = np.sqrt(1 - keep * keep)
    for i in range(white.size):
        x = keep * x + drive * white[i]
        coloured[i] = x
    return coloured
