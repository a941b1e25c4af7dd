"""Process performance of a one-sided, skewed response by the percentile method (ISO 22514-2).

There are no subgroups, so there is no Cpk; there is no lower limit, so there is no Cp or Pp.
"""

from __future__ import annotations

import math

from hdopt.errors import HdoptError

MEDIAN = 0.5
UPPER_PERCENTILE = 0.99865
"""The upper reference limit X99.865: what 3 sigma of a normal distribution leave above."""


def ppk(limit: float, median: float, upper_reference: float) -> float:
    """(U - X50)/(X99.865 - X50) for an upper limit U (ISO 22514-2); infinite where nothing varies and U is kept.

    `limit` is U, `median` X50 and `upper_reference` X99.865, the percentiles of one sample; all in one unit. Raises
    `HdoptError` where the percentiles are in the wrong order.
    """
    if upper_reference < median:
        raise HdoptError(f"X99.865 is {upper_reference:g}, below the median {median:g}; give percentiles of one sample")
    if upper_reference == median:
        return math.inf if limit >= median else -math.inf
    return (limit - median) / (upper_reference - median)
