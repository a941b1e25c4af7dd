"""Which other effects could be mistaken for the ones found, on the recording at hand.

Two effects are confounded as far as the columns of one lie in the span of the other's, once both are whitened and
freed of what the base, the offsets and the other effects of the fit can absorb. The smallest principal angle between
the two spans (Bjoerck, Golub, "Numerical methods for computing angles between linear subspaces", Math. Comp. 27, 1973)
says how near their nearest members are; how much of the found effect's own contribution the other could imitate says
what that means for this drive, and what is left of it over the noise says whether this recording still tells the two
apart. All follow from the recording: two speeds part what one speed leaves alike.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.inference.base_excitation import is_driven
from hdopt.diagnosis.inference.catalogue import properties_of
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.numerical import SPAN_RANK
from hdopt.diagnosis.search.candidates import search_terms
from hdopt.diagnosis.settings import DEFAULT
from hdopt.effects import EFFECTS
from hdopt.effects.estimate import FitEstimate
from hdopt.effects.term import Term

RIGHT_ANGLE_DEG = 90.0


@dataclass(frozen=True)
class Confounding:
    """How far the effect `other` could pass for the `effect` found.

    `angle_deg` is the smallest principal angle between their columns; `imitates` the share, 0 to 1, of the power of the
    effect's contribution that the other could take over; `evidence_apart` the log evidence that the rest of it holds
    against the other, and that it pays for bending; `separating` the measurement that would part them; `odds` the log
    prior odds, at most 0, of the other with the numbers by which it imitates over the effect.
    """

    effect: str
    other: str
    angle_deg: float
    imitates: float
    evidence_apart: float
    separating: str
    odds: float = 0.0

    def to_dict(self) -> dict[str, object]:
        """As in the JSON."""
        return {
            "pair": [self.effect, self.other],
            "angle_deg": self.angle_deg,
            "imitates": self.imitates,
            "evidence_apart": self.evidence_apart,
            "separating": self.separating,
        }


def remaining_span(white: Array, projected: Array, absorbed: float = DEFAULT.verdict.absorbed) -> Array:
    """Orthonormal basis (n, r) of what a projection left of the columns `white` (n, p): of `projected` (n, p). Of a
    column shorter than `absorbed` of its length before, nothing is left but rounding.
    """
    before, after = np.linalg.norm(white, axis=0), np.linalg.norm(projected, axis=0)
    kept = after > absorbed * before
    if not kept.any():
        return np.empty((len(white), 0))
    basis, size, _ = np.linalg.svd(projected[:, kept] / after[kept], full_matrices=False)
    return basis[:, size > SPAN_RANK * size[0]]


def smallest_angle_deg(one: Array, other: Array) -> float:
    """Smallest principal angle between the spans of two orthonormal bases, (n, p) and (n, q), deg; 90 for an empty
    one. `one` and `other` hold them as columns.
    """
    if one.shape[1] == 0 or other.shape[1] == 0:
        return RIGHT_ANGLE_DEG
    return float(np.degrees(np.arccos(np.clip(np.linalg.norm(one.T @ other, 2), 0.0, 1.0))))


def share_in_span(contribution: Array, basis: Array) -> float:
    """Share of the power of `contribution` (n,) that lies in the span of an orthonormal `basis` (n, q)."""
    power = float(contribution @ contribution)
    return min(float(np.sum((basis.T @ contribution) ** 2)) / power, 1.0) if power > 0 else 0.0


def confounded_with(
    fit: Fit,
    index: int,
    inflation: float = 1.0,
    others: Sequence[str] | None = None,
    order_range: tuple[float, float] | None = None,
) -> list[Confounding]:
    """Every other effect against term `index` of `fit`, the one that could imitate most of it first.

    The term stands at its fitted shape. An effect of `others` (ids; None for the whole catalogue) that is in the
    fit too stands at its own; any other at the shape that comes closest to the term's contribution. An effect
    that the recording cannot show is left out: `Effect.lacks` says so elsewhere. `inflation` is how much rougher
    the noise is, turn by turn, than the fit's noise model has it. Orders in `order_range` are searched (None:
    all).
    """
    term = fit.terms[index]
    fitted = {t.effect: i for i, t in enumerate(fit.terms)}
    names = [name for name in (EFFECTS if others is None else others) if name != term.effect]
    found = []
    probe = FitProbe(_only_contribution(fit, index, ()), order_range=order_range)
    for name in names:
        if name in fitted:
            seen = FitProbe(_only_contribution(fit, index, [fitted[name]]), order_range=order_range)
            candidates = [fit.terms[fitted[name]]]
        else:
            seen = probe
            searched = search_terms(probe, only=[name])
            further = EFFECTS[name].beyond_search(probe) if searched else ()
            candidates = [term for term in (*searched, *further) if _may_be_itself(probe, term)]
        own = _basis(seen, term)
        contribution = seen.white_residual
        power = float(contribution @ contribution) / fit.problem.noise.sigma**2
        compared = []
        for candidate in candidates:
            basis = _basis(seen, candidate)
            imitates = share_in_span(contribution, basis)
            apart = (1 - imitates) * power / 2 / inflation + _paid_for_bending(candidate, fit)
            compared.append((apart, imitates, smallest_angle_deg(own, basis), candidate))
        if compared:
            # Of variants that imitate all of it rounding would choose: the likeliest to begin with is asked.
            least = min(one[0] for one in compared) + fit.problem.settings.verdict.imitators_alike
            equal = [one for one in compared if one[0] <= least]
            weighed = [(min(_odds_of(one[-1], seen) - term.odds, 0.0), *one[:-1]) for one in equal]
            odds, apart, imitates, angle = max(weighed, key=lambda one: (one[0], one[2]))
            separating = EFFECTS[term.effect].separating
            found.append(Confounding(term.effect, name, angle, imitates, apart, separating, odds))
    return sorted(found, key=lambda pair: -pair.imitates)


def _only_contribution(fit: Fit, index: int, without: Sequence[int]) -> Fit:
    """`fit` freed of term `index` (and those `without`), on data that are that term's contribution and nothing else."""
    kept = [i for i in range(len(fit.terms)) if i != index and i not in without]
    return replace(
        fit,
        terms=tuple(fit.terms[i] for i in kept),
        coefficients=tuple(fit.coefficients[i] for i in kept),
        prediction=fit.problem.rows.error - fit.contribution(index),
    )


