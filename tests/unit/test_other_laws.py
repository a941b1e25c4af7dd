"""Whether what looks like a delay grows with the speed itself, or with another power of it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from hdopt.diagnosis.checks.other_laws import OtherLaw, laws_of, other_law
from hdopt.diagnosis.inference.fit import evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.search.candidates import joint_fit
from hdopt.diagnosis.settings import DEFAULT
from hdopt.diagnosis.stages import begin
from hdopt.diagnosis.verdict import rules
from hdopt.drive.geometry import ARCMIN
from hdopt.effects import EFFECTS
from hdopt.effects._direction_laws import columns_by_direction
from hdopt.effects._friction_law import Law
from hdopt.effects._speed_laws import weights_by_speed
from hdopt.effects._time_laws import columns_growing, part_gone_by, weights_by_time
from hdopt.effects.declared import Shaft
from hdopt.effects.resonance import Foot
from hdopt.effects.term import Term
from hdopt.kinematics.cartesian import CartesianModel
from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.recordings.read import recording_from_table
from hdopt.study import load_study
from tests.unit.test_diagnosis import bench

DELAY = EFFECTS["channel_delay"]


def recorded(power, speeds=(0.5, 1.0), size=0.15):
    """The fit of a delay to a record forward and back at each of the `speeds`, rad/s, in which an offset of `size`
    (arcmin at 1 rad/s), odd in direction, grows with a `power` of the speed.
    """
    study = load_study(drive="csf-25-80")
    records = bench(
        study,
        lambda motion: size * np.sign(motion["speed"]) * np.abs(motion["speed"]) ** power,
        turns=20,
        rate=60,
        speeds=speeds,
    )
    state = begin(records, CartesianModel.of(study.drive), 1, DEFAULT)
    return joint_fit(state.base, [DELAY.term(state.problem.rows, {})])


@pytest.mark.parametrize("power", [0.5, 2.0])
def test_another_power_of_the_speed_is_another_law(power):
    """At half the speed a delay makes half the offset, a root 0.71 of it, a square 0.25: by 2,400 rows of noise of
    0.02 arcmin that is hundreds in log evidence. Faults caught: not asked; asked of the residual alone, in which a
    delay was fitted already."""
    found = other_law(recorded(power), 1.0)
    assert found.index == 0
    assert found.log_evidence > 5 * DEFAULT.verdict.other_law


def test_a_delay_follows_its_own_law():
    """And of one speed every power is the same, so that none is better; rounding and the turns at a reversal leave less
    than one in log evidence."""
    assert other_law(recorded(1.0), 1.0).log_evidence < 1.0
    assert other_law(recorded(0.5, speeds=(1.0,)), 1.0).log_evidence < 1.0


def test_a_law_is_asked_in_place_of_the_effects_own():
    """A power of 1.4 lies nearer to a delay's than to a square: in place of the delay the square is no better. Fault
    caught: asked beside the delay, where it takes up what the delay leaves."""
    assert other_law(recorded(1.4), 1.0).log_evidence < 1.0


def shifted(effect, shape, law, speeds=(0.5, 1.0)):
    """The fit of `effect` at `shape` to records in which the two directions lie apart by a `law` of the speed."""
    study = load_study(drive="csf-25-80")
    records = bench(
        study, lambda motion: 0.15 * motion["direction"] * law(abs(motion["speed"])), turns=20, rate=60, speeds=speeds
    )
    state = begin(records, CartesianModel.of(study.drive), 1, DEFAULT)
    return joint_fit(state.base, [EFFECTS[effect].term(state.problem.rows, shape)])


def test_the_laws_of_drag_at_half_the_largest_speed():
    """One over its root, its root, and what fades within a quarter and a half of it; by the size of the speed alone."""
    speed = np.tile([2.0, -1.0, 1.0, -2.0], 10)
    half = [float(weight[1]) for weight in weights_by_speed(SimpleNamespace(locked=False, speed=speed))]
    assert half == pytest.approx([2**0.5, 0.5**0.5, np.exp(-2.0), np.exp(-1.0)])
    assert weights_by_speed(SimpleNamespace(locked=True, speed=speed)) == []
    assert weights_by_speed(SimpleNamespace(locked=False, speed=None)) == []


SHIFTS = (("lost_motion", {"ramp_arcmin": 0.05}), ("hysteresis", {"transition_deg": 0.02, "model": Law.DAHL}))


@pytest.mark.parametrize(("effect", "shape"), SHIFTS)
def test_play_and_friction_are_alike_at_all_speeds(effect, shape):
    """Drag that fades with the speed, or goes with a root of it, is another law; of one speed all are the same. Faults
    caught: a law left out; one asked where the speed hardly varies."""
    for law in (lambda v: np.exp(-v / 0.4), lambda v: v**-0.5, lambda v: v**0.5):
        assert other_law(shifted(effect, shape, law), 1.0).log_evidence > 2 * DEFAULT.verdict.other_law
    assert other_law(shifted(effect, shape, np.ones_like), 1.0).log_evidence < 1.0
    assert other_law(shifted(effect, shape, np.sqrt, speeds=(1.0, 1.1)), 1.0) == OtherLaw()


WAVES = (
    ("encoder_interpolation", {"lines": 24, "shaft": Shaft.INPUT, "cycles": (1,)}),
    ("circular_spline_lobing", {"lobes": 12}),
    ("cs_tooth_harmonics", {"members": (11, 12)}),
)


def rippled(effect, shape, law, beside=(), speeds=(0.5, 1.0)):
    """The fit of `effect` at `shape`, and of those `beside`, to records with waves of its orders, which both zones meet
    alike, of 0.1 arcmin by a `law` of the speed."""
    study = load_study(drive="csf-25-80")
    orders = EFFECTS[effect].orders(shape, 80.0)
    records = bench(
        study,
        lambda motion: 0.1 * law(np.abs(motion["speed"])) * sum(np.sin(k * motion["theta"]) for k in orders),
        turns=20,
        rate=120,
        speeds=speeds,
    )
    start = begin(records, CartesianModel.of(study.drive), 1, DEFAULT).base
    rows = start.problem.rows
    return joint_fit(start, [EFFECTS[name].term(rows, at, start.motion) for name, at in ((effect, shape), *beside)])


@pytest.mark.parametrize(("effect", "shape"), WAVES)
def test_waves_of_what_turns_are_as_large_at_every_speed(effect, shape):
    """A motor's ripple that fades to a half or grows to twice with the speed is another law; what is alike at both
    speeds is not, and of one speed none is asked. Faults caught: waves in the zones not asked; cogging named 39 waves
    of the teeth."""
    for law in (lambda v: 0.5 / v, lambda v: v, lambda v: v**2):
        found = other_law(rippled(effect, shape, law), 1.0)
        assert found.log_evidence > 2 * DEFAULT.verdict.other_law
        assert (found.index, found.of) == (0, "speed")
    assert other_law(rippled(effect, shape, np.ones_like), 1.0) == OtherLaw()
    assert other_law(rippled(effect, shape, np.ones_like, speeds=(1.0, 1.1)), 1.0) == OtherLaw()


def test_waves_behind_a_resonance_follow_the_speed():
    """Which swings them up: no law of the speed is asked of them then."""
    swinging = ("resonance", {"frequency_hz": 3.0, "damping_ratio": 0.05, "foot": Foot.ERROR})
    alone, beside = (rippled(*WAVES[1], lambda v: v, more) for more in ((), (swinging,)))
    assert len(laws_of(alone, alone.terms[0])["speed"]) == 6
    assert "speed" not in laws_of(beside, beside.terms[0])


def there_and_back(effect, shape, hidden, passes=4):
    """The fit of `effect` at `shape` to one record of so many `passes` of 20 turns, in which `hidden` adds to the
    drive's own error: a function of that error, the direction and the part of the record that has gone by."""
    study = load_study(drive="csf-25-80")
    there = np.arange(20 * 60) * 2 * np.pi / 60
    theta = np.concatenate([there if i % 2 == 0 else there[::-1] for i in range(passes)]) + 0.2
    direction = np.repeat([1.0 if i % 2 == 0 else -1.0 for i in range(passes)], len(there))
    own = kinematic_error_arcmin(study.drive, study.errors, theta)
    error = own + hidden(own, direction, np.arange(len(theta)) / len(theta))
    error = error + np.random.default_rng(2).normal(0, 0.02, len(theta))
    table = {
        "time_s": np.arange(len(theta)) * 0.1,
        "input_angle_deg": np.degrees(theta),
        "output_angle_deg": np.degrees(theta / 80 - error * ARCMIN),
    }
    state = begin([recording_from_table(pd.DataFrame(table), 80.0)], CartesianModel.of(study.drive), 1, DEFAULT)
    return joint_fit(state.base, [EFFECTS[effect].term(state.problem.rows, shape)])


