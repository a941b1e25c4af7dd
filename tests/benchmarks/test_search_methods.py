"""Why SLSQP, and why DIRECT-L starts it: all methods on the trade study's own problems.

`python -m pytest tests/benchmarks/test_search_methods.py -s` prints the tables.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from hdopt.drive.geometry import Structure
from hdopt.optimize.design_space import Combination
from hdopt.optimize.minimax import GLOBAL, LOCAL, PENALTY, explore, minimise
from hdopt.optimize.nlopt_adapter import Effort
from hdopt.study import load_study
from hdopt.workflow.search_setup import setup_of

pytestmark = pytest.mark.slow

PROFILES = ("ellipse", "resal", "two_disk")
LOCALS = ("LD_SLSQP", "LD_MMA", "LD_CCSAQ", "LN_COBYLA")
GLOBALS = ("GN_DIRECT_L", "GN_CRS2_LM", "GN_ISRES", "GN_ESCH")
STARTS = 3
REACHED = 1e-4
"""Within this share of the best value any method found."""


@cache
def problem(profile: str):
    setup = setup_of(load_study("csf-25-80-design-trade", ("search.robust=false",)), seed=1)
    return setup.problem(Combination(profile, Structure.AUTOMATIC), "peak_to_peak_arcmin")


def test_the_local_method_misses_nothing_and_needs_the_fewest_evaluations(request):
    """In the test suite the others end soon after the local method's median: it is the least all the same."""
    in_a_run = not request.config.getoption("benchmark_disable")
    table, most = {}, 400
    for algorithm in (LOCAL, *(name for name in LOCALS if name != LOCAL)):
        evaluations, missed = [], 0
        for profile in PROFILES:
            at = problem(profile)
            best = minimise(at, at.place(at.space.baseline_values)).evaluation.objective
            for start in np.random.default_rng(1).random((STARTS, at.n)):
                outcome = minimise(at, start, algorithm, Effort(evaluations=most))
                evaluations.append(outcome.evaluations)
                missed += not (outcome.feasible and outcome.evaluation.objective <= best * (1 + REACHED))
        table[algorithm] = (float(np.median(evaluations)), missed)
        most = 400 if in_a_run else int(1.5 * table[LOCAL][0])
    print()
    for algorithm, (median, missed) in table.items():
        print(f"{algorithm:10s} median {median:5.0f} evaluations, missed {missed} of {STARTS * len(PROFILES)}")
    assert table[LOCAL][1] == 0
    assert table[LOCAL][0] < min(median for name, (median, _) in table.items() if name != LOCAL)


@pytest.mark.xfail(
    strict=False,
    reason="since pressure and face follow the width, DIRECT's start is the worst of four for one profile: 1.70 of the "
    "optimum after 150 evaluations, where the others have 1.12 to 1.68; every one leads to a feasible optimum",
)
def test_the_global_method_gives_starts_that_are_no_worse_than_the_others_median():
    print()
    for profile in PROFILES:
        at = problem(profile)
        merit = {}
        for algorithm in GLOBALS:
            found = explore(at, algorithm, Effort(evaluations=150))
            best = minimise(at, found.u)
            assert best.feasible
            merit[algorithm] = found.evaluation.objective / best.evaluation.objective
            merit[algorithm] += PENALTY * found.evaluation.violation
            print(f"{profile:10s} {algorithm:12s} start at {merit[algorithm]:.3f} of the optimum")
        assert merit[GLOBAL] <= np.median(list(merit.values()))
