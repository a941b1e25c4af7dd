"""Base fit: the kinematic-error model's twelve errors, estimated from recordings.

What Jia 2021 did by hand for its Table 5. The waveform is the larger of two zones, so it is not smooth and has
several minima: the fit starts from many random drives on thinned rows, keeps those that come out best, and refines
them on all rows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from hdopt.arrays import Array, Mask
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import Fit, FitProblem, evaluate
from hdopt.diagnosis.inference.normal_equations import least_squares
from hdopt.diagnosis.numerical import HALF, SMALLEST_POWER
from hdopt.diagnosis.settings import DEFAULT, BaseSettings
from hdopt.drive.errors import DriveErrors
from hdopt.effects.estimate import FitEstimate, Parameter
from hdopt.effects.sines import sine_columns
from hdopt.effects.term import Term
from hdopt.kinematics.cartesian import CARTESIAN_NAMES, PARAMETERS, to_drive_errors
from hdopt.parallel.shared_memory import each
from hdopt.recordings.rows import Rows
from hdopt.words import settled

SIZES = {
    "axis_eccentricity_mm": "axis eccentricity x",
    "axis_tilt_x_deg": "axis tilt x",
    "axis_tilt_y_deg": "axis tilt y",
    "wg_eccentricity_mm": "wave-generator eccentricity along its major axis",
    "wg_tilt_major_deg": "wave-generator tilt major",
    "wg_tilt_minor_deg": "wave-generator tilt minor",
    "cs_tooth_amplitude_mm": "CS tooth sine",
    "fs_tooth_amplitude_mm": "FS tooth sine",
}
"""Errors of the drive that have a size, each with the Cartesian error that has its bound."""


def fit_base(
    problem: FitProblem,
    rng: np.random.Generator,
    starts: int | None = None,
    terms: tuple[Term, ...] = (),
    near: Fit | None = None,
) -> Fit:
    """The best fit of the base of `problem`, with `terms` beside it, from so many random drives (`starts`; None: as
    set) drawn by `rng`, and from `near` where given.
    """
    settings = problem.settings.base
    starts = settings.starts if starts is None else starts
    zeros = [np.zeros(term.width) for term in terms]
    offsets = np.zeros(problem.nuisance.shape[1])
    if problem.base is None:
        return refine(evaluate(problem, np.zeros(0), offsets, terms, zeros))
    stride = max(1, len(problem.rows) // settings.rows_for_starts)
    mask = np.zeros(len(problem.rows), bool)
    mask[::stride] = True
    thin = problem.only(mask)
    thin_terms = [thinned(term, mask) for term in terms]

    def started(errors: Array) -> Fit:
        start = with_offsets(evaluate(thin, errors, offsets, thin_terms, zeros))
        return refine(start, settings.start_iterations, settings.start_tolerance, move_shapes=False)

    def met_again() -> bool:
        """Whether enough starts have met in the same best minimum."""
        least = settings.same_minimum * min(fit.objective for fit in candidates)
        return sum(fit.objective < least for fit in candidates) >= settings.same_minimum_starts

    # As many at once as are made in any case; then one by one.
    candidates = each(started, [drawn(problem, rng) for _ in range(min(starts, settings.fewest_starts))])
    while len(candidates) < starts and not met_again():
        candidates.append(started(drawn(problem, rng)))
    candidates.sort(key=lambda fit: fit.objective)

    def finished(candidate: Fit) -> Fit:
        full = evaluate(problem, candidate.errors, candidate.offsets, terms, candidate.coefficients)
        return refine(full, settings.full_iterations, move_shapes=False)

    finals = each(finished, candidates[: settings.kept_starts])
    if near is not None:
        again = evaluate(problem, near.errors, near.offsets, terms, near.coefficients if near.terms else zeros)
        finals.append(refine(again, settings.full_iterations, move_shapes=False))
    return min(finals, key=lambda fit: fit.objective)


def thinned(term: Term, mask: Mask) -> Term:
    """`term` on the rows of the `mask` alone."""
    return replace(
        term,
        columns=None if term.columns is None else term.columns[mask],
        zones=None if term.zones is None else term.zones[:, mask],
    )


def drawn(problem: FitProblem, rng: np.random.Generator) -> Array:
    """Errors (12,) mm of a random drive of the kind of `problem`, a part of its prior in size; `rng` draws both."""
    settings = problem.settings.base
    errors = rng.normal(size=PARAMETERS) * problem.prior
    return np.asarray(errors * rng.uniform(settings.smallest_start, settings.largest_start))


def with_offsets(fit: Fit) -> Fit:
    """`fit` with the offsets that leave least, all else as it is."""
    nuisance = fit.problem.nuisance
    offsets = fit.offsets + least_squares(nuisance, fit.residual)
    return evaluate(fit.problem, fit.errors, offsets, fit.terms, fit.coefficients)


def is_far(fit: Fit) -> Mask:
    """Which of the base's errors in `fit` lie far outside the tolerances of its kind, (12,); of a gear without a base
    none, (0,).
    """
    if fit.problem.base is None:
        return np.zeros(0, bool)
    return np.asarray(np.abs(fit.errors) > fit.problem.settings.base.far * fit.problem.prior)


def far_errors(fit: Fit) -> str:
    """The base's errors in `fit` that lie far outside the tolerances of its kind, in words, each with its size: those
    over their prior, or where none is those that are surely twice their tolerance; "" where neither is."""
    if (far := is_far(fit)).any():
        return ", ".join(f"{CARTESIAN_NAMES[i]} {fit.errors[i]:.3g} mm" for i in np.flatnonzero(far))
    return ", ".join(str(one) for one in beyond_tolerances(fit, fit.problem.settings.base.surely_far))


@dataclass(frozen=True)
class BeyondTolerance:
    """An error of the drive that is surely larger than is allowed: its study key, its size and the lower end of its
    95 % interval, both in `unit`, and what is `allowed`."""

    name: str
    size: float
    surely: float
    allowed: float
    unit: str

    @property
    def times(self) -> float:
        """How many times the tolerance it surely is."""
        return self.surely / self.allowed

    def __str__(self) -> str:
        return f"{self.name} {self.size:.2g} {self.unit}, tolerance {self.allowed:.2g}"


def beyond_tolerances(fit: Fit, least: float, of_study: bool = False) -> list[BeyondTolerance]:
    """Errors of the drive in `fit` that are surely larger than `least` times what is allowed, the farthest first; of a
    gear without a base none. What a recording leaves open is not beyond anything.

    Allowed is what the drive's study states where it is asked for (`of_study`) and states it, else what drives of its
    kind have: as the shipped study, or more where the drive's own states more. A part may be worse than its drawing and
    no sign of other physics.
    """
    base, settings = fit.problem.base, fit.problem.settings.base
    if base is None:
        return []
    found = []
    parameters, stated = base_estimate(fit).parameters, dict(settings.stated_tolerances)
    for name, cartesian in SIZES.items():
        one = parameters[name]
        length = fit.problem.box[CARTESIAN_NAMES.index(cartesian)] / settings.box_over_tolerance
        of_kind = length if one.unit == "mm" else math.degrees(math.atan(length / base.half_width))
        own = stated.get(name, of_kind)
        allowed = own if of_study else max(own, of_kind)
        surely = max(abs(one.value) - (one.high - one.value), 0.0)
        if surely > least * allowed:
            found.append(BeyondTolerance(name, abs(one.value), surely, float(allowed), one.unit))
    return sorted(found, key=lambda one: one.times, reverse=True)


@dataclass(frozen=True)
class BaseEstimate:
    """The base's errors as a drive's: parameters with intervals, and combinations that the recording leaves open."""

    errors: DriveErrors
    parameters: dict[str, Parameter]
    open_combinations: tuple[str, ...]
    rms_arcmin: float


def base_estimate(fit: Fit) -> BaseEstimate:
    """What the fit says of the drive's errors, with 95 % intervals and what it leaves open."""
    base = fit.problem.base
    rms = float(np.std(fit.base_value)) if base is not None else 0.0
    if base is None:
        return BaseEstimate(DriveErrors(), {}, (), rms)
    half_width = base.half_width
    covariance = fit.covariance()[:PARAMETERS, :PARAMETERS]
    return BaseEstimate(
        to_drive_errors(fit.errors, half_width),
        parameters_of(FitEstimate(fit.errors, covariance), half_width),
        open_combinations(covariance, fit.problem.prior, fit.problem.settings.base),
        rms,
    )


