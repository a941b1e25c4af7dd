"""Friction and knees of a locked input stand where the data have them, not where the search looked."""

from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from hdopt.diagnosis import diagnose
from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.inference.settled_shapes import estimates_by_profile, profile_sigma, settled
from hdopt.effects import EFFECTS
from hdopt.effects.hysteresis import SHARES
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import gather
from tests.unit.test_locked_input import slider

REACHED, TRUE_FRICTION, TRUE_KNEE = 20.0, 4.71, 7.37
SOFT, STIFF = 1.6e3, 6e3
"""Nm/rad below the knee and above it."""
AR = (1.45, -0.47)
"""Noise of a locked actuator's encoder, as the planetary recording has it."""


def sweep(friction=TRUE_FRICTION, seed=0, noise=0.004):
    """A spring with a knee behind friction, torque recorded in steps of 0.025 Nm, noise of a long memory."""
    corners = (0, REACHED, -REACHED, 15, -18, REACHED, 0)
    torque = np.concatenate([np.arange(a, b, np.copysign(0.04, b - a)) for a, b in pairwise(corners)])
    behind = slider(torque, friction)
    low = np.clip(behind, -TRUE_KNEE, TRUE_KNEE)
    windup = (low / SOFT + (behind - low) / STIFF) * 10800 / np.pi
    red = lfilter([1], [1, -AR[0], -AR[1]], np.random.default_rng(seed).normal(0, noise, len(torque)))
    table = pd.DataFrame({"torque": np.round(torque / 0.025) * 0.025, "error": windup + red})
    return recording_from_table(table, 80.0, "torque=torque:Nm,error=error:arcmin")


@pytest.fixture(scope="module")
def problem():
    rows = gather([sweep()])
    noise = Noise(np.array(AR), 0.02, np.r_[0.0, 0.0, np.ones(len(rows) - 2)])
    return FitProblem(rows, None, np.ones((len(rows), 1)), noise)


def fitted(problem, friction, knee):
    """Spring and friction with their shapes held there, all that is linear fitted."""
    rows = problem.rows
    terms = [
        EFFECTS["torsional_windup"].term(rows, {"knee_1": knee}),
        EFFECTS["hysteresis"].term(rows, {"friction_nm": friction, "knee_nm": knee}),
    ]
    start = evaluate(problem, np.zeros(0), np.zeros(1), terms, [np.zeros(t.width) for t in terms])
    return refine(start, 4, move_shapes=False)


@pytest.fixture(scope="module")
def moved(problem):
    return settled(fitted(problem, 5.0, 8.0))


def test_a_shape_on_a_node_of_the_grid_goes_where_the_data_have_it(problem, moved):
    """From the nodes next to the truth. Fault caught: shapes left where the search put them."""
    nodes = [share * REACHED for share in SHARES]
    on_nodes = fitted(problem, 5.0, 8.0)
    assert {5.0, 8.0} <= {round(node, 9) for node in nodes}
    assert moved.objective < on_nodes.objective - 10 * problem.noise.sigma**2
    friction = moved.terms[1].shape["friction_nm"]
    assert friction == pytest.approx(TRUE_FRICTION, abs=0.1)
    assert moved.terms[0].shape["knee_1"] == pytest.approx(TRUE_KNEE, abs=0.3)
    assert settled(moved) is moved


def test_a_profile_is_as_wide_as_the_region_that_it_bounds(problem, moved):
    """Against the objective itself: just inside the stated distance some place is within 95 %, and none beyond it."""
    fit = moved
    rise = 1.96**2 * problem.noise.sigma**2
    half = 1.96 * profile_sigma(fit, 1, "friction_nm")
    own, step = fit.terms[1].shape, fit.terms[1].steps["friction_nm"]
    for reach in problem.settings.fit.profile_reach:
        for sign in (1, -1):
            shape = {**own, "friction_nm": own["friction_nm"] + sign * reach * step}
            terms = [fit.terms[0], EFFECTS["hysteresis"].term(problem.rows, shape)]
            there = refine(evaluate(problem, fit.errors, fit.offsets, terms, fit.coefficients), 4, move_shapes=False)
            assert reach * step <= half + 1e-9 or there.objective >= fit.objective + rise


def test_intervals_only_grow(moved):
    """The wider of profile and quadratic form; what is linear keeps its own."""
    fit = moved
    for plain, wide in zip(fit.estimates(), estimates_by_profile(fit, inflation=3.0), strict=True):
        before, after = np.diag(plain.covariance), np.diag(wide.covariance)
        assert np.all(after >= before * (1 - 1e-12))
        assert np.array_equal(plain.values, wide.values)


@pytest.mark.slow
def test_the_truth_lies_in_the_interval():
    """Off every node of the grid, torque in steps, noise of a long memory."""
    diagnosis = diagnose(sweep(seed=3), None, 80.0)
    stated = next(one for one in diagnosis.effects if one.id == "hysteresis").parameters["friction_torque"]
    assert stated.low < TRUE_FRICTION < stated.high
    assert stated.high - stated.low < 0.2 * TRUE_FRICTION
