"""Joint fit: the base model's errors, offsets, and the terms of any effects, all at once.

Generalized least squares on whitened rows. The base enters through its Cartesian errors with a wide prior (it keeps
combinations that the recording cannot tell apart from running off); effects that act inside the meshing zones take
part in the choice of the driving zone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate, pairwise

import numpy as np

from hdopt.arrays import Array, Index, Mask
from hdopt.diagnosis.inference.base_excitation import (
    answered,
    driven_by,
    excites,
    has_memory,
    is_driven,
    motion_of,
    transmitted,
)
from hdopt.diagnosis.inference.catalogue import explanations
from hdopt.diagnosis.inference.newey_west import newey_west, reach_95
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.inference.normal_equations import GroupedColumns, bordered, sums_of_groups
from hdopt.diagnosis.inference.read_angle import read_ahead, reads_input, where_it_stood
from hdopt.diagnosis.inference.whitened_terms import WhitenedTerms
from hdopt.diagnosis.numerical import NORMAL_95, TINY
from hdopt.diagnosis.settings import DEFAULT, DiagnosisSettings
from hdopt.drive.geometry import ARCMIN
from hdopt.effects.base import Explanation
from hdopt.effects.estimate import FitEstimate
from hdopt.effects.met import ToothForms, met_angles, sum_of
from hdopt.effects.sines import sine_columns
from hdopt.effects.term import Shape, Term
from hdopt.kinematics.cartesian import PARAMETERS, CartesianModel, Evaluated
from hdopt.recordings.rows import Rows


@dataclass(frozen=True)
class FitProblem:
    """What is fitted: `rows`, the `base` model (None for a gear without one), `nuisance` columns that are always free
    (n, q), arcmin per coefficient, the `noise`, and `prior_scale`, by which the base's prior is widened.

    `settings` reach everything that is computed from the problem. `behind`, of problems without a base: driven terms
    with their coefficients that are held, which answer to the motion of whatever is fitted and to nothing else.
    """

    rows: Rows
    base: CartesianModel | None
    nuisance: Array
    noise: Noise
    prior_scale: float = 1.0
    settings: DiagnosisSettings = DEFAULT
    behind: tuple[tuple[Term, Array], ...] = ()

    @cached_property
    def whitened(self) -> dict[tuple[int, ...], WhitenedTerms]:
        """Whitened columns and their inner products of terms that the rows remember, by their identities."""
        return {}

    @property
    def explanations(self) -> Mapping[str, Explanation]:
        """Everything that may enter the fit, by id."""
        return explanations(self.settings.alternatives)

    @cached_property
    def rotation(self) -> Array:
        """The rows' angles as the base takes them, (4, n), as `CartesianModel.rotation` has them, in a sixth of its
        time; none for a gear without a base."""
        if self.base is None:
            return np.empty((0, len(self.rows)))
        sine, cosine, sine_fs, cosine_fs = sine_columns(self.rows.theta, [1.0, self.base.advance]).T
        return np.stack([cosine, sine, cosine_fs, sine_fs])

    def where_it_stood(self, ahead: Array | None) -> FitProblem:
        """The same problem at the angles at which the drive stood, where these were read `ahead` (n,) of it, rad (None:
        nowhere)."""
        return self if ahead is None else replace(self, rows=where_it_stood(self.rows, ahead))

    def met_angles(self, errors: Array) -> Array:
        """Angles of both splines at which both zones of a base with these `errors` (12,) mm meet them, rad,
        (2, 2, n)."""
        if self.base is None:
            raise ValueError("a gear without a base has no meshing zones")
        return met_angles(self.rows.theta, self.base.advance, self.base.beyond_at(self.rotation, errors))

    @property
    def base_width(self) -> int:
        return PARAMETERS if self.base is not None else 0

    @property
    def weighed_rows(self) -> float:
        """Rows that the noise gives a weight."""
        return float((self.noise.root_weight > 0).sum())

    @cached_property
    def prior(self) -> Array:
        """Standard deviations of the base's Cartesian errors, (12,) mm."""
        return np.array(self.settings.base.prior_mm) * self.prior_scale

    def prior_precision(self, width: int) -> Array:
        """What the prior knows of each of so many parameters (`width`), 1/mm^2: of the base's errors alone."""
        precision = np.zeros(width)
        precision[: self.base_width] = 1 / self.prior[: self.base_width] ** 2
        return precision

    @cached_property
    def box(self) -> Array:
        """Bounds of the base's Cartesian errors, (12,) mm."""
        return np.array(self.settings.base.box_mm) * self.prior_scale

    def with_noise(self, noise: Noise) -> FitProblem:
        return replace(self, noise=noise)

    def only(self, mask: Mask) -> FitProblem:
        """The same problem on the rows in `mask` (n,), with white noise."""
        rows = self.rows.rows(mask)
        return replace(self, rows=rows, nuisance=self.nuisance[mask], noise=Noise.white(rows, self.noise.sigma))


