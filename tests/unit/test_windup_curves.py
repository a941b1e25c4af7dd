"""The windup's curve where it bends smoothly, and where a curve that bends varies over the turn too."""

from dataclasses import fields

import numpy as np
import pytest

from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.effects import EFFECTS
from hdopt.effects.estimate import FitEstimate
from hdopt.effects.torsional_windup import smooth_windup
from hdopt.recordings.rows import Rows
from tests.unit.test_effect_physics import added, moving

WINDUP = EFFECTS["torsional_windup"]
CURVES = {
    "one knee": {"stiffness_1_nm_per_rad": 31000.0, "stiffness_2_nm_per_rad": 52000.0, "knee_1_nm": 7.3},
    "two knees": {
        "stiffness_1_nm_per_rad": 31000.0,
        "stiffness_2_nm_per_rad": 52000.0,
        "stiffness_3_nm_per_rad": 90000.0,
        "knee_1_nm": 4.7,
        "knee_2_nm": 13.1,
    },
    "smooth": {"stiffness_1_nm_per_rad": 31000.0, "hardening_torque_nm": 6.1},
}
TURNING = {"variation_over_turn": 0.2, "variation_phase_deg": 40.0}


@pytest.mark.parametrize("torque", [-300.0, -2.0, 0.0, 1e-6, 5.0, 80.0])
def test_a_smooth_curve_is_the_springs_inverse(torque):
    """T = y + y^3 / Th^2 of the linear part's torque y, in Nm."""
    y = smooth_windup(np.array([torque]), 6.1)[0]
    assert y + y**3 / 6.1**2 == pytest.approx(torque, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
def test_a_curve_that_bends_varies_as_a_whole(curve):
    """Would catch a variation of the first stretch alone, and one that adds to the torque instead of the windup."""
    c = moving()
    turn = 1 + 0.2 * np.sin(2 * c.theta + np.radians(40))
    assert added(WINDUP.id, {**curve, **TURNING}, c) == pytest.approx(added(WINDUP.id, curve, c) * turn)


def fit_of(conditions, hidden, terms=()):
    """`hidden` (n,), arcmin, as a recording without noise: an offset and the `terms`, not yet moved."""
    own = {one.name: getattr(conditions, one.name) for one in fields(conditions)}
    n = len(conditions)
    rows = Rows(**own, error=hidden, block=np.arange(n) // 120, weight=np.ones(n), quantum=0.0)
    problem = FitProblem(rows, None, np.ones((n, 1)), Noise(np.zeros(0), 0.01, np.ones(n)))
    return evaluate(problem, np.zeros(0), np.zeros(1), terms, [np.zeros(term.width) for term in terms])


@pytest.mark.parametrize("varied", [{}, TURNING], ids=["as it is", "over the turn"])
@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
def test_the_search_offers_what_a_fit_makes_the_curve_of(curve, varied):
    """From one of its terms a fit comes to a thousandth of the windup and to the numbers put in, by their names. Would
    catch a search that offers no smooth curve, or none that bends and turns at once.
    """
    c = moving()
    said = {**curve, **varied}
    hidden = added(WINDUP.id, said, c)
    offered = WINDUP.search(FitProbe(refine(fit_of(c, hidden), 2)))
    fits = [refine(fit_of(c, hidden, [term]), 20) for term in offered]
    there = [fit for fit in fits if np.std(fit.residual) < 1e-3 * np.std(hidden)]
    best = min(there, key=lambda fit: fit.terms[0].freedom)
    shape = best.terms[0].shape
    found = WINDUP.keys(shape, best.coefficients[0], None)
    assert {name: found[name] for name in said} == pytest.approx(said, rel=0.01)
    values = np.array([*best.coefficients[0], *(shape[name] for name in best.terms[0].steps)])
    estimate = FitEstimate(values, np.zeros((len(values), len(values))))
    told = {name: p.value for name, p in WINDUP.parameters(best.terms[0], estimate).items()}
    names = {item.key: item.name for item in WINDUP.flat_declared()}
    assert told == pytest.approx({names[k]: v for k, v in said.items() if k != "variation_phase_deg"}, rel=0.01)
