"""What each stage decides, with fits and searches that are told what to answer: no fit is made here."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from hdopt.diagnosis import stages
from hdopt.diagnosis import state as state_module
from hdopt.diagnosis.inference import base_fit, clean_base
from hdopt.diagnosis.inference.common_slope import TakenSlope
from hdopt.diagnosis.orientation import Orientation
from hdopt.diagnosis.search import candidates, freed_of_ripple
from hdopt.diagnosis.search.candidates import Candidate
from hdopt.diagnosis.search.guess import Guess
from hdopt.diagnosis.search.subset_search import Selection
from hdopt.diagnosis.settings import DEFAULT
from hdopt.diagnosis.state import State
from hdopt.recordings.recording import Recording


@dataclass(frozen=True)
class Problem:
    """As much of a fit's problem as a stage asks for."""

    noise: object = field(default_factory=lambda: SimpleNamespace(sigma=1.0))
    base: object = "a base"
    rows: object = field(default_factory=lambda: SimpleNamespace(locked=False))
    nuisance: object = None
    settings: object = DEFAULT

    def with_noise(self, noise):
        return replace(self, noise=noise)


@dataclass(frozen=True)
class Told:
    """A fit that was told what it leaves."""

    name: str
    objective: float = 1.0
    problem: Problem = field(default_factory=Problem)
    terms: tuple = ()
    contributions: tuple = (0.0,)


def noise_of(sigma):
    return SimpleNamespace(sigma=sigma)


def selection_of(fit, log_bayes_factor=0.0, inflation=1.0):
    return Selection(fit, (Candidate(fit, log_bayes_factor, 0.0),), inflation)


def state_of(base, clean=None, output_reversed=False, drift=False, taken=None, inflation=1.0, **more):
    nuisances = SimpleNamespace(warps=False, drift=drift, taken=taken, columns=lambda rows: ("columns of", rows))
    angles = np.linspace(-7.0, 9.0, 50)
    record = Recording("one", 80.0, angles, 3.0 + angles, output_reversed=output_reversed)
    fields = {"selection": selection_of(base), "high": None, "ripple": None, "rng": np.random.default_rng(5)}
    return State((record,), nuisances, (), base, clean, inflation=inflation, **(fields | more))


def guess_turned(turned):
    """A guess that was found on recordings turned round, or on them as counted."""
    return Guess(np.zeros(12), (), (), turned)


@pytest.fixture
def ways(monkeypatch):
    """`of(as counted, turned, clean as counted, clean turned)`: what the bases leave, bare and beside smooth columns;
    what was chosen by the base, or by `effects` where it leaves that open. Bare, a clean base says the contrary."""
    left = {}

    def of(as_counted, turned, clean, clean_turned, output_reversed=False, found_turned=()):
        left.update(clean=clean, turned_clean=clean_turned)
        bare = [Told("clean", clean_turned), Told("turned_clean", clean)]
        guesses = tuple(guess_turned(one) for one in found_turned)
        begun = replace(state_of(Told("turned", turned)), guesses=guesses)
        monkeypatch.setattr(stages, "begin_turned", lambda state: begun)
        monkeypatch.setattr(stages, "fit_base", lambda problem, rng, near: replace(near, problem=problem))
        monkeypatch.setattr(stages, "fit_clean_base", lambda problem, rng: bare[1])
        monkeypatch.setattr(stages, "beside_smooth", lambda fit: Told(fit.name, left[fit.name]))
        monkeypatch.setattr(stages, "fit_base_in_noise", lambda state: replace(state, inflation=7.0))
        state = replace(state_of(Told("as counted", as_counted), bare[0], output_reversed), guesses=guesses)
        return stages.oriented(state, lambda *both: ("effects", *both))

    return of


def test_the_base_alone_decides_where_it_is_clear(ways):
    """Faults caught: the clean bases asked although the base is clear by e, the turned way in a noise that was never
    measured, the output's sign left as it was.
    """
    counted = ways(1.0, 3.0, 5.0, 1.0)
    assert (counted.base.name, counted.orientation) == ("as counted", Orientation(1, 1, "data"))
    turned = ways(3.0, 1.0, 1.0, 5.0)
    assert (turned.base.name, turned.orientation) == ("turned", Orientation(-1, -1, "data"))
    assert turned.inflation == 7.0
    assert ways(3.0, 1.0, 1.0, 5.0, output_reversed=True).orientation == Orientation(-1, 1, "data")
    assert ways(1.0, 3.0, 1.0, 5.0, output_reversed=True).orientation == Orientation(1, -1, "data")


