"""Numbers of single effects at the places where a sign, a shaft or a unit could be exchanged."""

from __future__ import annotations

import math
from dataclasses import replace
from enum import StrEnum
from types import SimpleNamespace

import numpy as np
import pytest
from test_effect_physics import RATE, RATIO, TURN, moving, spanned

from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.orientation import as_counted
from hdopt.diagnosis.search.candidates import in_order, joint_fit, penalty_scale, weigh
from hdopt.diagnosis.settings import DEFAULT
from hdopt.diagnosis.stages import begin
from hdopt.effects import EFFECTS
from hdopt.effects._friction_law import LAWS, Law
from hdopt.effects.base import Effect
from hdopt.effects.declared import Category, Quantity, Shaft
from hdopt.effects.estimate import FitEstimate, Parameter
from hdopt.effects.local_tooth_defect import NARROWEST_DEG, WIDEST_DEG, WIDEST_OUTPUT_DEG, Seat
from hdopt.effects.met import Pulse, Spline, ZoneWaves
from hdopt.effects.prior import outside_prior
from hdopt.effects.probe import best_terms, strongest_orders
from hdopt.effects.resonance import Foot
from hdopt.effects.term import Term
from hdopt.errors import HdoptError
from hdopt.kinematics.cartesian import CartesianModel
from hdopt.study import load_study
from tests.unit.test_diagnosis import bench

GEAR = SimpleNamespace(pressure_angle=math.radians(30), ratio=RATIO)


def test_play_varies_with_the_input():
    """Its slots turn with the wave generator: step sin(2 theta) and step cos(2 theta), not by the output's angle."""
    c = moving()
    plain = EFFECTS["lost_motion"].term(c, {"ramp_arcmin": 9.0}).columns[:, 0]
    columns = EFFECTS["lost_motion"].term(c, {"ramp_arcmin": 9.0, "order": 2}).columns
    np.testing.assert_allclose(columns[:, 1], plain * np.sin(2 * c.theta), atol=1e-12)
    np.testing.assert_allclose(columns[:, 2], plain * np.cos(2 * c.theta), atol=1e-12)


def follower(path, size, left):
    """The error that a play of `size` makes along `path`, both arcmin: the output stands until the play is crossed, of
    which a part (`left`) is left at the start of a way forward."""
    output, error = path[0] - size / 2 + left * size, np.empty(len(path))
    for i, place in enumerate(path):
        output = min(max(output, place - size / 2), place + size / 2)
        error[i] = place - output
    return error


def test_a_recording_may_begin_within_the_play():
    """Two recordings that stand, and then run forward and back, a third and all of the play left to cross first, and
    one that has crossed it: as a follower goes. What is found is the play, and what was left. Would catch a start of
    all recordings alike, and one that lasts."""
    size, ramp = 0.3, 0.3
    parts = [np.r_[np.zeros(200), np.linspace(0, 40, 400), np.linspace(40, 0, 400)] for _ in range(3)]
    error = np.concatenate([follower(path, size, left) for path, left in zip(parts, (1 / 3, 1.0, 0.0), strict=True)])
    path, n = np.concatenate(parts), len(parts[0])
    back = np.tile(np.arange(n) >= 600, 3)
    travel = np.where(back, 40 - path, path) / 60
    c = replace(moving((1,)), theta=path, output=path, direction=np.where(back, -1.0, 1.0), travel=travel, first=~back)
    c = replace(c, record=np.repeat(np.arange(3), n), piece=np.repeat(np.arange(3), n))
    effect = EFFECTS["lost_motion"]
    shape = {"ramp_arcmin": ramp, "start": True}
    columns = effect.term(c, shape).columns
    found = np.linalg.lstsq(columns, error, rcond=None)[0]
    assert found == pytest.approx([0.3, -0.1, -0.3, 0.0], abs=0.002)
    assert effect.lasting(shape) == 1 and effect.lasting({**shape, "order": 2}) == 3
    assert effect.predict(c, shape).columns.shape == (len(c), 1)

    probe = SimpleNamespace(samples=c, residual=error)

    def solve(term):
        coefficients = np.linalg.lstsq(term.columns, probe.residual, rcond=None)[0]
        left = probe.residual - term.columns @ coefficients
        return float(probe.residual @ probe.residual - left @ left) / 1e-4, coefficients

    probe.solve, probe.gains = solve, lambda terms: [solve(term)[0] for term in terms]
    assert ["start" in term.shape for term in effect.search(probe)] == [True, True]
    # What stands beyond either side of the play is no start within it.
    for more in (-0.4, 0.2):
        probe.residual = error + more * (np.arange(len(c)) < 200)
        assert ["start" in term.shape for term in effect.search(probe)] == [False, False]


def test_play_and_half_a_loop_are_sizes():
    """Whichever way the error counts: a step of -0.4 arcmin is play of 0.4, as sure as it is."""
    rows = moving()
    play = EFFECTS["lost_motion"].parameters(
        EFFECTS["lost_motion"].term(rows, {"ramp_arcmin": 9.0}), FitEstimate(np.array([-0.4]), np.array([[0.01]]))
    )["lost_motion_arcmin"]
    assert (play.value, play.low, play.high) == pytest.approx((0.4, 0.4 - 0.196, 0.4 + 0.196))
    term = EFFECTS["hysteresis"].term(rows, {"transition_deg": 2.0, "model": Law.DAHL})
    values = np.array([-0.3, *np.zeros(term.width - 1), 2.0])
    found = EFFECTS["hysteresis"].parameters(term, FitEstimate(values, 1e-4 * np.eye(len(values))))
    assert found["half_loop_arcmin"].value == pytest.approx(0.3)
    assert found["transition_deg"].value == pytest.approx(2.0)


