"""How far an allocated tolerance may go, and what is said of one that stands at a bound which is assumed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from hdopt.study.cost_bounds import assumed_keys, costs_and_reach

if TYPE_CHECKING:
    from hdopt.allocation.convex import Item
    from hdopt.study import Study
    from hdopt.study.costs import Cost

AT_BOUND = 1e-3
"""How near to a bound, relative to it, a tolerance stands at it."""


def assumed_bounds(row: Cost, present: float, reach: tuple[float, float]) -> tuple[float, float]:
    """Least and most that a tolerance may be by the cost `row`, in its unit, where `present` is its present size and
    `reach` holds, as multiples of it, what the row leaves out; of the bound that is given where that is beyond."""
    given_low, given_high = row.tightest, row.widest
    low, high = (factor * present for factor in reach)
    if given_high is not None and given_high <= low:
        low = reach[0] * given_high
    if given_low is not None and given_low >= high:
        high = reach[1] * given_low
    return low if given_low is None else given_low, high if given_high is None else given_high


def at_assumed_bounds(study: Study, items: Sequence[Item], tolerances: Mapping[str, float]) -> dict[str, str]:
    """`cost.tightest` or `cost.widest` by the name of each of `items` whose tolerance, of `tolerances`, stands at a
    bound that the `study` does not give."""
    rows, reach = costs_and_reach(study.sections)
    found = {}
    for item in items:
        tolerance, assumed = tolerances[item.name], assumed_keys(rows[item.name])
        low, high = item.bounds
        if "tightest" in assumed and reach[0] and tolerance <= low * (1 + AT_BOUND):
            found[item.name] = "cost.tightest"
        elif "widest" in assumed and tolerance >= high * (1 - AT_BOUND):
            found[item.name] = "cost.widest"
    return found


def bound_notes(at: Mapping[str, str], items: Sequence[Item]) -> Iterator[str]:
    """Which of the `items` stand at an assumed bound, as `at_assumed_bounds` found them, and which key moves it."""
    bounds = {item.name: item.bounds for item in items}
    for index, key in enumerate(("cost.tightest", "cost.widest")):
        names = [f"{name} ({bounds[name][index]:g})" for name, which in at.items() if which == key]
        if names:
            stand = "stands" if len(names) == 1 else "stand"
            yield f"{', '.join(names)} {stand} at a bound that is assumed; {key} moves it"
