"""What effects need, offer and refuse, at their bounds; and over all of them: that a search finds its own effect."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from test_effect_physics import GEAR, RATE, RATIO, TURN, moving
from test_windup_curves import fit_of

from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.settings import DEFAULT
from hdopt.diagnosis.stages import begin
from hdopt.drive.geometry import ARCMIN
from hdopt.effects import EFFECTS, cs_tooth_harmonics
from hdopt.effects import hysteresis as friction
from hdopt.effects._friction_torque import friction_columns
from hdopt.effects._zone_harmonics import strongest_few
from hdopt.effects.cs_tooth_harmonics import CircularSplineToothHarmonics
from hdopt.effects.declared import REQUIRED, Numbers, Quantity, Shaft, Sines
from hdopt.effects.encoder_interpolation import _with_neighbours, are_of_the_mesh, beside_the_mesh
from hdopt.effects.estimate import FitEstimate
from hdopt.effects.grid_search import Axis
from hdopt.effects.local_tooth_defect import WIDEST_DEG, WIDEST_OUTPUT_DEG, Seat
from hdopt.effects.requirements import requirement
from hdopt.effects.term import Term
from hdopt.errors import HdoptError, MissingValue
from hdopt.kinematics.cartesian import CartesianModel
from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather
from hdopt.study import load_study
from tests.unit.test_diagnosis import bench

EACH = pytest.mark.parametrize("effect", EFFECTS.values(), ids=EFFECTS)
RECORD = moving((14, 14, 14))


def columns_of(effect, example):
    """What an effect adds at the output at an `example`, arcmin; None of one that acts in the zones, that another
    number of teeth has, or that this record, with 120 rows a turn, cannot show."""
    defaults = {i.key: i.default for i in effect.flat_declared() if isinstance(i.default, (str, float, int))}
    try:
        shape, coefficients = effect.values({**defaults, **example}, GEAR)
    except HdoptError:
        return None
    if effect.highest_order(shape, RATIO) > 0.4 * RATE:
        return None
    term = effect.predict(RECORD, shape, np.zeros(len(RECORD)))
    return None if term.columns is None or effect.lacks(RECORD) else term.columns @ np.array(coefficients)


OWN = [
    pytest.param(effect, example, hidden, id=f"{effect.id}-{number}")
    for effect in EFFECTS.values()
    for number, example in enumerate(effect.examples)
    if effect.id != "torsional_windup" and (hidden := columns_of(effect, example)) is not None
]
"""Effects that act at the output or the bench with each of their examples; the windup has a file of its own."""


@pytest.mark.parametrize(("effect", "example", "hidden"), OWN)
def test_a_search_offers_what_a_fit_makes_the_effect_of(effect, example, hidden):
    """Of a record that holds an example and nothing else a fit from an offered term leaves a thousandth, and has the
    example's own numbers. Would catch a grid in another unit or without its ends, and a variant that is not offered."""
    offered = effect.search(FitProbe(refine(fit_of(RECORD, hidden), 2)))
    fits = (refine(fit_of(RECORD, hidden, [term]), 10) for term in offered)
    best = next((fit for fit in fits if np.std(fit.residual) < 1e-3 * np.std(hidden)), None)
    assert best is not None
    found = effect.keys(best.terms[0].shape, best.coefficients[0], GEAR)
    # Lines of one shaft are lines of the other too, where these are whole: then their phase counts from its angle.
    alike = all(found[k] == v for k, v in example.items() if isinstance(v, str) and k in found)
    numbers = {k: v for k, v in example.items() if isinstance(v, float) and k in found and (alike or "phase" not in k)}
    assert numbers
    for key, value in numbers.items():
        whole_turns = 360 * round((found[key] - value) / 360) if key.endswith("_deg") else 0.0
        assert found[key] - whole_turns == pytest.approx(value, rel=0.01, abs=1e-3), key


def test_the_search_was_asked_of_most_effects():
    assert len({param.values[0].id for param in OWN}) >= 9


# what an effect declares


@EACH
def test_no_sine_has_an_amplitude_below_zero(effect):
    """A sign is a phase: an amplitude of -1 would be one beside another phase without a word."""
    for one in effect.declared:
        if isinstance(one, Sines):
            amplitudes = [q for q in one.quantities() if q.unit == one.unit]
            assert amplitudes and all(q.at_least == 0.0 and q.prior == one.prior for q in amplitudes)
            assert one.prior is not None and 0.0 <= one.prior[0] < one.prior[1]


