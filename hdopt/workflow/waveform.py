"""The kinematic error of a study's one drive over a relative turn: what `hdopt ke` and the report both show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from hdopt.arrays import Array
from hdopt.kinematics.extremes import (
    extremes_arcmin,
    held_peak_to_peak,
    interpolated_waveform,
    lowest_and_where,
    tooth_width_peak_to_peak_arcmin,
)
from hdopt.kinematics.waveform import DEFAULT_METHOD, relative_turn, relative_turn_points
from hdopt.recordings.orders import ModelOrder, model_orders
from hdopt.simulation import ExtendedModel
from hdopt.simulation.extremes import extremes_arcmin as extended_extremes_arcmin
from hdopt.simulation.extremes import pass_extremes_arcmin
from hdopt.study import Study
from hdopt.workflow.effect_selection import extended_model
from hdopt.workflow.effect_table import effect_orders

SAMPLES_PER_TURN = 720


@dataclass(frozen=True)
class WaveformResult:
    """A drive's kinematic error (arcmin) over `theta` (rad) of one relative turn, the part of it that its zones drive,
    the orders worth a look; `method` of its geometry; the `direction` of motion shown, of `directions` in all."""

    method: str
    theta: Array
    waveform: Array
    driven: Array
    orders: tuple[ModelOrder, ...]
    direction: float = 1.0
    directions: int = 1


def model_of(study: Study, method: str = DEFAULT_METHOD) -> ExtendedModel:
    """The drive of `study` with the effects that count, by the geometry's `method`."""
    return replace(extended_model(study), geometry=method)


def waveform_of(study: Study, method: str = DEFAULT_METHOD) -> WaveformResult:
    """The waveform of the drive of `study`, with its effects in the first direction of the motion; `method` is "exact"
    or "closed form"."""
    named = model_orders(study.drive.geometry.ratio)
    if not study.effects:
        theta, error = relative_turn(study.drive, study.errors, SAMPLES_PER_TURN, method)
        return WaveformResult(method, theta, error, error, named)
    model = resolved(model_of(study, method))
    directions = model.operation.directions
    theta, error = model.relative_turn(directions[0])
    _, points = relative_turn_points(model.drive, model.errors, model.samples_per_turn, method)
    driven = model.driven(theta, points, directions[0])
    orders = (*named, *effect_orders(model))
    return WaveformResult(method, theta, error, driven, orders, directions[0], len(directions))


def resolved(model: ExtendedModel) -> ExtendedModel:
    """`model` without the effects that are too fine for a grid over the relative turn."""
    return model.with_effects([effect for effect in model.effects if effect not in model.too_fine])


def converged_extremes_arcmin(study: Study, method: str = DEFAULT_METHOD) -> tuple[float, float]:
    """Essential infimum and supremum of the drive of `study`, with its effects, arcmin, k_e = 1; `method` is "exact" or
    "closed form"."""
    if study.effects:
        return extended_extremes_arcmin(model_of(study, method))
    return extremes_arcmin(study.drive, study.errors, method)


def extremes_of(shown: WaveformResult, study: Study) -> tuple[tuple[float, float], tuple[float, float]]:
    """The lowest and the highest point of the waveform `shown` of a `study`, each as its input angle (rad) and its
    converged error (arcmin): those of the direction shown, between the points of the grid too.

    Effects too fine for the grid, which the waveform leaves out, count in the errors and move no angle.
    """
    drive = study.drive
    span = 2 * np.pi * drive.geometry.beat_phases
    waveform: Callable[[Array], Array]
    if study.effects:
        model = model_of(study, shown.method)
        low, high = pass_extremes_arcmin(model, shown.direction)
        waveform = partial(resolved(model).waveform, direction=shown.direction)
    else:
        low, high = extremes_arcmin(drive, study.errors, shown.method)
        waveform = interpolated_waveform(drive, study.errors, shown.method)
    lowest, _ = lowest_and_where(waveform, shown.theta, shown.waveform, span)
    highest, _ = lowest_and_where(lambda x: -waveform(x), shown.theta, -shown.waveform, span)
    return (lowest, low), (highest, high)


def held_arcmin(study: Study, method: str = DEFAULT_METHOD) -> float:
    """The peak-to-peak of the drive of `study` that holds over the width of one FS tooth, arcmin, k_e = 1, by `method`.

    With effects it is the largest of the directions of the motion, without effects too fine for the grid.
    """
    if not study.effects:
        return tooth_width_peak_to_peak_arcmin(study.drive, study.errors, method)
    model = resolved(model_of(study, method))
    width = 2 * np.pi / study.drive.geometry.flexspline_teeth
    spans = []
    for direction in model.operation.directions:
        theta, values = model.relative_turn(direction)
        waveform = partial(model.waveform, direction=direction)
        spans.append(held_peak_to_peak(waveform, theta, values, width))
    return max(spans)
