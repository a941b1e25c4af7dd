"""What a search of the rest goes on from, once a ripple was found and taken out of the rows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hdopt.arrays import Array, Index
from hdopt.diagnosis.inference.base_fit import with_offsets
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import Fit, evaluate, with_terms
from hdopt.diagnosis.search.penalty import leaves_nothing
from hdopt.diagnosis.search.subset_search import Selection


def without_effects_of(ripple: Fit, fit: Fit) -> Fit:
    """`fit` without the mesh that was taken out as a `ripple`: in rows that hold one it is among the others, and free
    beside nothing it would take up noise. An encoder's cycles below those of the ripple are there as before.
    """
    taken = {term.effect for term in ripple.terms if not leaves_nothing(term)}
    left = [at for at, term in enumerate(fit.terms) if term.effect not in taken]
    return fit if len(left) == len(fit.terms) else with_terms(fit, left)


def power_in_rows(adds: Array, ripple: Fit, row: Index) -> float:
    """The power (arcmin^2) of what the terms of a `ripple` may leave in averaged rows, of which `row` (N,) says into
    which each sample went, and to whose samples they add so much (`adds`, (N,)): inside the zones as much as the means
    of samples hold of it. Beside them it may lift the zones by as much as it is large, which no sine of it does.
    """
    if ripple.problem.base is None:
        return float(np.var(adds))
    return float(np.var(np.bincount(row, adds) / np.bincount(row)))


def at_drive_of(ripple: Fit, fits: Sequence[Fit]) -> tuple[Fit, ...]:
    """`fits` at the drive beside which a `ripple` was fitted inside the zones, with the offsets that they want there:
    without the ripple the drive was bent to what it does to the zones. None for a ripple beside them.
    """
    if ripple.problem.base is None:
        return ()
    there = (evaluate(one.problem, ripple.errors, one.offsets, one.terms, one.coefficients) for one in fits)
    return tuple(with_offsets(one) for one in there)


def each_left_out(ways: Sequence[Fit]) -> list[Fit]:
    """The sets with one term less than a leader, at that drive of its `ways` which leaves least: one of its terms may
    have stood for what a ripple does. None without a leader, or for one of a single term.
    """
    if not ways or len(ways[0].terms) == 1:
        return []
    lowest = min(ways, key=lambda fit: fit.objective)
    return [with_terms(lowest, lowest.all_but(at)) for at in range(len(lowest.terms))]


def lowest_of_both_drives(fit: Fit, ripple: Fit) -> Fit:
    """The way down of `fit` from where it is, or from the drive beside which a `ripple` was fitted inside the zones,
    whichever leaves less.
    """
    iterations = fit.problem.settings.fit.known_iterations
    starts = (fit, *at_drive_of(ripple, [fit]))
    return min((refine(start, iterations) for start in starts), key=lambda one: one.objective)


def stands(before: Selection | None, anew: Selection | None) -> bool:
    """Whether what was found in the zones `before` explains the rows as recorded better than what was found `anew`
    beside other effects: the zones make many minima, and the second look may have missed it.
    """
    if before is None or not any(term.in_zones for term in before.best.fit.terms):
        return False
    return anew is None or bool(np.var(before.best.fit.residual) < np.var(anew.best.fit.residual))