def test_friction_does_not_know_where_a_recording_began():
    """Beside the state that it would have had run in, what was else fades over the same length until the first
    reversal; a recording that begins with one has none of it."""
    c = moving()
    columns = EFFECTS["hysteresis"].term(c, {"transition_deg": 5.0 * np.log(10), "model": Law.DAHL}).columns
    np.testing.assert_allclose(columns[:, 1], np.where(c.first, np.exp(-c.travel / 5.0), 0.0))
    none = EFFECTS["hysteresis"].term(moving(first=np.zeros(len(c), bool)), {"transition_deg": 5.0, "model": Law.DAHL})
    assert none.width == 1


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(("lengths", "is_friction"), [(0.5, True), (9.9, True), (10.0, False), (40.0, False)])
def test_friction_that_is_drawn_to_its_longest_crossing_is_none(lengths, is_friction, law):
    """In passes of sixty input turns, long enough for any crossing of so many deg of a law's length. Fault caught: what
    relaxes for minutes after a reversal, named friction that crosses over within 10 deg (case 33 of run-014).
    """
    hysteresis = EFFECTS["hysteresis"]
    rows = moving(passes=(60, 60))
    assert 0.25 * rows.travel.max() > 40
    term = hysteresis.term(rows, {"transition_deg": lengths * LAWS[law].transition, "model": law})
    nothing = FitEstimate(np.zeros(term.freedom), np.eye(term.freedom))
    assert hysteresis.has_parts
    assert hysteresis.every_part_shows(term, nothing) is is_friction


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(("low_in_rows", "shown"), [(1.9, 0.0), (2.1, 2.1)])
def test_a_crossing_within_two_rows_may_be_as_short_as_it_likes(low_in_rows, shown, law):
    """Rows lie 3 deg of input apart. Fault caught: an interval that ends where the fit may go no further."""
    rows = moving()
    row = 360 / RATE / RATIO * LAWS[law].transition
    term = EFFECTS["hysteresis"].term(rows, {"transition_deg": 3 * row, "model": law})
    said = {"transition_deg": Parameter(3 * row, low_in_rows * row, 4 * row, "deg")}
    seen = EFFECTS["hysteresis"].as_seen(said, term, rows, np.zeros(len(rows)))
    assert seen["transition_deg"].low == pytest.approx(shown * row)
    assert seen["transition_deg"].high == pytest.approx(4 * row)


@pytest.mark.parametrize(("on", "way"), [("circular_spline", 1.0), ("flexspline", 1 + 1 / RATIO)])
@pytest.mark.parametrize("shown_deg", [40.0, 220.0])
def test_the_angle_of_a_tooth_is_where_its_pulse_shows(on, way, shown_deg):
    """A fit may have zone 1 meet the tooth at 40 deg and show its pulse only half a turn on, where zone 2 drives.
    Fault caught: the angle in the fit's own zone 1.
    """
    rows = moving((30, 6))  # long enough for a flexspline's tooth to go half round
    term = EFFECTS["local_tooth_defect"].term(rows, {"centre": np.radians(40.0), "width_deg": 3.0, "on": Seat(on)})
    off = np.mod(np.degrees(rows.theta) * way - shown_deg + 180, 360) - 180
    said = {"angle_deg": Parameter(40.0, 39.0, 41.5, "deg"), "width_deg": Parameter(3.0, 2.0, 4.0, "deg")}
    seen = EFFECTS["local_tooth_defect"].as_seen(said, term, rows, -np.exp(-0.5 * (off / 3.0) ** 2))
    assert seen["angle_deg"] == Parameter(shown_deg, shown_deg - 1.0, shown_deg + 1.5, "deg")
    assert seen["width_deg"] == said["width_deg"]
    once = EFFECTS["local_tooth_defect"].term(rows, {**term.shape, "on": Seat(f"{on}_once")})
    assert EFFECTS["local_tooth_defect"].as_seen(said, once, rows, -np.exp(-0.5 * (off / 3.0) ** 2)) == said


def test_both_directions_lie_a_whole_loop_apart():
    half = {"half_loop_arcmin": Parameter(0.25, 0.2, 0.3, "arcmin"), "transition_deg": Parameter(2, 1, 3, "deg")}
    said = EFFECTS["hysteresis"].sentence({"model": Law.DAHL}, half, 0.1)
    assert "0.5 arcmin apart" in said
    assert "2 deg of output" in said


@pytest.mark.parametrize(("delay", "late"), [(0.002, "output"), (-0.002, "input")])
def test_a_delay_names_the_channel_that_is_late(delay, late):
    """The error of a late output is positive at positive speed: its delay counts positive."""
    said = EFFECTS["channel_delay"].sentence({}, {"delay_s": Parameter(delay, 0, 0, "s")}, 0.1)
    assert said.startswith(f"The {late} channel is read 2 ms later")


def test_a_pulse_is_as_wide_as_its_seat_can_be():
    """Six input turns' worth of a tooth on the output's side, a few degrees in a zone, and half a degree at least."""
    c = moving((60,))
    effect = EFFECTS["local_tooth_defect"]

    def kept(width, seat):
        return effect.term(c, {"centre": 1.0, "width_deg": width, "on": seat}).shape["width_deg"]

    assert kept(100.0, Seat.OUTPUT) == 100.0
    assert kept(1e4, Seat.OUTPUT) == WIDEST_OUTPUT_DEG * RATIO
    assert kept(100.0, Seat.CIRCULAR_SPLINE) == WIDEST_DEG
    assert kept(0.1, Seat.CIRCULAR_SPLINE) == NARROWEST_DEG


