"""Whether an effect that is the same each time it is met is the same from one turn to the next.

A damaged tooth makes the same pulse in every turn. Pulses that come and go, or whose height is drawn anew each time,
have the same mean over the turns, and a fit takes that for a tooth. What is left then follows the effect's own shape,
with another factor in every turn. The factor of one turn is the least-squares one of what the fit leaves on what the
effect adds, both whitened. From one turn to the next these factors differ by the noise alone where the effect is what
it says; over many turns they may follow the output, as the drive's two zones share what they meet.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hdopt.diagnosis.inference.fit import Fit


@dataclass(frozen=True)
class FromTurnToTurn:
    """How an effect's size differs from one turn to the next: its `spread` beyond the noise's, over its mean size, and
    the `t` of that."""

    spread: float
    t: float


def from_turn_to_turn(fit: Fit, index: int) -> FromTurnToTurn:
    """How the size of term `index` of a `fit` differs between neighbouring input turns of its rows.

    Half the mean square of the differences is the variance of a factor. Over the noise's, the squares of K differences
    have a mean of K and a variance of 3 K: 2 each, and each shares a turn with the next. Where it is met in too few
    turns for a verdict nothing is said.
    """
    settings = fit.problem.settings.verdict
    noise, block = fit.problem.noise, fit.problem.rows.block
    added, left = noise.whiten(fit.contribution(index)), noise.whiten(fit.residual)
    power = np.bincount(block, added**2)
    met = power > settings.met_in_a_turn * np.median(power[power > 0]) if power.any() else power > 0
    turns = int(np.count_nonzero(met))
    if turns < settings.fewest_blocks:
        return FromTurnToTurn(0.0, 0.0)
    power = power[met]
    steps = np.diff(np.bincount(block, added * left)[met] / power)
    of_noise = np.mean(left**2) * (1 / power[1:] + 1 / power[:-1])
    weight = 1 / of_noise
    excess = float(np.sum((steps**2 - of_noise) * weight) / np.sum(weight)) / 2
    t = float(np.sum(steps**2 * weight) - len(steps)) / math.sqrt(2 * len(steps) * (1 + 1 / 2))
    return FromTurnToTurn(math.sqrt(max(excess, 0.0)), t)
