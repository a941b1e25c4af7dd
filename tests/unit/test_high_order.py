"""Orders above the averaged rows: which they are, and how they are taken out."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from hdopt.diagnosis.alternatives import AnyOrder, Mains
from hdopt.diagnosis.inference import fit as fitting
from hdopt.diagnosis.inference.catalogue import explanations
from hdopt.diagnosis.inference.fit import Fit
from hdopt.diagnosis.search import high_order
from hdopt.diagnosis.search.candidates import Candidate
from hdopt.diagnosis.search.high_order import high_order_selection, ripple_orders, subtract
from hdopt.diagnosis.search.subset_search import Selection
from hdopt.diagnosis.settings import DEFAULT
from hdopt.effects import EFFECTS, HIGH_ORDER
from hdopt.effects.term import Term
from hdopt.recordings.read import recording_from_table


def test_high_orders_begin_where_the_averages_end():
    """Averages of 64 rows a turn hold a third of that; 400 rows a turn hold less than 200."""
    averaged, raw = SimpleNamespace(highest_order=21.3), SimpleNamespace(rows_per_turn=400.0)
    lowest, highest = ripple_orders(averaged, raw)
    assert lowest == 21.3
    assert 21.3 < highest < 200.0


def test_a_ripple_is_taken_out_of_each_recording_in_its_place():
    theta = np.arange(400) / 10
    table = pd.DataFrame({"input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(theta / 50 + 1e-4)})
    one = recording_from_table(table, 50.0, name="one")
    total = np.arange(800.0)
    for number, left in enumerate(subtract([one, one], total)):
        np.testing.assert_allclose(one.error_arcmin - left.error_arcmin, np.arange(400) + 400 * number, atol=1e-9)


@pytest.fixture
def told(monkeypatch):
    """A residual of 1 arcmin^2 beside a ripple whose power the test says; lines that are no pulse's."""

    def of(power, pulse=False):
        left = np.array([-1.0, -1.0, 1.0, 1.0])
        ripple = np.sqrt(power) * np.array([-1.0, 1.0, -1.0, 1.0])
        probe = SimpleNamespace(residual=left + ripple, spectrum=lambda orders: np.ones(len(orders)))
        monkeypatch.setattr(high_order, "left_as_recorded", lambda *about: SimpleNamespace(rows=None))
        monkeypatch.setattr(high_order, "evaluate", lambda *about: None)
        monkeypatch.setattr(high_order, "FitProbe", lambda fit: probe)
        monkeypatch.setattr(high_order, "ripple_orders", lambda *about: (20.0, 90.0))
        monkeypatch.setattr(high_order, "strongest_orders", lambda probe, count, lowest, highest: [lowest + 1])
        monkeypatch.setattr(high_order, "waves_of", lambda rows, values, orders: ripple)
        monkeypatch.setattr(high_order, "is_part_of_a_pulse", lambda *about: pulse)
        rows = SimpleNamespace(locked=False, are_averages=True)
        return high_order.strong_ripple((), SimpleNamespace(problem=SimpleNamespace(rows=rows, settings=DEFAULT)), None)

    return of


def test_a_ripple_is_strong_against_what_stands_beside_it(told):
    """A quarter of the power beside it. Faults caught: held against all that is there, or strong at a fifth of that."""
    assert told(0.24) is None
    assert np.var(told(0.26)) == pytest.approx(0.26)
    assert told(0.26, pulse=True) is None


def test_what_was_taken_out_gained_its_power_in_every_row():
    """Log evidence counts in noise variances: 0.3 arcmin^2 in 200 rows and a noise of 0.5 arcmin are 240 of them."""
    problem = SimpleNamespace(weighed_rows=200.0, noise=SimpleNamespace(sigma=0.5))
    taken = high_order.subtracted_terms(SimpleNamespace(problem=problem), 0.3, ["a term"])
    assert (taken.terms, taken.gain) == (("a term",), pytest.approx(240.0))


