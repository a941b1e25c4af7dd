"""Small decisions of the diagnosis, each from both sides of its bound, and numbers that it hands on."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_effect_physics import RATE, RATIO, TURN, moving
from test_windup_curves import fit_of

from hdopt.diagnosis.alternatives import alternatives
from hdopt.diagnosis.checks.scale import _scale
from hdopt.diagnosis.checks.slow_wander import _autoregression, _cells, _filtered, _line
from hdopt.diagnosis.checks.step_detection import Steps
from hdopt.diagnosis.inference.cross_validation import HeldOut
from hdopt.diagnosis.inference.encoder_steps import _is_most, gather, neighbours_for, on_samples
from hdopt.diagnosis.inference.fit import evaluate
from hdopt.diagnosis.inference.nuisance import angle_range, tent_functions
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.settings import DEFAULT
from hdopt.diagnosis.verdict import facts, rules
from hdopt.diagnosis.verdict.draw import prior_notes
from hdopt.diagnosis.verdict.named_effect import NamedEffect
from hdopt.diagnosis.verdict.rivals import is_tie, placebo_as_good, with_imitator
from hdopt.effects.estimate import Parameter
from hdopt.effects.term import Term
from hdopt.recordings.recording import Recording

C = moving((8, 8))
N = len(C)
VERDICT = DEFAULT.verdict


# facts and rivals


@pytest.mark.parametrize(
    ("power", "explained", "enough"),
    [
        (1.02, 0.0, True),
        (0.98, 0.0, False),
        (1.02, 1.02 / 1.05, True),
        (1.02, 1.02 / 0.95, False),
        (1.02, -50.0, True),  # turns that are predicted worse explain nothing
    ],
)
def test_a_ripple_stands_out_of_the_raw_rows_and_of_what_else_explains(monkeypatch, power, explained, enough):
    """In units of the smallest share of the raw rows' variance, 4 arcmin^2, and of the share of what is explained."""
    least = VERDICT.smallest_share * 4.0
    monkeypatch.setattr(facts, "term_powers", lambda fit: [0.25 * power * least, 0.75 * power * least])
    high = SimpleNamespace(fit=SimpleNamespace(residual=np.resize([2.0, -2.0], 100)))
    other = SimpleNamespace(
        settings=DEFAULT,
        base_held_out=SimpleNamespace(variance=100.0 + explained * least / VERDICT.high_share),
        extended_held_out=SimpleNamespace(variance=100.0),
    )
    assert facts.stands_out(high, other) == enough


@pytest.mark.parametrize(("share", "said"), [(0.99, True), (0.97, False)])
def test_a_placebo_must_reach_nearly_all_that_the_effects_gain(share, said):
    """Of a gain of 2 in held-out variance; turns scatter so that the two errors do not differ."""
    wave = np.resize([1.0, -1.0], 40)
    own, other = 1.0 + 0.5 * wave, 3.0 - 2.0 * share - 0.5 * wave
    evidence = SimpleNamespace(
        settings=DEFAULT,
        base_held_out=HeldOut(np.full(40, 3.0), np.full(40, 3.0), np.ones(40)),
        extended_held_out=HeldOut(own, own, np.ones(40)),
        placebo_held_out=HeldOut(other, other, np.ones(40)),
        placebo="hysteresis",
        selection=SimpleNamespace(best=SimpleNamespace(effects=("lost_motion",))),
    )
    assert placebo_as_good(evidence, []) == ((("hysteresis",),) if said else ())


@pytest.mark.parametrize(
    ("imitates", "apart", "tie"),
    [(0.0, 0.0, False), (-0.01, 0.0, False), (0.01, 0.0, True), (0.01, 0.9, True), (0.01, 1.1, False)],
)
def test_a_tie_is_imitated_wholly_and_not_told_apart(imitates, apart, tie):
    """`imitates` from the share that counts on (half a hundredth below it at 0), `apart` in ties."""
    pair = SimpleNamespace(imitates=VERDICT.imitated - 0.005 + imitates, evidence_apart=apart * VERDICT.tie)
    assert is_tie(pair, VERDICT) == tie


def test_an_imitator_takes_the_place_of_its_effect_alone():
    pair = SimpleNamespace(effect="lost_motion", other="hysteresis")
    assert with_imitator(pair, ["thermal_drift", "lost_motion"]) == ("thermal_drift", "hysteresis")
    assert with_imitator(pair, ["hysteresis", "lost_motion"]) == ("hysteresis",)


