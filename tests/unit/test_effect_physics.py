"""What each effect does at known conditions, from its source's equation written out by hand."""

from dataclasses import replace
from math import exp, log, pi, radians, sqrt, tan
from types import SimpleNamespace

import numpy as np
import pytest

from hdopt.effects import EFFECTS
from hdopt.effects._friction_law import Law
from hdopt.effects._friction_torque import half_loop, torque_behind_friction
from hdopt.effects._oscillator import changes_of_speed, relative_responses, settled_responses
from hdopt.effects._zone_harmonics import zone_harmonics
from hdopt.effects.bearing_pass import bearing_orders
from hdopt.effects.conditions import Conditions
from hdopt.effects.declared import Shaft
from hdopt.effects.estimate import FitEstimate
from hdopt.effects.hysteresis import friction_state
from hdopt.effects.local_tooth_defect import Seat
from hdopt.effects.met import met_angles, sum_of
from hdopt.effects.resonance import Foot
from hdopt.effects.sines import sine_columns
from hdopt.effects.thermal_drift import elapsed, warming
from hdopt.effects.tooth_mesh import mesh_order

TURN, ARCMIN, RATIO, RATE = 2 * pi, pi / 10800, 50.0, 120
GEAR = SimpleNamespace(ratio=RATIO, pressure_angle=radians(12.0))


def moving(passes=(6, 6, 6), **changes):
    """Passes of so many input turns there and back at 2 rad/s, with a torque, a temperature and a clock."""
    parts, direction, travel, first = [], [], [], []
    at, way = 0.0, 1.0
    for number, turns in enumerate(passes):
        step = np.arange(1, turns * RATE + 1) * TURN / RATE
        parts.append(at + way * step)
        direction.append(np.full(len(step), way))
        travel.append(np.degrees(step) / RATIO)
        first.append(np.full(len(step), number == 0))
        at, way = parts[-1][-1], -way
    theta, direction = np.concatenate(parts), np.concatenate(direction)
    n = len(theta)
    made = Conditions(
        ratio=RATIO,
        theta=theta,
        output=theta / RATIO + 0.3,
        direction=direction,
        travel=np.concatenate(travel),
        first=np.concatenate(first),
        record=np.zeros(n, np.int64),
        piece=np.zeros(n, np.int64),
        time=np.arange(n) * TURN / RATE / 2.0,
        speed=2.0 * direction,
        torque=20.0 * np.sin(np.arange(n) / 90),
        temperature=25.0 + 3.0 * np.linspace(0, 1, n),
    )
    return replace(made, **changes)


def sine(order, theta, amplitude=1.0, phase=0.0):
    return amplitude * np.sin(order * theta + phase)


def spanned(columns, wave):
    """Whether `wave` is a sum of `columns`."""
    left = wave - columns @ np.linalg.lstsq(columns, wave, rcond=None)[0]
    return np.abs(left).max() < 1e-9 * np.abs(wave).max()


def added(name, keys, conditions):
    """What the effect adds at the output where a study says `keys`, arcmin."""
    effect = EFFECTS[name]
    defaults = {one.name: one.default for one in effect.flat_declared() if hasattr(one, "default")}
    shape, coefficients = effect.values({**defaults, **keys}, GEAR)
    return effect.predict(conditions, shape).columns @ np.array(coefficients)


def test_a_late_output_lags_by_its_speed_times_the_delay():
    c = moving()
    found = EFFECTS["channel_delay"].term(c, {}).columns[:, 0] * 3.0  # 3 ms
    assert found == pytest.approx(0.003 * c.speed / RATIO / ARCMIN)


def test_what_follows_the_temperature():
    c = moving()
    column = EFFECTS["thermal_drift"].term(c, {}).columns[:, 0]
    assert column == pytest.approx(c.temperature - c.temperature.mean())
    assert added("thermal_drift", {"coefficient_arcmin_per_k": 0.1}, c) == pytest.approx(0.1 * c.temperature)


def test_one_thermal_mass_is_warm_to_a_part_of_1_less_1_over_e_after_its_time_constant():
    assert warming(np.array([0.0, 60.0, 120.0]), 60.0)[:, 0] == pytest.approx([0, 1 - exp(-1), 1 - exp(-2)])


@pytest.mark.parametrize("gap", [50.0, -50.0])
def test_warming_goes_on_from_one_recording_to_the_next(gap):
    """Where their clocks follow each other; where both begin anew, each warms up by itself."""
    c = moving((4, 4))
    half = len(c) // 2
    record = np.arange(len(c)) // half
    time = np.where(record == 0, c.time, c.time - c.time[half] + (c.time[half - 1] + gap if gap > 0 else 7.0))
    found = elapsed(replace(c, record=record, time=time))
    assert found[half] == pytest.approx(c.time[half - 1] + gap - c.time[0] if gap > 0 else 0.0)


