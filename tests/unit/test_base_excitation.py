"""What a resonance makes of the drive's motion, its own and what is fitted beside it."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lsim

from hdopt.diagnosis.inference.base_excitation import excites, is_driven
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.inference.nuisance import nuisances_for
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.search.acceptance import is_acceptable, lost_in_misfit
from hdopt.diagnosis.search.as_recorded import left_of
from hdopt.diagnosis.search.zone_high_order import _step_by_step
from hdopt.drive.geometry import ARCMIN
from hdopt.effects import EFFECTS
from hdopt.effects._oscillator import relative_responses
from hdopt.effects.declared import Shaft
from hdopt.effects.resonance import Foot
from hdopt.kinematics.cartesian import CartesianModel, to_cartesian
from hdopt.kinematics.waveform import kinematic_error_arcmin
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather
from hdopt.simulation import Operation
from hdopt.study import load_study

TURN = 2 * np.pi
RATIO = 80.0
FREQUENCY, DAMPING = 6.0, 0.06
LOBES = {"lobes": 5}
SWING = {"frequency_hz": FREQUENCY, "damping_ratio": DAMPING}


@pytest.fixture(scope="module")
def study():
    return load_study(drive="csf-25-80")


def problem_of(study, turns=30, rate=120):
    """A problem on rows of a drive that speeds up from half a turn a second to two, the drive's own error in them."""
    theta = np.arange(turns * rate) * TURN / rate
    speed = np.linspace(0.5, 2.0, len(theta))
    time = np.r_[0, np.cumsum(1 / (rate * speed[:-1]))]
    error = kinematic_error_arcmin(study.drive, study.errors, theta)
    table = {
        "time_s": time,
        "input_angle_deg": np.degrees(theta),
        "output_angle_deg": np.degrees(theta / RATIO - error * ARCMIN),
    }
    samples = gather([recording_from_table(pd.DataFrame(table), RATIO, name="record")])
    base = CartesianModel.of(study.drive)
    nuisances = nuisances_for(samples, base)
    return FitProblem(samples, base, nuisances.columns(samples), Noise.white(samples, 0.01))


def shaken(study, problem, coefficients):
    """The drive with five lobes and a resonance."""
    samples = problem.rows
    errors = to_cartesian(study.errors, problem.base.half_width)
    nothing = np.zeros(len(samples))
    terms = [EFFECTS["circular_spline_lobing"].term(samples, LOBES), EFFECTS["resonance"].term(samples, SWING, nothing)]
    return evaluate(problem, errors, np.zeros(problem.nuisance.shape[1]), terms, coefficients)


LOBED = [np.array([1e-3, 5e-4]), np.array([1.0, 0.2])]


def test_filter_is_that_of_the_signal_library():
    """The swing is what scipy's simulation of its equation makes of straight lines between the rows."""
    rng = np.random.default_rng(0)
    time = np.arange(2000) / 400
    samples = Operation(speed=1.0).conditions(RATIO, time, 1.0, 1e6)
    motions = rng.normal(size=(2000, 3))
    w = TURN * FREQUENCY
    system = ([-1.0, -2 * 0.3 * DAMPING * w, 0.0], [1.0, 2 * DAMPING * w, w * w])
    expected = np.column_stack([lsim(system, one, time, interp=True)[1] for one in (motions - motions[0]).T])
    found = relative_responses(samples, motions, FREQUENCY, DAMPING, np.array([[1.0], [0.3]]))[:, :, 0]
    np.testing.assert_allclose(found, expected, atol=1e-9 * abs(expected).max())


def test_only_motions_of_the_drive_excite(study):
    problem = problem_of(study, turns=3)
    lobes, swing = shaken(study, problem, LOBED).terms
    wheel = EFFECTS["encoder_output_eccentricity"].term(problem.rows, {"shaft": Shaft.OUTPUT, "orders": (1,)})
    mesh = EFFECTS["tooth_mesh"].term(problem.rows, {"sidebands": (0,)})
    assert [excites(term) for term in (lobes, mesh, swing, wheel)] == [True, True, False, False]
    assert [is_driven(term) for term in (lobes, mesh, swing, wheel)] == [False, False, True, False]


def test_resonance_follows_the_lobes_beside_it(study):
    problem = problem_of(study)
    fit = shaken(study, problem, LOBED)
    own = EFFECTS["resonance"].term(problem.rows, SWING, fit.motion).columns @ LOBED[1]
    np.testing.assert_allclose(fit.contribution(1), own, atol=1e-12)
    still = evaluate(problem, fit.errors, fit.offsets, (), ())
    without = EFFECTS["resonance"].term(problem.rows, SWING, still.motion).columns @ LOBED[1]
    assert np.std(own - without) > 0.1 * np.std(own)


@pytest.mark.parametrize("column", ["base", "lobes"])
def test_design_is_the_derivative_of_the_prediction(study, column):
    """Where no zone changes its driving; rows beside such a change are left out."""
    problem = problem_of(study)
    fit = shaken(study, problem, LOBED)
    index = 2 if column == "base" else 12 + problem.nuisance.shape[1]
    step, sides = 1e-7, []
    for sign in (1, -1):
        errors, coefficients = fit.errors.copy(), [c.copy() for c in LOBED]
        if column == "base":
            errors[index] += sign * step
        else:
            coefficients[0][0] += sign * step
        sides.append(evaluate(problem, errors, fit.offsets, fit.terms, coefficients))
    assert np.array_equal(sides[0].zone, sides[1].zone)
    slope = (sides[0].prediction - sides[1].prediction) / (2 * step)
    np.testing.assert_allclose(fit.design()[:, index], slope, atol=1e-4 * abs(slope).max())


