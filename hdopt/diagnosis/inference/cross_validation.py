"""Held-out error: whole input turns that a fit did not see."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr

from hdopt.arrays import Array, Index
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.numerical import TINY
from hdopt.diagnosis.settings import DEFAULT, HeldOutSettings


@dataclass(frozen=True)
class HeldOut:
    """Squared errors on turns held out, one sum a turn: `plain` in arcmin^2, `white` in noise variances; `rows` a
    turn.
    """

    plain: Array
    white: Array
    rows: Array

    @classmethod
    def of(cls, block: Index, plain: Array, white: Array) -> HeldOut:
        """From the errors of all rows, (n,) each, and the turn of each row."""
        return cls(*(np.asarray(np.bincount(block, w), float) for w in (plain**2, white**2, np.ones(len(block)))))

    @property
    def rms(self) -> float:
        """Root mean square over all rows, arcmin."""
        return float(np.sqrt(self.plain.sum() / self.rows.sum()))

    @property
    def variance(self) -> float:
        """Mean square over all rows, arcmin^2."""
        return float(self.plain.sum() / self.rows.sum())


def held_out(fit: Fit, extra: Array | None, groups: Index) -> HeldOut:
    """Errors of `fit` (linearised where it stands), with `extra` columns beside it, on each group left out in turn.

    `groups` (n,) numbers the fold of each row: all rows of a turn, or of a recording, share one.
    """
    design = fit.design() if extra is None else np.column_stack([fit.design(), extra])
    noise = fit.problem.noise
    linear = fit.design()
    target = fit.residual
    white, white_target = noise.whiten(design), noise.whiten(target)
    precision = np.r_[fit.problem.prior_precision(linear.shape[1]), np.zeros(design.shape[1] - linear.shape[1])]
    prior = noise.sigma**2 * precision
    scale = np.sqrt(np.maximum((white**2).sum(0), TINY))
    # The small ridge (1e-3 of each column's own power) keeps a column
    # that lives in the held-out turns alone from running off.
    white = white / scale
    prior = prior / scale**2
    design = design / scale
    # The prior pulls the base toward zero errors, from where the fit stands.
    pull = np.zeros(len(scale))
    if fit.problem.base is not None:
        pull[: fit.problem.base_width] = prior[: fit.problem.base_width] * scale[: fit.problem.base_width] * fit.errors
    total, moment = white.T @ white, white.T @ white_target
    plain, whitened = np.empty(len(target)), np.empty(len(target))
    for group in np.unique(groups):
        rows = groups == group
        gram = total - white[rows].T @ white[rows] + np.diag(prior + fit.problem.settings.held_out.ridge)
        step = np.linalg.solve(gram, moment - white[rows].T @ white_target[rows] - pull)
        plain[rows] = target[rows] - design[rows] @ step
        whitened[rows] = (white_target[rows] - white[rows] @ step) / noise.sigma
    return HeldOut.of(fit.problem.rows.block, plain, whitened)


def turn_folds(fit: Fit, rng: np.random.Generator) -> Index:
    """A fold for each row of `fit` (n,), whole turns together, drawn by `rng`."""
    blocks = fit.problem.rows.blocks
    fold = rng.permutation(blocks) % min(fit.problem.settings.held_out.folds, max(blocks, 2))
    return np.asarray(fold[fit.problem.rows.block], np.int64)


def paired_t(worse: Array, better: Array, settings: HeldOutSettings = DEFAULT.held_out) -> float:
    """t statistic of the mean difference of two errors a turn, (turns,) each; 0 where there are too few turns.
    Positive where `worse` is larger than `better`. `settings` are the thresholds.
    """
    difference = worse - better
    if len(difference) < settings.fewest_turns:
        return 0.0
    spread = difference.std(ddof=1) / np.sqrt(len(difference))
    return float(difference.mean() / spread) if spread > 0 else 0.0


def paired_chance(worse: Array, better: Array, settings: HeldOutSettings = DEFAULT.held_out) -> float:
    """One-sided chance (Student's t) of a mean difference of two errors a turn, (turns,) each, as large as that of
    `worse` over `better`; 1 where there are too few turns. `settings` are the thresholds.
    """
    t = paired_t(worse, better, settings)
    return 1.0 if t <= 0 else float(stdtr(len(worse) - 1, -t))
