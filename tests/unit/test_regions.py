"""Where the choice of a search holds: boundaries along a constant of the trade, and maps over two."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hdopt.optimize import regions
from hdopt.optimize.constants import constants_of
from hdopt.optimize.region_maps import _map
from hdopt.optimize.region_records import NONE_LEFT, Boundary, ConstantRange, Regions
from hdopt.optimize.regions import Ground, bisect, follow
from hdopt.optimize.summary import nearest_boundary
from hdopt.report import Text
from hdopt.report.sections.regions import region_items
from hdopt.report.sections.search import confidence_section
from hdopt.study import load_study
from hdopt.workflow.search import search

SMALL = (
    'search.profiles=["ellipse"]',
    'search.structures=["integral", "automatic"]',
    'search.objective="peak_to_peak_arcmin"',
    "search.robust=false",
)


def study(*more: str):
    return load_study("csf-25-80-design-trade", (*SMALL, *more))


@pytest.fixture(scope="module")
def result():
    return search(study(), fronts=False)


@pytest.fixture(scope="module")
def ground(result):
    return Ground.of(result, 1)


def constant(ground, name):
    (found,) = (c for c in constants_of(ground.setup) if c.name == name)
    return found


@pytest.fixture(scope="module")
def lag(ground):
    return follow(ground, constant(ground, "Limit: Largest lag"))


@pytest.mark.parametrize(
    ("key", "asked", "followed"),
    [("false", None, 0), ("true", None, 1), ("false", True, 1), ("true", False, 0)],
    ids=["nobody", "the study", "the call", "not in this call"],
)
def test_constants_are_followed_where_someone_asks(result, monkeypatch, key, asked, followed):
    """Would catch a run that follows them unasked, which takes ten times as long, or a key that nobody reads."""
    calls = []
    monkeypatch.setattr("hdopt.workflow.search.search_designs", lambda *_, **__: result)
    monkeypatch.setattr("hdopt.workflow.search.words_on_model", lambda _: ())
    monkeypatch.setattr("hdopt.workflow.search.find_regions", lambda *_: calls.append(1) or Regions((), ()))
    found = search(study(f"search.regions={key}"), regions=asked)
    assert (len(calls), found.regions is not None) == (followed, bool(followed))
    assert ("regions" in found.to_dict()) == bool(followed)
    monkeypatch.setattr("hdopt.report.sections.search._checked_figures", lambda _: {})
    section = confidence_section(found, SimpleNamespace(fresh=None))
    words = [item.text for item in section.items if isinstance(item, Text)]
    assert any("--set search.regions=true" in text for text in words) != bool(followed)


@pytest.mark.slow
def test_a_boundary_of_the_structure_is_where_fresh_searches_change_it(lag):
    """Would catch a boundary stepped over: it lies 3 % below, where a change by a fifth finds no design at all."""
    boundary = lag.range.at("structure", upward=False)
    assert boundary.becomes == "integral"
    assert 0.9 < boundary.factor < 1.0
    for side, structure in ((1.01, "automatic"), (0.99, "integral")):
        bound = 1.15 * boundary.factor * side
        fresh = search(study(f"search.limits.lag_arcmin={{max_of_baseline={bound}}}"), fronts=False)
        assert fresh.best.structure == structure


def test_the_boundary_of_the_numbers_is_where_they_break_the_limit(ground, lag):
    """The design's own lag over the limit, to the share that it is bisected to."""
    limit = next(x for x in ground.setup.limits() if x.quantity == "lag_arcmin")
    design = ground.setup.space.design(ground.chosen.combination, ground.chosen.values)
    own = regions.find_quantity("lag_arcmin").value(ground.setup.trade, design)
    boundary = lag.range.at("design", upward=False)
    assert boundary.becomes == "breaks the limit on largest lag"
    assert boundary.factor == pytest.approx(own / limit.bound, rel=2 * regions.CLOSE_DESIGN)


def test_what_changes_nothing_that_holds_the_design_is_not_searched_anew(ground, monkeypatch):
    """The bearing's rated life cancels, as the limit is a share of the baseline's."""
    monkeypatch.setattr(regions, "solve", None)
    found = follow(ground, constant(ground, "WG bearing, L50")).range
    assert found.boundaries == ()
    assert (found.lowest, found.highest) == (pytest.approx(1 / 1.5), 1.5)


@pytest.mark.slow
def test_a_notch_factor_and_an_endurance_limit_bound_the_choice_alike(ground):
    notch, endurance = (follow(ground, constant(ground, name)).range for name in ("Notch factor", "Endurance limit"))
    mirrored = sorted((b.level, round(1 / b.factor, 9), b.becomes) for b in endurance.boundaries)
    assert mirrored == sorted((b.level, round(b.factor, 9), b.becomes) for b in notch.boundaries)