def worn_in(effect, shape, law, passes=4):
    """Of two directions that lie 0.3 arcmin apart at first, by a `law` of the part of the record that has gone by."""
    return there_and_back(effect, shape, lambda own, direction, part: 0.15 * direction * law(part), passes)


@pytest.mark.parametrize(("effect", "shape"), SHIFTS)
def test_play_and_friction_do_not_wear_in(effect, shape):
    """Drag that fades within a tenth to four tenths of a record is another law, of the time; what stays is not. Of two
    passes none is asked: what an offset of either does is a drift as well. Faults caught: play or friction not asked;
    asked of two passes; said to be a law of the speed."""
    for fading in (0.1, 0.15, 0.4):
        found = other_law(worn_in(effect, shape, lambda part, f=fading: np.exp(-part / f)), 1.0)
        assert found.log_evidence > 2 * DEFAULT.verdict.other_law
        assert found.of == "time"
    assert other_law(worn_in(effect, shape, np.ones_like), 1.0) == OtherLaw()
    assert other_law(worn_in(effect, shape, lambda part: np.exp(-part / 0.2), passes=2), 1.0) == OtherLaw()


def larger_one_way(effect, shape, share, offset):
    """Of an error that is larger by a `share` of itself forwards than backwards, and an `offset` (arcmin) apart."""
    return there_and_back(effect, shape, lambda own, direction, part: (share * own + offset) / 2 * direction)


