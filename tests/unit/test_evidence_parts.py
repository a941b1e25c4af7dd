"""What a verdict's evidence is put together from, with fits that are told what they leave: which of them is asked."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from hdopt.diagnosis import nested
from hdopt.diagnosis.checks import assessment
from hdopt.diagnosis.search.candidates import Candidate
from hdopt.diagnosis.search.subset_search import Selection
from hdopt.diagnosis.settings import DEFAULT
from hdopt.effects import EFFECTS, HIGH_ORDER


def told(name, **more):
    return SimpleNamespace(name=name, variance=more.pop("variance", 1.0), **more)


@pytest.fixture
def assessed(monkeypatch):
    """The evidence where every part says which fit it was asked of. `scored` is the best score of the pool, `found`
    the log Bayes factor of the best set, `floor` what the basis leaves beside it."""

    def of(scored=3.0, found=50.0, floor=0.25, alone=False, ripple=None):
        problem = SimpleNamespace(base="a base", settings=DEFAULT, rows="rows")
        base = told("base", problem=problem, residual="residual of base")
        best = base if alone else told("best", problem=problem, residual="residual of best")
        seen = SimpleNamespace(flips=[])

        def chance(probe, score, rng, observed, most):
            seen.observed, seen.most = observed, most
            return 0.004

        answers = {
            "turn_folds": lambda fit, rng: f"folds of {fit.name}",
            "held_out": lambda fit, columns, folds: told(f"{fit.name} beside {columns}, {folds}"),
            "look_at_remainder": lambda fit, folds, inflation: told(
                f"remainder of {fit.name}", held_out=told("generic", variance=floor)
            ),
            "useful_columns": lambda probe, inflation: (f"columns for {probe.name} at {inflation:g}", ()),
            "FitProbe": lambda fit: told(fit.name, on=lambda residual: residual),
            "search_terms": lambda probe, skip: f"pool of {probe.name} without {skip}",
            "penalty_scale": lambda problem, inflation: inflation,
            "best_score": lambda probe, pool, scale: scored,
            "best_placebo": lambda probe, pool, fit: told(f"beside {fit.name}", effect="thermal_drift"),
            "placebo_error": lambda probe, placebo, folds: told(f"{placebo.name} on {probe.name}, {folds}"),
            "across_conditions": lambda one, two: (one.name, two.name),
            "false_alarm_chance": chance,
            "most_flips": lambda one, two, settings: (one.name, two.name),
            "lacking_effects": lambda state, strange: {},
            "detection_limits": lambda probe, pool, scale: (probe.name, pool, scale),
            "sudden_steps": lambda fit: f"steps of {fit.name}",
            "slow_wave": lambda fit: f"wave of {fit.name}",
            "arising_at_an_angle": lambda fit: f"angles of {fit.name}",
            "without_ripple": lambda state: state.recordings,
            "noise_between_neighbours": lambda recordings: 0.01,
            "fitted_scale": lambda fit, nuisances: f"scale of {fit.name}",
            "repeated_passes": lambda fit: f"passes of {fit.name}",
            "other_law": lambda fit, inflation: f"law beside {fit.name} at {inflation}",
        }
        for name, answer in answers.items():
            monkeypatch.setattr(assessment, name, answer)
        selection = Selection(base, (Candidate(best, found, 1.0), Candidate(base, 0.0, 0.0)), 2.0)
        state = SimpleNamespace(
            draws=lambda: None,
            selection=selection,
            inflation=2.0,
            ruled_out=("bearing_pass",),
            problem=problem,
            high=None,
            nuisances=None,
            orientation=None,
            recordings=[SimpleNamespace(quantum_arcmin=step) for step in (0.1, 0.4, 0.2)],
            ripple=ripple,
        )
        return assessment.assess(state), seen

    return of


def test_every_part_of_the_evidence_is_asked_of_its_own_fit(assessed):
    """Faults caught: base and best exchanged in any of them, folds of different turns, the generic basis beside the
    best set instead of the base, limits of detection of what the base leaves, the finest of the sensors."""
    evidence, _ = assessed()
    folds = "folds of base"
    assert evidence.base_held_out.name == f"base beside None, {folds}"
    assert evidence.extended_held_out.name == f"best beside None, {folds}"
    assert evidence.generic_held_out.name == f"base beside columns for base at 2, {folds}"
    assert (evidence.placebo, evidence.placebo_held_out.name) == ("thermal_drift", f"beside best on base, {folds}")
    assert evidence.remainder.name == "remainder of best"
    assert evidence.across_conditions == ("base", "best")
    assert evidence.below_detection == ("best", "pool of base without ('bearing_pass',)", 2.0)
    assert evidence.steps == "steps of best"
    assert evidence.wave == "wave of best"
    assert evidence.arising == "angles of best"
    assert evidence.scale == "scale of best"
    assert evidence.passes == "passes of best"
    assert evidence.other_law == "law beside best at 2.0"
    assert evidence.sensor_arcmin == 0.4
    assert evidence.false_alarm_p == 0.004


def test_the_drive_alone_is_asked_with_the_ripple(assessed, monkeypatch):
    """Fault caught: a ripple at the teeth is taken out of the drive alone too, so that the fit does not show what was
    named: 0.0289 arcmin with and without a mesh that left 0.09."""
    monkeypatch.setattr(assessment, "with_the_ripple", lambda state: SimpleNamespace(name="base on all rows"))
    evidence, _ = assessed()
    assert evidence.drive_alone is evidence.base_held_out
    evidence, _ = assessed(ripple=np.ones(3))
    assert evidence.drive_alone.name == "base on all rows beside None, folds of base"
    assert evidence.base_held_out.name == "base beside None, folds of base"


def test_the_chance_is_that_of_the_best_of_all(assessed):
    """Of the pool's best score and of what was found together. Fault caught: either alone."""
    assert assessed(3.0, 50.0)[1].observed == 50.0
    assert assessed(60.0, 50.0)[1].observed == 60.0
    assert assessed(3.0, 50.0, alone=True)[1].observed == 3.0


