"""Shared by the effects that act inside the meshing zones: harmonics of a deviation round one of the splines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hdopt.diagnosis.effect import sine_columns

Array = NDArray[np.float64]


def zone_harmonics(phase: Array, harmonics: Sequence[int]) -> Array:
    """sin and cos of each harmonic as met in zone 1 (`phase`) and in zone 2, half a turn on: shape (2, n, 2 k).

    sin(h (x + pi)) = (-1)^h sin(h x): even harmonics are alike in both zones, odd ones opposite (Jia 2021,
    Eqs. (31a), (31b), carried to h > 1).
    """
    zone_1 = sine_columns(phase, harmonics)
    sign = np.repeat([(-1.0) ** h for h in harmonics], 2)
    return np.stack([zone_1, zone_1 * sign])