def _paid_for_bending(imitator: Term, fit: Fit) -> float:
    """What `imitator` pays, by Schwarz's criterion on the rows of `fit`, for coefficients above those of a stiff term:
    many waves imitate a pulse, but few of the ways in which they may stand make one.
    """
    beyond = max(imitator.width - fit.problem.settings.penalty.few_coefficients, 0)
    return beyond * math.log(fit.problem.weighed_rows) / 2


def _odds_of(imitator: Term, probe: FitProbe) -> float:
    """Log prior odds of the variant of `imitator`, less where what it imitates in `probe` would leave it without one of
    its parts: it may be so, but that is not how it is known.
    """
    known = _shows_all(probe, imitator)
    return imitator.odds - (0.0 if known else probe.fit.problem.settings.verdict.odds_of_a_part)


def _shows_all(probe: FitProbe, term: Term) -> bool:
    """Whether every part of `term` shows in what it imitates in `probe`."""
    effect = properties_of(term.effect)
    return not effect.has_parts or effect.every_part_shows(term, _numbers(probe, term))


def _may_be_itself(probe: FitProbe, term: Term) -> bool:
    """Whether `term`, one that follows the drive's motion, imitates what `probe` sees with numbers that it may have: an
    inertia of no gain that only drags is another's name for a delay.
    """
    return not is_driven(term) or properties_of(term.effect).may_imitate(term, _numbers(probe, term))


def _numbers(probe: FitProbe, term: Term) -> FitEstimate:
    """The coefficients of `term` where it imitates what `probe` sees, and its free shape parameters."""
    numbers = [float(term.shape[name]) for name in term.steps]
    covariance = np.zeros((term.freedom, term.freedom))
    covariance[: term.width, : term.width] = probe.noise.sigma**2 * np.linalg.pinv(probe.table(term)[0])
    return FitEstimate(np.r_[probe.solve(term)[1], numbers], covariance)


def _basis(probe: FitProbe, term: Term) -> Array:
    white = probe.white_columns(term)
    return remaining_span(white, probe.project(white), probe.fit.problem.settings.verdict.absorbed)