def test_more_places_are_more_trials():
    """A defect of the output is looked for over N input turns."""
    c = moving((60,))
    shape = {"centre": 1.0, "width_deg": 5.0}
    once, output = (
        EFFECTS["local_tooth_defect"].term(c, {**shape, "on": seat}).trials
        for seat in (Seat.CIRCULAR_SPLINE_ONCE, Seat.OUTPUT)
    )
    assert output == pytest.approx(RATIO * once)


def test_a_pulse_of_nine_degrees_rises_within_a_quarter_of_its_highest_orders_period():
    assert EFFECTS["local_tooth_defect"].highest_order({"width_deg": 9.0}, RATIO) == pytest.approx(10.0)


def test_a_defect_in_the_file_is_the_one_in_the_fit():
    """deg, um and arcmin there; rad, mm and arcmin here; two heights where it is seen twice, each its own."""
    effect, gear = EFFECTS["local_tooth_defect"], SimpleNamespace(ratio=RATIO)
    keys = {"on": "flexspline", "angle_deg": 90.0, "width_deg": 5.0, "height_um": 4.0}
    shape, coefficients = effect.values(keys, gear)
    assert (shape["centre"], coefficients) == (pytest.approx(math.pi / 2), (pytest.approx(0.004),))
    assert effect.keys(shape, coefficients, gear) == pytest.approx(keys)
    twice = {
        "on": "flexspline_twice",
        "angle_deg": 90.0,
        "width_deg": 5.0,
        "height_arcmin": 0.3,
        "height_2_arcmin": 0.1,
    }
    shape, coefficients = effect.values(twice, gear)
    assert coefficients == (0.3, 0.1)
    assert effect.keys(shape, coefficients, gear) == pytest.approx(twice)
    term = effect.term(moving(), {"centre": 1.0, "width_deg": 5.0, "on": Seat.FLEXSPLINE})
    found = effect.parameters(term, FitEstimate(np.array([0.004, 1.0, 5.0]), 1e-8 * np.eye(3)))
    assert found["height_um"].value == pytest.approx(4.0)
    assert found["angle_deg"].value == pytest.approx(math.degrees(1.0))
    assert found["angle_deg"].high - found["angle_deg"].value == pytest.approx(math.degrees(1.96e-4), rel=1e-3)
    assert found["width_deg"].value == 5.0


def test_a_pulse_met_once_is_an_event():
    """Passing a place counts; beginning beyond it does not."""
    effect, coordinate = EFFECTS["local_tooth_defect"], np.linspace(0.5, 0.5 + 3 * TURN, 300)
    assert effect.meetings(coordinate, TURN, 1.0) == 3
    assert effect.meetings(coordinate[:120], TURN, 1.0) == 2
    assert effect.meetings(coordinate[:90], TURN, 1.0) == 1


def test_a_defect_is_looked_for_where_it_is_met_again(monkeypatch):
    """Fault caught: an event, which nothing repeats, named a tooth."""
    effect = EFFECTS["local_tooth_defect"]
    monkeypatch.setattr(type(effect), "_candidates", lambda self, probe, at, period, seat: [(1.0, 5.0)])
    monkeypatch.setattr("hdopt.effects.local_tooth_defect.best_terms", lambda probe, terms, keep=1: list(terms)[:keep])
    for turns, found in ((1, 0), (3, 2)):
        c = moving((turns,))
        asked = effect.search(SimpleNamespace(samples=c, has_base=False))
        assert len(asked) == found


def test_a_pulse_falls_beyond_its_centre():
    """Its slope by central differences, of a sample and of a mean over a row."""
    angle, step = np.linspace(1.8, 2.2, 41), 1e-6
    for row in (0.0, 0.05):
        pulse = Pulse(Spline.CIRCULAR, 2.0, 0.03, row)
        sides = [pulse.added(angle + side, 0, np.array([0.004]))[0] for side in (-step, step)]
        np.testing.assert_allclose(
            pulse.added(angle, 0, np.array([0.004]))[1], (sides[1] - sides[0]) / (2 * step), atol=1e-7
        )


@pytest.mark.parametrize("zone", [0, 1])
def test_waves_of_a_zone_are_counted_from_its_own_end(zone):
    """sin(5.5 (x - pi zone)) for a zone's first coefficient, nothing of the other's; sum and columns agree."""
    angle = np.linspace(0.0, 9.0, 50)
    waves, coefficients = ZoneWaves(Spline.CIRCULAR, (5.5,)), np.array([1.0, 0.5, -2.0, 0.3])
    own = coefficients[2 * zone : 2 * zone + 2]
    expected = own[0] * np.sin(5.5 * (angle - math.pi * zone)) + own[1] * np.cos(5.5 * (angle - math.pi * zone))
    np.testing.assert_allclose(waves.added(angle, zone, coefficients)[0], expected, atol=1e-12)
    np.testing.assert_allclose(waves.columns(angle, zone) @ coefficients, expected, atol=1e-12)


def test_a_number_is_certainly_outside_where_its_whole_interval_is():
    """Of a resonance's gain, 0.7 to 1.3."""
    effect = EFFECTS["resonance"]
    for value, low, high, certainly in ((2.0, 1.4, 2.6, True), (2.0, 1.2, 2.8, False), (0.5, 0.3, 0.65, True)):
        (found,) = outside_prior(effect, {"gain": Parameter(value, low, high, "1")})
        assert found.certainly is certainly
    assert outside_prior(effect, {"gain": Parameter(1.2, 0.1, 2.3, "1")}) == []


