"""National Instruments TDMS files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hdopt.recordings.table import Channel, Table


def read(path: Path, wanted: Sequence[str] | None) -> Table:
    """Channels by 'group/channel' (by the channel's name alone where only one group has it).

    A channel's unit is its property `unit_string`; its clock is the waveform's start and increment where it has them.

    `path` of the file; `wanted` names the columns that will be used, None for all.
    """
    from nptdms import TdmsFile

    found: dict[str, Channel] = {}
    with TdmsFile.open(path) as file:
        channels = [channel for group in file.groups() for channel in group.channels()]
        names = [channel.name for channel in channels]
        starts = [c.properties["wf_start_time"] for c in channels if "wf_start_time" in c.properties]
        first = min(starts) if starts else None
        for channel in channels:
            key = channel.name if names.count(channel.name) == 1 else f"{channel.group_name}/{channel.name}"
            path_name = f"{channel.group_name}/{channel.name}"
            if wanted and not {key, path_name} & set(wanted):
                continue
            values = np.asarray(channel[:])
            clock = None
            step = channel.properties.get("wf_increment")
            if step:
                start = channel.properties.get("wf_start_time")
                late = float((start - first) / np.timedelta64(1, "ns")) * 1e-9 if start is not None else 0.0
                clock = late + float(channel.properties.get("wf_start_offset", 0.0)) + step * np.arange(len(values))
            use = path_name if wanted and path_name in wanted else key
            found[use] = Channel(values, str(channel.properties.get("unit_string", "")), clock)
    return Table(found)
