"""Extremes of the extended model over a full relative turn: a grid, then a zoom into its best local extremes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hdopt.arrays import Array
from hdopt.kinematics.extremes import CANDIDATES, zoom_lowest
from hdopt.simulation.model import ExtendedModel

RIPPLE_POINTS = 64
"""Points in a period of a ripple that is finer than the grid: its peak is met within 0.2 % of its amplitude."""
RIPPLE_PERIODS = 2


def extremes_arcmin(model: ExtendedModel) -> tuple[float, float]:
    """Infimum and supremum of the extended model's kinematic error over one full relative turn, arcmin.

    Of a motion in both directions, over both passes together. Effects whose orders do not fit into the relative turn
    (a bearing's) are met in the one turn that their phases describe.
    """
    found = [pass_extremes_arcmin(model, direction) for direction in model.operation.directions]
    return min(low for low, _ in found), max(high for _, high in found)


def peak_to_peak_arcmin(model: ExtendedModel) -> float:
    """Supremum less infimum of the kinematic error of `model` over one full relative turn, arcmin."""
    low, high = extremes_arcmin(model)
    return high - low


def pass_extremes_arcmin(model: ExtendedModel, direction: float) -> tuple[float, float]:
    """Infimum and supremum of the kinematic error of `model` over one full relative turn that is passed in one
    `direction` (+1 or -1), arcmin; effects too fine for the grid as in `extremes_arcmin`."""
    fine = model.too_fine
    coarse = model.with_effects([effect for effect in model.effects if effect not in fine])
    theta, values = coarse.relative_turn(direction)
    if fine:
        order = max(effect.highest_order(model.ratio) for effect in fine)
        low = _lowest_with_ripple(lambda x: model.waveform(x, direction), theta, values, order)
        high = -_lowest_with_ripple(lambda x: -model.waveform(x, direction), theta, -values, order)
        return low, high
    low = zoom_lowest(lambda x: model.waveform(x, direction), theta, values, model.span)
    high = -zoom_lowest(lambda x: -model.waveform(x, direction), theta, -values, model.span)
    return low, high


def _lowest_with_ripple(function: Callable[[Array], Array], theta: Array, values: Array, order: float) -> float:
    """Least value of `function` near the lowest local minima of the coarse `values`, ripple by ripple."""
    local = np.flatnonzero((values <= np.roll(values, 1)) & (values <= np.roll(values, -1)))
    local = local[np.argsort(values[local])[:CANDIDATES]]
    period = 2 * np.pi / order
    half = max(theta[1] - theta[0], RIPPLE_PERIODS * period)
    offsets = np.arange(-half, half, period / RIPPLE_POINTS)
    return float(min(function(centre + offsets).min() for centre in theta[local]))
