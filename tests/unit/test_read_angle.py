"""An input encoder that reads the angle wrong: the drive is fitted where it stood, not where it was read."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from test_cross_validation import TURN, noisy, rows_of

from hdopt.diagnosis import diagnose
from hdopt.diagnosis.inference.catalogue import explanations
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import FitProblem, evaluate, term_columns
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.inference.read_angle import read_ahead, reads_input, where_it_stood
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.nested import ripple_of
from hdopt.diagnosis.search.high_order import left_as_recorded
from hdopt.effects import EFFECTS
from hdopt.effects.declared import Shaft
from hdopt.effects.local_tooth_defect import Seat
from hdopt.kinematics.cartesian import CartesianModel, to_cartesian
from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.recordings.read import recording_from_table
from hdopt.study import load_study

ARCMIN = np.pi / 10800
RATIO = 80.0
SINES = {
    "encoder_input_eccentricity": {"shaft": Shaft.INPUT, "orders": (1,)},
    "output_coupling": {"shaft": Shaft.INPUT, "orders": (2,)},
    "encoder_interpolation": {"shaft": Shaft.INPUT, "lines": 8, "cycles": (1,)},
}
"""The effects that are errors of the input angle as read, at shapes at which they are."""
PULSE = ("local_tooth_defect", {"centre": 2.0, "width_deg": 6.0, "on": Seat.FLEXSPLINE}, (0.002,))
ECCENTRIC = ("encoder_input_eccentricity", SINES["encoder_input_eccentricity"], (0.14, 0.14))


@pytest.fixture(scope="module")
def study():
    return load_study(drive="csf-25-80")


@pytest.fixture(scope="module")
def rows():
    return noisy(6)


def problem_of(rows, base):
    return FitProblem(rows, base, np.ones((len(rows), 1)), Noise.white(rows, 0.02))


def fit_with(problem, study, *weighed):
    """The shipped errors of the drive and the terms with their coefficients."""
    errors = 0.5 * problem.prior if problem.base is not None else np.zeros(0)
    terms = [explanations()[effect].term(problem.rows, shape) for effect, shape, _ in weighed]
    return evaluate(problem, errors, np.zeros(1), terms, [np.array(c) for *_, c in weighed])


def test_which_effects_move_the_angle_as_read():
    """What turns with the input's encoder or its coupling, and a delay, of all examples of all effects. Faults caught:
    one of the four that is forgotten, the output's lines or coupling taken for the input's, an effect of the drive for
    any of them.
    """
    gear = load_study(drive="csf-25-80").drive.geometry
    moving = set()
    for effect in EFFECTS.values():
        defaults = {i.key: i.default for i in effect.flat_declared() if isinstance(i.default, (str, float, int))}
        for keys in effect.examples:
            shape, _ = effect.values({**defaults, **keys}, gear)
            if effect.reads_input(shape):
                moving.add(effect.id)
                assert shape.get("shaft", Shaft.INPUT) == Shaft.INPUT
    assert moving | {"encoder_interpolation"} == {*SINES, "channel_delay"}
    lines = EFFECTS["encoder_interpolation"]
    assert lines.reads_input(SINES["encoder_interpolation"])
    assert not lines.reads_input({"shaft": Shaft.OUTPUT, "lines": 500, "cycles": (1,)})


@pytest.mark.parametrize("effect", SINES)
def test_the_drive_is_where_it_stood_and_the_encoder_where_it_reads(effect, study, rows):
    """At theta as read the drive, a damaged tooth of it too, stands at theta - e, e being N times what shows at the
    output. Faults caught: the other sign, e not N times as large, arcmin for rad, the sine itself left out or taken at
    where the drive stood, a pulse that is met at the angle as read.
    """
    problem = problem_of(rows, CartesianModel.of(study.drive))
    fit = fit_with(problem, study, PULSE, (effect, SINES[effect], (0.3, -0.2)))
    shown = fit.terms[1].columns @ fit.coefficients[1]
    order = {"encoder_input_eccentricity": 1, "output_coupling": 2, "encoder_interpolation": 8}[effect]
    sine = np.column_stack([np.sin(order * rows.theta), np.cos(order * rows.theta)])
    assert np.std(shown - sine @ np.linalg.lstsq(sine, shown, rcond=None)[0]) < 1e-9
    stood = rows.theta - shown * RATIO * ARCMIN
    there = fit_with(problem_of(replace(rows, theta=stood), problem.base), study, PULSE)
    np.testing.assert_allclose(fit.prediction, there.prediction + shown, atol=1e-9)
    np.testing.assert_allclose(fit.ahead, shown * RATIO * ARCMIN, atol=1e-12)


@pytest.mark.parametrize("effect", SINES)
def test_columns_are_what_a_coefficient_changes(effect, study, rows):
    """By differences of the whole model, beside a damaged tooth whose pulse is narrow: the slope of what the zones
    meet counts too. Faults caught: the slope's sign or factor, the base's alone, the slope where nothing is ahead.
    """
    problem = problem_of(rows, CartesianModel.of(study.drive))
    fit = fit_with(problem, study, PULSE, (effect, SINES[effect], (0.3, 0.4)))
    columns = term_columns(fit.terms[1], fit)
    for k in range(2):
        sides = []
        for step in (1e-4, -1e-4):
            moved = fit.coefficients[1] + step * np.eye(2)[k]
            sides.append(evaluate(problem, fit.errors, fit.offsets, fit.terms, (fit.coefficients[0], moved)).prediction)
        slope = (sides[0] - sides[1]) / 2e-4
        # The zone that drives changes within a step here and there, where no slope is right.
        off = np.abs(columns[:, k] - slope)
        assert np.quantile(off, 0.97) < 2e-3
        # The pulse's slope is worth seeing: its own sine alone would be off by far more.
        assert np.abs(fit.terms[1].columns[:, k] - slope).max() > 0.02


def test_a_term_that_moves_the_angle_is_not_remembered_for_other_drives(study, rows):
    """What it adds depends on the drive beside it. Fault caught: its whitened columns kept with those that do not."""
    problem = problem_of(rows, CartesianModel.of(study.drive))
    lines = replace(explanations()["encoder_interpolation"].term(rows, SINES["encoder_interpolation"]), kept=True)
    for share in (0.0, 2.0):
        probe = FitProbe(evaluate(problem, share * problem.prior, np.zeros(1), (), ()))
        anew = probe.table(replace(lines, kept=False))
        np.testing.assert_array_equal(probe.table(lines)[0], anew[0])


def test_no_error_of_the_reading_leaves_the_angles_alone(rows):
    """Faults caught: an output's coupling that moves the input, a coefficient of nothing that is worked out."""
    output = explanations()["output_coupling"].term(rows, {"shaft": Shaft.OUTPUT, "orders": (2,)})
    still = explanations()["encoder_input_eccentricity"].term(rows, SINES["encoder_input_eccentricity"])
    assert not reads_input(output) and reads_input(still)
    assert read_ahead(rows, [output, still], [np.array([0.3, 0.1]), np.zeros(2)]) is None
    assert where_it_stood(rows, None) is rows


