"""Amplitudes as the samples had them, from a fit to rows that are means of neighbouring samples.

The mean of m even samples over an angle w leaves sin(k w/2) / (m sin(k w/(2 m))) of a sine of order k. The fit is made
on the rows, so that its columns are as they are; what is said of an amplitude is that of the samples, and so is what a
fit makes of the rows as recorded.
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


def before_means(
    coefficients: Array,
    rows: Conditions,
    orders: Sequence[float],
    least: float = DEFAULT.verdict.least_left_by_means,
) -> Array:
    """`coefficients` (w,) fitted to `rows`, a sine and a cosine of each of `orders` (cycles an input turn) the first of
    them, as they are on the samples behind these rows. `least` as for `part_left`."""
    left = np.ones(len(coefficients))
    left[: 2 * len(orders)] = np.repeat(part_left(rows, orders, least), 2)
    return coefficients / left


def as_sampled(
    estimate: FitEstimate,
    rows: Conditions,
    orders: Sequence[float],
    least: float = DEFAULT.verdict.least_left_by_means,
) -> FitEstimate:
    """`estimate` with its first coefficients, a sine and a cosine of each of `orders` (cycles an input turn), as the
    samples had them before means of these made the `rows`; the same object where no samples were averaged. `least` as
    for `part_left`."""
    scale = before_means(np.ones(len(estimate.values)), rows, orders, least)
    if np.all(scale == 1):
        return estimate
    profiles = {at: (low * float(scale[at]), high * float(scale[at])) for at, (low, high) in estimate.profiles.items()}
    return replace(
        estimate,
        values=estimate.values * scale,
        covariance=estimate.covariance * np.outer(scale, scale),
        profiles=profiles,
    )