def test_a_resonance_in_the_file_has_its_damper_as_a_share():
    """Coefficients are the gain and gain times share; both ways round, and in the diagnosis."""
    effect, gear = EFFECTS["resonance"], SimpleNamespace(ratio=RATIO)
    keys = {"frequency_hz": 3.0, "damping_ratio": 0.05, "gain": 0.8, "output_share_of_damping": 0.25, "foot": "error"}
    shape, coefficients = effect.values(keys, gear)
    assert coefficients == pytest.approx((0.8, 0.2))
    assert effect.keys(shape, coefficients, gear) == keys
    term = Term("resonance", shape, columns=np.zeros((3, 2)), steps={"frequency_hz": 0.1, "damping_ratio": 0.01})
    found = effect.parameters(term, FitEstimate(np.array([0.8, 0.2, 3.0, 0.05]), 1e-8 * np.eye(4)))
    assert [one.value for one in found.values()] == pytest.approx([0.8, 0.25, 3.0, 0.05])


def test_a_resonance_needs_speeds_that_differ():
    """By 15 % between the slowest and the fastest rows, whatever the direction."""
    effect = EFFECTS["resonance"]
    speed = np.where(np.arange(18 * RATE) % 2, 1.0, 1.1)
    assert effect.lacks(moving(speed=speed)) == "speeds that differ by more than 15 %"
    assert effect.lacks(moving(speed=speed * np.where(speed > 1.05, -1.1, 1.0))) is None
    assert effect.lacks(moving(time=None)) == "a time column"


class Known:
    """A probe whose gains and spectrum are written down."""

    def __init__(self, gains=(), amplitude=None, rows=1000):
        self.written, self.amplitude = gains, amplitude
        self.residual = np.zeros(rows)
        self.samples = SimpleNamespace(span_turns=20.0, rows_per_turn=100.0)
        self.order_range = (0.0, 45.0)

    def gain(self, term):
        return self.written[term.shape["at"]]

    def gains(self, terms):
        return [self.gain(term) for term in terms]

    def spectrum(self, orders):
        return self.amplitude(np.asarray(orders))


def variant(at, width=1, odds=0.0):
    return Term("output_coupling", {"at": at}, columns=np.zeros((2, width)), odds=odds)


def test_a_variant_pays_for_its_freedom_and_its_odds():
    """log(1000) = 6.9 for each coefficient and twice its log odds, in noise variances."""
    probe = Known((20.0, 26.0, 30.0, 22.0))
    wide, likely, unlikely = variant(1, width=2), variant(3, odds=0.0), variant(2, odds=-6.0)
    assert best_terms(probe, [variant(0), wide])[0].shape["at"] == 0
    assert best_terms(Known((20.0, 27.5)), [variant(0), wide])[0].shape["at"] == 1
    assert best_terms(probe, [unlikely, likely])[0].shape["at"] == 3
    assert [term.shape["at"] for term in best_terms(probe, [variant(0), likely, unlikely], 2)] == [3, 0]


def test_strongest_orders_are_separate_and_within_the_record():
    """A line of 20 turns is 1/20 wide: its flanks are no lines. Below one cycle a record there is none."""

    def amplitude(orders):
        line = np.sinc(20 * (orders - 7.0))
        return np.abs(line) + 0.5 * np.abs(np.sinc(20 * (orders - 3.0))) + 5.0 * (orders < 0.049)

    found = strongest_orders(Known(amplitude=amplitude), 2, lowest=0.01)
    assert found == pytest.approx([7.0, 3.0], abs=0.5 / 20 / 4)


def test_each_wave_of_an_encoder_has_its_own_pair():
    """Sine 3 and cosine 4 are 5 at once a turn, 12 and 5 are 13 at twice, 8 and -6 are 10 at three times."""
    effect = EFFECTS["encoder_output_eccentricity"]
    term = Term(effect.id, {"orders": (1, 2, 3), "shaft": Shaft.OUTPUT}, columns=np.zeros((4, 6)))
    found = effect.parameters(term, FitEstimate(np.array([3.0, 4.0, 12.0, 5.0, 8.0, -6.0]), 1e-10 * np.eye(6)))
    sizes = [one.value for name, one in found.items() if name.startswith("amplitude")]
    phases = [one.value for name, one in found.items() if name.startswith("phase")]
    assert sizes == pytest.approx([5.0, 13.0, 10.0], abs=1e-6)
    assert phases == pytest.approx(np.degrees(np.arctan2([4.0, 5.0, -6.0], [3.0, 12.0, 8.0])), abs=1e-6)


@pytest.mark.parametrize("seat", [Seat.CIRCULAR_SPLINE, Seat.CIRCULAR_SPLINE_TWICE])
@pytest.mark.parametrize("at", [0.3, 2.0, 2.9])
def test_pulses_are_looked_for_where_the_folded_residual_has_them(seat, at):
    """A pulse of 3 deg over one turn, or over half of one where it is met twice; a cell of the fold is 2.8 deg."""
    period = TURN / (2 if seat.twice else 1)
    theta = np.linspace(0, 20 * TURN, 20_000)
    off = np.mod(theta - at + period / 2, period) - period / 2
    probe = SimpleNamespace(residual=np.exp(-0.5 * (off / np.radians(3)) ** 2), samples=SimpleNamespace(ratio=80.0))
    found = EFFECTS["local_tooth_defect"]._candidates(probe, theta, TURN, seat)
    strongest = [centre for centre, _ in found[1::2]]
    assert strongest == pytest.approx([at] * len(strongest), abs=np.radians(2.9))