@pytest.mark.parametrize(("effect", "shape"), SHIFTS)
def test_an_error_that_is_larger_in_one_direction_is_no_play(effect, shape):
    """Its mean over the turn is an offset, and a play of that size leaves what varies. Of play alone the offset is all.
    Faults caught: not asked of play or friction; a coefficient more for nothing."""
    found = other_law(larger_one_way(effect, shape, 0.3, 0.0), 1.0)
    assert found.of == "direction"
    assert found.log_evidence > 2 * DEFAULT.verdict.other_law
    assert other_law(larger_one_way(effect, shape, 0.0, 0.3), 1.0) == OtherLaw()


def test_coefficients_beyond_the_effects_own_cost_evidence(monkeypatch):
    """The same column twice explains no more, and costs half the log of the rows. Fault caught: free coefficients."""
    fit = recorded(0.5)
    once = other_law(fit, 1.0).log_evidence
    laws = DELAY.other_laws(fit.problem.rows, fit.terms[0], fit.motion)["speed"]
    angle = np.random.default_rng(0).normal(size=(len(fit.problem.rows), 1))
    wider = {"speed": [np.hstack([columns, 1e-9 * angle * columns]) for columns in laws]}
    monkeypatch.setattr(type(DELAY), "other_laws", lambda self, conditions, term, motion: wider)
    paid = once - other_law(fit, 1.0).log_evidence
    assert paid == pytest.approx(np.log(fit.problem.weighed_rows) / 2, rel=0.3)


