"""A leading set that is only begun, and what completes it.

A set of effects pays a share of all that it explains for each effect (`search.penalty`): what an inexact shape leaves
must not be named. So a delay that took the place of a friction and a delay leads these two, though it leaves what no
noise does. A set that leaves more than noise, or whose drive lies far outside its tolerances, leaves physics out; where
one plain effect more takes up nearly all of that, or brings the drive home and takes up nearly all that is left beside
a drive at home, that is no misfit of a shape, which would be left beside it. Such sets do not pay for being inexact
against the set that they complete. What many waves of the teeth leave of steps from tooth to tooth is a pulse, though:
beside a term that bends to anything only sines of known orders and what does not turn with the drive complete a set.
Beside terms that bend to nothing long waves of the teeth do too, where they take up most of what is left: the drive had
taken up the rest of them. So do waves in place of one such term, which stood for them beside a drive that is none.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from dataclasses import replace

from hdopt.diagnosis.checks.other_laws import other_law
from hdopt.diagnosis.inference.base_excitation import is_driven
from hdopt.diagnosis.inference.base_fit import beyond_tolerances, is_far
from hdopt.diagnosis.inference.catalogue import EXACT_TOLD, is_outside
from hdopt.diagnosis.inference.clean_base import long_waves
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.numerical import NORMAL_95, VARIANCE_OF_A_SQUARE
from hdopt.diagnosis.search.acceptance import is_acceptable
from hdopt.diagnosis.search.at_home import fitted_within, is_outside_tolerances
from hdopt.diagnosis.search.candidates import (
    Candidate,
    from_new_drives,
    in_order,
    joint_fit,
    paid_for_freedom,
    with_only,
)
from hdopt.diagnosis.search.penalty import kind_of, leaves_nothing
from hdopt.diagnosis.search.search_state import Names, SearchState, names_of
from hdopt.diagnosis.search.several_for_one import has_bending
from hdopt.effects.met import Waves
from hdopt.effects.term import Term
from hdopt.parallel.shared_memory import each


def completed(state: SearchState, candidates: list[Candidate]) -> list[Candidate]:
    """`candidates` in order of evidence, the first only begun where another set has all its effects and takes up what
    it leaves: such sets then come first. `state` is where the work stands.
    """
    first = candidates[0]
    if not first.fit.terms:
        return candidates
    found: dict[Names, Candidate] = {}
    made = (
        *far_more_taken_up(state, candidates),
        *with_waves_for_one(state, candidates),
        *by_one_plain_effect(state, first),
        *by_waves(state, first),
    )
    for one in in_order(made):
        found.setdefault(names_of(one.fit), one)
    return in_order([*found.values(), *(one for one in candidates if names_of(one.fit) not in found)])


def far_more_taken_up(state: SearchState, candidates: list[Candidate]) -> list[Candidate]:
    """Of the `candidates` those that complete the first where it leaves far more than noise: terms that bend to nothing
    take up nearly all of that beside it. `state` is where the work stands.
    """
    first = candidates[0]
    left = state.above_noise(first.fit)
    if not is_far_more_than_noise(left, state):
        return []
    found = []
    for candidate in candidates[1:]:
        beside = [term for term in candidate.fit.terms if term.effect not in first.effects]
        if set(first.effects) < set(candidate.effects) and all(may_complete(t, first.fit) for t in beside):
            if takes_up(candidate.fit, left, state):
                found.append(without_inexactness(state, first, candidate))
    return found


def with_waves_for_one(state: SearchState, candidates: list[Candidate]) -> list[Candidate]:
    """Of the `candidates` those that have waves of the teeth for one effect of the first, which bends to nothing
    and leaves far more than noise beside a drive outside its tolerances: beside a drive within them they take up nearly
    all of that. `state` is where the work stands.
    """
    first = candidates[0]
    left = state.above_noise(first.fit)
    begun = not (first.outside or has_bending(first.fit)) and is_far_more_than_noise(left, state)
    if not (begun and is_outside_tolerances(first.fit)):
        return []
    found = []
    for candidate in candidates[1:]:
        beside = [term for term in candidate.fit.terms if term.effect not in first.effects]
        exchanged = len(candidate.effects) == len(first.effects) and len(beside) == 1
        if exchanged and isinstance(beside[0].met, Waves) and not is_outside_tolerances(candidate.fit):
            one = without_inexactness(state, first, candidate)
            if takes_up(candidate.fit, left, state) and may_come_first(one, first, state):
                found.append(one)
    return found


def may_grow(first: Candidate) -> bool:
    """Whether the `first` is a set of physics that may have one effect more."""
    return not first.outside and len(first.fit.terms) < first.fit.problem.settings.search.most_effects


def is_far_more_than_noise(left: float, state: SearchState) -> bool:
    """Whether what is `left` above the noise, in noise variances, is a good part of the noise. `state` is where the
    work stands."""
    return left >= state.settings.begun * state.scale.rows


def takes_up(more: Fit, left: float, state: SearchState) -> bool:
    """Whether `more` leaves hardly anything of what was `left` above the noise, in noise variances: a small share of
    it, or, of a larger share, no more than the power of so many rows of noise varies by, in 95 of 100. `state` is
    where the work stands."""
    settings = state.settings
    varies = NORMAL_95 * math.sqrt(VARIANCE_OF_A_SQUARE * state.scale.rows)
    return state.above_noise(more) <= max(settings.complete * left, min(varies, settings.complete_in_noise * left))


def by_one_plain_effect(state: SearchState, first: Candidate) -> list[Candidate]:
    """Sets that complete the `first`, one of physics, by one plain effect more: where it leaves more than noise, any
    that takes up nearly all of that; where its drive lies outside its tolerances, sines of known orders that bring it
    home. `state` is where the work stands.
    """
    settings, fit = state.settings, first.fit
    if not may_grow(first):
        return []
    left, far = state.above_noise(fit), is_outside_tolerances(fit)
    leaves_more = left >= settings.leaves_more * state.scale.rows
    if not (leaves_more or far):
        return []

    def fills(more: Fit) -> bool:
        return leaves_more and takes_up(more, left, state)

    made = [more for one in (fit, *without_told(fit)) for more in with_one_more(state, one, fills, not leaves_more)]
    home = [more for more in made if brings_home(more, first)] if far else []
    if len(home) > 1 and not is_far(fit).any():
        home = []  # Several would do: none of them is told by that.
    inexact = not all(leaves_nothing(term) for term in fit.terms)
    share = inexact * state.scale.settings.other_kind * state.top_gain / state.inflation / 2
    left_at_home = of_home(state, fit) if home and inexact else 0.0
    found = []
    for more in made:
        one = without_inexactness(state, first, state.weigh(more, state.top_gain))
        came_home = any(more is fit_at_home for fit_at_home in home)
        wanted_at_home = came_home and left_at_home > 0 and takes_up(more, left_at_home, state)
        if not (fills(more) or wanted_at_home):
            one = replace(one, log_bayes_factor=one.log_bayes_factor - share)
        if (fills(more) or came_home) and may_come_first(one, first, state):
            found.append(one)
    return found


def of_home(state: SearchState, fit: Fit) -> float:
    """What the terms of `fit` leave above the noise, in noise variances, beside a drive within its tolerances: what
    brings the drive home must take up that much, and is then no misfit of their shapes. 0 where that is no more than
    noise, or no such drive is found. `state` is where the work stands; the draws are its own.
    """
    at_home = fitted_within(fit, copy.deepcopy(state.rng))
    left = state.above_noise(at_home)
    more_than_noise = left >= state.settings.leaves_more * state.scale.rows
    return left if more_than_noise and not is_outside_tolerances(at_home) else 0.0


def without_told(fit: Fit) -> list[Fit]:
    """`fit` without what is only told of the instruments, refitted; none where there is no such term, or nothing else:
    a clock or a ratio that is off takes up a part of the very effect that is missing."""
    physics = [i for i, term in enumerate(fit.terms) if term.effect not in EXACT_TOLD]
    return [with_only(fit, physics)] if 0 < len(physics) < len(fit.terms) else []


def by_waves(state: SearchState, first: Candidate) -> list[Candidate]:
    """Sets that complete the `first`, one of physics that bends to nothing, by the longest waves of a spline's teeth:
    where it leaves far more than noise, and they, from new drives, take up most of that. A drive fitted without them
    takes up so much of them that no look beside it shows them. `state` is where the work stands; the draws are its own.
    """
    settings, fit = state.settings, first.fit
    left = state.above_noise(fit)
    if not may_grow(first) or has_bending(fit) or not is_far_more_than_noise(left, state):
        return []
    known = (*first.effects, *state.plan.skip)
    sets = [[*fit.terms, waves] for waves in long_waves(fit.problem) if waves.effect not in known]
    found = []
    for more in from_new_drives(fit, sets, copy.deepcopy(state.rng)):
        one = without_inexactness(state, first, state.weigh(more, state.top_gain))
        completes = state.above_noise(more) <= settings.complete_by_waves * left and not is_far(more).any()
        if completes and may_come_first(one, first, state):
            found.append(one)
    return found


def brings_home(more: Fit, first: Candidate) -> bool:
    """Whether what `more` has beside the `first`, whose drive lies outside its tolerances, is sines of known orders,
    and the drive beside them lies within."""
    beside = (term for term in more.terms if term.effect not in first.effects)
    if is_far(more).any() or not all(leaves_nothing(term) for term in beside):
        return False
    return bool(is_far(first.fit).any()) or not beyond_tolerances(more, 1.0)


def with_one_more(state: SearchState, fit: Fit, fills: Callable[[Fit], bool], sines_alone: bool) -> list[Fit]:
    """`fit` with each of the best plain effects beside it, or of sines at known orders (`sines_alone`): the best fit
    for each set of effects, those that were tried before among them. They are fitted from where `fit` stands, sines
    from new drives too, since a drive takes up most of them; so is the best where none takes up what `fit` leaves
    (`fills`). `state` is where the work stands; the draws are its own.
    """
    probe, settings = state.probe(fit), state.settings
    pool = [term for term in state.terms_for(probe, *names_of(fit)) if may_be_one_more(term, fit)]
    pool = sorted((t for t in pool if leaves_nothing(t) or not sines_alone), key=probe.gain, reverse=True)
    pool = [*pool[: settings.most_plain], *(t for t in pool[settings.most_plain :] if leaves_nothing(t))]
    fits = known_with_one_more(state, fit, sines_alone)
    fits += each(lambda term: joint_fit(fit, [*fit.terms, term]), pool)
    fits.sort(key=lambda one: one.objective)
    again = [[*fit.terms, term] for term in pool if leaves_nothing(term)]
    if not any(fills(one) for one in fits):
        again += [[*one.terms] for one in fits if not leaves_nothing(one.terms[-1])][:1]
    fits += from_new_drives(fit, again, copy.deepcopy(state.rng))
    best: dict[Names, Fit] = {}
    for one in sorted(fits, key=lambda fit: fit.objective):
        best.setdefault(names_of(one), one)
    return list(best.values())


def known_with_one_more(state: SearchState, fit: Fit, sines_alone: bool) -> list[Fit]:
    """Of the sets that were tried those that have one plain effect more than `fit`, or sines at known orders
    (`sines_alone`): what a search from `fit` on finds may be another drive. `state` is where the work stands."""
    found = []
    for names, known in state.fits.items():
        beside = [term for term in known.terms if term.effect not in names_of(fit)]
        if names > names_of(fit) and len(beside) == 1 and may_be_one_more(beside[0], fit):
            if leaves_nothing(beside[0]) or not sines_alone:
                found.append(known)
    return found


def may_be_one_more(term: Term, fit: Fit) -> bool:
    """Whether `term` beside `fit` is physics of few coefficients, that neither swings nor stands for lines that could
    be another effect's, nor could be what a term of `fit` that bends to anything leaves of itself."""
    plain = term.width <= fit.problem.settings.search.narrow and not (is_outside(term.effect) or term.doubtful)
    return plain and not is_driven(term) and not may_be_left(term, fit)