def test_an_encoders_second_cycle_is_that_of_half_its_lines():
    """100 lines of one shaft are part of 200 of the same; 200 are none of 100, nor those of the other shaft."""
    effect = EFFECTS["encoder_interpolation"]
    few = {"lines": 100, "shaft": Shaft.INPUT}
    assert effect.is_part_of(few, {"lines": 200, "shaft": Shaft.INPUT})
    assert not effect.is_part_of({"lines": 200, "shaft": Shaft.INPUT}, few)
    assert not effect.is_part_of(few, {"lines": 200, "shaft": Shaft.OUTPUT})


def test_an_encoder_whose_second_cycle_stands_at_the_mesh_is_doubtful():
    """102 teeth for N = 50: 51 lines a turn of the input, twice. One alone at 51 is none."""
    effect, c = EFFECTS["encoder_interpolation"], moving()
    lines = {"lines": 51, "shaft": Shaft.INPUT}
    assert effect.term(c, {**lines, "cycles": (1, 2)}).doubtful
    assert not effect.term(c, {**lines, "cycles": (1,)}).doubtful
    assert spanned(effect.term(c, {**lines, "cycles": (1,)}).columns, np.sin(51 * c.theta + 0.2))


@pytest.mark.parametrize(
    ("lines", "shaft", "ratio", "other"),
    [
        (9, Shaft.INPUT, 80.0, 720),
        (720, Shaft.OUTPUT, 80.0, 9),
        (160, Shaft.OUTPUT, 80.0, 0),
        (500, Shaft.OUTPUT, 80.0, 0),
        (9, Shaft.INPUT, 79.95, 0),
    ],
    ids=["input", "output", "too few", "no whole number", "no whole ratio"],
)
def test_lines_that_stand_at_the_same_orders_on_the_other_shaft_are_said(lines, shaft, ratio, other):
    """9 lines a turn of the input are 720 of the output at 80:1. Would catch 9 told as certain where 720 are true."""
    effect = EFFECTS["encoder_interpolation"]
    term = effect.term(replace(moving(), ratio=ratio), {"lines": lines, "shaft": shaft, "cycles": (1,)})
    found = effect.parameters(term, FitEstimate(np.ones(2), np.eye(2)))
    number = found["lines"]
    assert (number.value, number.low, number.high) == (lines, *sorted((lines, other or lines)))
    said = effect.sentence(term.shape, found, 0.1)
    assert (f"between its {lines} lines" in said) and ((f"its {other}, at the same orders" in said) is bool(other))


@pytest.mark.parametrize(
    ("seat", "angle", "where"),
    [
        (Seat.OUTPUT, 740.9, "at 740.9 deg of wave-generator travel"),
        (Seat.CIRCULAR_SPLINE_ONCE, 380.0, "at 20.0 deg"),
        (Seat.CIRCULAR_SPLINE, 303.3, "at 123.3 or 303.3 deg"),
    ],
)
def test_a_damaged_tooth_is_said_where_it_is_met(seat, angle, where):
    """One at the output is met once in N turns of the wave generator: its angle is not taken back into the first. Teeth
    that the driving zone meets may be met by either end."""
    numbers = {"angle_deg": Parameter(angle, angle, angle, "deg"), "width_deg": Parameter(5.0, 5.0, 5.0, "deg")}
    said = EFFECTS["local_tooth_defect"].sentence({"on": seat}, numbers, 0.1)
    assert f"{where} makes a pulse" in said


def test_every_cycle_of_an_encoders_line_is_said():
    """0.3 arcmin of offsets, one cycle a line, and 0.1 of unequal gains, two: each with its phase, and in the sentence.
    Turned round in both angles each keeps its size, and its phase changes its sign."""
    effect = EFFECTS["encoder_interpolation"]
    values = np.array([0.3 * math.cos(0.5), 0.3 * math.sin(0.5), 0.1 * math.cos(2.0), 0.1 * math.sin(2.0)])
    term = effect.term(moving(), {"lines": 20, "shaft": Shaft.INPUT, "cycles": (1, 2)})
    found = effect.parameters(term, FitEstimate(values, 1e-8 * np.eye(4)))
    sizes = {"amplitude_arcmin": 0.3, "amplitude_2_arcmin": 0.1}
    phases = {"phase_deg": math.degrees(0.5), "phase_2_deg": math.degrees(2.0)}
    assert {name: one.value for name, one in found.items()} == pytest.approx({"lines": 20} | sizes | phases)
    said = effect.sentence(term.shape, found, 0.1)
    assert said.endswith(": 0.3 and 0.1 arcmin at the output in 1 and 2 cycles a line.")
    turned = {name: one.value for name, one in as_counted(found, term).items()}
    assert turned == pytest.approx({"lines": 20} | sizes | {name: -phase for name, phase in phases.items()})
    alone = effect.term(moving(), {"lines": 20, "shaft": Shaft.INPUT, "cycles": (1,)})
    found = effect.parameters(alone, FitEstimate(values[:2], 1e-8 * np.eye(2)))
    assert effect.sentence(alone.shape, found, 0.1).endswith(": 0.3 arcmin at the output.")


def test_lobes_of_a_ring_act_by_the_tangent_there_and_back():
    """30 deg, where sine and tangent are 0.500 and 0.577: 10 um of radius are 5.77 um of arc, and back."""
    effect, gear = EFFECTS["circular_spline_lobing"], SimpleNamespace(pressure_angle=math.radians(30), ratio=RATIO)
    shape, coefficients = effect.values({"lobes": 6, "radial_amplitude_um": 10.0, "phase_deg": 90.0}, gear)
    assert coefficients == pytest.approx((0.0, 0.01 * math.tan(math.radians(30))), abs=1e-15)
    written = effect.keys(shape, coefficients, gear)
    assert written == pytest.approx({"lobes": 6, "radial_amplitude_um": 10.0, "phase_deg": 90.0})


