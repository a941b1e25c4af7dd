"""What stays of a residual once base, offsets and kept terms are taken out, against the normal equations."""

from types import SimpleNamespace

import numpy as np
import pytest

from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.diagnosis.settings import DEFAULT
from hdopt.effects.term import Term

N, SIGMA = 60, 0.2


def probe_of(design, precision, residual, weights=None):
    """A probe on a fit without terms, whose rows weigh as `weights` say."""
    weights = np.ones(N) if weights is None else weights
    noise = SimpleNamespace(
        sigma=SIGMA,
        whiten=lambda rows: (weights * np.asarray(rows).T).T,
        whitened=lambda blocks: weights[:, None] * np.column_stack(blocks),
    )
    problem = SimpleNamespace(settings=DEFAULT, rows=SimpleNamespace(highest_order=9.0), noise=noise, behind=())
    fit = SimpleNamespace(terms=(), problem=problem, motion=None, residual=residual)
    fit.white_design = lambda keep: fit.problem.noise.whiten(design)
    problem.prior_precision = lambda width: precision
    fit.columns_of = lambda term, keep: term.columns
    problem.whitened = {}
    return FitProbe(fit)


@pytest.mark.parametrize("weigh", [False, True])
def test_what_is_fitted_is_taken_out_as_far_as_its_prior_lets_it(weigh):
    """(1 - A (A'A + sigma^2 P)^-1 A') r, with whitened rows. Would catch a prior that is left out or measured in other
    noise, and rows that are not whitened."""
    rng = np.random.default_rng(1)
    design, residual, precision = rng.normal(size=(N, 4)), rng.normal(size=N), np.array([0.0, 100.0, 900.0, 0.0])
    weights = rng.uniform(0.5, 2.0, N) if weigh else np.ones(N)
    probe = probe_of(design, precision, residual, weights)
    white, r = weights[:, None] * design, weights * residual
    left = r - white @ np.linalg.solve(white.T @ white + SIGMA**2 * np.diag(precision), white.T @ r)
    assert probe.white_residual == pytest.approx(left, abs=1e-12)
    assert probe.project(white[:, 0]) == pytest.approx(np.zeros(N), abs=1e-12)
    assert np.linalg.norm(probe.project(white[:, 2])) > 0.1


def test_a_column_that_is_there_twice_takes_out_no_more():
    """Nor does one of zeros. Would catch a direction that is nothing but rounding, taken out of every residual."""
    rng = np.random.default_rng(2)
    design, residual = rng.normal(size=(N, 3)), rng.normal(size=N)
    twice = np.column_stack([design, 2 * design[:, 1], np.zeros(N)])
    one, two = (probe_of(a, np.zeros(a.shape[1]), residual).white_residual for a in (design, twice))
    assert two == pytest.approx(one, abs=1e-10)


def test_noise_with_the_signs_of_turns_is_projected_as_the_residual_is():
    rng = np.random.default_rng(3)
    design, residual, signs = rng.normal(size=(N, 3)), rng.normal(size=N), rng.choice([-1.0, 1.0], N)
    probe = probe_of(design, np.zeros(3), residual)
    flipped = probe.flipped(signs)
    assert flipped.residual == pytest.approx(signs * residual)
    assert design.T @ flipped.white_residual == pytest.approx(np.zeros(3), abs=1e-12)
    assert flipped.white_residual == pytest.approx(probe.project(signs * probe.white_residual))
    other = probe.on(2 * residual)
    assert other.white_residual == pytest.approx(2 * probe.white_residual)


@pytest.mark.parametrize("widths", [(1,), (1, 2, 1, 1, 3), (7, 1, 1, 1, 1, 1, 9, 2), (5, 5, 5), (4, 4)])
def test_the_gain_of_each_of_many_terms_is_the_drop_that_it_alone_brings(widths):
    """Against a least-squares fit with and without its columns, beside a fit of four. Faults caught: columns that stand
    beside each other in one product mixed up, a term left out where they no longer fit side by side, and one wider
    than what is fitted."""
    rng = np.random.default_rng(4)
    design, residual, weights = rng.normal(size=(N, 4)), rng.normal(size=N), rng.uniform(0.5, 2.0, N)
    terms = [Term("output_coupling", {}, columns=rng.normal(size=(N, width)) + design[:, :1]) for width in widths]

    def left(*columns):
        white = weights[:, None] * np.column_stack([design, *columns])
        return float(np.linalg.lstsq(white, weights * residual)[1][0])

    probe = probe_of(design, np.zeros(4), residual, weights)
    drops = [(left() - left(term.columns)) / SIGMA**2 for term in terms]
    assert probe.gains(terms) == pytest.approx(drops, rel=1e-4)
    assert probe.gains(terms) == pytest.approx([probe.gain(term) for term in terms], rel=1e-12)


def test_the_gain_of_each_part_of_a_term_is_that_of_a_term_of_these_columns():
    """In any order, alone and overlapping. Faults caught: moments of the first columns for those of a part, and what
    the fit absorbs of others."""
    rng = np.random.default_rng(6)
    design, residual, weights = rng.normal(size=(N, 4)), rng.normal(size=N), rng.uniform(0.5, 2.0, N)
    probe = probe_of(design, np.zeros(4), residual, weights)
    columns = rng.normal(size=(N, 6)) + design[:, :1]
    parts = [(0, 1), (4, 5), (1,), (2, 3, 0, 1), range(6)]
    alone = [Term("bearing_pass", {}, columns=columns[:, list(part)]) for part in parts]
    wide = Term("bearing_pass", {}, columns=columns)
    assert probe.gains_of_parts(wide, parts) == pytest.approx(probe.gains(alone), rel=1e-9)
    assert probe.gains_of_parts(wide, []) == []


@pytest.mark.parametrize("kept", [(True, True, True), (True, False, True)])
def test_what_is_remembered_of_terms_is_theirs_and_that_of_their_fit(kept):
    """Asked again, with other signs, beside another fit and in another order. Faults caught: a residual, or what a fit
    absorbs, that is remembered too; products of the terms that were asked first."""
    rng = np.random.default_rng(5)
    design, residual = rng.normal(size=(N, 4)), rng.normal(size=N)
    columns = [rng.normal(size=(N, width)) + design[:, :1] for width in (2, 1, 3)]
    terms = [Term("output_coupling", {}, columns=one, kept=keep) for one, keep in zip(columns, kept, strict=True)]
    first = probe_of(design, np.zeros(4), residual)
    other = probe_of(design[:, :2], np.zeros(2), residual)
    other.fit.problem.whitened = first.fit.problem.whitened
    signs = rng.choice([-1.0, 1.0], N)
    for probe in (first, first.flipped(signs), first.on(signs * residual**2), other):
        anew = probe.on(probe.residual)
        anew.white_residual = probe.white_residual
        anew.looked_at = {}
        fresh = [Term("output_coupling", {}, columns=one) for one in columns]
        for order in ([0, 1, 2], [2, 0], [1]):
            gains = probe.gains([terms[i] for i in order])
            assert gains == pytest.approx(anew.gains([fresh[i] for i in order]), rel=1e-9)


def test_no_terms_gain_nothing():
    assert probe_of(np.ones((N, 1)), np.zeros(1), np.arange(N)).gains([]) == []
