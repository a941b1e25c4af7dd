"""Other laws than that of an offset which parts the directions and is else alike, as of play and friction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hdopt.arrays import Array
from hdopt.effects._direction_laws import columns_by_direction
from hdopt.effects._speed_laws import columns_by_speed
from hdopt.effects._time_laws import columns_by_time
from hdopt.effects.conditions import Conditions
from hdopt.effects.term import Term


def laws_of_offset(conditions: Conditions, term: Term, motion: Array) -> Mapping[str, Sequence[Array]]:
    """Columns like those of `term`, an offset in `conditions` of n rows, by what they change with: the "speed", the
    "time", or the "direction" in which the drive's own error `motion` (n,), arcmin, is larger.
    """
    return {
        "speed": columns_by_speed(conditions, term),
        "time": columns_by_time(conditions, term),
        "direction": columns_by_direction(conditions, term, motion),
    }