def test_lobes_and_their_overtone_there_and_back():
    """As bolts that press in a narrow place make them. Would catch an overtone that loses its phase or its size, and
    one that a study cannot write."""
    effect, gear = EFFECTS["circular_spline_lobing"], SimpleNamespace(pressure_angle=math.radians(30), ratio=RATIO)
    given = {"lobes": 8, "radial_amplitude_um": 10.0, "phase_deg": 90.0}
    given |= {"radial_amplitude_2_um": 4.0, "phase_2_deg": -30.0}
    shape, coefficients = effect.values(given, gear)
    arc = 1e-3 * math.tan(math.radians(30))
    expected = (0.0, 10 * arc, 4 * arc * math.cos(math.radians(30)), -4 * arc * 0.5)
    assert coefficients == pytest.approx(expected, abs=1e-15)
    assert effect.keys(shape, coefficients, gear) == pytest.approx(given)
    assert effect.orders(shape, RATIO) == [8.0, 16.0]
    assert effect.term(None, shape).met.harmonics == (8, 16)
    assert effect.term(None, shape).odds == -10.0


@pytest.mark.parametrize(("overtone", "waves"), [(0.0, (1,)), (0.05, (1, 2))])
def test_the_overtone_of_lobes_is_found_where_it_is(overtone, waves):
    """Eight lobes and a quarter as much at sixteen were named an input encoder of eight lines."""
    records = bench(
        load_study(drive="csf-25-80"),
        lambda s: 0.2 * np.sin(8 * s["theta"] + 0.3) + overtone * np.sin(16 * s["theta"] + 1.1),
        turns=20,
        rate=60,
    )
    start = begin(records, CartesianModel.of(load_study(drive="csf-25-80").drive), 1, DEFAULT).base
    scale, offered = penalty_scale(start.problem), EFFECTS["circular_spline_lobing"].search(FitProbe(start))
    best = in_order(weigh(joint_fit(start, [term]), start, scale) for term in offered)[0].fit.terms[0]
    assert (best.shape["lobes"], best.shape["waves"]) == (8, waves)


def test_an_overtone_does_not_take_the_place_of_its_wave():
    """Eight lobes were said to be four, whose overtone they are: it took up a part of 2,000 of them at four, and no
    eight alone were offered beside."""
    effect, c = EFFECTS["circular_spline_lobing"], moving()
    found = []
    for size in (0.9, 1.0, 1.1):
        term = effect.term(c, {"lobes": 4, "waves": (1, 2)})
        found.append(effect.every_part_shows(term, FitEstimate(np.array([0.6, 0.8, 0, size]), np.eye(4))))
    assert found == [True, True, False]
    assert effect.every_part_shows(effect.term(c, {"lobes": 4}), FitEstimate(np.array([0.6, 0.8]), np.eye(2)))
    gains = {(4, (1, 2)): 9e4, (8, (1, 2)): 8.9e4, (6, (1, 2)): 8.8e4, (8, (1,)): 8.5e4}
    probe = SimpleNamespace(
        samples=c,
        residual=np.zeros(1000),
        gains=lambda terms: [gains.get((t.shape["lobes"], t.shape["waves"]), 0.0) for t in terms],
    )
    offered = [(term.shape["lobes"], term.shape["waves"]) for term in effect.search(probe)]
    assert offered[0] == (8, (1,)) and offered[2:] == [(4, (1, 2))]


def test_warming_may_take_ten_records():
    """And a hundredth of one at least."""
    effect, c = EFFECTS["thermal_drift"], moving()
    duration = np.ptp(c.time)
    for asked, kept in ((5.0, 5.0), (50.0, 10.0), (1e-4, 0.01)):
        term = effect.term(c, {"time_constant_s": asked * duration})
        assert term.shape["time_constant_s"] == pytest.approx(kept * duration)


@pytest.mark.parametrize(("step", "shortest"), [(0.01, 0.03), (1e-6, 1e-4)], ids=["by the rows", "by the travel"])
def test_friction_is_looked_for_from_what_the_rows_hold_to_a_part_of_the_longest_pass(monkeypatch, step, shortest):
    """Fourteen lengths in equal ratios: from 0.7 of three rows' travel, or of a ten-thousandth of the longest pass of
    1 deg, to 0.14 of that pass."""
    asked = []
    monkeypatch.setattr("hdopt.effects.hysteresis.best_terms", lambda probe, terms: ["found"])
    monkeypatch.setattr("hdopt.effects.hysteresis.terms_at", lambda effect, samples, shapes: asked.append(shapes) or [])
    monkeypatch.setattr(type(EFFECTS["hysteresis"]), "_shape", staticmethod(lambda law, half: half))
    travel = np.append(np.arange(100) * step, 1.0)
    EFFECTS["hysteresis"].search(SimpleNamespace(samples=SimpleNamespace(locked=False, travel=travel)))
    lengths = 0.7 * shortest * (0.14 / (0.7 * shortest)) ** (np.arange(14) / 13)
    assert all(shapes == pytest.approx(lengths) for shapes in asked) and len(asked) > 1


