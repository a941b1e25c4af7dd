"""Operating conditions among the rows, and the error on whole conditions that a fit did not see.

A condition is a level of speed, torque and temperature at which passes were run. A pass belongs to one condition
whichever way it runs: with one direction left out, play, friction and delay are nothing but an offset, and nobody could
predict the other from it. Where the input is locked, the torque is what is swept and no level.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import Fit, evaluate
from hdopt.diagnosis.settings import DEFAULT, ConditionSettings
from hdopt.recordings.read import TURN
from hdopt.recordings.rows import Rows

SECONDS_A_MINUTE = 60


@dataclass(frozen=True)
class Conditions:
    """`number` (n,) of the condition of each row, and what tells each from the others, in words."""

    number: Index
    names: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.names)


def find_conditions(rows: Rows, settings: ConditionSettings = DEFAULT.conditions) -> Conditions:
    """The conditions of all passes among `rows`; one where nothing differs. `settings` are the thresholds."""
    changes = (np.diff(rows.record) != 0) | (np.diff(rows.direction) != 0)
    runs = np.r_[0, np.cumsum(changes)]
    channels: list[tuple[Array, float, Callable[[float], str]]] = []
    if rows.speed is not None and not rows.locked:
        speed = median_of_runs(runs, np.abs(rows.speed))
        channels.append(
            (speed, settings.level * float(speed.max()), lambda value: f"{value * SECONDS_A_MINUTE / TURN:.3g} r/min")
        )
    if rows.torque is not None and not rows.locked:
        torque = median_of_runs(runs, rows.torque)
        channels.append((torque, settings.level * float(np.abs(rows.torque).max()), lambda value: f"{value:.3g} Nm"))
    if rows.temperature is not None:
        temperature = median_of_runs(runs, rows.temperature)
        channels.append((temperature, settings.level_k, lambda value: f"{value:.3g} deg C"))
    told = [(values, number_levels(values, apart), say) for values, apart, say in channels]
    told = [(values, level, say) for values, level, say in told if level.max() > 0]
    if not told:
        return Conditions(np.zeros(len(runs), np.int64), ("all",))
    _, number = np.unique(np.stack([level for _, level, _ in told]), axis=1, return_inverse=True)
    names = tuple(
        ", ".join(say(float(values[number == k].mean())) for values, _, say in told) for k in range(number.max() + 1)
    )
    return Conditions(number[runs], names)


def median_of_runs(runs: Index, values: Array) -> Array:
    """Median of `values` (n,) over each run, numbered by `runs` (n,): a reversal's slow rows do not count."""
    return np.array([np.median(part) for part in np.split(values, np.flatnonzero(np.diff(runs)) + 1)])


def number_levels(values: Array, apart: float) -> Index:
    """Number of the level of each value, from the lowest up: a gap of more than `apart` starts a new one. `values`
    (n,) in any unit.
    """
    order = np.argsort(values)
    number = np.empty(len(values), np.int64)
    number[order] = np.r_[0, np.cumsum(np.diff(values[order]) > apart)]
    return number


@dataclass(frozen=True)
class AcrossConditions:
    """Errors on conditions that the fit did not see, of the base alone and of the extended model, arcmin rms; the same
    for each condition by its name."""

    base: float
    extended: float
    each: dict[str, tuple[float, float]]


def across_conditions(base: Fit, extended: Fit) -> AcrossConditions | None:
    """Base and extended model on conditions left out; None where there is only one. `base` and `extended` are fits
    of the same rows.
    """
    conditions = find_conditions(base.problem.rows, base.problem.settings.conditions)
    if len(conditions) < 2:
        return None
    folds = conditions.number % base.problem.settings.conditions.most_folds
    errors = [held_out(fit, folds) for fit in ((base,) if extended is base else (base, extended))]
    one, other = errors[0], errors[-1]
    each = {
        name: (rms(one[conditions.number == k]), rms(other[conditions.number == k]))
        for k, name in enumerate(conditions.names)
    }
    return AcrossConditions(rms(one), rms(other), each)


def held_out(fit: Fit, folds: Index) -> Array:
    """Errors (n,) of `fit` on each fold, refitted without it; `folds` (n,) numbers the fold of each row.

    The refit is of the whole nonlinear model, from where it stands: turns of one condition differ little from each
    other, conditions may differ much. What the fit consists of was chosen with all conditions in sight. A recording
    that was zeroed anew brings a zero that no other can know: where a fold alone holds a column that is always free (a
    zero; a drift where one was asked for), that column, and nothing else, is fitted on the fold itself.
    """
    errors = np.empty(len(folds))
    problem, nuisance = fit.problem, fit.problem.nuisance
    for fold in np.unique(folds):
        rows = folds == fold
        blind = problem.with_noise(problem.noise.without(rows))
        again = refine(evaluate(blind, fit.errors, fit.offsets, fit.terms, fit.coefficients))
        residual = again.residual
        own = nuisance[:, ~nuisance[~rows].any(axis=0)]
        if own.shape[1]:
            residual = residual - own @ np.linalg.lstsq(own[rows], residual[rows], rcond=None)[0]
        errors[rows] = residual[rows]
    return errors


def rms(errors: Array) -> float:
    """Root mean square of `errors` (n,)."""
    return float(np.sqrt(np.mean(errors**2)))