@EACH
def test_the_one_sine_of_an_effect_must_be_given(effect):
    for one in effect.declared:
        if isinstance(one, Sines) and len(one.members) == 1:
            beside = [
                other for other in effect.declared if isinstance(other, Quantity | Numbers | Sines) and other != one
            ]
            assert beside or all(q.default is REQUIRED for q in one.quantities())


@EACH
def test_the_highest_of_the_orders_decides_how_fine_a_grid_is(effect):
    """Would catch the lowest taken for it: a wave would be walked over with too few angles."""
    for example in effect.examples:
        defaults = {i.key: i.default for i in effect.flat_declared() if isinstance(i.default, (str, float, int))}
        try:
            shape, _ = effect.values({**defaults, **example}, GEAR)
        except HdoptError:  # other numbers of teeth
            continue
        orders = effect.orders(shape, RATIO)
        assert effect.highest_order(shape, RATIO) >= max(orders, default=0.0)


# what a record must hold


def still(**changes):
    c = moving()
    return replace(c, direction=np.ones(len(c)), **changes)


@pytest.mark.parametrize(
    ("domain", "having", "lacking", "said"),
    [
        ("reversal", {}, still(), "a reversal"),
        ("direction", {}, still(), "a reversal"),
        ("torque", {}, moving(torque=None), "a torque column"),
        ("torque", {}, moving(torque=np.zeros(18 * RATE)), "torque that varies"),
        ("speed", {"speed": np.linspace(2, 3, 18 * RATE)}, moving(speed=None), "a time column"),
        ("speed", {"speed": np.linspace(2, 3, 18 * RATE)}, moving(speed=np.full(18 * RATE, 2.0)), "speed that varies"),
        ("temperature", {}, moving(temperature=None), "a temperature column"),
        ("temperature", {}, moving(temperature=np.full(18 * RATE, 20.0)), "temperature that varies"),
        ("time", {}, moving(time=None), "a time column"),
        ("angle", {}, moving((1,), theta=np.linspace(0, 0.9 * TURN, RATE)), "a whole input turn"),
    ],
)
def test_each_domain_needs_its_channel(domain, having, lacking, said):
    assert requirement(domain, moving(**having)) is None
    assert requirement(domain, lacking) == said


@pytest.mark.parametrize(
    ("domain", "channel", "least"), [("torque", "torque", 0.02), ("speed", "speed", 0.003)], ids=["torque", "speed"]
)
def test_a_channel_varies_from_a_share_of_its_largest_value(domain, channel, least):
    """Half of the rows at 1 and half at 1 - 2 d have the standard deviation d: a little more, and a little less."""
    for share, varies in ((1.15 * least, True), (0.85 * least, False)):
        values = 10 * (1 - 2 * share * (np.arange(18 * RATE) % 2))
        assert (requirement(domain, moving(**{channel: values})) is None) == varies


@pytest.mark.parametrize(("span", "varies"), [(0.025, True), (0.015, False)])
def test_a_bench_warms_from_a_fiftieth_of_a_kelvin(span, varies):
    found = requirement("temperature", moving(temperature=20 + np.linspace(0, span, 18 * RATE)))
    assert (found is None) == varies


@pytest.mark.parametrize(
    ("name", "turns"),
    [("encoder_input_eccentricity", 1.0), ("output_coupling", 7.5), ("encoder_output_eccentricity", 10.0)],
)
def test_a_shafts_sine_needs_a_turn_of_its_shaft_or_the_least_part_of_it(name, turns):
    """In turns of the input, at N = 50: of an output encoder a fifth of an output turn, of a coupling 0.15 of one."""
    effect = EFFECTS[name]
    for share, shown in ((1.1, True), (0.9, False)):
        c = moving((25,), theta=np.linspace(0, share * turns * TURN, 25 * RATE))
        assert (effect.lacks(c) is None) == shown


# bounds of shapes and studies


@pytest.mark.parametrize(
    ("seat", "widest"), [(Seat.CIRCULAR_SPLINE, WIDEST_DEG), (Seat.OUTPUT, WIDEST_OUTPUT_DEG * RATIO)]
)
def test_a_pulse_that_is_too_wide_for_its_seat_is_refused(seat, widest):
    height = {"height_um": 4.0} if seat.in_zones else {"height_arcmin": 0.2}
    keys = {"on": seat.value, "angle_deg": 90.0, **height}
    shape, _ = EFFECTS["local_tooth_defect"].values({**keys, "width_deg": 0.99 * widest}, GEAR)
    assert shape["width_deg"] == 0.99 * widest
    with pytest.raises(HdoptError, match=f"is at most {widest:g} deg"):
        EFFECTS["local_tooth_defect"].values({**keys, "width_deg": 1.01 * widest}, GEAR)


