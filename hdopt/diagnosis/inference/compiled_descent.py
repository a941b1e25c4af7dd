"""The way down of a fit of which nothing but the base bends, compiled as a whole: it needs no lock of Python's, so that
starts go down beside each other.

Parameters stand in the order of what the columns follow: the base's errors, waves round the splines (each its sine and
its cosine), what is met in the zones, errors of the input angle as it is read, and what nothing moves. The columns of
the last are whitened once, and their products with each other worked out once.

Where an input encoder reads ahead the drive stands behind. How fast its error changes as it turns follows from the
slopes over its parameters: all that the input angle turns is a pair of them, of which the one becomes the other.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.diagnosis.inference.noise import filtered
from hdopt.kinematics.cartesian import CARTESIAN_NAMES, ONCE_ROUND, PARAMETERS
from hdopt.kinematics.cartesian_kernel import BLOCK, Found, Gear, OnSplines, evaluated_into
from hdopt.kinematics.compiled_closed_form import allocating, compiled, entry

TURNED = (CARTESIAN_NAMES.index("axis eccentricity x"), CARTESIAN_NAMES.index("axis tilt x"), *ONCE_ROUND)
"""The place of the errors that the input angle turns into those after them: of the axis once a turn, and of the
splines' own sines with the angle at which they are met."""


class Base(NamedTuple):
    """The base model: its gear, and the tables of measured teeth of CS and FS."""

    gear: Gear
    cs_table: Array
    fs_table: Array


class Problem(NamedTuple):
    """What is fitted: `rotation` (4, n) of the rows, the whitened record `target` (n,), the filter of the noise (`ar`,
    `root_weight`), of each wave its spline and its harmonic (`waves` (w, 2), those of a spline together and rising),
    what either zone sees of each coefficient in the zones, mm (`zones` (2, z, n)), what each coefficient of a reading
    of the input adds to the record, arcmin (`readings` (r, n)), and to the input angle (`gain`, rad per arcmin), whose
    `advance` is that of the flexspline's teeth, whitened columns that nothing moves (`steady` (s, n)); the variance of
    the noise over that of the prior of each error (`precision` (12,)) and the errors' bounds (`box` (12,)).
    """

    rotation: Array
    target: Array
    ar: Array
    root_weight: Array
    waves: Index
    zones: Array
    readings: Array
    gain: float
    advance: float
    steady: Array
    precision: Array
    box: Array


class Effort(NamedTuple):
    """How far and how a descent goes, as in `FitSettings`."""

    iterations: int
    tolerance: float
    damping: float
    tries: int
    singular: float
    up: float
    down: float
    least_up: float
    least: float
    scale_floor: float


@allocating
def _look(base: Base, problem: Problem, x: Array, found: Found) -> tuple[Array, float]:
    """The whitened residual (n,) and the objective at the parameters `x` (q,); what the base does there is `found`."""
    waves, zones, rows = problem.waves, problem.zones, len(problem.target)
    on_cs, on_fs = np.zeros((2, _most(waves, 0))), np.zeros((2, _most(waves, 1)))
    for k in range(len(waves)):
        teeth = on_cs if waves[k, 0] == 0 else on_fs
        for i in range(2):
            teeth[i, waves[k, 1] - 1] += x[PARAMETERS + 2 * k + i]
    first = PARAMETERS + 2 * len(waves)
    extra = np.zeros((2, rows if zones.shape[1] else 1))
    for side in range(2):
        for k in range(zones.shape[1]):
            for i in range(rows):
                extra[side, i] += x[first + k] * zones[side, k, i]
    rotation, row, white = problem.rotation, np.zeros((1, rows)), np.empty((1, rows))
    first += zones.shape[1]
    for k in range(len(problem.readings)):
        for i in range(rows):
            row[0, i] += x[first + k] * problem.readings[k, i]
    if len(problem.readings) > 0:
        rotation = _turned_back(problem, row[0])
    errors, on_splines = x[:PARAMETERS], OnSplines(base.cs_table, base.fs_table, on_cs, on_fs)
    evaluated_into(rotation, base.gear, errors, extra, np.zeros((2, 2, 1)), on_splines, found)
    for i in range(rows):
        row[0, i] += found.value[i]
    filtered(row, problem.ar, problem.root_weight, white)
    residual = np.dot(x[first + len(problem.readings) :], problem.steady)
    for i in range(rows):
        residual[i] = problem.target[i] - residual[i] - white[0, i]
    objective = np.dot(residual, residual)
    for i in range(PARAMETERS):
        objective += problem.precision[i] * errors[i] ** 2
    return residual, objective


