"""Places that wait to be looked at: listed as they are found, and looked at in dense lists once there are many.

So a look stands at one place of a kernel. It is put there as a whole: at every further place the kernel would take
seconds more to compile. Where looks are most of the work, lists of a known length are worth that (`lows`, `tops`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hdopt.arrays import Index, Singles
from hdopt.kinematics.compiled_closed_form import compiled
from hdopt.kinematics.lanes.motion import LANES
from hdopt.simulation.turn.rows import ANGLE, LEAST_AT, LIST, RIM, ZONE


class Waiting(NamedTuple):
    """Room for places, (n,): at which `turns` of the input, whose they are (`lanes`), and of crests zone and rim by
    their signs; whose those `at_hand` are (LANES,), and which drives are `near` (LANES,): in the cell in hand."""

    turns: Singles
    lanes: Index
    zones: Singles
    rims: Singles
    at_hand: Index
    near: Index


def room_to_wait(places: int) -> Waiting:
    """Room for so many `places`."""
    turns, zones, rims = (np.zeros(places, np.float32) for _ in range(3))
    lanes, at_hand, near = (np.zeros(n, np.int64) for n in (places, LANES, LANES))
    return Waiting(turns, lanes, zones, rims, at_hand, near)


@compiled
def has_room(waiting: Waiting, count: int, more: int) -> bool:
    """Whether there is room for so many `more` places in `waiting` after the first `count`."""
    return count + more <= len(waiting.turns)


@compiled
def put(waiting: Waiting, at: int, turns: float, lane: int) -> None:
    """Put a place at so many `turns` of a `lane` into `waiting`, as the one numbered `at`."""
    waiting.turns[at], waiting.lanes[at] = turns, lane


@compiled
def put_crest(waiting: Waiting, at: int, turns: float, lane: int, zone: float, rim: float) -> None:
    """Put a crest at so many `turns` of a `lane` into `waiting`, as the one numbered `at`, with its `zone` and `rim` by
    their signs."""
    put(waiting, at, turns, lane)
    waiting.zones[at], waiting.rims[at] = zone, rim


@compiled
def put_lowest(work: Singles, waiting: Waiting) -> int:
    """Put where the least of each lane of `work` was found into `waiting`; how many these are."""
    for i in range(LANES):
        put(waiting, i, work[LEAST_AT + i], i)
    return LANES


@compiled
def take(work: Singles, waiting: Waiting, start: int, count: int) -> None:
    """Take the places of `waiting`, `count` of them from `start` on, no more than LANES, into the list of `work`."""
    for j in range(count):
        waiting.at_hand[j], work[LIST + ANGLE + j] = waiting.lanes[start + j], waiting.turns[start + j]
        work[LIST + ZONE + j], work[LIST + RIM + j] = waiting.zones[start + j], waiting.rims[start + j]