def parameters_of(cartesian: FitEstimate, half_width: float) -> dict[str, Parameter]:
    """Sizes (mm), directions, phases and tilts (deg) of a drive's errors, in the order of ERROR_NAMES by their study
    keys, from its `cartesian` errors (12), mm; `half_width` is b/2 of the wave generator, mm.

    The interval of a size begins at zero where its direction is open: what a recording does not see is no error of
    nought, it may be as large as drives of its kind have it.
    """

    def tilt(name: str, rises: str) -> dict[str, Parameter]:
        rise = cartesian.parameter(CARTESIAN_NAMES.index(rises), "mm")
        value, low, high = (math.degrees(math.atan(x / half_width)) for x in (rise.value, rise.low, rise.high))
        return {name: Parameter(value, low, high, "deg")}

    def pair(size: str, angle: str, along: str, across: str) -> dict[str, Parameter]:
        at = CARTESIAN_NAMES.index(along), CARTESIAN_NAMES.index(across)
        found = cartesian.amplitude(*at, unit="mm")
        return {size: replace(found, value=settled(found.value)), angle: cartesian.phase_deg(*at)}

    on_axis, on_wg = "axis eccentricity ", "wave-generator eccentricity along its "
    return {
        **pair("axis_eccentricity_mm", "axis_eccentricity_direction_deg", f"{on_axis}y", f"{on_axis}x"),
        **tilt("axis_tilt_y_deg", "axis tilt y"),
        **tilt("axis_tilt_x_deg", "axis tilt x"),
        **pair("wg_eccentricity_mm", "wg_eccentricity_direction_deg", f"{on_wg}major axis", f"{on_wg}minor axis"),
        **tilt("wg_tilt_major_deg", "wave-generator tilt major"),
        **tilt("wg_tilt_minor_deg", "wave-generator tilt minor"),
        **pair("cs_tooth_amplitude_mm", "cs_tooth_phase_deg", "CS tooth sine", "CS tooth cosine"),
        **pair("fs_tooth_amplitude_mm", "fs_tooth_phase_deg", "FS tooth sine", "FS tooth cosine"),
    }


