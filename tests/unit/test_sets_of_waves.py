"""Sets of waves round a rim or a ring of balls: the set that a search offers holds the waves that are there."""

from dataclasses import replace

import numpy as np
import pytest
from test_cross_validation import noisy

from hdopt.diagnosis.inference.descent import refine
from hdopt.diagnosis.inference.fit import FitProblem, evaluate
from hdopt.diagnosis.inference.noise import Noise
from hdopt.diagnosis.inference.residual_gains import FitProbe
from hdopt.effects import EFFECTS
from hdopt.effects.bearing_pass import ZONE_HARMONICS, zone_orders
from hdopt.effects.cs_tooth_harmonics import RUNS
from hdopt.effects.estimate import FitEstimate
from hdopt.effects.term import Term
from hdopt.kinematics.cartesian import CartesianModel
from hdopt.study import load_study

NOISE = 0.02
SIZE_MM = 1e-4
"""Half of what grows with it shows: sizes beyond bend the drive, and waves of another number come with them."""
ROWS = noisy(40, NOISE)


def offered(effect, *there):
    """The terms that the search of `effect` offers for rows of its own terms, each a shape and its coefficients (mm) by
    column, beside a drive and white noise."""
    base = CartesianModel.of(load_study(drive="csf-25-80").drive)
    problem = FitProblem(ROWS, base, np.ones((len(ROWS), 1)), Noise.white(ROWS, NOISE))
    terms = [problem.explanations[effect].term(ROWS, shape) for shape, _ in there]
    sizes = [np.array(size_by_column) for _, size_by_column in there]
    drive = np.random.default_rng(7).normal(0, 6e-3, 12)
    model = ROWS.error - evaluate(problem, drive, np.zeros(1), terms, sizes).residual
    problem = replace(problem, rows=replace(ROWS, error=model + ROWS.error))
    bare = refine(evaluate(problem, drive, np.zeros(1), (), ()), 10)
    return EFFECTS[effect].search(FitProbe(bare))


def last_alone(width, waves=2):
    """Coefficients of a set of waves of which so many, the last, are there."""
    return np.r_[np.zeros(width - 2 * waves), SIZE_MM * np.random.default_rng(2).uniform(0.5, 1.0, 2 * waves)]


@pytest.mark.parametrize("waves", [one for one in ZONE_HARMONICS if len(one) > 2], ids=len)
def test_a_bearing_is_offered_with_its_waves_however_few_show_before_them(waves):
    """The upper half of each set: two waves alone are those of several bearings. Fault caught: sets looked at in their
    order, and no more where two of them did not pay; the two after the first are no larger, and a bearing of waves from
    the third on was never offered. And sets that pay nothing for their waves, of which the widest explains most."""
    shape = {"ball_to_pitch_ratio": 0.12, "balls": 0, "zones": waves}
    terms = offered("bearing_pass", (shape, last_alone(2 * len(waves), len(waves) // 2)))
    found = next(term for term in terms if "zones" in term.shape)
    assert set(waves[-2:]) <= set(zone_orders(found.shape))
    assert len(zone_orders(found.shape)) <= len(waves) + 1
    assert found.shape["ball_to_pitch_ratio"] == pytest.approx(0.12, abs=2e-3)


def test_many_waves_are_offered_beside_a_stronger_one_of_another_bearing():
    """One strong line is a wave of some bearing. Fault caught: sets looked for at the one ratio that explains most, at
    which a wave stood alone that nothing may be named by, and the bearing that is there was never offered."""
    waves = ZONE_HARMONICS[5]
    many = {"ball_to_pitch_ratio": 0.086, "balls": 0, "zones": waves}
    alone = {"ball_to_pitch_ratio": 0.206, "balls": 0, "zones": (2,)}
    terms = offered("bearing_pass", (many, last_alone(2 * len(waves), 10)), (alone, [3 * SIZE_MM, 3 * SIZE_MM]))
    ratios = [term.shape["ball_to_pitch_ratio"] for term in terms if "zones" in term.shape]
    assert ratios[0] == pytest.approx(0.206, abs=2e-3)
    assert any(ratio == pytest.approx(0.086, abs=2e-3) for ratio in ratios)


@pytest.mark.parametrize("effect", ["cs_tooth_harmonics", "fs_tooth_harmonics"])
@pytest.mark.parametrize("last", [run[-1] for run in RUNS if 3 < run[-1] < 0.4 * ROWS.rows_per_turn])
def test_waves_of_the_teeth_are_offered_however_few_show_before_them(effect, last):
    """Faults caught: runs looked at in their order, and no more where two of them did not pay, so that waves 13 and 14
    alone were never offered; the longest runs left out."""
    members = tuple(range(2, last + 1))
    terms = offered(effect, ({"members": members}, last_alone(2 * len(members))))
    assert any(set(members[-2:]) <= set(term.shape["members"]) for term in terms)


@pytest.mark.parametrize(
    ("sizes", "counted"),
    [
        ({18: 0.9, 20: 2.0}, 20),  # over every wave from the tenth on
        ({18: 1.1, 20: 2.0}, None),  # one of those is larger than half of it
        ({3: 9.0, 9: 9.0, 20: 2.0}, 20),  # what unlike balls do slowly does not count
        ({3: 9.0, 10: 9.0, 20: 2.0}, 10),  # ten balls have a second wave
        ({6: 2.0}, None),  # no bearing has six balls
        ({}, None),
    ],
)
def test_balls_are_counted_among_many_waves_where_theirs_stands_out(sizes, counted):
    """Waves that are 0.01 um in noise of 0.1 um otherwise. Faults caught: the last wave taken for that of the balls, a
    wave counted that is noise, slow waves of unlike balls held against it, the first that stands out, no number below
    the last."""
    waves = ZONE_HARMONICS[-1]
    values = 1e-5 * np.ones(2 * len(waves) + 1)
    values[[2 * (h - 1) for h in sizes]] = 1e-3 * np.array(list(sizes.values()))
    shape = {"ball_to_pitch_ratio": 0.12, "balls": 0, "zones": waves}
    term = Term("bearing_pass", shape, zones=np.zeros((2, 3, 2 * len(waves))))
    found = EFFECTS["bearing_pass"].parameters(term, FitEstimate(values, 1e-8 * np.eye(len(values))))
    assert ("balls" in found) == (counted is not None)
    assert counted is None or found["balls"].value == counted
    unsure = EFFECTS["bearing_pass"].parameters(term, FitEstimate(values, 1e-5 * np.eye(len(values))))
    assert "balls" not in unsure


def test_balls_that_were_looked_for_are_counted_by_their_own_wave():
    """Fault caught: the last of the waves taken for that of the balls where a set holds it."""
    shape = {"ball_to_pitch_ratio": 0.12, "balls": 7, "zones": ZONE_HARMONICS[5]}
    term = Term("bearing_pass", shape, zones=np.zeros((2, 3, 20)))
    for wave, counted in ((7, True), (10, False)):
        values = 1e-3 * np.ones(21)
        values[2 * (wave - 1)] = 3e-3
        found = EFFECTS["bearing_pass"].parameters(term, FitEstimate(values, 1e-12 * np.eye(21)))
        assert ("balls" in found) == counted