def test_windup_is_three_straight_lines_odd_in_the_torque():
    c = moving()
    keys = {
        "stiffness_1_nm_per_rad": 31000.0,
        "stiffness_2_nm_per_rad": 50000.0,
        "stiffness_3_nm_per_rad": 57000.0,
        "knee_1_nm": 5.0,
        "knee_2_nm": 14.0,
    }
    size = np.abs(c.torque)
    lines = np.where(
        size < 5,
        size / 31e3,
        np.where(size < 14, 5 / 31e3 + (size - 5) / 50e3, 5 / 31e3 + 9 / 50e3 + (size - 14) / 57e3),
    )
    assert added("torsional_windup", keys, c) == pytest.approx(np.sign(c.torque) * lines / ARCMIN)


def test_compliance_varies_twice_a_turn():
    c = moving()
    keys = {"stiffness_1_nm_per_rad": 31000.0, "variation_over_turn": 0.2, "variation_phase_deg": 25.0}
    expected = c.torque / 31000 * (1 + 0.2 * np.sin(2 * c.theta + radians(25))) / ARCMIN
    assert added("torsional_windup", keys, c) == pytest.approx(expected)


def test_play_is_crossed_over_as_much_output_travel_as_it_is_long():
    """9 arcmin of play in 9 arcmin, 0.15 deg, of output: half of it to either side, none lost before a reversal."""
    c = moving()
    found = EFFECTS["lost_motion"].term(c, {"ramp_arcmin": 9.0}).columns[:, 0] * 9.0
    crossing = np.clip(c.travel / 0.15, 0, 1)
    expected = np.where(c.first, 4.5, c.direction * (9.0 * crossing - 4.5))
    assert found == pytest.approx(expected)


def test_play_of_a_locked_input_is_crossed_beyond_the_friction():
    torque = 10 * np.sin(np.linspace(0, 6 * pi, 900) + 0.001)
    direction = np.sign(np.gradient(torque))
    c = replace(moving((8,)), **fitting(900, torque=torque, direction=direction, locked=True))
    found = EFFECTS["lost_motion"].term(c, {"friction_nm": 2.0}).columns[:, 0]
    rising, falling = direction > 0, direction < 0
    assert np.array_equal(found[rising] > 0, torque[rising] > 2.0)
    assert np.array_equal(found[falling] > 0, torque[falling] > -2.0)
    assert set(np.abs(found)) == {0.5}


def fitting(n, **changes):
    """All arrays of `moving` cut to n rows, with `changes`."""
    c = moving((8,))
    return {k: v[:n] for k, v in vars(c).items() if isinstance(v, np.ndarray)} | changes


def test_friction_crosses_over_with_the_travel_and_remembers_a_short_pass():
    """Dahl 1968: 1 - (1 - y) exp(-s/delta) along the motion, from where the pass before ended; 90 % of the loop after
    ln 10 delta."""
    c = moving((6, 2, 6))
    delta = 20.0
    found = friction_state(c, log(10) * delta, Law.DAHL)
    ends = np.flatnonzero(np.diff(c.direction)) + 1
    there, back, again = np.split(np.arange(len(c)), ends)
    assert found[there] == pytest.approx(1.0)
    assert found[back] == pytest.approx(-(1 - 2 * np.exp(-c.travel[back] / delta)))
    last = found[back][-1]
    assert -0.5 < last < 0.99
    assert found[again] == pytest.approx(1 - (1 - last) * np.exp(-c.travel[again] / delta))


def test_the_spring_behind_friction_feels_the_torque_less_the_friction():
    """Play operator: rising T - r, falling T + r, unchanged until the torque has come back by 2 r."""
    torque = np.r_[np.linspace(0, 10, 101), np.linspace(10, -10, 201)[1:]]
    n = len(torque)
    direction = np.r_[np.ones(101), -np.ones(200)]
    c = replace(moving((8,)), **fitting(n, torque=torque, direction=direction, first=np.arange(n) < 101))
    found = torque_behind_friction(replace(c, locked=True), 2.0)
    assert found[:101] == pytest.approx(torque[:101] - 2.0)
    assert found[101:] == pytest.approx(np.minimum(8.0, torque[101:] + 2.0))


