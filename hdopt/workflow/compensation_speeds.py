"""What of the error depends on the speed: what grows with it, and what each speed has of its own."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from hdopt.arrays import Array, Index, Mask
from hdopt.compensation.of_speed import APART, lag_of, low_orders, shows_lag, signed_rpm
from hdopt.compensation.pursuit import dictionary, independent_share, pursue
from hdopt.compensation.surface import Harmonics, nothing
from hdopt.recordings.recording import TURN
from hdopt.recordings.rows import Rows
from hdopt.workflow.compensation_samples import Samples
from hdopt.workflow.compensation_trials import centred, folds, part_of

TERMS = 16
"""Coefficients that a speed may have of its own."""
SURE = 2.0
"""Standard errors by which the held-out squares of a speed must fall for terms of its own (one-sided 98 %)."""
WORTH = 0.05
"""Share of the rms, held out, that they must take."""
STEADY = 0.1
"""Share by which a row may be off a speed to be fitted to it: not those of starts and stops."""
STRETCHES = 10
"""Input turns over which held-out squares are taken together."""


def speeds_rpm(rows: Rows) -> list[float | None]:
    """The usual input speed of each of the records in `rows`, r/min; None without a clock."""
    records = range(int(rows.record.max()) + 1)
    if rows.speed is None:
        return [None for _ in records]
    size = np.abs(signed_rpm(rows))
    return [float(np.median(size[rows.record == n])) for n in records]


def of_each_speed(speeds: Sequence[float | None]) -> list[list[int]]:
    """The numbers of the records at each of the `speeds` (r/min) that differ by more than `APART`, slowest first; []
    where a record has no clock or stands."""
    groups: list[list[int]] = []
    for number in sorted(range(len(speeds)), key=lambda n: speeds[n] or 0.0):
        speed, first = speeds[number], speeds[groups[-1][0]] if groups else None
        if not speed:
            return []
        if first and speed < (1 + APART) * first:
            groups[-1].append(number)
        else:
            groups.append([number])
    return groups


def lag_in(rows: Rows, left: Array) -> float:
    """What is `left` (n,) of `rows` for each r/min of the input, arcmin, beside a zero of each record, a return error
    that no speed changes and the input's lowest orders; 0 where that is chance or cannot be told."""
    rpm = signed_rpm(rows)
    if not shows_lag(rpm):
        return 0.0
    zeros = (rows.record[:, None] == np.arange(rows.records)).astype(float)
    columns = np.column_stack([zeros, rows.direction, low_orders(rows.theta)])
    basis, _ = np.linalg.qr(columns)
    rest = left - basis @ (basis.T @ left)
    return lag_of(left, columns, rpm, independent_share(rest))


def own_of_each_speed(rows: Rows, samples: Samples, left: Array, terms: int) -> tuple[dict[float, Harmonics], Array]:
    """What each speed (r/min, negative backward ->) of the records in `rows` has of its own in what a common
    compensation has `left` (N,) arcmin of their `samples`, at most so many `terms` each, none where they do not pay;
    and what is left (N,) with them, held out.

    A load that swings lags behind in time: ahead in angle one way, behind it the other. {} where all turn at one speed.
    """
    known, rpm = speeds_rpm(rows), signed_rpm(rows)
    groups = of_each_speed(known)
    again, own, means = left.copy(), {}, samples.means(left)
    for group, way in itertools.product(groups if len(groups) > 1 else (), (-1.0, 1.0)):
        speed = way * (known[group[0]] or 0.0)
        mine = np.isin(rows.record, group) & (rows.direction == way)
        if not mine.any():
            continue
        part, rest = part_of(rows, mine), means[mine]
        behind, here = samples.of_rows(mine), mine[samples.row]
        each, had = behind.each, left[here]
        steady = np.abs(rpm[mine] - speed) < STEADY * abs(speed)
        fold = _parts(part)
        tried, parts = had.copy(), fold[behind.row]
        for k in range(int(fold.max()) + 1):
            found = _fitted(part, rest, (fold != k) & steady, terms)
            tried[parts == k] -= found.at(*_angles(each, parts == k))
        pays = _pays(each, centred(had, each, np.zeros_like(parts)), centred(tried, each, np.zeros_like(parts)))
        own[speed] = _fitted(part, rest, steady, terms) if pays else nothing()
        if pays:
            again[here] = tried
    return own, again


def _parts(rows: Rows) -> Index:
    """The part (n,) of each of `rows`: parts of each record by itself, so that what others have learnt is of its
    speed."""
    fold = np.zeros(len(rows), np.int64)
    for record in range(rows.records):
        mine = rows.record == record
        fold[mine] = folds(part_of(rows, mine))[0]
    return fold


def _angles(rows: Rows, some: Mask) -> tuple[Array, Array]:
    theta = rows.theta[some]
    return theta, theta / rows.ratio


def _fitted(rows: Rows, left: Array, some: Mask, terms: int) -> Harmonics:
    """At most so many `terms` of what is `left` (n,) of `some` of the `rows`."""
    zeros = (rows.record[some, None] == np.arange(rows.records)).astype(float)
    zeros = zeros[:, zeros.any(axis=0)]
    angles = _angles(rows, some)
    if not zeros.size:
        return nothing()
    found = pursue(angles, left[some], zeros, None, dictionary(float(np.ptp(angles[0])) / TURN / rows.ratio), terms)
    return found.sharpened(rows.ratio, TURN / rows.rows_per_turn, round(rows.averaged))


def _pays(rows: Rows, before: Array, after: Array) -> bool:
    """Whether what is left held out falls from `before` to `after`, (n,) each, beyond chance and by enough."""
    if np.std(after) > (1 - WORTH) * np.std(before):
        return False
    _, group = np.unique(rows.block // STRETCHES, return_inverse=True)
    fall = np.bincount(group, before**2 - after**2) / np.bincount(group)
    error = float(fall.std(ddof=1)) / math.sqrt(len(fall)) if len(fall) > 1 else math.inf
    return bool(fall.mean() > SURE * error)
