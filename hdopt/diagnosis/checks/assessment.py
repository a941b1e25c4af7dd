"""The numbers that carry the verdict: held-out errors, the placebo, what is left, false alarms, limits of detection."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.diagnosis.checks.cyclostationarity import ArisingAtAnAngle, arising_at_an_angle
from hdopt.diagnosis.checks.false_alarm import best_score, false_alarm_chance
from hdopt.diagnosis.checks.other_laws import OtherLaw, other_law
from hdopt.diagnosis.checks.repeated_passes import RepeatedPasses, repeated_passes
from hdopt.diagnosis.checks.scale import Scale, fitted_scale
from hdopt.diagnosis.checks.slow_wander import SlowWave, slow_wave
from hdopt.diagnosis.checks.step_detection import Steps, sudden_steps
from hdopt.diagnosis.inference.base_excitation import is_driven
from hdopt.diagnosis.inference.catalogue import STRAIN_WAVE_ONLY
from hdopt.diagnosis.inference.conditions import AcrossConditions, across_conditions
from hdopt.diagnosis.inference.cross_validation import HeldOut, held_out, paired_t, turn_folds
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import Fit, evaluate, term_columns
from hdopt.diagnosis.inference.generic_basis import useful_columns
from hdopt.diagnosis.inference.hidden_turns import NestedHeldOut
from hdopt.diagnosis.inference.neighbour_noise import noise_between_neighbours
from hdopt.diagnosis.inference.nuisance import Nuisances
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.numerical import SMALLEST_POWER, TINY
from hdopt.diagnosis.orientation import Orientation
from hdopt.diagnosis.search.acceptance import is_acceptable
from hdopt.diagnosis.search.candidates import joint_fit, penalty_scale, search_terms
from hdopt.diagnosis.search.high_order import subtract
from hdopt.diagnosis.search.penalty import Scale as PenaltyScale
from hdopt.diagnosis.search.penalty import penalty
from hdopt.diagnosis.search.subset_search import Selection
from hdopt.diagnosis.settings import DiagnosisSettings
from hdopt.diagnosis.state import State
from hdopt.effects import EFFECTS, HIGH_ORDER
from hdopt.effects.probe import strongest_orders
from hdopt.effects.term import Term
from hdopt.recordings.recording import OF_ROUNDING, Recording
from hdopt.recordings.rows import Rows, gather, neighbours_for


@dataclass(frozen=True)
class Remainder:
    """What a fit leaves, as seen by the generic basis: its held-out error, the t of its win, its largest domain."""

    held_out: HeldOut
    t: float
    domains: dict[str, float]
    orders: tuple[float, ...]
    columns: Array


@dataclass(frozen=True)
class Evidence:
    """Everything the verdict is drawn from. Held-out errors are those of rows without the ripple that was found, that
    of the `drive_alone` with it.
    """

    rows: Rows
    selection: Selection
    high: Selection | None
    nuisances: Nuisances
    base_held_out: HeldOut
    drive_alone: HeldOut
    extended_held_out: HeldOut
    generic_held_out: HeldOut
    placebo_held_out: HeldOut
    placebo: str | None
    across_conditions: AcrossConditions | None
    remainder: Remainder
    noise_floor: float
    false_alarm_p: float
    inflation: float
    lacking: dict[str, str]
    below_detection: dict[str, float]
    steps: Steps
    wave: SlowWave | None
    arising: ArisingAtAnAngle
    orientation: Orientation
    neighbours_arcmin: float
    sensor_arcmin: float
    scale: Scale | None
    passes: RepeatedPasses
    other_law: OtherLaw
    nested: NestedHeldOut | None = None
    proposed: NestedHeldOut | None = None

    @property
    def sensors_noise(self) -> float:
        """Standard deviation that the sensors give a single sample, arcmin: what neighbouring samples show, or what
        rounding to the sensors' steps makes, if that is more."""
        return max(self.neighbours_arcmin, self.sensor_arcmin * OF_ROUNDING)

    @property
    def unseen(self) -> NestedHeldOut | None:
        """Errors on the hidden turns of the best set that the turns left to the diagnosis of a part know of."""
        return self.proposed or self.nested

    @property
    def settings(self) -> DiagnosisSettings:
        """Thresholds of this diagnosis."""
        return self.selection.base.problem.settings


def assess(state: State) -> Evidence:
    """The evidence on the last state of a diagnosis."""
    rng, selection = state.draws(), state.selection
    base, best, inflation = selection.base, selection.best.fit, state.inflation
    folds = turn_folds(base, rng)
    base_out = held_out(base, None, folds)
    best_out = base_out if best is base else held_out(best, None, folds)
    remainder = look_at_remainder(best, folds, inflation)
    generic_out = remainder.held_out
    if best is not base:
        generic_out = held_out(base, useful_columns(FitProbe(base), inflation)[0], folds)
    probe = FitProbe(base)
    strange = STRAIN_WAVE_ONLY if base.problem.base is None else ()
    pool = search_terms(probe, skip=state.ruled_out)
    scale = penalty_scale(base.problem, inflation)
    found = -np.inf if best is base else selection.best.log_bayes_factor
    observed = max(best_score(probe, pool, scale), found)

    def searched_anew(flipped: FitProbe) -> float:
        return best_score(flipped, search_terms(flipped, skip=state.ruled_out), scale)

    placebo = best_placebo(probe, pool, best)
    return Evidence(
        rows=state.problem.rows,
        selection=selection,
        high=state.high,
        nuisances=state.nuisances,
        base_held_out=base_out,
        drive_alone=base_out if state.ripple is None else held_out(with_the_ripple(state), None, folds),
        extended_held_out=best_out,
        generic_held_out=generic_out,
        placebo_held_out=base_out if placebo is None else placebo_error(probe, placebo, folds),
        placebo=None if placebo is None else placebo.effect,
        across_conditions=across_conditions(base, best),
        remainder=remainder,
        noise_floor=float(np.sqrt(min(remainder.held_out.variance, best_out.variance))),
        false_alarm_p=false_alarm_chance(
            probe.on(best.residual), searched_anew, rng, observed, most_flips(base_out, best_out, base.problem.settings)
        ),
        inflation=inflation,
        lacking=lacking_effects(state, strange),
        below_detection=detection_limits(FitProbe(best), pool, scale),
        steps=sudden_steps(best),
        wave=slow_wave(best),
        arising=arising_at_an_angle(best),
        orientation=state.orientation,
        neighbours_arcmin=noise_between_neighbours(without_ripple(state)),
        sensor_arcmin=max(one.quantum_arcmin for one in state.recordings),
        scale=fitted_scale(best, state.nuisances),
        passes=repeated_passes(best),
        other_law=other_law(best, inflation),
    )


