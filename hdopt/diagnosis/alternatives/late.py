"""What follows something else with a lag, as creep follows a load and warmth a speed."""

from __future__ import annotations

import numpy as np

from hdopt.arrays import Array
from hdopt.diagnosis.settings import AlternativeSettings
from hdopt.effects.conditions import Conditions


def lags(samples: Conditions, settings: AlternativeSettings) -> list[float]:
    """The lags (s) that `settings` try on the time of `samples`."""
    longest = longest_recording(samples)
    return [lag * longest for lag in settings.lags]


def within_reach(samples: Conditions, lag: float, settings: AlternativeSettings) -> float:
    """The `lag` (s), or the nearest to it that a fit may move to by `settings` on the time of `samples`."""
    longest = longest_recording(samples)
    return float(np.clip(lag, settings.shortest_lag * longest, longest))


def longest_recording(samples: Conditions) -> float:
    """Time (s) that the longest recording of `samples` lasts."""
    return max(float(np.ptp(samples.known_time[samples.record == record])) for record in range(samples.records))


def lagging(samples: Conditions, target: Array, lag: float) -> Array:
    """What follows a `target` (n,) with a `lag` (s) over the time of `samples`, from zero at the start of each
    recording, (n,): y' = (target - y)/lag, the target held over each step.
    """
    found = np.empty(len(target))
    for record in range(samples.records):
        own = samples.record == record
        time = samples.known_time[own]
        growth = np.exp((time - time[0]) / lag)
        found[own] = np.cumsum(target[own] * np.diff(growth, prepend=growth[0])) / growth
    return found
