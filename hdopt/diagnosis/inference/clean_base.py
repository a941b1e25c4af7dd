"""A base that is less bent towards what is missing: fitted beside columns that soak up what the model leaves out.

Smooth columns take up what is additive: load, speed, time, reversals. Waves of the teeth act inside the meshing zones
and choose which one drives; a base without them is drawn to the end of its box, and all that is looked for about such
a base is wrong. Beside them it comes to the drive from nearly every start.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.inference.base_fit import fit_base
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import Fit, FitProblem, evaluate
from hdopt.diagnosis.inference.generic_basis import generic_columns
from hdopt.diagnosis.inference.normal_equations import least_squares
from hdopt.effects.sines import sine_columns
from hdopt.effects.term import Term
from hdopt.parallel.shared_memory import each

ORDER_DOMAINS = ("integer order", "output-synchronous order", "asynchronous order")
"""Domains of the generic basis in which the base itself lives."""

FS_TEETH, CS_TEETH = "fs_tooth_harmonics", "cs_tooth_harmonics"
Members = tuple[tuple[str, int], ...]
"""Waves of the teeth by effect, from the second wave to the last."""
WAVES_OF_TEETH: tuple[Members, ...] = tuple(
    tuple((effect, last) for effect in effects)
    for last in (8, 24)
    for effects in ((FS_TEETH,), (CS_TEETH,), (FS_TEETH, CS_TEETH))
)
"""Sets of them: long ones of either spline and of both."""


def fit_clean_base(problem: FitProblem, rng: np.random.Generator) -> Fit | None:
    """The base of `problem` fitted beside smooth columns that soak up most additive physics, from drives drawn by
    `rng`, then looked at without them.
    """
    if problem.base is None:
        return None
    return drive_alone(fit_base(with_smooth_columns(problem), rng, problem.settings.base.starts_clean), problem)


def with_smooth_columns(problem: FitProblem) -> FitProblem:
    """`problem` with smooth columns, and a sine once a turn, free beside the base."""
    columns, domains = generic_columns(problem.rows, settings=problem.settings.generic)
    wanted = [i for i, domain in enumerate(domains) if domain not in ORDER_DOMAINS]
    own = np.column_stack([problem.nuisance, columns[:, wanted], sine_columns(problem.rows.theta, [1])])
    return replace(problem, nuisance=own)


def drive_alone(fit: Fit, problem: FitProblem) -> Fit:
    """The drive of `fit`, made beside more than `problem` has, on that problem and without terms."""
    return _without_smooth_columns(fit, problem, (), ())


def drive_with_terms(fit: Fit, problem: FitProblem) -> Fit:
    """The drive of `fit`, made beside more than `problem` has, and its terms as they stand, on that problem."""
    return _without_smooth_columns(fit, problem, fit.terms, fit.coefficients)


def _without_smooth_columns(fit: Fit, problem: FitProblem, terms: Sequence[Term], coefficients: Sequence[Array]) -> Fit:
    """The drive of `fit` on `problem`, and `terms` with their `coefficients`, with the offsets that these want."""
    free = fit.offsets[: problem.nuisance.shape[1]]
    bare = evaluate(problem, fit.errors, free, terms, coefficients)
    offset = least_squares(problem.nuisance, bare.residual)
    return evaluate(problem, fit.errors, bare.offsets + offset, terms, coefficients)


def beside_smooth(clean: Fit) -> Fit:
    """A `clean` base's fit with its smooth columns beside it: what it was fitted for."""
    beside = with_smooth_columns(clean.problem)
    free = np.r_[clean.offsets, np.zeros(beside.nuisance.shape[1] - len(clean.offsets))]
    return refine(evaluate(beside, clean.errors, free, (), ()), beside.settings.fit.offset_iterations)


def power_beside_smooth(problem: FitProblem, rng: np.random.Generator) -> float:
    """What the base of `problem`, from drives drawn by `rng`, and smooth columns leave: a whitened sum of squares."""
    clean = fit_clean_base(problem, rng)
    return math.inf if clean is None else beside_smooth(clean).objective


def is_left_wavy(fit: Fit) -> bool:
    """Whether `fit` leaves so much more than noise that waves of the teeth may be among it."""
    return fit.objective >= fit.problem.settings.base.wavy * _of_noise(fit.problem)


def _of_noise(problem: FitProblem) -> float:
    """The whitened sum of squares that noise alone makes in the rows of `problem`, arcmin^2."""
    return problem.weighed_rows * problem.noise.sigma**2


def long_waves(problem: FitProblem) -> list[Term]:
    """The longest waves of each spline's teeth that the rows of `problem` hold; none without a base."""
    shortest = WAVES_OF_TEETH[0][0][1]
    alone = (members for members in _held_by(problem) if len(members) == 1 and members[0][1] == shortest)
    return [] if problem.base is None else [term for members in alone for term in _terms_of(problem, members)]


def _held_by(problem: FitProblem) -> list[Members]:
    """Those of the `WAVES_OF_TEETH` that the rows of `problem` hold."""

    def held(members: Members) -> bool:
        effects = [problem.explanations[effect] for effect, _ in members]
        return 2 * members[0][1] < problem.rows.rows_per_turn and all(e.lacks(problem.rows) is None for e in effects)

    return [members for members in WAVES_OF_TEETH if held(members)]


def _terms_of(problem: FitProblem, members: Members) -> tuple[Term, ...]:
    """Waves of the teeth, by effect and last wave (`members`), on the rows of `problem`."""
    waves = ((problem.explanations[effect], tuple(range(2, last + 1))) for effect, last in members)
    return tuple(effect.term(problem.rows, {"members": run}) for effect, run in waves)


def beside_waves(smooth: Fit, rng: np.random.Generator) -> Fit | None:
    """The base of `smooth`, its fit beside smooth columns, with those waves of the teeth beside these that pay best for
    their freedom, from drives drawn by `rng`; None where it leaves no more than noise, or where waves take up little of
    what is above it.
    """
    problem, settings = smooth.problem, smooth.problem.settings.base
    if problem.base is None:
        return None
    variance, of_noise = problem.noise.sigma**2, _of_noise(problem)
    if not is_left_wavy(smooth):
        return None

    def cost(fit: Fit) -> float:
        return fit.objective / variance + sum(term.width for term in fit.terms) * math.log(problem.weighed_rows)

    def fitted(numbered: tuple[Members, np.random.Generator]) -> Fit:
        members, own_rng = numbered
        return fit_base(problem, own_rng, settings.starts_clean, terms=_terms_of(problem, members))

    def takes_up(fit: Fit) -> bool:
        return fit.objective - of_noise < settings.wavy_share * (smooth.objective - of_noise)

    sets = _held_by(problem)
    if not sets:
        return None
    *fewer, all_waves = zip(sets, rng.spawn(len(sets)), strict=True)
    most = fitted(all_waves)
    # What all waves leave, fewer of them leave too.
    if not takes_up(most):
        return None
    best = min([smooth, *each(fitted, fewer), most], key=cost)
    return best if takes_up(best) else None
