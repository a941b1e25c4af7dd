"""Looking at what a fit leaves: gains of further terms with everything already fitted projected out, and its
spectrum.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hdopt.diagnosis.effect import Term
from hdopt.diagnosis.fit import Fit
from hdopt.diagnosis.transmission import excites, is_driven
from hdopt.recording import TURN

Array = NDArray[np.float64]


class FitProbe:
    """A `Probe` on a fit. Terms of the fit listed in `keep` stay in it, the others' contributions return to the
    residual.
    """

    def __init__(self, fit: Fit, keep: Sequence[int] | None = None, order_range: tuple[float, float] | None = None):
        self.keep = range(len(fit.terms)) if keep is None else keep
        self.fit = fit
        self.samples = fit.problem.samples
        self.motion = fit.motion
        self.order_range = order_range or (0.0, self.samples.highest_order)
        self.noise = fit.problem.noise
        self.swings = any(is_driven(fit.terms[i]) for i in self.keep)
        self.residual = fit.residual
        for i, term in enumerate(fit.terms):
            if i not in self.keep:
                own = fit.contribution(i)[:, None]
                self.residual = self.residual + (fit.seen(own, self.keep) if excites(term) else own)[:, 0]
        design = fit.design(self.keep)
        white = self.noise.whiten(design)
        # The prior on the base keeps directions the data leave open from swallowing an effect.
        prior = np.sqrt(fit.prior_precision(design.shape[1])) * self.noise.sigma
        augmented = np.vstack([white, np.diag(prior)])
        scale = np.sqrt((augmented**2).sum(0))
        basis, size, _ = np.linalg.svd(augmented / np.where(scale > 0, scale, 1), full_matrices=False)
        rank = int(np.sum(size > 1e-7 * size[0]))
        self.basis = np.asfortranarray(basis[: len(white), :rank])
        self.white_residual = self.project(self.noise.whiten(self.residual))

    def project(self, white: Array) -> Array:
        """Whitened columns with base, offsets and kept terms taken out."""
        return white - self.basis @ (self.basis.T @ white)

    def white_columns(self, term: Term) -> Array:
        """The term's columns, whitened."""
        return self.noise.whiten(self.fit.columns_of(term, self.keep))

    def columns(self, term: Term) -> Array:
        """The term's columns, whitened and projected."""
        return self.project(self.white_columns(term))

    def _whitened(self, term: Term) -> tuple[Array, Array]:
        """The term's whitened columns and their inner products."""
        known = self.fit.problem.whitened
        alone = term.kept and term.zones is None and not (self.swings and excites(term))
        if alone and id(term) in known:
            return known[id(term)][1:]
        white = self.white_columns(term)
        gram = white.T @ white
        if alone:
            known[id(term)] = (term, white, gram)
        return white, gram

    def table(self, term: Term) -> tuple[Array, Array]:
        """Inner products of the term's columns, with the fit projected out, with each other and with the residual."""
        gram, absorbed, moment = self._products(term)
        return gram - absorbed, moment

    def _products(self, term: Term) -> tuple[Array, Array, Array]:
        """Of the term's columns with each other, the part of it that the fit absorbs, and with the residual."""
        white, gram = self._whitened(term)
        absorbed = self.basis.T @ white
        return gram, absorbed.T @ absorbed, white.T @ self.white_residual

    def solve(self, term: Term) -> tuple[float, Array]:
        """Drop of the weighted sum of squares, in noise variances, and the coefficients that bring it."""
        gram, absorbed, moment = self._products(term)
        scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
        # A column that the base absorbs to a millionth has nothing left to say.
        gram = (gram - absorbed) / np.outer(scale, scale) + 1e-6 * np.eye(len(gram))
        coefficients = np.linalg.solve(gram, moment / scale) / scale
        return float(moment @ coefficients) / self.noise.sigma**2, coefficients

    def gain(self, term: Term) -> float:
        return self.solve(term)[0]

    @cached_property
    def _by_input(self) -> tuple[Array, float]:
        return self._fourier(self.samples.theta)

    @cached_property
    def _by_output(self) -> tuple[Array, float]:
        return self._fourier(self.samples.output * self.samples.ratio)

    def _fourier(self, theta: Array) -> tuple[Array, float]:
        theta = theta - theta.min()
        per_turn = 8 * 2 ** int(np.ceil(np.log2(max(self.samples.rows_per_turn, 16))))
        span = theta.max() / TURN + 1
        length = 1 << int(np.ceil(np.log2(4 * span * per_turn)))
        length = min(length, 1 << 21)
        per_turn = min(per_turn, int(length / (2.5 * span)))
        cell = np.round(theta / TURN * per_turn).astype(np.int64)
        signal = np.bincount(cell, self.residual - self.residual.mean(), minlength=length)[:length]
        return 2 * np.abs(np.fft.rfft(signal)) / len(theta), length / per_turn

    def spectrum(self, orders: Array, of_output: bool = False) -> Array:
        """Amplitude (arcmin) of the residual at each order, by the Fourier sum at the nearest quarter resolution.

        Orders count cycles of the input, or, with `of_output`, of N times the output angle as its encoder read it.
        """
        amplitude, periods = self._by_output if of_output else self._by_input
        index = np.round(np.asarray(orders) * periods).astype(np.int64)
        return amplitude[np.clip(index, 0, len(amplitude) - 1)]