def test_several_errors_of_the_reading_add_up(rows):
    terms = [explanations()[effect].term(rows, shape) for effect, shape in SINES.items()]
    own = [np.array([0.1, 0.2]), np.array([0.3, -0.1]), np.array([-0.2, 0.1])]
    together = sum(term.columns @ c for term, c in zip(terms, own, strict=True))
    np.testing.assert_allclose(read_ahead(rows, terms, own), RATIO * ARCMIN * together, atol=1e-12)


def test_lines_of_an_encoder_go_by_the_angle_as_read(rows):
    """The grating moves with the wheel that is off its centre. Faults caught: lines at where the drive stood, teeth at
    the angle as read, the angle as read lost where rows are put right twice."""
    ahead = 0.004 * np.sin(rows.theta)
    there = where_it_stood(where_it_stood(rows, ahead), 0.5 * ahead)
    np.testing.assert_allclose(there.theta, rows.theta - 1.5 * ahead)
    np.testing.assert_array_equal(there.input_as_read, rows.theta)
    lines = explanations()["encoder_interpolation"]
    shape = SINES["encoder_interpolation"]
    np.testing.assert_array_equal(lines.term(there, shape).columns, lines.term(rows, shape).columns)
    np.testing.assert_array_equal(there.rows(rows.theta < 7).input_as_read, rows.theta[rows.theta < 7])


def test_a_narrow_pulse_is_fitted_where_it_was_met(study):
    """An encoder 0.2 arcmin off, 16 arcmin at the input, against a pulse 3 deg wide, without noise: all of it is
    explained. Fault caught: the pulse at the angle as read, which leaves a tenth of it."""
    rows, base = noisy(20), CartesianModel.of(study.drive)
    pulse = ("local_tooth_defect", {"centre": 2.0, "width_deg": 3.0, "on": Seat.CIRCULAR_SPLINE}, (0.004,))
    truth = fit_with(problem_of(rows, base), study, pulse, ECCENTRIC)
    problem = problem_of(replace(rows, error=truth.prediction), base)
    start = evaluate(problem, 0.9 * truth.errors, np.zeros(1), truth.terms, (np.array([0.003]), np.array([0.1, 0.1])))
    fit = refine(start, 30, 1e-12, move_shapes=False)
    assert np.std(fit.residual) < 1e-4
    assert fit.coefficients[0] == pytest.approx([0.004], rel=2e-3)
    assert fit.coefficients[1] == pytest.approx([0.14, 0.14], rel=2e-3)