def test_a_pulse_is_weighed_by_how_often_its_place_was_met():
    """Three whole turns with a pulse of 1 at 200 deg, and twenty strokes over the first quarter with one of 0.3 at 45:
    in deviations of one meeting 1 x sqrt(3) = 1.7 and 0.3 x sqrt(23) = 1.4."""
    whole, stroke = np.linspace(0, 3 * TURN, 3000, endpoint=False), np.linspace(0, TURN / 4, 250, endpoint=False)
    theta = np.concatenate([whole, *[stroke] * 20])
    residual = sum(
        height * np.exp(-0.5 * ((np.mod(np.degrees(theta), 360) - at) / 3) ** 2)
        for at, height in ((200, 1.0), (45, 0.3))
    )
    probe = SimpleNamespace(residual=residual, samples=SimpleNamespace(ratio=RATIO))
    found = EFFECTS["local_tooth_defect"]._candidates(probe, theta, TURN, Seat.CIRCULAR_SPLINE_ONCE)
    strongest = [centre for centre, width in found[1::2] if width < 6]
    assert strongest and np.degrees(strongest) == pytest.approx([200.0] * len(strongest), abs=3.0)


def test_lines_of_balls_need_their_number():
    """The cage alone needs none; with the balls at the outer race it does."""
    cage = {"ball_to_pitch_ratio": 0.2, "cage_arcmin": 0.1, "cage_phase_deg": 0.0}
    effect = EFFECTS["bearing_pass"]
    names = {item.key for item in effect.flat_declared()}
    cage = {k: v for k, v in cage.items() if k in names}
    assert len(cage) == 3
    effect.values(cage, GEAR)
    outer = next(name for name in names if "outer" in name and name.endswith("_arcmin"))
    with pytest.raises(MissingValue, match="balls"):
        effect.values({**cage, outer: 0.1, outer.replace("_arcmin", "_phase_deg"): 0.0}, GEAR)


def test_waves_of_unequal_balls_stand_at_the_cages_place():
    """Balls go round at half the sum of both rings' surface speeds, (1 + d/D)(1 + 1/N)/2 against the wave generator:
    even waves meet both zones alike, odd ones once a turn more."""
    place = 1.2 * (1 + 1 / RATIO) / 2
    effect = EFFECTS["bearing_pass"]
    shape = {"ball_to_pitch_ratio": 0.2, "balls": 0, "zones": (1, 2, 3)}
    assert effect.orders(shape, RATIO) == pytest.approx([1 + place, 2 * place, 1 + 3 * place])


def test_the_unknown_start_behind_friction_fades_over_its_torque():
    c = moving(locked=True, theta=np.zeros(18 * RATE))
    columns = friction_columns(c, 2.5, 8.0)
    np.testing.assert_allclose(columns[:, 2], np.where(c.first, np.exp(-c.travel / 2.5), 0.0))


def test_friction_of_a_locked_input_is_looked_for_in_shares_of_its_torque(monkeypatch):
    """Each share for the friction and each for the knee, of 20 Nm."""
    asked = []
    monkeypatch.setattr(friction, "best_terms", lambda probe, terms, most=1: asked.extend(terms) or terms[:1])
    c = moving(locked=True, theta=np.zeros(18 * RATE))
    probe = FitProbe(fit_of(c, np.zeros(len(c))))
    EFFECTS["hysteresis"].search(probe)
    reached = float(np.max(np.abs(c.torque)))
    wanted = {(round(f * reached, 9), round(k * reached, 9)) for f in friction.SHARES for k in friction.SHARES}
    assert {(round(t.shape["friction_nm"], 9), round(t.shape["knee_nm"], 9)) for t in asked} == wanted


def test_a_smooth_windup_is_not_offered_at_a_locked_input():
    """The friction ahead of the spring is written for a curve of straight lines."""
    c = moving(locked=True, theta=np.zeros(18 * RATE))
    wound = 0.02 * np.sign(c.torque) * np.abs(c.torque) ** 0.7
    offered = EFFECTS["torsional_windup"].search(FitProbe(fit_of(c, wound)))
    assert offered and not any("hardening" in term.shape for term in offered)


