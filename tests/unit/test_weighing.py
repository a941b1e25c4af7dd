"""Log Bayes factors by hand, and which subset of terms they put first."""

from math import log
from types import SimpleNamespace

import numpy as np
import pytest
from test_cross_validation import RATE, rows_of, without_base

from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.search.candidates import Candidate, rank_subsets, search_terms, weigh
from hdopt.diagnosis.search.penalty import Scale, penalty, searched
from hdopt.diagnosis.search.subset_search import ranked
from hdopt.diagnosis.settings import DEFAULT
from hdopt.effects.term import Term

THETA = np.arange(40 * RATE) * 2 * np.pi / RATE


@pytest.fixture(scope="module")
def fit():
    error = 0.1 * np.sin(3.3 * THETA) + 0.05 * np.sin(5.7 * THETA + 1) + 0.08 * np.sin(6.6 * THETA)
    return without_base(rows_of(error + np.random.default_rng(0).normal(0, 0.02, len(THETA))))


def wave(effect, order):
    return Term(effect, {}, columns=np.column_stack([np.sin(order * THETA), np.cos(order * THETA)]))


def test_a_bayes_factor_is_half_the_gain_less_the_penalty():
    problem = SimpleNamespace(base=None, noise=SimpleNamespace(sigma=0.5))
    term = Term("hysteresis", {}, columns=np.zeros((4, 2)))
    fit, base = SimpleNamespace(problem=problem, objective=6.0, terms=(term,)), SimpleNamespace(objective=10.0)
    scale = Scale(1000.0, inflation=2.0)
    found = weigh(fit, base, scale)
    assert found.gain == 16.0
    assert found.log_bayes_factor == pytest.approx(16.0 / 2 / 2 - log(1000.0) - DEFAULT.penalty.effect_cost)


def test_what_was_searched_and_what_is_unlikely_is_paid_for():
    """A hundred shapes looked at, and odds of 1 to e^3 against it."""
    term = Term("hysteresis", {}, columns=np.zeros((4, 1)), trials=100.0, odds=-3.0)
    assert searched(term) == pytest.approx(log(100.0) + 3.0)
    plain = Term("hysteresis", {}, columns=np.zeros((4, 1)))
    for count in (1, 2):
        more = penalty([term] * count, 0.0, Scale(100.0)) - penalty([plain] * count, 0.0, Scale(100.0))
        assert more == pytest.approx(count * (log(100.0) + 3.0))


def test_effects_of_one_kind_pay_for_their_inexact_shapes():
    """A share of what is explained: two loops as many times as they gain, divided by the noise's roughness."""
    pair = [Term(name, {}, columns=np.zeros((4, 2))) for name in ("hysteresis", "lost_motion")]
    more = penalty(pair, 1000.0, Scale(100.0, inflation=2.0)) - penalty(pair, 0.0, Scale(100.0, inflation=2.0))
    assert more == pytest.approx(DEFAULT.penalty.discrepancy * 1000.0 / 2 / 2)


def test_the_subset_that_is_there_leads(fit):
    """Three waves are there, two of them of variants of one effect, of which a set holds one; a fourth pays nothing."""
    terms = [
        wave("output_coupling", 3.3),
        wave("bearing_pass", 5.7),
        wave("thermal_drift", 8.1),
        wave("output_coupling", 6.6),
    ]
    scale = Scale(1920.0, inflation=1.7)
    found = rank_subsets(FitProbe(fit), terms, scale)
    assert set(found[0].indices) == {0, 1}
    assert max(len(one.indices) for one in found) == 3
    top = max(one.gain for one in found)
    for one in found:
        chosen = [terms[i] for i in one.indices]
        assert len({term.effect for term in chosen}) == len(chosen)
        assert one.log_bayes_factor == pytest.approx(one.gain / 1.7 / 2 - penalty(chosen, top, scale), rel=1e-12)
    assert [one.log_bayes_factor for one in found] == sorted((one.log_bayes_factor for one in found), reverse=True)


def test_gains_are_drops_of_the_sum_of_squares(fit):
    """n a^2/2 over the noise's variance for a sine of amplitude a; of two orders together the sum."""
    terms = [wave("output_coupling", 3.3), wave("bearing_pass", 5.7)]
    gains = {one.indices: one.gain for one in rank_subsets(FitProbe(fit), terms, Scale(1920.0))}
    squares = fit.residual @ fit.residual
    for indices, gain in gains.items():
        columns = np.column_stack([np.ones(len(THETA)), *(terms[i].columns for i in indices)])
        left = fit.residual - columns @ np.linalg.lstsq(columns, fit.residual, rcond=None)[0]
        bare = squares - len(THETA) * np.mean(fit.residual) ** 2
        assert gain == pytest.approx((bare - left @ left) / 0.02**2, rel=1e-3)


def test_what_is_ruled_out_is_not_searched(fit):
    probe = FitProbe(fit)
    names = {term.effect for term in search_terms(probe, only=["output_coupling", "encoder_input_eccentricity"])}
    assert names == {"output_coupling", "encoder_input_eccentricity"}
    few = search_terms(probe, skip=["output_coupling"], only=["output_coupling", "encoder_input_eccentricity"])
    assert {term.effect for term in few} == {"encoder_input_eccentricity"}


def test_candidates_stand_in_the_order_of_their_evidence():
    """Not of their gain, which the largest set always leads."""
    made = {"wide": Candidate("wide", 10.0, 900.0), "plain": Candidate("plain", 40.0, 100.0)}
    state = SimpleNamespace(
        fits=made,
        base="base",
        top_gain=900.0,
        weigh=lambda fit, top: made[fit],
        settings=SimpleNamespace(leaders=0, otherwise=0),
    )
    state.fits = {name: name for name in made}
    assert [candidate.fit for candidate in ranked(state)] == ["plain", "wide", "base"]