@dataclass(frozen=True)
class Fit:
    """A fitted model: base errors (mm), offsets, terms with coefficients; prediction and residual in arcmin;
    `objective` the whitened sum of squares plus the prior's, `design` the columns of the linearised model. `ahead`: by
    how much the terms say that the input angle was read ahead of where the drive stood, rad, (n,), None for nowhere."""

    problem: FitProblem
    errors: Array
    offsets: Array
    terms: tuple[Term, ...]
    coefficients: tuple[Array, ...]
    base_value: Array
    zone: Index
    prediction: Array
    objective: float
    base_jacobian: Array
    ahead: Array | None = None

    @property
    def residual(self) -> Array:
        return self.problem.rows.error - self.prediction

    @cached_property
    def met_angles(self) -> Array:
        """Angles of both splines at which both zones meet them, rad, (2, 2, n)."""
        return self.problem.where_it_stood(self.ahead).met_angles(self.errors)

    @cached_property
    def met_angle(self) -> Array:
        """Angles of both splines at which the driving zone meets them, rad, (2, n)."""
        angles = self.met_angles
        chosen: Array = np.where(self.zone == 0, angles[:, 0], angles[:, 1])
        return chosen

    @cached_property
    def motion(self) -> Array:
        """The drive's motion before its spring, arcmin, (n,): what excites a resonance."""
        return motion_of(self.base_value, self.terms, self.coefficients)

    @cached_property
    def of_a_reading(self) -> Array:
        """What an error of the input angle's reading, 1 arcmin at the output, adds to the record, arcmin, (n,): itself,
        less what the drive would do where it was read and did not where it stood."""
        if self.problem.base is None:
            return np.ones(len(self.problem.rows))
        ahead = np.zeros(len(self.problem.rows)) if self.ahead is None else self.ahead
        step = self.problem.settings.fit.reading_step_rad
        behind, before = (
            _base_value(self.problem, self.errors, self.terms, self.coefficients, ahead + side)[0][0]
            for side in (step, -step)
        )
        slope: Array = (before - behind) / (2 * step)
        return 1 - ARCMIN * self.problem.rows.ratio * slope

    def all_but(self, index: int) -> list[int]:
        """The numbers of the terms without `index`: what to keep beside it."""
        return [i for i in range(len(self.terms)) if i != index]

    def contribution(self, index: int) -> Array:
        """What term `index` adds to the prediction, arcmin: with its zones' driving switched as fitted."""
        return term_columns(self.terms[index], self) @ self.coefficients[index]

    def _swung_behind(self) -> Array:
        """What the held terms of the problem add for the motion of those that are fitted, arcmin, (n,)."""
        return answered(self.motion, self.problem.rows, self.problem.behind)

    @property
    def contributions(self) -> Array:
        """What all terms add, arcmin, with what swings behind them."""
        none = np.zeros(len(self.problem.rows))
        return sum((self.contribution(i) for i in range(len(self.terms))), none) + self._swung_behind()

    def seen(self, columns: Array, keep: Sequence[int] | None = None) -> Array:
        """Columns of the drive's motion (n, k) as its output shows them beside the terms of `keep`, all by default."""
        kept = range(len(self.terms)) if keep is None else keep
        weighed = [*((self.terms[i], self.coefficients[i]) for i in kept), *self.problem.behind]
        return transmitted(columns, self.problem.rows, weighed)

    def columns_of(self, term: Term, keep: Sequence[int] | None = None) -> Array:
        """A term's columns as the output shows them beside the terms of `keep`, all by default, (n, p)."""
        columns = term_columns(term, self)
        return self.seen(columns, keep) if excites(term) else columns

    def design(self, keep: Sequence[int] | None = None, move_shapes: bool = True) -> Array:
        """Columns: base errors, offsets, then for each term of `keep` (all by default) its coefficients and, with
        `move_shapes`, its free shape parameters; (n, q).
        """
        return side_by_side(self._blocks(keep, move_shapes))

    def white_design(self, keep: Sequence[int] | None = None, move_shapes: bool = True) -> Array:
        """The columns of `design` whitened, (n, q), without a copy of them beside each other."""
        return self.problem.noise.whitened(self._blocks(keep, move_shapes))

    def _blocks(self, keep: Sequence[int] | None, move_shapes: bool) -> list[Array]:
        """The columns of `design`, block by block."""
        blocks, excite = [self.base_jacobian, self.problem.nuisance], [True, False]
        for i in range(len(self.terms)) if keep is None else keep:
            term = self.terms[i]
            blocks.append(term_columns(term, self))
            if move_shapes and term.steps:
                blocks.append(shape_columns(self, i))
            excite += [excites(term)] * (len(blocks) - len(excite))
        if self.problem.behind or any(is_driven(term) for term in self.terms):
            blocks = self._all_seen(blocks, excite, keep)
        return blocks

    def _all_seen(self, blocks: list[Array], excite: list[bool], keep: Sequence[int] | None) -> list[Array]:
        """`blocks` of columns as the output shows them: those that `excite` what swings behind it, all at once."""
        exciting = [block for block, does in zip(blocks, excite, strict=True) if does]
        seen = self.seen(side_by_side(exciting), keep)
        parts = iter(np.split(seen, np.cumsum([block.shape[1] for block in exciting])[:-1], axis=1))
        return [next(parts) if does else block for block, does in zip(blocks, excite, strict=True)]

    def normal_equations(self, move_shapes: bool = True) -> tuple[Array, Array]:
        """Inner products of the whitened columns of `design` with each other, (q, q), and with the whitened residual,
        (q,). Heights of single teeth, of which each row meets one, are never written out as columns.
        """
        noise, heights = self.problem.noise, self._heights()
        keep = None if heights is None else self.all_but(len(self.terms) - 1)
        white, residual = self.white_design(keep, move_shapes), noise.whiten(self.residual)
        if heights is not None:
            return bordered(white, residual, heights)
        return white.T @ white, white.T @ residual

    def _heights(self) -> GroupedColumns | None:
        """The whitened columns of the last term, where they are several heights of teeth, and neither the noise nor
        what is driven by them reaches from row to row; else None.
        """
        base, noise, term = self.problem.base, self.problem.noise, self.terms[-1] if self.terms else None
        if base is None or term is None or term.steps or not isinstance(term.met, ToothForms) or term.width == 1:
            return None
        if len(noise.ar) or any(has_memory(one) for one in self.terms):
            return None
        tooth, form = term.met.places(self.met_angle[term.met.spline])
        size = base.arcmin_per_mm * self.seen(form[:, None])[:, 0]
        return GroupedColumns(tooth, noise.whiten(size), term.met.heights)

    @cached_property
    def _curvature(self) -> tuple[Array, Array, float, Array]:
        """Whitened design (n, q) and residual (n,), the variance of the latter, arcmin^2, and the covariance (q, q)
        that the curvature of the objective gives."""
        design = self.white_design()
        residual = self.problem.noise.whiten(self.residual)
        freedom = max(len(residual) - design.shape[1], 1)
        sigma2 = max(float(residual @ residual) / freedom, self.problem.settings.fit.variance_floor)
        normal = design.T @ design / sigma2 + np.diag(self.problem.prior_precision(design.shape[1]))
        return design, residual, sigma2, np.linalg.pinv(normal, hermitian=True)

    def expected_rises(self) -> Array:
        """By how much the objective rises as its curvature says, per square of each parameter's change, the others
        fitted again, (q,)."""
        _, _, sigma2, inverse = self._curvature
        rises: Array = sigma2 / np.maximum(np.diag(inverse), TINY)
        return rises

    def along(self, index: int, name: str, change: float) -> Fit:
        """The fit with the free shape parameter `name` of term `index` moved by `change`, and all others by as much as
        the curvature of the objective says that they follow."""
        at = self.problem.base_width + self.problem.nuisance.shape[1]
        at += sum(term.freedom for term in self.terms[:index])
        at += self.terms[index].width + list(self.terms[index].steps).index(name)
        *_, inverse = self._curvature
        return moved(self, inverse[:, at] * (change / max(float(inverse[at, at]), TINY)), True)

    def covariance(self) -> Array:
        """`_robust_covariance`, worked out once."""
        return self._robust_covariance

    @cached_property
    def _robust_covariance(self) -> Array:
        """Covariance of all parameters, robust against what the noise model misses: the larger, parameter by parameter,
        of the model-based one and the sandwich over whole turns, whose variance is as much larger as makes +-1.96
        standard deviations hold 95 %: it is known from few turns that do not hang together."""
        settings = self.problem.settings.fit
        design, residual, sigma2, inverse = self._curvature
        block = self.problem.rows.block
        scores = sums_of_groups(design, block, residual / sigma2, block[-1] + 1)
        # Wander outlasts a turn: neighbouring turns' scores count too, with falling weight.
        lags = min(settings.lags_turns, len(scores) // settings.turns_a_lag)
        sandwich = inverse @ newey_west(scores, lags) @ inverse
        blocks = block[-1] + 1
        sandwich *= blocks / max(blocks - 1, 1) * (reach_95(lags, blocks) / NORMAL_95) ** 2
        ratio = np.sqrt(np.maximum(np.diag(sandwich) / np.maximum(np.diag(inverse), TINY), 1.0))
        robust: Array = inverse * np.outer(ratio, ratio)
        return robust

    def estimates(self) -> list[FitEstimate]:
        """Values and covariance of each term's coefficients and free shape parameters."""
        covariance = self.covariance()
        start = self.problem.base_width + self.problem.nuisance.shape[1]
        found = []
        for term, coefficients in zip(self.terms, self.coefficients, strict=True):
            end = start + term.freedom
            values = np.r_[coefficients, [term.shape[name] for name in term.steps]]
            found.append(FitEstimate(values, covariance[start:end, start:end]))
            start = end
        return found


def side_by_side(blocks: Sequence[Array]) -> Array:
    """`blocks` of columns, each (n, k), beside each other, (n, q); every column lies in one piece, as filters and
    products read it.
    """
    ends = list(accumulate((block.shape[1] for block in blocks), initial=0))
    columns = np.empty((len(blocks[0]), ends[-1]), order="F")
    for block, (start, end) in zip(blocks, pairwise(ends), strict=True):
        columns[:, start:end] = block
    return columns


def term_columns(term: Term, fit: Fit) -> Array:
    """The term's columns in arcmin per coefficient, (n, p), with the zones as they drive, and as they meet the
    splines, in `fit`."""
    base, zone = fit.problem.base, fit.zone
    if base is not None and term.met is not None:
        met: Array = term.met.columns(fit.met_angle[term.met.spline], zone)
        met *= base.arcmin_per_mm
        return met
    if base is not None and term.zones is not None:
        columns: Array = base.arcmin_per_mm * np.where((zone == 0)[:, None], term.zones[0], term.zones[1])
        return columns
    if term.columns is None:
        return np.zeros((len(zone), term.width))
    return term.columns * fit.of_a_reading[:, None] if reads_input(term) else term.columns


def shape_columns(fit: Fit, index: int) -> Array:
    """Derivative of term `index`'s contribution by its free shape parameters, (n, k), by central differences. `fit`
    is the one looked at.
    """
    term, problem = fit.terms[index], fit.problem
    columns = []
    for name, step in term.steps.items():
        sides = []
        for sign in (1, -1):
            shifted = {**term.shape, name: term.shape[name] + sign * step}
            moved = problem.explanations[term.effect].term(problem.rows, shifted, fit.motion)
            sides.append(term_columns(moved, fit) @ fit.coefficients[index])
        columns.append((sides[0] - sides[1]) / (2 * step))
    return np.column_stack(columns) if columns else np.empty((len(problem.rows), 0))


def evaluate(
    problem: FitProblem, errors: Array, offsets: Array, terms: Sequence[Term], coefficients: Sequence[Array]
) -> Fit:
    """The model of `problem` at given parameters: `errors` of the base (12,) mm, `offsets` of its nuisance columns
    (q,), and `terms` with their `coefficients`.
    """
    rows = problem.rows
    ahead = read_ahead(rows, terms, coefficients)
    angles = None
    if problem.base is not None:
        (base_value, zone, jacobian), angles = _base_value(problem, errors, terms, coefficients, ahead)
    else:
        base_value, zone, jacobian = (
            np.zeros(len(rows)),
            np.zeros(len(rows), np.int64),
            np.empty((len(rows), 0)),
        )
    motion = motion_of(base_value, terms, coefficients)
    terms = driven_by(motion, rows, terms)
    prediction = base_value + problem.nuisance @ offsets
    if problem.behind:
        prediction = prediction + answered(motion, rows, problem.behind)
    for term, c in zip(terms, coefficients, strict=True):
        if term.columns is not None:
            prediction = prediction + term.columns @ c
    white = problem.noise.whiten(rows.error - prediction)
    objective = float(white @ white)
    if problem.base is not None:
        objective += problem.noise.sigma**2 * float(np.sum((errors / problem.prior) ** 2))
    own = tuple(coefficients)
    fit = Fit(problem, errors, offsets, tuple(terms), own, base_value, zone, prediction, objective, jacobian, ahead)
    if angles is not None:
        fit.__dict__["met_angles"] = angles  # The cached property, worked out already.
    return fit


def _base_value(
    problem: FitProblem, errors: Array, terms: Sequence[Term], coefficients: Sequence[Array], ahead: Array | None
) -> tuple[Evaluated, Array | None]:
    """The base of `problem`, which it must have, with these `errors` and what `terms` add in its zones, where the input
    angle was read `ahead` (n,) of where the drive stood, rad (None: nowhere); and the angles at which the splines are
    met there, rad, (2, 2, n), None where no term stands on one."""
    assert problem.base is not None
    stood = problem.where_it_stood(ahead)
    angles = stood.met_angles(errors) if any(term.met is not None for term in terms) else None
    extra, rises = _in_zones(angles, terms, coefficients)
    return problem.base.evaluate_at(stood.rotation, errors, extra, rises), angles


def _in_zones(
    angles: Array | None, terms: Sequence[Term], coefficients: Sequence[Array]
) -> tuple[Array | None, Array | None]:
    """What `terms` add to the deviation of both zones, mm of arc, (2, n), and its slopes over the `angles` at which the
    splines are met, mm/rad, (2, 2, n); None where nothing does."""
    extra: Array | None = None
    rises: Array | None = None
    on_splines = []
    for term, c in zip(terms, coefficients, strict=True):
        if term.met is not None:
            on_splines.append((term.met, c))
        elif term.zones is not None:
            extra = term.zones @ c if extra is None else extra + term.zones @ c
    if angles is not None:
        added, rises = sum_of(on_splines, angles)
        extra = added if extra is None else extra + added
    return extra, rises


def moved(fit: Fit, step: Array, move_shapes: bool) -> Fit:
    """`fit` with all its parameters moved by `step` (q,), in the order of `Fit.design`, the base's errors kept in their
    box; the shapes of terms stay where not `move_shapes`."""
    problem, settings = fit.problem, fit.problem.settings.fit
    wb, position = problem.base_width, problem.base_width + problem.nuisance.shape[1]
    terms, coefficients = [], []
    for term, c in zip(fit.terms, fit.coefficients, strict=True):
        delta = step[position : position + term.width]
        position += term.width
        if move_shapes and term.steps:
            shape = dict(term.shape)
            for name in term.steps:
                limit = settings.shape_share * abs(shape[name]) + settings.shape_steps * term.steps[name]
                shape[name] += float(np.clip(step[position], -limit, limit))
                position += 1
            # What the motion drives waits for `evaluate`, which knows the motion.
            term = replace(term, shape=shape) if is_driven(term) else _at_shape(fit, term, shape)
        terms.append(term)
        coefficients.append(c + delta)
    errors = np.clip(fit.errors + step[:wb], -problem.box[:wb], problem.box[:wb])
    offsets = fit.offsets + step[wb : wb + problem.nuisance.shape[1]]
    return evaluate(problem, errors, offsets, terms, coefficients)


def _at_shape(fit: Fit, term: Term, shape: Shape) -> Term:
    """`term` at another `shape`, beside what is in `fit`."""
    shifted = fit.problem.explanations[term.effect].term(fit.problem.rows, shape, fit.motion)
    free = {name: shifted.steps[name] for name in term.steps}  # a parameter that is held stays so
    return replace(shifted, trials=term.trials, odds=term.odds, steps=free)


def in_shape(fit: Fit, index: int, shape: Shape) -> Fit:
    """`fit` with term `index` at another `shape`, all else as it stands."""
    terms = list(fit.terms)
    terms[index] = _at_shape(fit, terms[index], shape)
    return evaluate(fit.problem, fit.errors, fit.offsets, terms, fit.coefficients)


def with_terms(fit: Fit, keep: Sequence[int]) -> Fit:
    """`fit` with the terms numbered in `keep` alone, all else as it stands."""
    terms, coefficients = [fit.terms[i] for i in keep], [fit.coefficients[i] for i in keep]
    return evaluate(fit.problem, fit.errors, fit.offsets, terms, coefficients)


def extend(fit: Fit, terms: Sequence[Term]) -> Fit:
    """`fit` with further terms, at coefficients of zero."""
    return evaluate(
        fit.problem,
        fit.errors,
        fit.offsets,
        [*fit.terms, *terms],
        [*fit.coefficients, *(np.zeros(term.width) for term in terms)],
    )
