"""Held-out error: whole input turns that a fit did not see."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.numerical import SMALL_RIDGE, TINY
from hdopt.diagnosis.settings import DEFAULT, HeldOutSettings
from hdopt.effects.term import Term


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
    prior = noise.sigma**2 * np.r_[fit.prior_precision(linear.shape[1]), np.zeros(design.shape[1] - linear.shape[1])]
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


def family_wise_p(
    probe: FitProbe,
    terms: Sequence[Term],
    penalties: Sequence[float],
    rng: np.random.Generator,
    observed: float,
    inflation: float,
) -> float:
    """Share of random sign flips of whole turns whose best score over ALL `terms`, less their `penalties`, reaches
    `observed` (log evidence), where the noise is rougher by `inflation`.

    Under no effect the turns' scores are as likely with one sign as with the other, whatever the noise's colour
    within a turn; the maximum over the whole catalogue pays for having looked at all of it (Westfall, Young
    1993). A few turns have few sign patterns: of b turns no chance below 1 in 2^(b - 1) can be shown. `probe`
    looks at the base alone. `rng` draws what is random.
    """
    block = probe.rows.block
    blocks, flips = int(block[-1]) + 1, probe.fit.problem.settings.held_out.flips
    signs = rng.choice([-1.0, 1.0], size=(flips, blocks))
    best = np.full(flips, -np.inf)
    sigma2 = probe.noise.sigma**2
    for term, penalty in zip(terms, penalties, strict=True):
        columns = probe.columns(term)
        scores = np.zeros((blocks, columns.shape[1]))
        np.add.at(scores, block, columns * probe.white_residual[:, None])
        gram = columns.T @ columns
        gram += SMALL_RIDGE * np.trace(gram) / len(gram) * np.eye(len(gram))
        flipped = signs @ scores
        gain = np.einsum("ri,ri->r", flipped, np.linalg.solve(gram, flipped.T).T) / sigma2
        best = np.maximum(best, gain / 2 / inflation - penalty)
    return max(float((1 + np.sum(best >= observed)) / (1 + flips)), 2.0 ** (1 - blocks))
