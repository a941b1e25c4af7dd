"""A search result in words and lines."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any  # Any: values of JSON

from hdopt.drive.geometry import Structure
from hdopt.optimize.design_space import VARIABLES
from hdopt.optimize.objectives import QUANTITIES
from hdopt.optimize.records import DesignRecord, SearchResult
from hdopt.optimize.region_records import NONE_LEFT, Regions
from hdopt.words import counted, settled

NOT_MODELLED = (
    "tooth separation under load",
    "what an automatic or one-way wave generator loses in stiffness and efficiency in its cross-slide",
    "ratcheting and buckling torque and torsional stiffness K1 to K3, which are catalogue values without a formula",
    "the stiffness of the flexspline's cup, which loads the wave generator's bearing beside the toothed ring",
)
"""What stands beside every choice, because no formula of the trade knows it."""


def ring_share(design: DesignRecord) -> str | None:
    """How much of the load of the wave generator's bearing of a `design` bends the ring, as far as that is modelled, in
    a sentence; None where either is not known."""
    load, ring = (design.quantities.get(key) for key in ("bearing_load_n", "ring_force_n"))
    if not load or not ring:
        return None
    return (
        f"bending the flexspline counts with {ring:.0f} of the {load:.0f} N on the wave generator's bearing "
        f"({100 * ring / load:.1f} %): that is the toothed ring alone, what its cup adds is not modelled"
    )


def break_evens(result: SearchResult) -> tuple[str, ...]:
    """For each structure other than the one that `result` chose, a phrase of what the chosen one may cost beside it
    before that one is the better: the gap of the best designs of both, in the objective's unit and as a share.

    What an alignment structure loses in stiffness and efficiency is not modelled: this is the number to hold it
    against, over and above what the study says of it. Structures without a design that keeps the limits are left out.
    """
    unit = QUANTITIES[result.objective].unit
    if not result.feasible:
        return ()
    at_best = weighed(result, result.best)
    others: dict[str, float] = {}
    for design in result.combinations:
        if design.feasible and design.structure != result.best.structure:
            value = weighed(result, design)
            others[design.structure] = min(value, others.get(design.structure, value))
    return tuple(
        f"{number(abs(value - at_best), unit)} ({100 * abs(value / at_best - 1):.2g} %) beside {structure}"
        for structure, value in sorted(others.items(), key=lambda item: abs(item[1] - at_best))
    )


def weighed(result: SearchResult, design: DesignRecord) -> float:
    """The objective of a `design` of `result` with what its structure costs."""
    factor = result.setup.trade.structure_factor(Structure(design.structure))
    return factor * design.quantities[result.objective]


def structure_costs(result: SearchResult) -> str | None:
    """What the study of `result` says that structures cost, and what it leaves open, in a sentence; None where only one
    structure may be chosen."""
    compared = list(dict.fromkeys(design.structure for design in result.combinations))
    if len(compared) < 2:
        return None
    given = {s.value: cost for s, cost in result.setup.trade.structure_costs}
    said = [f"{name} {100 * cost:g} %" for name, cost in given.items() if name in compared]
    missing = [name for name in compared if name not in given and name != Structure.INTEGRAL.value]
    words = f"structures cost, as the study says: {', '.join(said)} of the objective" if said else ""
    if not missing:
        return words
    loses = "loses" if len(missing) == 1 else "lose"
    ask = (
        f"what {', '.join(missing)} {loses} in stiffness and efficiency is your number to give, as no published one "
        "was found: search.trade.structure_cost_percent, for each the share of the objective that you would give to be "
        f"without it, such as {{ {missing[0]} = 2.0 }}"
    )
    return f"{words}; {ask}" if words else ask


def nearest_boundary(regions: Regions) -> str:
    """The sentence on the nearest of all boundaries of structure and profile in `regions`."""
    if regions.nearest is None:
        reach = regions.ranges[0].highest - 1 if regions.ranges else 0.0
        return f"no constant of the trade changes the structure or the profile up to {1 + reach:g} times its value"
    constant, boundary = regions.nearest
    name = f"{constant.constant[:1].lower()}{constant.constant[1:]}"
    return (
        f"the nearest boundary of the choice: {boundary.per_cent:+.1f} % of {name}, beyond which "
        f"{boundary.becomes.replace('_', ' ')} is chosen"
        if boundary.becomes != NONE_LEFT
        else f"the nearest boundary of the choice: {boundary.per_cent:+.1f} % of {name}, beyond which {NONE_LEFT}"
    )


def region_lines(regions: Regions) -> Iterator[str]:
    """`regions` in lines for the terminal: each constant with a boundary of structure or profile, the nearest first."""
    yield f"  {nearest_boundary(regions)}"
    bounded = [(r, r.nearest("structure", "profile")) for r in regions.ranges]
    found = [(r, b) for r, b in bounded if b is not None]
    for constant, _ in sorted(found, key=lambda pair: abs(math.log(pair[1].factor))):
        bounds = [b for b in constant.boundaries if b.level != "design"]
        said = "; ".join(f"{b.per_cent:+.1f} % {b.level} {b.becomes}" for b in bounds)
        yield f"    {constant.constant:46s} {said}"
    free = [r.constant for r, b in bounded if b is None]
    if free:
        yield f"    none within reach: {'; '.join(free)}"


def number(value: float, unit: str = "") -> str:
    """A `value` to four digits with its `unit`; a large one written out: '35000 h'."""
    digits = f"{settled(value):.4g}" if abs(value) < 10_000 else f"{value:.0f}"
    return f"{digits} {unit}".strip()


def price_line(price: Mapping[str, Any]) -> str:
    """What the `price` of one active limit or bound says, in a sentence."""
    what = f"{price['title']} {price['kind']} {number(price['at'], price['unit'])}"
    return f"{what}: one {price['unit'] or 'unit'} of it is worth {price['per_unit']:.3g} arcmin"


def result_lines(result: SearchResult) -> Iterator[str]:
    """A search's `result` in lines for the terminal."""
    best, baseline = result.best, result.baseline
    yield f"{result.study}: {result.algorithm}; {counted(result.evaluations, 'design')} evaluated"
    if not result.feasible:
        yield "  no design meets all limits; the nearest is shown, which breaks:"
        for limit in best.broken_limits:
            yield f"    {limit}"
    yield f"  {'best' if result.feasible else 'nearest'}: {best.name}  ({result.stopped_because})"
    for name, value in best.variables.items():
        title, unit = VARIABLES[name]
        yield _row(title, unit, value, baseline.variables.get(name))
    for key, value in best.quantities.items():
        if key in best.variables:
            continue
        yield _row(QUANTITIES[key].title, QUANTITIES[key].unit, value, baseline.quantities.get(key))
    if result.active:
        yield "  held by"
        for price in result.active:
            yield f"    {price_line(price)}"
    yield "  combinations"
    for design in sorted(result.combinations, key=lambda d: (not d.feasible, d.quantities[result.objective])):
        state = "" if design.feasible else f"  breaks {'; '.join(design.broken_limits) or 'a limit'}"
        yield f"    {design.name:28s} {design.quantities[result.objective]:9.4f}{state}"
    for front in result.fronts:
        found = f"{counted(len(front.designs), 'design')}, hypervolume {front.hypervolume:.4g}"
        kept = found if front.designs else "empty, as no design was found that meets all limits"
        yield f"  front of {front.objective} and {front.second}: {kept}"
    if gaps := break_evens(result):
        more = "a further" if result.setup.trade.structure_costs else "worth"
        yield f"  {best.structure} stays the choice until what it costs is {more} {', '.join(gaps)}"
    if costs := structure_costs(result):
        yield f"  {costs}"
    if result.regions is not None:
        yield from region_lines(result.regions)
    for note in result.notes:
        yield f"  note: {note}"
    if share := ring_share(baseline):
        yield f"  of the drive as it is: {share}"
    yield f"  not modelled: {'; '.join(NOT_MODELLED)}"


def _row(title: str, unit: str, value: float, before: float | None) -> str:
    was = "" if before is None else f"   was {settled(before):9.4g}"
    return f"    {title:32s} {settled(value):9.4g} {unit:7s}{was}"


def design_words(design: DesignRecord) -> str:
    """One `design` in a phrase: 'ellipse, automatic: 10.2 deg, 8.1 mm ...'."""
    parts = [
        f"{VARIABLES[name][0].lower()} {number(value, VARIABLES[name][1])}" for name, value in design.variables.items()
    ]
    return f"{design.name}: {', '.join(parts)}"


def chosen_words(result: SearchResult) -> str:
    """The choice of `result` with what it gains: 'two-disk, automatic: pressure angle 7 deg, ...; 0.74 arcmin instead
    of 1.1'."""
    after, before = (d.quantities[result.objective] for d in (result.best, result.baseline))
    unit = QUANTITIES[result.objective].unit
    return f"{design_words(result.best)}; {number(after, unit)} instead of {number(before, unit)}"
