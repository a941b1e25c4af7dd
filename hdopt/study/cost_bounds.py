"""How far an allocated tolerance may go where the costs of a study do not say."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hdopt.study.base import Section
    from hdopt.study.costs import Cost

DEFAULT_REACH = (0.1, 3.0)
"""Least and most of a drive's tolerance as multiples of the present one: the closed form of the kinematic error is
checked up to three times the shipped tolerances."""
LINEAR_REACH = (0.0, 1e6)
"""The same of a linear stack's, which is exact for any tolerance: for the solver's sake only."""


def assumed_keys(row: Cost) -> tuple[str, ...]:
    """Of `tightest` and `widest` those that the cost `row` leaves to be assumed; data with ends of their own leave
    none."""
    if row.model in ("table", "piecewise"):
        return ()
    return tuple(key for key in ("tightest", "widest") if getattr(row, key) is None)


def costs_and_reach(sections: Mapping[str, Section]) -> tuple[dict[str, Cost], tuple[float, float]]:
    """The costs of a study's checked `sections` by the name of their tolerance, and how far these may go, as multiples
    of the present tolerance."""
    from hdopt.study.tolerances import ContributorsSection, LinearStackSection, TolerancesBase

    stack = sections.get("linear_stack")
    if isinstance(stack, LinearStackSection):
        return {name: d.cost for name, d in stack.dimensions.items() if d.cost is not None}, LINEAR_REACH
    found: dict[str, Cost] = {}
    for one in (sections.get("tolerances"), sections.get("contributors")):
        if isinstance(one, TolerancesBase | ContributorsSection):
            found |= one.costs()
    return found, DEFAULT_REACH


def assumed_lines(sections: Mapping[str, Section]) -> tuple[str, ...]:
    """A line each for `cost.tightest` and `cost.widest`: of which costs of a study's checked `sections` it is assumed,
    and what."""
    rows, reach = costs_and_reach(sections)
    said = []
    for key, factor in zip(("tightest", "widest"), reach, strict=True):
        names = [name for name, row in rows.items() if factor and key in assumed_keys(row)]
        if names:
            said.append(f"cost.{key} is not given for {', '.join(names)}: {factor:g} times the present tolerance")
    return tuple(said)
