"""A base beside waves of the teeth: the drive is found where a base alone is drawn to the end of its box."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from hdopt.diagnosis.inference import clean_base
from hdopt.diagnosis.inference.base_fit import fit_base
from hdopt.diagnosis.inference.clean_base import (
    WAVES_OF_TEETH,
    beside_smooth,
    beside_waves,
    drive_alone,
    fit_clean_base,
    is_left_wavy,
    long_waves,
)
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.search import subset_search
from hdopt.diagnosis.search.search_state import SearchPlan, SearchState
from hdopt.diagnosis.settings import DEFAULT
from hdopt.kinematics.cartesian import CartesianModel, to_cartesian
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather
from hdopt.study import load_study

RATIO, RATE, NOISE = 80.0, 48, 0.02
THETA = np.arange(40 * RATE) * 2 * np.pi / RATE
WAVES = np.array([0.0011, 0.0013, 0.0018, -0.0014])
"""Sine and cosine of the second and of the fifth wave of the flexspline, mm: as large as the drive's own errors."""


@cache
def recorded(waves):
    """Problem, true errors (12,) mm and the fit beside smooth columns of half an output turn under a torque that winds
    the drive up by 0.2 arcmin, with so much (`waves`) of the flexspline's waves, in white noise that is known.
    """
    study = load_study(drive="csf-25-80")
    base = CartesianModel.of(study.drive)
    truth = to_cartesian(study.errors, base.half_width)
    torque = 30.0 * np.sin(THETA / 11)
    table = {"input_angle_deg": np.degrees(THETA), "output_angle_deg": np.degrees(THETA / RATIO), "torque_Nm": torque}
    rows = gather([recording_from_table(pd.DataFrame(table), RATIO, name="record")])
    problem = FitProblem(rows, base, np.ones((len(rows), 1)), Noise.white(rows, NOISE))
    term = problem.explanations["fs_tooth_harmonics"].term(rows, {"members": (2, 5)})
    model = evaluate(problem, truth, np.zeros(1), [term], [waves * WAVES]).prediction
    error = model + 0.2 * torque / 30.0 + np.random.default_rng(3).normal(0, NOISE, len(rows))
    rows = gather(
        [
            recording_from_table(
                pd.DataFrame(table | {"output_angle_deg": np.degrees(THETA / RATIO) - error / 60}), RATIO, name="record"
            )
        ]
    )
    problem = FitProblem(rows, base, np.ones((len(rows), 1)), Noise.white(rows, NOISE))
    clean = fit_clean_base(problem, np.random.default_rng(1))
    return problem, truth, clean, beside_smooth(clean)


@cache
def wavy():
    """The base of the record with waves, beside waves."""
    return beside_waves(recorded(1.0)[3], np.random.default_rng(2))


def off(fit, truth):
    """By how much the drive of `fit` makes another error than the true one, arcmin rms about the mean."""
    problem = fit.problem
    value = [evaluate(problem, e, np.zeros(problem.nuisance.shape[1]), (), ()).base_value for e in (fit.errors, truth)]
    return float(np.std(value[0] - value[1]))


def test_beside_waves_the_drive_is_found_that_a_base_alone_misses():
    """The drive's own error has 0.36 arcmin rms. A clean base, bent by the waves, is off by a good part of that; beside
    them it is off by what 1,900 rows of noise leave of some forty coefficients: 0.02 sqrt(40/1920) = 0.003, three times
    which is allowed. Faults caught: no waves, the worst of them, waves without the smooth columns (the load stays).
    """
    problem, truth, clean, _ = recorded(1.0)
    assert off(clean, truth) > 0.05
    assert wavy().objective == pytest.approx(
        len(problem.rows) * NOISE**2, rel=0.1
    )  # 1,920 rows: 3 %, 60 coefficients 3
    assert off(drive_alone(wavy(), problem), truth) < 0.01


def test_of_waves_that_explain_alike_the_fewest_are_taken():
    """The fifth wave is the last: seven of the flexspline explain as much as its twenty-three, or as both splines'."""
    (term,) = wavy().terms
    assert (term.effect, term.width) == ("fs_tooth_harmonics", 14)
    assert (("fs_tooth_harmonics", 8),) in WAVES_OF_TEETH


def test_where_smooth_columns_leave_noise_no_waves_are_asked():
    """Nor of a gear that has no teeth in a model. Fault caught: half a minute of fits where none is needed."""
    _, truth, clean, smooth = recorded(0.0)
    assert off(clean, truth) < 0.01
    assert beside_waves(smooth, None) is None
    no_base = SimpleNamespace(base=None, settings=DEFAULT, noise=smooth.problem.noise)
    assert beside_waves(SimpleNamespace(problem=no_base), None) is None