@pytest.mark.parametrize("name", ["channel_delay", "_skew"])
def test_a_delay_is_an_error_of_the_reading(study, name):
    """The input turns both ways at two speeds, and the output is read 2 ms before it, or by as much more as time goes
    on: at 40 rad/s the drive stood 4.6 deg back. Each pair is the drive's own at the moment of the output. Faults
    caught: the drive at the angle as read, that of a moment as long after, a delay that grows and is not counted."""
    speed = np.repeat([10.0, -10.0, 40.0, -40.0, 20.0, -20.0], 500)
    time = np.arange(len(speed)) * 0.005
    theta = np.cumsum(speed) * 0.005
    delay, coefficient = (0.002, 2.0) if name == "channel_delay" else (1e-4 * time, 1e-4)
    base = CartesianModel.of(study.drive)
    own = to_cartesian(study.errors, base.half_width)
    error = base.evaluate_at(base.rotation(theta - speed * delay), own)[0] + speed * delay / RATIO / ARCMIN
    rows = replace(rows_of(error), theta=theta, speed=speed, time=time)
    term = explanations()[name].term(rows, {})
    fit = evaluate(problem_of(rows, base), own, np.zeros(1), [term], [np.array([coefficient])])
    np.testing.assert_allclose(fit.residual, 0, atol=1e-9)


def recorded(rows, error):
    table = {
        "time_s": 0.01 * np.arange(len(rows)),
        "input_angle_deg": np.degrees(rows.theta),
        "output_angle_deg": np.degrees(rows.theta / RATIO - error * ARCMIN),
    }
    return recording_from_table(pd.DataFrame(table), RATIO, name="record")


def offset(rows):
    return np.ones((len(rows), 1))


def test_high_orders_are_looked_for_where_the_drive_stood(study, rows):
    """What the averaged rows leave of those recorded, at the angles by which the teeth go. Fault caught: the angles as
    read."""
    fit = fit_with(problem_of(rows, CartesianModel.of(study.drive)), study, ECCENTRIC)
    nuisances = SimpleNamespace(columns=offset)
    left = left_as_recorded([recorded(rows, fit.prediction + 0.07)], fit, nuisances).rows
    np.testing.assert_allclose(left.theta, rows.theta - fit.ahead, atol=1e-9)
    np.testing.assert_allclose(left.input_as_read, rows.theta, atol=1e-9)
    np.testing.assert_allclose(left.error, 0.07, atol=1e-6)


def test_a_ripple_of_turns_unseen_stands_where_the_drive_stood(study, rows):
    """Faults caught: the ripple at the angles as read, by which hidden turns look worse than they are; what the drive
    does at them counted as the ripple's."""
    low = fit_with(problem_of(rows, CartesianModel.of(study.drive)), study, ECCENTRIC)
    high = fit_with(problem_of(rows, None), study, ("tooth_mesh", {"members": (1,)}, (0.05, 0.03)))
    found = [SimpleNamespace(best=SimpleNamespace(fit=fit)) for fit in (low, high)]
    state = SimpleNamespace(
        nuisances=SimpleNamespace(columns=offset), selection=found[0], high=found[1], ripple=np.zeros(len(rows))
    )
    there = explanations()["tooth_mesh"].term(replace(rows, theta=rows.theta - low.ahead), high.terms[0].shape)
    ripple = ripple_of([recorded(rows, low.prediction)], state)
    np.testing.assert_allclose(ripple, there.columns @ high.coefficients[0], atol=1e-6)


@pytest.mark.slow
def test_a_mesh_behind_an_eccentric_encoder_has_its_height(study):
    """0.08 arcmin of 162 waves, read with an encoder 0.2 arcmin off its centre at the output, 43 deg of a wave. Faults
    caught: the mesh fitted at the angles as read, which makes it 14 % too small; the ripple that is taken out of the
    hidden turns at the angles as read, by which the error there is twice the noise; the mesh taken for an encoder's
    lines, which go by the angle as read."""
    t = np.arange(24 * 400) * TURN / 400
    stood = np.r_[t, t[::-1]]
    error = kinematic_error_arcmin(study.drive, study.errors, stood) + 0.08 * np.sin(162 * stood + 0.4)
    noise = np.random.default_rng(3).normal(0, 0.01, len(stood))
    table = {
        "time_s": np.arange(len(stood)) * TURN / 2400,
        "input_angle_deg": np.degrees(stood + 0.2 * RATIO * ARCMIN * np.sin(stood + 0.7)),
        "output_angle_deg": np.degrees(stood / RATIO - (error + noise) * ARCMIN),
    }
    answer = diagnose([recording_from_table(pd.DataFrame(table), RATIO, name="record")], study.drive)
    assert answer.verdict == "named"
    found = {effect.id: effect.parameters for effect in answer.effects}
    assert set(found) == {"encoder_input_eccentricity", "tooth_mesh"}
    size = found["tooth_mesh"]["amplitude_arcmin"]
    assert size.low < 0.08 < size.high and size.value == pytest.approx(0.08, rel=0.01)
    assert found["encoder_input_eccentricity"]["amplitude_arcmin"].value == pytest.approx(0.2, rel=0.02)
    assert answer.evidence.unseen.extended < 1.2 * answer.evidence.noise_floor
