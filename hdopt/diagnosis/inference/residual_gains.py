"""Looking at what a fit leaves: gains of further terms with everything already fitted projected out, and its
spectrum.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.inference.base_excitation import excites, is_driven
from hdopt.diagnosis.inference.fit import Fit, side_by_side
from hdopt.diagnosis.inference.normal_equations import orthonormal, solved
from hdopt.diagnosis.inference.read_angle import reads_input
from hdopt.diagnosis.inference.whitened_terms import WhitenedTerms
from hdopt.diagnosis.numerical import RIDGE, TINY
from hdopt.effects.term import Term
from hdopt.recordings.read import TURN


class FitProbe:
    """A `Probe` on a fit: what `keep` lists of its terms (all by default) stays in it, the others' contributions return
    to the residual; searches look at orders in `order_range`.
    """

    def __init__(self, fit: Fit, keep: Sequence[int] | None = None, order_range: tuple[float, float] | None = None):
        self.keep = range(len(fit.terms)) if keep is None else keep
        self.fit = fit
        self.settings = fit.problem.settings.probe
        self.samples = self.rows = fit.problem.rows
        self.motion = fit.motion
        self.order_range = order_range or (0.0, self.rows.highest_order)
        self.noise = fit.problem.noise
        self.swings = bool(fit.problem.behind) or any(is_driven(fit.terms[i]) for i in self.keep)
        self.residual = fit.residual
        for i, term in enumerate(fit.terms):
            if i not in self.keep:
                own = fit.contribution(i)[:, None]
                self.residual = self.residual + (fit.seen(own, self.keep) if excites(term) else own)[:, 0]
        white = fit.white_design(self.keep)
        # The prior on the base keeps directions the data leave open from swallowing an effect.
        prior = np.sqrt(fit.problem.prior_precision(white.shape[1])) * self.noise.sigma
        augmented = np.vstack([white, np.diag(prior)])
        scale = np.sqrt((augmented**2).sum(0))
        basis = orthonormal(augmented / np.where(scale > 0, scale, 1))
        self.basis = np.asfortranarray(basis[: len(white)])
        self.white_residual = self.project(self.noise.whiten(self.residual))
        self.looked_at: dict[tuple[int, ...], tuple[WhitenedTerms, list[Array]]] = {}

    def flipped(self, signs: Array) -> FitProbe:
        """The same with what is left times `signs` (n,), one of each row: noise that is as likely as what was seen,
        where the rows of a turn share one.
        """
        other = self._anew()
        other.residual = signs * self.residual
        other.white_residual = self.project(signs * self.white_residual)
        return other

    def on(self, residual: Array) -> FitProbe:
        """The same with another `residual` (n,), arcmin, in place of what the fit leaves."""
        other = self._anew()
        other.residual = residual
        other.white_residual = self.project(self.noise.whiten(residual))
        return other

    def _anew(self) -> FitProbe:
        """A copy without the spectra of its residual, which knows what this one has looked at."""
        other = copy.copy(self)
        for name in ("_by_input", "_by_output"):
            other.__dict__.pop(name, None)
        return other

    @property
    def has_base(self) -> bool:
        """Whether a base model with meshing zones is fitted beside."""
        return self.fit.problem.base is not None

    def project(self, white: Array) -> Array:
        """Whitened columns with base, offsets and kept terms taken out."""
        return white - self.basis @ (self.basis.T @ white)

    def white_columns(self, term: Term) -> Array:
        """The term's columns, whitened."""
        return self.noise.whiten(self.fit.columns_of(term, self.keep))

    def columns(self, *terms: Term) -> Array:
        """The columns of `terms` beside each other, whitened and projected."""
        return self.project(side_by_side([self.white_columns(term) for term in terms]))

    def _whitened(self, terms: Sequence[Term]) -> WhitenedTerms:
        """The columns of `terms`, whitened; those that hang on nothing but the rows are remembered with them."""
        known, key = self.fit.problem.whitened, tuple(map(id, terms))
        alone = all(self._hangs_on_rows_alone(term) for term in terms)
        if alone and key in known:
            return known[key]
        columns = self.noise.whitened([self.fit.columns_of(term, self.keep) for term in terms])
        white = WhitenedTerms.of(terms, columns)
        if alone:
            known[key] = white
        return white

    def _hangs_on_rows_alone(self, term: Term) -> bool:
        """Whether the columns of `term`, which the rows remember, are the same beside every fit."""
        return term.kept and not (term.in_zones or reads_input(term)) and not (self.swings and excites(term))

    def table(self, term: Term) -> tuple[Array, Array]:
        """Inner products of the term's columns, with the fit projected out, with each other and with the residual."""
        ((gram, absorbed, moment),) = self._products([term])
        return gram - absorbed, moment

    def _products(self, terms: Sequence[Term]) -> Iterator[tuple[Array, Array, Array]]:
        """Of each term's columns with each other, the part of it that the fit absorbs, and with the residual: all
        `terms` in one product with what is fitted.
        """
        white, absorbed = self._absorbed(terms)
        return zip(white.grams, absorbed, white.parts(white.columns.T @ self.white_residual), strict=True)

    def _absorbed(self, terms: Sequence[Term]) -> tuple[WhitenedTerms, list[Array]]:
        """The whitened columns of `terms` and, of each, the part of its inner products that the fit absorbs: remembered
        for other residuals of the same fit where the rows remember the terms.
        """
        key = tuple(map(id, terms))
        if key in self.looked_at:
            return self.looked_at[key]
        white = self._whitened(terms)
        found = white, [part @ part.T for part in white.parts((self.basis.T @ white.columns).T)]
        if all(term.kept for term in terms):
            self.looked_at[key] = found
        return found

    def solve(self, term: Term) -> tuple[float, Array]:
        """Drop of the weighted sum of squares, in noise variances, and the coefficients that bring it."""
        ((gram, absorbed, moment),) = self._products([term])
        return self._solved(gram, absorbed, moment)

    def _solved(self, gram: Array, absorbed: Array, moment: Array) -> tuple[float, Array]:
        """`solve` of a term with such `_products`."""
        scale = np.sqrt(np.maximum(np.diag(gram), TINY))
        # A column that the base absorbs to a millionth has nothing left to say.
        gram = (gram - absorbed) / (scale[:, None] * scale)
        gram.flat[:: len(gram) + 1] += RIDGE
        coefficients = solved(gram, moment / scale) / scale
        return float(moment @ coefficients) / self.noise.sigma**2, coefficients

    def gain(self, term: Term) -> float:
        """Drop of the weighted sum of squares, in noise variances, when `term` joins the fit."""
        return self.solve(term)[0]

    def gains(self, terms: Sequence[Term]) -> list[float]:
        """`gain` of each of `terms` by itself. What is fitted already is gone through once for as many columns as it
        has itself, not once for each term.
        """
        if terms and all(term.kept for term in terms):
            return [self._solved(*products)[0] for products in self._products(terms)]
        most, found, at = self.basis.shape[1], [], 0
        while at < len(terms):
            end, width = at + 1, terms[at].width
            while end < len(terms) and width + terms[end].width <= most:
                width += terms[end].width
                end += 1
            found += [self._solved(*products)[0] for products in self._products(terms[at:end])]
            at = end
        return found

    def gains_of_parts(self, term: Term, parts: Sequence[Sequence[int]]) -> list[float]:
        """`gain` of those columns of `term` alone that each of `parts` lists: all are whitened and projected once."""
        ((gram, absorbed, moment),) = self._products([term])
        blocks = [np.ix_(part, part) for part in parts]
        return [
            self._solved(gram[block], absorbed[block], moment[list(part)])[0]
            for part, block in zip(parts, blocks, strict=True)
        ]

    @cached_property
    def _by_input(self) -> tuple[Array, float]:
        return self._fourier(self.rows.theta)

    @cached_property
    def _by_output(self) -> tuple[Array, float]:
        return self._fourier(self.rows.output * self.rows.ratio)

    def _fourier(self, theta: Array) -> tuple[Array, float]:
        theta = theta - theta.min()
        s = self.settings
        per_turn = s.cells_a_row * 2 ** int(np.ceil(np.log2(max(self.rows.rows_per_turn, s.fewest_rows))))
        span = theta.max() / TURN + 1
        length = 1 << int(np.ceil(np.log2(s.oversampling * span * per_turn)))
        length = min(length, 1 << s.most_cells_log2)
        per_turn = min(per_turn, int(length / (s.folded_span * span)))
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
