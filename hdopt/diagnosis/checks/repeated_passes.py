"""What repeated passes over the same angles show: noise differs from pass to pass, what the drive does comes again.

A noise model may take up whatever nothing else explains. Where the drive came by the same input angle more than once,
in the same direction and the same recording, half the mean square difference of what a fit leaves there is all that
can be noise; the mean product of the two is the power of what came again (of two readings e + n and e + m with
independent noise the product is e^2 on average). After a whole number of output turns the same teeth meet again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.diagnosis.inference.cross_validation import paired_t
from hdopt.diagnosis.inference.fit import Fit
from hdopt.recordings.read import TURN
from hdopt.recordings.rows import Rows


@dataclass(frozen=True)
class RepeatedPasses:
    """What a fit leaves (arcmin rms) where it could be compared over `turns` input turns: `scatter` differs from pass
    to pass, `repeated` comes again at the same angle; `t` of the latter over the turns.
    """

    scatter: float
    repeated: float
    turns: int
    t: float

    @property
    def left(self) -> float:
        """All that was left there, arcmin rms."""
        return math.hypot(self.scatter, self.repeated)


NOTHING_REPEATED = RepeatedPasses(0.0, 0.0, 0, 0.0)
"""Where too few angles were passed twice."""


def repeated_passes(fit: Fit) -> RepeatedPasses:
    """What passes over the same angles say of what `fit` leaves; nothing where too few turns were passed twice.

    Each turn is freed of its mean, so that a slow wander, which lasts over many turns, does not look like something
    that comes again.
    """
    rows, settings = fit.problem.rows, fit.problem.settings
    if rows.locked:
        return NOTHING_REPEATED
    one, other = pairs_at_same_angle(rows)
    turns = np.unique(rows.block[one])
    if len(turns) < settings.verdict.fewest_blocks:
        return NOTHING_REPEATED
    count = np.bincount(rows.block)
    left = fit.residual - (np.bincount(rows.block, fit.residual) / count)[rows.block]
    product = left[one] * left[other]
    each = (np.bincount(rows.block[one], product) / np.maximum(np.bincount(rows.block[one]), 1))[turns]
    scatter = float(np.mean((left[one] - left[other]) ** 2)) / 2
    t = paired_t(each, np.zeros(len(each)), settings.held_out)
    return RepeatedPasses(math.sqrt(scatter), math.sqrt(max(float(product.mean()), 0.0)), len(turns), t)


def pairs_at_same_angle(rows: Rows) -> tuple[Index, Index]:
    """Indices of `rows`, two arrays of equal length: rows of one recording and direction that stand within half a row
    of each other, in neighbouring angles of different passes, or of different turns of the output.
    """
    angle, lap = drive_angles(rows)
    visit = np.cumsum(np.r_[False, (np.diff(rows.record) != 0) | (np.diff(rows.direction) != 0)])
    order = np.lexsort((angle, rows.direction, rows.record))
    one, other = order[:-1], order[1:]
    alike = (rows.record[one] == rows.record[other]) & (rows.direction[one] == rows.direction[other])
    apart = (visit[one] != visit[other]) | (lap[one] != lap[other])
    near = angle[other] - angle[one] <= float(np.median(np.abs(np.diff(rows.theta)))) / 2
    kept = alike & apart & near
    return one[kept], other[kept]


def drive_angles(rows: Rows) -> tuple[Array, Index]:
    """Input angle of each of the `rows` (n,) rad, within one output turn where that is a whole number of input turns,
    and which output turn it is, (n,).
    """
    if rows.ratio != round(rows.ratio):
        return rows.theta, np.zeros(len(rows), np.int64)
    lap = np.floor(rows.theta / (rows.ratio * TURN)).astype(np.int64)
    return rows.theta - lap * rows.ratio * TURN, lap
