"""Amplitudes are those of the samples, though a fit sees means of neighbouring samples."""

from __future__ import annotations

from dataclasses import replace
from math import ceil
from types import SimpleNamespace

import numpy as np
import pytest
from effect_examples import EXAMPLES, NAMES
from test_effect_physics import GEAR, RATIO, moving

from hdopt.diagnosis import diagnose
from hdopt.diagnosis.inference.catalogue import explanations
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.inference.row_means import as_sampled, part_left
from hdopt.diagnosis.search.as_recorded import left_as_recorded
from hdopt.effects import EFFECTS
from hdopt.effects.conditions import TURN
from hdopt.effects.declared import Shaft
from hdopt.effects.estimate import FitEstimate
from hdopt.effects.met import Spline
from hdopt.kinematics.cartesian import CartesianModel, to_cartesian
from hdopt.recordings.recording import Recording
from hdopt.recordings.rows import gather
from hdopt.study import load_study
from tests.unit.test_diagnosis import bench

COUNT = 8


def moving_at(rate):
    """Three turns forward with so many rows a turn."""
    theta = np.arange(3 * rate) * TURN / rate
    n, c = len(theta), moving()
    return replace(
        c,
        theta=theta,
        output=theta / RATIO,
        direction=np.ones(n),
        travel=np.degrees(theta) / RATIO,
        first=np.ones(n, bool),
        record=np.zeros(n, np.int64),
        piece=np.zeros(n, np.int64),
        time=theta / 2,
        speed=np.full(n, 2.0),
        torque=np.full(n, 20.0),
        temperature=np.full(n, 25.0),
    )


def in_means(rate):
    """The same motion with `COUNT` times as many samples, of which so many make a row, and its samples."""
    fine = moving_at(COUNT * rate)
    rows = moving_at(rate)
    middle = fine.theta.reshape(-1, COUNT).mean(1)
    return replace(rows, theta=middle, output=middle / RATIO, averaged=float(COUNT)), fine


def columns_of(term, conditions):
    """Those of zone 1 where it acts in the zones."""
    if term.met is not None:
        turned = 1 + 1 / RATIO if term.met.spline is Spline.FLEX else 1.0
        return term.met.columns(turned * conditions.theta, 0)
    return term.zones[0] if term.zones is not None else term.columns


def shape_of(name, keys):
    effect = EFFECTS[name]
    defaults = {one.key: one.default for one in effect.flat_declared() if isinstance(one.default, (str, float, int))}
    if "form_heights_um" in keys:
        keys = {**keys, "form_heights_um": [2.0] * int(2 * RATIO + 2)}
    return effect.values({**defaults, **keys}, GEAR)[0]


WITH_SINES = {
    "bearing_pass",
    "circular_spline_lobing",
    "cs_tooth_harmonics",
    "encoder_input_eccentricity",
    "encoder_interpolation",
    "encoder_output_eccentricity",
    "fs_tooth_harmonics",
    "output_coupling",
    "tooth_mesh",
}


@pytest.mark.parametrize(("name", "keys"), EXAMPLES, ids=NAMES)
def test_a_mean_leaves_of_every_column_the_part_that_is_said(name, keys):
    """Every effect's own columns: the mean of these over the samples of a row against those of the row. Would catch an
    order of another column, of another spline or shaft, and waves that follow something else than the angle."""
    effect, shape, c = EFFECTS[name], shape_of(name, keys), moving()
    orders = effect.orders_of_columns(effect.term(c, shape, np.zeros(len(c))), RATIO)
    assert bool(orders) is (name in WITH_SINES and "heights" not in shape)
    rows, fine = in_means(4 * max(ceil(max(orders, default=1)), 10))
    if not orders:
        return
    term = effect.term(rows, shape)
    expected = columns_of(effect.term(fine, shape), fine).reshape(len(rows), COUNT, -1).mean(1)
    found = columns_of(term, rows) * np.repeat(part_left(rows, orders), 2)
    assert found.shape == expected.shape == (len(rows), term.width)
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_samples_that_are_rows_leave_all():
    rows = replace(moving_at(40), averaged=1.0)
    assert part_left(rows, [3.0, 18.0]).tolist() == [1.0, 1.0]
    estimate = FitEstimate(np.ones(4), np.eye(4))
    assert as_sampled(estimate, rows, [3.0, 18.0]) is estimate
    assert as_sampled(estimate, in_means(40)[0], []) is estimate


