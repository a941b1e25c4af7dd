"""Intervals over the forms that an effect may have: they take in what forms that explain as well say, and no others."""

from types import SimpleNamespace

import numpy as np
import pytest
from test_profile_interval import fitted

from hdopt.diagnosis.inference.other_forms import estimates_over_forms
from hdopt.diagnosis.inference.profile_interval import profiled_estimates
from hdopt.diagnosis.orientation import AS_COUNTED
from hdopt.diagnosis.settings import DEFAULT
from hdopt.diagnosis.verdict.named_effect import describe
from hdopt.effects import EFFECTS
from hdopt.effects._friction_law import LAWS, Law

TRANSITION = 1.5
"""Of the friction in these recordings, deg of output."""


def friction(noise, model, true=Law.BOUC_WEN):
    """A fit by the law `model` of friction that crosses by the law `true`, 0.4 arcmin in passes of two turns."""
    stroke = np.arange(0, 2 * 2 * np.pi, 2 * np.pi / 120)
    theta = np.concatenate([stroke, 4 * np.pi - stroke] * 4)
    time = np.arange(len(theta)) * 0.01
    plain = fitted(theta, time, np.zeros(len(theta)), 1.0, "hysteresis", {"transition_deg": TRANSITION, "model": true})
    wave = EFFECTS["hysteresis"].term(plain.problem.rows, {"transition_deg": TRANSITION, "model": true}).columns[:, 0]
    error = 0.4 * wave + np.random.default_rng(2).normal(0, noise, len(theta))
    return fitted(theta, time, error, noise, "hysteresis", {"transition_deg": TRANSITION, "model": model})


def interval(estimate, fit):
    one = estimate.parameter(fit.terms[0].width, "deg")
    return one.low, one.high


@pytest.mark.parametrize("law", LAWS)
def test_forms_that_explain_as_well_count(law):
    """In noise as large as the friction no law can be told from another. Fault caught: the interval of one law."""
    fit = friction(0.5, law)
    low, high = interval(estimates_over_forms(fit)[0], fit)
    alone = interval(profiled_estimates(fit)[0], fit)
    assert low <= alone[0] and alone[1] <= high
    for other in LAWS:
        its_own = friction(0.5, other)
        one = profiled_estimates(its_own)[0]
        said, sigma = one.values[its_own.terms[0].width], np.sqrt(one.covariance[-1, -1])
        assert low < said - 1.5 * sigma and said + 1.5 * sigma < high, other


def test_a_diagnosis_says_the_interval_over_forms():
    """Fault caught: it says that of the law which explains best."""
    fit = friction(0.5, Law.DAHL)
    candidate = SimpleNamespace(fit=fit, effects=("hysteresis",), log_bayes_factor=9.0)
    evidence = SimpleNamespace(
        selection=SimpleNamespace(candidates=[candidate]),
        settings=DEFAULT,
        base_held_out=SimpleNamespace(variance=1.0),
        orientation=AS_COUNTED,
        false_alarm_p=0.0,
        inflation=1.0,
    )
    (said,) = describe(candidate, evidence, high=True)
    low, high = interval(estimates_over_forms(fit)[0], fit)
    seen = said.parameters["transition_deg"]
    assert (seen.low, seen.high) == pytest.approx((low, high))
    assert high - low > 1.1 * np.diff(interval(profiled_estimates(fit)[0], fit))[0]


@pytest.mark.parametrize("law", [Law.BOUC_WEN, Law.DAHL, Law.MAXWELL_SLIP])
def test_forms_that_explain_less_do_not_count(law):
    """In little noise the true law stands alone. Fault caught: every form counts."""
    fit = friction(0.004, law, true=law)
    assert interval(estimates_over_forms(fit)[0], fit) == pytest.approx(interval(profiled_estimates(fit)[0], fit))


def test_an_interval_of_a_wrong_law_reaches_to_the_right_one():
    """As long as the wrong law explains nearly as well. Fault caught: forms are compared at its own transition."""
    fit = friction(0.15, Law.DAHL)
    alone, over = (interval(estimate, fit) for estimate in (profiled_estimates(fit)[0], estimates_over_forms(fit)[0]))
    said = float(friction(0.15, Law.BOUC_WEN).terms[0].shape["transition_deg"])
    assert over[0] < said < over[1]
    assert over != pytest.approx(alone)


def test_an_effect_of_one_form_keeps_its_estimate():
    fit = friction(0.1, Law.DAHL)
    bump = fitted(
        fit.problem.rows.theta,
        fit.problem.rows.time,
        fit.problem.rows.error,
        0.1,
        "thermal_drift",
        {"time_constant_s": 3.0},
    )
    (over,), (alone,) = estimates_over_forms(bump), profiled_estimates(bump)
    np.testing.assert_array_equal(over.covariance, alone.covariance)
    assert over.profiles == alone.profiles