@allocating
def _turned_back(problem: Problem, ahead: Array) -> Array:
    """The rotation (4, n) of the rows where the drive stood, whose input was read `ahead` (n,), arcmin at the
    output."""
    given, rotation = problem.rotation, np.empty(problem.rotation.shape)
    for i in range(len(ahead)):
        for spline in range(2):
            angle = problem.gain * ahead[i] * (problem.advance if spline else 1.0)
            cosine, sine = math.cos(angle), math.sin(angle)
            rotation[2 * spline, i] = given[2 * spline, i] * cosine + given[2 * spline + 1, i] * sine
            rotation[2 * spline + 1, i] = given[2 * spline + 1, i] * cosine - given[2 * spline, i] * sine
    return rotation


@compiled
def _most(waves: Index, spline: int) -> int:
    """The highest harmonic of the `waves` on a `spline`, 0 where there are none."""
    most = 0
    for k in range(len(waves)):
        if waves[k, 0] == spline:
            most = max(most, waves[k, 1])
    return most


@allocating
def _moving_columns(problem: Problem, scale: float, zone: Index, columns: Array) -> None:
    """The columns of waves and zones into `columns` (m, n), after those of the errors, which are there."""
    waves, zones = problem.waves, problem.zones
    n = len(zone)
    sine, cosine, s, c = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    for start in range(0, n, BLOCK):
        here = min(BLOCK, n - start)
        reached, spline = 0, -1
        for k in range(len(waves)):
            if waves[k, 0] != spline:
                spline, reached = waves[k, 0], 0
                at = ONCE_ROUND[spline]
                for i in range(here):
                    sine[i], cosine[i] = columns[at, start + i] / scale, columns[at + 1, start + i] / scale
                    s[i], c[i] = 0.0, scale
            for _ in range(waves[k, 1] - reached):
                for i in range(here):
                    s[i], c[i] = s[i] * cosine[i] + c[i] * sine[i], c[i] * cosine[i] - s[i] * sine[i]
            reached = waves[k, 1]
            for i in range(here):
                columns[PARAMETERS + 2 * k, start + i] = s[i]
                columns[PARAMETERS + 2 * k + 1, start + i] = c[i]
    first = PARAMETERS + 2 * len(waves)
    for k in range(zones.shape[1]):
        for i in range(n):
            columns[first + k, i] = scale * (zones[0, k, i] if zone[i] == 0 else zones[1, k, i])


@allocating
def _reading_columns(problem: Problem, x: Array, columns: Array) -> None:
    """The columns of readings into `columns` (m, n), after those of the errors, waves and zones at the parameters `x`
    (q,), which are there: what a reading adds, less what the drive would do where it was read and did not where it
    stood."""
    waves, readings = problem.waves, problem.readings
    if len(readings) == 0:
        return
    first = PARAMETERS + 2 * len(waves) + problem.zones.shape[1]
    slope = np.zeros(columns.shape[1])
    for k in range(len(TURNED)):
        at, speed = TURNED[k], problem.advance if TURNED[k] == ONCE_ROUND[1] else 1.0
        for i in range(len(slope)):
            slope[i] += speed * (x[at] * columns[at + 1, i] - x[at + 1] * columns[at, i])
    for k in range(len(waves)):
        at, speed = PARAMETERS + 2 * k, waves[k, 1] * (problem.advance if waves[k, 0] else 1.0)
        for i in range(len(slope)):
            slope[i] += speed * (x[at] * columns[at + 1, i] - x[at + 1] * columns[at, i])
    for k in range(len(readings)):
        for i in range(len(slope)):
            columns[first + k, i] = readings[k, i] * (1 - problem.gain * slope[i])


@compiled
def _solve(matrix: Array, moment: Array) -> bool:
    """Solves `matrix` x = `moment` for a symmetric positive `matrix` (q, q), whose upper triangle counts, by Cholesky's
    factors in place of both; False where it is not positive."""
    q = len(moment)
    for i in range(q):
        if not matrix[i, i] > 0:
            return False
        root = 1 / math.sqrt(matrix[i, i])
        for j in range(i, q):
            matrix[i, j] *= root
        moment[i] *= root
        for k in range(i + 1, q):
            own = matrix[i, k]
            for j in range(k, q):
                matrix[k, j] -= own * matrix[i, j]
            moment[k] -= own * moment[i]
    for i in range(q - 1, -1, -1):
        for j in range(i + 1, q):
            moment[i] -= matrix[i, j] * moment[j]
        moment[i] /= matrix[i, i]
    return True


