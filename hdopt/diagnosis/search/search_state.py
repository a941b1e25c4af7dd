"""Where a search over sets of effects stands: the best fit of every set that was tried."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.search.candidates import Candidate, penalty_scale, search_terms, weigh
from hdopt.diagnosis.search.penalty import NOTHING_SUBTRACTED, Scale, SubtractedTerms
from hdopt.diagnosis.settings import SearchSettings
from hdopt.effects.term import Term

Names = frozenset[str]


@dataclass(frozen=True)
class SearchPlan:
    """What a search is to do: effects to `skip`; the `order_range` that it looks at (None: all that the rows hold);
    `clean`, a base fitted beside smooth columns, less bent towards what is missing, from which it also starts, and
    `wavy`, one fitted beside waves of the teeth, if those were needed; `known`, the leaders of an earlier search, from
    which it goes on; and what was `subtracted` from the rows before.
    """

    skip: tuple[str, ...] = ()
    order_range: tuple[float, float] | None = None
    clean: Fit | None = None
    wavy: Fit | None = None
    known: tuple[Fit, ...] = ()
    subtracted: SubtractedTerms = NOTHING_SUBTRACTED


@dataclass(frozen=True)
class SearchState:
    """The `base` alone, the best fit of each set of effects tried (`fits`, by the effects' ids), what the search is to
    do (`plan`), how much rougher the noise is than its model (`inflation`), and the stream of random drives (`rng`),
    from which the stages draw in their order.
    """

    base: Fit
    plan: SearchPlan
    inflation: float
    rng: np.random.Generator
    fits: Mapping[Names, Fit] = field(default_factory=dict)

    @property
    def settings(self) -> SearchSettings:
        """Thresholds of the search."""
        return self.base.problem.settings.search

    @property
    def scale(self) -> Scale:
        """What penalties are measured by."""
        return penalty_scale(self.base.problem, self.inflation, self.plan.subtracted)

    @property
    def order_range(self) -> tuple[float, float]:
        """Orders that are looked at."""
        return self.plan.order_range or (0.0, self.base.problem.rows.highest_order)

    def weigh(self, fit: Fit, top_gain: float | None = None, far_pays: bool = True) -> Candidate:
        """`fit` as a candidate, where the best explanation gains `top_gain` (None: this one); `far_pays` as in
        `candidates.weigh`."""
        return weigh(fit, self.base, self.scale, top_gain, far_pays)

    def log_bayes_factor(self, fit: Fit) -> float:
        """That of `fit` against the base alone."""
        return self.weigh(fit).log_bayes_factor

    def above_noise(self, fit: Fit) -> float:
        """By how much what `fit` leaves is above what the noise makes, in noise variances."""
        return fit.objective / fit.problem.noise.sigma**2 / self.inflation - self.scale.rows

    @property
    def top_gain(self) -> float:
        """The largest gain of all fits, noise variances."""
        return max((self.weigh(fit).gain for fit in self.fits.values()), default=0.0)

    @property
    def leader(self) -> Candidate | None:
        """The candidate with the largest log Bayes factor, if it is better than the base alone."""
        top = self.top_gain
        best = max((self.weigh(f, top) for f in self.fits.values()), key=lambda c: c.log_bayes_factor, default=None)
        return best if best is not None and best.log_bayes_factor > 0 else None

    def is_better(self, fit: Fit, known: Fit, by: float) -> bool:
        """Of two fits of the same effects, whose variants may differ in width, whether the first has more evidence, by
        so much. Which drive stands beside them is the data's to say: one far outside its tolerances pays only against
        other effects.
        """
        top = max(self.weigh(fit).gain, self.weigh(known).gain)
        first, second = (self.weigh(f, top, far_pays=False).log_bayes_factor for f in (fit, known))
        return first > second + by

    def would_take(self, fit: Fit) -> bool:
        """Whether `fit` is the first of its set of effects, or better than the one that is known."""
        names = names_of(fit)
        return names not in self.fits or self.is_better(fit, self.fits[names], self.settings.better)

    def with_fit(self, fit: Fit) -> SearchState:
        """The state with `fit` for its set of effects, whatever stood there."""
        return replace(self, fits={**self.fits, names_of(fit): fit})

    def taking(self, fits: Sequence[Fit]) -> SearchState:
        """The state with each of `fits` in turn taken where it is the first of its set or better; the same object where
        none was.
        """
        state = self
        for fit in fits:
            if state.would_take(fit):
                state = state.with_fit(fit)
        return state

    def probe(self, fit: Fit, keep: Sequence[int] | None = None) -> FitProbe:
        """A probe on `fit`, with the terms in `keep` (all by default), at the orders that are looked at."""
        return FitProbe(fit, keep=keep, order_range=self.order_range)

    def terms_for(self, probe: FitProbe, *others: str) -> list[Term]:
        """The best terms for the residual of `probe`, of all effects but those to skip and the `others`."""
        return search_terms(probe, [*self.plan.skip, *others])


def names_of(fit: Fit) -> Names:
    """Ids of the effects of `fit`."""
    return frozenset(term.effect for term in fit.terms)
