"""A search whose quantile is over drives with teeth drawn from tolerances of pitch."""

from dataclasses import replace

import numpy as np
import pytest

from hdopt.errors import HdoptError
from hdopt.optimize.objectives import ROBUST, find_quantity
from hdopt.study import load_study
from hdopt.tolerance.sampling import ScrambledSobol
from hdopt.workflow.search import _notes
from hdopt.workflow.search_setup import setup_of
from hdopt.workflow.search_verification import quantile_blocks
from hdopt.workflow.stack import drive_problem_of

N = 256
SMALL = (
    'search.profiles=["two_disk"]',
    'search.structures=["automatic"]',
    f"search.samples={N}",
    "search.quantile=0.9",
    "tolerances.cs_teeth={iso_1328_class=7}",
    "tolerances.fs_teeth={single_pitch_um=4, cumulative_pitch_um=14}",
)


@pytest.fixture(scope="module")
def study():
    return load_study("csf-25-80-design-trade", SMALL)


@pytest.fixture(scope="module")
def setup(study):
    return setup_of(study, 3)


def test_the_quantile_is_that_of_a_stack_of_the_same_drives(study, setup):
    """Against the stack's own response: would catch teeth of another row, of the other spline, or none."""
    problem = drive_problem_of(study)
    inputs = problem.space.sample(next(ScrambledSobol(1).blocks(3, 0, N, problem.space.dimension)))
    spans = replace(problem.response, drive=setup.baseline.drive, homogenization=1.0)(inputs)
    found = find_quantity(ROBUST).value(setup.trade, setup.baseline)
    assert found == pytest.approx(setup.trade.weights @ np.sort(spans), abs=1e-9)
    bare = replace(setup.trade, teeth=None)
    assert find_quantity(ROBUST).value(bare, setup.baseline) < 0.8 * found


def test_slopes_are_those_of_wide_differences(setup):
    """Common random numbers: would catch teeth that are drawn anew for a neighbour, and slopes of drives without
    theirs."""
    problem = setup.problem(setup.space.combinations[0], ROBUST)
    u = np.full(problem.n, 0.45)
    found, step = problem.evaluate(u), 1e-2
    for i in range(problem.n):
        wide = [problem.evaluate(u + sign * step * np.eye(problem.n)[i], slopes=False).objective for sign in (-1, 1)]
        # Drives change ranks within the step; 2 % of the largest slope, as without drawn teeth.
        error = abs(found.piece_slopes[0, i] - (wide[1] - wide[0]) / (2 * step))
        assert error < 0.02 * np.abs(found.piece_slopes).max()


def test_the_choice_is_verified_with_teeth(study, setup):
    """Fresh drives of a search, robust or not, have teeth too: without them the quantile lies a fifth below."""
    fresh = quantile_blocks(study, setup.baseline, 0.9, 4, setup.trade, 2048).mean()
    searched = find_quantity(ROBUST).value(setup.trade, setup.baseline)
    # 256 drives know their 0.9 quantile to 2 % (standard deviation over seeds 1 to 12); three times that.
    assert fresh == pytest.approx(searched, rel=0.06)


def test_what_the_search_rests_on_is_said(study):
    said = " ".join(_notes(study))
    assert "cs_teeth: single pitch" in said
    assert "the same teeth in every design" in said


def test_a_changing_number_of_teeth_is_refused():
    with pytest.raises(HdoptError, match="set search.size=fixed_tooth_counts, or give tooth amplitudes"):
        setup_of(load_study("csf-25-80-design-trade", [*SMALL, 'search.size="fixed_outside_diameter"']), 1)