def test_the_loop_is_as_wide_as_its_spring_is_soft_up_to_the_knee():
    """1e-5 rad/Nm a coefficient: above the knee only the first of both counts."""
    assert half_loop(np.array([3.0, 2.0]), 4.0, 10.0) == pytest.approx(5.0 * 4.0 * 1e-5 / ARCMIN)
    assert half_loop(np.array([3.0, 2.0]), 4.0, 1.5) == pytest.approx((3.0 * 4.0 + 2.0 * 1.5) * 1e-5 / ARCMIN)


FREQUENCY, DAMPING = 4.0, 0.08
W = TURN * FREQUENCY


def test_steady_swing_is_that_of_the_textbook():
    """A foot that moves by sin(s t): x - y = r^2/(1 - r^2 + 2 i zeta r) y, r = s/w; the damper on the output adds
    -2 i zeta r over the same."""
    n, ratio = 4096, 0.7
    period = 10 / (ratio * FREQUENCY)
    time = np.arange(n) * period / n
    found = settled_responses(time, np.sin(ratio * W * time), FREQUENCY, DAMPING)
    response = 1 / (1 - ratio**2 + 2j * DAMPING * ratio)
    swing = np.exp(1j * ratio * W * time)
    assert found[:, 0] == pytest.approx(np.imag(ratio**2 * response * swing), abs=1e-9)
    assert found[:, 1] == pytest.approx(np.imag(-2j * DAMPING * ratio * response * swing), abs=1e-9)


def test_integrated_swing_settles_to_the_steady_one():
    time = np.arange(20_000) * 1e-3
    c = replace(moving((170,)), **{k: v[:20_000] for k, v in vars(moving((170,))).items() if isinstance(v, np.ndarray)})
    c = replace(c, time=time)
    motion = np.sin(0.7 * W * time)
    found = relative_responses(c, motion[:, None], FREQUENCY, DAMPING, np.eye(2))[:, 0]
    response = 1 / (1 - 0.49 + 2j * DAMPING * 0.7)
    swing = np.exp(1j * 0.7 * W * time)
    late = time > 5  # exp(-0.08 2 pi 4 5) = 4e-5 of the start is left
    # The start's step of the foot's speed has died away; Tustin's rule is within 2 %.
    assert found[late, 0] == pytest.approx(np.imag(0.49 * response * swing)[late], abs=0.02)
    assert found[late, 1] == pytest.approx(np.imag(-2j * DAMPING * 0.7 * response * swing)[late], abs=0.02)


def accelerating(acceleration, start=3.0, n=6000):
    time = np.arange(n) * 1e-3
    theta = start * time + acceleration * time**2 / 2
    c = replace(moving((60,)), **{k: v[:n] for k, v in vars(moving((60,))).items() if isinstance(v, np.ndarray)})
    return replace(c, time=time, theta=theta, speed=start + acceleration * time, direction=np.ones(n))


def test_an_accelerated_inertia_lags_by_a_over_w_squared():
    """The error grows by a/(N w^2) while the input speeds up by a (rad/s^2)."""
    c = accelerating(40.0)
    changes, _ = changes_of_speed(c)
    found = relative_responses(c, changes[:, None], FREQUENCY, DAMPING, np.array([[1.0], [0.0]]))[:, 0, 0]
    assert found[-1000:].mean() == pytest.approx(40.0 / RATIO / W**2 / ARCMIN, rel=0.01)


def test_a_steady_speed_only_winds_up_the_damper_on_the_output():
    c = accelerating(0.0)
    shape = {"frequency_hz": FREQUENCY, "damping_ratio": DAMPING, "foot": Foot.WHOLE_MOTION}
    columns = EFFECTS["resonance"].term(c, shape, np.zeros(len(c))).columns
    assert columns[:, 0] == pytest.approx(0.0, abs=1e-6)
    assert columns[:, 1] == pytest.approx(2 * DAMPING / W * 3.0 / RATIO / ARCMIN, rel=1e-6)
    still = EFFECTS["resonance"].term(c, shape | {"foot": Foot.ERROR}, np.zeros(len(c))).columns
    assert np.abs(still).max() == 0.0


@pytest.mark.parametrize(
    ("name", "shape", "order"),
    [
        ("encoder_input_eccentricity", {"shaft": Shaft.INPUT, "orders": (1,)}, 1.0),
        ("encoder_output_eccentricity", {"shaft": Shaft.OUTPUT, "orders": (1,)}, 1 / RATIO),
        ("output_coupling", {"shaft": Shaft.OUTPUT, "orders": (2,)}, 2 / RATIO),
        ("output_coupling", {"shaft": Shaft.INPUT, "orders": (2,)}, 2.0),
        ("tooth_mesh", {"sidebands": (0,)}, 2 * (RATIO + 1)),
        ("encoder_interpolation", {"shaft": Shaft.INPUT, "lines": 25, "cycles": (1,)}, 25.0),
    ],
)
def test_a_sine_stands_at_its_order(name, shape, order):
    c = moving()
    term = EFFECTS[name].term(c, shape)
    assert term.columns.shape[1] == 2
    assert spanned(term.columns, sine(order, c.theta, 1.3, 0.7))
    assert EFFECTS[name].orders(shape, RATIO) == pytest.approx([order])


