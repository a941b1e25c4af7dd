"""Messages of a bag as channels: every number in a message becomes a channel by its path, with the message's time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any  # Any: messages of any definition

import numpy as np

from hdopt.recordings.table import Channel, Table

MOST_ELEMENTS = 32
"""Elements of an array in a message that become channels of their own; longer ones are images and the like."""
NANOSECOND = 1e-9


class Collector:
    """Gathers numbers of messages by 'topic.field', elements of arrays as 'topic.field[0]' or 'topic.field[name]'."""

    def __init__(self) -> None:
        self._values: dict[str, list[float]] = {}
        self._times: dict[str, list[int]] = {}

    def add(self, topic: str, time_ns: int, message: Any) -> None:
        """All numbers of one message; `message` is an object with fields, a mapping, or a number."""
        for path, value in _numbers(message, topic):
            self._values.setdefault(path, []).append(value)
            self._times.setdefault(path, []).append(time_ns)

    def table(self) -> Table:
        """All channels, on the clock of the earliest message of all."""
        if not self._times:
            return Table({})
        first = min(times[0] for times in self._times.values())
        channels = {
            path: Channel(
                np.array(values), "", np.asarray((np.array(self._times[path], np.int64) - first) * NANOSECOND, float)
            )
            for path, values in self._values.items()
        }
        return Table(channels, ("times are those of the messages' stamps where they have one, else of their logging",))


def stamp_ns(message: Any) -> int | None:
    """The time in the header of a ROS message, ns; None where it has no header or the stamp is zero."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    if stamp is None:
        return None
    seconds, rest = getattr(stamp, "sec", 0), getattr(stamp, "nanosec", 0)
    return int(seconds) * 10**9 + int(rest) or None


def _numbers(value: Any, path: str) -> Iterator[tuple[str, float]]:
    if isinstance(value, bool | int | float | np.number):
        yield path, float(value)
    elif isinstance(value, Mapping):
        for key, item in value.items():
            yield from _numbers(item, f"{path}.{key}")
    elif isinstance(value, list | tuple | np.ndarray):
        if len(value) <= MOST_ELEMENTS:
            for place, item in enumerate(value):
                yield from _numbers(item, f"{path}[{place}]")
    elif hasattr(value, "__dataclass_fields__"):
        names = getattr(value, "name", None)
        for field in value.__dataclass_fields__:
            if field.startswith("__") or field == "header":
                continue
            item = getattr(value, field)
            arrays = isinstance(names, list) and field != "name" and isinstance(item, list | np.ndarray)
            if arrays and isinstance(names, list) and len(item) == len(names):
                for name, element in zip(names, item, strict=True):
                    yield from _numbers(element, f"{path}.{field}[{name}]")
            else:
                yield from _numbers(item, f"{path}.{field}")
