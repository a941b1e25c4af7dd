"""What every explanation without physics has in common."""

from __future__ import annotations

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.numerical import TINY
from hdopt.diagnosis.settings import DEFAULT, AlternativeSettings
from hdopt.effects.base import Explanation


class Alternative(Explanation):
    """A description without physics, searched as its `settings` say."""

    def __init__(self, settings: AlternativeSettings = DEFAULT.alternatives):
        self.settings = settings


def of_largest(values: Array | None, n: int) -> Array:
    """The `values` (n,) over the largest of them; zeros where there are none."""
    if values is None:
        return np.zeros(n)
    return values / max(float(np.max(np.abs(values))), TINY)