@pytest.fixture
def searched(monkeypatch):
    """The search of high orders, where averaged rows were explained by a rough term that may leave 2 arcmin^2 there and
    an exact one: what it was asked, by the power that both explain together."""

    class AveragedRows(SimpleNamespace):
        def __len__(self):
            return 2

    def of(together=9.0, lowest=None, averaged=True):
        seen = SimpleNamespace()
        rows = AveragedRows(locked=False, are_averages=averaged, rows_per_turn=400.0, highest_order=20.0)
        terms = (SimpleNamespace(rough=True), SimpleNamespace(rough=False))

        class Problem(SimpleNamespace):
            def with_noise(self, noise):
                return Problem(**{**vars(self), "noise": noise})

        problem = Problem(rows=rows, settings=DEFAULT, noise="first guess")
        low = SimpleNamespace(problem=problem, terms=terms, residual=np.zeros(2), offsets=None)
        base = SimpleNamespace(residual=np.array([-1.0, 1.0]) * np.sqrt(together))
        found = SimpleNamespace(best=SimpleNamespace(fit=low), base=base)

        def evaluate(problem, *about):
            return SimpleNamespace(problem=problem, residual=np.array([-4.0, 4.0]), offsets=None)

        def select(bare, inflation, rng, plan):
            seen.plan, seen.noise = plan, bare.problem.noise
            return "a selection"

        def power_left(fit, which, lowest):
            assert (fit, which) == ("as recorded", [0])
            seen.from_order = lowest
            return 2.0

        monkeypatch.setattr(high_order, "on_rows_as_recorded", lambda *about: "as recorded")
        monkeypatch.setattr(high_order, "left_of", lambda fit: problem if fit == "as recorded" else None)
        monkeypatch.setattr(high_order, "noise_beside_lines", lambda bare, orders: (bare.problem.noise, orders))
        monkeypatch.setattr(high_order, "power_left", power_left)
        monkeypatch.setattr(high_order, "evaluate", evaluate)
        monkeypatch.setattr(high_order, "refine", lambda fit, iterations: fit)
        monkeypatch.setattr(high_order, "leaves_nothing", lambda term: not term.rough)
        monkeypatch.setattr(high_order, "subtracted_terms", lambda fit, power, terms: (power, list(terms)))
        monkeypatch.setattr(high_order, "select", select)
        assert high_order_selection((), found, None, ("tooth_mesh",), None, lowest) == "a selection"
        seen.rough = terms[0]
        return seen

    return of


def test_high_orders_are_searched_by_what_is_of_high_order(searched):
    """All of the catalogue that is not, and what is ruled out, is left aside; plain lines and hum are not."""
    plan = searched().plan
    assert set(explanations()) - set(plan.skip) == {*HIGH_ORDER, AnyOrder.id, Mains.id} - {"tooth_mesh"}
    assert plan.order_range == (20.0, DEFAULT.high_order.order_share * 400.0)


def test_high_orders_are_searched_in_the_noise_beside_lines(searched):
    """Faults caught: the first guess kept, or the noise beside other orders than those that are searched."""
    assert searched().noise == ("first guess", (20.0, DEFAULT.high_order.order_share * 400.0))


def test_what_rough_shapes_explained_may_come_back_as_high_orders(searched):
    """Their own power, or what both explain together where that is less: a term may be large only against a bent base.
    Fault caught: the power of a term that the base takes back."""
    for together, power in ((9.0, 2.0), (0.5, 0.5)):
        seen = searched(together)
        assert seen.plan.subtracted == (pytest.approx(power), [seen.rough])
        assert seen.from_order == 20.0


def test_a_ripple_found_in_the_zones_adds_what_it_adds_there(monkeypatch):
    """Fault caught: the contribution beside the zones taken where the fit inside of them is the better one."""
    best = Candidate(SimpleNamespace(terms=("a",), contributions="beside"), 9.0, 1.0)
    high = Selection("base", (best, Candidate("mesh", 8.0, 1.0)), 1.0)
    low = SimpleNamespace(terms=(), problem=SimpleNamespace(rows=None))
    found = SimpleNamespace(best=SimpleNamespace(fit=low), candidates=())
    monkeypatch.setattr(high_order, "high_order_selection", lambda *about: high)
    monkeypatch.setattr(high_order, "gather", lambda recordings: None)
    inside = SimpleNamespace(fit="inside", adds="what it adds there")
    for zones, fit, adds in ((inside, "inside", "what it adds there"), (None, high.best.fit, "beside")):
        monkeypatch.setattr(
            high_order, "fit_in_zones", lambda *about, zones=zones: about[-2:] == ("told", ["mesh"]) and zones
        )
        selection, ripple = high_order.find_ripple((), found, None, (), None, "told")
        assert (selection.best.fit, ripple) == (fit, adds)


