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
from hdopt.drive.geometry import ARCMIN
from hdopt.effects import EFFECTS
from hdopt.effects._oscillator import relative_responses
from hdopt.effects.declared import Shaft
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
    assert [excites(term) for term in (lobes, swing, wheel)] == [True, False, False]
    assert [is_driven(term) for term in (lobes, swing, wheel)] == [False, True, False]


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