@compiled
def _scale_alike(normal: Array, gradient: Array, least: float, scale: Array) -> None:
    """Scales each parameter of the `normal` matrix (q, q), of which the upper triangle counts, and of the `gradient`
    (q,) by the root of its own power, or the `least`: that is its `scale` (q,)."""
    for i in range(len(scale)):
        scale[i] = math.sqrt(max(normal[i, i], least))
    for i in range(len(scale)):
        for j in range(i, len(scale)):
            normal[i, j] /= scale[i] * scale[j]
        gradient[i] /= scale[i]


@compiled
def _damped_step(normal: Array, gradient: Array, damping: float, damped: Array, step: Array) -> bool:
    """The `step` (q,) of scaled parameters by their `normal` matrix (q, q) and `gradient` (q,), with so much `damping`
    on its diagonal, in the place of `damped` (q, q); False where that is not positive."""
    for i in range(len(step)):
        for j in range(i, len(step)):
            damped[i, j] = normal[i, j]
        damped[i, i] += damping
        step[i] = gradient[i]
    return _solve(damped, step)


@compiled
def _copy(given: Array, out: Array, row: int, column: int) -> None:
    """Copy `given` (k, l) into `out` from `row` and `column` on. What an assignment of slices may raise takes seconds
    to compile."""
    for k in range(given.shape[0]):
        for i in range(given.shape[1]):
            out[row + k, column + i] = given[k, i]


@entry
def descended(base: Base, problem: Problem, start: Array, effort: Effort) -> tuple[Array, float]:
    """Where the way down from `start` (q,) ends and the objective there: as `descent.refine` goes, whose rules are the
    `effort`. `base` and `problem` are what is fitted."""
    q, n = len(start), len(problem.target)
    m = q - len(problem.steady)
    found = Found(np.empty(n), np.empty(n, np.int64), np.empty((PARAMETERS, n)))
    columns, design = np.empty((m, n)), np.empty((q, n))
    _copy(problem.steady, design, m, 0)
    normal, gradient, scale = np.empty((q, q)), np.empty(q), np.empty(q)
    among_steady = np.dot(problem.steady, problem.steady.T)
    x, best, trial = start.copy(), np.inf, start.copy()
    damping, tries, taken = effort.damping, 0, -1
    damped = np.empty((q, q))
    while True:
        residual, objective = _look(base, problem, trial, found)
        if taken < 0 or objective < best:
            drop, best = best - objective, objective
            for i in range(q):
                x[i] = trial[i]
            taken += 1
            if taken > 0:
                damping = max(damping / effort.down, effort.least)
            if taken == effort.iterations or (taken > 0 and drop < effort.tolerance * best):
                break
            _copy(found.slopes, columns, 0, 0)
            _moving_columns(problem, base.gear.scale, found.zone, columns)
            _reading_columns(problem, x, columns)
            filtered(columns, problem.ar, problem.root_weight, design)
            # Row by row of the upper triangle would be slow, all at once twice the work.
            for first in range(0, m, 2 * PARAMETERS):
                last = min(first + 2 * PARAMETERS, m)
                _copy(np.dot(design[first:last], design[first:].T), normal, first, first)
            _copy(among_steady, normal, m, m)
            gradient = np.dot(design, residual)
            for i in range(PARAMETERS):
                gradient[i] -= problem.precision[i] * x[i]
                normal[i, i] += problem.precision[i]
            _scale_alike(normal, gradient, effort.scale_floor, scale)
            tries = 0
        else:
            damping, tries = max(damping * effort.up, effort.least_up), tries + 1
        solved = False
        while not solved and tries < effort.tries:
            solved = _damped_step(normal, gradient, damping, damped, trial)
            if not solved:
                damping, tries = damping * effort.singular, tries + 1
        if not solved:
            break
        for i in range(q):
            trial[i] = x[i] + trial[i] / scale[i]
        for i in range(PARAMETERS):
            trial[i] = min(max(trial[i], -problem.box[i]), problem.box[i])
    return x, best