def test_few_harmonics_end_where_the_least_adds_nothing():
    """Orthogonal waves that explain 100, 25 and 0.01: the third, less than 0.002 of all, is what a shape leaves."""
    moment = np.array([10.0, 0.0, 5.0, 0.0, 0.1, 0.0])
    assert strongest_few(np.eye(6), moment, (4, 7, 9), 3) == [(4,), (4, 7)]
    moment[4] = 1.0  # 0.008 of all
    assert strongest_few(np.eye(6), moment, (4, 7, 9), 3) == [(4,), (4, 7), (4, 7, 9)]


def test_lines_at_the_mesh_are_the_teeths():
    """102 for N = 50, and 51, whose second cycle stands there; a third of it, and neighbours, may be an encoder's."""
    orders = np.array([102.0, 51.0, 34.0, 25.5, 101.0, 103.0, 50.0, 204.0])
    assert are_of_the_mesh(orders, RATIO).tolist() == [True, True, False, False, False, False, False, False]


@pytest.mark.parametrize(("waves", "offered"), [(102, False), (103, True)])
def test_a_mesh_is_no_encoder_of_as_many_lines(waves, offered):
    """A wave of 102 an input turn, N = 50, of either encoder: no lines at it, nor half as many. Faults caught: such
    lines of the input offered, by which every mesh of one wave is told half an encoder's; or of the output, 2550 and
    5100; no lines offered that are not the mesh's."""
    theta = np.arange(60 * 400) * TURN / 400
    table = pd.DataFrame({"input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(theta / RATIO)})
    rows = gather([recording_from_table(table, RATIO, name="one")])
    rows = replace(rows, error=0.1 * np.sin(waves * theta))
    bare = evaluate(FitProblem(rows, None, np.ones((len(rows), 1)), Noise.white(rows, 0.01)), [], np.zeros(1), (), ())
    found = EFFECTS["encoder_interpolation"].search(FitProbe(bare))
    orders = {
        cycle * term.shape["lines"] / (RATIO if term.shape["shaft"] == Shaft.OUTPUT else 1)
        for term in found
        for cycle in (1, 2)
    }
    assert (float(waves) in orders) is offered


@pytest.mark.parametrize(("poles", "lines", "cycles"), [(2, None, 2), (3, 3, 2), (5, 5, 2), (8, 8, 2), (9, 9, 1)])
def test_pole_pairs_of_a_resolver_are_lines_of_few(poles, lines, cycles):
    """A wave of each pole pair and, of fewer than eight, with its double: one such wave alone could be anything's.
    Faults caught: a resolver at the input that is not looked for, which was named waves of the teeth; one pole pair
    less than a wave generator's own two ends; and low waves that are called lines without a double."""
    theta = np.arange(60 * 100) * TURN / 100
    table = pd.DataFrame({"input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(theta / RATIO)})
    rows = gather([recording_from_table(table, RATIO, name="one")])
    rows = replace(rows, error=0.1 * np.sin(poles * theta) + (0.05 * np.sin(2 * poles * theta) if cycles > 1 else 0.0))
    bare = evaluate(FitProblem(rows, None, np.ones((len(rows), 1)), Noise.white(rows, 0.01)), [], np.zeros(1), (), ())
    found = EFFECTS["encoder_interpolation"].search(FitProbe(bare))
    of_input = [term.shape for term in found if term.shape["shaft"] == Shaft.INPUT]
    assert any(shape["lines"] == poles for shape in of_input) is (lines is not None)
    assert all(len(shape["cycles"]) > 1 for shape in of_input if shape["lines"] < 8)
    if lines:
        assert all(term.odds < 0 for term in found if term.shape["lines"] == lines)


@pytest.mark.parametrize(
    ("shaft", "lines", "low"),
    [(Shaft.INPUT, 6, True), (Shaft.INPUT, 8, False), (Shaft.OUTPUT, 300, True), (Shaft.OUTPUT, 400, False)],
)
@pytest.mark.parametrize("double", [0.2, 0.05])
def test_a_low_line_is_an_encoders_where_its_double_shows(shaft, lines, low, double):
    """A sine of order 6 was `unknown`, since six lines with a double of a twenty-fifth took up the drive's misfit too:
    named lobes before. Faults caught: a double that need not show, one that a higher line needs, and
    an output encoder's lines counted by its own turn."""
    effect = EFFECTS["encoder_interpolation"]
    term = effect.term(moving(), {"lines": lines, "shaft": shaft, "cycles": (1, 2)})
    shows = effect.every_part_shows(term, FitEstimate(np.array([1.0, 0.0, 0.0, double]), np.eye(4)))
    assert shows is (double > 0.1 or not low)


@pytest.mark.parametrize(("effect", "example", "hidden"), OWN)
def test_what_stands_at_the_same_orders_does(effect, example, hidden):
    """And has what it was found for as its own. Faults caught: a variant at other orders, the same one once more, one
    that does not lead back."""
    term = effect.term(RECORD, effect.values(example, GEAR)[0], np.zeros(len(RECORD)))
    for other in effect.at_the_same_orders(RECORD, term):
        assert other.effect == effect.id
        assert effect.orders(other.shape, RATIO) == pytest.approx(effect.orders(term.shape, RATIO))
        assert effect.categories(other.shape) != effect.categories(term.shape)
        (back,) = effect.at_the_same_orders(RECORD, other)
        np.testing.assert_array_equal(back.columns, term.columns)


@pytest.mark.parametrize(("shaft", "lines", "other"), [(Shaft.INPUT, 9, 450), (Shaft.OUTPUT, 450, 9)])
def test_an_encoder_of_the_other_shaft_stands_at_the_same_orders(shaft, lines, other):
    """For N = 50; of 4001 lines of the output the input has none. Whether they may be the teeth's is asked once: 9
    lines of the input were preferred to 450 of the output that left 50 noise variances less, since order 9 is that of
    waves of the teeth too, which was asked of the output's alone. Faults caught: that, and odds of a few lines or
    numbers to choose from that are the other's."""
    effect = EFFECTS["encoder_interpolation"]
    term = effect.term(RECORD, {"lines": lines, "shaft": shaft, "cycles": (1, 2)}, trials=100.0)
    assert term.doubtful == (shaft is Shaft.OUTPUT)
    (found,) = effect.at_the_same_orders(RECORD, term)
    assert (found.shape["lines"], found.shape["shaft"] is shaft) == (other, False)
    assert found.doubtful == term.doubtful
    assert effect.term(RECORD, found.shape).doubtful == term.doubtful
    assert found.trials == pytest.approx(100.0 * other / lines)
    assert (found.odds < 0) == (other == 9)
    alone = effect.term(RECORD, {"lines": 4001, "shaft": Shaft.OUTPUT, "cycles": (1,)})
    assert effect.at_the_same_orders(RECORD, alone) == ()


@pytest.mark.parametrize(("shaft", "lines", "turns", "tried"), [
    (Shaft.INPUT, 9, 4, False), (Shaft.INPUT, 9, 6, True), (Shaft.OUTPUT, 450, 4, True),
    (Shaft.INPUT, 95, 60, False), (Shaft.INPUT, 85, 60, True), (Shaft.OUTPUT, 51 * 50, 60, False),
])  # fmt: skip
def test_lines_are_tried_on_the_other_shaft_where_they_are_looked_for(shaft, lines, turns, tried):
    """For N = 50, of which a tenth of an output turn is 5 of the input's; about its mesh, order 102, no lines of the
    output are looked for, and none at half of it on either. Faults caught: lines that no search would tell come in by
    the other shaft's."""
    effect = EFFECTS["encoder_interpolation"]
    record = moving((turns,))
    term = effect.term(record, {"lines": lines, "shaft": shaft, "cycles": (1,)})
    assert bool(effect.at_the_same_orders(record, term)) == tried


def test_the_teeth_own_orders_about_the_mesh():
    """102 for N = 50 and its sidebands, up to 12 off, each 3.5 fiftieths wide."""
    orders = np.array([102.0, 102.06, 102.08, 110.0, 113.95, 114.05, 90.05, 89.95, 50.0])
    assert beside_the_mesh(orders, RATIO).tolist() == [True, True, False, True, True, False, True, False, False]


@pytest.mark.parametrize(("low", "high"), [(1.0, 100.0), (-1.0, 1.0)])
def test_a_step_for_the_derivative_is_the_same_part_of_the_grids_distance_everywhere(low, high):
    axis = Axis("x", low, high)
    apart = np.diff(np.log(axis.grid) if axis.by_ratio else axis.grid)
    for value, gap in zip(axis.grid[1:-1], apart[1:], strict=True):
        share = axis.step(value) / (value if axis.by_ratio else 1.0) / gap
        assert share == pytest.approx(axis.step(axis.grid[1]) / (axis.grid[1] if axis.by_ratio else 1.0) / apart[0])
        assert 1e-4 < share < 0.2


# estimates


def test_an_amplitude_that_may_be_nothing_begins_at_nothing():
    """Of sine and cosine known to 0.1 each, 0.15 in all is within 1.96 deviations of nothing, 0.25 is not: there the
    ends are the amplitude and 1.96 deviations, by the circle about it."""
    for size, low in ((0.15, 0.0), (0.25, 0.25 - 0.196)):
        found = FitEstimate(size * np.array([0.6, 0.8]), 0.01 * np.eye(2)).amplitude(0, 1)
        assert found.value == pytest.approx(size)
        assert (found.low, found.high) == pytest.approx((low, size + 0.196), abs=1e-5)


@pytest.mark.parametrize("phase", [20.0, 170.0, 180.0])
def test_a_phase_whose_size_is_known_exactly_in_one_part_has_its_gradients_interval(phase):
    """Amplitude 1, the sine known exactly and the cosine to 0.01: the phase moves by 0.01 cos(phase) rad, also across
    half a turn."""
    values = np.array([math.cos(math.radians(phase)), math.sin(math.radians(phase))])
    found = FitEstimate(values, np.diag([0.0, 1e-4])).phase_deg(0, 1)
    half = math.degrees(1.96 * 0.01 * abs(math.cos(math.radians(phase))))
    assert found.value == pytest.approx(phase)
    assert (found.low, found.high) == pytest.approx((phase - half, phase + half), abs=1e-6)


@pytest.mark.parametrize("stretch", [0, 1, 2])
def test_the_stiffness_of_a_stretch_is_the_inverse_of_its_compliance(stretch):
    """A coefficient of 2 is 2e-5 rad/Nm, 50,000 Nm/rad; known to 1 % it is known to 1 %."""
    values = np.array([4.0, 4.0, 4.0, 5.0, 12.0])
    values[stretch] = 2.0
    term = Term("torsional_windup", {"knee_1": 5.0, "knee_2": 12.0}, columns=np.ones((3, 3)))
    estimate = FitEstimate(values, np.diag((0.01 * values) ** 2))
    found = EFFECTS["torsional_windup"].parameters(replace(term, steps={"knee_1": 1.0, "knee_2": 1.0}), estimate)
    stiff = found[f"stiffness_{stretch + 1}"]
    assert stiff.value == pytest.approx(50_000)
    assert stiff.high - stiff.value == pytest.approx(1.96 * 500, rel=1e-3)


@pytest.mark.parametrize("name", ["cs_tooth_harmonics", "fs_tooth_harmonics"])
def test_each_wave_of_the_teeth_has_its_own_pair_in_um(name):
    """Sine 3 and cosine 4 um are 5 um, 5 and 12 are 13; their phases the angles whose tangents are 4/3 and 12/5."""
    effect = EFFECTS[name]
    example = {"amplitude_2_um": 5.0, "phase_2_deg": 53.13, "amplitude_3_um": 13.0, "phase_3_deg": 67.38}
    shape, coefficients = effect.values(example, GEAR)
    assert np.array(coefficients) == pytest.approx(np.array([3.0, 4.0, 5.0, 12.0]) * 1e-3, rel=1e-4)
    term = Term(name, dict(shape), columns=np.ones((3, 4)))
    found = effect.parameters(term, FitEstimate(np.array(coefficients), 1e-12 * np.eye(4)))
    assert {k: p.value for k, p in found.items()} == pytest.approx(example, rel=1e-4)


SINES_OF_EACH = [
    pytest.param(effect, one, member, id=f"{effect.id}-{one.members[member][0]}")
    for effect in EFFECTS.values()
    for one in effect.declared
    if isinstance(one, Sines)
    for member in one.members
]


@pytest.mark.parametrize(("effect", "sines", "member"), SINES_OF_EACH)
def test_every_sine_that_may_be_said_goes_into_the_fit_and_back(effect, sines, member):
    """Each alone beside the rest of an example: would catch a wave that no set of waves has, another wave's place, and
    a phase or scale that is not its own."""
    amplitude, phase = sines.members[member]
    others = {key for one in effect.declared if isinstance(one, Sines) for pair in one.members.values() for key in pair}
    example = next(e for e in effect.examples if any(k in e for pair in sines.members.values() for k in pair))
    plain = {key: value for key, value in example.items() if key not in others}
    defaults = {i.key: i.default for i in effect.flat_declared() if isinstance(i.default, (str, float, int))}
    said = {**plain, amplitude: 0.7, phase: 25.0}
    try:
        shape, coefficients = effect.values({**defaults, "balls": 12, **said}, GEAR)
    except HdoptError as refused:  # harmonics beyond the widest set that is looked for are of as many balls
        assert effect.id == "bearing_pass" and "as many balls" in str(refused)
        shape, coefficients = effect.values({**defaults, **said, "balls": member}, GEAR)
    found = {k: v for k, v in effect.keys(shape, coefficients, GEAR).items() if k in others}
    assert found[amplitude] == pytest.approx(0.7) and found[phase] == pytest.approx(25.0)
    assert all(abs(v) < 1e-12 for k, v in found.items() if k != amplitude and "phase" not in k)


@pytest.mark.parametrize(("share", "told"), [(1.9, False), (2.1, True)])
def test_balls_are_counted_where_their_wave_is_twice_the_usual_one(share, told):
    """The other waves are 4, 5 and 6 um, the usual one 5."""
    effect = EFFECTS["bearing_pass"]
    term = Term(effect.id, {"ball_to_pitch_ratio": 0.2, "balls": 12, "zones": (1, 2, 3)}, zones=np.zeros((2, 3, 8)))
    values = np.array([0.004, 0.0, 0.005, 0.0, 0.006, 0.0, 0.005 * share, 0.0, 0.2])
    found = effect.parameters(term, FitEstimate(values, 1e-12 * np.eye(9)))
    assert ("balls" in found) == told
    assert found["unequal_um"].value == pytest.approx(4.0)


def test_stiff_resonances_begin_where_sixteen_waves_of_a_turn_are(monkeypatch):
    """At 10 input turns a second 160 Hz, and 2000 Hz at most."""
    effect = EFFECTS["resonance"]
    monkeypatch.setattr(type(effect), "term", lambda self, conditions, shape, motion=None: shape["frequency_hz"])
    probe = SimpleNamespace(samples=SimpleNamespace(known_speed=np.full(9, -10 * TURN)), motion=None)
    found = effect.beyond_search(probe)
    assert (found[0], found[-1]) == pytest.approx((160.0, 2000.0))


@pytest.mark.parametrize("friction", [2.4, 7.7])
def test_play_of_a_locked_input_is_crossed_at_the_torque_of_the_friction(friction):
    c = moving(locked=True, theta=np.zeros(18 * RATE))
    side = EFFECTS["lost_motion"].term(c, {"friction_nm": friction}).columns[:, 0]
    assert np.array_equal(side, 0.5 * np.where(c.torque > friction * c.direction, 1.0, -1.0))


def test_a_defect_of_the_output_is_looked_for_in_parts_of_its_widest():
    """6 deg of the output at N = 50 are 300 of the input: 15 to 240 of them, beside those of a tooth in a zone."""
    theta = np.linspace(0, 2 * RATIO * TURN, 5000)
    probe = SimpleNamespace(residual=np.cos(theta / 9), samples=SimpleNamespace(ratio=RATIO))
    effect = EFFECTS["local_tooth_defect"]
    found = effect._candidates(probe, theta, TURN * RATIO, Seat.OUTPUT)
    assert sorted({w for _, w in found}) == pytest.approx([1.2, 2.5, 5.0, 10.0, 15.0, 30.0, 60.0, 120.0, 240.0])


def runs_offered(monkeypatch, effect, **samples):
    """The runs of waves that a search looks at, in their order."""
    offered = []
    monkeypatch.setattr(cs_tooth_harmonics, "best_terms", lambda probe, terms, keep: offered.extend(terms) or [])
    monkeypatch.setattr(cs_tooth_harmonics, "terms_at", lambda effect, samples, shapes: shapes)
    monkeypatch.setattr(CircularSplineToothHarmonics, "_strongest_few", lambda self, probe, limit: [])
    assert EFFECTS[effect].search(SimpleNamespace(samples=SimpleNamespace(**samples))) == []
    return [cs_tooth_harmonics.members_of(shape) for shape in offered]


@pytest.mark.parametrize("effect", ["cs_tooth_harmonics", "fs_tooth_harmonics"])
@pytest.mark.parametrize(("ratio", "most"), [(30.0, 45), (50.0, 70), (160.0, 70)])
def test_waves_of_the_teeth_do_not_reach_to_the_mesh(monkeypatch, effect, ratio, most):
    """60 teeth have 30 waves, and what a load that passes from tooth to tooth makes of them: 70 were tried, which took
    up the mesh of 62 (case 547 of run-018). Fault caught: no bound from the number of teeth."""
    runs = runs_offered(monkeypatch, effect, ratio=ratio, rows_per_turn=800.0, highest_order=300.0)
    assert max(run[-1] for run in runs) == most


@pytest.mark.parametrize("effect", ["cs_tooth_harmonics", "fs_tooth_harmonics"])
@pytest.mark.parametrize(
    ("rows", "longest"), [(16.0, [5, 8]), (17.9, [5, 8]), (18.0, [8, 9]), (80.0, [24, 40]), (111.0, [40, 55])]
)
def test_waves_of_the_teeth_reach_as_far_as_the_rows(monkeypatch, effect, rows, longest):
    """Each tooth's own error makes waves of every length: of 111 rows a turn 40 were tried, and what the others left
    was named an encoder of 46 lines or a damaged tooth (cases 456 and 517 of run-018). Faults caught: the last run left
    out, a run twice, one beyond half the rows."""
    runs = runs_offered(monkeypatch, effect, ratio=100.0, rows_per_turn=rows, highest_order=rows / 3)
    assert [run[-1] for run in runs][-2:] == longest
    assert all(cs_tooth_harmonics.has_no_gap(run) for run in runs)
    assert len(set(runs)) == len(runs)


@pytest.mark.parametrize(
    ("members", "run"),
    [((2,), True), ((3,), True), ((4,), False), ((2, 3), True), ((3, 4), False), (tuple(range(2, 56)), True)],
)
def test_a_run_of_waves_begins_with_the_second(members, run):
    """Fault caught: a run that ends with the rows taken for a few waves that stand out alone, which must all be as
    large as its largest."""
    assert cs_tooth_harmonics.has_no_gap(members) == run


def lines_found(order, of_output, turns=25, size=0.06):
    """The best lines that the search offers for a wave of `order` of the input, or of N times the output's angle, in a
    recording of so many turns there and back, and by how much (log evidence) a sine of any order of the input explains
    more."""
    study = load_study(drive="csf-25-80")

    def wave(state):
        behind = kinematic_error_arcmin(study.drive, study.errors, state["theta"]) if of_output else 0.0
        return size * np.sin(order * (state["theta"] - 80 * behind * ARCMIN))

    records = bench(study, wave, turns=turns, rate=100)
    fit = begin(records, CartesianModel.of(study.drive), 1, DEFAULT).base
    probe = FitProbe(fit)
    best = max(EFFECTS["encoder_interpolation"].search(probe), key=probe.gain)
    other = max(fit.problem.explanations["_sine_in_angle"].search(probe), key=probe.gain)
    return best.shape, (probe.gain(other) - probe.gain(best)) / 2


@pytest.mark.parametrize("lines", [1799, 1800, 1801])
def test_lines_of_the_output_are_counted_in_a_third_of_its_turn(lines):
    """Neighbours lie three to a line of the spectrum, and their phases tell them. Would catch the strongest of the
    spectrum taken for them, and lines that are looked for from half a turn on alone: `unknown`, four of four."""
    shape, apart = lines_found(lines / 80, of_output=True)
    assert (shape["lines"], shape["shaft"]) == (lines, Shaft.OUTPUT)
    assert apart < 0


@pytest.mark.parametrize(("turns", "reach"), [(25, 1), (8, 5), (40, 1), (41, 0), (400, 0)])
def test_lines_are_tried_with_neighbours_that_a_spectrum_does_not_tell_apart(turns, reach):
    lines, samples = np.arange(16.0, 2000.0), SimpleNamespace(span_turns=turns)
    found = _with_neighbours({16.0, 900.0}, lines, 80.0, samples)
    assert found == [*(16.0 + np.arange(reach + 1)), *(900.0 + np.arange(-reach, reach + 1))]


@pytest.mark.parametrize("order", [22.4937, 31.3071])
def test_orders_between_the_lines_are_no_lines(order):
    """As of a belt or a pulley, in the same third of an output turn: half a line away a sine explains more."""
    assert lines_found(order, of_output=False)[1] > 30


def test_lines_of_the_output_are_not_counted_in_less_than_a_tenth_of_its_turn():
    assert lines_found(22.5, of_output=True, turns=7)[0]["shaft"] == Shaft.INPUT