def test_numbers_without_a_prior_are_outside_of_none():
    """A category, an angle, and a width at its prior's end; a height on both sides of its own."""
    where = {"domain": "angle", "orders_per_input_turn": [], "direction": "both", "share_of_residual": 1.0}
    reaching = [(-3.0, 2.0), (-29.0, -28.0), (-40.0, -29.0), (29.0, 40.0)]
    beyond = [(-40.0, -31.0), (31.0, 40.0)]
    for low, high in reaching + beyond:
        parameters = {
            "angle_deg": Parameter(1e5, 1e5, 1e5, "deg"),
            "height_um": Parameter((low + high) / 2, low, high, "um"),
        }
        found = NamedEffect("local_tooth_defect", 0.97, where | {"rms_arcmin": 1.0}, parameters, "Says.")
        notes = prior_notes([found])
        assert ["height_um" in note for note in notes] == [True] * ((low, high) in beyond)


@pytest.mark.parametrize(("sensors", "rms"), [(3.0, 4.0), (6.0, 0.0)])
def test_what_is_no_noise_is_told_without_the_sensors_own(monkeypatch, sensors, rms):
    """Of 5 arcmin rms, 3 are the bench's sensors': 4 are something else."""
    monkeypatch.setattr(rules, "locate_remainder", lambda evidence: {"rms_arcmin": 5.0, "domain": "torque"})
    evidence = SimpleNamespace(sensors_noise=sensors, extended_held_out=SimpleNamespace(variance=25.0, rms=5.0))
    findings = SimpleNamespace(
        evidence=evidence, facts=SimpleNamespace(carry_most=False, noise_over_neighbours=9.0), effects=()
    )
    assert rules.no_noise(findings).where["rms_arcmin"] == pytest.approx(rms)


def test_one_step_is_a_step():
    assert Steps(np.array([7]), 0.1).any and not Steps(np.zeros(0, int), 0.0).any


# probes and problems


def test_what_is_not_kept_is_put_back_to_what_is_left():
    """A sine that the fit holds at half of what is there: left is the other half, and all of it once it is let go."""
    wave = np.sin(3 * C.theta)
    fit = fit_of(C, wave, [Term("encoder_input_eccentricity", {}, columns=wave[:, None])])
    fit = evaluate(fit.problem, fit.errors, fit.offsets, fit.terms, [np.array([0.5])])
    assert np.allclose(FitProbe(fit).residual, 0.5 * wave)
    assert np.allclose(FitProbe(fit, keep=()).residual, wave)


