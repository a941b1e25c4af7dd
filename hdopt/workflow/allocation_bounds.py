"""How far an allocated tolerance may go where a study does not say, and what is said of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hdopt.allocation.convex import Item
    from hdopt.study import Study
    from hdopt.study.costs import Cost

DEFAULT_REACH = (0.1, 3.0)
"""Least and most of a drive's tolerance as multiples of the present one: the closed form of the kinematic error is
checked up to three times the shipped tolerances."""
LINEAR_REACH = (0.0, 1e6)
"""The same of a linear stack's, which is exact for any tolerance: for the solver's sake only."""
AT_BOUND = 1e-3
"""How near to a bound, relative to it, a tolerance stands at it."""


def assumed_keys(row: Cost) -> tuple[str, ...]:
    """Of `tightest` and `widest` those that the cost `row` leaves to be assumed; data with ends of their own leave
    none."""
    if row.model in ("table", "piecewise"):
        return ()
    return tuple(key for key in ("tightest", "widest") if getattr(row, key) is None)


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


def default_lines(study: Study) -> tuple[str, ...]:
    """A line each for `cost.tightest` and `cost.widest`: of which costs of the `study` it is assumed, and what."""
    rows, reach = _rows(study)
    said = []
    for key, factor in zip(("tightest", "widest"), reach, strict=True):
        names = [name for name, row in rows.items() if factor and key in assumed_keys(row)]
        if names:
            said.append(f"cost.{key} is not given for {', '.join(names)}: {factor:g} times the present tolerance")
    return tuple(said)


def _rows(study: Study) -> tuple[dict[str, Cost], tuple[float, float]]:
    """The costs of the `study` by the name of their tolerance, and how far these may go."""
    from hdopt.study.tolerances import ContributorsSection, LinearStackSection, TolerancesBase

    stack = study.find("linear_stack", LinearStackSection)
    if stack is not None:
        return {name: d.cost for name, d in stack.dimensions.items() if d.cost is not None}, LINEAR_REACH
    sections = study.find("tolerances", TolerancesBase), study.find("contributors", ContributorsSection)
    return {name: row for one in sections if one is not None for name, row in one.costs().items()}, DEFAULT_REACH


def at_assumed_bounds(study: Study, items: Sequence[Item], tolerances: Mapping[str, float]) -> dict[str, str]:
    """`cost.tightest` or `cost.widest` by the name of each of `items` whose tolerance, of `tolerances`, stands at a
    bound that the `study` does not give."""
    rows, reach = _rows(study)
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
