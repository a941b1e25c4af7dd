"""A drive within the tolerances of its kind, in place of one outside them that leaves hardly less."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.search import at_home
from hdopt.diagnosis.search.at_home import brought_home, is_outside_tolerances, left_by_shapes
from hdopt.diagnosis.settings import DEFAULT
from hdopt.effects import EFFECTS
from hdopt.effects.declared import Shaft
from hdopt.kinematics.cartesian import CartesianModel
from hdopt.recordings.recording import Recording
from hdopt.recordings.rows import gather
from hdopt.study import load_study

WHEEL = {"shaft": Shaft.OUTPUT, "orders": (1,)}
NOISE = 0.005
FAR = 1.5 * np.array(DEFAULT.base.prior_mm)[0]
"""An eccentricity of the axis far outside the tolerances of its kind, mm."""


@pytest.fixture(scope="module")
def base():
    return CartesianModel.of(load_study("csf-25-80").drive)


def within(seed=4):
    """Errors (12,) mm of a drive within its tolerances."""
    return np.random.default_rng(seed).normal(size=12) * np.array(DEFAULT.base.box_mm) / 12


def far(base):
    """Such errors whose axis is far out: a part of it, to first order, is taken back by the CS teeth."""
    errors = within()
    errors[8] -= base.tan_alpha * base.tip.passes_major * (FAR - errors[0])
    errors[0] = FAR
    return errors


def problem_of(base, errors, turns=30, rate=80):
    """A record of these `errors`."""
    theta = np.linspace(0, 2 * np.pi * turns, turns * rate)
    error = base.evaluate(theta, errors)[0] + np.random.default_rng(1).normal(0, NOISE, len(theta))
    rows = gather([Recording("record", 80.0, theta, error)])
    return FitProblem(rows, base, np.ones((len(rows), 1)), Noise.white(rows, NOISE))


def beside(problem, errors):
    """A wheel off its centre beside a drive of these `errors`."""
    term = EFFECTS["encoder_output_eccentricity"].term(problem.rows, WHEEL)
    return evaluate(problem, errors, np.zeros(1), (term,), (np.zeros(2),))


def home_of(fit, inflation=1.0):
    return brought_home(fit, inflation, np.random.default_rng(2))


def test_a_drive_far_out_makes_way_for_one_at_home(base):
    """Of a record made by a drive within: on the same problem and with the same terms. Faults caught: a home that is
    not looked for, one on the narrowed problem."""
    problem = problem_of(base, within())
    fit = beside(problem, far(base))
    assert is_outside_tolerances(fit)
    home = home_of(fit)
    assert not is_outside_tolerances(home)
    assert home.problem is problem and [term.effect for term in home.terms] == ["encoder_output_eccentricity"]
    assert home.objective < fit.objective + DEFAULT.search.home_within * NOISE**2


def test_a_drive_that_is_far_out_stays(base):
    """Of a record made by such a drive: none at home leaves nearly as little, but in noise that is much rougher. Faults
    caught: home whatever it leaves, and the noise's roughness left out."""
    fit = beside(problem_of(base, far(base)), far(base))
    assert home_of(fit) is fit
    assert home_of(fit, inflation=1e6) is not fit


LOBES = {"lobes": 4, "waves": (1,)}


def with_a_wave(base, amplitude):
    """A record of a drive far out and a wave of four on its circular spline, so many mm of arc high, fitted as made."""
    lobes = EFFECTS["circular_spline_lobing"]
    clean = problem_of(base, far(base))
    term, height = lobes.term(clean.rows, LOBES), (np.array([amplitude, 0.0]),)
    made = evaluate(clean, far(base), np.zeros(1), (term,), height)
    rows = replace(clean.rows, error=clean.rows.error + made.contribution(0))
    problem = FitProblem(rows, base, clean.nuisance, clean.noise)
    return evaluate(problem, far(base), np.zeros(1), (lobes.term(rows, LOBES),), height)


@pytest.mark.parametrize(
    ("noise", "share", "inflation", "comes"),
    [(15, 0.9, 1.0, True), (17, 1.0, 1.0, False), (15, 1.1, 1.0, False), (30, 0.9, 2.0, True), (32, 1.5, 2.0, False)],
)
def test_what_inexact_shapes_leave_is_any_drives(base, noise, share, inflation, comes, monkeypatch):
    """A home that leaves so many `noise` variances more and a `share` of what the shape of a wave may leave: a
    thousandth of what it explains. Faults caught: a home that only noise may part from the drive far out, the roughness
    of the noise left out of the share, a share of what is exact."""
    fit = with_a_wave(base, 0.01)
    left = left_by_shapes(fit)
    explained = np.sum(fit.contribution(0) ** 2) / NOISE**2
    assert 0.5 * explained < 1e3 * left < explained
    home = SimpleNamespace(objective=fit.objective + (noise + share * left) * NOISE**2, problem=fit.problem)
    monkeypatch.setattr(at_home, "fitted_within", lambda fit, rng: home)
    monkeypatch.setattr(at_home, "refine", lambda fit: fit)
    monkeypatch.setattr(at_home, "is_outside_tolerances", lambda one: one is fit)
    assert (home_of(fit, inflation) is home) is comes
    monkeypatch.setattr(at_home, "leaves_nothing", lambda term: True)
    assert home_of(fit, inflation) is fit


def test_what_is_at_home_stays(base, monkeypatch):
    """Without a fit. Fault caught: every drive fitted once more."""
    monkeypatch.setattr(at_home, "fitted_within", lambda *given: pytest.fail("fitted"))
    fit = beside(problem_of(base, within()), within())
    assert home_of(fit) is fit
