"""The chance that noise alone does as well as what was found: the whole search, made again on noise."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.search.penalty import Scale, penalty
from hdopt.diagnosis.settings import HeldOutSettings
from hdopt.effects.term import Term

GUMBEL_SPREAD = math.pi / math.sqrt(6)
"""Standard deviation of the largest of many exponential scores, of unit scale."""
GUMBEL_MEAN = float(np.euler_gamma)
"""Mean of the same."""


def best_score(probe: FitProbe, terms: Sequence[Term], scale: Scale) -> float:
    """Log evidence of the best single one of `terms` for what `probe` sees; minus infinity where there is none. `scale`
    is what penalties are measured by.
    """
    return max((probe.gain(t) / 2 / scale.inflation - penalty([t], 0.0, scale) for t in terms), default=-np.inf)


def false_alarm_chance(
    probe: FitProbe, score: Callable[[FitProbe], float], rng: np.random.Generator, observed: float, most: int
) -> float:
    """Chance that noise alone reaches `observed`, by random sign flips of whole turns, drawn by `rng`, of what `probe`
    looks at: the noise, that is what the best explanation leaves (Freedman, Lane, J. Bus. Econ. Stat. 1, 1983; an
    effect whose turns were flipped would be no noise). `score` searches anew under each flip, so that shapes are as
    free there as they were in the recording.

    Under no effect the turns are as likely with one sign as with the other, whatever the noise's colour within a turn,
    and the best score over the whole catalogue pays for having looked at all of it (Westfall, Young 1993). Flips go on
    until a few reach `observed`: of h after n, h/n is a true chance, never too small (Besag, Clifford, "Sequential
    Monte Carlo p-values", Biometrika 78, 1991). Where `observed` lies so far out that the largest of exponential
    scores (Gumbel's distribution of their mean and spread, its scale widened for safety) is hardly ever there, the
    least chance that is told stands at once; after `most` flips that all stayed below it is 1 / (1 + `most`). Of b
    turns there are 2^(b - 1) patterns: no chance below is shown.
    """
    settings = probe.fit.problem.settings.held_out
    block = probe.rows.block
    blocks = int(block[-1]) + 1
    least = max(settings.least_chance, 2.0 ** (1 - blocks))
    if np.isneginf(observed):
        return 1.0
    scores: list[float] = []
    for _ in range(most):
        scores.append(score(probe.flipped(rng.choice([-1.0, 1.0], size=blocks)[block])))
        reached = sum(one >= observed for one in scores)
        if reached == settings.enough_reached:
            return max(reached / len(scores), least)
        if not reached and len(scores) >= settings.fewest_flips and tail(scores, observed, settings) < least:
            return least
    return max((1 + reached) / (1 + most), least)


def tail(scores: Sequence[float], observed: float, settings: HeldOutSettings) -> float:
    """Chance that one more like the `scores`, the largest of many each, reaches `observed`, by Gumbel's distribution of
    their mean and spread, its scale not below that of log evidence and widened by the `settings`.
    """
    scale = max(float(np.std(scores, ddof=1)) / GUMBEL_SPREAD, 1.0)
    middle = float(np.mean(scores)) - GUMBEL_MEAN * scale
    # As `scipy.stats.gumbel_r.sf`, which for this one number takes most of a second to load.
    return -math.expm1(-math.exp((middle - observed) / (settings.tail_safety * scale)))