def fit_of(problem, terms, coefficients):
    """A fit of `terms` of which nothing else is asked."""
    return Fit(problem, None, None, terms, coefficients, *[None] * 5)


def test_a_mesh_among_the_averaged_rows_is_looked_for_in_the_zones(monkeypatch):
    """Where the rows hold the mesh it was seen among all effects, beside the motion: it is taken out of what was found,
    looked for from its lowest order on, and kept where the zones explain more than all that was found; else all stays.
    Faults caught: taken out for good, another term taken out, the orders beside it left out, kept where it leaves more.
    """
    asked = []

    def selection(recordings, found, nuisances, ruled_out, rng, lowest):
        asked.append((found.best.fit, lowest))
        return None if lowest is None else Selection("base", (Candidate(SimpleNamespace(terms=("m",)), 9.0, 1.0),), 1.0)

    explained = {name: EFFECTS[name] for name in ("tooth_mesh", "output_coupling")}
    mesh = Term("tooth_mesh", {"sidebands": (0, -2, 2)}, columns=np.ones((3, 6)))
    other = Term("output_coupling", {"shaft": "output"}, columns=np.ones((3, 2)))
    problem = SimpleNamespace(explanations=explained, rows=SimpleNamespace(ratio=30.0))
    fit = fit_of(problem, (mesh, other), ("m", "o"))
    found = Selection("base", (Candidate(fit, 9.0, 1.0),), 1.0)
    monkeypatch.setattr(fitting, "evaluate", lambda problem, errors, offsets, terms, own: (terms, own))
    monkeypatch.setattr(high_order, "high_order_selection", selection)
    monkeypatch.setattr(high_order, "gather", lambda recordings: None)
    recorded = SimpleNamespace(rows=SimpleNamespace(error=np.array([-2.0, 2.0])))
    monkeypatch.setattr(high_order, "left_as_recorded", lambda *about: recorded)
    less, more = (SimpleNamespace(fit=SimpleNamespace(residual=np.array([-a, a])), adds="added") for a in (1.9, 2.1))
    for zones, expected in ((less, (less.fit, "added")), (more, None), (None, None)):
        asked.clear()
        monkeypatch.setattr(high_order, "fit_in_zones", lambda *about, zones=zones: zones)
        high, ripple = high_order.find_ripple((), found, None, (), None)
        assert asked[0] == (([other], ["o"]), 59.0)  # 62 teeth, two waves below them, and one
        assert (high and (high.best.fit, ripple)) == expected
        assert asked[1:] == ([] if zones is less else [(fit, None)])
    plain = Selection("base", (Candidate(SimpleNamespace(problem=problem, terms=(other,)), 9.0, 1.0),), 1.0)
    assert high_order.mesh_taken_out(plain) is None


@pytest.mark.parametrize("white", [True, False])
def test_a_mesh_behind_a_better_set_is_taken_where_that_leaves_more_than_noise(monkeypatch, white):
    """Faults caught: of the sets only the best, or a mesh tried where nothing is left."""
    problem = SimpleNamespace(explanations=dict(EFFECTS), rows=SimpleNamespace(ratio=30.0))
    mesh = Term("tooth_mesh", {"sidebands": (0,)}, columns=np.ones((3, 2)))
    line = Term("encoder_interpolation", {"lines": 62, "shaft": "input", "cycles": (1,)}, columns=np.ones((3, 2)))
    first, second = (fit_of(problem, (one,), ("own",)) for one in (line, mesh))
    found = Selection("base", (Candidate(first, 9.0, 1.0), Candidate(second, 8.0, 1.0)), 1.0)
    monkeypatch.setattr(fitting, "evaluate", lambda problem, errors, offsets, terms, own: (terms, own))
    monkeypatch.setattr(high_order, "leaves_white_noise", lambda fit: white if fit is first else None)
    if white:
        assert high_order.mesh_taken_out(found) is None
    else:
        without, lowest = high_order.mesh_taken_out(found)
        assert (without.best.fit, lowest) == (([], []), 61.0)


