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

from hdopt.arrays import Array, Index, Mask
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.numerical import MAD_TO_SIGMA, TINY
from hdopt.diagnosis.settings import StepSettings
from hdopt.recordings.rows import Rows


@dataclass(frozen=True)
class Steps:
    """Rows at which steps start, and the rms (arcmin) of what they and the creeping between them add."""

    rows: Index
    rms: float

    @property
    def any(self) -> bool:
        """Whether there is one."""
        return len(self.rows) > 0


def sudden_steps(fit: Fit) -> Steps:
    """The steps in what `fit` leaves; none where there are too few to say so."""
    record, noise, settings = fit.problem.rows, fit.problem.noise, fit.problem.settings.steps
    reach = settings.reach
    none = Steps(np.zeros(0, np.int64), 0.0)
    if record.locked or len(record) < settings.record_reaches * reach:
        return none
    white = FitProbe(fit).white_residual
    step = 1 - np.r_[0.0, np.cumsum(np.r_[noise.ar, np.zeros(reach)])[: reach - 1]]
    glitch = np.r_[1.0, -noise.ar, np.zeros(reach)][:reach]
    slip = np.eye(reach)[0]
    as_step, as_glitch, as_slip = (_scores(white, trace, record.block) for trace in (step, glitch, slip))
    size = np.maximum(np.abs(as_step), np.abs(as_slip))
    usable = (noise.root_weight[: len(as_step)] > 0) & ~_near_an_edge(record, settings)[: len(as_step)]
    found = usable & (size > settings.out) & (size**2 > as_glitch**2 + settings.over_a_glitch)
    found &= ~_of_the_encoder(fit)[: len(found)]
    rows = _separate(size, found, reach)
    if len(rows) < settings.fewest or len(np.unique(record.block[rows])) < settings.fewest_turns:
        return none
    if _set_by_angle(record, rows, settings):
        return none
    quiet = float(np.var(white[np.abs(white) < settings.quiet * _scatter(white)]))
    return Steps(rows, float(np.sqrt(max(float(np.var(fit.residual)) - quiet, 0.0))))


def _of_the_encoder(fit: Fit) -> Mask:
    """Rows at which what `fit` leaves jumps by no more than the encoder may. Reading in steps adds up to one of them to
    a jump: only what is beyond one counts against the noise, which may have crossed two.
    """
    settings, step = fit.problem.settings, fit.problem.rows.output_step
    if step == 0:
        return np.zeros(len(fit.residual), bool)
    reach = max(settings.encoder_steps.told * step, step + settings.steps.out * fit.problem.noise.sigma)
    return np.asarray(np.abs(np.diff(fit.residual, prepend=fit.residual[:1])) < reach)


def _scores(white: Array, trace: Array, block: Index) -> Array:
    """Size of `trace` starting at each row, in units of its scatter over the row's turn."""
    score = np.correlate(white, trace, "valid") / np.sqrt(trace @ trace)
    turns = block[: len(score)]
    scatter = np.ones(len(score))
    for turn in np.unique(turns):
        rows = turns == turn
        scatter[rows] = max(_scatter(score[rows]), TINY)
    return score / scatter


def _scatter(values: Array) -> float:
    """Standard deviation of the bulk of `values`."""
    return MAD_TO_SIGMA * float(np.median(np.abs(values)))


def _near_an_edge(record: Rows, settings: StepSettings) -> Mask:
    """Rows just before or after a reversal or a gap."""
    n = len(record)
    change = np.flatnonzero((np.diff(record.direction) != 0) | (np.diff(record.piece) != 0)) + 1
    after = int(np.ceil(settings.after_reversal * record.rows_per_turn))
    near = np.zeros(n, bool)
    for start in change:
        near[max(start - settings.reach, 0) : start + after] = True
    return near


def _separate(size: Array, chosen: Mask, reach: int) -> Index:
    """The largest of the chosen rows, and further ones that lie half a `reach` apart from it."""
    left: Array = np.where(chosen, size, 0.0)
    rows: list[int] = []
    while left.max() > 0:
        row = int(np.argmax(left))
        rows.append(row)
        left[max(row - reach // 2, 0) : row + reach // 2] = 0.0
    return np.array(sorted(rows), np.int64)


def _set_by_angle(record: Rows, rows: Index, settings: StepSettings) -> bool:
    """Whether the steps come back at an angle of the input, the flexspline or the output, once or twice a turn."""
    theta = record.theta[rows]
    length = max(
        abs(np.mean(np.exp(1j * times * factor * theta))) for factor in (1.0, 1 + 1 / record.ratio) for times in (1, 2)
    )
    return bool(length > settings.by_angle and len(rows) * length**2 > settings.not_by_chance)