def test_a_gear_without_an_error_of_its_own_shows_none_in_one_direction():
    rows = SimpleNamespace(locked=False)
    term = SimpleNamespace(columns=np.array([[1.0, 5.0], [-1.0, 6.0]]))
    assert columns_by_direction(rows, term, np.zeros(2)) == []
    (columns,) = columns_by_direction(rows, term, np.array([2.0, 3.0]))
    np.testing.assert_array_equal(columns, [[1.0, 5.0, 2.0], [-1.0, 6.0, -3.0]])
    assert columns_by_direction(SimpleNamespace(locked=True), term, np.array([2.0, 3.0])) == []
    assert columns_by_direction(rows, SimpleNamespace(columns=None), np.array([2.0, 3.0])) == []


def test_what_wears_in_fades_from_the_start_of_each_recording():
    """To 1/e after a tenth, a fifth and two fifths of it; without a clock, or with a recording of three passes, nothing
    is told."""
    way = np.tile(np.repeat([1.0, -1.0], 5), 2)
    two = SimpleNamespace(
        locked=False,
        time=np.r_[np.arange(20.0), 100 + 3 * np.arange(20.0)],
        direction=np.r_[way, way],
        record=np.repeat([0, 1], 20),
        records=2,
    )

    class Rows(SimpleNamespace):
        def __len__(self):
            return 40

    rows = Rows(**vars(two))
    found = weights_by_time(rows)
    for weight, fading in zip(found, (0.1, 0.2, 0.4), strict=True):
        np.testing.assert_allclose(weight, np.tile(np.exp(-np.arange(20) / 19 / fading), 2))
    assert weights_by_time(Rows(**{**vars(two), "time": None})) == []
    assert weights_by_time(Rows(**{**vars(two), "locked": True})) == []
    fewer = np.r_[way, np.repeat([1.0, -1.0, 1.0], (5, 5, 10))]
    assert weights_by_time(Rows(**{**vars(two), "direction": fewer})) == []


def lines_of_an_encoder(grows, shaft="output", lines=400):
    """The fit of an encoder's lines to four passes of 20 turns, in which a wave at their order is by so much (`grows`)
    larger at the end than at the start, beside 0.25 arcmin."""
    order = lines if shaft == "input" else lines / 80

    def wave(own, direction, part):
        turned = np.concatenate([np.arange(1200)[:: 1 if i % 2 == 0 else -1] for i in range(4)]) * 2 * np.pi / 60 + 0.2
        return (0.25 + grows * part) * np.sin(order * turned + 1.0)

    return there_and_back("encoder_interpolation", {"shaft": Shaft(shaft), "lines": lines, "cycles": (1,)}, wave)


def test_lines_of_an_encoder_do_not_grow():
    """A wave that grows or fades by 0.2 arcmin is a hundred in log evidence in 4,800 rows, as the noise is first taken;
    one that does not pays for the two coefficients more. It was named an encoder (case 26 of run-023: a wave of the
    time). Faults caught: not asked; asked without the wave that is alike at all times; coefficients that cost nothing.
    """
    for grows in (0.2, -0.2):
        found = other_law(lines_of_an_encoder(grows), 1.0)
        assert found.of == "time" and found.log_evidence > 10 * DEFAULT.verdict.other_law
    for shaft, lines in (("output", 400), ("output", 1000), ("input", 12)):
        assert other_law(lines_of_an_encoder(0.0, shaft, lines), 1.0) == OtherLaw()


