"""Noise that arises at one angle of the input, and what is no such noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hdopt.diagnosis.checks.cyclostationarity import NOWHERE, ArisingAtAnAngle, arising_at_an_angle
from hdopt.diagnosis.inference import noise as noise_model
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.orientation import Orientation
from hdopt.diagnosis.settings import DEFAULT
from hdopt.diagnosis.verdict import residual_structure
from hdopt.effects.conditions import TURN
from hdopt.recordings.rows import gather
from hdopt.study import load_study
from tests.unit.test_diagnosis import bench
from tests.unit.test_turn_by_turn import evidence, seen_at

NOISE = 0.02
PLACE_DEG = 123.0
FORWARD = gather(bench(load_study(drive="csf-25-80"), turns=40))
TURN_OF = np.floor((FORWARD.theta - np.radians(PLACE_DEG)) / TURN).astype(int)
TURN_OF = TURN_OF - TURN_OF.min()


def left_by(signal, samples=FORWARD):
    """What a fit of an offset leaves of a `signal` (n,) beside noise, in noise of its own colour; no base."""
    error = signal + np.random.default_rng(3).normal(0, NOISE, len(samples))
    rows = replace(samples, error=error)
    problem = FitProblem(rows, None, np.ones((len(rows), 1)), Noise.white(rows, NOISE))
    bare = evaluate(problem, np.zeros(0), np.array([error.mean()]), (), ())
    noise = noise_model.estimate(rows, bare.residual)
    return evaluate(problem.with_noise(noise), np.zeros(0), bare.offsets, (), ())


def slips(size):
    """A new level each turn, drawn anew, from one angle on."""
    return np.random.default_rng(5).normal(0, size, TURN_OF.max() + 1)[TURN_OF]


def pulses(size):
    """A pulse of random height each turn at that angle."""
    away = np.mod(FORWARD.theta - np.radians(PLACE_DEG) + np.pi, TURN) - np.pi
    height = np.random.default_rng(6).normal(0, size, TURN_OF.max() + 2)
    return height[np.round((FORWARD.theta - np.radians(PLACE_DEG)) / TURN).astype(int) - TURN_OF.min()] * np.exp(
        -0.5 * (away / 0.1) ** 2
    )


@pytest.mark.parametrize("signal", [slips(0.1), pulses(0.2)], ids=["slips", "pulses"])
def test_what_is_new_each_turn_is_found_at_its_angle(signal):
    """Within an angle of the place. Faults caught: angles counted from elsewhere or backwards; the power of the whole
    residual, which a slip changes at every angle, in place of what is new; a difference in place of a ratio."""
    found = arising_at_an_angle(left_by(signal))
    away = (np.degrees(found.angle) - PLACE_DEG + 180) % 360 - 180
    assert abs(away) < 360 / DEFAULT.cyclic.angles
    assert found.chance < DEFAULT.verdict.remainder_chance
    assert found.over_elsewhere > DEFAULT.cyclic.over_elsewhere
    assert 0 < found.rms < np.hypot(np.std(signal), NOISE)


def coloured():
    walk = np.cumsum(np.random.default_rng(7).normal(0, 0.01, len(FORWARD)))
    return walk - walk.mean()


def once():
    """One turn with a large pulse."""
    return 2.0 * np.exp(-0.5 * ((FORWARD.theta - FORWARD.theta.mean()) / 0.05) ** 2)


def louder_and_louder():
    return np.random.default_rng(8).normal(0, 0.2, len(FORWARD)) * np.linspace(0, 1, len(FORWARD)) ** 3


@pytest.mark.parametrize("signal", [np.zeros(len(FORWARD)), coloured(), once(), louder_and_louder()])
def test_noise_of_every_angle_arises_nowhere(signal):
    """White noise, a walk, one event, noise that grows: none has an angle. Faults caught: t of the powers, to which one
    event is all there is; no t at all."""
    found = arising_at_an_angle(left_by(signal))
    assert found.chance > 10 * DEFAULT.verdict.remainder_chance


def test_on_noise_alone_the_chance_is_one():
    """Of 300 records of noise with long tails none is below 1e-3, and as many below any chance as it says, or fewer:
    the angles are asked together. Faults caught: the loudest of 36 angles taken for the only one asked (a hundred below
    0.3), a variance of the ranks that is too small."""
    rows = replace(FORWARD, error=np.zeros(len(FORWARD)))
    problem = FitProblem(rows, None, np.ones((len(rows), 1)), Noise.white(rows, NOISE))
    rng = np.random.default_rng(11)

    def asked_of(error):
        own = replace(problem, rows=replace(rows, error=error))
        return arising_at_an_angle(evaluate(own, np.zeros(0), np.zeros(1), (), ()))

    found = [asked_of(rng.standard_t(4, len(FORWARD))).chance for _ in range(300)]
    assert min(found) > DEFAULT.verdict.remainder_chance
    for chance in (0.01, 0.03, 0.1, 0.3):
        # Three standard errors of a share of 300.
        assert np.mean(np.array(found) < chance) < chance + 3 * np.sqrt(chance * (1 - chance) / 300)


def test_a_wave_that_comes_again_each_turn_is_no_noise():
    """A second order left by a fit is foretold by the rows before and as large at many angles."""
    assert arising_at_an_angle(left_by(0.1 * np.sin(2 * FORWARD.theta))).over_elsewhere < DEFAULT.cyclic.over_elsewhere


@pytest.mark.parametrize(
    "change",
    [
        {"locked": True},
        {"output_step": 0.05},
        {"theta": FORWARD.theta * 3},
    ],
    ids=["locked", "coarse output encoder", "33 rows a turn"],
)
def test_angles_are_not_told_where_rows_cannot(change):
    assert arising_at_an_angle(left_by(slips(0.1), replace(FORWARD, **change))) == NOWHERE


def test_rows_without_a_past_do_not_count():
    """Rows of no weight are no measurement: a fit whose every tenth row has none finds the same."""
    fit = left_by(slips(0.1))
    weight = np.where(np.arange(len(FORWARD)) % 10 == 0, 0.0, fit.problem.noise.root_weight)
    lighter = replace(fit, problem=fit.problem.with_noise(replace(fit.problem.noise, root_weight=weight)))
    assert arising_at_an_angle(lighter).over_elsewhere == pytest.approx(
        arising_at_an_angle(fit).over_elsewhere, rel=0.5
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({}, True),
        ({"chance": 1.1e-3}, False),
        ({"over_elsewhere": 2.4}, False),
        ({"rms": 0.003}, False),
    ],
)
def test_clear_and_large_and_much_louder_than_elsewhere(change, said):
    """None of the three may be wanting: a chance below 1e-3, 2.5 times the usual power, more than a sensor resolves."""
    clear = ArisingAtAnAngle(rms=0.05, angle=np.radians(PLACE_DEG), over_elsewhere=2.6, chance=0.9e-3)
    found = replace(clear, **change)
    seen = evidence(left_by(np.zeros(len(FORWARD))), seen_at(0.004))
    seen.arising = found
    where = residual_structure.arises_at_an_angle(seen)
    assert (where is not None) == said
    assert residual_structure.unsteady(seen) == where
    if said:
        assert where["domain"] == "angle" and where["rms_arcmin"] == found.rms
        seen.extended_held_out.variance = 0.05**2 + 0.12**2
        seen.sensors_noise = 0.05
        assert residual_structure.arises_at_an_angle(seen)["rms_arcmin"] == pytest.approx(0.12)
        assert where["input_angle_deg"] == pytest.approx(PLACE_DEG)
        assert residual_structure.in_what_way(where) == ", new each turn and always at 123 deg of the input"


def test_the_angle_is_that_of_the_recording_as_given():
    """Of a recording that was fitted with its angles turned round 237 deg are 123. Fault caught: the angle at which
    the hub is not, told to who marks it."""
    seen = evidence(left_by(np.zeros(len(FORWARD))), seen_at(0.004))
    seen.arising = ArisingAtAnAngle(rms=0.05, angle=np.radians(360 - PLACE_DEG), over_elsewhere=9.0, chance=1e-9)
    seen.orientation = Orientation(input=-1, output=-1, decided_by="data")
    assert residual_structure.arises_at_an_angle(seen)["input_angle_deg"] == pytest.approx(PLACE_DEG)
