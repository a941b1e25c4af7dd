"""What a structure may cost before another is the better choice."""

from types import SimpleNamespace

from hdopt.optimize.records import DesignRecord
from hdopt.optimize.summary import break_evens

KEY = "peak_to_peak_arcmin"


def design(structure, value, profile="ellipse", feasible=True):
    return DesignRecord(profile, structure, {}, {KEY: value}, feasible)


def test_the_break_even_is_the_gap_to_each_structures_own_best():
    best = design("automatic", 0.8, "two_disk")
    others = (
        best,
        design("automatic", 0.9),
        design("integral", 1.2),
        design("integral", 1.0, "two_disk"),
        design("one_way_major", 0.81),
        design("one_way_minor", 0.5, feasible=False),
    )
    result = SimpleNamespace(best=best, combinations=others, objective=KEY, feasible=True)
    assert break_evens(result) == (
        "0.01 arcmin (1.2 %) beside one_way_major",
        "0.2 arcmin (25 %) beside integral",
    )


def test_without_a_design_that_keeps_the_limits_there_is_none():
    best = design("automatic", 0.8, feasible=False)
    assert break_evens(SimpleNamespace(best=best, combinations=(best,), objective=KEY, feasible=False)) == ()
