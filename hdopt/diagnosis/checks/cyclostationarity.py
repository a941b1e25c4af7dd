"""Noise that arises at one angle of the input.

The noise of sensors and of a bench is as large at one angle of a turn as at another. What has a new size each turn but
arises at one angle, as of a hub that slips there or a pulse of random height, follows no effect's shape, and a noise
model may take it up: its mean over the turns is nothing. Its power is not. So what the noise model could not predict
from the rows before is squared and averaged over the turns, angle by angle (second-order cyclostationarity; Antoni,
Mechanical Systems and Signal Processing 23, 2009).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from hdopt.arrays import Array, Index
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.numerical import TINY
from hdopt.recordings.read import TURN
from hdopt.recordings.recording import OF_ROUNDING


@dataclass(frozen=True)
class ArisingAtAnAngle:
    """What a fit leaves that arises about one input `angle` (rad), `rms` (arcmin) of it all: `over_elsewhere` is the
    power of what is new there, over that of a usual angle, `chance` that noise alone makes it so much louder than the
    others at any of the angles: by its rank in each turn, in which one large event is one turn, times the number of
    angles (Bonferroni).
    """

    rms: float
    angle: float
    over_elsewhere: float
    chance: float


NOWHERE = ArisingAtAnAngle(0.0, 0.0, 1.0, 1.0)
"""Noise as large at every angle, or too few turns to say."""


def arising_at_an_angle(fit: Fit) -> ArisingAtAnAngle:
    """Where in the input's turn most of what a `fit` leaves arises; nowhere where its rows cannot say."""
    rows, settings = fit.problem.rows, fit.problem.settings.cyclic
    # Of a coarse encoder whose steps were taken out only rows near an edge say something: where edges are, is angle.
    if rows.locked or rows.output_step > 0 or rows.rows_per_turn < settings.rows_an_angle * settings.angles:
        return NOWHERE
    noise = fit.problem.noise
    known = noise.root_weight > 0
    power = (noise.whiten(fit.residual) ** 2)[known]
    angle = (np.mod(rows.theta[known] / TURN, 1.0) * settings.angles).astype(int) % settings.angles
    count = np.bincount(angle, minlength=settings.angles)
    by_angle = np.bincount(angle, power, minlength=settings.angles) / np.maximum(count, 1)
    usual, loudest = float(np.median(by_angle)), int(np.argmax(by_angle))
    if usual <= TINY:
        return NOWHERE
    beside = [(loudest + off) % settings.angles for off in (-1, 0, 1)]
    share = float(np.sum((np.maximum(by_angle - usual, 0.0) * count)[beside]) / np.sum(power))
    each = _each_turn(power, rows.block[known], angle, settings.angles)
    return ArisingAtAnAngle(
        rms=math.sqrt(share) * float(np.std(fit.residual)),
        angle=(loudest + 1 / 2) * TURN / settings.angles,
        over_elsewhere=float(by_angle[loudest]) / usual,
        chance=min(settings.angles * _chance_of_rank(each, loudest), 1.0),
    )


def _chance_of_rank(each: Array, one: int) -> float:
    """Chance that the angle `one` has so high a rank by its power in `each` turn (turns, angles), nan where unknown, if
    every order of the angles of a turn is as likely; one-sided, by the normal limit of the mean rank (Friedman, Journal
    of the American Statistical Association 32, 1937).
    """
    own, others = each[:, [one]], np.delete(each, one, axis=1)
    known = np.isfinite(own + others).sum(axis=1)
    met = known > 0
    if not met.any():
        return 1.0
    quieter = (others < own).sum(axis=1)[met] / known[met]
    # Of k others any number from 0 to k is as likely to be quieter: their share is uniform, in steps of 1/k.
    variance = OF_ROUNDING**2 * np.sum(1 + 2 / known[met])
    return float(ndtr(-np.sum(quieter - 1 / 2) / math.sqrt(variance)))


def _each_turn(power: Array, turn: Index, angle: Index, angles: int) -> Array:
    """Mean `power` (n,) in each turn at each of the `angles`, (turns, angles), by the numbers of the `turn` (n,) and of
    the `angle` (n,) of each; nan where a turn has no row at an angle. Turns without any row are left out.
    """
    _, turn = np.unique(turn, return_inverse=True)
    cell, cells = turn * angles + angle, (int(turn.max()) + 1) * angles
    count = np.bincount(cell, minlength=cells)
    total = np.bincount(cell, power, minlength=cells)
    mean = np.divide(total, count, out=np.full(cells, np.nan), where=count > 0)
    return np.asarray(mean.reshape(-1, angles), np.float64)