@pytest.mark.parametrize(("left", "wavy"), [(1.2, False), (1.3, True), (2.0, True)])
def test_a_base_that_leaves_a_quarter_more_than_noise_may_be_wavy(left, wavy):
    """Fault caught: a limit of another size."""
    problem = SimpleNamespace(weighed_rows=100.0, noise=SimpleNamespace(sigma=0.5), settings=DEFAULT)
    assert is_left_wavy(SimpleNamespace(objective=left * 25.0, problem=problem)) is wavy


@pytest.mark.parametrize(
    ("rows_per_turn", "turns", "splines"),
    [(17, 10, ["fs", "cs"]), (17, 9, ["cs"]), (16, 10, []), (400, 40, ["fs", "cs"])],
)
def test_the_long_waves_are_those_of_each_spline_that_the_rows_hold(rows_per_turn, turns, splines):
    """Eight waves want more than sixteen rows a turn, those of the flexspline ten turns. Faults caught: waves that are
    folded; waves of both splines at once; the twenty-three that bend to anything."""
    problem = recorded(0.0)[0]
    rows = SimpleNamespace(rows_per_turn=rows_per_turn, span_turns=turns, ratio=RATIO)
    rows.highest_order = rows_per_turn / 2
    problem = SimpleNamespace(base=problem.base, rows=rows, explanations=problem.explanations)
    found = [(term.effect, term.shape["members"]) for term in long_waves(problem)]
    assert found == [(f"{spline}_tooth_harmonics", (2, 3, 4, 5, 6, 7, 8)) for spline in splines]
    assert long_waves(SimpleNamespace(**vars(problem) | {"base": None})) == []


def test_waves_that_take_up_little_are_not_the_teeths(monkeypatch):
    """A sine at a foreign order, twenty times the noise, beside waves of a few times it: these pay for their freedom,
    but no wave of the teeth explains the sine. Faults caught: a search about a base that was bent to it; fewer waves
    fitted where all of them leave most of it.
    """
    _, _, _, smooth = recorded(0.2)
    problem = smooth.problem
    added = 0.4 * np.sin(9.37 * THETA)
    rows = replace(problem.rows, error=problem.rows.error + added)
    other = replace(
        smooth, problem=replace(problem, rows=rows), objective=float(np.sum((smooth.residual + added) ** 2))
    )
    assert other.objective > DEFAULT.base.wavy * len(rows) * NOISE**2
    fitted = []
    monkeypatch.setattr(clean_base, "fit_base", lambda *about, **more: fitted.append(more) or fit_base(*about, **more))
    assert beside_waves(other, np.random.default_rng(2)) is None
    ((flex, circular),) = (more["terms"] for more in fitted)
    assert flex.width == circular.width == 2 * (8 - 1)  # 48 rows a turn hold no 24 waves


def test_a_search_goes_about_the_base_beside_waves_with_draws_of_its_own(monkeypatch):
    """Once without the waves, once beside them. Faults caught: the base beside waves left out of the first look; what
    is smaller than the waves looked for without them alone; a search that goes on otherwise for it.
    """
    centres = []

    def explore(state, centre, pool, afresh=False):
        centres.append((centre, pool))
        state.rng.normal()
        return state

    monkeypatch.setattr(subset_search, "explore", explore)
    monkeypatch.setattr(SearchState, "probe", lambda state, fit, keep=None: f"probe of {fit}")
    monkeypatch.setattr(SearchState, "terms_for", lambda state, probe, *others: [f"terms for {probe}", *others])
    monkeypatch.setattr(subset_search, "drive_alone", lambda fit, problem: f"drive on {problem}")
    rng = np.random.default_rng(4)
    wave = SimpleNamespace(effect="waves")
    wavy = SimpleNamespace(terms=(wave,))
    state = SearchState(SimpleNamespace(problem="its rows"), SearchPlan(wavy=wavy), 1.0, rng)
    after = subset_search.about_wavy_base(state)
    alone = ("drive on its rows", ["terms for probe of drive on its rows"])
    assert centres == [alone, (wavy, [wave, f"terms for probe of {wavy}", "waves"])]
    assert after.rng is rng and rng.normal() == np.random.default_rng(4).normal()
    without = SearchState("base", SearchPlan(), 1.0, rng)
    assert subset_search.about_wavy_base(without) is without
