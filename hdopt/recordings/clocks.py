"""Times of any kind as seconds, and channels of different clocks on one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any  # Any: times as numbers, text or dates

import numpy as np
from numpy.typing import NDArray

from hdopt.arrays import Array
from hdopt.errors import HdoptError
from hdopt.recordings.table import Channel

GAP_STEPS = 4.0
"""A source that pauses for more than so many of its usual steps is not interpolated across the pause."""
DAY_S = 86_400.0


def seconds_of(values: NDArray[Any], name: str) -> tuple[Array, str] | None:
    """Dates and times of day as seconds from the first (n,), NaT as NaN, and how they were read; None for numbers.

    Takes datetimes and durations of any resolution and zone, and text: ISO 8601, day.month.year with a time, and times
    of day (which may pass midnight). Raises `HdoptError` where text is none of these.

    `values` (n,) as the file holds them; `name` of the channel, for messages.
    """
    import pandas as pd

    if values.dtype.kind in "fiub":
        return None
    series = pd.Series(values)
    if isinstance(series.dtype, pd.DatetimeTZDtype) or series.dtype.kind == "M":
        return _from_first(series), f"the {name}'s dates are read as dates, in seconds from the first"
    if series.dtype.kind == "m":
        return np.asarray(series.dt.total_seconds(), float), f"the {name}'s durations are read as durations"
    if isinstance(series.dropna().iloc[0] if series.notna().any() else None, pd.Timestamp):
        return _from_first(pd.to_datetime(series, utc=True)), f"the {name}'s dates are read as dates"
    text = series.astype(str).str.strip().str.replace(",", ".", regex=False)
    return _text_seconds(text, name)


def _text_seconds(text: Any, name: str) -> tuple[Array, str]:
    import pandas as pd

    iso = pd.to_datetime(text, format="ISO8601", utc=True, errors="coerce")
    if iso.notna().mean() > 0.5:
        return _from_first(iso), f"the {name} is read as ISO 8601, in seconds from the first"
    for form in ("%d.%m.%Y %H:%M:%S.%f", "%d.%m.%Y %H:%M:%S"):
        german = pd.to_datetime(text, format=form, utc=True, errors="coerce")
        if german.notna().mean() > 0.5:
            return _from_first(german), f"the {name} is read as day.month.year, in seconds from the first"
    day = pd.to_timedelta(text, errors="coerce")
    if day.notna().mean() > 0.5:
        seconds = np.asarray(day.dt.total_seconds(), float)
        midnights = np.r_[0, np.cumsum(np.diff(np.nan_to_num(seconds)) < -0.5 * DAY_S)]
        return seconds + midnights * DAY_S, f"the {name} is read as the time of day, in seconds"
    raise HdoptError(
        f"the {name} holds {str(text.iloc[0])[:40]!r}, which is no number and no time; write ISO 8601 "
        "(2026-11-22T10:00:00.125) or seconds"
    )


def _from_first(dates: Any) -> Array:
    """Seconds since the first valid date, exact to the resolution of the dates."""
    first = dates.dropna().iloc[0]
    seconds: Array = (dates - first).dt.total_seconds().to_numpy(float)
    return seconds


def on_one_clock(channels: Mapping[str, Channel], values: Mapping[str, Array]) -> tuple[dict[str, Array], list[str]]:
    """Channels brought onto one clock, with sentences on how.

    `channels` and `values` by role ("input", "output", ...); `values` in base units. Where all have one length and one
    clock nothing changes. Else the clock is that of the slower of the two angles, so that no angle is invented between
    its samples; all others are interpolated linearly onto it within their common time. Adds "time" from that clock
    where there is none. Raises `HdoptError` where lengths differ and a channel has no clock, or no time is common.
    """
    clocks = {role: channel.time_s for role, channel in channels.items()}
    lengths = {role: len(v) for role, v in values.items()}
    own = [role for role in values if clocks.get(role) is not None]
    if not own and len(set(lengths.values())) <= 1:
        return dict(values), []
    if len(own) < len(values):
        if len(set(lengths.values())) > 1:
            counts = ", ".join(f"{role} {n}" for role, n in lengths.items())
            raise HdoptError(f"the channels have different numbers of samples ({counts}) and not each its own clock")
        shared = next((clocks[role] for role in own), None)
        clocks = {role: clocks.get(role) if clocks.get(role) is not None else shared for role in values}
    times = {role: np.asarray(clock, float) for role, clock in clocks.items() if role in values and clock is not None}
    angles = [role for role in ("input", "output", "error") if role in times]
    master = max(angles, key=lambda role: _step(times[role]))
    if all(len(t) == len(times[master]) and np.allclose(t, times[master], atol=1e-9) for t in times.values()):
        same = dict(values)
        same.setdefault("time", times[master])
        return same, []
    return _interpolated(times, values, master)


def _interpolated(
    times: Mapping[str, Array], values: Mapping[str, Array], master: str
) -> tuple[dict[str, Array], list[str]]:
    grid = times[master]
    low, high = max(t[0] for t in times.values()), min(t[-1] for t in times.values())
    inside = (grid >= low) & (grid <= high)
    if inside.sum() < 2:
        raise HdoptError("the channels' clocks have no time in common; give channels that were recorded together")
    said: list[str] = []
    kept = inside.copy()
    found: dict[str, Array] = {}
    for role, time in times.items():
        if role == master:
            continue
        order = np.argsort(time, kind="stable")
        t, v = time[order], values[role][order]
        after = np.clip(np.searchsorted(t, grid), 1, len(t) - 1)
        kept &= ~(inside & (t[after] - t[after - 1] > GAP_STEPS * _step(t)))
        found[role] = np.interp(grid, t, v)
        said.append(f"{role} ({1 / _step(t):.4g} Hz{_bend(role, v)})")
    result = {role: v[kept] for role, v in found.items()} | {master: values[master][kept]}
    result.setdefault("time", grid[kept])
    return result, [
        f"{' and '.join(said)} interpolated linearly onto the clock of {master} ({1 / _step(grid):.4g} Hz); "
        f"{int(kept.sum())} of {len(grid)} samples lie in their common time"
    ]


def _bend(role: str, values: Array) -> str:
    """What a straight line between samples misses: an eighth of the second difference, its median."""
    if role not in ("input", "output") or len(values) < 5:
        return ""
    missed = float(np.nanmedian(np.abs(np.diff(values, 2)))) / 8
    return f", missing about {missed * 10800 / np.pi:.2g} arcmin at its shaft"


def _step(time: Array) -> float:
    steps = np.diff(time)
    steps = steps[steps > 0]
    return float(np.median(steps)) if len(steps) else 1.0
