"""Amplitudes as the samples had them, from a fit to rows that are means of neighbouring samples.

The mean of m even samples over an angle w leaves sin(k w/2) / (m sin(k w/(2 m))) of a sine of order k. The fit is made
on the rows, so that its columns are as they are; only what is said of an amplitude is that of the samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.numerical import TINY
from hdopt.diagnosis.settings import DEFAULT
from hdopt.effects.conditions import Conditions
from hdopt.effects.estimate import FitEstimate


def part_left(rows: Conditions, orders: Sequence[float], least: float = DEFAULT.verdict.least_left_by_means) -> Array:
    """Part of the amplitude of each of `orders` (k, cycles an input turn) that the means behind `rows` leave, (k,), and
    no less than the `least`: on average over rows, which span different angles where the speed changes."""
    count = round(rows.averaged)
    if count < 2 or rows.locked:
        return np.ones(len(orders))
    within = np.diff(rows.piece) == 0
    width = np.abs(np.diff(rows.theta))[within]
    half = np.maximum(width[:, None] * np.abs(np.asarray(orders, float)) / 2, TINY)
    left = np.sin(half) / (count * np.sin(half / count))
    return np.asarray(np.maximum(left.mean(0), least))


def as_sampled(
    estimate: FitEstimate,
    rows: Conditions,
    orders: Sequence[float],
    least: float = DEFAULT.verdict.least_left_by_means,
) -> FitEstimate:
    """`estimate` with its first coefficients, a sine and a cosine of each of `orders` (cycles an input turn), as the
    samples had them before means of these made the `rows`; the same object where no samples were averaged. `least` as
    for `part_left`."""
    left = part_left(rows, orders, least)
    if np.all(left == 1):
        return estimate
    scale = np.ones(len(estimate.values))
    scale[: 2 * len(left)] = np.repeat(1 / left, 2)
    profiles = {at: (low * float(scale[at]), high * float(scale[at])) for at, (low, high) in estimate.profiles.items()}
    return replace(
        estimate,
        values=estimate.values * scale,
        covariance=estimate.covariance * np.outer(scale, scale),
        profiles=profiles,
    )