def test_the_floor_is_the_rms_of_what_the_better_leaves(assessed):
    assert assessed(floor=0.25)[0].noise_floor == pytest.approx(0.5)
    assert assessed(floor=9.0)[0].noise_floor == pytest.approx(1.0)


def test_what_a_recording_lacks_says_each_effect_itself(monkeypatch):
    """What needs the drive's model is lacking without one, whatever is recorded; what only needs more rows a turn was
    looked for on the rows as recorded, where these were searched."""
    rows, raw = "averaged", "as recorded"
    monkeypatch.setattr(assessment, "EFFECTS", {name: lacking_by(name) for name in ("hysteresis", "lobing", "mesh")})
    monkeypatch.setattr(assessment, "HIGH_ORDER", ("mesh",))

    def of(base, high, strange=(), hidden=()):
        searched = None if not high else SimpleNamespace(base=SimpleNamespace(problem=SimpleNamespace(rows=raw)))
        problem = SimpleNamespace(base=base, rows=rows)
        state = SimpleNamespace(problem=problem, high=searched, nuisances=SimpleNamespace(hidden=hidden))
        return assessment.lacking_effects(state, strange)

    assert of("a base", high=False) == {"mesh": "more rows"}
    assert of("a base", high=True) == {}
    assert of(None, high=True) == {"lobing": "a harmonic-drive model (--drive)"}
    assert set(of("a base", high=True, strange=("odd",), hidden=("drift",))) == {"odd", "drift"}


def lacking_by(name):
    """An effect that needs the model where it is called lobing, and more rows than averages have where it is mesh."""
    return SimpleNamespace(
        id=name,
        needs_base=name == "lobing",
        lacks=lambda rows: "more rows" if name == "mesh" and rows == "averaged" else None,
    )


def test_the_catalogue_has_effects_of_high_order():
    """What the test above takes for granted."""
    assert HIGH_ORDER
    assert set(HIGH_ORDER) < set(EFFECTS)


