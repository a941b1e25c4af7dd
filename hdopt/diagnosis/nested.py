"""The held-out error of a whole diagnosis: every stage of it on some turns alone, and its error on the others.

What is refitted by one linear step with the rest in sight (`inference.cross_validation`) has had its effects, shapes,
zones and noise chosen on the very turns that it then predicts. Here the turns are taken out of the recordings before
the first stage; orientation, scale, noise, search, shapes and drive all come from what is left (an orientation that
the base leaves open is not searched for twice). One split: a fold more would cost one diagnosis more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from hdopt.arrays import Array, Mask
from hdopt.diagnosis.inference.fit import Fit, FitProblem, evaluate, refine
from hdopt.diagnosis.inference.hidden_turns import NestedHeldOut, hidden_samples, shares_of_samples, without_samples
from hdopt.diagnosis.orientation import turn_round
from hdopt.diagnosis.search.high_order import subtract
from hdopt.diagnosis.settings import DiagnosisSettings
from hdopt.diagnosis.state import Guess, State
from hdopt.effects.term import Term
from hdopt.recordings.recording import Recording
from hdopt.recordings.rows import Rows, gather, neighbours_for

Pipeline = Callable[[Sequence[Recording]], State]


def nested_held_out(
    recordings: Sequence[Recording], pipeline: Pipeline, seed: int, settings: DiagnosisSettings
) -> tuple[NestedHeldOut, tuple[Guess, ...]] | None:
    """The error of the last state of `pipeline`, run on some turns of the `recordings`, on the turns that were hidden
    from it, and what it found; None where too few can be hidden. Turns are drawn with `seed`, by the `settings`.
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
    best, base = state.selection.best.fit, state.selection.base
    errors = [_rms(refitted(fit, rows, share > 0, state).residual[share == 1]) for fit in (base, best)]
    named = {name for found in (state.selection, state.high) if found is not None for name in found.best.effects}
    turns = len(np.unique(rows.block[share == 1]))
    return NestedHeldOut(errors[0], errors[1], turns, tuple(sorted(named))), state.as_guesses()


def as_seen(recordings: Sequence[Recording], hidden: Sequence[Mask], state: State) -> tuple[Recording, ...]:
    """All samples of the `recordings` as `state`, which saw those not `hidden`, has its own: the same zero, slope and
    way of counting.
    """
    taken, turned = state.nuisances.taken, state.orientation.turned
    middle = float(np.median(recordings[0].error_arcmin[~hidden[0]]))
    seen = tuple(replace(one, error_arcmin=one.error_arcmin - middle) for one in recordings)
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
    terms = terms_on(problem, low, [*low.terms, *high.terms])
    inside = [*low.coefficients, *high.coefficients]
    both = evaluate(problem, low.errors, low.offsets, terms, inside)
    alone = evaluate(problem, low.errors, low.offsets, terms[: len(low.terms)], low.coefficients)
    return both.prediction - alone.prediction


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors**2)))