def test_warming_is_looked_for_from_a_twentieth_of_the_record_to_five(monkeypatch):
    """Twelve time constants in equal ratios, of a record of 300 s, begun at 1000 s."""
    effect, asked = EFFECTS["thermal_drift"], []
    monkeypatch.setattr("hdopt.effects.thermal_drift.terms_at", lambda effect, samples, shapes: asked.extend(shapes))
    monkeypatch.setattr("hdopt.effects.thermal_drift.best_terms", lambda probe, terms: [])
    c = replace(moving(), time=1000 + np.linspace(0, 300, len(moving())))
    effect.search(SimpleNamespace(samples=c))
    found = [shape["time_constant_s"] for shape in asked]
    assert found == pytest.approx(15 * 100 ** (np.arange(12) / 11))


@pytest.mark.parametrize(
    ("begun", "sizes"), [((0, 0), (0.5,)), ((30, 281), (0.5 * math.exp(-0.3), 0.5 * math.exp(-2.81)))]
)
def test_one_warming_is_found_where_the_clock_begins_anew_in_each_recording(begun, sizes):
    """Of 100 s, over two recordings of 151 s: both begun cold; or the first 30 s after the bench was switched on, the
    second 281 s after. Would catch the second taken for cold (it was `unknown`), its amplitude not its own, and two
    amplitudes where one serves."""
    study = load_study(drive="csf-25-80")
    records = bench(
        study,
        lambda s: 0.5 * (1 - np.exp(-(s["time"] + begun[s["index"]]) / 100)),
        turns=24,
        rate=60,
        speeds=(2.0, 2.0),
    )
    start = begin(records, CartesianModel.of(study.drive), 1, DEFAULT).base
    effect = EFFECTS["thermal_drift"]
    scale = penalty_scale(start.problem)
    best = in_order(weigh(joint_fit(start, [term]), start, scale) for term in effect.search(FitProbe(start)))[0].fit
    assert [term.width for term in best.terms] == [len(sizes)]
    estimate = best.estimates()[0]
    told = [estimate.parameter(i, "arcmin") for i in range(len(sizes))]
    told.append(effect.parameters(best.terms[0], estimate)["time_constant_s"])
    for one, true in zip(told, [*sizes, 100.0], strict=True):
        assert one.low < true < one.high and one.high - one.low < 0.4 * true + 0.05
    said = effect.sentence(best.terms[0].shape, effect.parameters(best.terms[0], estimate), 0.1)
    assert ("in the first recording" in said) is (len(sizes) > 1)


@pytest.mark.parametrize(
    "keys",
    [
        {"coefficient_arcmin_per_k": 0.1, "amplitude_arcmin": 0.2},
        {"coefficient_arcmin_per_k": 0.1, "time_constant_s": 60.0},
        {"coefficient_arcmin_per_k": 0.1, "amplitude_arcmin": 0.2, "time_constant_s": 60.0},
        {"amplitude_arcmin": 0.2},
        {"time_constant_s": 60.0},
        {},
    ],
    ids=lambda keys: " and ".join(keys) or "nothing",
)
def test_a_drift_follows_the_temperature_or_time(keys):
    """Would catch a key that is dropped without a word, and half a pair that is filled up."""
    every = dict.fromkeys(("coefficient_arcmin_per_k", "amplitude_arcmin", "time_constant_s"))
    with pytest.raises(HdoptError, match="follows either the temperature or time"):
        EFFECTS["thermal_drift"].values({**every, **keys}, GEAR)


class Hum(StrEnum):
    ONE = "one"
    OTHER = "other"


class Declared(Effect):
    """An effect that is all declared: a category, a whole number, a number of its shape and one of its columns."""

    id = "declared"
    domain = "time"
    separating = "none"
    declared = (
        Category("hum", Hum, "which"),
        Quantity("lines", "1", "whole", "n", (3, 7), whole=True),
        Quantity("decay", "1", "of its shape", "d", (0.1, 2.0)),
        Quantity("size_um", "um", "of its columns", "s", scale=4.0),
    )

    def columns(self, conditions, shape):
        return np.ones((len(conditions), 1))


def test_what_is_declared_is_looked_for_over_all_its_values(monkeypatch):
    """Each whole number of its prior, both ends, each category and nine places of what is continuous are trials: 90.
    Would catch an end left out, and names that pay for fewer trials than were made."""
    effect, asked = Declared(), []
    monkeypatch.setattr("hdopt.effects.base.search_on_grid", lambda probe, *grid: asked.append(grid[:2]) or [])
    effect.search(SimpleNamespace(samples=None))
    ((axes, discrete),) = asked
    assert [(axis.name, axis.low, axis.high) for axis in axes] == [("decay", 0.1, 2.0)]
    assert discrete == {"hum": [Hum.ONE, Hum.OTHER], "lines": [3, 4, 5, 6, 7]}
    assert effect.term(moving(), {"hum": Hum.ONE, "lines": 3, "decay": 1.0}).trials == 9 * 2 * 5


def test_what_is_declared_goes_into_a_file_and_back():
    """A coefficient is its number over the scale; a whole number stays one."""
    effect, keys = Declared(), {"hum": "other", "lines": 5.0, "decay": 0.5, "size_um": 6.0}
    shape, coefficients = effect.values(keys, GEAR)
    assert (shape, coefficients) == ({"hum": Hum.OTHER, "lines": 5, "decay": 0.5}, (1.5,))
    assert isinstance(shape["lines"], int)
    assert effect.keys(shape, coefficients, GEAR) == keys


