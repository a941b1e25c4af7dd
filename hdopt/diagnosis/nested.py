"""The held-out error of a whole diagnosis: every stage of it on some turns alone, and its error on the others.

What is refitted by one linear step with the rest in sight (`inference.cross_validation`) has had its effects, shapes,
zones and noise chosen on the very turns that it then predicts. Here the turns are taken out of the recordings before
the first stage; orientation, scale, noise, search, shapes and drive all come from what is left (an orientation that
the base leaves open is not searched for twice). One split: a fold more would cost one diagnosis more.

A search may miss what is there: the two zones of a drive make many minima, and fewer turns hold fewer of its ways. So
what the search on all turns found is proposed to the turns that were left; where these prefer it to what was found on
them alone, that was missed, and `of_proposal` says what it leaves of the hidden turns.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdopt.arrays import Array, Mask
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import Fit, FitProblem, evaluate
from hdopt.diagnosis.inference.hidden_turns import NestedHeldOut, hidden_samples, shares_of_samples, without_samples
from hdopt.diagnosis.inference.read_angle import where_it_stood
from hdopt.diagnosis.inference.zeros import freed_of_zeros
from hdopt.diagnosis.orientation import turn_round
from hdopt.diagnosis.search.guess import Guess
from hdopt.diagnosis.search.high_order import subtract
from hdopt.diagnosis.search.penalty import bends_to_anything
from hdopt.diagnosis.settings import DiagnosisSettings
from hdopt.diagnosis.stages import on_problem
from hdopt.diagnosis.state import State
from hdopt.effects.term import Term
from hdopt.recordings.recording import Recording
from hdopt.recordings.rows import Rows, gather, neighbours_for

Pipeline = Callable[[Sequence[Recording]], State]


@dataclass(frozen=True)
class Part:
    """A diagnosis of the turns that were left: what its `base` alone and all that it chose (`best`) make of all turns,
    fitted to those that were left, on rows without the ripple that it found, and what its base makes of rows with it
    (`drive_alone`); which rows hold hidden samples (`touched`, (n,)) and which nothing else (`hidden`,
    (n,)); the `effects` found, and with how many coefficients and shapes (`freedom`), those of high orders among them;
    `guesses` for a search on all turns, and the `ripple` for the same.
    """

    base: Fit
    best: Fit
    drive_alone: Fit
    touched: Mask
    hidden: Mask
    effects: tuple[str, ...]
    freedom: int
    guesses: tuple[Guess, ...]
    ripple: Guess | None = None

    @property
    def held_out(self) -> NestedHeldOut:
        """Errors of what was found on the turns that were left, on those that were hidden."""
        return self._errors_of(self.base, self.best, self.effects)

    def of_proposal(self, found: State) -> NestedHeldOut | None:
        """Errors on the hidden turns of the best set of `found`, the last state of the diagnosis of all turns, fitted
        to those that were left, on the rows of `found`: without the ripple that it took out. None where the turns that
        were left do not clearly prefer it to what was found on them alone, by Schwarz's criterion, and where it has
        many waves of an effect that was not found on them, or nothing beside such a ripple: in which waves these are
        the hidden turns had a say.
        """
        best = found.selection.best.fit
        settings = best.problem.settings
        ripple = () if found.high is None else found.high.best.fit.terms
        if best.problem.base is None or not (best.terms or ripple) or len(best.residual) != len(self.best.residual):
            return None
        many_waves = [term for term in best.terms if bends_to_anything(term, settings.penalty)]
        if not {term.effect for term in (many_waves if best.terms else ripple)} <= set(self.effects):
            return None
        problem = best.problem.with_noise(best.problem.noise.without(self.touched))
        base, fit = (
            refine(on_problem(one, problem), settings.fit.settled_iterations) for one in (found.selection.base, best)
        )
        effects, freedom = all_found(found)

        def cost(residual: Array, coefficients: int) -> float:
            power = float(np.sum(problem.noise.whiten(residual) ** 2)) / problem.noise.sigma**2 / found.inflation
            return (power + coefficients * math.log(problem.weighed_rows)) / 2

        # Turned round, a residual is the same but for its sign.
        gained = cost(self.best.residual, self.freedom) - cost(fit.residual, freedom)
        return self._errors_of(base, fit, effects) if gained > settings.search.better else None

    def _errors_of(self, base: Fit, extended: Fit, effects: tuple[str, ...]) -> NestedHeldOut:
        """Errors of the `base` alone and of the `extended` fit on the hidden turns."""
        left = [_rms(fit.residual[self.hidden]) for fit in (base, extended, self.drive_alone)]
        return NestedHeldOut(left[0], left[1], len(np.unique(base.problem.rows.block[self.hidden])), effects, left[2])


def all_found(state: State) -> tuple[tuple[str, ...], int]:
    """The effects that `state` found, in the order of the alphabet, and their coefficients and shapes."""
    found = [one.best.fit for one in (state.selection, state.high) if one is not None]
    terms = [term for fit in found for term in fit.terms]
    return tuple(sorted({term.effect for term in terms})), sum(term.freedom for term in terms)


def diagnosis_of_a_part(
    recordings: Sequence[Recording], pipeline: Pipeline, seed: int, settings: DiagnosisSettings
) -> Part | None:
    """What the last state of `pipeline`, run on some turns of the `recordings`, makes of all of them; None where too
    few can be hidden. Turns are drawn with `seed`, by the `settings`.
    """
    hidden = hidden_samples(recordings, np.random.default_rng(seed), settings.held_out)
    if hidden is None:
        return None
    state = pipeline(without_samples(recordings, hidden))
    seen = as_seen(recordings, hidden, state)
    # Means of as many samples as those that it is held against: of fewer there are on the turns that are left.
    neighbours = neighbours_for(recordings)
    rows = gather(subtract(seen, ripple_of(seen, state)), neighbours)
    share = shares_of_samples(seen, hidden, neighbours)
    base, best = (refitted(fit, rows, share > 0, state) for fit in (state.selection.base, state.selection.best.fit))
    alone = base if state.ripple is None else refitted(base, gather(seen, neighbours), share > 0, state)
    what = *all_found(state), state.as_guesses(), state.ripple_as_guess()
    return Part(base, best, alone, share > 0, share == 1, *what)


def as_seen(recordings: Sequence[Recording], hidden: Sequence[Mask], state: State) -> tuple[Recording, ...]:
    """All samples of the `recordings` as `state`, which saw those not `hidden`, has its own: the same zero, slope and
    way of counting.
    """
    taken, turned = state.nuisances.taken, state.orientation.turned
    seen = freed_of_zeros(recordings, state.settings.nuisance, hidden)
    if taken is not None:
        seen = (taken.turned if turned else taken).take_out(seen)
    return turn_round(seen) if turned else seen


def refitted(fit: Fit, rows: Rows, left_out: Mask, state: State) -> Fit:
    """`fit`, made by `state` on some of the `rows`, on all of them: its parameters fitted once more to those that are
    not `left_out` (n,), where columns have the same reference on all.
    """
    problem = on_rows(fit.problem, rows, state)
    problem = problem.with_noise(problem.noise.without(left_out))
    again = evaluate(problem, fit.errors, fit.offsets, terms_on(problem, fit, fit.terms), fit.coefficients)
    return refine(again, problem.settings.fit.settled_iterations)


def on_rows(problem: FitProblem, rows: Rows, state: State) -> FitProblem:
    """`problem` on other `rows`, in the same noise. `state` has its nuisances."""
    return replace(problem, rows=rows, nuisance=state.nuisances.columns(rows), noise=problem.noise.on(rows))


def terms_on(problem: FitProblem, fit: Fit, terms: Sequence[Term]) -> list[Term]:
    """`terms` of `fit` on the rows of `problem`."""
    motion = evaluate(problem, fit.errors, fit.offsets, (), ()).base_value
    return [problem.explanations[term.effect].term(problem.rows, term.shape, motion) for term in terms]


def ripple_of(recordings: Sequence[Recording], state: State) -> Array:
    """What the high orders that `state` found add to the error of all samples of the `recordings`, (n,) arcmin."""
    raw = gather(recordings)
    if state.ripple is None or state.high is None:
        return np.zeros(len(raw))
    low, high = state.selection.best.fit, state.high.best.fit
    problem = on_rows(low.problem, raw, state)
    below = terms_on(problem, low, low.terms)
    alone = evaluate(problem, low.errors, low.offsets, below, low.coefficients)
    above = terms_on(replace(problem, rows=where_it_stood(raw, alone.ahead)), low, high.terms)
    inside = [*low.coefficients, *high.coefficients]
    both = evaluate(problem, low.errors, low.offsets, [*below, *above], inside)
    return both.prediction - alone.prediction


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors**2)))