def with_the_ripple(state: State) -> Fit:
    """The base of `state` on rows that have the ripple too, which was taken out of those of its selection."""
    base, recordings = state.selection.base, state.recordings
    rows = gather(recordings, neighbours_for(recordings))
    problem = replace(base.problem, rows=rows, nuisance=state.nuisances.columns(rows))
    alone = evaluate(problem, base.errors, base.offsets, (), ())
    return refine(alone, problem.settings.fit.settled_iterations)


def without_ripple(state: State) -> tuple[Recording, ...]:
    """The recordings of `state` without the ripple that was found in them: it is no noise between neighbours."""
    return state.recordings if state.ripple is None else tuple(subtract(state.recordings, state.ripple))


def most_flips(base: HeldOut, best: HeldOut, settings: DiagnosisSettings) -> int:
    """Flips that the chance of a false alarm is worth, where the base alone misses unseen turns by `base` and with the
    best explanation by `best`: few where that is not enough for a name, whatever the chance. `settings` are the
    thresholds.
    """
    enough = base.variance > (1 + settings.verdict.smallest_share) * best.variance
    return settings.held_out.flips if enough else settings.held_out.flips_of_nothing


def best_placebo(probe: FitProbe, pool: Sequence[Term], best: Fit) -> Term | None:
    """Of the terms in `pool` the single one of the catalogue that explains most of what `probe` sees and is no part of
    the `best` fit. One that swings must have the numbers of what swings: without them it is no other explanation.
    """
    found = {t.effect for t in best.terms}
    others = [t for t in pool if t.effect not in found and t.effect in EFFECTS]
    in_order = sorted(others, key=probe.gain, reverse=True)
    return next((t for t in in_order if not is_driven(t) or is_acceptable(joint_fit(probe.fit, [t]))), None)


def placebo_error(probe: FitProbe, placebo: Term, folds: Index) -> HeldOut:
    """Held-out error, on `folds` (n,), with the `placebo` beside the base that `probe` looks at."""
    return held_out(probe.fit, term_columns(placebo, probe.fit), folds)


def lacking_effects(state: State, strange: Sequence[str]) -> dict[str, str]:
    """What the recording lacks for each effect that it cannot show; `strange` are those that its gear cannot have.
    `state` is the last one.
    """
    has_base, rows = state.problem.base is not None, state.problem.rows
    lacking = {}
    for effect in EFFECTS.values():
        reason = effect.lacks(rows) if has_base or not effect.needs_base else "a harmonic-drive model (--drive)"
        if reason:
            lacking[effect.id] = reason
    lacking |= {name: "a harmonic drive (--drive)" for name in strange}
    lacking |= {name: "a fit without a free drift (--nuisance)" for name in state.nuisances.hidden}
    if state.high is not None:
        # What only needs more rows a turn was looked for on the rows as recorded.
        raw = state.high.base.problem.rows
        return {name: reason for name, reason in lacking.items() if name not in HIGH_ORDER or EFFECTS[name].lacks(raw)}
    return lacking


def look_at_remainder(fit: Fit, folds: Index, inflation: float) -> Remainder:
    """Held-out gain of the generic basis beside `fit`, on `folds` (n,) of its rows, in noise rougher by `inflation`."""
    settings = fit.problem.settings.held_out
    probe = FitProbe(fit)
    columns, domains = useful_columns(probe, inflation)
    orders = () if fit.problem.rows.locked else tuple(strongest_orders(probe, settings.remainder_orders))
    own = held_out(fit, None, folds)
    generic = held_out(fit, columns, folds)
    gains = {}
    for domain in dict.fromkeys(domains):
        chosen = [i for i, d in enumerate(domains) if d == domain]
        alone = held_out(fit, columns[:, chosen], folds)
        gains[domain] = own.variance - alone.variance
    t = paired_t(own.white, generic.white, settings)
    return Remainder(generic, t, gains, orders, columns)


def detection_limits(probe: FitProbe, terms: Sequence[Term], scale: PenaltyScale) -> dict[str, float]:
    """Smallest rms (arcmin) of each effect of `terms` that would have been found in the residual of `probe`: where its
    gain just pays its penalty by `scale`.
    """
    limits: dict[str, float] = {}
    for term in terms:
        raw = term_columns(term, probe.fit)
        left = (probe.columns(term) ** 2).sum(0)
        power = np.maximum((raw**2).mean(0), TINY)
        visible = float(np.mean(left / power))
        needed = 2 * scale.inflation * penalty([term], 0.0, scale) * probe.noise.sigma**2
        limit = math.sqrt(needed / max(visible, SMALLEST_POWER))
        limits[term.effect] = min(limit, limits.get(term.effect, math.inf))
    return limits
