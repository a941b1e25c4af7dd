"""The tail of the shipped drive against 1e8 plain samples, renewed by `python tests/regression/brute_force_tail.py`."""

import json
from pathlib import Path

import pytest

from hdopt.tolerance.intervals import clopper_pearson
from hdopt.tolerance.tail import tail_probability
from hdopt.workflow.stack import study_problem

BRUTE_FORCE = json.loads((Path(__file__).parent / "brute_force_tail.json").read_text())


def test_subset_simulation_agrees_with_brute_force():
    problem = study_problem("csf-25-80")
    result = tail_probability(
        problem.response, problem.space, BRUTE_FORCE["limit_arcmin"], seed=0, level_size=8000, replicates=12
    )
    counted = clopper_pearson(BRUTE_FORCE["beyond"], BRUTE_FORCE["n"])
    assert result.low <= counted.high and counted.low <= result.high
    assert result.probability == pytest.approx(counted.value, rel=0.25)  # the interval's half width is about 8 %
    assert result.evaluations < BRUTE_FORCE["n"] / 100
