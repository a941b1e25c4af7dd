"""The response as a straight line about a stated operating point, for root-sum-square stacks and contributions.

The kinematic error has a kink where an error is zero, so slopes taken there mean nothing: they would call the wave
generator's own errors free. The line is therefore drawn where drives are: every magnitude, and every tilt's absolute
value, at its mean; directions, phases and the tilts' signs are not linearised at all but averaged over their own
distribution, and their spread enters as it is. What the line is worth is measured, not assumed: see `Linearisation`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hdopt.arrays import Array
from hdopt.tolerance.response import Response, evaluate
from hdopt.tolerance.sampling import ScrambledSobol
from hdopt.tolerance.space import InputSpace

DIRECTIONS = 2**12
"""Sobol' points over which directions, phases and signs are averaged."""
PHASE_BINS = 32
JOINTLY = "directions_jointly"
"""What several directions and phases do together and none of them alone."""


@dataclass(frozen=True)
class Linearisation:
    """y ~ value + sum of slope_i (m_i - point_i) + a part of spread `turning_std` from directions and phases.

    `point`, `slopes` and `spreads` (standard deviations) by input, for magnitudes m_i; `shares` of the line's variance
    by input, summing to 1; a direction's share is what it does alone, the rest is `directions_jointly`.
    """

    point: dict[str, float]
    value: float
    slopes: dict[str, float]
    spreads: dict[str, float]
    turning_std: float
    linear_std: float
    shares: dict[str, float] = field(repr=False)

    @property
    def std(self) -> float:
        """Root sum square of all parts."""
        return float(np.hypot(self.linear_std, self.turning_std))

    def rss(self, z: float) -> float:
        """The line's value `z` standard deviations out."""
        return self.value + z * self.std


def linearise(response: Response, space: InputSpace, seed: int, directions: int = DIRECTIONS) -> Linearisation:
    """The straight line of `response` over `space` about the mean magnitudes, averaged over so many `directions` that
    `seed` draws; costs (2 k + 1) times as many responses for k magnitudes.

    Slopes are central differences over half a standard deviation to either side: small against the response's
    curvature, large against its kinks, which the average over directions has already smoothed.
    """
    u = next(ScrambledSobol(1).blocks(seed, 0, directions, space.dimension))
    inputs = space.sample(u)
    straight = [name for name in space.names if name not in space.turning and not _is_fixed(space, name)]
    columns = [space.index(name) for name in straight]
    magnitudes = inputs[:, columns].copy()
    signs = np.ones_like(magnitudes)
    for position, name in enumerate(straight):
        if name in space.folded:
            signs[:, position] = np.where(magnitudes[:, position] < 0, -1.0, 1.0)
            magnitudes[:, position] = np.abs(magnitudes[:, position])
    point, spreads = magnitudes.mean(axis=0), magnitudes.std(axis=0)

    def averaged(at: Array) -> Array:
        moved = inputs.copy(order="F")
        moved[:, columns] = signs * at
        return evaluate(response, moved, space.names, "the linearisation")

    centre = averaged(point)
    slopes = np.zeros(len(straight))
    for position, spread in enumerate(spreads):
        step = np.zeros(len(straight))
        step[position] = spread / 2
        slopes[position] = np.mean(averaged(point + step) - averaged(point - step)) / spread
    covariance = np.atleast_2d(np.cov(magnitudes.T, ddof=0)) if straight else np.zeros((0, 0))
    if space.copula.is_independent:
        covariance = np.diag(np.diag(covariance))  # what is left beside it is sampling noise
    parts = slopes * (covariance @ slopes)
    alone = {
        name: _variance_alone(centre, u[:, space.index(name)])
        for name in space.names
        if name in space.turning - space.fields
    }
    for name in space.fields:
        # A field's number has no neighbours: what it does alone is what two drives with the same field share.
        others, kept = np.roll(inputs, 1, axis=0), space.index(name)
        others[:, kept], others[:, columns] = inputs[:, kept], np.roll(signs, 1, axis=0) * point
        shared = evaluate(response, np.asfortranarray(others), space.names, "the linearisation")
        alone[name] = max(float(np.cov(centre, shared)[0, 1]), 0.0)
    turning = float(np.var(centre))
    total = float(parts.sum()) + turning
    shares = dict(zip(straight, (parts / total).tolist(), strict=True)) if total > 0 else dict.fromkeys(straight, 0.0)
    if turning > 0 and total > 0 and (alone or space.folded):
        shares |= {name: part / total for name, part in alone.items()}
        shares[JOINTLY] = (turning - sum(alone.values())) / total
    return Linearisation(
        point=dict(zip(straight, point.tolist(), strict=True)),
        value=float(np.mean(centre)),
        slopes=dict(zip(straight, slopes.tolist(), strict=True)),
        spreads=dict(zip(straight, spreads.tolist(), strict=True)),
        turning_std=float(np.sqrt(turning)),
        linear_std=float(np.sqrt(max(parts.sum(), 0.0))),
        shares={name: shares[name] for name in (*space.names, JOINTLY) if name in shares},
    )


def _is_fixed(space: InputSpace, name: str) -> bool:
    lower, upper = space.tolerances[name].distribution.support
    return lower == upper


def _variance_alone(values: Array, u: Array) -> float:
    """Variance of the mean of `values` given `u`, by bins of `u`; the bins' own noise is taken off."""
    bins = np.minimum((u * PHASE_BINS).astype(int), PHASE_BINS - 1)
    counts = np.bincount(bins, minlength=PHASE_BINS)
    means = np.bincount(bins, values, PHASE_BINS) / counts
    between = float(np.average((means - values.mean()) ** 2, weights=counts))
    within = float(np.var(values)) - between
    return max(between - within * (PHASE_BINS - 1) / (len(values) - PHASE_BINS), 0.0)
