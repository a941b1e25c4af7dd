"""An effect that is the same each time it is met, and pulses that come and go."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hdopt.diagnosis.checks.cyclostationarity import NOWHERE
from hdopt.diagnosis.checks.slow_wander import SlowWave
from hdopt.diagnosis.checks.step_detection import Steps
from hdopt.diagnosis.checks.turn_by_turn import from_turn_to_turn
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.orientation import AS_COUNTED
from hdopt.diagnosis.search.candidates import joint_fit
from hdopt.diagnosis.settings import DEFAULT
from hdopt.diagnosis.verdict import residual_structure
from hdopt.effects import EFFECTS
from hdopt.effects.conditions import TURN
from hdopt.effects.local_tooth_defect import Seat
from hdopt.recordings.rows import gather
from hdopt.study import load_study
from tests.unit.test_diagnosis import bench

NOISE = 0.02
PLACE, WIDTH_DEG = 2.0, 8.0
SHAPE = {"centre": PLACE, "width_deg": WIDTH_DEG, "on": Seat.CIRCULAR_SPLINE_ONCE}


def fitted(height_of_turn, noise=NOISE, turns=40, output=0.0):
    """One damaged tooth, at one angle, fitted to pulses with a height of each turn (a function of the turns' numbers),
    arcmin, that follows the output by a share `output`; a gear without a base."""

    samples = gather(bench(load_study(drive="csf-25-80"), turns=turns))
    theta = samples.theta
    turn = np.floor((theta - PLACE + np.pi) / TURN).astype(int)
    height = height_of_turn(turn - turn.min()) * (1 + output * np.sin(theta / 10))
    away = np.mod(theta - PLACE + np.pi, TURN) - np.pi
    error = height * np.exp(-0.5 * (away / np.radians(WIDTH_DEG)) ** 2)
    error += np.random.default_rng(3).normal(0, noise, len(samples))
    rows = replace(samples, error=error)
    problem = FitProblem(rows, None, np.ones((len(rows), 1)), Noise.white(rows, noise))
    start = evaluate(problem, np.zeros(0), np.zeros(1), (), ())
    return joint_fit(start, [replace(EFFECTS["local_tooth_defect"].term(rows, SHAPE), steps={})])


def at_random(share):
    """A height of 0.3 arcmin in about a `share` of the turns, none in the others."""
    return lambda turn: 0.3 * (np.random.default_rng(5).random(turn.max() + 1) < share)[turn]


def test_a_tooth_is_as_high_in_every_turn():
    """Of noise alone t is 0 to 1, its own standard deviation; three of which is allowed."""
    found = from_turn_to_turn(fitted(lambda turn: 0.3), 0)
    assert abs(found.t) < 3
    assert found.spread < 0.1


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_pulses_that_come_and_go_differ_by_their_chance(share):
    """With n of N turns the spread is ((N - n)/n)^(1/2); differences of 40 turns know it to a fifth or so. Faults
    caught: over the noise in place of the mean size; the variance of a difference taken for that of a turn."""
    there = np.random.default_rng(5).random(100) < share
    found = from_turn_to_turn(fitted(at_random(share), turns=100), 0)
    n = np.count_nonzero(there)
    assert found.spread == pytest.approx(np.sqrt((100 - n) / n), rel=0.2)
    assert found.t > 50


def test_what_follows_the_output_slowly_is_the_drives_own():
    """A height that follows the output by four tenths, over ten turns and more: from one turn to the next a tenth of
    that. Fault caught: the scatter over all turns, by which a tooth that both zones share came and went."""
    found = from_turn_to_turn(fitted(lambda turn: 0.3, output=0.4), 0)
    assert found.spread < 0.15
    assert found.spread < DEFAULT.verdict.spread_over_turns


def test_little_in_much_noise_is_no_spread_that_counts():
    """The noise of a turn's factor is larger than the factor: beyond the noise little is left, and t says so."""
    found = from_turn_to_turn(fitted(lambda turn: 0.01, noise=0.2), 0)
    assert abs(found.t) < 3


def test_of_too_few_turns_nothing_is_said():
    fit = fitted(lambda turn: 0.3, turns=1)
    fit = replace(fit, problem=replace(fit.problem, rows=replace(fit.problem.rows, block=0 * fit.problem.rows.block)))
    assert from_turn_to_turn(fit, 0).t == 0.0


def evidence(fit, noise=NOISE):
    best = SimpleNamespace(fit=fit, effects=tuple(term.effect for term in fit.terms))
    return SimpleNamespace(
        settings=DEFAULT,
        selection=SimpleNamespace(best=best, base=fit),
        base_held_out=SimpleNamespace(variance=0.01),
        extended_held_out=SimpleNamespace(variance=0.001),
        neighbours_arcmin=noise,
        sensor_arcmin=0.0,
        sensors_noise=noise,
        rows=SimpleNamespace(output_step=0.0),
        wave=None,
        steps=Steps(np.zeros(0, int), 0.0),
        arising=NOWHERE,
        orientation=AS_COUNTED,
    )


def seen_at(rms):
    """Noise between neighbours, arcmin, in which `rms` is as much as sensors resolve."""
    return rms / DEFAULT.verdict.sensor_resolution


def test_what_is_below_the_resolution_comes_and_goes_unsaid():
    """Would catch a clean recording of 600,000 rows called unknown for a pulse of 0.0002 arcmin that comes and goes."""
    fit = fitted(at_random(0.4))
    rms = residual_structure.comes_and_goes(evidence(fit))["rms_arcmin"]
    assert residual_structure.comes_and_goes(evidence(fit, seen_at(0.9 * rms))) is not None
    assert residual_structure.comes_and_goes(evidence(fit, seen_at(1.1 * rms))) is None
    assert residual_structure.unsteady(evidence(fit, seen_at(1.1 * rms))) is None


@pytest.mark.parametrize("what", ["wave", "steps"])
def test_what_is_below_the_resolution_does_not_change_in_time(what):
    fit, rms = fitted(lambda turn: 0.3), 0.1
    found = {"wave": SlowWave(30.0, rms), "steps": Steps(np.arange(3), rms)}[what]
    for share, said in ((0.9, True), (1.1, False)):
        seen = evidence(fit, seen_at(share * rms))
        setattr(seen, what, found)
        assert (residual_structure.unsteady(seen) is not None) == said


def test_what_is_below_the_resolution_did_not_happen():
    fit = fitted(lambda turn: 0.3)
    rms = float(np.std(fit.contribution(0)))
    for share, said in ((0.9, True), (1.1, False)):
        seen = evidence(fit, seen_at(share * rms))
        seen.selection.best.effects = ("_jump",)
        seen.selection.best.log_bayes_factor = 1e6
        assert residual_structure.momentary(seen) == said


def test_pulses_that_come_and_go_are_unsteady():
    """Located where the tooth would be. Faults caught: named a damaged tooth at 0.97, as in two registered runs."""
    where = residual_structure.comes_and_goes(evidence(fitted(at_random(0.4))))
    assert where["domain"] == "angle"
    assert where["rms_arcmin"] > 0.01
    assert residual_structure.unsteady(evidence(fitted(at_random(0.4)))) == where
    spread = from_turn_to_turn(fitted(at_random(0.4)), 0).spread
    assert where["spread_over_turns"] == spread
    assert f"comes and goes: its size differs by {spread:.2g} of its mean" in residual_structure.in_what_way(where)
    assert residual_structure.comes_and_goes(evidence(fitted(lambda turn: 0.3))) is None


def test_only_what_is_the_same_each_time_is_asked(monkeypatch):
    monkeypatch.setattr(type(EFFECTS["local_tooth_defect"]), "same_each_time", False)
    assert residual_structure.comes_and_goes(evidence(fitted(at_random(0.4)))) is None
    assert {effect.id for effect in EFFECTS.values() if effect.same_each_time} == set()


def test_a_damaged_tooth_is_the_same_each_time():
    assert [effect.id for effect in EFFECTS.values() if effect.same_each_time] == ["local_tooth_defect"]