def test_a_domain_gains_what_its_own_columns_take_away(monkeypatch):
    """Held-out variances: 9 beside nothing, 4 beside all, 8 beside the order, 5 beside the two of time. Faults caught:
    gains with the other sign, each domain given the gain of all."""
    variances = {0: 9.0, 3: 4.0, 1: 8.0, 2: 5.0}

    def held_out(fit, columns, folds):
        return SimpleNamespace(variance=variances[0 if columns is None else columns.shape[1]], white="white")

    problem = SimpleNamespace(settings=DEFAULT, rows=SimpleNamespace(locked=True))
    monkeypatch.setattr(assessment, "FitProbe", lambda fit: None)
    monkeypatch.setattr(assessment, "useful_columns", lambda *about: (np.zeros((5, 3)), ["time", "order", "time"]))
    monkeypatch.setattr(assessment, "held_out", held_out)
    monkeypatch.setattr(assessment, "paired_t", lambda *about: 0.0)
    found = assessment.look_at_remainder(SimpleNamespace(problem=problem), None, 1.0)
    assert found.domains == {"time": 4.0, "order": 1.0}
    assert found.held_out.variance == 4.0


@pytest.fixture
def hidden(monkeypatch):
    """The nested figure of rows of which one was hidden, one half and two not at all; what was left out of the last
    fit. The base leaves ten times what the best does."""
    left_out = []

    def refitted(fit, rows, mask, state):
        left_out.append(mask.tolist())
        problem = SimpleNamespace(rows=SimpleNamespace(block=np.array([0, 1, 1, 2])))
        return SimpleNamespace(residual=fit.size * np.array([100.0, -3.0, 10.0, 4.0]), problem=problem)

    def fit(size, *effects):
        return SimpleNamespace(size=size, terms=[SimpleNamespace(effect=name, freedom=2) for name in effects])

    base, best = fit(10.0), fit(1.0, "hysteresis")
    found = SimpleNamespace(best=SimpleNamespace(fit=best), base=base)
    high = SimpleNamespace(best=SimpleNamespace(fit=fit(1.0, "tooth_mesh")))
    state = SimpleNamespace(
        ripple=None,
        selection=found,
        high=high,
        recordings=(),
        as_guesses=lambda: ("a guess",),
        ripple_as_guess=lambda: "a ripple",
    )
    monkeypatch.setattr(nested, "hidden_samples", lambda *about: ("mask",))
    monkeypatch.setattr(nested, "without_samples", lambda recordings, mask: recordings)
    monkeypatch.setattr(nested, "as_seen", lambda *about: ())
    monkeypatch.setattr(nested, "ripple_of", lambda *about: None)
    monkeypatch.setattr(nested, "subtract", lambda *about: None)
    monkeypatch.setattr(nested, "gather", lambda *about: SimpleNamespace(block=np.array([0, 1, 1, 2])))
    monkeypatch.setattr(nested, "neighbours_for", lambda recordings: 3)
    monkeypatch.setattr(nested, "shares_of_samples", lambda *about: np.array([0.0, 1.0, 0.5, 1.0]))
    monkeypatch.setattr(nested, "refitted", refitted)
    return nested.diagnosis_of_a_part((), lambda recordings: state, 1, DEFAULT), left_out


def test_a_row_with_hidden_samples_is_neither_fitted_nor_judged(hidden):
    """A row that is the mean of hidden samples and others has seen both. Faults caught: it takes part in the last fit,
    or in the figure; base and best exchanged; the mean error in place of its rms."""
    part, left_out = hidden
    figure = part.held_out
    assert left_out == [[False, True, True, True]] * 2
    assert figure.extended == pytest.approx(np.sqrt((9 + 16) / 2))
    assert figure.base == pytest.approx(10 * np.sqrt((9 + 16) / 2))
    assert figure.turns == 2


def test_a_nested_run_tells_all_that_it_found(hidden):
    part, _ = hidden
    assert part.held_out.effects == ("hysteresis", "tooth_mesh")
    assert part.freedom == 4
    assert (part.guesses, part.ripple) == (("a guess",), "a ripple")
