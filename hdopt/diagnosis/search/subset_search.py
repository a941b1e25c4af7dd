"""Which effects explain the residual: a search over subsets, with the base refitted beside every one of them.

Every candidate's columns are whitened and freed of what the base can absorb; the drop of the sum of squares of every
subset up to three then follows from one table of inner products. Subsets are weighed by an approximate log Bayes
factor: half the gain less half the freedom times log(rows) (Schwarz), less what the search over shapes cost and less
prior odds. The leaders are fitted jointly with the nonlinear base, and the search is repeated about the best fit until
it stands. `STAGES` is the order of work.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdopt.diagnosis.inference.base_fit import is_far
from hdopt.diagnosis.inference.catalogue import is_outside
from hdopt.diagnosis.inference.clean_base import drive_alone
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.search.acceptance import is_acceptable
from hdopt.diagnosis.search.candidates import (
    Candidate,
    from_new_drives,
    in_order,
    joint_fit,
    paid_for_freedom,
    search_terms,
    with_only,
    without_each,
)
from hdopt.diagnosis.search.completion import completed
from hdopt.diagnosis.search.explore import explore
from hdopt.diagnosis.search.in_place_of_others import in_place_of_others
from hdopt.diagnosis.search.penalty import flexibility, leaves_nothing
from hdopt.diagnosis.search.plain_for_waves import plain_for_waves
from hdopt.diagnosis.search.refinement import (
    for_freedom_alone,
    otherwise_acceptable,
    shortened,
    trimmed,
    widened_where_it_pays,
    with_a_plain_term,
)
from hdopt.diagnosis.search.search_state import SearchPlan, SearchState, names_of
from hdopt.diagnosis.search.several_for_one import (
    fewest_first,
    has_bending,
    several_first,
    several_for_one,
    with_teeth_in_the_zones,
)
from hdopt.effects.met import Waves
from hdopt.effects.term import Term
from hdopt.parallel.shared_memory import each


@dataclass(frozen=True)
class Selection:
    """The `base` alone, the `candidates` in order of evidence (the base alone is among them), and how much rougher the
    noise is, turn by turn, than its model (`inflation`).
    """

    base: Fit
    candidates: tuple[Candidate, ...]
    inflation: float

    @property
    def best(self) -> Candidate:
        """The first candidate."""
        return self.candidates[0]

    @property
    def leaders(self) -> tuple[Fit, ...]:
        """Fits of the best candidates that have terms."""
        known = self.base.problem.settings.search.known
        return tuple(candidate.fit for candidate in self.candidates if candidate.fit.terms)[:known]

    def with_best_fit(self, fit: Fit) -> Selection:
        """The same selection with its best candidate fitted otherwise."""
        return replace(self, candidates=(replace(self.best, fit=fit), *self.candidates[1:]))


def select(base: Fit, inflation: float, rng: np.random.Generator, plan: SearchPlan | None = None) -> Selection:
    """The candidates that explain best beside `base`, in noise rougher by `inflation`, by alternating search about the
    best fit and joint fits of the leaders; `rng` draws new drives, `plan` says where to look.
    """
    return select_from(SearchState(base, plan or SearchPlan(), inflation, rng))


def select_from(state: SearchState) -> Selection:
    """`select` where the work stands at `state`: a first look is not taken twice, and what an earlier search found is
    looked about first; all else is done again only where another set of effects leads then.
    """
    if state.plan.known:
        state = through(STAGES_AGAIN, state)
    if not leads_still(state):
        state = through(STAGES_AFTER_AGAIN if state.plan.known else STAGES, state)
    candidates = acceptable_first(ranked(state), state.settings.close_behind)
    return Selection(state.base, tuple(complete_and_wide(state, candidates)), state.inflation)


def through(stages: Sequence[Callable[[SearchState], SearchState]], state: SearchState) -> SearchState:
    """`state` after one of the `stages` after the other."""
    for stage in stages:
        state = stage(state)
    return state


def leads_still(state: SearchState) -> bool:
    """Whether the set of effects that led an earlier search, the first of those known, leads at `state` too."""
    leader, known = state.leader, state.plan.known
    return leader is not None and bool(known) and names_of(leader.fit) == names_of(known[0])


def first_look(base: Fit, inflation: float, rng: np.random.Generator, plan: SearchPlan) -> SearchState:
    """Where a search stands after one look about `base` alone; `inflation`, `rng` and `plan` as for `select`."""
    return explore_base(SearchState(base, plan, inflation, rng))


def most_explained(state: SearchState) -> float:
    """The most that any set of `state` explains beyond the base, as log evidence that pays for freedom and search
    alone; 0 where none does. Not the leader's: it pays a share of all that it explains for each inexact shape, and
    leads with fewer where one more would be needed.
    """
    explained = (paid_for_freedom(state.weigh(fit), state.scale) for fit in state.fits.values())
    return max((0.0, *explained))


def refit_known(state: SearchState) -> SearchState:
    """The leaders of an earlier search, refitted on these rows and this noise. `state` is where the work stands."""
    if not state.plan.known:
        return state
    iterations = state.base.problem.settings.fit.known_iterations
    known = tuple(each(lambda fit: refine(fit, iterations), state.plan.known))
    return replace(state, plan=replace(state.plan, known=known)).taking(known)


def explore_base(state: SearchState) -> SearchState:
    """Where nothing is known yet: the best sets about the base alone. `state` is where the work stands."""
    if state.fits:
        return state
    pool = state.terms_for(state.probe(state.base))
    return about_wavy_base(teeth_from_new_drives(explore(state, state.base, pool, afresh=True), pool))


def about_wavy_base(state: SearchState) -> SearchState:
    """The best sets about a base that was fitted beside waves of the teeth, where one was, without these and beside
    them: those bend every other base, and hide what is smaller. `state` is where the work stands; the draws are its
    own.
    """
    wavy = state.plan.wavy
    if wavy is None:
        return state
    own = replace(state, rng=copy.deepcopy(state.rng))
    alone = drive_alone(wavy, state.base.problem)
    own = explore(own, alone, own.terms_for(own.probe(alone)))
    pool = [*wavy.terms, *own.terms_for(own.probe(wavy), *(term.effect for term in wavy.terms))]
    return replace(explore(own, wavy, pool), rng=state.rng)


def teeth_from_new_drives(state: SearchState, pool: Sequence[Term]) -> SearchState:
    """Waves of the teeth may bend the base alone far outside its tolerances; about that base others look larger than
    they. So the widest waves of each spline in the `pool` that do not wholly bend to anything are fitted from new
    drives. `state` is where the work stands; the draws are its own, so that a search in which nothing comes of it goes
    on as without it.
    """
    if not is_far(state.base).any():
        return state
    penalties = state.base.problem.settings.penalty
    stiff = [term for term in pool if isinstance(term.met, Waves) and flexibility(term, penalties) < 1]
    widest = {term.effect: term for term in sorted(stiff, key=lambda term: term.width)}
    return state.taking(from_new_drives(state.base, [[term] for term in widest.values()], copy.deepcopy(state.rng)))


def explore_clean_base(state: SearchState) -> SearchState:
    """The best sets about a base that is less bent towards what is missing. `state` is where the work stands."""
    clean = state.plan.clean
    return state if clean is None else explore(state, clean, state.terms_for(state.probe(clean)))


def look_beside_flexible_leader(state: SearchState) -> SearchState:
    """Where the leader bends to anything, what it explains may be two effects, of which each alone leaves the other:
    the best sets about single effects. `state` is where the work stands.
    """
    for fit in single_effects_worth_a_second(state):
        pool = [*fit.terms, *state.terms_for(state.probe(fit), fit.terms[0].effect)]
        state = explore(state, fit, pool)
    return state


def single_effects_worth_a_second(state: SearchState) -> list[Fit]:
    """Fits of single effects beside which a second is looked for; none where the leader is stiff. `state` is where
    the work stands.
    """
    leader, settings = state.leader, state.settings
    penalties = state.base.problem.settings.penalty
    if leader is None or not any(
        is_outside(t.effect) or t.doubtful or flexibility(t, penalties) > 0 for t in leader.fit.terms
    ):
        return []
    least = settings.beside_flexible * leader.log_bayes_factor
    single = [
        fit
        for fit in state.fits.values()
        if len(fit.terms) == 1
        and fit is not leader.fit
        and not is_outside(fit.terms[0].effect)
        and state.log_bayes_factor(fit) > least
    ]
    return sorted(single, key=state.log_bayes_factor, reverse=True)[: settings.leaders]


def search_about_leader(state: SearchState) -> SearchState:
    """A better drive may fit once the effect is there: the leader from new starts, and a search about what was
    found, until nothing new comes. `state` is where the work stands.
    """
    centre: Fit | None = None
    for _ in range(state.settings.rounds):
        leader = state.leader
        if leader is None or leader.fit is centre:
            break
        centre = joint_fit(leader.fit, leader.fit.terms, state.rng)
        state = state.with_fit(centre)
        before = state
        state = explore(state, centre, pool_about(state, centre))
        if state is before:
            break
    return state


def pool_about(state: SearchState, centre: Fit) -> list[Term]:
    """The terms of `centre`, what is found beside them all, and what is found in place of each. `state` is where the
    work stands.
    """
    names = [term.effect for term in centre.terms]
    pool = [*centre.terms, *state.terms_for(state.probe(centre), *names)]
    if len(names) == 1:
        return pool + state.terms_for(state.probe(centre, keep=()), *names)
    for i in range(len(names)):
        keep = centre.all_but(i)
        pool += state.terms_for(state.probe(centre, keep=keep), *(names[j] for j in keep))
    return pool


def refit_close_rivals(state: SearchState) -> SearchState:
    """The leader has been fitted from new drives; those close behind it, and simpler sets, may want another drive.
    What only adds to the leader's effects shares its drive. `state` is where the work stands.
    """
    leader, settings = state.leader, state.settings
    if leader is None or state.base.problem.base is None:
        return state
    others = (fit for names, fit in state.fits.items() if not names >= set(leader.effects))
    behind = sorted(others, key=state.log_bayes_factor, reverse=True)[: settings.leaders]
    least = settings.close * leader.log_bayes_factor
    sets: list[Sequence[Term]] = [fit.terms for fit in behind if state.log_bayes_factor(fit) > least]
    sets += with_a_plain_term(leader.fit, state.plan.skip, state.order_range)
    return state.taking(from_new_drives(leader.fit, sets, state.rng))


def beside_a_far_drive(state: SearchState) -> SearchState:
    """A leader's drive far outside its tolerances stands for physics that the leader leaves out, which no look beside
    that drive shows: each sine of known orders beside the leader, from new drives. `state` is where the work stands;
    the draws are its own, so that a search in which nothing comes of it goes on as without it.
    """
    before = state.leader
    if before is None or state.base.problem.base is None or not is_far(before.fit).any():
        return state
    start = before.fit
    found = [term for term in state.terms_for(state.probe(start), *before.effects) if leaves_nothing(term)]
    fits = from_new_drives(start, [[*start.terms, term] for term in found], copy.deepcopy(state.rng))
    return about_a_new_leader(state.taking(fits), before)


def at_the_same_orders(state: SearchState) -> SearchState:
    """The leader with what stands at the orders of its terms in their place, from new drives, and it too: beside an
    encoder of one shaft the drive came to where that of the other does not show. `state` is where the work stands; the
    draws are its own, so that a search in which nothing comes of it goes on as without it.
    """
    before = state.leader
    if before is None:
        return state
    fit, problem = before.fit, before.fit.problem
    sets = [
        [*fit.terms[:i], other, *fit.terms[i + 1 :]]
        for i, term in enumerate(fit.terms)
        for other in problem.explanations[term.effect].at_the_same_orders(problem.rows, term)
    ]
    if not sets:
        return state
    return about_a_new_leader(state.taking(from_new_drives(fit, [fit.terms, *sets], copy.deepcopy(state.rng))), before)


def beside_what_is_told(state: SearchState) -> SearchState:
    """What a drive as built and its bench may do without a finding, in place of the leader, beside it and in place of
    some of its effects; where that leads, the search goes on about it. `state` is where the work stands.
    """
    before = state.leader
    for effect in state.base.problem.explanations.values():
        if not effect.aside or effect.id in state.plan.skip or (before is not None and effect.id in before.effects):
            continue
        for start in (state.base, *([before.fit] if before is not None else [])):
            found = search_terms(state.probe(start), only=[effect.id])
            fits = [joint_fit(start, [*start.terms, term]) for term in found]
            state = state.taking(fits)
            for fit in fits:
                state = in_place_of_others(state, start, fit)
    return about_a_new_leader(state, before)


def about_a_new_leader(state: SearchState, before: Candidate | None) -> SearchState:
    """The search about the leader, where it is another than `before`. `state` is where the work stands."""
    after = state.leader
    if after is None or (before is not None and after.fit is before.fit):
        return state
    return search_about_leader(state)


def leave_out_hidden_parts(state: SearchState) -> SearchState:
    """Parts of terms that do not show are left out: without them a set may be acceptable, with them not. `state` is
    where the work stands.
    """
    for fit in list(state.fits.values()):
        few = trimmed(fit)
        if few is None:
            continue
        may_lose = state.settings.lost_by_trimming * state.weigh(fit).gain / state.inflation
        if state.is_better(few, fit, by=-may_lose):
            state = state.with_fit(few)
    return state


def shorten_wide_terms(state: SearchState) -> SearchState:
    """Less and less of the leaders' terms that bend to much, as long as that is better. `state` is where the work
    stands.
    """
    best = sorted(state.fits.values(), key=state.log_bayes_factor, reverse=True)[: state.settings.leaders]
    for fit in best:
        for shorter in shortened(fit, state.rng):
            if not state.would_take(shorter):
                break
            state = state.with_fit(shorter)
    return state


def leave_out_each_term(state: SearchState) -> SearchState:
    """A term that came in beside a better drive may have no part in it: without each, from where the best stands.
    `state` is where the work stands.
    """
    while (leader := state.leader) is not None and len(leader.fit.terms) > 1:
        state = state.taking(without_each(leader.fit))
        after = state.leader
        if after is None or after.fit is leader.fit:
            break
    return state


def base_beside_leader(state: SearchState) -> SearchState:
    """Beside an effect the base may have come to a better drive: then that is the one to beat. `state` is where the
    work stands.
    """
    leader = state.leader
    if leader is None:
        return state
    alone = with_only(leader.fit, ())
    return replace(state, base=min(state.base, alone, key=lambda one: one.objective))


STAGES: tuple[Callable[[SearchState], SearchState], ...] = (
    explore_base,
    explore_clean_base,
    look_beside_flexible_leader,
    search_about_leader,
    beside_a_far_drive,
    with_teeth_in_the_zones,
    several_for_one,
    plain_for_waves,
    refit_close_rivals,
    at_the_same_orders,
    beside_what_is_told,
    leave_out_hidden_parts,
    shorten_wide_terms,
    leave_out_each_term,
    base_beside_leader,
)
"""The search, in the order of its work."""

FOR_OTHER_KINDS = (
    explore_base,
    look_beside_flexible_leader,
    with_teeth_in_the_zones,
    several_for_one,
    plain_for_waves,
)
"""What of it looks for sets of other kinds in place of a leader, or where none is known."""

STAGES_AGAIN = (refit_known, *(stage for stage in STAGES if stage not in FOR_OTHER_KINDS))
"""The search where an earlier one, on other rows or in another noise, has looked for those."""

STAGES_AFTER_AGAIN = tuple(stage for stage in STAGES if stage is not explore_clean_base)
"""The search after that, where another set leads: the base less bent is still the same, and was looked about."""


def ranked(state: SearchState) -> list[Candidate]:
    """All sets and the base alone in order of evidence, with acceptable variants of leaders that are not acceptable,
    those that led an earlier search among them. `state` is where the work stands.
    """
    top = state.top_gain
    candidates = [state.weigh(fit, top) for fit in state.fits.values()]
    candidates.append(Candidate(state.base, 0.0, 0.0))
    candidates = in_order(candidates)
    for candidate in candidates[: state.settings.otherwise]:
        if not candidate.fit.terms or is_acceptable(candidate.fit):
            break
        alike = (fit for fit in state.plan.known if names_of(fit) == names_of(candidate.fit) and is_acceptable(fit))
        others = otherwise_acceptable(candidate.fit, state.plan.skip, state.order_range)
        candidates += [state.weigh(fit, top) for fit in (*alike, *others)]
    return in_order(candidates)


def complete_and_wide(state: SearchState, candidates: list[Candidate]) -> list[Candidate]:
    """`candidates` in their last order, the first completed; once more where it came out wider, or another: what it
    leaves then may be one effect more. `state` is where the work stands.
    """
    begun = completed(state, candidates)
    wide = in_last_order(state, begun)
    return wide if wide[0].fit is begun[0].fit else completed(state, wide)


def in_last_order(state: SearchState, candidates: list[Candidate]) -> list[Candidate]:
    """`candidates` in order of evidence, as they stand once sets that need not pay for inexact shapes came before
    others, and the first is as wide as pays. Several effects that came first because none of them bends do not where
    one of them bends then, unless it bends to no more than the others' inexact shapes leave. `state` is where the work
    stands.
    """
    stiff = several_first(state, candidates)
    found = fewest_and_wide(state, stiff)
    if stiff[0] is candidates[0] or not has_bending(found[0].fit) or bends_to_misfit(state, stiff[0], found[0]):
        return found
    return fewest_and_wide(state, candidates)


def bends_to_misfit(state: SearchState, stiff: Candidate, wide: Candidate) -> bool:
    """Whether a `wide` variant of the `stiff` set has its effects, and explains no more beyond it than the slightly
    wrong shape of any of its effects may leave. `state` is where the work stands.
    """
    if set(wide.effects) != set(stiff.effects):
        return False
    beyond = stiff.fit.objective - wide.fit.objective
    carried = min(fewer.objective - stiff.fit.objective for fewer in without_each(stiff.fit))
    return beyond < state.scale.settings.discrepancy * carried


def fewest_and_wide(state: SearchState, candidates: list[Candidate]) -> list[Candidate]:
    """`candidates` in order of evidence, first the set that explains most for its coefficients, in wider variants where
    these pay; where another set explains more than these in no more coefficients, that, as wide as pays. `state` is
    where the work stands.
    """
    found = widened(state, fewest_first(state, candidates))
    again = fewest_first(state, found)
    return found if again[0] is found[0] else widened(state, again)


def widened(state: SearchState, candidates: list[Candidate]) -> list[Candidate]:
    """`candidates` in order of evidence, the first with its effects in wider variants where these pay; effects that it
    lost to these stand for the set without them. `state` is where the work stands.
    """
    first, rest = candidates[0], candidates[1:]
    if not first.fit.terms:
        return candidates
    fit = widened_where_it_pays(first.fit, state.base, state.inflation, state.order_range)
    names = names_of(fit)
    if names != names_of(first.fit):
        same = [fit, *([state.fits[names]] if names in state.fits else [])]
        fit = max(same, key=lambda one: for_freedom_alone(one, state.base, state.inflation))
        rest = [one for one in rest if names_of(one.fit) != names]
    return [replace(first, fit=fit, gain=state.weigh(fit).gain), *rest]


def acceptable_first(candidates: Sequence[Candidate], close_behind: float) -> list[Candidate]:
    """`candidates` in order of evidence, without those that are not acceptable, as far as they lead or come within
    `close_behind` (log Bayes factor) of the leader.
    """
    kept: list[Candidate] = []
    for candidate in candidates:
        close = not kept or kept[0].log_bayes_factor - candidate.log_bayes_factor < close_behind
        if not close or not candidate.fit.terms or is_acceptable(candidate.fit):
            kept.append(candidate)
    return kept
