"""Sudden events: steps of the error that no Gaussian noise makes, at moments that no angle sets.

Stick-slip, a joint that gives way, a fitting that works loose: each step is quick, and between the steps the error
creeps back, so that averages, orders and smooth functions of time see little of it, and an autoregressive noise model
takes its mean colour for noise. What gives it away is that the innovations of that noise are far from Gaussian. Each
row of the whitened residual is compared with the trace that a step starting there would leave in it, one that stays
or one that the noise's own memory takes back, in units of the turn's own scatter; single rows that are out (a glitch of
the read-out) and what repeats at an angle do not count.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hdopt.diagnosis.fit import Fit
from hdopt.diagnosis.probe import FitProbe

Array = NDArray[np.float64]

REACH = 16
"""Rows over which a step is looked at."""
OUT = 5.0
"""Standard deviations from which a row starts a step: of 10 000 Gaussian rows 0.006 do."""
OVER_A_GLITCH = 10.0
"""Noise variances by which a step must describe the rows better than a single row that is out."""
FEWEST, FEWEST_TURNS = 8, 5
"""Steps, and turns in which they lie, below which nothing is said."""
AFTER_REVERSAL = 0.05
"""Part of an input turn after a reversal that is left out: a loop that is not quite right is steep there."""
BY_ANGLE = 0.5
"""Mean resultant length of the steps' angles from which an angle sets them."""
NOT_BY_CHANCE = 10.0
"""Rayleigh's statistic (steps times length squared) from which that is no chance: of four looks one in 5000."""


@dataclass(frozen=True)
class Steps:
    """Rows at which steps start, and the rms (arcmin) of what they and the creeping between them add."""

    rows: NDArray[np.int64]
    rms: float

    @property
    def any(self) -> bool:
        return len(self.rows) > 0


def sudden_steps(fit: Fit) -> Steps:
    """The steps in what `fit` leaves; none where there are too few to say so."""
    samples, noise = fit.problem.samples, fit.problem.noise
    none = Steps(np.zeros(0, np.int64), 0.0)
    if samples.locked or len(samples) < 20 * REACH:
        return none
    white = FitProbe(fit).white_residual
    step = 1 - np.r_[0.0, np.cumsum(np.r_[noise.ar, np.zeros(REACH)])[: REACH - 1]]
    glitch = np.r_[1.0, -noise.ar, np.zeros(REACH)][:REACH]
    slip = np.eye(REACH)[0]
    as_step, as_glitch, as_slip = (_scores(white, trace, samples.block) for trace in (step, glitch, slip))
    size = np.maximum(np.abs(as_step), np.abs(as_slip))
    usable = (noise.root_weight[: len(as_step)] > 0) & ~_near_an_edge(samples)[: len(as_step)]
    rows = _separate(size, usable & (size > OUT) & (size**2 > as_glitch**2 + OVER_A_GLITCH))
    if len(rows) < FEWEST or len(np.unique(samples.block[rows])) < FEWEST_TURNS or _set_by_angle(samples, rows):
        return none
    quiet = float(np.var(white[np.abs(white) < 3 * _scatter(white)]))
    return Steps(rows, float(np.sqrt(max(np.var(fit.residual) - quiet, 0.0))))


def _scores(white: Array, trace: Array, block: NDArray[np.int64]) -> Array:
    """Size of `trace` starting at each row, in units of its scatter over the row's turn."""
    score = np.correlate(white, trace, "valid") / np.sqrt(trace @ trace)
    turns = block[: len(score)]
    scatter = np.ones(len(score))
    for turn in np.unique(turns):
        rows = turns == turn
        scatter[rows] = max(_scatter(score[rows]), 1e-300)
    return score / scatter


def _scatter(values: Array) -> float:
    """Standard deviation of the bulk of `values`."""
    return 1.4826 * float(np.median(np.abs(values)))


def _near_an_edge(samples) -> NDArray[np.bool_]:
    """Rows just before or after a reversal or a gap."""
    n = len(samples)
    change = np.flatnonzero((np.diff(samples.direction) != 0) | (np.diff(samples.piece) != 0)) + 1
    after = int(np.ceil(AFTER_REVERSAL * samples.rows_per_turn))
    near = np.zeros(n, bool)
    for start in change:
        near[max(start - REACH, 0) : start + after] = True
    return near


def _separate(size: Array, chosen: NDArray[np.bool_]) -> NDArray[np.int64]:
    """The largest of the chosen rows, and further ones that lie apart from it."""
    left = np.where(chosen, size, 0.0)
    rows = []
    while left.max() > 0:
        row = int(np.argmax(left))
        rows.append(row)
        left[max(row - REACH // 2, 0) : row + REACH // 2] = 0.0
    return np.array(sorted(rows), np.int64)


def _set_by_angle(samples, rows: NDArray[np.int64]) -> bool:
    """Whether the steps come back at an angle of the input, the flexspline or the output, once or twice a turn."""
    theta = samples.theta[rows]
    length = max(
        abs(np.mean(np.exp(1j * times * factor * theta))) for factor in (1.0, 1 + 1 / samples.ratio) for times in (1, 2)
    )
    return bool(length > BY_ANGLE and len(rows) * length**2 > NOT_BY_CHANCE)
