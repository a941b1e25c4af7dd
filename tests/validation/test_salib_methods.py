"""SALib's methods through hdopt: the Ishigami function's published indices, and the same numbers as SALib alone."""

import numpy as np
import pytest

from hdopt.errors import HdoptError
from hdopt.tolerance.copula import CorrelationGroup
from hdopt.tolerance.distributions import Normal, Uniform
from hdopt.tolerance.results import SobolResult
from hdopt.tolerance.screening import METHODS, run_screening, salib_problem
from hdopt.tolerance.sensitivity import run_sobol
from hdopt.tolerance.space import InputSpace, Tolerance

NAMES = ("x1", "x2", "x3")
SPACE = InputSpace({name: Tolerance(Uniform(lower=-np.pi, upper=np.pi)) for name in NAMES})


def ishigami(x):
    """Ishigami and Homma (1990), a = 7, b = 0.1."""
    return np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


FIRST = {"x1": 0.3139, "x2": 0.4424, "x3": 0.0}
TOTAL = {"x1": 0.5576, "x2": 0.4424, "x3": 0.2437}
"""Exact indices of the Ishigami function (Saltelli et al. 2008, Global Sensitivity Analysis, Sec. 4.6)."""


def test_rbd_fast_gives_the_first_order_indices():
    found = run_screening(ishigami, SPACE, "rbd_fast", n=4096, engine="process")
    for name, exact in FIRST.items():
        # about 1/sqrt(n) of noise, and what is left of the bias of 10 harmonics
        assert found.inputs[name]["S1"] == pytest.approx(exact, abs=0.03)


def test_dgsm_is_no_less_than_the_total_index():
    found = run_screening(ishigami, SPACE, "dgsm", n=1024, engine="process")
    assert all(found.inputs[name]["dgsm"] >= total for name, total in TOTAL.items())


def test_morris_and_pawn_find_the_input_that_does_nothing():
    def idle(x):
        return ishigami(np.column_stack([x[:, 0], x[:, 1], 0 * x[:, 2]]))

    morris = run_screening(idle, SPACE, "morris", engine="process").inputs
    assert morris["x3"]["mu_star"] == pytest.approx(0, abs=1e-9) and min(morris[x]["mu_star"] for x in ("x1", "x2")) > 1
    pawn = run_screening(idle, SPACE, "pawn", n=2048, engine="process").inputs
    assert pawn["x3"]["median"] < 0.5 * min(pawn[name]["median"] for name in ("x1", "x2"))


def test_the_numbers_and_objects_are_salibs_own():
    from SALib.analyze import morris

    found = run_screening(ishigami, SPACE, "morris", seed=4, engine="process")
    alone = morris.analyze(salib_problem(SPACE), found.X, found.Y, seed=4)
    for name, mu_star in zip(NAMES, alone["mu_star"], strict=True):
        assert found.inputs[name]["mu_star"] == mu_star
    assert ishigami(np.pi * (2 * found.X - 1)) == pytest.approx(found.Y, abs=1e-9)
    assert list(found.to_salib().to_df()["mu_star"]) == list(alone["mu_star"])
    assert list(found.to_frame().index) == list(NAMES)


def test_open_ends_stay_finite():
    space = InputSpace({"x": Tolerance(Normal(std=1.0)), "y": Tolerance(Normal(std=1.0, lower=-2.0, upper=2.0))})
    assert salib_problem(space)["bounds"] == [[0.001, 0.999], [0.0, 1.0]]
    found = run_screening(lambda x: x.sum(axis=1), space, "morris", n=128, engine="process")
    assert np.abs(found.Y).max() < 3.1 + 2.0  # the 0.1 % point of a normal input is at -3.09


def test_correlated_inputs_are_refused_where_independence_is_needed():
    group = CorrelationGroup(("x1", "x2"), [[1, 0.5], [0.5, 1]])
    space = InputSpace(SPACE.tolerances, (group,))
    for method in (name for name, method in METHODS.items() if method.independent):
        with pytest.raises(HdoptError, match=f"{method} takes independent inputs"):
            run_screening(ishigami, space, method)
    assert run_screening(ishigami, space, "pawn", n=512, engine="process").inputs
    with pytest.raises(HdoptError, match="unknown sensitivity method 'moris'; did you mean 'morris'"):
        run_screening(ishigami, SPACE, "moris")
    with pytest.raises(HdoptError, match="n is 10, too small for delta; take at least 128"):
        run_screening(ishigami, SPACE, "delta", n=10)


def test_sobol_indices_are_salibs_result_too():
    """The same keys, shapes and tables as SALib's own analysis, which sees the same function; the numbers are ours."""
    from SALib.analyze import sobol as analysis
    from SALib.sample import sobol as sampler

    problem = salib_problem(SPACE)
    theirs = analysis.analyze(problem, ishigami(np.pi * (2 * sampler.sample(problem, 4096, seed=1) - 1)), seed=1)
    found = run_sobol(ishigami, SPACE, n=2**15, engine="process")
    ours = SobolResult("ishigami", found).to_salib()
    assert type(ours) is type(theirs) and list(ours) == list(theirs)
    for key in theirs:
        assert np.isnan(ours[key]).tolist() == np.isnan(theirs[key]).tolist()
        # their own intervals of 4096 base points are up to 0.1 wide
        assert ours[key] == pytest.approx(theirs[key], abs=0.1, nan_ok=True)
    for our, their in zip(ours.to_df(), theirs.to_df(), strict=True):
        assert our.index.tolist() == their.index.tolist() and our.columns.tolist() == their.columns.tolist()
    for i, (name, index) in enumerate(found.inputs.items()):
        assert name == NAMES[i]
        assert (ours["S1"][i], ours["ST"][i]) == (index.S1.value, index.ST.value)
        assert ours["ST_conf"][i] == pytest.approx(index.ST.high - index.ST.value, rel=1e-9)
    for (a, b), pair in found.second.items():
        assert ours["S2"][NAMES.index(a), NAMES.index(b)] == pair.value
    assert ours.plot() is not None
    with pytest.raises(HdoptError, match="SALib has no Shapley effects"):
        SobolResult("none").to_salib()
