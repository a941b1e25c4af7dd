"""Zeros of the recordings' angles, which mean nothing, taken out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hdopt.arrays import Mask
from hdopt.diagnosis.settings import NuisanceSettings
from hdopt.recordings.recording import Recording


def freed_of_zeros(
    recordings: Sequence[Recording], settings: NuisanceSettings, hidden: Sequence[Mask] | None = None
) -> tuple[Recording, ...]:
    """`recordings` with their errors about the median of the first, and with outputs that are counted from one place.

    Zeros of thousands of arcmin go, so that the numbers keep their digits. Where medians lie farther apart than
    physics does, by the `settings`, an output was counted from zero again: its disc still stands where it stood, and
    what hangs on it is met at the angle from the first recording's zero, which the input tells. Samples that are
    `hidden` (of each recording (n,)) are not asked.
    """
    hidden = [np.zeros(len(one), bool) for one in recordings] if hidden is None else hidden
    medians = [float(np.median(one.error_arcmin[~mask])) for one, mask in zip(recordings, hidden, strict=True)]
    counted_anew = max(medians) - min(medians) >= settings.shared_zero_arcmin
    return tuple(
        replace(
            one,
            error_arcmin=one.error_arcmin - medians[0],
            output_zero_arcmin=median - medians[0] if counted_anew else 0.0,
        )
        for one, median in zip(recordings, medians, strict=True)
    )
