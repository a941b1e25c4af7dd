"""Whether one table is enough for recordings at several speeds: what a table for each speed would take besides."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hdopt.arrays import Array
from hdopt.compensation.pursuit import dictionary, pursue
from hdopt.recordings.recording import TURN
from hdopt.recordings.rows import Rows

APART = 0.1
"""Share by which speeds differ that are two."""
TERMS = 16
WORTH = 0.15
"""Share of the rms that harmonics of one speed alone must take before they are worth a table of their own."""


def speeds_rpm(rows: Rows) -> list[float | None]:
    """The usual input speed of each of the records in `rows`, r/min; None without a clock."""
    records = range(int(rows.record.max()) + 1)
    if rows.speed is None:
        return [None for _ in records]
    size = np.abs(rows.speed) * 60 / TURN
    return [float(np.median(size[rows.record == n])) for n in records]


def of_each_speed(speeds: Sequence[float | None]) -> list[list[int]]:
    """The numbers of the records at each of the `speeds` (r/min) that differ by more than `APART`, slowest first; []
    where a record has no clock or stands."""
    groups: list[list[int]] = []
    for number in sorted(range(len(speeds)), key=lambda n: speeds[n] or 0.0):
        speed, first = speeds[number], speeds[groups[-1][0]] if groups else None
        if not speed:
            return []
        if first and speed < (1 + APART) * first:
            groups[-1].append(number)
        else:
            groups.append([number])
    return groups


def of_one_speed(rows: Rows, left: Array) -> tuple[str, ...]:
    """A sentence on each speed of the recordings in `rows` at which what the table has `left` (n,) arcmin holds
    harmonics that a table for this speed alone would take. () where all turn at one speed."""
    speeds, groups = speeds_rpm(rows), of_each_speed(speeds_rpm(rows))
    return tuple(
        said for group in groups if len(groups) > 1 and (said := _of_group(rows, left, group, speeds[group[0]]))
    )


def _of_group(rows: Rows, left: Array, group: list[int], speed: float | None) -> str:
    """The sentence on the records of a `group` at one `speed`, r/min; "" where the table is as good for it as any."""
    mine = np.isin(rows.record, group)
    theta, record = rows.theta[mine], rows.record[mine]
    zeros = (record[:, None] == np.array(group)).astype(float)
    rest = left[mine] - zeros @ np.linalg.lstsq(zeros, left[mine], rcond=None)[0]
    angles = theta, theta / rows.ratio
    own = pursue(angles, rest, zeros, None, dictionary(float(np.ptp(theta)) / TURN / rows.ratio), TERMS)
    before, after = float(np.std(rest)), float(np.std(rest - own.at(*angles)))
    if after > (1 - WORTH) * before:
        return ""
    return (
        f"at {speed:.3g} r/min this table leaves {before:.2g} arcmin rms, one for this speed alone about {after:.2g}; "
        "compensate the recordings of each speed by themselves"
    )