def test_the_base_does_not_decide_against_what_other_rows_showed(ways):
    """Faults caught: a windup of 4 arcmin bent the base so that a recording was turned round, which a part of the turns
    had explained to the noise as it was counted; what was found asked of the way that lost."""
    assert ways(3.0, 1.0, 1.0, 5.0, found_turned=[False])[0] == "effects"
    assert ways(1.0, 3.0, 5.0, 1.0, found_turned=[False, True])[0] == "effects"
    assert ways(3.0, 1.0, 1.0, 5.0, found_turned=[True]).base.name == "turned"
    assert ways(1.0, 3.0, 5.0, 1.0, found_turned=[False]).base.name == "as counted"


@pytest.mark.parametrize("otherwise", [True, False])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_first_look_does_not_decide_against_what_other_rows_showed(monkeypatch, otherwise, sign):
    """What was found there is no part of a first look. Faults caught: the first look alone decides; it never does; the
    other way asked."""
    guesses = (guess_turned((sign > 0) == otherwise),)
    one = replace(state_of(Told("one", 2.0)), orientation=Orientation(1, 1, "data"), guesses=guesses)
    two = replace(state_of(Told("two", 2.0)), orientation=Orientation(-1, -1, "data"), guesses=guesses)
    asked = []
    monkeypatch.setattr(stages, "fit_base_in_noise", lambda turned: two)
    monkeypatch.setattr(stages, "in_one_noise", lambda state, turned: [one, two])
    monkeypatch.setattr(stages, "with_first_look", lambda way: way)
    monkeypatch.setattr(stages, "gap_at_first_look", lambda both: sign * 501.0)
    monkeypatch.setattr(stages, "search_effects", lambda way: asked.append(way.base.name) or way)
    monkeypatch.setattr(stages, "unexplained", lambda way: 0.0)
    monkeypatch.setattr(stages, "explained", lambda way: 0.0)
    after = stages.better_way(one, two)
    assert asked == (["one", "two"] if otherwise else [])
    assert after.base.name == ("one" if otherwise or sign > 0 else "two")


def test_where_it_is_not_the_bases_beside_smooth_columns_must_agree(ways):
    """Faults caught: the clean bases compared bare, or the other way round, or not asked from a fifth of e on."""
    assert ways(1.0, 2.0, 1.0, 1.5).base.name == "as counted"
    assert ways(2.0, 1.0, 1.5, 1.0).base.name == "turned"
    assert ways(1.0, 2.0, 1.5, 1.0)[0] == "effects"
    chosen, state, turned = ways(2.0, 1.0, 1.0, 1.5)
    assert chosen == "effects"
    assert (state.orientation.input, turned.orientation.input) == (1, -1)
    assert turned.problem.noise is state.problem.noise
    assert ways(1.0, 1.2, 1.0, 9.0)[0] == "effects"


def test_beside_waves_of_the_teeth_the_bent_bases_are_not_asked(monkeypatch):
    """A base that is bent by waves prefers either way, bare and beside smooth columns: only the bases beside waves
    decide, or, turned round, the one beside smooth columns where no waves help it. Faults caught: the bent ones asked
    too, the way of the turned base without its waves.
    """
    state = state_of(Told("bent"), clean=Told("clean"), wavy=Told("wavy", 2.0))
    monkeypatch.setattr(stages, "is_left_wavy", lambda fit: False)
    monkeypatch.setattr(stages, "beside_waves", lambda fit, rng: Told("turned, wavy", 6.0))
    assert stages.preferences_beside([-5.0], state, Told("turned", 40.0), None) == [pytest.approx(np.log(3.0))]
    monkeypatch.setattr(stages, "beside_waves", lambda fit, rng: None)
    assert stages.preferences_beside([-5.0], state, Told("turned", 40.0), None) == [pytest.approx(np.log(20.0))]