def open_combinations(covariance: Array, prior: Array, settings: BaseSettings = DEFAULT.base) -> tuple[str, ...]:
    """Combinations of Cartesian errors that the data leave uncertain by a good part of their prior, largest members
    named: from their `covariance` (12, 12) in mm^2 and the standard deviations of their `prior` (12,) in mm.
    `settings` are the thresholds.
    """
    values, vectors = np.linalg.eigh(covariance / np.outer(prior, prior))
    found = []
    for value, vector in zip(values, vectors.T, strict=True):
        if value > settings.open_share:
            order = np.argsort(-np.abs(vector))
            least = settings.open_member * abs(vector[order[0]])
            members = [i for i in order if abs(vector[i]) > least][: settings.open_members]
            found.append(" with ".join(CARTESIAN_NAMES[i] for i in members))
    return tuple(found)


def beat_warning(rows: Rows, settings: BaseSettings = DEFAULT.base) -> str | None:
    """What a record shorter than an output turn cannot carry: whole orders k and those of the flexspline, k (1 + 1/N).

    Both together beat once an output turn. The standard error of either grows, against a whole output turn at the
    same sampling, by the root of N/turns and of what order 2 keeps of its power once 2 (1 + 1/N) is taken out.
    None where that is less than the `settings` say (3). `rows` are those of the recordings.
    """
    order, other = 2.0, 2.0 * (1 + 1 / rows.ratio)
    beside = np.column_stack([sine_columns(rows.theta, [other]), np.ones(len(rows))])
    own = sine_columns(rows.theta, [order])
    left = own - beside @ np.linalg.lstsq(beside, own, rcond=None)[0]
    kept = max(float(np.min(np.linalg.eigvalsh(left.T @ left))) / len(rows) / HALF, SMALLEST_POWER)
    part = rows.span_turns / rows.ratio
    growth = math.sqrt(1 / kept / min(part, 1.0))
    if growth < settings.beat_growth:
        return None
    return (
        f"{rows.span_turns:.2g} input turns are {part:.2g} of an output turn: orders k and k (1 + 1/N) are told "
        f"apart {growth:.2g} times worse than by a whole one; what stands there may be the circular spline's or the "
        "flexspline's"
    )
