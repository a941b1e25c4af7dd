"""Beside a ripple that the zones meet: the drive there, and what the ripple may leave in averaged rows."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from test_cross_validation import TURN, noisy

from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.search.freed_of_ripple import at_drive_of, each_left_out, power_in_rows, stands, without_effects_of
from hdopt.effects.declared import Shaft
from hdopt.kinematics.cartesian import CartesianModel
from hdopt.recordings.read import recording_from_table
from hdopt.recordings.rows import neighbours_for, row_of_each_sample
from hdopt.study import load_study

SIZE = 0.05


def test_a_fit_goes_to_the_drive_of_the_ripple_with_its_own_terms():
    """Faults caught: the drive as it was, the offset of the other drive kept, terms or coefficients lost, a drive taken
    from a ripple beside the zones, which has none."""
    rows = noisy(6)
    problem = FitProblem(
        rows, CartesianModel.of(load_study(drive="csf-25-80").drive), np.ones((len(rows), 1)), Noise.white(rows, 0.02)
    )
    term = problem.explanations["output_coupling"].term(rows, {"shaft": "output", "orders": (2,)})
    fit = evaluate(problem, 0.5 * problem.prior, np.array([3.0]), [term], [np.array([0.1, -0.2])])
    ripple = SimpleNamespace(problem=problem, errors=-0.3 * problem.prior)
    (there,) = at_drive_of(ripple, [fit])
    np.testing.assert_array_equal(there.errors, ripple.errors)
    np.testing.assert_array_equal(there.coefficients[0], [0.1, -0.2])
    assert there.terms == (term,)
    assert np.mean(there.residual) == pytest.approx(0, abs=1e-9)
    beside = SimpleNamespace(problem=SimpleNamespace(base=None), errors=np.zeros(0))
    assert at_drive_of(beside, [fit]) == ()


def test_each_term_is_left_out_at_the_better_drive():
    """Faults caught: the drive that leaves more, a term that is never left out, a set of one that becomes none."""
    rows = noisy(6)
    base = CartesianModel.of(load_study(drive="csf-25-80").drive)
    problem = FitProblem(rows, base, np.ones((len(rows), 1)), Noise.white(rows, 0.02))
    terms = [
        problem.explanations["output_coupling"].term(rows, {"shaft": "output", "orders": (2,)}),
        problem.explanations["channel_delay"].term(replace(rows, speed=np.sin(rows.theta)), {}),
    ]
    fit = evaluate(problem, 0.0 * problem.prior, np.zeros(1), terms, [np.zeros(2), np.zeros(1)])
    worse, better = (SimpleNamespace(problem=problem, errors=size * problem.prior) for size in (2.0, 0.0))
    for ripple, start in ((worse, fit), (better, at_drive_of(better, [fit])[0])):
        found = each_left_out((fit, *at_drive_of(ripple, [fit])))
        assert [one.terms for one in found] == [(terms[1],), (terms[0],)]
        assert all(np.array_equal(one.errors, start.errors) for one in found)
    alone = evaluate(problem, fit.errors, np.zeros(1), terms[:1], [np.zeros(2)])
    assert each_left_out((alone, *at_drive_of(better, [alone]))) == each_left_out(()) == []
    far = evaluate(problem, 2.0 * problem.prior, np.zeros(1), terms, [np.zeros(2), np.zeros(1)])
    assert not any(one.errors.any() for one in each_left_out((far, *at_drive_of(better, [far]))))


def test_noise_is_measured_beside_what_was_not_taken_out():
    """Faults caught: the mesh free again beside rows that are rid of it, what stands beside it left out too, an
    encoder's first cycle left out where its second was taken out."""
    rows = noisy(6)
    problem = FitProblem(rows, None, np.ones((len(rows), 1)), Noise.white(rows, 0.02))
    mesh = problem.explanations["tooth_mesh"].term(rows, {"sidebands": (0,)})
    other = problem.explanations["output_coupling"].term(rows, {"shaft": "output", "orders": (2,)})
    fit = evaluate(problem, np.zeros(0), np.zeros(1), [mesh, other], [np.ones(2), np.array([0.1, 0.2])])
    assert without_effects_of(SimpleNamespace(terms=[mesh]), fit).terms == (other,)
    assert without_effects_of(SimpleNamespace(terms=[]), fit).terms == (mesh, other)
    shape = {"lines": 8, "shaft": Shaft.INPUT, "cycles": (1,)}
    lines = problem.explanations["encoder_interpolation"].term(rows, shape)
    fit = evaluate(problem, np.zeros(0), np.zeros(1), [lines, other], [np.ones(2), np.array([0.1, 0.2])])
    assert without_effects_of(SimpleNamespace(terms=[lines]), fit).terms == (lines, other)


@pytest.mark.parametrize(("base", "power"), [("a base", 0.0), (None, SIZE**2 / 2)])
def test_a_ripple_in_the_zones_leaves_what_the_means_of_samples_hold_of_it(base, power):
    """A wave that the means of samples take out. Faults caught: its power in the samples counted inside the zones, or
    in their means beside the zones, where what it does to these is no part of it."""
    theta = np.arange(60000) * TURN / 1500
    frame = {"input_angle_deg": np.degrees(theta), "output_angle_deg": np.degrees(theta) / 80}
    recordings = [recording_from_table(pd.DataFrame(frame), 80.0)]
    count = neighbours_for(recordings)
    assert count > 2
    wave = SIZE * np.sin(TURN * np.arange(len(theta)) / count)
    ripple = SimpleNamespace(problem=SimpleNamespace(base=base))
    row = row_of_each_sample(recordings, count)
    assert power_in_rows(wave, ripple, row) == pytest.approx(power, abs=1e-9)
    slow = np.sqrt(2) * SIZE * np.sin(theta)
    assert power_in_rows(slow, ripple, row) == pytest.approx(SIZE**2, rel=1e-2)


@pytest.mark.parametrize(
    ("in_zones", "left", "stand"), [(True, 2.0, True), (True, 0.5, False), (False, 2.0, False), (True, None, True)]
)
def test_a_ripple_in_the_zones_stands_where_a_second_look_leaves_more(in_zones, left, stand):
    """Fault caught: the worse of two minima kept because it came last."""

    def found(size, zones):
        fit = SimpleNamespace(terms=[SimpleNamespace(in_zones=zones)], residual=size * np.array([-1.0, 1.0]))
        return SimpleNamespace(best=SimpleNamespace(fit=fit))

    anew = None if left is None else found(left, False)
    assert stands(found(1.0, in_zones), anew) is stand
    assert not stands(None, anew)
