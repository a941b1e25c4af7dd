"""The noise of single samples, as neighbours show it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hdopt.diagnosis.numerical import MAD_TO_SIGMA
from hdopt.recordings.recording import Recording

SECOND_DIFFERENCE = 6
"""Variance of a second difference of white noise over the noise's own: 1 + 4 + 1."""


def noise_between_neighbours(recordings: Sequence[Recording]) -> float:
    """Standard deviation (arcmin) of the noise of one sample of the `recordings` as recorded, from second differences
    of neighbours, in which whatever is smooth over three samples vanishes: the median over the recordings.
    """
    sizes = [np.median(np.abs(np.diff(one.error_arcmin, 2))) for one in recordings]
    return float(np.median(sizes)) * MAD_TO_SIGMA / math.sqrt(SECOND_DIFFERENCE)