@pytest.mark.parametrize(("counted", "turned"), [(2.0, 6.0), (6.0, 2.0)])
def test_waves_that_leave_much_do_not_decide_alone(monkeypatch, counted, turned):
    """The better of both ways leaves more than noise: the base alone must agree. Faults caught: a code wheel's lines at
    the fifth wave, of which waves of the teeth left sixty times the noise, turned a recording round; the worse way, or
    always the one as counted, asked for what it leaves."""
    state = state_of(Told("bent"), clean=Told("clean"), wavy=Told("as counted", counted))
    monkeypatch.setattr(stages, "beside_waves", lambda fit, rng: Told("turned", turned))
    preferred = pytest.approx(np.log(turned / counted))
    monkeypatch.setattr(stages, "is_left_wavy", lambda fit: fit.objective > 1.0)
    assert stages.preferences_beside([-5.0], state, Told("", 40.0), None) == [-5.0, preferred]
    monkeypatch.setattr(stages, "is_left_wavy", lambda fit: fit.objective > 4.0)
    assert stages.preferences_beside([-5.0], state, Told("", 40.0), None) == [preferred]


def test_what_is_left_counts_in_noise_variances_half(monkeypatch):
    """log likelihood of what is left: half its power over that of the noise, which is rougher by the inflation."""
    assert stages.unexplained(state_of(Told("", 12.0, Problem(noise_of(0.5))), inflation=3.0)) == pytest.approx(8.0)
    monkeypatch.setattr(stages, "plan_of", lambda way: way.base.name)
    monkeypatch.setattr(stages, "first_look", lambda base, inflation, rng, plan: plan)
    monkeypatch.setattr(stages, "most_explained", {"one": 10.0, "two": 4.0}.get)
    both = [stages.with_first_look(state_of(Told(*told))) for told in (("one", 6.0), ("two", 10.0))]
    assert stages.gap_at_first_look(both) == pytest.approx((10 - 3) - (4 - 5))


def test_both_ways_are_compared_in_one_noise(monkeypatch):
    monkeypatch.setattr(stages, "on_problem", lambda fit, problem: replace(fit, problem=problem))
    monkeypatch.setattr(stages, "refine", lambda fit, iterations: fit)
    one = state_of(Told("one", problem=Problem(noise_of(0.5))), inflation=2.0)
    two = state_of(Told("two", problem=Problem(noise_of(4.0))), inflation=9.0)
    for way, name in zip(stages.in_one_noise(one, two), ("one", "two"), strict=True):
        assert (way.base.name, way.problem.noise.sigma, way.inflation) == (name, 0.5, 2.0)


@pytest.mark.parametrize(
    ("evidence", "left", "chosen"),
    [
        ((100.0, 100.0), (10.0, 60.0), ("one", "data")),
        ((100.0, 100.0), (60.0, 10.0), ("two", "data")),
        ((100.0, 130.0), (10.0, 60.0), ("two", "data")),
        ((100.0, 100.0), (10.0, 18.0), ("one", "convention")),
        ((100.0, 100.0), (18.0, 10.0), ("one", "convention")),
        ((100.0, 100.0), (10.0, 22.0), ("one", "data")),
    ],
)
def test_after_both_searches_what_effects_and_base_explain_together_decides(monkeypatch, evidence, left, chosen):
    """Half of what is left is log evidence; 4 apart is a tie, 6 is none. The turned way goes on in its own noise."""
    found = dict(zip(("one", "two"), evidence, strict=True))

    def searched(way):
        return replace(way, selection=selection_of(way.base, found[way.base.name]), inflation=5.0)

    ways = [state_of(Told(name, size), inflation=1.0) for name, size in zip(("one", "two"), left, strict=True)]
    ways[0] = replace(ways[0], orientation=Orientation(1, 1, "data"))
    other = replace(ways[1], inflation=3.0, orientation=Orientation(-1, -1, "data"))
    monkeypatch.setattr(stages, "fit_base_in_noise", lambda turned: other)
    monkeypatch.setattr(stages, "in_one_noise", lambda state, turned: list(ways))
    monkeypatch.setattr(stages, "with_first_look", lambda way: way)
    monkeypatch.setattr(stages, "gap_at_first_look", lambda both: 499.0)
    monkeypatch.setattr(stages, "search_effects", searched)
    monkeypatch.setattr(stages, "unexplained", lambda way: way.base.objective / 2)
    monkeypatch.setattr(stages, "explained", lambda way: found[way.base.name])
    after = stages.better_way(ways[0], ways[1])
    assert (after.base.name, after.orientation.decided_by) == chosen
    assert after.selection.best.log_bayes_factor == found[chosen[0]]
    assert after.inflation == (3.0 if chosen[0] == "two" else 5.0)