def test_rows_of_two_speeds_leave_what_they_leave_on_average():
    """Half the rows span 9 deg, half 4.5: of order 10 those leave 0.9011, these 0.9744 (m = 8). Would catch the usual
    row taken for all, and the way from one piece to the next taken for a row."""
    slow, fast = moving_at(80), moving_at(40)
    theta = np.r_[slow.theta[:60], 100 + fast.theta[:60]]
    piece = np.repeat([0, 1], 60)
    both = replace(in_means(40)[0], theta=theta, piece=piece)

    def left(turn):
        return np.sin(10 * turn / 2) / (8 * np.sin(10 * turn / 16))

    assert part_left(both, [10.0])[0] == pytest.approx((left(TURN / 80) + left(TURN / 40)) / 2, rel=1e-12)


def test_rows_too_wide_for_an_order_leave_what_is_believed_at_least():
    assert part_left(in_means(40)[0], [36.0]).tolist() == [0.5]
    assert part_left(in_means(40)[0], [36.0], 0.2).tolist() == [0.2]


def test_an_estimate_of_means_is_made_one_of_samples():
    """Values, spread and the ends of profiles alike; what stands behind the waves stays as it is."""
    rows = in_means(40)[0]
    left = part_left(rows, [10.0])[0]
    values, covariance = np.array([0.3, -0.2, 7.0]), np.array([[4.0, 1, 2], [1, 9, 3], [2, 3, 16]]) * 1e-4
    found = as_sampled(FitEstimate(values, covariance, {0: (0.2, 0.4), 2: (6.0, 9.0)}), rows, [10.0])
    assert 0.8 < left < 0.95
    np.testing.assert_allclose(found.values, values / [left, left, 1])
    np.testing.assert_allclose(found.covariance, covariance / np.outer([left, left, 1], [left, left, 1]))
    assert found.profiles == {0: pytest.approx((0.2 / left, 0.4 / left)), 2: (6.0, 9.0)}


@pytest.mark.slow
def test_lobes_are_said_as_large_as_they_are():
    """Eight of 3 um of arc, in 64 means of ten samples a turn: they would be said 2.5 % smaller. Within 0.2 %: where
    the driving zone changes the mean of an error is not the error of the mean, 0.0009 arcmin of that order."""
    study = load_study(drive="csf-25-80")
    model = CartesianModel.of(study.drive)
    errors = to_cartesian(study.errors, model.half_width)

    def lobes(state):
        rotation = model.rotation(state["theta"])
        met = state["theta"] + model.beyond_at(rotation, errors)[Spline.CIRCULAR]
        with_lobes = model.evaluate_at(rotation, errors, 0.003 * np.sin(8 * met + 0.6))[0]
        return with_lobes - model.evaluate_at(rotation, errors)[0]

    found = diagnose(bench(study, lobes, turns=80, rate=640), study.drive)
    (named,) = found.effects
    amplitude = named.parameters["arc_amplitude_um"]
    assert named.id == "circular_spline_lobing" and named.parameters["lobes"].value == 8
    assert amplitude.value == pytest.approx(3.0, rel=2e-3)
    assert amplitude.high - amplitude.low < 0.06


def test_a_fit_to_means_leaves_nothing_of_its_waves_on_the_rows_as_recorded():
    """A wave of 40 an input turn, 292 samples a turn, of which two make a row: their means leave 0.909 of it, so that
    0.0053 arcmin of 0.0583 would stand in the rows as recorded, where orders above those of the means are looked for.
    Fault caught: coefficients as the means want them."""
    rate, sizes = 292, np.array([0.05, -0.03])
    theta = np.arange(4 * rate) * TURN / rate
    error = np.column_stack([np.sin(40 * theta), np.cos(40 * theta)]) @ sizes
    record = Recording("record", RATIO, theta, error)
    rows = gather([record], 2)
    problem = FitProblem(rows, None, np.ones((len(rows), 1)), Noise.white(rows, 1.0))
    term = explanations()["encoder_interpolation"].term(rows, {"lines": 40, "shaft": Shaft.INPUT, "cycles": (1,)})
    dimmed, *_ = np.linalg.lstsq(term.columns, rows.error, rcond=None)
    assert np.hypot(*dimmed) == pytest.approx(np.cos(np.pi * 40 / rate) * np.hypot(*sizes), rel=1e-9)
    fit = evaluate(problem, np.zeros(0), np.zeros(1), [term], [dimmed])
    nuisances = SimpleNamespace(columns=lambda rows: np.ones((len(rows), 1)))
    left = left_as_recorded([record], fit, nuisances).rows.error
    np.testing.assert_allclose(left, 0, atol=1e-9)
