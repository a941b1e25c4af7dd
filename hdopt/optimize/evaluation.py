"""A design or a solution as a record of plain numbers."""

from __future__ import annotations

from hdopt.errors import MissingValue
from hdopt.optimize.design_space import Combination, Design
from hdopt.optimize.objectives import NOMINAL, QUANTITIES
from hdopt.optimize.records import DesignRecord
from hdopt.optimize.setup import Setup
from hdopt.optimize.solve import Solution


def record_of(setup: Setup, solution: Solution) -> DesignRecord:
    """A `solution` of `setup` in plain numbers."""
    design = setup.space.design(solution.combination, solution.values)
    return record(setup, design, solution)


def record(setup: Setup, design: Design, solution: Solution | None = None) -> DesignRecord:
    """A `design` in plain numbers; its peak-to-peak is the converged one, not the envelope that the search works on.

    Its limits are those of its `solution` where there is one, else those of `setup`.
    """
    from hdopt.kinematics.extremes import converged_peak_to_peak_arcmin

    found: dict[str, float] = {}
    for key, quantity in QUANTITIES.items():
        try:
            found[key] = quantity.value(setup.trade, design)
        except MissingValue:
            continue
    if setup.trade.added is None and isinstance(design.drive.geometry.flexspline_teeth, int):
        found[NOMINAL] = converged_peak_to_peak_arcmin(design.drive, setup.trade.errors_of(design))
    limits = setup.limits() if solution is None else solution.problem.limits
    broken = tuple(str(x) for x in limits if x.quantity in found and x.excess(found[x.quantity]) > 1e-5)
    combination: Combination = design.combination
    return DesignRecord(
        combination.profile,
        combination.structure.value,
        dict(design.values),
        found,
        not broken if solution is None else solution.feasible,
        broken,
    )
