"""What `hdopt ke` and the report say of a drive's effects."""

from __future__ import annotations

import math
from typing import Any  # Any: values of JSON

import numpy as np

from hdopt.recordings.orders import ModelOrder, model_orders
from hdopt.simulation import ExtendedModel
from hdopt.simulation.extremes import peak_to_peak_arcmin
from hdopt.study import Study
from hdopt.workflow.effect_selection import Inclusion

SAME_ORDER = 1e-9
PER_CYCLE = 4
"""Samples in a cycle below which an order is left out of the spectrum."""


def effect_orders(model: ExtendedModel) -> tuple[ModelOrder, ...]:
    """Orders that the effects add to those of the base model, as far as the grid over the relative turn shows them."""
    found: list[ModelOrder] = []
    known = [order.order for order in model_orders(model.ratio)]
    for effect in model.effects:
        for order in effect.orders(model.ratio):
            if order > model.samples_per_turn / PER_CYCLE or any(abs(order - o) < SAME_ORDER for o in known):
                continue
            known.append(order)
            found.append(ModelOrder(f"{order:.6g}", order, effect.id))
    return tuple(found)


def effect_table(
    study: Study, model: ExtendedModel, chosen: Inclusion, whole: float, base: float
) -> tuple[dict[str, Any], ...]:
    """A row an effect of the `study`: id, origin, whether it is counted, its numbers by study key, and what it adds.

    `model` has the effects that are counted, `chosen` says which those are. `whole` is the peak-to-peak of the model,
    `base` that without any effect, arcmin. `adds_arcmin` is how much the peak-to-peak would fall if this effect alone
    were taken out, arcmin; None where it is not counted.
    """
    from hdopt.study.effects import effect_keys

    rows = []
    for effect in study.effects:
        counted = effect in chosen.counted
        if counted:
            others = [other for other in chosen.counted if other is not effect]
            adds = whole - (peak_to_peak_arcmin(model.with_effects(others)) if others else base)
        else:
            adds = None
        rows.append(
            {
                "id": effect.id,
                "origin": effect.origin,
                "counted": counted,
                "adds_arcmin": adds,
                "parameters": dict(effect_keys(effect, study.drive.geometry)),
            }
        )
    return tuple(rows)


def remarks(model: ExtendedModel) -> list[str]:
    """In plain words, what the operating condition or the grid of the `model` keeps from showing; [] for nothing."""
    both_ways = len(model.operation.directions) > 1
    found = [said for effect in model.effects if (said := effect.remark(both_ways)) is not None]
    if model.too_fine:
        names = ", ".join(effect.id for effect in model.too_fine)
        found.append(f"{names}: finer than the spectrum's grid, so in the peak-to-peak but not in the orders")
    return found


def walked_extended_arcmin(model: ExtendedModel, sampling: float, turns: float) -> float:
    """Peak-to-peak of the extended model only on a grid, arcmin: every `sampling` rad over `turns` input turns from 0,
    the end included, in each direction of the motion."""
    steps = round(turns * 2 * math.pi / sampling)
    theta = np.minimum(np.arange(steps + 1) * sampling, turns * 2 * math.pi)
    values = [model.waveform(theta, direction) for direction in model.operation.directions]
    return float(np.ptp(np.concatenate(values)))
