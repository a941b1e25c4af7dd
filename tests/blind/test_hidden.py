"""Each concealed physics, alone on a smooth run, against the closed form that it must come to."""

from dataclasses import replace

import numpy as np
import pytest

from hdopt.bench.cases import CATALOGUE
from hdopt.bench.geometry import ARCMIN, RATIO, BaseErrors
from hdopt.bench.hidden_drive import BearingPass, Lobing, LocalDefect
from hdopt.bench.hidden_load import Hysteresis, LostMotion, Resonance, ThermalDrift, Windup
from hdopt.bench.hidden_outside import ALL_KINDS, Outside
from hdopt.bench.hidden_sensors import ChannelDelay, Coupling, Eccentricity, Interpolation
from hdopt.bench.motion import TURN, Heat, Plan, Torque, run
from hdopt.bench.signal_chain import hidden_wave, joint_rms, read_angles, read_error, set_up

# A drive with nothing but a sine on its circular spline: simple enough for closed forms.
QUIET = BaseErrors(*[0.0] * 10, 0.002, 0.0)


def setup_for(legs, errors=QUIET, samples=200.0, torque=None, heat=None):
    plan = Plan(tuple(legs), samples, 0.0, 0.2, (), torque, heat, False)
    return set_up(errors, run(plan, 0.0, np.random.default_rng(0))), plan


def amplitude_at(wave, angle, order):
    """Amplitude (arcmin) of `order` cycles per turn of `angle`, by least squares."""
    columns = np.column_stack([np.ones_like(angle), np.cos(order * angle), np.sin(order * angle)])
    _, c, s = np.linalg.lstsq(columns, wave, rcond=None)[0]
    return np.hypot(c, s) / ARCMIN


@pytest.mark.parametrize("effect", CATALOGUE)
def test_no_size_no_effect(effect):
    setup, plan = setup_for([(6, 60), (-6, 60)], torque=Torque("sweep", 10, 0, 0.2, 0.3), heat=Heat(5, 3, 0, 1))
    for seed in range(3):
        physics = CATALOGUE[effect](np.random.default_rng(seed)).for_plans((plan,))
        wave = hidden_wave(setup, [physics.scaled(1e-9)])
        assert np.abs(wave).max() < 1e-5 * ARCMIN


@pytest.mark.parametrize("kind", ALL_KINDS)
def test_outside_kinds_scale(kind):
    """Every form is finite, is there, and grows in proportion: the severity of a case rests on it."""
    setup, plan = setup_for(
        [(20, 60), (-20, 60), (8, 25)], torque=Torque("sweep", 10, 0, 0.2, 0.3), heat=Heat(5, 3, 0, 1)
    )
    physics = Outside.draw(np.random.default_rng(1), kind).for_plans((plan,))
    one, two = (joint_rms([hidden_wave(setup, [physics.scaled(s)])]) for s in (0.1, 0.2))
    assert two == pytest.approx(2 * one, rel=1e-6) and one > 0.01 * ARCMIN


def closest(wave, column):
    """Share of `wave` that a free factor of `column` explains."""
    wave, column = wave - wave.mean(), column - column.mean()
    return (wave @ column) ** 2 / (wave @ wave) / (column @ column)


def test_forms_are_what_their_names_say():
    """Catches a form that is a catalogue effect under another name, or no law at all."""
    setup, plan = setup_for([(20, 60), (-20, 60), (20, 15)], torque=Torque("sweep", 10, 0, 0.2, 0.3))
    speed = setup.run.speed / TURN

    def wave(kind, seed=3):
        return hidden_wave(setup, [Outside.draw(np.random.default_rng(seed), kind).for_plans((plan,))])

    drag = wave("drag by a root of speed")
    assert closest(drag, np.sign(speed) * np.sqrt(np.abs(speed))) > 0.98 > closest(drag, speed)
    size = wave("size of torque")
    assert abs(size[np.argmax(setup.run.torque)] - size[np.argmin(setup.run.torque)]) < 0.02 * np.ptp(size)
    creep = wave("creep after a reversal")
    back = np.flatnonzero(np.diff(np.sign(speed)) < 0)[0] + 5
    later = creep[back : back + 1500 : 500]
    assert abs(later[1] - later[0]) > abs(later[2] - later[1])  # ever slower
    other = wave("wandering pulse", seed=4)
    assert closest(wave("wandering pulse"), other) < 0.5  # parameters are drawn


