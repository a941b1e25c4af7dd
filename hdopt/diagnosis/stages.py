"""The stages of a diagnosis, each from one `State` to the next; `STAGES` is the order of work."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.inference.base_fit import fit_base, with_offsets
from hdopt.diagnosis.inference.catalogue import SCALE, STRAIN_WAVE_ONLY
from hdopt.diagnosis.inference.clean_base import (
    beside_smooth,
    beside_waves,
    drive_with_terms,
    fit_clean_base,
    is_left_wavy,
    power_beside_smooth,
)
from hdopt.diagnosis.inference.common_slope import TakenSlope, common_slope, input_is_off
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import Fit, FitProblem, evaluate
from hdopt.diagnosis.inference.generic_basis import generic_columns
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.inference.normal_equations import least_squares
from hdopt.diagnosis.inference.nuisance import nuisances_for, with_time_warp
from hdopt.diagnosis.inference.residual_noise import measure_noise
from hdopt.diagnosis.inference.settled_shapes import settled
from hdopt.diagnosis.inference.zeros import freed_of_zeros
from hdopt.diagnosis.orientation import Orientation, is_decisive, preference, turn_round
from hdopt.diagnosis.search.at_home import brought_home
from hdopt.diagnosis.search.candidates import Candidate, paid_for_freedom, penalty_scale
from hdopt.diagnosis.search.freed_of_ripple import (
    at_drive_of,
    each_left_out,
    lowest_of_both_drives,
    power_in_rows,
    stands,
    without_effects_of,
)
from hdopt.diagnosis.search.guess import Guess
from hdopt.diagnosis.search.high_order import find_ripple, strong_ripple, subtract, subtracted_terms
from hdopt.diagnosis.search.search_state import SearchPlan
from hdopt.diagnosis.search.subset_search import Selection, first_look, most_explained, select, select_from
from hdopt.diagnosis.settings import DiagnosisSettings
from hdopt.diagnosis.state import State
from hdopt.effects.sines import sine_columns
from hdopt.kinematics.cartesian import CartesianModel
from hdopt.recordings.read import Recording
from hdopt.recordings.rows import gather, neighbours_for, row_of_each_sample


def begin(
    recordings: Sequence[Recording],
    base: CartesianModel | None,
    seed: int,
    settings: DiagnosisSettings,
    nuisance: Sequence[str] = (),
) -> State:
    """The first state: rows of all `recordings`, nuisances asked for by name (`nuisance`), a first guess of the
    noise, and the `base` model (None for a gear without one) fitted from random drives drawn with `seed`.
    `settings` are the thresholds. A large slope of the error by the angle is taken out first.
    """
    rng = np.random.default_rng(seed)
    recordings = freed_of_zeros(recordings, settings.nuisance)
    taken = common_slope(recordings, settings.nuisance)
    if taken is None:
        return first_fit(recordings, base, rng, settings, nuisance)
    as_output = first_fit(taken.take_out(recordings), base, rng, settings, nuisance, taken)
    if base is None:
        return as_output
    of_input = taken.of_input(recordings[0].ratio)
    as_input = first_fit(of_input.take_out(recordings), base, rng, settings, nuisance, of_input)
    # Physics that is not the base's own stands in both: smooth columns beside them soak most of it up.
    left = [(one.base.objective, power_beside_smooth(one.problem, rng)) for one in (as_output, as_input)]
    return as_input if input_is_off(left[0], left[1], settings.nuisance) else as_output


def first_fit(
    recordings: Sequence[Recording],
    base: CartesianModel | None,
    rng: np.random.Generator,
    settings: DiagnosisSettings,
    nuisance: Sequence[str] = (),
    taken: TakenSlope | None = None,
) -> State:
    """The first state on `recordings` freed of the slope `taken` (None: of none), with the nuisances asked for by name
    (`nuisance`): the `base` fitted from random drives drawn by `rng`. `settings` are the thresholds.
    """
    recordings = tuple(recordings)
    rows = gather(recordings, neighbours_for(recordings))
    nuisances = replace(nuisances_for(rows, base, nuisance, settings.nuisance), taken=taken)
    ruled_out = (*nuisances.hidden, *(STRAIN_WAVE_ONLY if base is None else ()))
    if taken is not None:
        ruled_out = (*ruled_out, SCALE)
    problem = FitProblem(rows, base, nuisances.columns(rows), Noise.white(rows), settings=settings)
    offsets = problem.nuisance @ least_squares(problem.nuisance, rows.error)
    size = float(np.std(rows.error - offsets))
    sigma = max(settings.noise.first_share * size, settings.noise.smallest_arcmin)
    widened = max(1.0, size / settings.base.prior_arcmin)
    start = fit_base(replace(problem, noise=Noise.white(rows, sigma), prior_scale=widened), rng)
    return State(recordings, nuisances, ruled_out, start, None, only_base(start, 1.0), None, None, 1.0, rng)


def only_base(base: Fit, inflation: float) -> Selection:
    """The selection of a search that found nothing beside `base`. `inflation` is that of the noise."""
    return Selection(base, (Candidate(base, 0.0, 0.0),), inflation)


def set_strong_ripple_aside(state: State) -> State:
    """What the means of a few rows cannot hold comes back as orders that are not there: a strong ripple is taken out
    of the rows and waits for its own search. `state` is where the work stands.
    """
    ripple = strong_ripple(state.recordings, state.base, state.nuisances)
    if ripple is None:
        return state
    rng = state.draws()
    rows = gather(subtract(state.recordings, ripple), neighbours_for(state.recordings))
    return replace(state, base=fit_base(replace(state.problem, rows=rows), rng, near=state.base), rng=rng)


def fit_time_warp(state: State) -> State:
    """Where one was asked for: the base with a time warp beside it, linearised anew where each fit stands. A sine once
    a turn is free meanwhile: that of an eccentric encoder, which is not known yet, would bend the drive and the warp.
    `state` is where the work stands.
    """
    if not state.nuisances.warps:
        return state
    rows, nuisances, fit, settings = state.problem.rows, state.nuisances, state.base, state.settings.nuisance
    once_a_turn = sine_columns(rows.theta, [1])

    def beside(own: Array, *others: Array) -> Fit:
        """The fit's way down with the nuisances' `own` columns (n, q) and `others` free, from what it knows of these
        own."""
        problem = replace(state.problem, nuisance=np.column_stack([own, *others]))
        known = fit.offsets[: own.shape[1]]
        free = np.r_[known, np.zeros(problem.nuisance.shape[1] - len(known))]
        return refine(evaluate(problem, fit.errors, free, (), ()), settings.warp_iterations)

    for _ in range(settings.warp_rounds):
        nuisances = with_time_warp(nuisances, fit)
        own = nuisances.columns(rows)
        fit = beside(own, once_a_turn)
    return replace(state, base=beside(own), nuisances=nuisances)


def fit_base_in_noise(state: State) -> State:
    """The noise is measured, and the base fitted in it, once as it is and once beside smooth columns; where these leave
    much, also beside waves of the teeth. `state` is where the work stands.
    """
    rng, settings = state.draws(), state.settings.base
    measured = measure_noise(state.base)
    problem = state.problem.with_noise(measured.noise)
    base = refine(fit_base(problem, rng, settings.starts_again, near=state.base), settings.measured_iterations)
    clean = fit_clean_base(problem, rng)
    wavy = None
    if clean is not None and is_left_wavy(base):
        wavy = beside_waves(beside_smooth(clean), copy.deepcopy(rng))
    return replace(state, base=base, clean=clean, wavy=wavy, inflation=measured.inflation, rng=rng)


def choose_orientation(state: State) -> State:
    """Both ways of counting the angles are fitted; where neither base explains clearly more, with their effects.
    `state` is where the work stands; the draws are its own, so that a recording as counted goes on as without them.
    """
    return oriented(state, better_way)


def choose_orientation_at_first_look(state: State) -> State:
    """As `choose_orientation`, but where neither base explains clearly more, the one in which a first look at the
    effects explains more: a search saved. `state` is where the work stands.
    """
    return oriented(state, likelier_way_with_effects)


def oriented(state: State, undecided: Callable[[State, State], State]) -> State:
    """`state` on its recordings as counted or turned round, by what the base explains. `undecided` chooses where that
    is not clear: of the state and its turned counterpart.
    """
    problem = state.problem
    output = -1 if state.recordings[0].output_reversed else 1
    if problem.base is None or problem.rows.locked or state.nuisances.warps:
        return replace(state, orientation=Orientation(1, output, "no model"))
    rng, settings = state.draws(), state.settings
    turned = begin_turned(state)
    turned = replace(turned, base=fit_base(turned.problem.with_noise(problem.noise), rng, near=turned.base))
    preferred = [preference(state.base, turned.base)]
    if not abs(preferred[0]) > settings.orientation.base_alone and state.clean is not None:
        clean = fit_clean_base(turned.problem, rng)
        if clean is not None:
            preferred = preferences_beside(preferred, state, beside_smooth(clean), rng)
    turned = replace(turned, orientation=Orientation(-1, -output, "data"))
    state = replace(state, orientation=Orientation(1, output, "data"))
    way = state if preferred[0] > 0 else turned
    if is_decisive(preferred, settings.orientation) and not is_told_otherwise(way):
        return way if way is state else fit_base_in_noise(way)
    return undecided(state, turned)


def is_told_otherwise(way: State) -> bool:
    """Whether what was found on other rows of the recordings was found counted the other way than this `way`: a large
    effect bends both bases, and which of them it bends more is no matter of the drive."""
    return any(guess.turned != way.orientation.turned for guess in way.guesses)


def preferences_beside(alone: Sequence[float], state: State, turned: Fit, rng: np.random.Generator) -> list[float]:
    """The preferences of the base of `state`, `alone` and beside smooth columns, of which `turned` is the fit turned
    round. Where there are waves of the teeth, by which bases that do without are bent, that beside waves in place of
    both; beside `alone`, where waves leave much more than noise too: it is not for what they hold that one way wins.
    `rng` draws new drives.
    """
    if state.clean is None or state.wavy is None:
        return [*alone, *([] if state.clean is None else [preference(beside_smooth(state.clean), turned)])]
    other = beside_waves(turned, rng) or turned
    better = min(state.wavy, other, key=lambda fit: fit.objective)
    return [*(alone if is_left_wavy(better) else ()), preference(state.wavy, other)]


def begin_turned(state: State) -> State:
    """`state` before its noise was measured, on its recordings turned round."""
    seed = int(state.draws().integers(np.iinfo(np.int64).max))
    asked = ("drift",) if state.nuisances.drift else ()
    taken = None if state.nuisances.taken is None else state.nuisances.taken.turned
    rng = np.random.default_rng(seed)
    turned = first_fit(turn_round(state.recordings), state.problem.base, rng, state.settings, asked, taken)
    return set_strong_ripple_aside(replace(turned, guesses=state.guesses, guessed_ripple=state.guessed_ripple))


def smooth_model(
    recordings: Sequence[Recording],
    base: CartesianModel | None,
    seed: int,
    settings: DiagnosisSettings,
    nuisance: Sequence[str] = (),
) -> Array:
    """What the `base` and smooth columns beside it make of the averaged rows of `recordings`, (n,) arcmin; smooth
    columns alone for a gear without one. `seed`, `settings` and `nuisance` as in `begin`.
    """
    state = begin(recordings, base, seed, settings, nuisance)
    clean = fit_clean_base(state.problem, state.draws())
    if clean is not None:
        residual = beside_smooth(clean).residual
    else:
        rows = state.problem.rows
        columns = np.column_stack([state.problem.nuisance, generic_columns(rows, settings=settings.generic)[0]])
        residual = rows.error - columns @ np.linalg.lstsq(columns, rows.error, rcond=None)[0]
    return np.asarray(gather(recordings, neighbours_for(recordings)).error - residual)


def better_way(state: State, turned: State) -> State:
    """Of `state` and its `turned` counterpart the one whose effects and base explain more together; `state`, by
    convention, where that is a tie. A first look decides where it is clear enough, and what was found on other rows
    does not speak against it: that is no part of a first look.
    """
    other, settings = fit_base_in_noise(turned), state.settings.orientation
    ways = [with_first_look(way) for way in in_one_noise(state, other)]
    gap = gap_at_first_look(ways)
    clearer = ways[0] if gap > 0 else other
    if abs(gap) > settings.first_look and not is_told_otherwise(clearer):
        return clearer
    ways = [search_effects(way) for way in ways]
    scores = [explained(way) - unexplained(way) for way in ways]
    if abs(scores[0] - scores[1]) < settings.tie:
        return replace(ways[0], orientation=replace(state.orientation, decided_by="convention"))
    # Turned round, the noise is another, and the search goes on in it from what was found.
    return ways[0] if scores[0] > scores[1] else replace(other, selection=ways[1].selection)


def likelier_way_with_effects(state: State, turned: State) -> State:
    """Of `state` and its `turned` counterpart the one in which a first look at the effects explains more."""
    other = fit_base_in_noise(turned)
    ways = [with_first_look(way) for way in in_one_noise(state, other)]
    return ways[0] if gap_at_first_look(ways) >= 0 else other


def in_one_noise(state: State, other: State) -> list[State]:
    """`state` and `other`, its counterpart turned round, both in the noise of the first."""
    ways = []
    for way in (state, other):
        problem = way.problem.with_noise(state.problem.noise)
        base = refine(on_problem(way.base, problem), way.settings.fit.known_iterations)
        ways.append(replace(way, base=base, inflation=state.inflation))
    return ways


def with_first_look(way: State) -> State:
    """`way` with the first look about its base, from which a search goes on."""
    return replace(way, looked=first_look(way.base, way.inflation, way.draws(), plan_of(way)))


def gap_at_first_look(ways: Sequence[State]) -> float:
    """By how much log evidence the first of two `ways` explains more than the second, its base and the best of a first
    look at the effects together.
    """
    first, second = (most_explained(way.looked) - unexplained(way) for way in ways if way.looked is not None)
    return first - second


def explained(state: State) -> float:
    """What the best set of `state` explains beyond its base, as log evidence that pays for freedom and search alone: a
    set that completed another need not pay for inexact shapes, one that led from the first on does.
    """
    return paid_for_freedom(state.selection.best, penalty_scale(state.problem, state.inflation))


def unexplained(state: State) -> float:
    """What the base of `state` leaves, as the log evidence against it."""
    return state.base.objective / state.problem.noise.sigma**2 / state.inflation / 2


def plan_of(state: State) -> SearchPlan:
    """What a search from `state` on is to do: what was found in another noise, and elsewhere, is where it begins."""
    told = (guessed(guess, state.problem) for guess in guesses_here(state))
    known = (*leaders_on(state.selection, state.problem), *told)
    wavy = None if state.wavy is None else drive_with_terms(state.wavy, state.problem)
    return SearchPlan(skip=state.ruled_out, clean=state.clean, wavy=wavy, known=known)


def search_effects(state: State) -> State:
    """Which effects explain what the base leaves, unless it was looked for already: in this noise that stands, in
    another it is where the search begins. What was found elsewhere does not save the first look. `state` is where the
    work stands.
    """
    if state.searched:
        return state
    if state.looked is None and guesses_here(state):
        state = with_first_look(state)
    if state.looked is None:
        rng = state.draws()
        found = select(state.base, state.inflation, rng, plan_of(state))
    else:
        rng = copy.deepcopy(state.looked.rng)
        found = select_from(replace(state.looked, rng=rng))
    return replace(state.found(found), rng=rng, searched=True, looked=None)


def guesses_here(state: State) -> tuple[Guess, ...]:
    """What was found on other rows of the recordings, as they are counted at `state`: the two zones of a drive make
    many minima, of which a search may miss the best. A gear without a base has no zones.
    """
    if state.problem.base is None:
        return ()
    return tuple(guess for guess in state.guesses if guess.turned == state.orientation.turned)


def guessed(guess: Guess, problem: FitProblem) -> Fit:
    """The model of `guess` on the rows of `problem`, with the offsets that these want."""
    bare = evaluate(problem, guess.errors, np.zeros(problem.nuisance.shape[1]), (), ())
    terms = [problem.explanations[effect].term(problem.rows, shape, bare.motion) for effect, shape in guess.terms]
    return with_offsets(evaluate(problem, guess.errors, bare.offsets, terms, guess.coefficients))


def measure_noise_again(state: State) -> State:
    """The noise again, now without what was found: where that was most of what is there, more shows beside it.
    `state` is where the work stands.
    """
    rng, settings = state.draws(), state.settings
    for _ in range(settings.noise.rounds):
        best = state.selection.best.fit
        measured = measure_noise(best)
        change = measured.noise.sigma / state.problem.noise.sigma
        if not best.terms or settings.noise.unchanged_from < change < settings.noise.unchanged_to:
            break
        problem = state.problem.with_noise(measured.noise)
        base = refine(on_problem(state.base, problem), settings.fit.known_iterations)
        plan = SearchPlan(skip=state.ruled_out, known=leaders_on(state.selection, problem))
        selection = select(base, measured.inflation, rng, plan)
        state = replace(state.found(selection), inflation=measured.inflation)
    return replace(state, rng=rng)


def search_high_orders(state: State) -> State:
    """Tooth mesh and encoder lines, on the rows as recorded. `state` is where the work stands."""
    rng = state.draws()
    high, ripple = ripple_beside_selection(state, rng)
    return replace(state, high=high, ripple=ripple, rng=rng)


def ripple_beside_selection(state: State, rng: np.random.Generator) -> tuple[Selection | None, Array | None]:
    """The orders above the averaged rows beside the selection of `state`, and what they add, as `find_ripple` has them;
    a ripple found on other rows of the recordings is told where these were counted as here. `rng` draws what is random.
    """
    guess = state.guessed_ripple
    told = guess if guess is not None and guess.turned == state.orientation.turned else None
    return find_ripple(state.recordings, state.selection, state.nuisances, state.ruled_out, rng, told)


def search_without_ripple(state: State) -> State:
    """Where a ripple was found: the rest is searched again on rows that are free of it. `state` is where the work
    stands.
    """
    if state.ripple is None or state.high is None:
        return state
    rng, settings, before = state.draws(), state.settings, state.selection.best
    cleaned = subtract(state.recordings, state.ripple)
    neighbours = neighbours_for(cleaned)
    rows = gather(cleaned, neighbours)
    problem = replace(state.problem, rows=rows, nuisance=state.nuisances.columns(rows))
    ripple = state.high.best.fit
    base = lowest_of_both_drives(on_problem(state.base, problem), ripple)
    rest = without_effects_of(ripple, before.fit)
    found = lowest_of_both_drives(on_problem(rest, problem), ripple) if rest.terms else base
    measured = measure_noise(found)
    base = refine(on_problem(base, problem.with_noise(measured.noise)), settings.fit.settled_iterations)
    leaders = leaders_on(state.selection, base.problem)
    there = at_drive_of(ripple, leaders)
    power = power_in_rows(state.ripple, ripple, row_of_each_sample(cleaned, neighbours))
    plan = SearchPlan(
        skip=state.ruled_out,
        known=(*leaders, *there, *each_left_out((*leaders[:1], *there[:1]))),
        subtracted=subtracted_terms(base, power, ripple.terms),
    )
    selection = select(base, measured.inflation, rng, plan)
    state = replace(state.found(selection), inflation=measured.inflation, rng=rng)
    changed = set(selection.best.effects) != set(before.effects)
    sizes = [float(np.var(fit.contributions)) for fit in (selection.best.fit, before.fit)]
    if state.ripple is not None and changed and max(sizes) > settings.high_order.beside * float(np.var(state.ripple)):
        # What was beside the ripple when it was named is not there any more.
        high, _ = ripple_beside_selection(state, rng)
        state = state if stands(state.high, high) else replace(state, high=high)
    return state


def settle_shapes(state: State) -> State:
    """Of a locked input: what is said must not stand on a node of the search's grid. `state` is where the work
    stands.
    """
    best = state.selection.best.fit
    if not state.problem.rows.locked:
        return state
    fit = settled(best)
    return state if fit is best else replace(state, selection=state.selection.with_best_fit(fit))


def bring_drive_home(state: State) -> State:
    """What is named beside a drive outside the tolerances of its kind is told beside one within them that leaves hardly
    more, where there is one. `state` is where the work stands.
    """
    best, rng = state.selection.best.fit, state.draws()
    home = brought_home(best, state.selection.inflation, rng) if best.terms else best
    return state if home is best else replace(state, selection=state.selection.with_best_fit(home), rng=rng)


def on_problem(fit: Fit, problem: FitProblem) -> Fit:
    """The parameters of `fit` on another problem's rows and noise."""
    terms = [
        replace(problem.explanations[t.effect].term(problem.rows, t.shape, fit.motion), trials=t.trials, odds=t.odds)
        for t in fit.terms
    ]
    return evaluate(problem, fit.errors, fit.offsets, terms, fit.coefficients)


def leaders_on(selection: Selection, problem: FitProblem) -> tuple[Fit, ...]:
    """The leaders of a search on another problem's rows and noise; none where nothing led. `selection` is what the
    search found.
    """
    return tuple(on_problem(fit, problem) for fit in selection.leaders) if selection.best.fit.terms else ()


STAGES: tuple[Callable[[State], State], ...] = (
    set_strong_ripple_aside,
    fit_time_warp,
    fit_base_in_noise,
    choose_orientation,
    search_effects,
    measure_noise_again,
    search_high_orders,
    search_without_ripple,
    settle_shapes,
    bring_drive_home,
)
"""A diagnosis, in the order of its work, after `begin`; `checks.assessment.assess` takes the last state."""

STAGES_OF_A_PART = tuple(
    choose_orientation_at_first_look if stage is choose_orientation else stage
    for stage in STAGES
    if stage is not bring_drive_home
)
"""The same on a part of the turns, whose error on the others is asked for and not its verdict: no second search where
the base leaves the orientation open, and the drive that explains best.
"""