def test_flipped_noise_is_what_was_left_with_other_signs():
    wave = np.sin(3 * C.theta)
    probe = FitProbe(fit_of(C, wave))
    signs = np.where(np.arange(N) // RATE % 2 == 0, 1.0, -1.0)
    assert np.allclose(probe.flipped(signs).residual, signs * wave)
    assert np.allclose(probe.flipped(-np.ones(N)).white_residual, -probe.white_residual)
    assert np.allclose(probe.on(2 * wave).residual, 2 * wave)
    assert np.allclose(probe.on(2 * wave).white_residual, 2 * probe.white_residual)


@pytest.mark.parametrize("scale", [1.0, 2.5])
def test_prior_and_box_of_the_base_widen_together(scale):
    problem = replace(fit_of(C, np.zeros(N)).problem, prior_scale=scale)
    assert problem.prior == pytest.approx(scale * np.array(DEFAULT.base.prior_mm))
    assert problem.box == pytest.approx(scale * np.array(DEFAULT.base.box_mm))


@pytest.mark.parametrize(("row", "doubtful"), [(901, True), (900, False), (1019, True), (1020, False)])
def test_half_a_turn_about_a_reversal_is_half_a_turn(row, doubtful):
    """Row 960 is the first after it, half a turn 60 rows."""
    (jump,) = (one for one in alternatives(DEFAULT.alternatives) if one.id == "_jump")
    assert jump.term(C, {"row": float(row)}).doubtful == doubtful


@pytest.mark.parametrize("name", ["_even_in_speed", "_skew"])
@pytest.mark.parametrize(("share", "varies"), [(1.1, True), (0.9, False)])
def test_speed_varies_from_a_share_of_its_largest(name, share, varies):
    """Half of the rows at 10 rad/s and half at 10 (1 - 2 d) have the standard deviation 10 d."""
    one = next(one for one in alternatives(DEFAULT.alternatives) if one.id == name)
    speed = 10 * (1 - 2 * share * DEFAULT.alternatives.speed_levels * (np.arange(N) % 2))
    assert (one.lacks(moving((8, 8), speed=speed)) is None) == varies


@pytest.mark.parametrize("count", [1, 2, 5])
def test_each_jump_may_stand_at_any_row(count):
    (jump,) = (one for one in alternatives(DEFAULT.alternatives) if one.id == "_jump")
    shape = {f"row_{i}" if i else "row": 100.0 * (i + 1) for i in range(count)}
    assert jump.term(C, shape).trials == pytest.approx(float(N) ** count)


# nuisances


@dataclass(frozen=True)
class Angles:
    """Rows of which the input angle alone is asked."""

    theta: np.ndarray

    def __len__(self):
        return len(self.theta)


@pytest.mark.parametrize(("rows", "knots"), [(300, 5), (2000, 20), (20_000, 60)])
def test_a_free_curve_has_a_knot_for_a_hundred_rows(rows, knots):
    """Five at least, sixty at most."""
    theta = np.linspace(-3.0, 40.0, rows)
    assert angle_range(Angles(theta)) == (-3.0, 40.0, knots)


def test_tents_make_any_straight_piece_from_zero():
    """Each is one at its own knot and nothing at the others; together they run through any values at the knots."""
    knots = np.linspace(-2.0, 6.0, 9)
    assert np.allclose(tent_functions(knots, -2.0, 6.0, 9), np.eye(9)[:, 1:])
    at = np.linspace(-2.0, 6.0, 101)
    values = np.r_[0.0, np.random.default_rng(2).normal(size=8)]
    assert np.allclose(tent_functions(at, -2.0, 6.0, 9) @ values[1:], np.interp(at, knots, values))


@pytest.mark.parametrize("step", [1.0, 3.0])
def test_a_step_is_most_of_a_scatter_between_two_bounds(step):
    """What is evenly spread over a step scatters by step / sqrt(12)."""
    share = DEFAULT.encoder_steps.share_of_scatter
    own = step / math.sqrt(12)
    for scatter, most in ((0.98 * own / share, True), (1.02 * own / share, False)):
        assert _is_most(step, scatter, DEFAULT.encoder_steps) == most
    for scatter, most in ((1.02 * own * share, True), (0.98 * own * share, False)):
        assert _is_most(step, scatter, DEFAULT.encoder_steps) == most


def test_averages_come_back_to_the_samples_by_straight_lines():
    """Rows of a line's own values, of two recordings of another length each, give the line of each."""
    made = [
        Recording("r", RATIO, np.arange(n) * TURN / 400, np.zeros(n), time=0.01 * np.arange(n)) for n in (9000, 12_000)
    ]
    rows = gather([replace(one, error_arcmin=0.1 * np.arange(len(one))) for one in made], neighbours_for(made))
    for one, found in zip(made, on_samples(made, rows.error), strict=True):
        inner = slice(20, -20)
        assert found[inner] == pytest.approx(0.1 * np.arange(len(one))[inner])


# scale and wander


@pytest.mark.parametrize("gain", [0.999, 1.001])
def test_a_slope_of_the_error_is_a_gain_or_another_ratio(gain):
    """An output that counts `gain` times its angle g theta/N leaves (1 - g)/N a rad; so does a ratio N/g in place of
    N. Known to 1e-6 rad/rad, the gain is to N times that."""
    slope = (1 - gain) / RATIO
    found = _scale(RATIO, slope, 1e-6, True)
    assert found.gain == pytest.approx(gain)
    assert found.ratio == pytest.approx(RATIO / gain)
    assert (found.low, found.high) == pytest.approx((gain - 50e-6, gain + 50e-6))


def test_a_slow_wave_has_its_period_and_size():
    """Of 120 s and 0.5 arcmin over 1500 s, among noise; the rms of a sine is 0.5 / sqrt(2)."""
    time = np.linspace(0, 1500, 1200)
    noise = np.random.default_rng(3).normal(0, 0.1, len(time))
    found = _line(time, 0.5 * np.sin(TURN * time / 120) + noise, DEFAULT.wander)
    assert found.period == pytest.approx(120, rel=0.05)
    assert found.rms == pytest.approx(0.5 / math.sqrt(2), rel=0.1)
    assert _line(time, noise, DEFAULT.wander) is None


def test_parts_of_a_turn_end_at_reversals_gaps_and_their_own_length():
    """Four parts a turn: eight turns there and eight back are 64, a gap in the middle of a part one more."""
    own = {one.name: getattr(C, one.name) for one in fields(C)}
    rows = SimpleNamespace(**own)
    cells = _cells(rows, 4)
    assert cells[-1] + 1 == pytest.approx(64, abs=2)
    rows.piece = (np.arange(N) >= 315).astype(int)
    assert _cells(rows, 4)[-1] == cells[-1] + 1


def test_a_walk_of_several_records_begins_anew_in_each():
    """x = 0.7 x before + noise: the first means of each record have no past."""
    rng = np.random.default_rng(5)
    values = np.zeros((2, 1500))
    for k in range(1, 1500):
        values[:, k] = 0.7 * values[:, k - 1] + rng.normal(0, 1, 2)
    record = np.repeat([0, 1], 1500)
    both = values.ravel()
    ar, usable = _autoregression(both, record, 2)
    # A standard error of sqrt(1 - 0.49) / sqrt(3000) = 0.013, and the correction for a mean that was taken out.
    assert ar[0] == pytest.approx(0.7, abs=0.05)
    assert not usable[:2].any() and not usable[1500:1502].any() and usable.sum() == 2996
    white = _filtered(both, np.array([0.7, 0.0]), usable)
    assert np.std(white) == pytest.approx(1.0, rel=0.05)