def test_no_order_is_below_those_of_an_effect_without_orders():
    assert high_order.lowest_order([Term("hysteresis", {}, columns=np.ones((3, 1)))], 80.0) == np.inf


def test_high_orders_begin_where_they_are_told_to(searched):
    """Of rows that are no averages too. Faults caught: the orders above the averaged rows alone, and none without."""
    assert searched().plan.order_range[0] == 20.0
    seen = searched(lowest=7.0, averaged=False)
    assert seen.plan.order_range == (7.0, DEFAULT.high_order.order_share * 400.0)


@pytest.mark.parametrize("left", ["mesh", "noise", "no swing", "no waves", "lobes", "fine rows"])
def test_what_swings_is_tried_without_the_waves_beside_it(monkeypatch, left):
    """Behind a spring waves of the teeth stand for a mesh in part: without them it is looked for above the averaged
    rows, and kept where it explains more inside the zones. Faults caught: tried where nothing is left or swings,
    beside lobes, which stand for no mesh, or where the rows are no averages; what is beside the waves taken out with
    them; kept where it leaves more."""
    asked = []

    def selection(recordings, found, nuisances, ruled_out, rng, lowest):
        asked.append((found.best.fit, lowest))
        return Selection("base", (Candidate(SimpleNamespace(terms=("m",), contributions="c"), 9.0, 1.0),), 1.0)

    waves = Term("cs_tooth_harmonics", {"members": (2, 3)}, met=SimpleNamespace())
    swing = Term("resonance", {}, columns=np.ones((3, 2)))
    drift = Term("thermal_drift", {}, columns=np.ones((3, 1)))
    lobes = Term("circular_spline_lobing", {"lobes": 2}, met=SimpleNamespace())
    others = {"no swing": (waves, drift), "no waves": (swing, drift), "lobes": (lobes, swing, drift)}
    terms = others.get(left, (waves, swing, drift))
    rows = SimpleNamespace(ratio=30.0, are_averages=left != "fine rows")
    problem = SimpleNamespace(explanations=dict(EFFECTS), rows=rows, settings=DEFAULT)
    fit = fit_of(problem, terms, [term.effect for term in terms])
    found = Selection("base", (Candidate(fit, 9.0, 1.0),), 1.0)
    monkeypatch.setattr(fitting, "evaluate", lambda problem, errors, offsets, terms, own: (terms, own))
    monkeypatch.setattr(high_order, "refine", lambda fit, iterations: (*fit, iterations))
    monkeypatch.setattr(high_order, "leaves_white_noise", lambda fit: left == "noise")
    monkeypatch.setattr(high_order, "high_order_selection", selection)
    monkeypatch.setattr(high_order, "gather", lambda recordings: None)
    recorded = SimpleNamespace(rows=SimpleNamespace(error=np.array([-2.0, 2.0])))
    monkeypatch.setattr(high_order, "left_as_recorded", lambda *about: recorded)
    for size in (1.9, 2.1):
        asked.clear()
        inside = SimpleNamespace(fit=SimpleNamespace(residual=np.array([-size, size])), adds="added")
        monkeypatch.setattr(high_order, "fit_in_zones", lambda *about, inside=inside: inside)
        high, ripple = high_order.find_ripple((), found, None, (), None)
        assert (high.best.fit, ripple) == (inside.fit, "added")
        without = ([swing, drift], ["resonance", "thermal_drift"], DEFAULT.fit.settled_iterations)
        tried = [(without, None)] if left == "mesh" else []
        assert asked == tried + ([] if tried and size < 2 else [(fit, None)])