@pytest.mark.parametrize("log_bayes_factor", [5467.0, 4827.0])
def test_what_a_way_explains_does_not_hang_on_how_its_set_was_weighed(monkeypatch, log_bayes_factor):
    """Half the gain in the noise as it is, less what freedom and search cost. Faults caught: the log Bayes factor, of
    which a set that completed another pays 400 less; the inflation forgotten; nothing paid at all."""
    fit = SimpleNamespace(terms=("a term", "another"))
    best = Candidate(fit, log_bayes_factor, 1000.0)
    state = replace(state_of(Told("one")), selection=Selection(Told("one"), (best,), 2.0), inflation=2.0)
    monkeypatch.setattr(stages, "penalty_scale", lambda problem, inflation: SimpleNamespace(inflation=inflation))
    monkeypatch.setattr(candidates, "penalty", lambda terms, top_gain, scale: 20.0 * len(terms) + top_gain)
    assert stages.explained(state) == pytest.approx(1000.0 / 2.0 / 2 - 40.0)


@pytest.mark.parametrize("drift", [False, True])
@pytest.mark.parametrize("taken", [None, TakenSlope(0.01, 4.0)])
def test_a_recording_turned_round_begins_as_the_other_did(monkeypatch, drift, taken):
    """Faults caught: the drift that was asked for forgotten, a slope taken out about the angle as it was counted, a
    strong ripple left in, what a part of the turns was found to hold forgotten.
    """
    begun = []
    monkeypatch.setattr(stages, "first_fit", lambda *about: begun.append(about) or state_of(Told("turned")))
    monkeypatch.setattr(stages, "set_strong_ripple_aside", lambda state: (state.guesses, state.guessed_ripple))
    state = replace(state_of(Told(""), drift=drift, taken=taken), guesses=("told",), guessed_ripple="a ripple")
    assert stages.begin_turned(state) == (("told",), "a ripple")
    (((record,), base, _, settings, asked, slope),) = begun
    assert (base, settings, asked) == ("a base", DEFAULT, ("drift",) if drift else ())
    np.testing.assert_array_equal(record.input_angle, -state.recordings[0].input_angle)
    assert slope == (None if taken is None else TakenSlope(0.01, -4.0))


GUESS = Guess(np.full(12, 0.01), (("tooth_mesh", {}),), (np.ones(2),), False)


def test_what_was_found_elsewhere_is_where_a_search_begins(monkeypatch):
    """After what was found here in another noise. Faults caught: guesses dropped, or what was known here, tried on
    recordings that are counted the other way round, or on a gear without a base.
    """
    monkeypatch.setattr(stages, "leaders_on", lambda selection, problem: ("known",))
    monkeypatch.setattr(stages, "guessed", lambda guess, problem: ("told", guess.turned))
    turned = replace(GUESS, turned=True)
    state = replace(state_of(Told("base", problem=Problem(base="a base"))), guesses=(turned, GUESS))
    assert stages.plan_of(state).known == ("known", ("told", False))
    other = replace(state, orientation=Orientation(-1, -1, "data"))
    assert stages.plan_of(other).known == ("known", ("told", True))
    gear = state_of(Told("base", problem=Problem(base=None)), guesses=(GUESS,))
    assert stages.plan_of(gear).known == ("known",)


def test_a_ripple_is_told_where_it_was_counted_as_here(monkeypatch):
    """Faults caught: a ripple of recordings that are counted the other way round, and one that is not handed on."""
    told = []
    monkeypatch.setattr(stages, "find_ripple", lambda *about: told.append(about[-1]) or (None, None))
    state = replace(state_of(Told("base")), guessed_ripple=GUESS)
    stages.search_high_orders(state)
    stages.search_high_orders(replace(state, orientation=Orientation(-1, -1, "data")))
    stages.search_high_orders(replace(state, guessed_ripple=None))
    assert told == [GUESS, None, None]


@pytest.mark.parametrize("told", [True, False])
def test_what_was_found_elsewhere_does_not_save_the_first_look(monkeypatch, told):
    """Fault caught: a search that sees only what a part of the turns saw. Without guesses there is nothing to save, and
    the search takes its first look itself.
    """
    searched = []
    monkeypatch.setattr(stages, "guesses_here", lambda state: ("told",) if told else ())
    look = SimpleNamespace(rng=np.random.default_rng(3))
    monkeypatch.setattr(stages, "with_first_look", lambda way: searched.append("look") or replace(way, looked=look))
    monkeypatch.setattr(stages, "plan_of", lambda state: "its plan")
    monkeypatch.setattr(
        stages, "replace", lambda one, **new: SimpleNamespace(**new) if one is look else replace(one, **new)
    )
    monkeypatch.setattr(stages, "select_from", lambda state: searched.append("from it") or selection_of(Told("found")))
    monkeypatch.setattr(stages, "select", lambda *about: searched.append("anew") or selection_of(Told("found")))
    assert stages.search_effects(state_of(Told("base"))).searched
    assert searched == (["look", "from it"] if told else ["anew"])


