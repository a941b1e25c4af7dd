"""How far the points of a measured closed curve scatter, from the points alone."""

from __future__ import annotations

import math

import numpy as np

from hdopt.arrays import Array

ORDERS = (4, 6, 8)
"""Of the differences that are looked at. Scatter has the same share in all of them, a smooth curve the less the higher
the order is and the closer the points lie: the least of them is the nearest to the scatter alone."""


def differences(angles: Array, radii: Array, order: int) -> Array:
    """Divided differences of an even `order` about every point, mm, (n,), so scaled that independent scatter of
    standard deviation 1 mm has the standard deviation 1 mm in them, whatever the steps are.

    `angles` (rad, (n,), rising within one turn) and `radii` (mm, (n,)) are points of a closed curve, n > `order`.
    """
    near = (np.arange(len(angles))[:, None] + np.arange(order + 1) - order // 2) % len(angles)
    away = np.angle(np.exp(1j * (angles[near] - angles[:, None])))
    # Over the widest reach of each point, as the products of steps would leave the range of numbers.
    apart = (away[:, :, None] - away[:, None, :]) / np.ptp(away, axis=1)[:, None, None] + np.eye(order + 1)
    weights = 1 / apart.prod(axis=2)
    weights /= np.linalg.norm(weights, axis=1)[:, None]
    return np.asarray(np.einsum("ij,ij->i", weights, radii[near]))


def scatter_of_points(angles: Array, radii: Array) -> tuple[float, int]:
    """Standard deviation of a point's radius (mm), and the index of the point that lies farthest from its neighbours'
    curve; `angles` and `radii` as in `differences`, n > 8."""
    found = [differences(angles, radii, order) for order in ORDERS]
    least = min(found, key=lambda one: float(np.mean(one**2)))
    return math.sqrt(float(np.mean(least**2))), int(np.abs(least).argmax())