def test_a_choice_within_rounding_of_the_best_stays(ground):
    """Two searches of one problem differ by a hair: that is no other choice."""
    own = ground.chosen
    (other,) = (s for c, s in ground.today.items() if c != own.combination)

    def at(objective):
        evaluation = replace(other.outcome.evaluation, pieces=np.array([objective]))
        return {
            own.combination: own,
            other.combination: replace(other, outcome=replace(other.outcome, evaluation=evaluation)),
        }

    assert ground.choice(at(own.objective * (1 - 0.5 * regions.SAME))) == own.combination
    assert ground.choice(at(own.objective * (1 - 2.0 * regions.SAME))) == other.combination


@pytest.mark.slow
def test_a_map_agrees_with_the_boundaries_on_its_axes(ground, lag):
    backlash = follow(ground, constant(ground, "Backlash"))
    drawn = _map(ground, lag, backlash)
    middle = len(drawn.x_factors) // 2
    assert drawn.choices[drawn.chosen[middle][middle]] == str(ground.chosen.combination)
    assert drawn.excess[middle][middle] <= regions.BROKEN
    boundary = lag.range.at("structure", upward=False)
    step = drawn.x_factors[1] / drawn.x_factors[0]
    for factor, place in zip(drawn.x_factors, drawn.chosen[middle], strict=True):
        if abs(math.log(factor / boundary.factor)) > math.log(step) / 2 and factor > 0.92:
            assert (place == 0) == (factor > boundary.factor), factor


def test_bisection_ends_within_the_share_asked():
    assert bisect(1.0, 0.5, lambda f: f > 0.7, 0.001) == pytest.approx(0.7, rel=0.001)
    assert bisect(1.0, 2.0, lambda f: f < 1.3, 0.001) == pytest.approx(1.3, rel=0.001)


def a_range(*boundaries: Boundary) -> ConstantRange:
    return ConstantRange("Backlash", 0.01, "mm", "assumed", 0.5, 2.0, boundaries)


def test_the_nearest_boundary_is_said_in_per_cent():
    far, near = Boundary("structure", 1.5, "integral"), Boundary("profile", 0.8, "resal")
    made = Regions((a_range(far, near, Boundary("design", 0.99, "breaks a limit")),), ())
    assert "-20.0 % of backlash, beyond which resal is chosen" in nearest_boundary(made)
    assert NONE_LEFT in nearest_boundary(Regions((a_range(Boundary("structure", 1.1, NONE_LEFT)),), ()))
    assert "up to 2 times" in nearest_boundary(Regions((a_range(),), ()))


def test_the_bars_end_at_the_boundaries(ground, lag):
    """Would catch bars that are drawn to the far end instead of the nearer boundary."""
    from hdopt.optimize.evaluation import record_of

    figure, table = region_items(record_of(ground.setup, ground.chosen), Regions((lag.range,), ()), "key")
    wide = figure.figure.data[0]
    boundary = lag.range.at("structure", upward=False)
    assert wide.base[0] == pytest.approx(boundary.per_cent)
    assert wide.base[0] + wide.x[0] == pytest.approx(100 * (lag.range.highest - 1))
    assert "integral" in table.frame["structure"][0]


def test_a_boundary_that_rounding_puts_before_the_end_of_all_designs_is_that_end():
    near = [Boundary("structure", 0.9612, "one_way_major"), Boundary("profile", 0.9581, NONE_LEFT)]
    assert {(b.factor, b.becomes) for b in regions._merged(near)} == {(0.9581, NONE_LEFT)}
    apart = [Boundary("structure", 0.9642, "one_way_major"), Boundary("profile", 0.8576, NONE_LEFT)]
    assert regions._merged(apart) == apart


def test_a_boundary_lies_between_the_factors_searched(lag):
    """The first of them is 1.5^(-1/4) = 0.904: the boundary is bisected, not taken there."""
    assert 0.91 < lag.range.at("structure", upward=False).factor < 0.99


def test_designs_are_compared_with_what_their_structure_costs(ground):
    own = ground.chosen
    trade = replace(own.problem.trade, structure_costs=((own.combination.structure, 0.25),))
    costly = replace(own, problem=replace(own.problem, trade=trade))
    assert costly.weighed == pytest.approx(1.25 * own.objective, rel=1e-12)
    assert own.weighed == own.objective
    others = {c: s for c, s in ground.today.items() if c != own.combination}
    assert ground.choice({**others, own.combination: costly}) in others