def test_a_guess_stands_where_it_stood(monkeypatch):
    """The drive, the terms and what excites them are the guess's own; only the zeros are new."""
    seen = []

    def evaluate(problem, errors, offsets, terms, coefficients):
        seen.append((errors, offsets, terms, coefficients))
        left = {"motion": "its motion", "residual": np.array([1.0, 3.0])}
        own = {"problem": problem, "errors": errors, "offsets": offsets, "terms": terms, "coefficients": coefficients}
        return SimpleNamespace(**left, **own)

    monkeypatch.setattr(stages, "evaluate", evaluate)
    monkeypatch.setattr(base_fit, "evaluate", evaluate)
    effect = SimpleNamespace(term=lambda rows, shape, motion: ("term", motion))
    problem = SimpleNamespace(nuisance=np.ones((2, 1)), rows=None, explanations={"tooth_mesh": effect})
    stages.guessed(GUESS, problem)
    for errors, _, _, _ in seen:
        np.testing.assert_array_equal(errors, GUESS.errors)
    errors, offsets, terms, coefficients = seen[-1]
    assert terms == [("term", "its motion")]
    assert offsets == pytest.approx([2.0])
    assert coefficients is GUESS.coefficients


def measured(sigma, inflation):
    return lambda fit: SimpleNamespace(noise=noise_of(sigma), inflation=inflation)


def test_the_noise_comes_with_its_roughness(monkeypatch):
    """Fault caught: the inflation of an earlier noise kept, in any of the stages that measure it."""
    monkeypatch.setattr(stages, "measure_noise", measured(0.5, 6.0))
    monkeypatch.setattr(stages, "fit_base", lambda problem, *rest, near: replace(near, problem=problem))
    monkeypatch.setattr(stages, "refine", lambda fit, iterations: fit)
    monkeypatch.setattr(stages, "fit_clean_base", lambda problem, rng: None)
    after = stages.fit_base_in_noise(state_of(Told("")))
    assert (after.inflation, after.problem.noise.sigma) == (6.0, 0.5)
    inflations = []

    def select(base, inflation, rng, plan):
        inflations.append(inflation)
        return selection_of(replace(base, terms=("a",)))

    monkeypatch.setattr(stages, "select", select)
    monkeypatch.setattr(stages, "on_problem", lambda fit, problem: replace(fit, problem=problem))
    found = state_of(Told(""), selection=selection_of(Told("", terms=("a",))))
    again = stages.measure_noise_again(found)
    assert (again.inflation, again.problem.noise.sigma, inflations) == (6.0, 0.5, [6.0])


def test_a_base_beside_waves_is_made_from_the_clean_one(monkeypatch):
    """With draws of its own: what comes after goes on as without it; and none where the base alone leaves no more than
    noise, whatever the smooth columns came to. Faults caught: no such base; none of its draws kept apart; six fits of
    waves on a record that holds none.
    """

    def beside_waves(smooth, rng):
        rng.normal()
        return f"waves beside {smooth}"

    monkeypatch.setattr(stages, "measure_noise", measured(0.5, 6.0))
    monkeypatch.setattr(stages, "fit_base", lambda problem, *rest, near: replace(near, problem=problem))
    monkeypatch.setattr(stages, "refine", lambda fit, iterations: fit)
    monkeypatch.setattr(stages, "fit_clean_base", lambda problem, rng: "the clean base")
    monkeypatch.setattr(stages, "beside_smooth", lambda clean: f"smooth columns of {clean}")
    monkeypatch.setattr(stages, "beside_waves", beside_waves)
    monkeypatch.setattr(stages, "is_left_wavy", lambda fit: False)
    assert stages.fit_base_in_noise(state_of(Told(""))).wavy is None
    monkeypatch.setattr(stages, "is_left_wavy", lambda fit: fit.name == "the base")
    after = stages.fit_base_in_noise(state_of(Told("the base")))
    assert after.wavy == "waves beside smooth columns of the clean base"
    assert after.draws().normal() == np.random.default_rng(5).normal()
    plan = replace(after, wavy=Told("wavy"))
    monkeypatch.setattr(stages, "leaders_on", lambda *about: ())
    monkeypatch.setattr(stages, "drive_with_terms", lambda fit, problem: (fit.name, problem is plan.problem))
    assert stages.plan_of(plan).wavy == ("wavy", True)
    assert stages.plan_of(plan).clean == "the clean base"