def test_play_leaves_its_full_step_at_a_reversal():
    setup, _ = setup_for([(10, 30), (-10, 30)])
    for seed in range(4):
        physics = LostMotion.draw(np.random.default_rng(seed)).scaled(0.4)
        wave = hidden_wave(setup, [physics]) / ARCMIN
        forward = (setup.run.speed > 0) & (setup.run.theta > TURN) & (setup.run.theta < 9 * TURN)
        back = (setup.run.speed < 0) & (setup.run.theta > TURN) & (setup.run.theta < 9 * TURN)
        assert wave[forward].mean() - wave[back].mean() == pytest.approx(0.4, rel=0.01)
        # The output stands still until the play is taken up: the step takes 0.4 arcmin of output, 0.53 deg of input.
        turn = np.argmax(setup.run.theta)
        after = turn + np.argmax(setup.run.theta[turn:] < setup.run.theta.max() - np.deg2rad(1.2 * 0.4 * RATIO / 60))
        assert wave[after] - wave[turn] == pytest.approx(-0.4, rel=0.1)
        assert np.ptp(wave[forward]) < 0.05 * 0.4


@pytest.mark.parametrize("seed", range(6))
def test_friction_closes_its_loop_whatever_the_speed(seed):
    physics = Hysteresis.draw(np.random.default_rng(seed)).scaled(0.3)
    far = 3 * 360 * physics.reversal_path(0.98) * RATIO / TURN / 360
    loops = []
    for rpm in (5, 50):
        setup, _ = setup_for([(far, rpm), (-far, rpm), (far, rpm)], samples=400)
        loops.append((setup.run, hidden_wave(setup, [physics]) / ARCMIN))
    for motion, wave in loops:
        middle = np.abs(motion.theta - far * TURN / 2) < 0.2 * far * TURN
        back, forth = motion.speed < 0, motion.speed > 0
        last = motion.time > 0.67 * motion.time[-1]
        assert wave[middle & forth & last].mean() - wave[middle & back].mean() == pytest.approx(0.6, rel=0.04)
    (slow, slow_wave), (_, fast_wave) = loops
    assert np.abs(slow_wave - fast_wave).max() < 0.01  # the same path: rate-independent
    top = np.argmax(slow.theta[: slow.theta.size // 2])
    travelled = (slow.theta[top] - slow.theta[top:]) / RATIO
    transition = np.argmax(travelled > np.deg2rad(physics.truth()["transition_deg"].value))
    done = (slow_wave[top] - slow_wave[top + transition]) / 0.6
    assert done == pytest.approx(0.9, abs=0.02)


def test_windup_follows_the_catalogue_curve():
    setup, _ = setup_for([(40, 60)], torque=Torque("sweep", 70.0, 0.0, 0.5, 0.0))
    physics = Windup("three slopes", (3.1e4, 5.0e4, 5.7e4), (14.0, 48.0), 0.0, 0.0)
    twist = physics.lag(setup.run, None)
    torque = setup.run.torque
    slope = np.diff(torque) / np.where(np.diff(twist) == 0, np.nan, np.diff(twist))
    middle = np.abs(0.5 * (torque[1:] + torque[:-1]))
    assert np.nanmedian(slope[middle < 12]) == pytest.approx(3.1e4, rel=1e-6)
    assert np.nanmedian(slope[(middle > 16) & (middle < 46)]) == pytest.approx(5.0e4, rel=1e-6)
    assert np.nanmedian(slope[middle > 50]) == pytest.approx(5.7e4, rel=1e-6)
    cubic = replace(physics, variant="cubic").lag(setup.run, None)
    k3 = (5.0e4 - 3.1e4) * (3.1e4 / 14.0) ** 2
    assert 3.1e4 * cubic + k3 * cubic**3 == pytest.approx(torque, abs=1e-6)


def test_off_centre_disc_gives_the_published_amplitude():
    # 412.5 e(um)/D(mm) arcsec: 2 um on 60 mm are 13.75 arcsec.
    setup, _ = setup_for([(80, 60)])
    physics = Eccentricity("encoder_output_eccentricity", "centre", 0.3, 0.0, 0.0).scaled(2e-3 / 30 / ARCMIN)
    wave = hidden_wave(setup, [physics])
    assert 60 * amplitude_at(wave, setup.run.theta, 1 / RATIO) == pytest.approx(13.75, rel=1e-3)
    at_input = replace(physics, id="encoder_input_eccentricity").scaled(0.2)
    assert amplitude_at(hidden_wave(setup, [at_input]), setup.run.theta, 1) == pytest.approx(0.2, rel=1e-3)
    oval = replace(physics, oval_share=0.5).scaled(0.2)
    assert amplitude_at(hidden_wave(setup, [oval]), setup.run.theta, 2 / RATIO) == pytest.approx(0.1, rel=0.02)


def test_interpolation_gives_once_and_twice_a_line():
    setup, _ = setup_for([(80, 60)], samples=250)
    phase = Interpolation("output", 1024, (0.0, 0.0), 1.0, 0.0, 0.1)
    wave, angle = hidden_wave(setup, [phase]), setup.run.theta / RATIO
    # A gain g off gives g/2 of electrical angle at twice the lines; an offset gives itself at once the lines.
    assert amplitude_at(wave, angle, 2048) == pytest.approx(0.05 / 1024 / ARCMIN, rel=0.06)
    assert amplitude_at(wave, angle, 1024) < 0.02 * amplitude_at(wave, angle, 2048)
    offset = Interpolation("output", 1024, (1.0, 0.0), 0.0, 0.0, 0.02)
    assert amplitude_at(hidden_wave(setup, [offset]), angle, 1024) == pytest.approx(0.02 / 1024 / ARCMIN, rel=0.01)


OF_2_ARCMIN = {
    "joint": Coupling("output", 0.4).scaled(2 / 0.262),
    "disc": Eccentricity("encoder_output_eccentricity", "centre", 0.3, 0, 0).scaled(2.0),
}


@pytest.mark.parametrize("moved", OF_2_ARCMIN.values(), ids=OF_2_ARCMIN)
@pytest.mark.parametrize("lines_first", [True, False])
def test_lines_are_read_behind_a_joint_and_off_centre(moved, lines_first):
    """The ripple stands at 1000 times the angle that joint and disc leave, in whatever order a case has its physics:
    2 arcmin move it by 0.6 rad. Would catch lines that are read ahead of the joint."""
    setup, _ = setup_for([(80, 60)], samples=250)
    lines = Interpolation("output", 1000, (1.0, 0.0), 0.0, 0.0, 0.02)
    both = [lines, moved] if lines_first else [moved, lines]
    alone = read_angles(setup, [moved])[1]
    ripple = read_angles(setup, both)[1] - alone
    assert amplitude_at(ripple, alone, 1000) == pytest.approx(0.02 / 1000 / ARCMIN, rel=0.01)


def test_bent_joint_of_one_degree_gives_sixteen_arcsec():
    setup, _ = setup_for([(80, 60)])
    wave = hidden_wave(setup, [Coupling("output", 0.4).scaled(1.0)])
    assert 60 * amplitude_at(wave, setup.run.theta, 2 / RATIO) == pytest.approx(15.7, abs=0.1)
    wave = hidden_wave(setup, [Coupling("input", 0.4).scaled(9.0)])
    assert 60 * amplitude_at(wave, setup.run.theta, 2) == pytest.approx(9 * 15.7 / RATIO, rel=0.01)


def test_bearing_orders():
    setup, _ = setup_for([(160, 60)])
    r, balls = 0.1, 22  # an even number: both ends see a ball at the same time
    one_odd = BearingPass("diameters", balls, r, (1.0,) + (0.0,) * (balls - 1), 0.0, 8.0)
    wave = hidden_wave(setup, [one_odd])
    strong = amplitude_at(wave, setup.run.theta, (1 + r) * (1 + 1 / RATIO))
    assert strong > 5 * amplitude_at(wave, setup.run.theta, (1 + r) * (1 + 1 / RATIO) + 0.05)
    pitch = BearingPass("pitch", balls, r, (0.0,) * balls, 0.0, 100.0)
    wave = hidden_wave(setup, [pitch])
    passing = balls / 2 * (1 + r) * (1 + 1 / RATIO)
    assert amplitude_at(wave, setup.run.theta, passing) > np.std(wave) / ARCMIN


def test_lobes_appear_through_the_depth():
    setup, _ = setup_for([(20, 60)], errors=BaseErrors(*[0.0] * 12))
    physics = Lobing(6, 0.0).scaled(4.0)
    wave = hidden_wave(setup, [physics])
    # 4 um of radius are 4 tan(12 deg) um of arc on a pitch radius of 31.68 mm.
    expected = 4e-3 * np.tan(np.deg2rad(12)) / 31.68 / ARCMIN
    assert amplitude_at(wave, setup.run.theta, 6) == pytest.approx(expected, rel=0.01)


def test_warm_body_follows_its_lag():
    setup, plan = setup_for([(60, 60)], heat=Heat(8.0, 20.0, 0.0, 1.0))
    expected = 8.0 * (1 - np.exp(-setup.run.time / 20.0))
    assert setup.run.body_k == pytest.approx(expected, abs=0.01)
    physics = ThermalDrift("warm-up", 0.02).for_plans((plan,))
    assert physics.truth()["time_constant_s"].value == 20.0


def test_resonance_has_the_gain_of_its_transfer_function():
    errors = BaseErrors(*[0.0] * 8, 0.0, 0.0, 0.002, 0.0)  # the flexspline's wave, near order 1
    for to_ground in (True, False):
        setup, plan = setup_for([(60, 60)], errors=errors)
        physics = Resonance(0.05, to_ground).for_plans((plan,)).scaled(0.5)
        held = (setup.run.theta > 20 * TURN) & (setup.run.theta < 58 * TURN)
        theta = setup.run.theta[held]
        ke = read_error(setup)
        moved = hidden_wave(setup, [physics]) + ke - ke.mean()
        for order in (2 * (1 + 1 / RATIO), 4 * (1 + 1 / RATIO)):
            s = 1j * order / physics.frequency_hz
            expected = abs((1 + (0 if to_ground else 0.1 * s)) / (1 + 0.1 * s + s * s))
            gain = amplitude_at(moved[held], theta, order) / amplitude_at(ke[held], theta, order)
            assert gain == pytest.approx(expected, rel=0.03)


def test_local_defect_sits_where_the_key_says():
    setup, _ = setup_for([(10, 60)], samples=400)
    for on in ("cs", "fs"):
        physics = LocalDefect(on, 40, 1.0).scaled(20.0)
        wave = hidden_wave(setup, [physics])
        angle = setup.run.theta if on == "cs" else setup.run.theta * (1 + 1 / RATIO)
        there = np.rad2deg(angle[np.argsort(wave)[-20:]]) % 180
        assert there == pytest.approx(physics.truth()["angle_deg"].value % 180, abs=1.5)


@pytest.mark.parametrize("on", ["cs", "fs"])
def test_the_key_of_a_tooth_gives_the_angle_at_which_it_shows(on):
    """Both ends of the wave generator pass a tooth, half a turn apart. Fault caught: the tooth's own angle where the
    end that comes half a turn later drives there.
    """
    setup, _ = setup_for([(10, 60)], samples=400)
    shown = set()
    for tooth in range(0, 160, 16):
        physics = LocalDefect(on, tooth, 1.0).scaled(5.0)
        wave = hidden_wave(setup, [physics])
        wave = wave - np.median(wave)
        angle = setup.run.theta if on == "cs" else setup.run.theta * (1 + 1 / RATIO)
        stated = np.deg2rad(physics.truth_in([setup], [wave])["angle_deg"].value)
        near = np.cos(angle - stated) > 0
        assert wave[near] @ wave[near] >= wave[~near] @ wave[~near]
        shown.add(bool(np.isclose(np.rad2deg(stated), physics.truth()["angle_deg"].value)))
    assert shown == {True, False}


def test_a_late_channel_lags_in_proportion_to_speed():
    setup, _ = setup_for([(5, 60), (-5, 60), (5, 30)])
    physics = ChannelDelay("output late").scaled(1e-3)
    lag = read_error(setup, [physics]) - read_error(setup)
    held = np.abs(np.abs(setup.run.speed) - TURN) < 1e-9
    assert lag[held] == pytest.approx(1e-3 * setup.run.speed[held] / RATIO, abs=0.02 * 1e-3 * TURN / RATIO)
