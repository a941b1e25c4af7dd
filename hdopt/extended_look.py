"""What `hdopt ke` and the report show of a drive's waveform, with its effects."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdopt.analysis import Look
from hdopt.extended import AddedEffect, ExtendedModel
from hdopt.extended.extremes import extremes_arcmin, peak_to_peak_arcmin
from hdopt.included import Inclusion, inclusion
from hdopt.kinematics.waveform import relative_turn_deviation
from hdopt.spectrum import ModelOrder, model_orders
from hdopt.study import Study
from hdopt.study.effects import effect_keys

Array = NDArray[np.float64]

SAME_ORDER = 1e-9
PER_CYCLE = 4
"""Samples in a cycle below which an order is left out of the spectrum."""


def extended_look(study: Study, model: ExtendedModel, base_peak_to_peak: float, k_e: float | None) -> Look:
    """The study's `model` with the effects that count; `base_peak_to_peak` (arcmin) is without any, `k_e` evens the
    zones out."""
    chosen = inclusion(study, "all")
    low, high = extremes_arcmin(model)
    resolved = model.with_effects([effect for effect in model.effects if effect not in model.too_fine])
    direction = model.operation.directions[0]
    theta, waveform = resolved.relative_turn(direction)
    orders = (*model_orders(model.ratio), *effect_orders(resolved))
    return Look(
        low,
        high,
        None if k_e is None else peak_to_peak_arcmin(replace(model, homogenization=k_e)),
        theta,
        waveform,
        driven_waveform(resolved, direction),
        orders,
        effect_table(study, model, chosen, high - low, base_peak_to_peak),
        (*chosen.says, *remarks(model)),
    )


def driven_waveform(model: ExtendedModel, direction: float) -> Array:
    """What the zones drive over one full relative turn, arcmin: the error without what is beside the zones."""
    theta, deviation = relative_turn_deviation(model.drive, model.errors, model.samples_per_turn, model.geometry)
    return model.driven(theta, deviation, direction)


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
    """A row an effect: where it comes from, whether it counts, its numbers, its own size, and what it adds (arcmin) to
    the peak-to-peak of the others that count; `whole` is theirs together, `base` without any."""
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
    """In plain words, what the operating condition or the grid keeps from showing."""
    found = []
    for effect in _of(model.effects, "hysteresis", "lost_motion", "channel_delay"):
        if model.operation.motion != "both":
            found.append(
                f"{effect.id} only shifts a one-way motion, which leaves its peak-to-peak as it is; "
                'operation.motion = "both" shows it'
            )
    for effect in _of(model.effects, "torsional_windup", "thermal_drift"):
        if "angle" not in effect.shape and "time_constant_s" not in effect.shape:
            found.append(f"{effect.id} only shifts the error here, since the operating condition is constant")
    if _of(model.effects, "bearing_pass"):
        found.append(
            "bearing_pass never repeats: it is met in the relative turn that its phases describe, others differ"
        )
    if model.operation.motion == "both" and _of(model.effects, "resonance"):
        found.append("resonance is that of steady running in each direction, without what a reversal stirs up")
    if model.too_fine:
        names = ", ".join(effect.id for effect in model.too_fine)
        found.append(f"{names}: finer than the spectrum's grid, so in the peak-to-peak but not in the orders")
    return found


def _of(effects: Sequence[AddedEffect], *ids: str) -> list[AddedEffect]:
    return [effect for effect in effects if effect.id in ids]


def walked_extended_arcmin(model: ExtendedModel, sampling: float, turns: float) -> float:
    """Peak-to-peak of the extended model only on a grid, arcmin: every `sampling` rad over `turns` input turns from 0,
    the end included, in each direction of the motion."""
    steps = round(turns * 2 * math.pi / sampling)
    theta = np.minimum(np.arange(steps + 1) * sampling, turns * 2 * math.pi)
    values = [model.waveform(theta, direction) for direction in model.operation.directions]
    return float(np.ptp(np.concatenate(values)))
