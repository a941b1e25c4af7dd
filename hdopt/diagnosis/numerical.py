"""Guards against rounding and constants of statistics: they decide nothing, and none is a threshold."""

from __future__ import annotations

TINY = 1e-300
"""Keeps a division or a logarithm of zero finite."""
HALF = 0.5
"""Of the log likelihood: half a sum of squares in noise variances, half a coefficient times log(rows)."""
MAD_TO_SIGMA = 1.4826
"""Standard deviation of a Gaussian over its median absolute deviation."""
NORMAL_95 = 1.96
"""Half width of a 95 % interval in standard deviations."""
VARIANCE_OF_A_SQUARE = 2.0
"""Variance of the square of a standard normal number."""
RIDGE = 1e-6
"""Share of a unit column's power added to a Gram matrix: nearly parallel columns stay solvable to six digits."""
SMALL_RIDGE = 1e-8
"""The same where the columns are fewer and scaled alike."""
RANK = 1e-7
"""Singular values below this share of the largest are rounding."""
SPAN_RANK = 1e-6
"""The same for what a projection left."""
LEAST_SQUARES_RANK = 1e-8
"""The same in least squares of scaled columns."""
SMALLEST_POWER = 1e-12
"""Power below which a column or a parameter is taken as absent."""
RATIO_DIGITS = 1e-9
"""Ratios closer than this are the same number."""
