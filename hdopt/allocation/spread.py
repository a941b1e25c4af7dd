"""How much of a dimension's tolerance the root-sum-square rule counts, for the yield that a linear stack is to reach.

Dimensions are normal with so many standard deviations within their tolerances, and truncated there. A sum of them is
more peaked than one of whole normal distributions (Birnbaum, Ann. Math. Stat. 19, 1948), so whole ones lie on the safe
side.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import special

from hdopt.allocation.rules import DESIGN_POINTS
from hdopt.arrays import Array

CLASSICAL = 0.9973
"""The share within three standard deviations of a normal distribution, 0.99730020, as it is written."""


def two_sided_quantile(share: float) -> float:
    """Standard deviations to either side of a normal distribution's mean within which `share` (0 to 1) lies; 3 for
    0.9973."""
    return 3.0 if share == CLASSICAL else float(special.ndtri((1 + share) / 2))


def truncated_std(sigmas: Array) -> Array:
    """Standard deviations of standard normal distributions truncated `sigmas` (k,) to either side of the mean."""
    density = np.exp(-np.square(sigmas) / 2) / math.sqrt(2 * math.pi)
    kept: Array = np.asarray(special.erf(sigmas / math.sqrt(2)))
    return np.sqrt(np.maximum(1 - 2 * sigmas * density / kept, 0.0))


def spread_factors(sigmas: Array, required_yield: float) -> Array:
    """Factors of the tolerances (k,) whose root sum square is the deviation that `required_yield` (0 to 1) of
    assemblies keep, where `sigmas` (k,) standard deviations of each dimension lie within its tolerance.

    They are z/sigmas with the quantile z of the yield: 1 for three standard deviations and 0.9973, the classical rule.
    Truncation within three standard deviations lets a verification confirm such a yield. Truncation further out takes
    little off: there the spread left counts with the quantile of a yield that is higher by three standard deviations of
    a share of 2^20 samples, where that is more.
    """
    z = two_sided_quantile(required_yield)
    sampling = 3 * math.sqrt(required_yield * (1 - required_yield) / DESIGN_POINTS)
    confirmed = two_sided_quantile(required_yield + min(sampling, (1 - required_yield) / 2))
    return np.where(sigmas > 3, np.maximum(z, confirmed * truncated_std(sigmas)), z) / sigmas