def test_a_resonance_is_looked_for_from_the_slowest_turn_to_sixteen_of_the_fastest(monkeypatch):
    """Turns a second, not radians: at 10 and 20 of them from 8 Hz to 320 Hz, for each kind of foot."""
    effect, asked = EFFECTS["resonance"], []
    speed = TURN * np.where(np.arange(200) < 100, 10.0, -20.0)
    monkeypatch.setattr(type(effect), "_of_foot", lambda self, probe, frequencies, foot: asked.append(frequencies))
    monkeypatch.setattr("hdopt.effects.resonance.best_terms", lambda probe, terms, keep=1: [])
    effect.search(SimpleNamespace(samples=SimpleNamespace(known_speed=speed)))
    assert len(asked) == 2
    assert (asked[0][0], asked[0][-1]) == pytest.approx((8.0, 320.0))


def test_each_kind_of_foot_is_a_trial_more():
    """Where the whole motion swings it, the error alone might have."""
    effect, c = EFFECTS["resonance"], moving()
    shape = {"frequency_hz": 3.0, "damping_ratio": 0.05}
    alone, whole = (
        effect.term(c, {**shape, "foot": foot}, np.zeros(len(c))).trials for foot in (Foot.ERROR, Foot.WHOLE_MOTION)
    )
    assert whole == 2 * alone


# what the rows of a recording are


def test_a_few_rows_the_other_way_are_no_reversal():
    """One in fifty of each direction at least: an encoder's flutter is less."""
    c = moving((40,))
    for share, reverses in ((0.01, False), (0.03, True)):
        way = np.where(np.arange(len(c)) < share * len(c), -1.0, 1.0)
        assert moving((40,), direction=way).reverses is reverses


def test_the_span_is_that_of_the_longest_recording():
    """Two of six turns whose counts are a hundred turns apart."""
    c = moving((6, 6))
    record = (np.arange(len(c)) >= len(c) // 2).astype(int)
    apart = moving((6, 6), theta=c.theta + 100 * TURN * record, record=record)
    assert apart.span_turns == pytest.approx(6.0, abs=0.02)


def test_rows_a_turn_are_the_usual_ones_within_a_piece():
    """A gap of three turns between two pieces, and a tenth of the rows lost in them, change nothing."""
    c = moving((12,))
    kept = np.arange(len(c)) % 10 != 3
    piece = (np.arange(len(c)) >= 700).astype(int)
    theta = c.theta + 3 * TURN * piece
    fewer = {k: v[kept] for k, v in vars(c).items() if isinstance(v, np.ndarray)}
    lost = moving((12,), **fewer | {"theta": theta[kept], "piece": piece[kept]})
    assert lost.rows_per_turn == pytest.approx(RATE)
    assert lost.highest_order == pytest.approx(0.45 * RATE)
    averaged = moving((12,), averaged=4.0)
    assert averaged.are_averages and not moving((12,), averaged=1.1).are_averages
    assert averaged.highest_order == pytest.approx(0.35 * RATE)


def test_a_piece_begins_with_the_speed_of_its_first_rows():
    """At a steady acceleration the line through five rows has the speed of their middle, the third."""
    n, dt = 50, 0.01
    time = dt * np.arange(n)
    cut = {k: v[:n] for k, v in vars(moving()).items() if isinstance(v, np.ndarray)}
    speed, beyond = moving(**cut | {"time": time, "theta": 3.0 + 0.5 * 4.0 * time**2}).starting_motion
    assert speed == pytest.approx(np.full(n, 4.0 * 2 * dt))
    assert beyond == pytest.approx(0.5 * 4.0 * time**2 - 4.0 * 2 * dt * time)


# bearings


@pytest.mark.parametrize(("lobes", "odds"), [(2, -2.0), (3, 0.0), (4, 0.0), (12, 0.0)])
def test_two_lobes_are_less_likely_than_what_jaws_and_bolts_make(lobes, odds):
    """A cumulative pitch error has two waves before it has more; three jaws make three lobes. Fault caught: three lobes
    told as one wave of the teeth, in nine of nine registered cases that had lobes."""
    assert EFFECTS["circular_spline_lobing"].term(None, {"lobes": lobes}).odds == odds


def bearing(sizes, sigma=0.01, ratio=0.14, **shape):
    """Whether every part of a bearing shows whose sines have these sizes, known to sigma."""
    values = np.ravel([(size, 0.0) for size in sizes])
    term = Term(
        "bearing_pass",
        {"ball_to_pitch_ratio": ratio, "balls": 20, **shape},
        columns=np.zeros((3, len(values))),
        steps={"ball_to_pitch_ratio": 1e-3},
    )
    covariance = np.diag(np.r_[np.full(len(values), sigma**2), 1e-9])
    return EFFECTS["bearing_pass"].every_part_shows(term, FitEstimate(np.r_[values, ratio], covariance))


def test_named_lines_of_a_bearing_must_all_be_there():
    """Four standard deviations, and a tenth of the strongest; a ball is between 0.04 and 0.35 of the pitch circle."""
    lines = {"lines": (0, 3)}
    assert bearing((0.2, 0.045), **lines)
    assert not bearing((0.2, 0.035), **lines)
    assert not bearing((0.2, 0.0008), sigma=1e-4, **lines)
    assert not bearing((0.2, 0.015), sigma=1e-4, **lines)
    assert not bearing((0.2, 0.2), ratio=0.03, **lines)
    assert not bearing((0.2, 0.2), ratio=0.36, **lines)


def test_of_many_waves_of_unequal_balls_half_must_show():
    """Of ten waves five; of three all."""
    shown, hidden = 0.05, 0.03
    assert bearing([shown] * 5 + [hidden] * 5, zones=tuple(range(1, 11)))
    assert not bearing([shown] * 4 + [hidden] * 6, zones=tuple(range(1, 11)))
    assert not bearing([shown] * 2 + [hidden], zones=(1, 2, 3))
    assert bearing([shown] * 3, zones=(1, 2, 3))
