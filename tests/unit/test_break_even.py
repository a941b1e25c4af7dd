"""What a structure may cost before another is the better choice, and what the study says that it costs."""

from types import SimpleNamespace

import pytest

from hdopt.drive.geometry import Structure
from hdopt.errors import HdoptError
from hdopt.optimize.records import DesignRecord
from hdopt.optimize.summary import break_evens, structure_costs
from hdopt.study import load_study
from hdopt.workflow.search import search
from hdopt.workflow.search_setup import setup_of

KEY = "peak_to_peak_arcmin"
COST = "search.trade.structure_cost_percent"


def design(structure, value, profile="ellipse", feasible=True):
    return DesignRecord(profile, structure, {}, {KEY: value}, feasible)


def found(best, *others, costs="{}", feasible=True):
    setup = setup_of(load_study("csf-25-80", (f"{COST}={costs}",)), 1)
    return SimpleNamespace(best=best, combinations=(best, *others), objective=KEY, feasible=feasible, setup=setup)


def test_the_break_even_is_the_gap_to_each_structures_own_best():
    result = found(
        design("automatic", 0.8, "two_disk"),
        design("automatic", 0.9),
        design("integral", 1.2),
        design("integral", 1.0, "two_disk"),
        design("one_way_major", 0.81),
        design("one_way_minor", 0.5, feasible=False),
    )
    assert break_evens(result) == (
        "0.01 arcmin (1.2 %) beside one_way_major",
        "0.2 arcmin (25 %) beside integral",
    )


def test_what_the_study_says_of_costs_is_taken_off_the_gap():
    """0.8 arcmin with a tenth more is 0.88: 0.12 are left beside an integral one of 1.0."""
    result = found(design("automatic", 0.8), design("integral", 1.0), costs="{automatic=10.0}")
    assert break_evens(result) == ("0.12 arcmin (14 %) beside integral",)


def test_without_a_design_that_keeps_the_limits_there_is_none():
    assert break_evens(found(design("automatic", 0.8, feasible=False), feasible=False)) == ()


def test_the_cost_is_asked_for_where_structures_are_compared_and_it_is_absent():
    pair = design("automatic", 0.8), design("integral", 1.0)
    assert COST in structure_costs(found(*pair))
    assert structure_costs(found(*pair)).startswith("what automatic lose")
    said = structure_costs(found(*pair, design("one_way_major", 0.9), costs="{automatic=2.5}"))
    assert said.startswith("structures cost, as the study says: automatic 2.5 % of the objective; what one_way_major")
    assert structure_costs(found(*pair, costs="{automatic=2.5}")).endswith("automatic 2.5 % of the objective")
    assert structure_costs(found(pair[0])) is None


@pytest.mark.slow
def test_a_cost_above_the_break_even_changes_the_choice():
    """Would catch a cost that is read but not weighed, or one that moves the numbers of a design."""
    small = (
        'search.profiles=["ellipse"]',
        'search.structures=["integral", "automatic"]',
        'search.objective="peak_to_peak_arcmin"',
        "search.robust=false",
    )
    free = search(load_study("csf-25-80-design-trade", small), fronts=False)
    values = {s.combination.structure: s.objective for s in free.solutions}
    gap = 100 * (values[Structure.INTEGRAL] / values[Structure.AUTOMATIC] - 1)
    assert free.best.structure == "automatic"
    for share, structure in ((0.9, "automatic"), (1.1, "integral")):
        costs = f"{COST}={{automatic={share * gap}}}"
        costly = search(load_study("csf-25-80-design-trade", (*small, costs)), fronts=False)
        assert costly.best.structure == structure
        assert {s.combination.structure: s.objective for s in costly.solutions} == values


def test_a_structure_that_is_none_has_no_cost():
    with pytest.raises(HdoptError, match="structure_cost_percent"):
        load_study("csf-25-80", (f"{COST}={{automtic=1.0}}",))