def test_an_output_encoder_reads_its_own_angle():
    """Its lines follow the output as read, kinematic error and all, not input over N."""
    c = moving()
    c = replace(c, output=c.theta / RATIO + 0.01 * np.sin(2 * c.theta))
    shape = {"shaft": Shaft.OUTPUT, "lines": 900, "cycles": (1, 2)}
    term = EFFECTS["encoder_interpolation"].term(c, shape)
    for cycle in (1, 2):
        assert spanned(term.columns, sine(900 * cycle, c.output, 1.0, 0.4))
    assert EFFECTS["encoder_interpolation"].orders(shape, RATIO) == pytest.approx([18.0, 36.0])


def test_teeth_that_the_wave_generator_passes_a_turn():
    """Two more than the flexspline's 2 N: 102 for N = 50, 162 for N = 80."""
    assert [mesh_order(ratio) for ratio in (50.0, 80.0)] == [102.0, 162.0]


def test_both_zones_meet_the_teeth_half_a_turn_apart():
    phase = np.linspace(0, 9, 200)
    zones = zone_harmonics(phase, (1, 2, 5))
    assert zones[0] == pytest.approx(sine_columns(phase, (1, 2, 5)))
    assert zones[1] == pytest.approx(sine_columns(phase + pi, (1, 2, 5)))


def test_sines_by_addition_are_sines():
    """Of 3,300 rad the last digit is 5e-13. Faults caught: a run that begins a multiple late, multiples in the order of
    the run and not as asked for, rows after the last whole group of lanes."""
    phase = np.linspace(-20, 20, 301)
    for harmonics in ((2, 3), (1, 2, 3, 4, 8), (0.5, 1.3), (7,), (162, 163, 161, 165), (40, 41), (17, 20, 18)):
        found = sine_columns(phase, harmonics)
        assert found.shape == (301, 2 * len(harmonics))
        for k, h in enumerate(harmonics):
            assert found[:, 2 * k] == pytest.approx(np.sin(h * phase), abs=5e-12)
            assert found[:, 2 * k + 1] == pytest.approx(np.cos(h * phase), abs=5e-12)


def test_waves_of_the_input_are_made_once_and_for_these_rows():
    """Faults caught: made anew at each step of a fit, the first number asked for taken for all, those of other rows."""
    c = moving()
    for most in (1, 3):
        waves = c.waves_of_input(most)
        angles = np.outer(c.theta, range(1, most + 1))
        assert waves[:, 0::2] == pytest.approx(np.sin(angles), abs=1e-12)
        assert waves[:, 1::2] == pytest.approx(np.cos(angles), abs=1e-12)
        assert c.waves_of_input(most) is waves
    shifted = replace(c, theta=c.theta + 0.5)
    assert shifted.waves_of_input(1)[:, 0] == pytest.approx(np.sin(c.theta + 0.5), abs=1e-12)


def test_the_flexsplines_teeth_advance_by_one_more_in_n():
    c = moving()
    angles = met_angles(c.theta, 1 + 1 / RATIO, np.zeros((2, 2, 1)))
    terms = [EFFECTS[f"{part}_tooth_harmonics"].term(c, {"members": (2, 3)}) for part in ("cs", "fs")]
    circular, flex = (term.met.columns(angles[term.met.spline, 0], 0) for term in terms)
    assert spanned(circular, sine(3, c.theta, 1.0, 0.2))
    assert spanned(flex, sine(3 * (1 + 1 / RATIO), c.theta, 1.0, 0.2))
    assert not spanned(flex, sine(3, c.theta, 1.0, 0.2))


def test_ball_orders_follow_from_rolling_without_slip():
    """Surface speeds of both rings, inner at 1, outer at -1/N, pitch radius 1: a ball's centre moves at their mean."""
    r, n = 0.21, 23
    inner, outer = 1.0, -1 / RATIO
    cage = (inner * (1 - r) + outer * (1 + r)) / 2
    expected = [cage, inner - cage, 2 * (inner - cage), n * (cage - outer), n * (inner - cage)]
    assert bearing_orders(r, n, RATIO) == pytest.approx(expected)