def may_be_left(term: Term, fit: Fit) -> bool:
    """Whether `term` could be what a term of `fit` that bends to anything leaves of itself: it turns with the drive,
    and is no sines of known orders."""
    return kind_of(term) == "turning" and not leaves_nothing(term) and has_bending(fit)


def may_come_first(more: Candidate, first: Candidate, state: SearchState) -> bool:
    """Whether the candidate of `more` effects is clearly ahead of the `first`, acceptable, and beaten by no other law.
    `state` is where the work stands."""
    ahead = more.log_bayes_factor - first.log_bayes_factor > state.settings.clearly
    return ahead and is_acceptable(more.fit) and follows_its_laws(more.fit, state)


def follows_its_laws(fit: Fit, state: SearchState) -> bool:
    """Whether every effect of `fit` depends on the speed as it does, and no other law explains better. `state` is where
    the work stands."""
    return other_law(fit, state.inflation).log_evidence <= fit.problem.settings.verdict.other_law


def may_complete(term: Term, fit: Fit) -> bool:
    """Whether `term` beside `fit` is sines at lines that are known, or turns with the drive, has few coefficients and
    is not what a term of `fit` leaves of itself: it bends to nothing."""
    few = kind_of(term) == "turning" and term.width <= fit.problem.settings.search.narrow
    return leaves_nothing(term) or (few and not may_be_left(term, fit))


def without_inexactness(state: SearchState, first: Candidate, more: Candidate) -> Candidate:
    """The candidate of `more` effects than the `first`, of which those beside it pay for their freedom alone. `state`
    is where the work stands.
    """
    gained = paid_for_freedom(more, state.scale) - paid_for_freedom(first, state.scale)
    return replace(more, log_bayes_factor=first.log_bayes_factor + gained)