def test_what_has_gone_by_is_counted_in_each_recording():
    """Fault caught: the time since the first of all recordings."""

    class Rows(SimpleNamespace):
        def __len__(self):
            return 6

    rows = Rows(locked=False, time=np.array([0.0, 1, 2, 100, 110, 140]), record=np.repeat([0, 1], 3), records=2)
    np.testing.assert_allclose(part_gone_by(rows), [0, 0.5, 1, 0, 0.25, 1])
    for of, value in (("locked", True), ("time", None), ("time", np.array([0.0, 1, 2, 7, 7, 7]))):
        assert part_gone_by(Rows(**{**vars(rows), of: value})) is None
    term = Term("encoder_interpolation", {}, columns=np.ones((6, 1)))
    (columns,) = columns_growing(rows, term)
    np.testing.assert_allclose(columns, np.column_stack([np.ones(6), part_gone_by(rows)]))
    assert columns_growing(rows, Term("encoder_interpolation", {})) == []


def test_rough_noise_and_each_law_cost_evidence(monkeypatch):
    """Faults caught: the noise's roughness forgotten; three laws tried for nothing."""
    fit = recorded(0.5)
    once, rough = other_law(fit, 1.0).log_evidence, other_law(fit, 2.0).log_evidence
    assert once + np.log(3) == pytest.approx(2 * (rough + np.log(3)))


def test_what_a_terms_own_form_may_leave_is_no_other_law(monkeypatch):
    """A law that follows a delay but for a part of it, which the record holds as well, is another one only where that
    part is more than a thousandth of what the delay explains. Would catch a play beside a delay that is refused, at a
    millionth of an arcmin of noise, for the way in which its crossing is drawn."""
    fit = recorded(1.0, size=3.0)
    probe = FitProbe(fit, keep=())
    own = probe.white_columns(fit.terms[0])[:, 0] * float(fit.coefficients[0][0])
    part = np.sin(np.arange(len(own)))
    for share, other in ((3e-4, False), (3e-3, True)):
        size = np.sqrt(share) * np.linalg.norm(own) / np.linalg.norm(part)
        held = _with_error(fit, size * part)
        columns = fit.terms[0].columns + (size / fit.coefficients[0][0]) * part[:, None]
        law = {"speed": [columns]}
        monkeypatch.setattr(type(DELAY), "other_laws", lambda self, conditions, term, motion, law=law: law)
        assert (other_law(held, 1.0).log_evidence > DEFAULT.verdict.other_law) is other


def _with_error(fit, more):
    """`fit` of rows whose error has so much `more` in it (n,), arcmin, by noise of 0.02 arcmin."""
    rows = replace(fit.problem.rows, error=fit.problem.rows.error + more)
    problem = replace(fit.problem, rows=rows, noise=Noise.white(rows, 0.02))
    return evaluate(problem, fit.errors, fit.offsets, fit.terms, fit.coefficients)


def test_effects_without_other_laws_are_not_asked(monkeypatch):
    fit = recorded(0.5)
    monkeypatch.setattr(type(DELAY), "other_laws", lambda self, conditions, term, motion: {"speed": []})
    assert other_law(fit, 1.0) == OtherLaw()


def test_the_verdict_says_that_the_law_is_another():
    """Where it lives and what it looks like. Fault caught: the effect is named all the same."""
    fit = recorded(0.5)
    best = SimpleNamespace(fit=fit, effects=("channel_delay",))
    evidence = SimpleNamespace(
        selection=SimpleNamespace(best=best), other_law=OtherLaw(0, 99.0), base_held_out=SimpleNamespace(variance=0.02)
    )
    said = rules.not_by_its_law(SimpleNamespace(evidence=evidence))
    assert (said.verdict, said.effects, said.where["domain"]) == ("unknown", (), "speed")
    assert said.where["rms_arcmin"] == pytest.approx(np.std(fit.contribution(0)))
    assert "looks like channel_delay, but another law of the speed explains it better" in said.says
    evidence.other_law = OtherLaw(0, 99.0, "time")
    said = rules.not_by_its_law(SimpleNamespace(evidence=evidence))
    assert said.where["domain"] == "time"
    assert "another law of the time explains it better" in said.says