@pytest.fixture
def without_ripple(monkeypatch):
    """`of(effects before, effects after, power of the best, what is left at the ripple's drive)`: what was measured,
    the plan, the base it was for, the state after. From where they are all fits leave 1."""

    def of(before, after, size, there=2.0):
        seen = SimpleNamespace(measured=[], plans=[], again=0, bases=[])
        terms = tuple(SimpleNamespace(effect=name) for name in before)
        high = selection_of(Told("high", terms=("a ripple's term",)))
        first = Told("first", terms=terms)
        best = Told("best", terms=tuple(SimpleNamespace(effect=name) for name in after), contributions=(-size, size))

        def measure(fit):
            seen.measured.append(fit.name)
            return SimpleNamespace(noise=noise_of(0.5), inflation=6.0)

        def select(base, inflation, rng, plan):
            seen.plans.append(plan)
            seen.bases.append(base.name)
            return Selection(base, (Candidate(best, 0.0, 0.0),), inflation)

        def find(*about):
            seen.again += 1
            return high, None

        def at_drive_of(ripple, fits):
            assert ripple is high.best.fit
            return tuple(replace(one, name=f"{one.name} there", objective=there) for one in fits)

        def power_in_rows(adds, ripple, row):
            assert ripple is high.best.fit
            return float(np.var(adds))

        monkeypatch.setattr(stages, "subtract", lambda recordings, ripple: recordings)
        monkeypatch.setattr(stages, "row_of_each_sample", lambda recordings, neighbours: neighbours)
        monkeypatch.setattr(stages, "gather", lambda recordings, neighbours: SimpleNamespace(locked=False))
        monkeypatch.setattr(stages, "neighbours_for", lambda recordings: 1)
        monkeypatch.setattr(stages, "on_problem", lambda fit, problem: replace(fit, problem=problem))
        monkeypatch.setattr(stages, "measure_noise", measure)
        monkeypatch.setattr(stages, "select", select)
        monkeypatch.setattr(stages, "stands", lambda before, anew: False)
        for module in (stages, freed_of_ripple):
            monkeypatch.setattr(module, "at_drive_of", at_drive_of)
            monkeypatch.setattr(module, "refine", lambda fit, iterations: fit)
        monkeypatch.setattr(stages, "power_in_rows", power_in_rows)
        monkeypatch.setattr(stages, "without_effects_of", lambda ripple, fit: fit)
        monkeypatch.setattr(stages, "each_left_out", lambda ways: [Told(f"less than {one.name}") for one in ways])
        monkeypatch.setattr(stages, "find_ripple", find)
        monkeypatch.setattr(stages, "subtracted_terms", lambda base, power, terms: (power, terms))
        ripple = np.array([-2.0, 2.0])
        state = state_of(Told("base"), selection=Selection(first, (Candidate(first, 0.0, 0.0),), 1.0))
        seen.after = stages.search_without_ripple(replace(state, base=Told("base"), high=high, ripple=ripple))
        return seen

    return of


def test_freed_of_a_ripple_the_rest_is_searched_in_its_own_noise(without_ripple):
    """Faults caught: the noise measured with what was found still in it, its roughness kept from before, what was
    taken out forgotten."""
    seen = without_ripple(("hysteresis",), ("hysteresis",), 3.0)
    assert seen.measured == ["first"]
    assert seen.plans[0].subtracted == (4.0, ("a ripple's term",))
    assert seen.after.inflation == 6.0
    assert without_ripple((), (), 3.0).measured == ["base"]