def test_fit_finds_lobes_behind_a_resonance(study):
    """From none at all: their waves are amplified and turned as the speed runs through the resonance."""
    problem = problem_of(study)
    truth = shaken(study, problem, LOBED)
    noise = np.random.default_rng(1).normal(0, 0.01, len(problem.rows))
    rows = replace(problem, rows=replace(problem.rows, error=truth.prediction + noise))
    start = shaken(study, rows, [np.zeros(2), np.array([0.8, 0.0])])
    fit = refine(start, iterations=20)
    np.testing.assert_allclose(fit.coefficients[0], LOBED[0], atol=3e-5)
    assert fit.terms[1].shape["frequency_hz"] == pytest.approx(FREQUENCY, rel=5e-3)
    assert np.std(fit.residual) < 0.0105
    # Beside the resonance alone, the lobes are looked for as the output shows them.
    alone = evaluate(rows, truth.errors, truth.offsets, truth.terms[1:], LOBED[1:])
    lobes = truth.terms[0]
    seen, direct = (FitProbe(alone, keep=keep).gain(lobes) for keep in ([0], []))
    assert seen > 1.2 * direct


@pytest.mark.parametrize(("size", "credible"), [(1.0, True), (0.02, False)])
def test_a_swing_must_be_more_than_the_misfit_of_what_excites_it(study, size, credible):
    problem = problem_of(study)
    fit = shaken(study, problem, [np.array([4e-3, 2e-3]), np.array([size, 0.0])])
    assert lost_in_misfit(fit, 1) is not credible
    assert is_acceptable(fit) is credible


@pytest.mark.parametrize("foot", list(Foot))
def test_what_is_looked_for_in_the_rest_is_seen_through_what_was_found(study, foot):
    """A mesh beside the motion moves the spring's foot, too: fitted to what drive and resonance leave, with the
    resonance held behind it, it adds what it adds in the fit of all three. Faults caught: the mesh past the spring, the
    changes of speed counted twice, columns or contributions without what swings."""
    problem = problem_of(study)
    swing = EFFECTS["resonance"].term(problem.rows, SWING | {"foot": foot}, np.zeros(len(problem.rows)))
    mesh = EFFECTS["tooth_mesh"].term(problem.rows, {"sidebands": (0,)})
    errors, offsets = to_cartesian(study.errors, problem.base.half_width), np.zeros(problem.nuisance.shape[1])
    gain, own = np.array([1.0, 0.2]), np.array([0.03, -0.05])
    without, whole = (
        evaluate(problem, errors, offsets, terms, coefficients)
        for terms, coefficients in (([swing], [gain]), ([swing, mesh], [gain, own]))
    )
    adds = whole.prediction - without.prediction
    assert np.std(adds - mesh.columns @ own) > 0.3 * np.std(adds)
    rest = left_of(without)
    np.testing.assert_array_equal(rest.rows.error, without.residual)
    alone = evaluate(rest, np.zeros(0), np.zeros(1), [mesh], [own])
    for seen in (alone.prediction, alone.contributions, alone.design()[:, 1:] @ own):
        np.testing.assert_allclose(seen, adds, atol=1e-9 * np.max(np.abs(adds)))
    still = evaluate(rest, np.zeros(0), np.zeros(1), (), ())
    assert not np.any(still.prediction)
    seen = FitProbe(still).white_columns(mesh) @ own
    np.testing.assert_allclose(seen, rest.noise.whiten(adds), atol=1e-9 * np.max(np.abs(seen)))


def test_a_mesh_in_the_zones_finds_the_swing_that_it_excites(study):
    """A resonance that was found beside the motion without the mesh is off by three parts in a hundred; beside heights
    of teeth that differ it moves to its place, and is handed on from there. Faults caught: its frequency held beside
    the heights, the frequency as found before handed on."""
    problem = problem_of(study, turns=4, rate=500)
    errors, offsets = to_cartesian(study.errors, problem.base.half_width), np.zeros(problem.nuisance.shape[1])
    heights = 1 + 0.3 * np.random.default_rng(2).normal(size=162)
    shape = {"heights": tuple(heights / np.median(heights)), "skew": 0.1, "start": 0.3}
    mesh, still = EFFECTS["tooth_mesh"].term(problem.rows, shape), np.zeros(len(problem.rows))
    gain = np.array([1.0, 0.1])

    def swing(frequency):
        return EFFECTS["resonance"].term(problem.rows, {"frequency_hz": frequency, "damping_ratio": 0.06}, still)

    truth = evaluate(problem, errors, offsets, [swing(30.0), mesh], [gain, np.array([4e-3])])
    noise = np.random.default_rng(1).normal(0, 0.01, len(problem.rows))
    told = replace(problem, rows=replace(problem.rows, error=truth.prediction + noise))
    low = evaluate(told, errors, offsets, [swing(29.1)], [gain])
    beside = [(low.terms[0], gain)]
    zones = [{"sidebands": (0,), "zones": True}]
    found = _step_by_step(told, low, beside, EFFECTS["tooth_mesh"], zones, np.random.default_rng(0))
    assert found.terms[0].shape["frequency_hz"] == pytest.approx(30.0, rel=2e-3)