def test_unequal_balls_pass_the_lobes_at_the_odd_balls_order():
    c = moving((12,))
    place = (1 + 0.21) * (1 + 1 / RATIO) / 2
    zones = EFFECTS["bearing_pass"].term(c, {"ball_to_pitch_ratio": 0.21, "balls": 0, "zones": (2,)}).zones
    assert spanned(zones[0], sine(2 * place, c.theta, 1.0, 0.3))


def test_lobes_act_by_the_tangent_of_the_pressure_angle():
    """5 um of radius at 12 deg make 1.063 um of arc in both zones, half a turn apart."""
    effect = EFFECTS["circular_spline_lobing"]
    shape, coefficients = effect.values({"lobes": 5, "radial_amplitude_um": 5.0, "phase_deg": 30.0}, GEAR)
    c = moving()
    angles = met_angles(c.theta, 1 + 1 / RATIO, np.zeros((2, 2, 1)))
    first, second = sum_of([(effect.term(c, shape).met, np.array(coefficients))], angles)[0]
    arc = 0.005 * tan(radians(12))
    assert first == pytest.approx(arc * np.sin(5 * c.theta + radians(30)))
    assert second == pytest.approx(arc * np.sin(5 * (c.theta + pi) + radians(30)))


@pytest.mark.parametrize(
    ("seat", "advance", "turns"),
    [
        (Seat.CIRCULAR_SPLINE, 1.0, 1.0),
        (Seat.FLEXSPLINE, 1 + 1 / RATIO, 1.0),
        (Seat.CIRCULAR_SPLINE_TWICE, 1.0, 1.0),
        (Seat.FLEXSPLINE_ONCE, 1 + 1 / RATIO, 1.0),
        (Seat.OUTPUT, 1.0, RATIO),
    ],
)
def test_a_damaged_tooth_is_met_where_it_sits(seat, advance, turns):
    """A Gaussian of that standard deviation of travel, once a turn of its part; by the other zone half a turn on."""
    c = moving((60,))
    term = EFFECTS["local_tooth_defect"].term(c, {"centre": 2.0, "width_deg": 6.0, "on": seat})

    def pulse(shift):
        away = np.mod(c.theta * advance - 2.0 - shift, TURN * turns)
        away = np.minimum(away, TURN * turns - away)
        return np.exp(-((away / radians(6.0)) ** 2) / 2)

    if seat.in_zones:
        first, second = met_angles(c.theta, 1 + 1 / RATIO, np.zeros((2, 2, 1)))[term.met.spline]
        assert term.met.columns(first, 0)[:, 0] == pytest.approx(pulse(0.0), abs=1e-9)
        assert term.met.columns(second, 1)[:, 0] == pytest.approx(pulse(pi), abs=1e-9)
    else:
        assert term.columns[:, 0] == pytest.approx(pulse(0.0), abs=1e-9)
    assert (term.columns is not None and term.columns.shape[1] == 2) is seat.twice
    if seat.twice:
        assert term.columns[:, 1] == pytest.approx(pulse(pi), abs=1e-9)


def test_estimated_sines_have_the_amplitude_and_phase_of_their_pair():
    """a sin(x + phi) = a cos(phi) sin(x) + a sin(phi) cos(x); each coefficient known to 0.01."""
    estimate = FitEstimate(np.array([0.3 * np.cos(0.5), 0.3 * np.sin(0.5)]), 1e-4 * np.eye(2))
    amplitude, phase = estimate.amplitude(0, 1), estimate.phase_deg(0, 1)
    assert amplitude.value == pytest.approx(0.3)
    assert (amplitude.low, amplitude.high) == pytest.approx((0.3 - 0.0196, 0.3 + 0.0196), abs=1e-5)
    assert phase.value == pytest.approx(np.degrees(0.5))
    assert phase.high - phase.value == pytest.approx(np.degrees(np.arcsin(0.0196 / 0.3)), rel=1e-6)


def test_numbers_that_follow_have_their_gradients_interval():
    """sqrt(x) at 4 +- 0.2: its slope is 1/4; 95 % is 1.96 standard deviations."""
    estimate = FitEstimate(np.array([4.0]), np.array([[0.04]]))
    found = estimate.derived(lambda v: sqrt(v[0]), "mm")
    assert (found.value, found.high - found.value) == (2.0, pytest.approx(1.96 * 0.05, rel=1e-4))
    scaled = estimate.parameter(0, "um", scale=1e3)
    assert (scaled.low, scaled.high) == pytest.approx((4000 - 392, 4000 + 392), rel=1e-4)