def test_freed_of_a_ripple_the_search_knows_the_drive_beside_which_it_was_fitted(without_ripple):
    """Of both drives that which leaves less, for the base and for what the noise is measured beside; what is known, at
    both, and with one term less. Faults caught: one drive alone for either, the worse of them, no term less."""
    for there, name in ((2.0, ""), (0.5, " there")):
        seen = without_ripple(("hysteresis",), ("hysteresis",), 3.0, there)
        assert (seen.measured, seen.bases) == ([f"first{name}"], [f"base{name}"])
        assert [fit.name for fit in seen.plans[0].known] == [
            "first",
            "first there",
            "less than first",
            "less than first there",
        ]


def test_a_ripple_is_named_anew_where_what_stands_beside_it_is_another(without_ripple):
    """Its power is 4: what is beside it counts from a hundredth of that on."""
    assert without_ripple(("hysteresis",), ("hysteresis",), 3.0).again == 0
    assert without_ripple(("hysteresis",), ("thermal_drift",), 0.3).again == 1
    assert without_ripple(("hysteresis",), ("thermal_drift",), 0.1).again == 0


@pytest.fixture
def first(monkeypatch):
    """`of(errors, ...)`: the problem of the first fit of recordings of these errors."""

    def of(errors, hidden=(), taken=None, base="a base"):
        @dataclass(frozen=True)
        class Posed:
            rows: object
            base: object
            nuisance: object
            noise: object
            settings: object
            prior_scale: float = 1.0

        @dataclass(frozen=True)
        class Nuisances:
            hidden: tuple
            taken: object = None

            def columns(self, rows):
                return np.ones((len(rows.error), 1))

        rows = SimpleNamespace(error=np.asarray(errors, float))
        monkeypatch.setattr(stages, "gather", lambda recordings, neighbours: rows)
        monkeypatch.setattr(stages, "neighbours_for", lambda recordings: 1)
        monkeypatch.setattr(stages, "nuisances_for", lambda *about: Nuisances(hidden))
        monkeypatch.setattr(stages, "FitProblem", Posed)
        monkeypatch.setattr(stages, "Noise", SimpleNamespace(white=lambda rows, sigma=1.0: noise_of(sigma)))
        monkeypatch.setattr(stages, "fit_base", lambda problem, rng: Told("", problem=problem))
        return stages.first_fit((), base, np.random.default_rng(0), DEFAULT, (), taken)

    return of


def test_an_error_that_no_drive_of_its_kind_has_widens_the_prior(first):
    """Errors of 3 arcmin rms leave the prior as it is in use of up to `prior_arcmin`; ten times that widens it."""
    usual = DEFAULT.base.prior_arcmin
    assert first([-usual / 10, usual / 10]).problem.prior_scale == 1.0
    wide = first([-10 * usual, 10 * usual]).problem
    assert wide.prior_scale == pytest.approx(10.0)
    assert wide.noise.sigma == pytest.approx(DEFAULT.noise.first_share * 10 * usual)


def test_what_a_nuisance_takes_is_not_searched_for(first):
    """Faults caught: a drift that is free and found too, a slope that was taken out and comes back as a scale."""
    assert first([1.0, 2.0]).ruled_out == ()
    assert first([1.0, 2.0], hidden=("thermal_drift",)).ruled_out == ("thermal_drift",)
    assert stages.SCALE in first([1.0, 2.0], taken=TakenSlope(0.01, 4.0)).ruled_out
    assert set(first([1.0, 2.0], base=None).ruled_out) == set(stages.STRAIN_WAVE_ONLY)


def test_recordings_keep_their_zeros_among_each_other(monkeypatch):
    """One number is taken from all of them, the first's middle: what differs between them is kept."""
    monkeypatch.setattr(stages, "common_slope", lambda recordings, settings: None)
    monkeypatch.setattr(stages, "first_fit", lambda recordings, *rest: recordings)
    angle = np.linspace(0.0, 9.0, 3)
    errors = np.array([1.0, 2.0, 9.0]), np.array([11.0, 12.0, 13.0])
    one, two = stages.begin([Recording(str(k), 80.0, angle, error) for k, error in enumerate(errors)], None, 1, DEFAULT)
    np.testing.assert_allclose(one.error_arcmin, [-1.0, 0.0, 7.0])
    np.testing.assert_allclose(two.error_arcmin, [9.0, 10.0, 11.0])


@pytest.mark.parametrize(
    ("alone", "beside", "chosen"),
    [((9.0, 1.0), (9.0, 1.0), "input"), ((9.0, 1.0), (1.0, 9.0), "output"), ((1.0, 9.0), (9.0, 1.0), "output")],
)
def test_whether_the_input_is_off_is_asked_of_the_base_alone_and_beside_smooth_columns(
    monkeypatch, alone, beside, chosen
):
    """`alone` and `beside` smooth columns: what is left as output and as input. Faults caught: one of both asked, where
    a base alone is bent by physics that is not its own, and one beside smooth columns by waves of the teeth."""
    taken = TakenSlope(0.01, 4.0)
    monkeypatch.setattr(stages, "common_slope", lambda recordings, settings: taken)

    def fitted(recordings, base, rng, settings, nuisance, slope):
        return state_of(Told("output" if slope is taken else "input", alone[slope is not taken], Problem(slope)))

    def clean(problem, rng):
        return Told("output" if problem.noise is taken else "input", 1.0)

    monkeypatch.setattr(stages, "first_fit", fitted)
    monkeypatch.setattr(clean_base, "fit_clean_base", clean)
    monkeypatch.setattr(clean_base, "beside_smooth", lambda fit: replace(fit, objective=beside[fit.name == "input"]))
    angle = np.linspace(0.0, 9.0, 3)
    assert stages.begin([Recording("", 80.0, angle, angle)], "a base", 1, DEFAULT).base.name == chosen


@pytest.fixture
def smooth(monkeypatch):
    """Three smooth columns, of which the first is an order, and a sine: what `fit_clean_base` and `beside_smooth` have
    beside the base."""
    seen = []

    def evaluate(problem, errors, offsets, terms, coefficients):
        seen.append((problem, offsets))
        return SimpleNamespace(problem=problem, errors=errors, offsets=offsets, residual=np.array([2.0, 6.0]))

    def fit_base(problem, rng, starts):
        return SimpleNamespace(errors="errors", offsets=np.arange(1.0, 1.0 + problem.nuisance.shape[1]))

    columns = np.array([[10.0, 20.0, 30.0], [11.0, 21.0, 31.0]])
    domains = ["integer order", "time", "torque"]
    monkeypatch.setattr(clean_base, "generic_columns", lambda rows, settings: (columns, domains))
    monkeypatch.setattr(clean_base, "sine_columns", lambda theta, orders: np.array([[40.0], [41.0]]))
    monkeypatch.setattr(clean_base, "fit_base", fit_base)
    monkeypatch.setattr(clean_base, "evaluate", evaluate)
    monkeypatch.setattr(clean_base, "refine", lambda fit, iterations: fit)
    return seen


POSED = Problem(nuisance=np.ones((2, 1)), rows=SimpleNamespace(theta=np.zeros(2), locked=False))
BESIDE = [1.0, 20.0, 30.0, 40.0]


def test_a_clean_base_is_fitted_beside_what_is_not_its_own(smooth, monkeypatch):
    """Zero, time, torque and the first order; of whole orders the base itself is made. Looked at without them, the
    zero is the mean of what is left. Faults caught: the base's own orders beside it, the smooth columns' zero kept.
    """
    fitted = []
    own = clean_base.fit_base
    monkeypatch.setattr(clean_base, "fit_base", lambda problem, *rest: fitted.append(problem) or own(problem, *rest))
    fit = clean_base.fit_clean_base(POSED, np.random.default_rng(0))
    np.testing.assert_array_equal(fitted[0].nuisance[0], BESIDE)
    assert fit.problem is POSED
    assert fit.offsets == pytest.approx([1.0 + 4.0])
    assert clean_base.fit_clean_base(replace(POSED, base=None), np.random.default_rng(0)) is None


def test_beside_smooth_columns_it_has_them_again(smooth):
    clean = SimpleNamespace(problem=POSED, errors="errors", offsets=np.array([5.0]))
    fit = clean_base.beside_smooth(clean)
    np.testing.assert_array_equal(fit.problem.nuisance[0], BESIDE)
    np.testing.assert_array_equal(fit.offsets, [5.0, 0.0, 0.0, 0.0])


def test_a_ripple_is_told_where_one_was_found(monkeypatch):
    """Fault caught: what there is told as nothing, and nothing asked for its best."""
    monkeypatch.setattr(state_module, "guess_of", lambda fit, turned: (fit, turned))
    there = SimpleNamespace(
        high=SimpleNamespace(best=SimpleNamespace(fit="a ripple")), orientation=SimpleNamespace(turned=True)
    )
    assert State.ripple_as_guess(there) == ("a ripple", True)
    assert State.ripple_as_guess(SimpleNamespace(high=None)) is None
